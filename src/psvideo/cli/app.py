"""psvideo: the commands, assembled, and how faults become one paragraph and an exit status."""

import os
import shlex
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import compiling_said, libraries_aside
from psvideo.cli.ending import (
    check_addresses,
    leave_threads,
    nobody_reads,
    paragraph_on,
    say_any_name,
    starving_said,
    stoppable,
)
from psvideo.cli.first_screen import COMMANDS, Entry
from psvideo.cli.spelling import spelled
from psvideo.cli.teaching import PROGRAM, command_called, teach, words_typed
from psvideo.compute.heap import set_as_commands_do
from psvideo.errors import PsvideoError, UsageError, nearest

STOPPED = 130
"""What the command line library ends with when the user interrupts."""


def application(arguments: Sequence[str]) -> typer.Typer:
    """Return the commands as one program; only the one that is called is loaded, of the others one line is known."""
    app = typer.Typer(
        name=PROGRAM,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    )
    app.callback()(psvideo)
    called = command_called(arguments)
    for entry in COMMANDS:
        command = _loaded(entry) if entry.name == called else _not_loaded
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=entry.name, rich_help_panel=entry.panel)
        else:
            summary = entry.summary if command is _not_loaded else None
            app.command(entry.name, help=summary, rich_help_panel=entry.panel)(command)
    return teach(app)


def _loaded(entry: Entry) -> Callable[..., None] | typer.Typer:
    command: Callable[..., None] | typer.Typer = getattr(
        import_module(f"psvideo.cli.commands.{entry.word}"), entry.word
    )
    return command


def _not_loaded() -> None:
    """Stand for a command of which only its line in the list is asked for."""


def _print_version(wanted: bool) -> None:
    if wanted:
        from psvideo import __version__

        print(f"{PROGRAM} {__version__}")
        raise typer.Exit


def psvideo(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Say which version this is.")
    ] = False,
) -> None:
    """Normals and albedo for every instant, from strobed rolling-shutter video."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status: 0 done, 1 a fault of the footage or the run, 2 wrong usage.

    A fault is printed as one paragraph on stderr.
    """
    say_any_name()  # before signals are heard: a stream that is interrupted while it changes prints no more
    try:
        with stoppable():
            status = _run(arguments)
    except KeyboardInterrupt as stop:  # the command line library catches it only inside a command
        status = _stopped(stop)
    if arguments is None:  # this process is the command's own
        leave_threads(status)
    return status


def _words(arguments: Sequence[str] | None) -> list[str]:
    return words_typed(sys.argv[1:] if arguments is None else arguments, os.environ)


def _run(arguments: Sequence[str] | None) -> int:
    set_as_commands_do()
    words = _words(arguments)
    with compiling_said(quiet="-q" in words or "--quiet" in words), starving_said():
        try:
            with libraries_aside(words):
                return _ended(words)
        except (OSError, MemoryError, ImportError, RuntimeError) as fault:
            return _broken_off(fault)


def _ended(words: Sequence[str]) -> int:
    called = command_called(words)
    names = [entry.name for entry in COMMANDS]
    if called and called not in names and "_PSVIDEO_COMPLETE" not in os.environ:
        print(f"psvideo: {_no_command(called, names)}", file=sys.stderr)
        return UsageError.exit_status
    try:
        check_addresses()
        application(words)(args=words, prog_name=PROGRAM, obj=words)
    except PsvideoError as fault:
        print(f"psvideo: {spelled(str(fault))}", file=sys.stderr)
        return fault.exit_status
    except SystemExit as end:
        if end.code == STOPPED:
            return _stopped(end)
        return end.code if isinstance(end.code, int) else 0
    return 0


def _stopped(end: BaseException) -> int:
    """Say that a command was stopped, and what the run that was stopped noted on it: what is kept."""
    stop: BaseException | None = end
    noted = list[str]()
    while stop is not None:
        noted += getattr(stop, "__notes__", [])
        stop = stop.__cause__ or stop.__context__
    print(spelled(" ".join(["psvideo: stopped.", *dict.fromkeys(noted)])), file=sys.stderr)
    return PsvideoError.exit_status


def _broken_off(fault: Exception) -> int:
    """Say what the machine refused; a fault that is not the machine's goes on to where it is seen."""
    said = paragraph_on(fault)
    if said is None:
        raise fault
    if said:
        print(f"psvideo: {spelled(said)}", file=sys.stderr)
    else:
        nobody_reads()
    return PsvideoError.exit_status


def _no_command(word: str, names: Sequence[str]) -> str:
    """Say what to type instead of a word that is no command."""
    if Path(word).exists():
        return f"{word}: the command comes first. psvideo info {shlex.quote(word)} says what it is."
    return f"there is no command {word!r}; {nearest(word, names)} psvideo -h shows what each does."


if __name__ == "__main__":
    sys.exit(main())
