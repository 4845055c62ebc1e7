"""How commands end before their time: signals, readers that are gone, machines that have no more to give."""

import ctypes
import errno
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

import psvideo
from psvideo.cli import app
from psvideo.cli.ending import ENDING, paragraph_on, stoppable
from psvideo.formats.whole_folders import whole_folder

ENDS_S = 2.9
"""The end of a process waits for threads for 3 s."""


@pytest.fixture(params=ENDING)
def number(request: pytest.FixtureRequest) -> Iterator[int]:
    """A signal that asks a program to end, obeyed whatever the tests were started by: nohup ignores SIGHUP."""
    asked = int(request.param)
    before = signal.signal(asked, signal.default_int_handler)
    yield asked
    signal.signal(asked, before)


def test_a_stop_that_is_asked_for_again_ends_nothing_once_its_command_has_ended(
    number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a busy machine it came so late: the command said that it had stopped, and its status was the signal's."""
    raised, raise_signal = threading.Event(), signal.raise_signal

    def raise_late(asked: int) -> None:
        raised.set()
        time.sleep(0.2)
        raise_signal(asked)

    def end() -> None:
        sys.unraisablehook(SimpleNamespace(exc_value=KeyboardInterrupt(number)))
        assert raised.wait(10)
        raise ValueError("for the stop's sake")

    monkeypatch.setattr(signal, "raise_signal", raise_late)
    with pytest.raises(KeyboardInterrupt), stoppable():
        end()
    time.sleep(0.4)  # here it would be heard


def test_what_asks_a_program_to_end_stops_it_as_ctrl_c_does(number: int) -> None:
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), stoppable():
        os.kill(os.getpid(), number)
    assert signal.getsignal(number) == before


def test_a_signal_that_is_ignored_stays_so(number: int) -> None:
    """As under nohup, which is there to let a run go on."""
    signal.signal(number, signal.SIG_IGN)
    with stoppable():
        os.kill(os.getpid(), number)
        assert signal.getsignal(number) is signal.SIG_IGN
    assert signal.getsignal(number) is signal.SIG_IGN


def test_a_stop_that_falls_into_a_call_back_from_c_is_a_stop_and_no_fault() -> None:
    called_back = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGTERM))

    def compile_and_keep() -> None:
        called_back()
        raise RuntimeError("no compiled object yet")

    with pytest.raises(KeyboardInterrupt), stoppable():
        compile_and_keep()
    with pytest.raises(RuntimeError), stoppable():
        raise RuntimeError("a fault of its own")


def test_signals_that_are_ignored_stay_so() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with stoppable():
            assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
            os.kill(os.getpid(), signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_second_signal_ends_a_command_at_once() -> None:
    script = (
        "import os, signal, time\nfrom psvideo.cli.ending import stoppable\nwith stoppable():\n try:\n"
        "  os.kill(os.getpid(), signal.SIGTERM)\n finally:\n  os.kill(os.getpid(), signal.SIGINT)\n  time.sleep(60)\n"
    )
    assert subprocess.run([sys.executable, "-c", script], timeout=30, check=False).returncode == 1


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (MemoryError("Unable to allocate 9 GiB"), "not enough memory (Unable to allocate 9 GiB)"),
        (ImportError("lib.so: failed to map segment from shared object"), "not enough memory"),
        (RuntimeError("can't start new thread"), "not enough memory"),
        (OSError(errno.EIO, "Input/output error", "/disk/a.exr"), "/disk/a.exr: cannot be read or written (Input/"),
    ],
)
def test_what_the_machine_refuses_is_said_in_one_paragraph(
    fault: Exception, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refused(words: list[str]) -> int:
        raise fault

    monkeypatch.setattr(app, "_ended", refused)
    assert app.main(["info", "clip"]) == 1
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_too_few_addresses_are_refused_at_once(capfd: pytest.CaptureFixture[str]) -> None:
    command = f"ulimit -v 700000; {sys.executable} -m psvideo.cli.app normals clip --rig rig.toml -o out"
    assert subprocess.run(command, shell=True, check=False, timeout=60).returncode == 1
    error = capfd.readouterr().err
    assert "this process may use 683 MB of addresses (ulimit -v), and psvideo needs 1200 MB at least" in error
    assert error.count("\n") == 1


def test_a_thread_that_gets_no_memory_for_taking_up_its_job_ends_the_command(capfd: pytest.CaptureFixture[str]) -> None:
    script = (
        "from concurrent.futures import Future, ThreadPoolExecutor\nfrom psvideo.cli import app\n"
        "def starve(self): raise MemoryError\n"
        "Future.set_running_or_notify_cancel = starve\n"
        "app._ended = lambda words: ThreadPoolExecutor(1).submit(print).result()\n"
        "app.main(['info', 'clip'])\n"
    )
    assert subprocess.run([sys.executable, "-c", script], timeout=60, check=False).returncode == 1
    error = capfd.readouterr().err
    assert "there is not enough memory" in error
    assert error.count("\n") == 1


def test_a_fault_of_the_program_is_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    assert paragraph_on(RuntimeError("generator raised StopIteration")) is None


def test_a_reader_that_is_gone_ends_a_command_without_a_word(capfd: pytest.CaptureFixture[str]) -> None:
    command = f"{sys.executable} -m psvideo.cli.app capture-plan --list | true"
    subprocess.run(command, shell=True, check=False, timeout=60)
    assert "Traceback" not in (error := capfd.readouterr().err)
    assert "Exception ignored" not in error


def test_no_run_asks_what_time_it_is() -> None:
    """So that a clock that jumps changes nothing; only the strobe's log holds it, and the day of a measurement."""
    root = Path(psvideo.__file__).parent
    asking = re.compile(r"\btime\.time\(|\b(datetime\.now|utcnow|localtime)\(")
    found = [path.relative_to(root) for path in root.rglob("*.py") if asking.search(path.read_text(encoding="utf-8"))]
    assert found
    assert all("strobe" in path.parts for path in found)


def test_a_command_may_be_stopped_twice_before_a_signal_ends_it_at_once() -> None:
    script = (
        "import os, signal, time\nfrom psvideo.cli.ending import stoppable\nwith stoppable(), stoppable(stops=2):\n"
        " for stop in range(3):\n  try:\n   os.kill(os.getpid(), signal.SIGINT)\n   time.sleep(60)\n"
        "  except KeyboardInterrupt:\n   print(stop, flush=True)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], timeout=30, check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (1, "0\n1\n")


def test_a_command_that_is_over_waits_for_no_thread_that_goes_on_beside_it() -> None:
    script = (
        "import sys, time\nfrom psvideo.cli import app\nfrom psvideo.compute.side_threads import run_beside\n"
        "def run(arguments):\n run_beside(lambda: time.sleep(60), name='compiling')\n"
        " print('said', end='')\n return 3\n"
        "app._run = run\nsys.exit(app.main())\n"
    )
    began_s = time.monotonic()
    done = subprocess.run([sys.executable, "-c", script], timeout=60, check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (3, "said")
    assert time.monotonic() - began_s < ENDS_S, "at the interpreter's own end it is waited for longer"


def test_a_stop_says_that_something_is_kept_only_where_something_was_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A run that was stopped while flashes were searched for said that what was finished is kept."""

    def stopped_after(*written: str) -> str:
        def run(_: object) -> int:
            with whole_folder(tmp_path / "out", mark="report.json", settings="these") as folder:
                for name in written:
                    (folder / name).write_bytes(b"x")
                raise KeyboardInterrupt

        monkeypatch.setattr(app, "_run", run)
        assert app.main([]) == 1
        return capsys.readouterr().err

    assert stopped_after() == "psvideo: stopped.\n"
    assert stopped_after(".normals.1001.exr.partial-12") == "psvideo: stopped.\n"
    assert stopped_after("normals.1001.exr") == (
        "psvideo: stopped. What was finished is kept; the same command with --resume goes on.\n"
    )
