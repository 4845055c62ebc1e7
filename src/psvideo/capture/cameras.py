"""The table of camera modes that come with the package: how big, how fast, how long a frame takes to read.

``cameras.csv`` has one row per mode, each with the source of its readout time and how certain it is; where the figures
come from, and how to measure one's own camera, stands in ``calibration/README.md``.
"""

import csv
import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from importlib.resources import files
from typing import Literal, cast

from psvideo.errors import UsageError
from psvideo.model.units import show_rate

Sureness = Literal["measured", "consistent", "single", "specification", "assumed"]
RATE_TOLERANCE = Fraction(15, 10_000)
"""A mode of 119.88 fps is meant by 120 as well; 100 is another mode."""

HOW_TO_MEASURE = (
    "Measure it with an LED that blinks at a known rate (calibration/README.md: readout = height in rows / rows per "
    "stripe period / LED rate), or give `readout_s` unknown, and always the mode itself: `fps` 120 `size_px` 1920x1080."
)
FAMILIES = {"EOS", "Lumix"}
NOISE_WORDS = {"mark", "mk", "alpha", "camera"}


@dataclass(frozen=True, kw_only=True)
class CameraMode:
    """One row of the table. ``readout_s`` is 0 for a global shutter, negative where the bottom row comes first.

    ``sure`` says what the readout rests on: ``measured`` (a laboratory's or a documented LED measurement),
    ``consistent`` (several profiles agree), ``single`` (one user's or maker's profile), ``specification`` (the
    maker's data), ``assumed`` (nobody measured it).
    """

    make: str
    model: str
    mode: str
    width_px: int
    height_px: int
    fps: Fraction
    readout_s: float
    sure: Sureness
    source: str

    @property
    def name(self) -> str:
        """Make and model, as a plan names the camera."""
        return f"{self.make} {self.model}"


ALIKE = 0.75
"""A name shares its maker or most of its letters with what was typed, or it is another camera's."""


@cache
def camera_modes() -> tuple[CameraMode, ...]:
    """Return the whole table, in the order of makes and models."""
    text = files("psvideo.capture").joinpath("cameras.csv").read_text(encoding="utf-8")
    return tuple(_mode(row) for row in csv.DictReader(text.splitlines()))


def _mode(row: dict[str, str]) -> CameraMode:
    sign = -1 if row["direction"] == "bottom-up" else 1
    return CameraMode(
        make=row["make"],
        model=row["model"],
        mode=row["mode"],
        width_px=int(row["width_px"]),
        height_px=int(row["height_px"]),
        fps=Fraction(row["fps"]),
        readout_s=sign * float(row["readout_ms"]) / 1e3,
        sure=cast(Sureness, row["sure"]),
        source=row["source"],
    )


def find_model(wanted: str) -> tuple[CameraMode, ...]:
    """Return all modes of the camera that is meant, or nothing where no single model is.

    Case, spaces, hyphens, the make, ``Mark`` and Roman or Arabic numbers make no difference. Words in the middle may be
    left out, and the last one not: an iPhone 7 is no iPhone 7 Plus, and has another readout.

    >>> {mode.name for mode in find_model("a7siii")}, find_model("sony")
    ({'Sony A7S III'}, ())
    """
    key, words = _key(wanted), _words(wanted)
    by_name = _by_name()
    for names in (
        [name for name, modes in by_name.items() if key in _keys(modes[0])],
        [name for name in by_name if words and _says(words, name)],
    ):
        if len(names) == 1:
            return by_name[names[0]]
    return ()


def _says(words: Sequence[str], name: str) -> bool:
    """Return whether all words are words of a camera's name, its last among them; what stands in [] may be left out."""
    whole, plain = _words(name), _words(name.partition("[")[0])
    known = {"".join(whole[first:last]) for last in range(len(whole) + 1) for first in range(last)}
    return all(word in known for word in words) and words[-1].endswith(plain[-1])


def nearest_names(wanted: str, *, count: int = 4) -> tuple[str, ...]:
    """Return the names in the table that come close to what was typed, best first; none where nothing is like it.

    Where the maker was named, or the maker's word for a series (iPhone, Galaxy), they are all of this maker.
    """
    key, words = _key(wanted), _words(wanted)

    def likeness(name: str) -> float:
        shared = sum(word in _key(name) for word in words if not word.isdigit()) / max(len(words), 1)
        return shared + max(difflib.SequenceMatcher(None, key, part).ratio() for part in _keys(_by_name()[name][0]))

    makers = _makers_named(words)
    found = {name: likeness(name) for name, modes in _by_name().items() if not makers or modes[0].make in makers}
    return tuple(sorted((name for name in found if found[name] >= ALIKE), key=lambda name: -found[name])[:count])


def _makers_named(words: Sequence[str]) -> set[str]:
    """Return the makers of which the maker's or a series' first word is among these."""
    return {
        mode.make
        for mode in camera_modes()
        for name in (mode.make, mode.model)
        if (first := _words(name)[0]) in words and first.isalpha() and len(first) > 2
    }


def find_mode(wanted: str, *, fps: Fraction | None, size_px: tuple[int, int] | None) -> CameraMode:
    """Return the one mode that is meant; raises UsageError that lists the near ones where none or several are."""
    modes = find_model(wanted)
    if not modes:
        names = ", ".join(repr(name) for name in nearest_names(wanted))
        near = f"the nearest are {names}" if names else "nor is any like it"
        raise UsageError(
            f"`camera` {wanted!r} is not in the table; {near} (all: `list_cameras`). For a camera "
            f"that is not there the readout time is needed. {HOW_TO_MEASURE}"
        )
    fitting = [mode for mode in modes if fits(mode, fps=fps, size_px=size_px)]
    if len(fitting) == 1:
        return fitting[0]
    what = "has several modes" if fitting else "is in the table, but not in this mode"
    raise UsageError(
        f"`camera` {wanted!r}: {modes[0].name} {what}. In the table: {_listed(modes)}. Say which with `fps` and "
        "`size_px`, or give `fps`, `size_px` and `readout_s` of the mode that you use."
    )


def fits(mode: CameraMode, *, fps: Fraction | None, size_px: tuple[int, int] | None) -> bool:
    """Return whether a mode has this frame rate (or the one that it is a rounding of) and this size."""
    return (fps is None or abs(fps / mode.fps - 1) < RATE_TOLERANCE) and (
        size_px is None or size_px == (mode.width_px, mode.height_px)
    )


def _listed(modes: Sequence[CameraMode]) -> str:
    return "; ".join(f"{mode.width_px}x{mode.height_px} at {show_rate(mode.fps)}" for mode in modes)


@cache
def _by_name() -> dict[str, tuple[CameraMode, ...]]:
    modes = camera_modes()
    return {name: tuple(mode for mode in modes if mode.name == name) for name in dict.fromkeys(m.name for m in modes)}


def _words(name: str) -> list[str]:
    """Return the name's words in lower case, numbers in Arabic: ``A7S III`` and ``a7siii`` both end in 3."""
    plain = re.sub(r"[α]", " a", name.lower())
    words = [word for word in re.findall(r"[a-z0-9.]+", plain) if word not in NOISE_WORDS]
    if words:
        words[-1] = re.sub(r"^v$|(?<=\d[a-z])v$", "5", words[-1])
    return [word.replace("iii", "3").replace("ii", "2").replace("iv", "4") for word in words]


def _key(name: str) -> str:
    return "".join(_words(name))


def _keys(mode: CameraMode) -> set[str]:
    """Return all keys by which a camera goes: EOS R5 is called R5 too, Lumix GH7 is called GH7."""
    family, _, rest = mode.model.partition(" ")
    short = {_key(rest), _key(f"{mode.make} {rest}")} if family in FAMILIES else set()
    return {_key(mode.name), _key(mode.model), *short}
