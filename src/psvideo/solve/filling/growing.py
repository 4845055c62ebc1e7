"""The compiled loop that grows normals and albedo from solved pixels into the others, the likeliest neighbours first.

Neighbours of the same colour give a normal and an albedo, and what one or two lights say of the pixel mends them
(``hernandez2011``). Pixels are taken in the order of their distance from what is solved, where a step to another colour
is a long one: so they follow their own surface, and what is behind an outline comes last.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded, encoded, lent
from psvideo.solve.filling.hernandez2011 import from_one, from_two
from psvideo.solve.filling.looking import Said
from psvideo.solve.filling.tiles import SHIFT, THREE_LIGHTS, UNKNOWN, WITHIN, Tiles
from psvideo.solve.normals.blocks import ONE, THREE, ZERO
from psvideo.solve.normals.task import Floats

REACH_PX = 4  # neighbours are looked at so far in every direction,
SPREAD_PX = 2.0  # with weights that fall off so,
SAME_COLOUR = np.float32(0.015)  # and with the colour: shares of red and blue that differ so much weigh a half;
STEP = 4  # distance of neighbours of one colour, in the whole numbers in which distances are counted
BUCKETS = 256  # more than the longest step
WEIGHTS = np.array([0.1, 0.25, 0.5, 1.0], np.float32)  # of neighbours that no, one, two or three lights reach
HALF, THIRD, TINY = np.float32(0.5), np.float32(1 / 3), np.float32(1e-6)
MOST_STEPS = np.float32(50)
UNCOLOURED = np.float32(0.01)  # the square of what is not known of the colour of a pixel without light
ONWARD = np.float32(0.7)  # how far neighbours' bend is taken on: all of it would burst from noise
FOREVER = 1 << 30
NONE = -1  # of a queue's lists


class Queue(NamedTuple):
    """Pixels by distance: a ring of buckets, ``heads``, of lists that are linked both ways, so that a pixel that is
    nearer by another way leaves its place. ``distance`` (pixel,) is FOREVER of those that nothing has reached yet."""

    heads: NDArray[np.int32]
    following: NDArray[np.int32]
    preceding: NDArray[np.int32]
    distance: NDArray[np.int32]


def queue_for(pixels: int) -> Queue:
    """Return a queue that holds so many pixels."""
    return Queue(
        heads=np.full(BUCKETS, NONE, np.int32),
        following=np.full(pixels, NONE, np.int32),
        preceding=np.full(pixels, NONE, np.int32),
        distance=np.full(pixels, FOREVER, np.int32),
    )


WINDOW = np.exp(
    -(np.arange(-REACH_PX, REACH_PX + 1)[:, None] ** 2 + np.arange(-REACH_PX, REACH_PX + 1)[None] ** 2)
    / (2 * SPREAD_PX**2)
).astype(np.float32)


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
    waiting = now = begun = farthest = 0
    for pixel in range(len(places)):
        distance = _start(p, s, places, pixel)
        if distance < FOREVER:
            _push(q, pixel, distance)
            waiting, farthest = waiting + 1, max(farthest, distance)
    while True:
        while waiting > 0:
            pixel = q.heads[now % BUCKETS]
            if pixel == NONE:
                now += 1
                continue
            _take_out(q, pixel)
            row, col = places[pixel, 0], places[pixel, 1]
            _estimate(p, s, row, col, pixel)
            out[pixel] = np.float32(now) / np.float32(STEP)
            more, farthest = _push_around(p, s, q, row, col, now, farthest)
            waiting += more - 1
        while begun < len(places) and _lights(p, places[begun, 0], places[begun, 1]) != UNKNOWN:
            begun += 1
        if begun == len(places):
            return
        now = farthest  # what nothing reaches comes after all that something does
        _push(q, begun, now)
        waiting = 1


@FUSED.inlined
def _tile(p: Tiles, row: int, col: int) -> int:
    """The tile that a pixel lies in."""
    return int(p.table[row >> SHIFT, col >> SHIFT])


@FUSED.inlined
def _lights(p: Tiles, row: int, col: int) -> int:
    """How many lights a pixel's normal is from."""
    return int(p.lights[_tile(p, row, col), row & WITHIN, col & WITHIN])


@FUSED.inlined
def _push(q: Queue, pixel: int, distance: int) -> None:
    """Put a pixel that waits nowhere at the head of its distance's list."""
    bucket = distance % BUCKETS
    head = q.heads[bucket]
    if head != NONE:
        q.preceding[head] = pixel
    q.distance[pixel], q.following[pixel], q.preceding[pixel], q.heads[bucket] = distance, head, NONE, pixel


@FUSED.inlined
def _take_out(q: Queue, pixel: int) -> None:
    """Take a pixel that waits out of its list."""
    before, after = q.preceding[pixel], q.following[pixel]
    if before == NONE:
        q.heads[q.distance[pixel] % BUCKETS] = after
    else:
        q.following[before] = after
    if after != NONE:
        q.preceding[after] = before


@FUSED.called
def _start(p: Tiles, s: Said, places: NDArray[np.int32], pixel: int) -> int:
    """Return the shortest step to a pixel from a solved neighbour, FOREVER where it has none."""
    row, col = places[pixel, 0], places[pixel, 1]
    nearest = FOREVER
    for side in range(4):
        y, x = row + (side == 1) - (side == 0), col + (side == 3) - (side == 2)
        if 0 <= y < p.rows and 0 <= x < p.cols and _lights(p, y, x) == THREE_LIGHTS:
            nearest = min(nearest, _step(p, s, row, col, y, x))
    return nearest


@FUSED.called
def _push_around(p: Tiles, s: Said, q: Queue, row: int, col: int, now: int, farthest: int) -> tuple[int, int]:
    """Push a pixel's neighbours that are to be filled and are nearer by this way; return how many more wait, and the
    longest distance that was ever pushed."""
    more = 0
    for side in range(4):
        y, x = row + (side == 1) - (side == 0), col + (side == 3) - (side == 2)
        if 0 <= y < p.rows and 0 <= x < p.cols and _lights(p, y, x) == UNKNOWN:
            other, distance = p.places[_tile(p, y, x), y & WITHIN, x & WITHIN], now + _step(p, s, row, col, y, x)
            if distance < q.distance[other]:
                if q.distance[other] < FOREVER:
                    _take_out(q, other)
                else:
                    more += 1
                _push(q, other, distance)
                farthest = max(farthest, distance)
    return more, farthest


@FUSED.called
def _step(p: Tiles, s: Said, row: int, col: int, y: int, x: int) -> int:
    """The distance between neighbours, the longer the more their colours differ."""
    red, blue, noise = _colour_of(p, s, row, col)
    red_there, blue_there, noise_there = _colour_of(p, s, y, x)
    apart = (red - red_there) ** 2 + (blue - blue_there) ** 2
    allowed = SAME_COLOUR**2 + noise + noise_there
    return int(np.float32(STEP) * (ONE + min(apart / allowed, MOST_STEPS)))


@FUSED.inlined
def _colour_of(p: Tiles, s: Said, row: int, col: int) -> tuple[np.float32, np.float32, np.float32]:
    """The shares of red and blue, and the square of what noise makes of them."""
    tile, y, x = _tile(p, row, col), row & WITHIN, col & WITHIN
    pixel, last = p.places[tile, y, x], p.albedo.shape[1] - 1
    if pixel >= 0:
        red, green, blue = s.colour[pixel, 0], s.colour[pixel, 1], s.colour[pixel, 2]
    else:
        red = decoded(p.albedo[tile, 0, y, x])
        green, blue = decoded(p.albedo[tile, min(1, last), y, x]), decoded(p.albedo[tile, last, y, x])
    total = red + green + blue
    if not total > ZERO:
        return THIRD, THIRD, UNCOLOURED
    one = ONE / total
    return red * one, blue * one, (s.noise * one) ** 2


@FUSED.called
def _estimate(p: Tiles, s: Said, row: int, col: int, pixel: int) -> None:
    """Give a pixel its normal and albedo from its neighbours and from what the lights say."""
    nx, ny, nz, albedo, reds, blues = _said_around(p, s, row, col)
    count = min(s.reached[pixel], 2)
    if count == 2:
        nx, ny, nz, albedo = from_two(s, pixel, nx, ny, nz, albedo)
    elif count == 1:
        nx, ny, nz, albedo = from_one(s, pixel, nx, ny, nz, albedo)
    # lights that shine from almost one direction, or straight along the normal, leave a vector that is no unit one
    one = ONE / max(np.sqrt(nx * nx + ny * ny + nz * nz), TINY)
    nx, ny, nz = nx * one, ny * one, nz * one
    if count > 0:
        reds, blues, _ = _colour_of(p, s, row, col)
    tile, y, x = _tile(p, row, col), row & WITHIN, col & WITHIN
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


@FUSED.inlined
def _said_around(
    p: Tiles, s: Said, row: int, col: int
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """The normal (x, y, z), albedo, and shares of red and blue that a pixel's neighbours give it, those of its own
    colour most; their bend is taken on, so that a round surface stays round."""
    channels = p.albedo.shape[1]
    red, blue, noise = _colour_of(p, s, row, col)
    weight = albedo = nx = ny = nz = reds = blues = ZERO
    down = right = downs = rights = both = ZERO
    nx_down = ny_down = nz_down = nx_right = ny_right = nz_right = ZERO
    for y in range(max(row - REACH_PX, 0), min(row + REACH_PX + 1, p.rows)):
        v = y & WITHIN
        for x in range(max(col - REACH_PX, 0), min(col + REACH_PX + 1, p.cols)):
            tile, u = _tile(p, y, x), x & WITHIN
            state = p.lights[tile, v, u]
            if state > THREE_LIGHTS:
                continue
            there_red = decoded(p.albedo[tile, 0, v, u])
            there_blue = decoded(p.albedo[tile, channels - 1, v, u])
            there = there_red + there_blue + (decoded(p.albedo[tile, 1, v, u]) if channels > 1 else there_red)
            if not there > ZERO:
                continue
            one = ONE / there
            share_red, share_blue = there_red * one, there_blue * one
            apart = (share_red - red) ** 2 + (share_blue - blue) ** 2
            alike = ONE / (ONE + apart / (SAME_COLOUR**2 + noise + (s.noise * one) ** 2))
            alike *= alike
            w = WEIGHTS[state] * WINDOW[y - row + REACH_PX, x - col + REACH_PX] * (alike * alike + TINY)
            a, b, c = (
                decoded(p.normals[tile, 0, v, u]),
                decoded(p.normals[tile, 1, v, u]),
                decoded(p.normals[tile, 2, v, u]),
            )
            dy, dx = np.float32(y - row), np.float32(x - col)
            weight += w
            albedo += w * there * THIRD
            reds += w * share_red
            blues += w * share_blue
            nx, ny, nz = nx + w * a, ny + w * b, nz + w * c
            wy, wx = w * dy, w * dx
            down, right = down + wy, right + wx
            downs, rights, both = downs + wy * dy, rights + wx * dx, both + wy * dx
            nx_down, ny_down, nz_down = nx_down + wy * a, ny_down + wy * b, nz_down + wy * c
            nx_right, ny_right, nz_right = nx_right + wx * a, ny_right + wx * b, nz_right + wx * c
    if not weight > ZERO:
        return ZERO, ZERO, ONE, ZERO, THIRD, THIRD
    one = ONE / weight
    albedo, reds, blues = albedo * one, reds * one, blues * one
    nx, ny, nz, down, right = nx * one, ny * one, nz * one, down * one, right * one
    vy, vx, vxy = downs * one - down * down + HALF, rights * one - right * right + HALF, both * one - down * right
    determinant = ONE / (vy * vx - vxy * vxy)
    # how far a straight course over the neighbours, taken on to this pixel, leads from their mean
    per_y = -(down * vx - right * vxy) * determinant * ONWARD
    per_x = -(right * vy - down * vxy) * determinant * ONWARD
    nx += per_y * (nx_down * one - down * nx) + per_x * (nx_right * one - right * nx)
    ny += per_y * (ny_down * one - down * ny) + per_x * (ny_right * one - right * ny)
    nz += per_y * (nz_down * one - down * nz) + per_x * (nz_right * one - right * nz)
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    one = ONE / max(length, TINY)
    return nx * one, ny * one, nz * one, albedo, reds, blues
