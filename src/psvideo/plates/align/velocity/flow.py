"""Where things moved between two plates of one light: dense optical flow both ways, and where the two agree.

Kroeger, Timofte, Dai and Van Gool, "Fast Optical Flow using Dense Inverse Search", ECCV 2016, as OpenCV has it. Lights
differ in what they show, so only plates of the same light are compared. Flow is found on 8-bit sketches of the plates,
whose codes follow the square root of light: photon noise is then the same everywhere. Their exposure is fixed.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import quantile
from psvideo.compute.threads import WRITING_THREADS, thread_count
from psvideo.model.arrays import Bytes, Codes8, Flags, Floats, Image
from psvideo.plates.align.velocity.sketch_kernel import root_rows
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.several_lights.clipped_flashes import coarser, filled_of, vague_between

LARGEST_PX = 1_200_000
"""Pictures of more pixels are halved before flow is looked for."""
TOE = 0.02
"""Light that is added before the square root, as a share of white: it keeps the noise of dark pixels small."""
LEAST_WHITE = 1 / 16
"""A clip that begins in the dark is not brightened by more than this."""
FINEST_SCALE, FINE_PIXELS = 1, 250_000
"""Flow is found on half the sketch and enlarged where sketches have this many pixels: good to a twentieth of one."""
REFINED, DESCENTS = 1, 12
"""Rounds of refinement and steps of a patch there: 5 and 16 take half as long again, and gain a 150th of a pixel."""
SHORTEST_PX, LONGEST_PX = 8, 12
"""Flow needs pictures of so many pixels along the shorter side and along the longer one: smaller ones are at rest."""
BLOCK_PX, AROUND = 4, 4
"""Change is measured on means of blocks this wide, over this many blocks together."""
LEAST_CHANGE = 1.5
"""Blocks that change by fewer codes did not move."""
NOISE_FACTOR = 5.0
"""Blocks that change by less than this many times what independent noise of their pixels explains did not move."""
CODED_BLOCKS = 2
"""Compression works on squares of 8 pixels and more, which is this many blocks."""
BLOCK_NOISE_FACTOR, MOST_BLOCK_NOISE = 3.0, 2.0
"""Blocks that change by less than the first times the noise that blocks themselves show did not move: compression makes
noise that a whole block shares. At most the second, in codes, counts: more is motion that fills the picture."""
FINE_OF_CODED, OF_THREE_QUARTERS, MOST_CODED = 0.6, 5.5, 10.0
"""In movies whose finest detail differs by fewer codes than the first, a codec took that away. What it leaves is
coarser and lies where there is texture: blocks that change by less than the second times what three quarters of them do
not exceed were not stirred, up to the third, in codes: more is motion that fills a quarter of the picture. (Of what
stands still in H.264 and HEVC 99 % change by less than 2.0 to 3.1 times as much, and most of the rest by less than 5.)
"""
SOME, LEAST_LIT = 8, 8
"""Noise is estimated from every eighth row, where codes are at least this: below, noise is cut off at zero."""
QUARTER_OF_NORMAL = 0.3186
"""A quarter of normal values of variance one is smaller than this."""


@dataclass(frozen=True, kw_only=True)
class Sketch:
    """A plate as flow sees it: ``codes`` (row, col), which of these any frame saw, ``seen`` (row, 1), or (row, col)
    where the picture was turned, and the means of blocks of codes, ``blocks`` (row, col). ``white`` is the light of
    code 255, and ``filled`` where codes say nothing. ``coded``: the plate is made of a movie's frames."""

    number: int
    time_s: float
    codes: Codes8
    seen: Flags
    blocks: Floats
    white: float
    filled: Bytes | None = None
    coded: bool = False


def white_of(plate: LightPlate) -> float:
    """Return the light that becomes the brightest code, from a light's first plate."""
    return float(np.clip(1.2 * quantile(_grey(plate.picture.thinned(4)), 0.995), LEAST_WHITE, plate.saturation))


def sketch_of(plate: LightPlate, *, white: float, coded: bool = False) -> Sketch:
    """Return what flow needs of a plate: a few hundred kilobytes; ``white`` becomes code 255. ``coded``: it is made of
    a movie's frames."""
    rows, cols = plate.shape[:2]
    halved = rows * cols > LARGEST_PX
    grey = plate.picture.halved() if halved else _grey(plate.image)
    seen = plate.seen if plate.seen.ndim == 2 else plate.seen[:, None]
    if halved:
        seen = all_of(seen, 2)
    shown: Floats = np.empty(grey.shape[:2], np.float32)
    codes: Codes8 = np.empty(grey.shape[:2], np.uint8)
    root = float(np.sqrt(TOE))
    scale = np.float32(255 / (np.sqrt(1 + TOE) - root))
    light = np.ascontiguousarray(grey)
    root_rows(light, np.float32(1 / white), np.float32(TOE), np.float32(root), scale, shown, codes)
    size = max(shown.shape[1] // BLOCK_PX, 1), max(shown.shape[0] // BLOCK_PX, 1)
    blocks = np.asarray(cv2.resize(shown, size, interpolation=cv2.INTER_AREA), np.float32)
    filled = coarser(filled_of(plate, range(rows)), *((2, 2) if halved else (1, 1)))
    return Sketch(
        number=plate.number,
        time_s=plate.time_s,
        codes=codes,
        seen=seen,
        blocks=blocks,
        white=white,
        filled=filled,
        coded=coded,
    )


def all_of(seen: Flags, step: int) -> Flags:
    """Return where all of ``step`` by ``step`` pixels were seen, of rows, (row, 1), or of pixels, (row, col); what is
    left over at the ends goes.

    >>> all_of(np.array([[True], [True], [True], [False], [True]]), 2).tolist()
    [[True], [False]]
    """
    wide = step if seen.shape[1] > 1 else 1
    rows, cols = seen.shape[0] // step, seen.shape[1] // wide
    return np.asarray(seen[: rows * step, : cols * wide].reshape(rows, step, cols, wide).all(axis=(1, 3)))


def _grey(image: Image) -> Image:
    if image.ndim == 2:
        return image
    return np.asarray(cv2.transform(image, np.full((1, image.shape[2]), 1 / image.shape[2], np.float32)), np.float32)


def comparable(before: Sketch, after: Sketch) -> tuple[Codes8, Codes8]:
    """Return the codes of both; what no frame saw for one of them shows the same in both, and so does not seem to move,
    nor does what is filled."""
    one, other = before.codes, after.codes
    if not before.seen.all():
        one = np.where(before.seen, one, other)
    if not after.seen.all():
        other = np.where(after.seen, other, one)
    if (vague := vague_between(before.filled, after.filled)) is not None:
        other = np.where(vague, one, other)
    return one, other


class Changes(NamedTuple):
    """Where anything changed between two sketches by more than noise does, by block, (row, col): what may have
    ``moved``, rather yes than no, and what was ``stirred``, by more than a codec leaves."""

    moved: Flags
    stirred: Flags


def changed(before: Sketch, after: Sketch) -> Flags:
    """Return where anything changed between two sketches by more than noise does, by block, (row, col); quick, and
    rather yes than no."""
    return changes(before, after).moved


def changes(before: Sketch, after: Sketch) -> Changes:
    """Return the same, and where it is more than a codec leaves of what stands still."""
    change = after.blocks - before.blocks
    seen = before.seen & after.seen
    if not seen.all():
        size = change.shape[1] if seen.shape[1] > 1 else 1, change.shape[0]
        shown = cv2.resize(seen.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        change[np.broadcast_to(shown < 1, change.shape)] = 0
    if (vague := vague_between(before.filled, after.filled)) is not None:
        hidden = cv2.resize(vague.astype(np.float32), change.shape[::-1], interpolation=cv2.INTER_AREA)
        change[hidden > 0] = 0
    local = np.asarray(cv2.blur(change * change, (AROUND, AROUND)), np.float32)
    noise = noise_between(before, after)
    blocks = BLOCK_NOISE_FACTOR * min(_spread(change, before.blocks, CODED_BLOCKS), MOST_BLOCK_NOISE)
    least = max(LEAST_CHANGE, NOISE_FACTOR * noise / BLOCK_PX, blocks)
    moved: Flags = local > np.float32(least**2)
    coded = before.coded and noise < FINE_OF_CODED
    return Changes(moved, local > max(least, _left_by_codec(local, before.blocks)) ** 2 if coded else moved)


def _left_by_codec(local: Floats, shown: Floats) -> float:
    """Return by how many codes blocks differ at most for what a codec left of them, of the squares of their change."""
    lit = local[shown >= LEAST_LIT]
    return min(OF_THREE_QUARTERS * float(np.sqrt(quantile(lit, 0.75))), MOST_CODED) if lit.size else 0.0


def noise_between(before: Sketch, after: Sketch) -> float:
    """Return the noise of the change between two sketches, in codes, by its finest detail in some of the rows.

    The quieter half decides: up to half of what is lit may move and be as rich in detail as it likes.
    """
    seen = before.seen & after.seen
    some = np.flatnonzero(seen.any(axis=1))[::SOME]
    one, other = (sketch.codes[some].astype(np.int16) for sketch in (before, after))
    return _spread(other - one, np.where(seen[some], one, 0))


def _spread(change: NDArray[Any], shown: NDArray[Any], step: int = 1) -> float:
    """Return the standard deviation of a change by its detail over ``step`` columns, where anything is shown."""
    fine = np.abs(change[:, 2 * step :] - 2 * change[:, step:-step] + change[:, : -2 * step])
    fine = fine[shown[:, step:-step] >= LEAST_LIT]
    if fine.size < 64:
        return 0.0
    return _quarter(fine) / QUARTER_OF_NORMAL / float(np.sqrt(6))


def _quarter(sizes: NDArray[Any]) -> float:
    """Return what a quarter of sizes, 0 and more, lies below; whole numbers stand for all that is rounded to them."""
    place = sizes.size // 4
    quarter = np.partition(sizes, place)[place]
    if not np.issubdtype(sizes.dtype, np.integer):
        return float(quarter)
    below, alike = np.count_nonzero(sizes < quarter), np.count_nonzero(sizes == quarter)
    least = max(float(quarter) - 0.5, 0.0)
    return least + (float(quarter) + 0.5 - least) * (place + 0.5 - below) / alike


def flow_from(one: Codes8, other: Codes8, start_px: tuple[float, float] | None = None, *, coarser: int = 0) -> Floats:
    """Return the way from every pixel of one picture to the other, (row, col, 2) as (x right, y down), px.

    ``start_px`` is where it is looked for; left out, nearby. Between pictures of FINE_PIXELS and more it is found on
    those halved ``coarser`` times more often. It is 0 in pictures that are too small for flow.
    """
    if min(one.shape) < SHORTEST_PX or max(one.shape) < LONGEST_PX:
        return np.zeros((*one.shape, 2), np.float32)
    search: Any = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
    if one.size >= FINE_PIXELS:
        search.setFinestScale(FINEST_SCALE + coarser)
        search.setVariationalRefinementIterations(REFINED)
        search.setGradientDescentIterations(DESCENTS)
    else:
        search.setFinestScale(0)
    start = None
    if start_px is not None:
        start = np.empty((*one.shape, 2), np.float32)
        start[:] = start_px
    return np.asarray(search.calc(one, other, start), np.float32)


def flow_threads() -> int:
    """Return how many flows are found side by side: the other threads write results meanwhile."""
    return max(thread_count() - WRITING_THREADS, 1)


def evenly_spread(count: int, most: int) -> list[int]:
    """Return places of at most so many of a count, evenly spread.

    >>> evenly_spread(7, 4)
    [0, 2, 4, 6]
    """
    return sorted({round(float(place)) for place in np.linspace(0, count - 1, min(count, most))})


def pixel_places(rows: int, cols: int) -> tuple[Floats, Floats]:
    """Return the column and the row of every pixel, each (row, col)."""
    x, y = np.meshgrid(np.arange(cols, dtype=np.float32), np.arange(rows, dtype=np.float32))
    return x, y
