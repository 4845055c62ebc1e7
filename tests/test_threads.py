"""The same command gives the same bytes, whatever the number of threads, the load, and whether it was stopped."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from bytes_of_files import Digest, digest_of_results
from lit_ball import LIT_BALL

from psvideo.cli.app import main
from psvideo.compute.threads import THREADS, in_order, over_ranges, thread_count, writing
from psvideo.errors import UsageError
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat, FoundClock
from psvideo.sync.rowfit.compiled_profiles import WORTH_A_THREAD, equations
from psvideo.sync.rowfit.profiles import Profiles

COUNTS = (1, 3, 8)
TALL = f"""
schema = "psvideo-scene/1"
name = "tall"
frames = 28
seed = 5
[camera]
width_px = 44
height_px = 1600
fps = 100
shutter_deg = 360.0
readout_s = 0.01
width_m = 0.2
[strobe]
flash_s = 0.001
clock_offset_ppm = 40.0
{LIT_BALL}"""
"""Enough samples for several parts of the fit and several bands of the solution, in pictures that cost little."""
BUSY = """
from time import perf_counter, sleep
while True:
    until_s = perf_counter() + 0.004
    while perf_counter() < until_s:
        pass
    sleep(0.004)
"""


def test_ranges_follow_the_work_and_results_their_order() -> None:
    def late_first(first: int, last: int) -> tuple[int, int]:
        time.sleep(0.02 if first == 0 else 0.0)
        return first, last

    found = [over_ranges(late_first, 10, each=3, threads=threads) for threads in COUNTS]
    assert found == [[(0, 3), (3, 6), (6, 9), (9, 10)]] * len(COUNTS)
    assert over_ranges(late_first, 0, each=3) == []
    assert over_ranges(late_first, 2, each=0, threads=2) == [(0, 1), (1, 2)]


def test_jobs_give_their_results_in_order_and_their_errors() -> None:
    def job(number: int) -> Callable[[], int]:
        def run() -> int:
            time.sleep(0.01 * (number % 3))
            return 1 // (5 - number)

        return run

    given = in_order((job(number) for number in range(9)), ahead=4, threads=3, name="test")
    assert [next(given) for _ in range(5)] == [0, 0, 0, 0, 1]
    with pytest.raises(ZeroDivisionError):
        next(given)
    with pytest.raises(ZeroDivisionError), writing(most_waiting=1) as write:
        write(lambda: print(1 // 0))


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="only Linux binds a process to cores")
def test_a_process_that_is_bound_to_one_core_computes_with_one_thread() -> None:
    """Farms bind jobs: more threads than cores would take turns."""
    code = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
    code += "from psvideo.compute.threads import thread_count\nprint(thread_count())"
    bare = {name: value for name, value in os.environ.items() if name != THREADS}
    said = subprocess.run([sys.executable, "-c", code], env=bare, capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "1"


def test_the_number_of_threads_is_set_in_one_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(THREADS, raising=False)
    assert thread_count() >= 1
    monkeypatch.setenv(THREADS, "3")
    assert thread_count() == 3
    for wrong in ("0", "-1", "two", "1.5", "²"):
        monkeypatch.setenv(THREADS, wrong)
        with pytest.raises(UsageError, match=r"PSVIDEO_THREADS=.* expected a whole number"):
            thread_count()


def test_the_fit_adds_its_parts_in_order(make_plan: Callable[..., Plan], monkeypatch: pytest.MonkeyPatch) -> None:
    plan, rng = make_plan(height_px=1080), np.random.default_rng(0)
    frames = 4 * WORTH_A_THREAD // 1080
    rows = Profiles(
        value=rng.random((frames, 1080)),
        index=np.arange(frames),
        period_s=plan.camera.frame_period_s,
        place=np.arange(1080.0),
        window_start=np.zeros(1, np.int64),
    )
    assert plan.camera.readout_s is not None
    beat = Beat(
        clock=FoundClock(phase_s=0.001, offset_ppm=0.0),
        row_time_s=plan.camera.readout_s / 1080,
        exposure_s=plan.camera.exposure_s,
    )
    found = []
    for threads in (*COUNTS, *COUNTS):
        monkeypatch.setenv(THREADS, str(threads))
        found.append([part.tobytes() for part in equations(plan, rows, beat, np.ones_like(rows.value), tails=False)])
    assert all(before == after for before, after in pairwise(found))


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shoot")
    (folder / "tall.toml").write_text(TALL)
    assert main(["synth", str(folder / "tall.toml"), "-o", str(folder / "clip"), "-q"]) == 0
    return folder / "clip"


def begun(*arguments: object, threads: int) -> "subprocess.Popen[str]":
    """Begin a command in a process of its own, with so many threads for numpy's and OpenCV's libraries too."""
    count = dict.fromkeys((THREADS, "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"), str(threads))
    command = [sys.executable, "-m", "psvideo.cli.app", *map(str, arguments), "-q"]
    return subprocess.Popen(command, env=os.environ | count, stderr=subprocess.PIPE, text=True)


def ended(process: "subprocess.Popen[str]") -> None:
    _, said = process.communicate(timeout=600)
    assert process.returncode == 0, said


@contextmanager
def load() -> Iterator[None]:
    """Keep the machine busy with two loops that come and go, which is worse to threads than loops that stay."""
    loops = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(2)]
    try:
        yield
    finally:
        for one in loops:
            one.kill()
            one.wait()


COMMANDS: dict[str, tuple[str, ...]] = {
    "sync": ("sync",),
    "split": ("split", "--flashes"),
    "normals": ("normals", "--rig", "{clip}/rig.toml", "--align", "flow", "--aov", "residual", "--solver", "robust"),
    "depth": ("normals", "--rig", "{clip}/rig.toml", "--aov", "depth", "--mesh", "ply"),
}


@pytest.fixture(scope="module")
def by_one_thread(clip: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Digest]:
    """Return what gives the checksums of a command that ran whole and by one thread; each runs once.

    All outputs lie as deep as its own: the edit list names the clip from where it lies.
    """

    @cache
    def digest_of(name: str) -> Digest:
        command, *options = (word.format(clip=clip) for word in COMMANDS[name])
        out = tmp_path_factory.mktemp("by_one_thread") / "out"
        ended(begun(command, clip, *options, "-o", out, threads=1))
        return digest_of_results(out)

    return digest_of


@pytest.mark.parametrize(
    "name",
    [name if name == "sync" else pytest.param(name, marks=pytest.mark.campaign) for name in COMMANDS],
)
def test_any_number_of_threads_gives_the_same_bytes_also_under_load(
    name: str, clip: Path, tmp_path: Path, by_one_thread: Callable[[str], Digest]
) -> None:
    command, *options = (word.format(clip=clip) for word in COMMANDS[name])
    for count, around in ((3, load()), (8, nullcontext())):
        out = tmp_path / f"by_{count}_threads"
        with around:
            ended(begun(command, clip, *options, "-o", out, threads=count))
        assert digest_of_results(out) == by_one_thread(name), f"{count} threads"


@pytest.mark.parametrize("name", [pytest.param("split", marks=pytest.mark.campaign), "normals"])
def test_a_run_that_was_killed_goes_on_to_the_same_bytes(
    name: str, clip: Path, tmp_path: Path, by_one_thread: Callable[[str], Digest]
) -> None:
    command, *options = (word.format(clip=clip) for word in COMMANDS[name])
    out = tmp_path / "out"
    process = begun(command, clip, *options, "-o", out, threads=2)
    partial = tmp_path / ".out.partial"
    while process.poll() is None and not list(partial.rglob("[!.]*.exr")):
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert partial.is_dir()
    assert not out.exists(), "killed in the middle"
    (partial / ".left.exr.1.partial").write_bytes(b"half a file")
    ended(begun(command, clip, *options, "-o", out, "--resume", threads=8))
    assert digest_of_results(out) == by_one_thread(name)


LEFT_IN_C = """
import time
import numpy as np
import cv2
from psvideo.compute.side_threads import run_beside
picture = np.zeros((400, 400), np.float32)
def blur():
    until = time.monotonic() + 0.6
    while time.monotonic() < until:
        cv2.GaussianBlur(picture, (0, 0), 3)
    print("done")
run_beside(blur, name="beside")
time.sleep(0.1)
"""


def test_a_process_whose_thread_is_in_the_midst_of_a_call_of_a_c_library_ends_in_order() -> None:
    done = subprocess.run([sys.executable, "-c", LEFT_IN_C], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "done\n", "")
