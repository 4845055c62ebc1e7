"""Edges that one light shows and no other: plates that were brought to one instant and do not show the same thing.

Where something goes through its own period from flash to flash or from round to round (a fan, a checker, a facet for
the next), the plates of every light agree along a false motion, or at rest, and three lights explain any three
brightnesses. But what is an edge in a surface, of its paint or its shape, is one under every light that reaches it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Codes8, Flags, Floats
from psvideo.plates.align.velocity.brightness import SCALE, light_of
from psvideo.plates.align.velocity.flow import TOE, Sketch

SMOOTH_PX, BESIDE_PX = 1.0, 3
"""Edges are looked for in sketches smoothed by the first, and found again over a window of the second."""
SHADING_PX, STEEPEST = 11, np.float32(0.2)
"""What falls off evenly over such a window, by no more than the second, is shading, and may be one light's alone: on a
wave, a fold, a small ball. Edges are narrower or steeper."""
ALONE = 2.5
"""An edge is alone where it is this many times what any other light shows of it: shading makes edges differ by less."""
LEAST_EDGE, OF_NOISE = 0.04, 2.7
"""Steps below the first (of the logarithm of light), or below this many times the noise, are no edges."""
SHADOW, SHADOW_PX, PENUMBRA_PX = 0.12, 5, 5
"""Where light falls below this share of what it is within such a window it is the edge of a shadow, which is alone; so
is what lies around it within a second window, where the smoothing leaves steps of it."""
LEAST_LIT = 0.04
"""What shows less light, as a share of white, says nothing of edges."""
FEWEST = 3
"""This many lights must show something of a pixel."""
AROUND_SHARE = 1 / 8
"""Edges speak for what lies within this share of the picture's longer side."""
USUAL, UNSURE = 0.01, 5.0
"""Edges speak where their mean step over all pixels around exceeds the first (subjects that are followed correctly,
painted or bare: 0.009 on average); what is beyond it, times the second, is the share by which light may be off."""

FOLLOWED = 0.3
"""Where all lights agree with a motion, this share of that counts: what is followed has its edges slightly off."""


@dataclass(frozen=True, kw_only=True)
class InstantSketch:
    """What a light shows at an instant: the ``codes`` of a sketch (row, col), ``white``, the light of the brightest,
    and the ``noise`` of what changes between two of them, in codes. ``used`` (row, col) is where the light's plate is
    used, None where it is everywhere: nobody sees its edges elsewhere."""

    codes: Codes8
    white: float
    noise: float
    used: Flags | None = None

    @classmethod
    def standing(cls, sketch: Sketch, shape: tuple[int, ...]) -> "InstantSketch":
        """Return what a light shows under which nothing moved, on a grid of its own."""
        codes = cv2.resize(sketch.codes, shape[::-1], interpolation=cv2.INTER_AREA)
        return cls(codes=np.asarray(codes, np.uint8), white=sketch.white, noise=0.0)


def unsure_by_lone_edges(shown: Sequence[InstantSketch], moves: Flags) -> list[Floats]:
    """Return by how much every light's plate may be off because lights do not show the same edges, each (row, col), in
    units of its light. ``moves`` says where a motion was found that all lights agree with."""
    if len(shown) < FEWEST:
        return [np.zeros(one.codes.shape, np.float32) for one in shown]
    around = max(round(max(shown[0].codes.shape) * AROUND_SHARE) | 1, 3)
    noise = max(one.noise for one in shown)
    mean = cv2.blur(_lone(shown, noise), (around, around))
    share = np.float32(UNSURE * np.sqrt(len(shown) / FEWEST)) * np.maximum(mean - np.float32(USUAL), 0)
    share *= np.where(moves, np.float32(FOLLOWED), np.float32(1))
    return [share * light_of(one.codes.astype(np.float32)) * np.float32(one.white) for one in shown]


def _lone(shown: Sequence[InstantSketch], noise: float) -> Floats:
    """Return how much of an edge is alone, (row, col), as a step in the logarithm of light."""
    edges = over_ranges(lambda n, _: _edges(shown[n], noise), len(shown), each=1)
    lit = np.sum([here for _, _, here in edges], axis=0, dtype=np.int16) >= FEWEST
    wide = [cv2.dilate(step * here, np.ones((BESIDE_PX, BESIDE_PX), np.uint8)) for step, _, here in edges]
    first, second = np.zeros((2, *lit.shape), np.float32)  # the widest two, so that each light is held against others
    for each in wide:
        np.maximum(second, np.minimum(first, each), out=second)
        np.maximum(first, each, out=first)
    alone = np.zeros(lit.shape, np.float32)
    for (step, least, here), own in zip(edges, wide, strict=True):
        others = np.where(own >= first, second, first)
        np.maximum(alone, (step - np.float32(ALONE) * others - least) * here, out=alone)
    return np.asarray(alone * lit, np.float32)


def _edges(one: InstantSketch, noise: float) -> tuple[Floats, Floats, Floats]:
    """Return steps in the logarithm of light over three pixels, the least that is one and no shading, and 1 where light
    is enough."""
    light = cv2.GaussianBlur(light_of(one.codes.astype(np.float32)), (0, 0), SMOOTH_PX)
    level = np.log(light + np.float32(TOE))
    across, down = (cv2.Sobel(level, cv2.CV_32F, *way, scale=3 / 8) for way in ((1, 0), (0, 1)))
    even = (cv2.blur(np.clip(way, -STEEPEST, STEEPEST), (SHADING_PX,) * 2) for way in (across, down))
    least = np.float32(LEAST_EDGE) + np.float32(OF_NOISE / SCALE * noise) / np.sqrt(light + np.float32(TOE))
    window = np.ones((SHADOW_PX, SHADOW_PX), np.uint8)
    dim, bright = cv2.erode(light, window), cv2.dilate(light, window)
    shadow = cv2.dilate((dim <= np.float32(SHADOW) * bright).astype(np.uint8), np.ones((PENUMBRA_PX,) * 2, np.uint8))
    here = (shadow == 0) & (bright > np.float32(LEAST_LIT))
    if one.used is not None:
        here &= cv2.erode(one.used.view(np.uint8), window) > 0
    return np.hypot(across, down).astype(np.float32), np.hypot(*even) + least, here.astype(np.float32)
