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
from psvideo.solve.normals.blocks import ONE, THREE, ZERO
from psvideo.solve.normals.task import Bytes, Floats, Samples

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
SOLVED, LEFT_ALONE = -1, -2  # of Picture.places
THREE_LIGHTS, UNKNOWN = 3, 9  # of Picture.lights


class Picture(NamedTuple):
    """The surface that is filled, planes of float32 or of half floats as the bits of uint16, and what is beside it.

    places: (row, col), the place of a pixel to be filled in the lists, -1 of solved ones, -2 of what is left alone.
    lights: (row, col), how many lights a pixel's normal is from, 3 where it is solved.
    """

    normals: Samples  # (3, row, col)
    albedo: Samples  # (channel, row, col)
    places: NDArray[np.int32]
    lights: Bytes


class Queue(NamedTuple):
    """Pixels by distance: a ring of buckets, of lists that are linked."""

    heads: NDArray[np.int32]
    following: NDArray[np.int32]
    pixels: NDArray[np.int32]
    distance: NDArray[np.int32]


def queue_for(pixels: int) -> Queue:
    """Return a queue that holds so many pixels, each pushed by at most four neighbours and once as a start."""
    return Queue(
        heads=np.full(BUCKETS, -1, np.int32),
        following=np.full(5 * pixels + 1, -1, np.int32),
        pixels=np.zeros(5 * pixels + 1, np.int32),
        distance=np.full(pixels, FOREVER, np.int32),
    )


WINDOW = np.exp(
    -(np.arange(-REACH_PX, REACH_PX + 1)[:, None] ** 2 + np.arange(-REACH_PX, REACH_PX + 1)[None] ** 2)
    / (2 * SPREAD_PX**2)
).astype(np.float32)


@FUSED.kept
def grow(picture: Picture, said: Said, where: NDArray[np.int32], queue: Queue, away: Floats) -> None:
    """Fill the pixels ``where`` (pixel, 2: row and column) of the picture, nearest first; for one thread.

    ``away`` (pixel,) takes a pixel's distance from what is solved, in pixels of its own colour.
    """
    p = Picture(lent(picture.normals), lent(picture.albedo), lent(picture.places), lent(picture.lights))
    s = Said(lent(said.reached), lent(said.bright), lent(said.towards), lent(said.colour), said.noise)
    q = Queue(lent(queue.heads), lent(queue.following), lent(queue.pixels), lent(queue.distance))
    places, out = lent(where), lent(away)
    pushed = 0
    for pixel in range(len(places)):
        pushed = _push_start(p, s, places, q, pixel, pushed)
    begun, now, waiting = 0, 0, pushed
    while True:
        while waiting > 0:
            entry = q.heads[now % BUCKETS]
            if entry < 0:
                now += 1
                continue
            q.heads[now % BUCKETS] = q.following[entry]
            waiting -= 1
            pixel = q.pixels[entry]
            row, col = places[pixel, 0], places[pixel, 1]
            if p.lights[row, col] != UNKNOWN:
                continue
            _estimate(p, s, row, col, pixel)
            out[pixel] = np.float32(now) / np.float32(STEP)
            before = pushed
            pushed = _push_around(p, s, places, q, pixel, now, pushed)
            waiting += pushed - before
        while begun < len(places) and p.lights[places[begun, 0], places[begun, 1]] != UNKNOWN:
            begun += 1
        if begun == len(places):
            return
        q.distance[begun] = now
        pushed = _push(q, begun, now, pushed)
        waiting = 1


@FUSED.inlined
def _push(q: Queue, pixel: int, distance: int, pushed: int) -> int:
    bucket = distance % BUCKETS
    q.pixels[pushed], q.following[pushed], q.heads[bucket] = pixel, q.heads[bucket], pushed
    return pushed + 1


@FUSED.called
def _push_start(p: Picture, s: Said, places: NDArray[np.int32], q: Queue, pixel: int, pushed: int) -> int:
    """Push a pixel that has solved neighbours with the shortest step from one of them."""
    row, col = places[pixel, 0], places[pixel, 1]
    for side in range(4):
        y, x = row + (side == 1) - (side == 0), col + (side == 3) - (side == 2)
        if 0 <= y < p.places.shape[0] and 0 <= x < p.places.shape[1] and p.places[y, x] == SOLVED:
            q.distance[pixel] = min(q.distance[pixel], _step(p, s, row, col, y, x))
    return _push(q, pixel, q.distance[pixel], pushed) if q.distance[pixel] < FOREVER else pushed


@FUSED.called
def _push_around(p: Picture, s: Said, places: NDArray[np.int32], q: Queue, pixel: int, now: int, pushed: int) -> int:
    """Push a pixel's neighbours that are to be filled and are nearer by this way."""
    row, col = places[pixel, 0], places[pixel, 1]
    for side in range(4):
        y, x = row + (side == 1) - (side == 0), col + (side == 3) - (side == 2)
        if 0 <= y < p.places.shape[0] and 0 <= x < p.places.shape[1] and p.lights[y, x] == UNKNOWN:
            other, distance = p.places[y, x], now + _step(p, s, row, col, y, x)
            if distance < q.distance[other]:
                q.distance[other] = distance
                pushed = _push(q, other, distance, pushed)
    return pushed


@FUSED.called
def _step(p: Picture, s: Said, row: int, col: int, y: int, x: int) -> int:
    """The distance between neighbours, the longer the more their colours differ."""
    red, blue, noise = _colour_of(p, s, row, col)
    red_there, blue_there, noise_there = _colour_of(p, s, y, x)
    apart = (red - red_there) ** 2 + (blue - blue_there) ** 2
    allowed = SAME_COLOUR**2 + noise + noise_there
    return int(np.float32(STEP) * (ONE + min(apart / allowed, MOST_STEPS)))


@FUSED.inlined
def _colour_of(p: Picture, s: Said, row: int, col: int) -> tuple[np.float32, np.float32, np.float32]:
    """The shares of red and blue, and the square of what noise makes of them."""
    pixel, last = p.places[row, col], len(p.albedo) - 1
    if pixel >= 0:
        red, green, blue = s.colour[pixel, 0], s.colour[pixel, 1], s.colour[pixel, 2]
    else:
        red = decoded(p.albedo[0, row, col])
        green, blue = decoded(p.albedo[min(1, last), row, col]), decoded(p.albedo[last, row, col])
    total = red + green + blue
    if not total > ZERO:
        return THIRD, THIRD, UNCOLOURED
    one = ONE / total
    return red * one, blue * one, (s.noise * one) ** 2


@FUSED.called
def _estimate(p: Picture, s: Said, row: int, col: int, pixel: int) -> None:
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
    p.lights[row, col] = count
    p.normals[0, row, col] = encoded(nx, p.normals)
    p.normals[1, row, col] = encoded(ny, p.normals)
    p.normals[2, row, col] = encoded(nz, p.normals)
    if len(p.albedo) == 1:
        p.albedo[0, row, col] = encoded(albedo, p.albedo)
    else:
        p.albedo[0, row, col] = encoded(THREE * albedo * reds, p.albedo)
        p.albedo[1, row, col] = encoded(THREE * albedo * max(ONE - reds - blues, ZERO), p.albedo)
        p.albedo[2, row, col] = encoded(THREE * albedo * blues, p.albedo)


@FUSED.inlined
def _said_around(
    p: Picture, s: Said, row: int, col: int
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """The normal (x, y, z), albedo, and shares of red and blue that a pixel's neighbours give it, those of its own
    colour most; their bend is taken on, so that a round surface stays round."""
    rows, cols = p.places.shape
    channels = len(p.albedo)
    red, blue, noise = _colour_of(p, s, row, col)
    weight = albedo = nx = ny = nz = reds = blues = ZERO
    down = right = downs = rights = both = ZERO
    nx_down = ny_down = nz_down = nx_right = ny_right = nz_right = ZERO
    for y in range(max(row - REACH_PX, 0), min(row + REACH_PX + 1, rows)):
        for x in range(max(col - REACH_PX, 0), min(col + REACH_PX + 1, cols)):
            state = p.lights[y, x]
            if state > THREE_LIGHTS:
                continue
            there_red = decoded(p.albedo[0, y, x])
            there_blue = decoded(p.albedo[channels - 1, y, x])
            there = there_red + there_blue + (decoded(p.albedo[1, y, x]) if channels > 1 else there_red)
            if not there > ZERO:
                continue
            one = ONE / there
            share_red, share_blue = there_red * one, there_blue * one
            apart = (share_red - red) ** 2 + (share_blue - blue) ** 2
            alike = ONE / (ONE + apart / (SAME_COLOUR**2 + noise + (s.noise * one) ** 2))
            alike *= alike
            w = WEIGHTS[state] * WINDOW[y - row + REACH_PX, x - col + REACH_PX] * (alike * alike + TINY)
            a, b, c = decoded(p.normals[0, y, x]), decoded(p.normals[1, y, x]), decoded(p.normals[2, y, x])
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
