"""A picture of one instant for eyes."""

import numpy as np
from numpy.typing import NDArray

from psvideo.pipeline import (
    Instant,
)
from psvideo.view.contact import Strip, Tile, sheet
from psvideo.view.shading import exposure_for, normal_colours, smaller, srgb

Pixels = NDArray[np.uint8]
SHOWN_WIDTH_PX = 600


def look(instant: Instant) -> Pixels:
    """Return a picture of one instant for eyes: its plates, its normals and its albedo."""
    shown = [(plate.light, smaller(plate.image, SHOWN_WIDTH_PX)) for plate in instant.round.plates]
    exposure = exposure_for(shown[0][1])
    albedo = smaller(instant.surface.albedo, SHOWN_WIDTH_PX)
    normals = smaller(instant.surface.normals, SHOWN_WIDTH_PX)
    surface = [Tile("normals", normal_colours(normals)), Tile("albedo", srgb(albedo, exposure=exposure_for(albedo)))]
    plates = [Tile(light, srgb(picture, exposure=exposure)) for light, picture in shown]
    return sheet([Strip("Plates, one per light", plates), Strip("Surface", surface)], width_px=1200)
