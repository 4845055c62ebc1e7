"""Ways to make a clip's folder hostile: absurd values and names, damage, and what is no file or folder at all.

Each takes a folder and a random generator, changes the folder, and returns what it did, in words.
"""

import contextlib
import os
import re
import socket
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from bench.hostile import CHANGES

Rng = np.random.Generator
Item = TypeVar("Item")
DEEP = 3000
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


def one_of(items: Sequence[Item], rng: Rng) -> Item:
    """Return one of some things by chance."""
    return items[int(rng.integers(0, len(items)))]


def texts_in(clip: Path) -> list[Path]:
    """Return the texts of a clip, and of its results."""
    found = [path for path in clip.rglob("*") if path.suffix in (".toml", ".json", ".lp", ".txt") and path.is_file()]
    return sorted(found)


def absurd(clip: Path, rng: Rng) -> str:
    """Replace some values of a text of the clip with absurd ones; return what was done."""
    path = one_of(texts_in(clip), rng)
    text = path.read_text(encoding="utf-8")
    places = [*TOKEN.finditer(text)]
    for _ in range(int(rng.integers(1, 3))):
        at, value = one_of(places, rng), str(rng.choice(VALUES))
        if path.suffix == ".lp" or path.suffix == ".txt":
            value = value.strip('"')
        text = text[: at.start()] + value + text[at.end() :]
        places = [*TOKEN.finditer(text)] or places[:1]
    path.write_text(text, encoding="utf-8")
    return f"{path.name}: {value[:60]} at {at.start()}"


def lines_again(clip: Path, rng: Rng) -> str:
    """Leave out, repeat or swap some lines of a text."""
    path = one_of(texts_in(clip), rng)
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
    path = one_of(sorted(path for path in clip.rglob("*") if path.is_file()), rng)
    data = bytearray(path.read_bytes())
    for _ in range(int(rng.integers(1, 4))):
        if data:
            data = CHANGES[int(rng.integers(0, len(CHANGES)))](data, rng)
    path.write_bytes(data)
    return f"{path.name}: damaged"


def not_a_file(clip: Path, rng: Rng) -> str:
    """Put something else in the place of a file: a pipe, a device, a folder, a link in a circle, nothing."""
    path = one_of(sorted(path for path in clip.rglob("*") if path.is_file()), rng)
    other = one_of(sorted(path for path in clip.rglob("*") if path.is_file()), rng)
    data = other.read_bytes()
    path.unlink()
    what = one_of([*PLACED], rng)
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
    path = one_of(frames, rng)
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
