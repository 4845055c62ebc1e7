"""Plates turned upright, for cameras that were held on their side or upside down.

Frames and recipes stay as the sensor read them. A turned plate is computed at once, and held in 16-bit codes.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.turn import Turn
from psvideo.plates.align.packed import packed
from psvideo.plates.ambient.ambient_regression import Separated
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.several_lights.clipped_flashes import with_filled


def upright(plate: LightPlate, turn: Turn) -> LightPlate:
    """Return a plate as it is to be seen, with what is known of its rows."""
    if turn.is_none:
        return plate
    picture = packed(mixture_of(turn.upright(plate.image)), plate.saturation)
    filled = with_filled(plate).filled
    return replace(
        plate,
        picture=picture,
        seen=_seen(plate, turn),
        shown_s=_shown_s(plate, turn),
        sideways=plate.sideways != turn.transposed,
        filled=None if filled is None else turn.upright(np.array(filled)),
    )


def upright_window(found: Separated, turn: Turn) -> Separated:
    """Return a window's ambient light as it is to be seen, (row, col) in all its pictures."""
    if turn.is_none:
        return found
    known = np.broadcast_to(found.known[:, None], found.image.shape[:2])
    return replace(
        found, image=turn.upright(found.image), stood=turn.upright(found.stood), known=turn.upright(np.array(known))
    )


def _seen(plate: LightPlate, turn: Turn) -> NDArray[np.bool_]:
    """Return what is known of the turned plate: of rows where it may be, (row,), else of pixels."""
    if plate.seen.all():
        return np.ones(plate.shape[1 if turn.transposed else 0], np.bool_)
    if turn.transposed or plate.seen.ndim == 2:
        return turn.upright(np.array(plate.pixels_seen))
    return plate.seen[:: -1 if turn.rows_flipped else 1]


def _shown_s(plate: LightPlate, turn: Turn) -> Doubles | None:
    """Return the instants that the turned plate's rows show, or its pixels where the sensor's rows are columns now."""
    if plate.shown_s is None:
        return None
    if not turn.transposed:
        return plate.shown_s[:: -1 if turn.rows_flipped else 1]
    return turn.upright(np.broadcast_to(plate.shown_s[:, None], plate.shape[:2]))
