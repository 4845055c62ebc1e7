"""Whole commands on hostile folders: absurd values in every text, pictures and folders that are not what they seem.

``python -m bench.hostile_runs --seed 1 --minutes 60`` goes on with ever new ones and prints what went wrong. A command
may do its work or refuse it with one paragraph, and ends with 0, 1 or 2; no traceback, no hang, no gigabyte.
"""

import argparse
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import NamedTuple, NoReturn

import cv2
import numpy as np

from bench.faults import CRASHED, as_anybody
from bench.hostile import LIMIT_MB, LIMIT_S
from bench.hostile_folders import KINDS, absurd, damaged, not_a_file, one_of
from psvideo.cli.app import main as psvideo
from psvideo.synth.shoot import shoot

SCENE = """
schema = "psvideo-scene/1"
name = "hostile"
frames = 24
camera = { width_px = 48, height_px = 32, fps = 100, shutter_deg = 360, readout_s = 0.0097, width_m = 1.0 }
ambient = { level = 0.02 }
object = [{ mesh = "sphere" }]
light = [
  { name = "a", direction = [0.5, 0.0, 0.8] },
  { name = "b", direction = [-0.5, 0.1, 0.8] },
  { name = "c", direction = [0.1, 0.5, 0.8] },
]
"""
LIGHTS = "3\na.png 0.53 0.0 0.848\nb.png -0.527 0.105 0.843\nc.png 0.105 0.527 0.843\n"
FLAT = """
schema = "psvideo-flat/1"
width_px = 48
height_px = 32
box = [2, 2, 46, 30]
light = [{ name = "a", coefficients = [COEFFICIENTS] }]
"""
MATRIX = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
MOST_MB = int(LIMIT_MB)
PLENTY_MB = 6000
"""Address space of a command: far more than it may use, so that what asks for all of it is seen and harms nobody."""
LOADED = (
    "psvideo.runs.many_takes.normals_of_takes",
    "psvideo.runs.stills",
    "psvideo.inspect.describe",
    "psvideo.export.usd",
)
"""What most commands load is loaded before they are forked."""
TRIED = 300
"""Commands that the table tries."""
PATIENCE_S = 6 * LIMIT_S
"""A command that has not ended by then hangs; on a busy machine its LIMIT_S of processor time take longer."""
COMPILES_S = 600
"""So long the first commands may take, which compile."""


@dataclass(frozen=True, kw_only=True)
class Ran:
    """What became of a command; ``fault`` is empty where all is well."""

    words: tuple[str, ...]
    why: str
    status: int
    said: str
    fault: str
    cpu_s: float
    peak_mb: float


class Runs(NamedTuple):
    """One kind of hostility: how many commands met it, ended well, refused it, and were at fault."""

    kind: str
    tried: int
    done: int
    refused: int
    faults: int
    most_seconds: str
    most_memory: str


WORLD = ("--space", "world")
COMMANDS: tuple[tuple[str, ...], ...] = (
    ("info", "{clip}"),
    ("check", "{clip}", "--rig", "{clip}/rig.toml"),
    ("sync", "{clip}", "-o", "{out}.json"),
    ("split", "{clip}", "-o", "{out}", "--timing", "{clip}/timing.json", "--beauty"),
    ("normals", "{clip}", "--rig", "{clip}/rig.toml", "-o", "{out}", "--no-preview"),
    ("normals", "{clip}", "--rig", "{clip}/rig.toml", "--timing", "{clip}/timing.json", "-o", "{out}", "--plates"),
    ("normals", "{clip}", "--rig", "{clip}/lights.lp", "--mask", "{clip}/given/mask.png", "-o", "{out}"),
    ("normals", "{clip}", "--rig", "{clip}/rig.toml", "--flat", "{clip}/flat.toml", "-o", "{out}", "--no-preview"),
    ("normals", "{clip}", "--rig", "{clip}/rig.toml", "--fps", "24", "--resync", "{clip}/clocks.json", "-o", "{out}"),
    ("normals", "{clip}", "--rig", "{clip}/rig.toml", "--depth", "{clip}/given/depth.png", "-o", "{out}"),
    ("normals", "{clip}", "--rig", "{clip}/rig.toml", "--camera-to-world", "{clip}/camera.txt", *WORLD, "-o", "{out}"),
    ("normals", "{clip}", "--rig", "{clip}/near.toml", "-o", "{out}", "--aov", "depth", "--no-preview"),
    ("farm", "{clip}", "--rig", "{clip}/rig.toml", "--results", "{out}", "--commands"),
    ("stills", "{clip}/photographs", "--lights", "{clip}/lights.lp", "-o", "{out}"),
    ("calibrate", "convert", "{clip}/rig.toml", "-o", "{out}.lp"),
    ("calibrate", "matte-sphere", "{clip}", "-o", "{out}.toml"),
    ("calibrate", "readout", "{clip}", "-o", "{out}.toml"),
    ("strobe", "check", "{clip}/plan.toml"),
    ("info", "{clip}/strobe.json"),
    ("info", "{clip}/rig.toml"),
    ("info", "{clip}/timing.json"),
    ("info", "{clip}/given/mask.png"),
    ("view", "{out}.results", "--export", "{out}.html"),
    ("info", "{out}.results"),
)  # fmt: skip
NEAR = """
schema = "psvideo-rig/1"
light = [
  { name = "a", position_m = [0.5, 0.0, -0.2], intensity = 0.4, anisotropy = 1.0 },
  { name = "b", position_m = [-0.5, 0.1, -0.2], intensity = 0.4 },
  { name = "c", position_m = [0.1, 0.5, -0.2], intensity = 0.4, axis = [0.0, 0.0, -1.0] },
]
camera = { focal_px = [50.0, 50.0], principal_px = [23.5, 15.5] }
surface = { plane = [0.0, 0.0, 1.0, 1.0] }
"""


def made(folder: Path) -> Path:
    """Film a small clip with everything beside it that commands read; return it. Its results lie in ``results``."""
    (folder / "hostile.toml").write_text(SCENE, encoding="utf-8")
    clip = folder / "clip"
    shoot(folder / "hostile.toml", clip)
    shutil.rmtree(clip / "truth", ignore_errors=True)
    rng = np.random.default_rng(0)
    for name in ("given", "photographs"):
        (clip / name).mkdir()
    cv2.imwrite(str(clip / "given" / "mask.png"), np.full((32, 48), 255, np.uint8))
    cv2.imwrite(str(clip / "given" / "depth.png"), np.full((32, 48), 1000, np.uint16))
    for name in "abc":
        cv2.imwrite(str(clip / "photographs" / f"{name}.png"), rng.integers(0, 255, (32, 48, 3)).astype(np.uint8))
    texts = {"lights.lp": LIGHTS, "near.toml": NEAR, "camera.txt": MATRIX}
    texts["flat.toml"] = FLAT.replace("COEFFICIENTS", ", ".join(["0.1"] * 5))
    for name, text in texts.items():
        (clip / name).write_text(text, encoding="utf-8")
    commands: tuple[tuple[str, ...], ...] = (
        ("sync", str(clip), "-o", str(clip / "timing.json")),
        ("sync", str(clip), str(_twin(clip)), "--starts", "0,0", "-o", str(clip / "clocks.json")),
        (
            "strobe",
            "run",
            str(clip / "plan.toml"),
            "--port",
            "emulated",
            "--rounds",
            "3",
            "--log",
            str(folder / "s.json"),
        ),
        ("normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(folder / "results")),
    )
    for words in commands:
        status, said, _ = forked(words, patience_s=COMPILES_S)
        if status != 0:
            raise RuntimeError(f"psvideo {' '.join(words)}: {said}")
    (folder / "s.json").rename(clip / "strobe.json")
    for number, words in enumerate(COMMANDS):
        forked(_typed(words, clip, folder / f"first{number}"), patience_s=COMPILES_S)
    return clip


def _twin(clip: Path) -> Path:
    """Return a second name of a clip, as of another camera that saw the same."""
    twin = clip.with_name("twin")
    shutil.copytree(clip, twin)
    return twin


def forked(
    words: Sequence[str], *, anybody: bool = False, patience_s: float = PATIENCE_S
) -> tuple[int, str, "resource.struct_rusage"]:
    """Run a command in a fork of this process, if wished without root's rights; return its exit status, negative for a
    signal, what it said, and what it used. One that lasts longer than ``patience_s`` is killed."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        _begin(words, writing, anybody=anybody)
    os.close(writing)
    said = _heard(reading, child, time.monotonic() + patience_s)
    _, status, used = os.wait4(child, 0)
    return os.waitstatus_to_exitcode(status), said, used


def _heard(reading: int, child: int, until_s: float) -> str:
    """Return what a process says until it ends, or is killed because it does not."""
    parts = []
    while True:
        if not select.select([reading], [], [], max(until_s - time.monotonic(), 0))[0]:
            os.kill(child, signal.SIGKILL)
            break
        part = os.read(reading, 1 << 16)
        if not part:
            break
        parts.append(part)
    os.close(reading)
    return b"".join(parts).decode("utf-8", "replace")


def _begin(words: Sequence[str], writing: int, *, anybody: bool) -> NoReturn:
    """Run a command and end this process, whatever comes."""
    status = CRASHED
    try:
        for stream in (1, 2):
            os.dup2(writing, stream)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        sys.stdout = sys.stderr = os.fdopen(2, "w", buffering=1, encoding="utf-8", errors="backslashreplace")
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (PLENTY_MB << 20, hard))
        if anybody:
            as_anybody()
        status = psvideo(list(words))
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(status)


def tried(folder: Path, *, seed: int) -> Iterator[tuple[str, Ran]]:
    """Make a clip hostile in ever new ways, and give what commands made of it, with the kind of hostility."""
    rng = np.random.default_rng(seed)
    for name in LOADED:
        import_module(name)
    clip = made(folder)
    while True:
        kind = one_of(KINDS, rng)
        place = folder / "place"
        place.mkdir()
        shutil.copytree(clip, place / "clip")
        shutil.copytree(folder / "results", place / "out.results")
        subject = place / "out.results" if kind in (absurd, damaged, not_a_file) and rng.integers(0, 6) == 0 else None
        why = kind(subject or place / "clip", rng)
        there = next(path for path in place.iterdir() if path.name != "out.results")
        few = [one for one in COMMANDS if ("out}.res" in one[1]) == (subject is not None)]
        for words in rng.choice(len(few), min(3, len(few)), replace=False):
            yield kind.__name__, _ran(few[int(words)], there, place, why)
        shutil.rmtree(place)


def _ran(words: Sequence[str], clip: Path, place: Path, why: str) -> Ran:
    typed = _typed(words, clip, place / "out")
    before = _outside(place)
    status, said, used = forked(typed, anybody="may not be read" in why)
    cpu_s, peak_mb = used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
    fault = ""
    if status == -signal.SIGKILL:
        fault = f"no end for {PATIENCE_S:g} s"
    elif status not in (0, 1, 2) or "Traceback" in said:
        fault = f"ended with {status}"
    elif status != 0 and not said.strip():
        fault = "ended without a word"
    elif cpu_s > LIMIT_S:
        fault = f"took {cpu_s:.0f} s"
    elif peak_mb > MOST_MB:
        fault = f"took {peak_mb:.0f} MB"
    elif _outside(place) != before:
        fault = f"wrote {sorted(_outside(place) ^ before)}"
    for left in place.iterdir():
        if left.name.startswith(("out", ".out")) and left.name != "out.results":
            shutil.rmtree(left) if left.is_dir() else left.unlink()
    return Ran(words=typed, why=why, status=status, said=said, fault=fault, cpu_s=cpu_s, peak_mb=peak_mb)


def _typed(words: Sequence[str], clip: Path, out: Path) -> tuple[str, ...]:
    return tuple(word.replace("{clip}", str(clip)).replace("{out}", str(out)) for word in words)


def _outside(place: Path) -> set[str]:
    """Return the names that lie beside the folder in which a command may write."""
    return {path.name for path in place.parent.iterdir()} | {
        path.name for path in place.iterdir() if not path.name.startswith(("out", ".out"))
    }


def rows() -> Iterator[Runs]:
    """Make so many clips hostile."""
    found: dict[str, list[Ran]] = {}
    with tempfile.TemporaryDirectory() as place:
        for kind, one in islice(tried(Path(place), seed=1), TRIED):
            found.setdefault(kind, []).append(one)
    for kind, several in sorted(found.items()):
        yield summary(kind, several)


def summary(name: str, found: Sequence[Ran]) -> Runs:
    """Add up what became of one kind."""
    faults = sum(bool(one.fault) for one in found)
    done = sum(one.status == 0 and not one.fault for one in found)
    return Runs(
        kind=name,
        tried=len(found),
        done=done,
        refused=len(found) - faults - done,
        faults=faults,
        most_seconds=f"{max(one.cpu_s for one in found):.2f} s",
        most_memory=f"{max(one.peak_mb for one in found):.0f} MB",
    )


def main() -> int:
    """Go on for so many minutes."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=10.0)
    asked = parser.parse_args()
    end_s = time.monotonic() + 60 * asked.minutes
    found: dict[str, list[Ran]] = {}
    with tempfile.TemporaryDirectory() as place:
        for kind, one in tried(Path(place), seed=asked.seed):
            found.setdefault(kind, []).append(one)
            if one.fault:
                print(f"{one.fault}: psvideo {' '.join(one.words)}\n  {one.why}\n  {one.said[-1500:]}", flush=True)
            if time.monotonic() > end_s:
                break
    for kind, several in sorted(found.items()):
        print(*summary(kind, several), flush=True)
    return int(any(one.fault for several in found.values() for one in several))


if __name__ == "__main__":
    sys.exit(main())
