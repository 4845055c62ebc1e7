"""Where doubt is narrow, normals continue across it: at edges of paint of what moves, where plates lie a part of a
pixel beside each other, and at edges of shadows of what stands.

A strip of a pixel or two, on whose both sides normals are trusted and agree, is no hole in the surface, and no crease
either where it is an edge of paint. Its normals are means of what was solved there and of a plane through those around,
each counted by its error.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Mask
from psvideo.model.surface import Surface
from psvideo.solve.normals.trust.continued_part import BAND_ROWS, AskedPixels, ContinuedPart
from psvideo.solve.normals.trust.moving_doubt import at_points

FINEST = 2
"""So many pixels go to one of a grid on which motion is found: strips are twice as wide where it is twice that."""
OF_AROUND = 0.8
"""So much of the errors around is common to them, and stays, where motion makes them; where things stand all of it is:
it comes of the rig or the surface."""


def continued(surface: Surface, moves: Mask, *, limit_deg: float) -> Surface:
    """Return the surface with normals that are trusted on across narrow doubt and edges of paint in what ``moves``, a
    mask on a grid of its own. Beside these, what was trusted stays; ``limit_deg`` is the error up to which a normal is.
    The surface's memory is taken over; one without errors passes as it is."""
    error = surface.error_deg
    if error is None:
        return surface
    shape = error.shape
    stride = max(round(shape[1] / moves.shape[1] / FINEST), 1)
    return _continued(
        surface,
        error,
        at_points(moves, shape),
        AskedPixels(limit_deg=limit_deg, stride=stride, of_around=OF_AROUND, at_paint=True),
    )


def continued_at_rest(surface: Surface, moves: Mask | None, *, limit_deg: float) -> Surface:
    """Return the surface with normals that are trusted on across narrow doubt in what does not move: edges of shadows,
    and where noise is a little too much. There plates lie on each other, and edges of paint turn nothing."""
    error = surface.error_deg
    if error is None:
        return surface
    rests = None if moves is None else ~at_points(moves, error.shape)
    return _continued(surface, error, rests, AskedPixels(limit_deg=limit_deg, stride=1, of_around=1.0, at_paint=False))


def _continued(surface: Surface, error: NDArray[np.floating], there: Mask | None, asked: AskedPixels) -> Surface:
    found = [
        part.taken(asked)
        for first in range(0, len(error), BAND_ROWS)
        if (part := ContinuedPart.around((surface, error), there, asked, first)) is not None
    ]
    if not found:
        return surface
    valid = surface.valid.copy()
    for (rows, cols), normals, errors_deg in found:  # after all were looked at: what is told is what was solved
        surface.normals[rows, cols] = normals.astype(surface.normals.dtype)
        error[rows, cols] = errors_deg.astype(error.dtype)
        valid[rows, cols] = True
    return replace(surface, valid=valid)
