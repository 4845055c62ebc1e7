"""A whole `normals` run against the larger of decoding alone and encoding alone, and its memory over clip length.

The clips are 1080p colour in 16-bit PNG, three lights or eight, noise and all. Decoding and encoding alone use the same
functions as the run does: decoding once with the threads that a caller gets by default, and once with all cores, as in
the run. Every command is a process of its own, in turn; the lesser of two times counts, because others use the machine
too.
"""

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from bench.table import Row
from psvideo.compute.threads import thread_count
from psvideo.formats.plan_toml import format_plan, parse_fps
from psvideo.formats.rig_toml import format_rig
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Light, Rig
from psvideo.synth import Noise, TrueClock, expose

SHORT, LONG = 40, 100
REPEATS = 2
REPEATED = 8
THREE = {"key": (0.5, 0.4, 0.768), "left": (-0.6, 0.2, 0.775), "right": (0.1, -0.5, 0.86)}
RING = {f"l{k}": (0.5 * math.cos(0.3 + k * math.pi / 4), 0.5 * math.sin(0.3 + k * math.pi / 4), 0.86) for k in range(8)}
Directions = dict[str, tuple[float, float, float]]

DECODE = """
import sys
from pathlib import Path
from psvideo.clip import open_clip, read_frames
clip, count, threads = open_clip(Path(sys.argv[1])), int(sys.argv[2]), {"threads": int(n) for n in sys.argv[3:]}
print(sum(1 for _ in read_frames(clip, clip.numbers[:count], **threads)))
"""
ENCODE = """
import sys
from fractions import Fraction
from functools import partial
from pathlib import Path
import OpenEXR
from psvideo.formats.exr_files import write_exr
from psvideo.compute.threads import writing
sample, out, count = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
planes = {}
for name in ("normals", "albedo", "valid"):
    file = next((sample / name).iterdir())
    planes[name] = {key: c.pixels for key, c in OpenEXR.File(str(file), separate_channels=True).channels().items()}
with writing() as write:
    for number in range(count):
        for name, channels in planes.items():
            write(partial(write_exr, out / f"{name}.{number}.exr", channels, fps=Fraction(30)))
"""


def rows() -> Iterator[Row]:
    """Film two clips, and run decoding, encoding and everything on them."""
    with tempfile.TemporaryDirectory(prefix="psvideo-bench-") as folder:
        for directions in (THREE, RING):
            clip = Path(folder) / f"clip{len(directions)}"
            _film(clip, LONG, directions)
            yield from _time_rows(clip, len(directions))
            yield from _memory_rows(clip, len(directions))


def _time_rows(clip: Path, lights: int) -> Iterator[Row]:
    timing, out, spare = clip.with_name("timing.json"), clip.with_name("out"), clip.with_name("encoded")
    _psvideo("sync", clip, "-o", timing, "--force", "-q")
    normals = ("-m", "psvideo.cli.app", "normals", clip, "--rig", clip / "rig.toml", "-o", out, "--force", "-q")
    _timed(*normals)  # the first run compiles
    rounds = len(list((out / "normals").iterdir()))
    jobs = {
        "once": normals,
        "timed": (*normals, "--timing", timing),
        "usual": ("-c", DECODE, clip, LONG),
        "all": ("-c", DECODE, clip, LONG, thread_count()),
        "encode": ("-c", ENCODE, out, spare, rounds),
    }
    found: dict[str, float] = {}
    for _ in range(REPEATS):
        for name, job in jobs.items():
            found[name] = min(_timed(*job), found.get(name, math.inf))
    yield Row(
        f"{lights} lights: decoding {LONG} frames alone, threads as by default", f"{found['usual']:.2f} s", "", None
    )
    yield Row(
        f"{lights} lights: decoding {LONG} frames alone, all {thread_count()} cores", f"{found['all']:.2f} s", "", None
    )
    yield Row(f"{lights} lights: encoding {rounds} rounds alone", f"{found['encode']:.2f} s", "", None)
    for name, what in (("timed", "normals with timing.json"), ("once", "normals, timing found")):
        yield Row(f"{lights} lights: {what}", f"{found[name]:.2f} s", "", None)
        for base, of in (("usual", "the larger, decoding as by default"), ("all", "the larger, decoding on all cores")):
            ratio = found[name] / max(found[base], found["encode"])
            yield Row(f"{lights} lights: {what} / {of}", f"{ratio:.2f}", "<= 1.2", ratio <= 1.2)


def _memory_rows(clip: Path, lights: int) -> Iterator[Row]:
    peaks = {frames: _peak_mb(clip, frames) for frames in (SHORT, LONG)}
    for frames, peak in peaks.items():
        yield Row(f"{lights} lights: peak memory, {frames} frames", f"{peak:.0f} MB", "<= 600 MB", peak <= 600)
    growth = peaks[LONG] / peaks[SHORT]
    yield Row(f"{lights} lights: peak memory of {LONG} frames / of {SHORT}", f"{growth:.2f}", "<= 1.1", growth <= 1.1)


def _peak_mb(clip: Path, frames: int) -> float:
    """Return the largest resident memory of one run over a clip's first frames, in a process with no other child."""
    measure = (
        "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True);"
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)"
    )
    out, rig = clip.with_name("out"), clip / "rig.toml"
    command = [sys.executable, "-m", "psvideo.cli.app", "normals", clip, "--rig", rig, "-o", out]
    command += ["--frames", f"0-{frames - 1}", "--force", "-q"]
    done = subprocess.run(
        [sys.executable, "-c", measure, *map(str, command)], capture_output=True, text=True, check=True
    )
    return float(done.stdout)


def _timed(*arguments: object) -> float:
    began = time.perf_counter()
    subprocess.run([sys.executable, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL, env=dict(os.environ))
    return time.perf_counter() - began


def _psvideo(*arguments: object) -> None:
    subprocess.run([sys.executable, "-m", "psvideo.cli.app", *map(str, arguments)], check=True)


def _film(folder: Path, frames: int, directions: Directions) -> None:
    """Write a 1080p clip of a smooth relief, repeated to the full width, with a camera's noise."""
    fps = parse_fps("120000/1001")
    period_s = float(1 / fps)
    camera = Camera(width_px=1920, height_px=1080, fps=fps, exposure_s=period_s, readout_s=0.97 * period_s)
    flashes = [PlannedFlash(lights={name: 1.0}, duration_s=0.0008) for name in directions]
    flashes.append(PlannedFlash(lights={}, duration_s=0.0008))
    plan = Plan(camera=camera, flashes=tuple(flashes), dark_s=1.0002 * period_s)
    y, x = np.mgrid[0:1080, 0:240].astype(np.float32) / 240
    normals = np.stack([0.4 * np.sin(9 * x), 0.4 * np.cos(7 * y), np.ones_like(x)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    shades = [0.7 * np.maximum(normals @ np.array(d, np.float32), 0) for d in directions.values()]
    plates = [np.tile(np.repeat(shade[..., None], 3, axis=2), (1, REPEATED, 1)).astype(np.float32) for shade in shades]
    clock = TrueClock(phase_s=0.0123, offset_ppm=20.0)
    (folder / "frames").mkdir(parents=True)
    for first in range(0, frames, 10):
        shot = expose(
            plates, plan, frames=min(first + 10, frames), clock=clock, dropped=tuple(range(first)),
            noise=Noise(full_well_e=20_000, read_e=6),
        )  # fmt: skip
        for number, image in zip(shot.indices, shot.frames, strict=True):
            codes = (np.clip(image, 0, 1) * 65535).astype(np.uint16)
            cv2.imwrite(str(folder / "frames" / f"relief.{number:05d}.png"), codes, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    (folder / "plan.toml").write_text(format_plan(plan))
    (folder / "rig.toml").write_text(format_rig(_rig(directions)))


def _rig(directions: Directions) -> Rig:
    lights = []
    for name, direction in directions.items():
        x, y, z = (float(value) for value in np.array(direction) / np.linalg.norm(direction))
        lights.append(Light(name=name, direction=(x, y, z)))
    return Rig(lights=tuple(lights))
