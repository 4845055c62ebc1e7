"""What commands print where: a bar on a terminal, plain lines elsewhere, colour only where somebody sees it."""

import os
import pty
import re
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, cast

import pytest

from psvideo.cli import console
from psvideo.cli.console import Voice

if TYPE_CHECKING:
    from psvideo.report.run_report import RunReport

ENTRY = "import sys; from psvideo.cli.app import main; sys.exit(main())"
COLOUR = re.compile(r"\x1b\[(?:[0-9;]*;)?(?:3[0-7]|9[0-7]|38;[25])[0-9;]*m")
SLOW = (
    "import time\nfrom psvideo.cli.console import Voice\n"
    "for _ in Voice().track(range(40), total=40, what='solving', unit='results'): time.sleep(0.03)\nprint('done')"
)


def on_a_terminal(code: str, *words: str, **environment: str) -> str:
    """Run Python on a terminal of 120 columns and return all that appeared there."""
    ours, theirs = pty.openpty()
    settings = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "120", **environment}
    for name in ("NO_COLOR", "FORCE_COLOR"):
        if name not in environment:
            settings.pop(name, None)
    with subprocess.Popen([sys.executable, "-c", code, *words], stdout=theirs, stderr=theirs, env=settings) as child:
        os.close(theirs)
        seen = b"".join(_read(ours))
        child.wait(60)
    os.close(ours)
    return seen.decode()


def _read(terminal: int) -> Iterator[bytes]:
    while select.select([terminal], [], [], 60)[0]:
        try:
            block = os.read(terminal, 4096)
        except OSError:  # the other end was closed
            return
        if not block:
            return
        yield block


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_terminal_sees_a_bar_with_rate_and_time_left() -> None:
    seen = on_a_terminal(SLOW)
    assert "━" in seen
    rates = [float(rate) for rate in re.findall(r"([\d.]+) results/s", seen)]
    assert rates
    assert 5 < rates[-1] < 34, "40 results, each of 30 ms or more on a busy machine"
    assert re.search(r"0:00:\d\d", seen), "the time left"
    assert re.search(r"\b\d+/40\b", seen)
    assert seen.rstrip().endswith("done"), "the bar is gone when the work is done"


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
@pytest.mark.parametrize("environment", [{"NO_COLOR": "1"}, {"TERM": "dumb"}])
def test_no_colour_where_none_is_wanted(environment: dict[str, str]) -> None:
    assert not COLOUR.search(on_a_terminal(SLOW, **environment))
    assert not COLOUR.search(on_a_terminal(ENTRY, "sync", "--help", **environment))


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_terminal_has_colour() -> None:
    assert COLOUR.search(on_a_terminal(ENTRY, "sync", "--help"))


def test_a_pipe_sees_no_escape_sequence(tmp_path: Path) -> None:
    for words in (["--help"], ["normals", "--help"], ["sync", str(tmp_path)], ["sync", "--frobnicate"]):
        done = subprocess.run([sys.executable, "-c", ENTRY, *words], capture_output=True, text=True)
        assert "\x1b" not in done.stdout + done.stderr


def test_elsewhere_progress_is_a_plain_line_now_and_then(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(console, "PLAIN_PROGRESS_EVERY_S", 0.05)
    for _ in Voice().track(range(20), total=20, what="filming", unit="frames"):
        time.sleep(0.01)
    said = capsys.readouterr()
    lines = said.err.splitlines()
    assert said.out == ""
    assert 1 <= len(lines) <= 6, "not one for every frame"
    assert re.fullmatch(r"filming: \d+ of 20 frames, [\d.]+ frames/s, \d+ s left", lines[0])


def test_what_the_first_item_waits_for_is_not_expected_of_the_others(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Loops are compiled while the first item is worked on, which may take a minute."""
    clock = iter([0.0, 50.0, 51.0, 52.0, 60.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    list(Voice().track(range(4), total=10, what="filming"))
    assert capsys.readouterr().err.splitlines() == [
        "filming: 1 of 10 frames",
        "filming: 4 of 10 frames, 0.3 frames/s, 20 s left",
    ]


def test_of_what_takes_long_is_said_how_long_each_takes(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter([0.0, 50.0, 100.0, 150.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    list(Voice().track(range(3), total=10, what="compiling", unit="takes"))
    assert capsys.readouterr().err.splitlines()[-1] == "compiling: 3 of 10 takes, 50 s each, 350 s left"


def test_quiet_says_nothing_and_machines_get_no_text_on_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    quiet, machines = Voice(quiet=True), Voice(json=True)
    quiet.say("a")
    quiet.warn("b")
    list(quiet.track([1], total=1, what="c"))
    said = capsys.readouterr()
    assert said.out + said.err == ""
    machines.say("a")
    machines.result({"a": 1})
    assert capsys.readouterr().out == '{\n "a": 1\n}\n'


def test_what_was_warned_of_is_not_said_again_at_the_end(capsys: pytest.CaptureFixture[str]) -> None:
    @dataclass(frozen=True)
    class Judged:
        verdict: str = "This take is usable, with reservations."
        findings: tuple[str, ...] = ("8 bits cost accuracy", "Give more light, or `first_light`.")

    voice = Voice()
    voice.warn("8 bits cost accuracy")
    console.print_report(voice, cast("RunReport", Judged()))
    said = capsys.readouterr().err
    assert said.count("8 bits cost accuracy") == 1
    assert said.count("Give more light, or --first-light.") == 1
