"""Whether the pictures of a light, set after set, are of one still scene at one exposure."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.runs.steps.caller import Caller

MOST_DIFFERENT = 0.2
"""Share of its light by which a light's pictures may differ. Noise and motion at the edges of a subject stay below, an
exposure wrong by a quarter of a stop reaches it, and so do, of twelve photographs under other lights, some two."""
RUN_PX = 16
"""Noise of a sum over this many pixels is a quarter of the pixels' own, beside their light."""


def compared(sets: Iterator[LightPictures], where: Path, caller: Caller) -> Iterator[LightPictures]:
    """Hand on sets as they come, and say at the end which light's pictures differ from its first one."""
    first: LightPictures | None = None
    worst, light, at = 0.0, "", 0
    for number, one in enumerate(sets, start=1):
        first = first or one
        both = (first.seen & one.seen).reshape(*one.seen.shape, *[1] * (one.images.ndim - 2))
        axes = tuple(range(1, one.images.ndim))
        away = np.abs(_in_runs(one.images - first.images)).sum(axis=axes, where=both)
        shares = away / np.maximum(np.abs(_in_runs(one.images + first.images)).sum(axis=axes, where=both) / 2, 1e-9)
        if shares.max() > worst:
            worst, light, at = float(shares.max()), one.names[int(shares.argmax())], number
        yield one
    if worst > MOST_DIFFERENT:
        caller.warn(
            f"{where}: pictures 1 and {at} of light {light!r} differ by {worst:.0%} of their light. Expected pictures "
            "of one still scene, each light in a folder of its own with one exposure: the mean is taken. Where the "
            "folders are scenes of their own, name one of them; where the subject or the exposure changed, choose "
            "pictures with `frames`, or take them again."
        )


def _in_runs(images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return sums over short runs of columns: of a dark picture with small highlights, noise is most of each pixel."""
    sums: NDArray[np.float32] = np.add.reduceat(images, np.arange(0, images.shape[2], RUN_PX), axis=2)
    return sums
