"""Runs that something stops leave nothing half-made, and go on to the same bytes."""

import os
import shutil
import signal
import sys
from itertools import product
from pathlib import Path
from types import FrameType

import pytest
from bench.faults import FAULTS, Fault, forked
from bench.killed import COMMANDS, EVERY_PAGE, NOT_TRIED, filmed, trials

from psvideo.errors import PsvideoError
from psvideo.formats.whole_files import HERE, refuse_existing
from psvideo.formats.whole_folders import whole_folder

LARGEST_PROCESS = 1 << 22
"""No system has a process of this number (PID_MAX_LIMIT of Linux)."""


@pytest.mark.campaign
@pytest.mark.parametrize(("name", "how"), [*product(COMMANDS, FAULTS), ("sync", EVERY_PAGE)])
def test_a_run_that_was_stopped_at_random_goes_on_to_the_same_bytes(name: str, how: str, tmp_path: Path) -> None:
    if how in {"disk full", EVERY_PAGE} and not (os.getuid() == 0 and shutil.which("mount")):
        pytest.skip("only root may put a small disk under the output")
    if how == "slow disk" and not shutil.which("strace"):
        pytest.skip("strace makes disks slow")
    if (name, how) in NOT_TRIED:
        pytest.skip("a page without its clip is another page")
    found = list(trials(name, filmed(tmp_path), tmp_path / "trials", how=how, moments=2, seed=3))
    faults = [fault for one in found for fault in one.faults]
    assert not faults, "\n\n".join(faults)


def test_a_folder_that_was_removed_while_it_was_written_is_not_taken_for_whole(tmp_path: Path) -> None:
    out = tmp_path / "out"

    def write() -> None:
        with whole_folder(out, mark="timing.json", settings="a") as folder:
            (folder / "first").touch()
            shutil.rmtree(folder)
            folder.mkdir()
            (folder / "second").touch()

    with pytest.raises(PsvideoError, match=r"\.out\.partial in which it was written was removed meanwhile"):
        write()
    assert not [*tmp_path.iterdir()]


def test_what_a_process_that_is_no_more_had_begun_is_removed_by_the_next(tmp_path: Path) -> None:
    left = tmp_path / f".timing.json.{LARGEST_PROCESS}-{HERE}.partial"
    own = tmp_path / f".timing.json.{os.getpid()}-{HERE}.partial"
    elsewhere = tmp_path / f".timing.json.{LARGEST_PROCESS}-00000000.partial"
    for path in (left, own, elsewhere):
        path.touch()
    refuse_existing(tmp_path / "timing.json", force=False)
    assert {*tmp_path.iterdir()} == {own, elsewhere}


def _terminated_at(call: int) -> Fault:
    """SIGTERM at the n-th call of a Python function, counted from when the program listens to it."""

    def inside() -> None:
        calls = 0
        before = signal.getsignal(signal.SIGTERM)

        def count(frame: FrameType, event: str, _: object) -> None:
            nonlocal calls
            calls += event == "call" and signal.getsignal(signal.SIGTERM) is not before
            if calls == call:
                calls += 1
                os.kill(os.getpid(), signal.SIGTERM)

        sys.setprofile(count)

    return Fault(when=f"SIGTERM at call {call}", inside=inside)


def test_a_signal_at_any_call_ends_a_command_with_one_sentence(tmp_path: Path) -> None:
    undisturbed = forked(["info", str(tmp_path)])  # loads what every later process has from its parent
    ends = [
        (call, *forked(["info", str(tmp_path)], _terminated_at(call)))
        for call in (*range(1, 31), *range(31, 4500, 193))
    ]
    assert [
        end for end in ends if end[1:] != undisturbed and (end[1] != 1 or not end[2].startswith("psvideo: stopped."))
    ] == []
    assert sum("psvideo: stopped." in end[2] for end in ends) > len(ends) / 2
