"""What commands print: plain text or JSON on stdout; notes, warnings and progress on stderr."""

import contextlib
import json
import logging
import os
import shlex
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import typer

    from psvideo.report.run_report import RunReport
    from psvideo.report.takes_report import TakeResult
    from psvideo.runs.steps.caller import Caller

from psvideo.cli.options.clip_and_run import Json, Quiet, Verbose
from psvideo.cli.spelling import spelled, spelled_within
from psvideo.compute.compile_count import COMPILING

Item = TypeVar("Item")
PLAIN_PROGRESS_EVERY_S = 5.0


@contextlib.contextmanager
def libraries_aside(words: Sequence[str]) -> Iterator[None]:
    """In this block, what libraries print (OpenEXR a warning of damaged pixels) goes to stderr where ``words`` ask for
    JSON, so that standard output holds nothing else."""
    asked = "--json" in words and not {"-h", "--help"}.intersection(words)
    with contextlib.redirect_stdout(sys.stderr) if asked and sys.stdout is sys.__stdout__ else contextlib.nullcontext():
        yield


def print_json(text: str) -> None:
    """Print what machines read."""
    print(text, file=sys.__stdout__ if sys.stdout is sys.stderr else sys.stdout, flush=True)


@dataclass(frozen=True, kw_only=True)
class Voice:
    """How much a command says, and to whom; parameters in sentences are spelled as options. ``warned`` is what it
    warned of so far."""

    json: Json = False
    verbose: Verbose = False
    quiet: Quiet = False
    warned: set[str] = field(default_factory=set, init=False)

    def say(self, text: str) -> None:
        """Print a line for people: on stdout, or nowhere where machines read stdout."""
        if not (self.json or self.quiet):
            print(spelled(text))

    def detail(self, text: str) -> None:
        """Print a line that only -v asks for."""
        if self.verbose:
            print(spelled(text), file=sys.stderr)

    def warn(self, text: str) -> None:
        """Print a warning on stderr, for people and machines alike."""
        sentence = spelled(text)
        self.warned.add(sentence)
        if not self.quiet:
            print(f"psvideo: warning: {sentence}", file=sys.stderr)

    def result(self, data: Mapping[str, object]) -> None:
        """Print the machine-readable result, where --json asked for it: one object, all that stdout gets."""
        if self.json:
            print_json(json.dumps(spelled_within(data), indent=1))

    def track(self, items: Iterable[Item], *, total: int, what: str, unit: str = "frames") -> Iterator[Item]:
        """Pass items through and show progress with rate and time left: a bar on a terminal, plain lines elsewhere."""
        if self.quiet:
            yield from items
        elif sys.stderr.isatty() and os.environ.get("TERM") != "dumb":
            yield from _bar(items, total, what, unit)
        else:
            yield from _lines(items, total, what, unit)

    def caller(self, context: "typer.Context | None" = None) -> "Caller":
        """Return what a run is called with, so that its sentences come here, and its report holds what was typed."""
        from psvideo.runs.steps.caller import Caller

        command = "" if context is None else command_line(context)
        return Caller(say=self.say, warn=self.warn, detail=self.detail, spell=spelled, command=command)


SLOWEST_RATE = 0.1
"""Items a second below which the time that each takes is said."""
KEPT = (
    "psvideo: compiling, once: those loops of this run that no run before it needed, for this processor, which takes "
    "up to a minute or two. They are kept for all later runs; other commands and other kinds of footage may need more. "
    "psvideo doctor --compile does it ahead for usual runs."
)
LOST = (
    "psvideo: compiling this run's loops for this processor, which takes a minute or two, and will again in every run: "
    "neither psvideo's own folder nor one in your home can be written. Set NUMBA_CACHE_DIR to a folder that can be, "
    "and they are kept there."
)


class _Once(logging.Handler):
    """Says once that loops are being compiled, however many there are."""

    def emit(self, record: logging.LogRecord) -> None:
        print(LOST if getattr(record, "lost", False) else KEPT, file=sys.stderr)
        self.setLevel(logging.CRITICAL)


@contextlib.contextmanager
def compiling_said(*, quiet: bool) -> Iterator[None]:
    """In this block, say on stderr when loops are compiled rather than loaded: that takes long, and shows nothing."""
    if quiet:
        yield
        return
    once, before = _Once(), COMPILING.level
    COMPILING.addHandler(once)
    COMPILING.setLevel(logging.INFO)
    try:
        yield
    finally:
        COMPILING.removeHandler(once)
        COMPILING.setLevel(before)


def command_line(context: "typer.Context") -> str:
    """Return the command as it was typed, quoted for a shell; empty where nobody typed one."""
    words = context.find_root().obj
    return shlex.join(["psvideo", *words]) if isinstance(words, list) else ""


def print_report(voice: Voice, report: "RunReport") -> None:
    """Say whether the take is usable, and warn of all that speaks against it and was not said while it was read."""
    voice.say(report.verdict)
    for sentence in report.findings:
        if spelled(sentence) not in voice.warned:
            voice.warn(sentence)


def print_takes(voice: Voice, results: "Sequence[TakeResult]") -> None:
    """Say what became of several takes, the worst first, and end with a fault where one could not be used."""
    import typer

    from psvideo.report.takes_report import takes_record

    voice.result(takes_record(results))
    for one in results:
        voice.say(f"{one.out}: {one.fault or one.verdict}")
    if any(one.fault for one in results):
        raise typer.Exit(1)


def plain(words: "Sequence[Item] | None") -> "list[Item]":
    """Return the words of an option that may be given several times, as plain text and each once."""
    return [getattr(word, "value", word) for word in dict.fromkeys(words or ())]


def _bar(items: Iterable[Item], total: int, what: str, unit: str) -> Iterator[Item]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    rate = TextColumn("{task.fields[rate]}")
    columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), rate, TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(what, total=total, rate="…")
        for item in items:
            yield item
            speed = progress.tasks[0].speed
            progress.update(task, advance=1, rate=_rate(speed, unit) if speed else "…")


def _lines(items: Iterable[Item], total: int, what: str, unit: str) -> Iterator[Item]:
    """Say how far a step is now and then. Its first item may wait for loops to be compiled, and tells no rate."""
    first = said = time.monotonic()
    for count, item in enumerate(items, start=1):
        yield item
        now = time.monotonic()
        first = now if count == 1 else first
        if now - said >= PLAIN_PROGRESS_EVERY_S and count < total:
            print(
                f"{what}: {count} of {total} {unit}{_pace(count - 1, now - first, total - count, unit)}",
                file=sys.stderr,
            )
            said = now


def _pace(done: int, seconds: float, left: int, unit: str) -> str:
    """Return the rate of what was done and the time for what is left; nothing where nothing tells."""
    if done < 1 or seconds <= 0:
        return ""
    rate = done / seconds
    return f", {_rate(rate, unit)}, {left / rate:.0f} s left"


def _rate(rate: float, unit: str) -> str:
    """Return how fast items come; of slow ones how long each takes, since 0.0 a second says nothing."""
    return f"{rate:.1f} {unit}/s" if rate >= SLOWEST_RATE else f"{1 / rate:.0f} s each"
