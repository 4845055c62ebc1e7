"""Frames whose flashes are not to be trusted: what lies in the dark, and what is odd beside a break.

A strobe that stops or begins again does so within a frame, which then shows some of both; missing frames before or
after it stand for the jump. Which flashes such a frame saw, no fit knows. Nor does it of a few frames between two
breaks, which fit somewhere by chance, or of those in which no flash lights anything.
"""

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Integers
from psvideo.sync.rowfit.coarse.retime import regular_step
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS, frame_losses

BESIDE = 2
"""Frames on either side of a break, or at an end, that may show some of what was before it and of what came after."""
ODD, LEAST_ODD = 6.0, 0.03
"""A frame there is odd whose loss is higher than usual by this many usual scatters, and by this much: a flash lights
few of its rows."""
FEW = 6
"""Fewer frames than this between two breaks fit by chance."""


def doubted_places(found: ClipFit, numbered: NDArray[np.int64]) -> Integers:
    """Return the places in time, ascending, of frames in which a fit's flashes are not to be trusted.

    ``numbered`` (frame,) are the places of all of the clip's frames by their numbers.
    """
    places, dark = found.track.index, found.unlit
    lit = np.flatnonzero(~dark & ~found.track.repeated)
    retimed = regular_step(places, numbered) != 1  # then frames that are missing or repeated by rule are no breaks
    stray = np.zeros_like(places) if retimed else places - numbered
    breaks = np.flatnonzero((np.diff(stray[lit]) != 0) | (np.diff(np.cumsum(dark)[lit]) > 0)) + 1
    near = np.zeros(len(lit), np.bool_)
    for at in (0, *breaks.tolist(), len(lit)):
        near[max(at - BESIDE, 0) : at + BESIDE] = True
    loss = frame_losses(found.rows, found.fit.rest)
    usual = float(np.median(loss))
    scatter = 1.4826 * float(np.median(np.abs(loss - usual)))
    near &= loss > usual + min(max(ODD * scatter, LEAST_ODD), SUSPICIOUS)
    inner = np.diff(breaks) < FEW
    for first, end in zip(breaks[:-1][inner].tolist(), breaks[1:][inner].tolist(), strict=True):
        near[first:end] = True
    doubted: Integers = np.unique(np.concatenate([places[lit[near]], places[dark]]))
    return doubted
