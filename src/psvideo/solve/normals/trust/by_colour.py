"""Albedo that pales where it does not darken: a surface mirrors its lamps, which are white beside its own colour.

What a coloured surface sends back is its own colour, and the lamp's where it shines (S. Shafer, "Using color to
separate reflection components", Color Research & Application 10, 1985). Divided by the lamps' colours, a sheen is
white: the albedo of what shines lies between the subject's colour and white, while the part of it that is no white
stays. Paint changes that part as well. Three lights leave nothing over; but how pale a normal's albedo is says which
share of it was mirrored, and how the lights spread that says by how much the normal is turned.
"""

import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Floats, Mask
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.trust.thin_surface import ThinSurface, blurred, width_of

FINE, AROUND = 3, 0.05
"""Colours are means over squares of so many points; and what is around a point, as a share of the subject's size."""
GREY, COLOURED = 0.12, 0.2
"""A subject's colour, over its mean, is so far from white: up to the first it tells nothing, from the second on all.
(Three photographed objects: a cat 0.15, a ball 0.4, a bear 0.7.)"""
PAINT, OWN = 0.7, 0.9
"""Where the part that is no white is below the first share of what is typical, something else is painted there; from
the second on it is the subject's."""
STEADY, EDGE = 0.2, 0.35
"""Where the logarithm of that part varies around by the second number, paint ends there; up to the first none does.
(Of photographed and rendered sheen 0.01 to 0.1, a ball's small highlights 0.05 to 0.5, a bust's paint 0.3 to 0.8.)"""
ON_THE_WAY, BESIDE = 0.3, 0.6
"""A colour that lies beside the way to white by the second share of how far it went is another one, up to the first it
is not."""
ALL_WHITE, BEYOND = 0.85, 1.1
"""Nothing that shines goes beyond white: from the second number on it is paint of another colour."""
OF_NOISE = 2.0
"""What is paler by less than so many times of what the finest detail differs by is noise."""
COUNTS, LARGEST_DEG = 0.6, np.float32(30)
"""Normals are turned by so much of what their paleness says; what that says by as many degrees as the second number
counts half, and nothing counts more."""
TYPICAL_OF_MEDIAN = 1.48


def by_colour_deg(points: ThinSurface, lit: Illumination, known: Mask) -> Floats:
    """Return by how many degrees normals are turned by what their surface mirrors, as far as colour shows it, (row,
    col) of the points, of which these ``known`` speak for the subject; zeros for a grey one, and for grey pictures."""
    colours = _mean_colours(points, known, FINE)
    white = None if colours is None else paleness(colours, known)
    if white is None:
        return np.zeros(known.shape, np.float32)
    across, along = spread_across_and_along(points, lit, known)
    turned = np.degrees(white) * np.sqrt(across / np.maximum(along, np.float32(1e-12)))
    around = np.maximum(_mean(turned * turned, known, width_of(known, AROUND)), 0)  # running sums end below nothing
    shown = np.float32(COUNTS) * np.sqrt(around)
    return np.asarray(shown / (1 + shown / LARGEST_DEG), np.float32)


def paleness(colours: Floats, known: Mask) -> Floats | None:
    """Return which share of albedo, (3, row, col), is light that was mirrored, (row, col), as far as it surely is that
    and no paint; None where the ``known`` points are grey."""
    mean = np.maximum(colours.mean(axis=0), np.float32(1e-6))
    each = colours / mean
    own = np.array([median(plane[known]) for plane in each], np.float32)
    to_white = 1 - own
    coloured = float(to_white @ to_white) ** 0.5
    if coloured <= GREY:
        return None
    pale = np.asarray(np.tensordot(to_white, each - own[:, None, None], axes=1) / coloured**2, np.float32)
    off = each - own[:, None, None] - pale * to_white[:, None, None]
    aside = np.sqrt((off * off).sum(axis=0)) / coloured / np.maximum(pale, np.float32(1e-3))
    no_white = np.maximum(np.sqrt(((colours - mean) ** 2).sum(axis=0)), np.float32(1e-6))
    no_white = np.asarray(no_white / median(no_white[known]), np.float32)
    finest = TYPICAL_OF_MEDIAN * median(np.abs(pale - _mean(pale, known, width_of(known, 0)))[known])
    share = np.maximum(pale - np.float32(OF_NOISE * finest), 0)
    share *= _rising(np.float32(coloured), GREY, COLOURED)
    share *= _rising(no_white, PAINT, OWN)
    share *= 1 - _rising(
        _varies(np.asarray(np.log(no_white), np.float32), known, width_of(known, AROUND)), STEADY, EDGE
    )
    share *= 1 - _rising(np.asarray(aside, np.float32), ON_THE_WAY, BESIDE)
    share *= 1 - _rising(pale, ALL_WHITE, BEYOND)
    return np.asarray(share * known, np.float32)


def painted(points: ThinSurface, known: Mask, width: int) -> Floats:
    """Return how far colour lies beside the subject's own and white, (row, col), means over squares of so many points:
    nothing that a surface mirrors goes there, only other paint. As far as the subject is coloured, else zeros."""
    nothing, colours = np.zeros(known.shape, np.float32), _mean_colours(points, known, width)
    if colours is None:
        return nothing
    colours /= np.maximum(colours.mean(axis=0), np.float32(1e-6))
    own = np.array([median(plane[known]) for plane in colours])
    coloured = float(np.linalg.norm(1 - own))
    if coloured <= GREY:
        return nothing
    beside = np.cross(own, np.ones(3))
    beside *= _rising(np.float32(coloured), GREY, COLOURED) / np.linalg.norm(beside)
    return np.asarray(np.tensordot(beside.astype(np.float32), colours, axes=1), np.float32)


def spread_across_and_along(points: ThinSurface, lit: Illumination, known: Mask) -> tuple[Floats, Floats]:
    """Return the squares of how far lights spread what each is off by across every normal and along it, (row, col).

    Where normals are turned to the direction in which it spreads farthest, little of it is left across them, and that
    tells nothing: it counts for no less than around them.
    """
    inverse = np.linalg.pinv(lit.directions)
    spread = (inverse @ inverse.T).astype(np.float32)
    along = np.einsum("irc,ij,jrc->rc", points.planes, spread, points.planes)
    across = np.maximum(np.float32(np.trace(spread)) - along, np.float32(0))
    return np.maximum(across, _mean(across, known, points.widths[0])), along


def _mean_colours(points: ThinSurface, known: Mask, width: int) -> Floats | None:
    """Return the mean albedo of known points over squares, (3, row, col); None of grey pictures, or where none is."""
    if points.surface.albedo.ndim == 2 or not known.any():
        return None
    squares = blurred(known.astype(np.float32), width)
    planes = np.moveaxis(points.surface.albedo, -1, 0).astype(np.float32)
    return np.stack([_mean(plane, known, width, squares) for plane in planes])


def _mean(plane: Floats, known: Mask, width: int, squares: Floats | None = None) -> Floats:
    """Return the mean of known points over squares; ``squares`` is which share of them is known."""
    if squares is None:
        squares = blurred(known.astype(np.float32), width)
    return np.asarray(
        blurred(np.asarray(plane * known, np.float32), width) / np.maximum(squares, np.float32(1e-6)), np.float32
    )


def _varies(plane: Floats, known: Mask, width: int) -> Floats:
    """Return the standard deviation of known points over squares."""
    mean = _mean(plane, known, width)
    return np.asarray(np.sqrt(np.maximum(_mean(plane * plane, known, width) - mean * mean, 0)), np.float32)


def _rising(value: Floats | np.float32, least: float, most: float) -> Floats:
    """Return 0 up to the least, 1 from the most on, and what lies between."""
    return np.asarray(np.clip((value - np.float32(least)) / (most - least), 0, 1), np.float32)
