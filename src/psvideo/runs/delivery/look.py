"""A picture of one instant for eyes."""

from psvideo.model.arrays import Pixels
from psvideo.pictures.contact import Strip, Tile, sheet
from psvideo.pictures.on_screen import exposure_for, smaller, smaller_by_rows, srgb
from psvideo.pictures.quantity import picture_of
from psvideo.plates.sequence import Round
from psvideo.solve.instants import Instant

SHOWN_WIDTH_PX, WIDE_PX = 600, 1200
SAMPLE_ROUND = 3
"""The round that the report shows, counted from 1; the first where it is not there."""


def instant_sheet(instant: Instant) -> Pixels:
    """Return a picture of one instant for eyes: its plates, its normals and its albedo."""
    albedo = smaller(instant.surface.albedo, SHOWN_WIDTH_PX)
    normals = smaller(instant.surface.normals, SHOWN_WIDTH_PX)
    surface = [Tile(name, picture_of(name, image)) for name, image in (("normals", normals), ("albedo", albedo))]
    return sheet([_plates(instant.round), Strip("Surface", surface)], width_px=WIDE_PX)


def plates_sheet(one: Round) -> Pixels:
    """Return a picture of one round's plates for eyes."""
    return sheet([_plates(one)], width_px=WIDE_PX)


def _plates(one: Round) -> Strip:
    tiles: list[Tile] = []
    exposure: float | None = None
    for plate in one.plates:  # one after the other: in linear light each takes as much as all of them as pixels
        shown = smaller_by_rows(plate.picture.reader(), plate.shape, SHOWN_WIDTH_PX)
        exposure = exposure_for(shown) if exposure is None else exposure
        tiles.append(Tile(plate.light, srgb(shown, exposure=exposure)))
    return Strip("Plates, one per light", tiles)
