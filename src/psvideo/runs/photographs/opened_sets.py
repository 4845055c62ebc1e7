"""Pictures of a scene, one per light and as often as it was taken, once opened; and how they are to be read."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures

MOST_SETS = 12
"""Rounds that are read where the user names no frames: more would hardly make a calibration better."""


@dataclass(frozen=True, kw_only=True)
class LightSets:
    """What shows each light by itself, as many times as it was taken. ``sets`` can be gone through once.

    ``room`` is a picture under room light, where one lies beside stills or plates; ``taken_as_dark`` whether nothing
    shows these with all lamps off.
    """

    name: str
    names: tuple[str, ...]
    sets: Iterator[LightPictures]
    room: NDArray[np.float32] | None = None
    taken_as_dark: bool = False
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How pictures of lights are to be read.

    ``plan`` names the plan where none lies beside the pictures; ``frames`` chooses file numbers of a clip, or sets
    counted from 1; ``transfer`` says how stills code light (left out: as the plan says; without a plan as the files do,
    else sRGB for JPEG, and linear for other kinds). A clip is read as its plan says.
    """

    plan: Path | None = None
    frames: str | None = None
    first_light: str | None = None
    transfer: str | None = None
    most: int = MOST_SETS
