"""Whole commands on hostile folders: absurd values in every text, pictures and folders that are not what they seem.

``python -m bench.hostile_runs --seed 1 --minutes 60`` goes on with ever new ones and prints what went wrong. A command
may do its work or refuse it with one paragraph, and ends with 0, 1 or 2; no traceback, no hang, no gigabyte.
"""

import argparse
import contextlib
import os
import re
import resource
import select
import shutil
import signal
import socket
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import NamedTuple, NoReturn, TypeVar

import cv2
import numpy as np

from bench.faults import CRASHED, as_anybody
from bench.hostile import CHANGES, LIMIT_MB, LIMIT_S
from psvideo.cli.app import main as psvideo
from psvideo.synth.shoot import shoot

Rng = np.random.Generator
Item = TypeVar("Item")
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
DEEP = 3000
PATIENCE_S = 6 * LIMIT_S
"""A command that has not ended by then hangs; on a busy machine its LIMIT_S of processor time take longer."""
COMPILES_S = 600
"""So long the first commands may take, which compile."""
VALUES = (
    *("1e308", "-1e308", "1e-308", "5e-324", "1e16", "-1", "0", "0.0", "-0.0", "1", "2", "0.5", "1e9", "1e400"),
    *("nan", "inf", "-inf", "NaN", "Infinity", "-Infinity", "true", "null", "9223372036854775807", "65536"),
    *("18446744073709551616", "2147483648", "1" + "0" * 400, '""', '"x"', "[]", "{}", "[" * DEEP + "]" * DEEP),
    *("[" + "0.5," * 200_000 + "0.5]", '"' + "x" * 100_000 + '"', '"../../../../etc/passwd"', '"/dev/zero"'),
    *('"a\\u0000b"', '"a\\nb"', '"%s%n"', '"*"', '"unknown"', "1e5", "1e-9", "-1e-9", '"1/0"', '"1e-300"'),
)
"""What a number or a word in a text is replaced with: valid and absurd, or not valid at all."""
TOKEN = re.compile(r'"(?:[^"\\\n]|\\.)*"|(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])|true|false')
"""A word in quotes or a number."""
NAMES = (
    *("a\nb", "a%sb", "*", "?[a]", "-rf", "~", "$(touch x)", "a b", "\u202eb", "%d.####", "#", "..c", "é\u0301"),
    *("x" * 200, "\udcff\udcfe", "'\"", "a;b", "<b>"),
)
"""Names of folders."""


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


def texts_in(clip: Path) -> list[Path]:
    """Return the texts of a clip, and of its results."""
    found = [path for path in clip.rglob("*") if path.suffix in (".toml", ".json", ".lp", ".txt") and path.is_file()]
    return sorted(found)


def absurd(clip: Path, rng: Rng) -> str:
    """Replace some values of a text of the clip with absurd ones; return what was done."""
    path = _one(texts_in(clip), rng)
    text = path.read_text(encoding="utf-8")
    places = [*TOKEN.finditer(text)]
    for _ in range(int(rng.integers(1, 3))):
        at, value = _one(places, rng), str(rng.choice(VALUES))
        if path.suffix == ".lp" or path.suffix == ".txt":
            value = value.strip('"')
        text = text[: at.start()] + value + text[at.end() :]
        places = [*TOKEN.finditer(text)] or places[:1]
    path.write_text(text, encoding="utf-8")
    return f"{path.name}: {value[:60]} at {at.start()}"


def lines_again(clip: Path, rng: Rng) -> str:
    """Leave out, repeat or swap some lines of a text."""
    path = _one(texts_in(clip), rng)
    lines = path.read_text(encoding="utf-8").splitlines()
    first, last = sorted(int(place) for place in rng.integers(0, len(lines) + 1, 2))
    how = int(rng.integers(0, 3))
    times = int(rng.choice([2, 50, 5000])) if len(lines) < 100 else 2
    part = lines[first:last]
    lines[first:last] = [[], part * times, part[::-1]][how]
    path.write_text("\n".join(lines), encoding="utf-8")
    return f"{path.name}: lines {first} to {last} {('left out', f'{times} times', 'reversed')[how]}"


def damaged(clip: Path, rng: Rng) -> str:
    """Change the bytes of any file."""
    path = _one(sorted(path for path in clip.rglob("*") if path.is_file()), rng)
    data = bytearray(path.read_bytes())
    for _ in range(int(rng.integers(1, 4))):
        if data:
            data = CHANGES[int(rng.integers(0, len(CHANGES)))](data, rng)
    path.write_bytes(data)
    return f"{path.name}: damaged"


def not_a_file(clip: Path, rng: Rng) -> str:
    """Put something else in the place of a file: a pipe, a device, a folder, a link in a circle, nothing."""
    path = _one(sorted(path for path in clip.rglob("*") if path.is_file()), rng)
    other = _one(sorted(path for path in clip.rglob("*") if path.is_file()), rng)
    data = other.read_bytes()
    path.unlink()
    what = _one([*PLACED], rng)
    PLACED[what](path, data)
    return f"{path.relative_to(clip)}: {what}"


def _pipe(path: Path, _: bytes) -> None:
    os.mkfifo(path)


def _zeros(path: Path, _: bytes) -> None:
    path.symlink_to("/dev/zero")


def _circle(path: Path, _: bytes) -> None:
    path.symlink_to(path.name)


def _folder(path: Path, _: bytes) -> None:
    path.mkdir()


def _nowhere(path: Path, _: bytes) -> None:
    path.symlink_to("nothing")


def _unread(path: Path, data: bytes) -> None:
    path.write_bytes(data)
    path.chmod(0)


def _another(path: Path, data: bytes) -> None:
    path.write_bytes(data)


def _sparse(path: Path, _: bytes) -> None:
    with path.open("wb") as file:
        file.truncate(5 << 30)


def _socket(path: Path, _: bytes) -> None:
    with contextlib.chdir(path.parent), socket.socket(socket.AF_UNIX) as one:  # names are of 107 bytes at most
        one.bind(path.name)


PLACED: dict[str, Callable[[Path, bytes], None]] = {
    "a pipe that nobody writes to": _pipe,
    "zeros without end": _zeros,
    "a link to itself": _circle,
    "a folder": _folder,
    "a link to nothing": _nowhere,
    "a file that may not be read": _unread,
    "another file of the clip": _another,
    "five gigabytes of holes": _sparse,
    "a socket": _socket,
}


def named(clip: Path, rng: Rng) -> str:
    """Give files absurd names: numbers beyond all bounds, twice the same number, other kinds."""
    frames = sorted((clip / "frames").iterdir()) if (clip / "frames").is_dir() else sorted(clip.glob("*.png"))
    path = _one(frames, rng)
    stem = path.stem.rstrip("0123456789")
    name = str(
        rng.choice([
            f"{stem}{'9' * 40}.png", f"{stem}{'9' * 200}.png", f"{stem}00000000000000000001.png", f"{stem}.png",
            f"{stem}1000000000.png", f"{stem}\n0001.png", f"{stem}0001.PNG", f"{stem}\u0663.png", f"{stem}²2.png",
            f"{stem}0001.exr", f"{stem}0001.dng", f"{stem}0001.tif", f"{stem}0001.mov", f"%s{stem}0001.png",
        ])
    )  # fmt: skip
    path.rename(path.with_name(name))
    return f"{path.name} is named {name[:60]!r}"


def nested(clip: Path, rng: Rng) -> str:
    """Put a folder with an absurd name, or a link to the folder itself, into the clip."""
    if rng.integers(0, 2):
        name = str(rng.choice(("frames", "truth", "loop", "plates", "normals")))
        place = clip / name
        if not place.exists():
            place.symlink_to(clip, target_is_directory=True)
        return f"{name} is a link to the clip itself"
    place = clip
    for _ in range(60):
        place = place / "d"
        place.mkdir()
    return "folders 60 deep"


def moved(clip: Path, rng: Rng) -> str:
    """Give the clip's folder a strange name."""
    name = str(rng.choice(NAMES))
    clip.rename(clip.with_name(name))
    return f"the clip is named {name[:40]!r}"


KINDS: tuple[Callable[[Path, Rng], str], ...] = (absurd, absurd, lines_again, damaged, not_a_file, named, nested, moved)


def _one(items: Sequence[Item], rng: Rng) -> Item:
    return items[int(rng.integers(0, len(items)))]


def tried(folder: Path, *, seed: int) -> Iterator[tuple[str, Ran]]:
    """Make a clip hostile in ever new ways, and give what commands made of it, with the kind of hostility."""
    rng = np.random.default_rng(seed)
    for name in LOADED:
        import_module(name)
    clip = made(folder)
    while True:
        kind = _one(KINDS, rng)
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
