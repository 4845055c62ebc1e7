"""Memory as a contract: it grows with the picture and with the flashes of a round, and never with the clip."""

import json
import math
import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import tifffile

from psvideo.formats.plan_toml import format_plan
from psvideo.formats.rig_toml import format_rig
from psvideo.formats.timing_json import format_timing
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Light, Rig
from psvideo.model.timing import Flash, Timing
from psvideo.synth import TrueClock, expose

LIGHTS = {f"l{n}": (0.5 * math.cos(0.9 * n), 0.5 * math.sin(0.9 * n), math.sqrt(0.75)) for n in range(7)}
FRAMES_A_ROUND = 10
"""A flash or the dark slot every 1.25 frames: after each round of eight the same ten frames come again."""
PHASE_S = 0.003
SMALL, LARGE = (90, 160), (450, 800)
FEW, MANY = 60, 600
USUAL_GROWTH_MB = 0.03
"""So much a process's peak may rise in 30 frames, usually: 0.00 to 0.02 was measured, a few numbers of each instant and
what files left for the collector. A byte a pixel that stays with every instant makes 0.04 more, the codes of a frame
that stay with every frame 2.5."""
TRIES = 3
"""What stays with every instant grows in each of so many runs; of seven runs one made 0.031, and one 0.043."""
MOST_GROWTH_MB = 2.2
"""So much it may rise in all between 60 frames and 570: 0.2 to 1.4 was measured. Now and then the peak leaps by 0.1 to
1.0, when a frame more than before is on its way, at frames that differ from run to run."""
MOST_BYTES_PER_SAMPLE = 55
"""A sample of the picture: ambient light, twice, results with what they are judged by, and what is held steady (51.5
bytes). Frames of plain codes stay in their files: the 19 that a round and a half needs would be 38 more."""
HALF_MANY = 40
"""Frames of four instants: of the first depth is found while nothing else is done."""
MOST_MB = 450
"""The bar. Measured with eight lights: 316 MB by default and 382 with depth. A loop that is loaded brings 52 MB of what
only compiling needs, which goes back to the system."""
RUN = """
import json, sys
from fractions import Fraction
from pathlib import Path
import psvideo as ps

def peak_kb():
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmHWM"))

def watched(frames, *, what, **_):
    for number, frame in enumerate(frames):
        if number % 30 == 0 and not what.startswith("movie of"):
            peaks.append(peak_kb() / 1024)
        yield frame
        del frame

runs = []
for folder in map(Path, sys.argv[1:]):
    peaks = []
    given = {"rig": folder / "rig.toml", "timing": folder / "timing.json", "out": folder / "out", "force": True}
    ps.normals(folder, **given, solver="least-squares", watch=watched)
    runs.append([*peaks, peak_kb() / 1024])
print(json.dumps(runs))
"""
COMMAND = """
import sys
from psvideo.cli.app import main
assert main(sys.argv[1:]) == 0
print(next(line for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""

MOST_COMPILER_KB = 8192
"""Loading the loops of a whole run needs 4 MB of LLVM's code."""
LOADING = """
import numpy as np
from psvideo.pictures.relit_kernel import relit
plane = np.zeros((8, 8), np.float16)
relit((plane,) * 3, (plane,) * 3, np.zeros(3, np.float32), 2)
held, here = 0, False
for line in open("/proc/self/smaps"):
    first, *rest = line.split()
    if not first.endswith(":"):
        here = "libllvmlite" in line and rest[0] == "r-xp"
    elif here and first == "Rss:":
        held += int(rest[0])
print(held)
"""


def filmed(folder: Path, size: tuple[int, int], frames: int) -> Path:
    """Write a clip of a relief at rest: five frames that come again and again, in files that are links."""
    rows, cols = size
    period_s = 1 / 120
    camera = Camera(width_px=cols, height_px=rows, fps=Fraction(120), exposure_s=period_s, readout_s=0.97 * period_s)
    lit = [PlannedFlash(lights={name: 1.0}, duration_s=0.0008) for name in LIGHTS]
    flashes = (*lit, PlannedFlash(lights={}, duration_s=0.0008))
    plan = Plan(camera=camera, flashes=flashes, dark_s=1.25 * period_s - 0.0008)
    y, x = np.mgrid[0:rows, 0:cols] / rows
    normals = np.stack([0.4 * np.sin(9 * x), 0.4 * np.cos(7 * y), np.ones_like(x)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    plates = [(0.7 * normals @ one)[..., None].astype(np.float32) * np.ones(3, np.float32) for one in LIGHTS.values()]
    clock = TrueClock(phase_s=PHASE_S, offset_ppm=0.0)
    shot = expose(plates, plan, frames=2 * FRAMES_A_ROUND, clock=clock, ambient=np.full((*size, 3), 0.02, np.float32))
    (folder / "frames").mkdir(parents=True)
    for number in range(frames):
        file = folder / "frames" / f"relief.{number:04d}.tif"
        if number < FRAMES_A_ROUND:
            codes = np.clip(shot.frames[FRAMES_A_ROUND + number] * 65535, 0, 65535).astype(np.uint16)
            tifffile.imwrite(file, codes, photometric="rgb")
        else:
            os.link(folder / "frames" / f"relief.{number % FRAMES_A_ROUND:04d}.tif", file)
    count = int(frames / 1.25)
    fired = tuple(
        Flash(
            index=n,
            slot=n % len(flashes),
            lights=flashes[n % len(flashes)].lights,
            start_s=PHASE_S + 1.25 * period_s * n,
            duration_s=0.0008,
            complete=n < count - 2,
        )
        for n in range(count)
    )
    timing = Timing(
        clip=folder.name,
        frame_period_s=period_s,
        exposure_s=period_s,
        row_time_s=0.97 * period_s / rows,
        clock_offset_ppm=0.0,
        phase_error_rows=0.001,
        order="marker",
        flashes=fired,
    )
    (folder / "plan.toml").write_text(format_plan(plan))
    (folder / "timing.json").write_text(format_timing(timing))
    rig = Rig(lights=tuple(Light(name=name, direction=one) for name, one in LIGHTS.items()))
    (folder / "rig.toml").write_text(format_rig(rig))
    return folder


@pytest.mark.skipif(sys.platform != "linux", reason="a process's peak is read from /proc")
def test_memory_grows_with_the_picture_and_not_with_the_clip(tmp_path: Path) -> None:
    """One process runs a long clip of small pictures and then a short one of large pictures: its peaks on the way."""
    clips = [filmed(tmp_path / "long", SMALL, MANY), filmed(tmp_path / "large", LARGE, FEW)]
    for _ in range(TRIES):
        long, large = _peaks_mb(clips)
        steps = np.diff(long[FEW // 30 : -1])  # the last is with the report and the movie
        if np.median(steps) <= USUAL_GROWTH_MB:
            break
    samples = LARGE[0] * LARGE[1] * 3
    assert np.median(steps) <= USUAL_GROWTH_MB
    assert sum(steps) <= MOST_GROWTH_MB
    assert (large[-1] - long[-1]) * 2**20 <= MOST_BYTES_PER_SAMPLE * samples
    assert len(list((tmp_path / "long" / "out" / "normals").iterdir())) == MANY // FRAMES_A_ROUND - 2


def _peaks_mb(clips: list[Path]) -> list[list[float]]:
    """Return what ``RUN`` finds of clips."""
    alone = os.environ | {"MALLOC_ARENA_MAX": "1"}  # as the command line sets it
    done = subprocess.run([sys.executable, "-c", RUN, *clips], env=alone, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found: list[list[float]] = json.loads(done.stdout.splitlines()[-1])
    return found


@pytest.mark.campaign
@pytest.mark.skipif(sys.platform != "linux", reason="a process's peak is what Linux says of it")
def test_at_full_size_a_command_stays_within_its_megabytes(tmp_path: Path) -> None:
    """Seven lights at 1080p colour, by the command line's own settings of its heap; depth after the second instant is
    integrated while the next one is solved."""
    small, whole = filmed(tmp_path / "small", SMALL, FEW), filmed(tmp_path / "whole", (1080, 1920), HALF_MANY)
    for folder, more in ((small, ()), (small, ("--aov", "depth")), (whole, ("--frames", "0-19"))):
        peak_mb(folder, *more)  # compiles
    assert peak_mb(whole) <= MOST_MB
    assert peak_mb(whole, "--aov", "depth") <= MOST_MB


def peak_mb(folder: Path, *more: str) -> float:
    """Solve a clip by the command line, and return the most memory that the process held."""
    words = ["normals", folder, "--rig", folder / "rig.toml", "--timing", folder / "timing.json", *more]
    call = [sys.executable, "-c", COMMAND, *map(str, words), "-o", str(folder / "out"), "--force", "-q"]
    done = subprocess.run(call, capture_output=True, text=True, check=True)
    return int(done.stdout.split()[-2]) / 1024


@pytest.mark.skipif(sys.platform != "linux", reason="what a process holds of a library is what Linux says")
def test_nothing_of_the_compiler_s_code_is_held_once_loops_are_loaded() -> None:
    """52 MB of it stayed to the end of every run."""
    for _ in range(2):  # the first one may compile
        done = subprocess.run([sys.executable, "-c", LOADING], capture_output=True, text=True, check=True)
    assert int(done.stdout) <= MOST_COMPILER_KB


@pytest.mark.parametrize(("said", "huge"), [({}, "0"), ({"NUMPY_MADVISE_HUGEPAGE": "1"}, "1")])
def test_the_command_line_leaves_huge_pages_alone_unless_the_user_wants_them(said: dict[str, str], huge: str) -> None:
    ask = "from psvideo.cli.app import main; main(['--version']); import numpy as np; "
    ask += "print(int(np._core.multiarray._set_madvise_hugepage(False)))"
    kept = {name: value for name, value in os.environ.items() if name != "NUMPY_MADVISE_HUGEPAGE"}
    done = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True, env=kept | said)
    assert done.stdout.split()[-1] == huge


@pytest.mark.parametrize(("said", "threads"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2")])
def test_linear_algebra_has_no_threads_of_its_own_unless_wanted(said: dict[str, str], threads: str) -> None:
    ask = "import os; from psvideo.cli.app import main; main(['--version']); print(os.environ['OPENBLAS_NUM_THREADS'])"
    kept = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    done = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True, env=kept | said)
    assert done.stdout.split()[-1] == threads


def test_python_seldom_looks_for_reference_cycles() -> None:
    ask = "import gc; from psvideo.cli.app import main; main(['--version']); print(gc.get_threshold()[0])"
    done = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True)
    assert int(done.stdout.split()[-1]) >= 10_000
