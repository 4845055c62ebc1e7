"""The compiled loop that grows normals and albedo from solved pixels into the others, the likeliest neighbours first.

Neighbours of the same colour suggest a normal and an albedo (``neighbours``), which the one or two lights that reach
the pixel correct (``hernandez2011``). Pixels are filled in the order of their distance from solved ones. A step to
another colour counts as a long one, so that a surface is filled from itself, and not across an outline. ``rim`` says
which solved pixels are none to go on from.
"""

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import encoded, lent
from psvideo.model.arrays import Floats
from psvideo.solve.filling.bucket_queue import BUCKETS, FOREVER, NONE, Queue, push, take_out
from psvideo.solve.filling.hernandez2011 import from_one, from_three, from_two
from psvideo.solve.filling.looking import Said
from psvideo.solve.filling.neighbours import SAME_COLOUR, TINY, colour_of, from_neighbours, known_of, misfit
from psvideo.solve.filling.rim import mark_rim
from psvideo.solve.filling.tiles import ALONE_AT_RIM, THREE_LIGHTS, UNKNOWN, WITHIN, Tiles, lights_at, tile_at
from psvideo.solve.normals.loops.blocks import ONE, THREE, ZERO

STEP = 4  # distance of neighbours of one colour, in the whole numbers in which distances are counted
MOST_STEPS = np.float32(50)
LONGEST = STEP * (1 + int(MOST_STEPS))
BACK_PX = 3  # a step's colour is held against so many pixels that lie before it: an outline is two or three wide
LEAST_ALIKE = np.float32(0.4)  # neighbours less like a pixel in colour do not say its albedo
ONWARD_OF_TWO, ONWARD = np.float32(1.0), np.float32(0.6)  # of neighbours' bend: all of it would burst from noise,
# but for two lights, which leave less room for it


@FUSED.kept
def grow(tiles: Tiles, said: Said, where: NDArray[np.int32], queue: Queue, away: Floats) -> None:
    """Fill the pixels ``where`` (pixel, 2: row and column) of a picture's tiles, nearest first; for one thread.

    ``away`` (pixel,) takes a pixel's distance from what is solved, in pixels of its own colour.
    """
    p = Tiles(
        tiles.rows, tiles.cols, lent(tiles.table),
        lent(tiles.normals), lent(tiles.albedo), lent(tiles.lights), lent(tiles.places),
    )  # fmt: skip
    s = Said(lent(said.reached), lent(said.bright), lent(said.towards), lent(said.colour), said.noise)
    q = Queue(lent(queue.heads), lent(queue.following), lent(queue.preceding), lent(queue.distance))
    places, out = lent(where), lent(away)
    mark_rim(p, s, places)
    waiting = now = begun = farthest = 0
    for pixel in range(len(places)):
        distance = _start(p, s, places, pixel)
        if distance < FOREVER:
            push(q, pixel, distance)
            waiting, farthest = waiting + 1, max(farthest, distance)
    while True:
        while waiting > 0:
            pixel = q.heads[now % BUCKETS]
            if pixel == NONE:
                now += 1
                continue
            take_out(q, pixel)
            row, col = places[pixel, 0], places[pixel, 1]
            _estimate(p, s, row, col, pixel)
            out[pixel] = np.float32(now) / np.float32(STEP)
            more, farthest = _push_around(p, s, q, row, col, now, farthest)
            waiting += more - 1
        while begun < len(places) and lights_at(p, places[begun, 0], places[begun, 1]) != UNKNOWN:
            begun += 1
        if begun == len(places):
            return
        now = farthest  # what nothing reaches comes after all that something does
        push(q, begun, now)
        waiting = 1


@FUSED.called
def _start(p: Tiles, s: Said, places: NDArray[np.int32], pixel: int) -> int:
    """Return the shortest step to a pixel from a solved neighbour, the longest from those that stand alone, FOREVER
    where it has none."""
    row, col = places[pixel, 0], places[pixel, 1]
    nearest = FOREVER
    for side in range(4):
        y, x = row + (side == 1) - (side == 0), col + (side == 3) - (side == 2)
        if 0 <= y < p.rows and 0 <= x < p.cols and THREE_LIGHTS <= lights_at(p, y, x) <= ALONE_AT_RIM:
            alone = lights_at(p, y, x) == ALONE_AT_RIM
            nearest = min(nearest, LONGEST if alone else _step(p, s, y, x, row, col))
    return nearest


@FUSED.called
def _push_around(p: Tiles, s: Said, q: Queue, row: int, col: int, now: int, farthest: int) -> tuple[int, int]:
    """Push a pixel's neighbours that are to be filled and are nearer by this way; return how many more wait, and the
    longest distance that was ever pushed."""
    more = 0
    for side in range(4):
        y, x = row + (side == 1) - (side == 0), col + (side == 3) - (side == 2)
        if 0 <= y < p.rows and 0 <= x < p.cols and lights_at(p, y, x) == UNKNOWN:
            other, distance = p.places[tile_at(p, y, x), y & WITHIN, x & WITHIN], now + _step(p, s, row, col, y, x)
            if distance < q.distance[other]:
                if q.distance[other] < FOREVER:
                    take_out(q, other)
                else:
                    more += 1
                push(q, other, distance)
                farthest = max(farthest, distance)
    return more, farthest


@FUSED.called
def _step(p: Tiles, s: Said, row: int, col: int, y: int, x: int) -> int:
    """The distance from a pixel with a normal to its neighbour (y, x), the longer the more the latter's colour differs
    from the former's or that of those before it on the same way, and the less what is known of the former explains what
    lights show of the latter."""
    red_there, blue_there, noise_there = colour_of(p, s, y, x)
    there = p.places[tile_at(p, y, x), y & WITHIN, x & WITHIN]
    other_light, other_colour = misfit(s, there, *known_of(p, row, col)), ZERO
    for back in range(BACK_PX):
        v, u = row - back * (y - row), col - back * (x - col)
        if not (0 <= v < p.rows and 0 <= u < p.cols) or lights_at(p, v, u) > ALONE_AT_RIM:
            break
        red, blue, noise = colour_of(p, s, v, u)
        apart = (red - red_there) ** 2 + (blue - blue_there) ** 2
        other_colour = max(other_colour, apart / (SAME_COLOUR**2 + noise + noise_there))
    return int(np.float32(STEP) * (ONE + min(other_colour * other_colour + other_light, MOST_STEPS)))


@FUSED.called
def _estimate(p: Tiles, s: Said, row: int, col: int, pixel: int) -> None:
    """Give a pixel its normal and albedo from its neighbours and from what the lights say."""
    count = s.reached[pixel]
    onward = ONWARD_OF_TWO if count == 2 else ONWARD
    nx, ny, nz, albedo, reds, blues, tx, ty, tz, alike = from_neighbours(p, s, row, col, onward)
    if count > 0 and alike < LEAST_ALIKE:
        albedo = ZERO
    if count == THREE_LIGHTS:
        nx, ny, nz, albedo = from_three(s, pixel, nx, ny, nz, albedo, tx, ty, tz)
    elif count == 2:
        nx, ny, nz, albedo = from_two(s, pixel, nx, ny, nz, albedo, tx, ty, tz)
    elif count == 1:
        nx, ny, nz, albedo = from_one(s, pixel, nx, ny, nz, albedo)
    # lights that shine from almost one direction, or straight along the normal, leave a vector that is no unit one
    one = ONE / max(np.sqrt(nx * nx + ny * ny + nz * nz), TINY)
    nx, ny, nz = nx * one, ny * one, nz * one
    if count > 0:
        reds, blues, _ = colour_of(p, s, row, col)
    tile, y, x = tile_at(p, row, col), row & WITHIN, col & WITHIN
    p.lights[tile, y, x] = count
    p.normals[tile, 0, y, x] = encoded(nx, p.normals)
    p.normals[tile, 1, y, x] = encoded(ny, p.normals)
    p.normals[tile, 2, y, x] = encoded(nz, p.normals)
    if p.albedo.shape[1] == 1:
        p.albedo[tile, 0, y, x] = encoded(albedo, p.albedo)
    else:
        p.albedo[tile, 0, y, x] = encoded(THREE * albedo * reds, p.albedo)
        p.albedo[tile, 1, y, x] = encoded(THREE * albedo * max(ONE - reds - blues, ZERO), p.albedo)
        p.albedo[tile, 2, y, x] = encoded(THREE * albedo * blues, p.albedo)
