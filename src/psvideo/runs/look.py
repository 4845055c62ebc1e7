"""A picture of one instant for eyes."""

import numpy as np
from numpy.typing import NDArray

from psvideo.pictures.contact import Strip, Tile, sheet
from psvideo.pictures.quantity import picture_of
from psvideo.pictures.relighting import exposure_for, smaller, smaller_by_rows, srgb
from psvideo.plates.sequence import Round
from psvideo.solve.instants import Instant

Pixels = NDArray[np.uint8]
SHOWN_WIDTH_PX, WIDE_PX = 600, 1200


def look(instant: Instant) -> Pixels:
    """Return a picture of one instant for eyes: its plates, its normals and its albedo."""
    albedo = smaller(instant.surface.albedo, SHOWN_WIDTH_PX)
    normals = smaller(instant.surface.normals, SHOWN_WIDTH_PX)
    surface = [Tile(name, picture_of(name, image)) for name, image in (("normals", normals), ("albedo", albedo))]
    return sheet([_plates(instant.round), Strip("Surface", surface)], width_px=WIDE_PX)


def look_at_plates(one: Round) -> Pixels:
    """Return a picture of one round's plates for eyes."""
    return sheet([_plates(one)], width_px=WIDE_PX)


def _plates(one: Round) -> Strip:
    shown = [
        (plate.light, smaller_by_rows(plate.picture.reader(), plate.shape, SHOWN_WIDTH_PX)) for plate in one.plates
    ]
    exposure = exposure_for(shown[0][1])
    return Strip("Plates, one per light", [Tile(light, srgb(picture, exposure=exposure)) for light, picture in shown])
