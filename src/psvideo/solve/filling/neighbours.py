"""The normal, albedo and colour that a pixel's neighbours suggest, those of its own colour most; compiled."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded
from psvideo.solve.filling.looking import Said
from psvideo.solve.filling.neighbours_bend import Sums, bend_of, level_across
from psvideo.solve.filling.tiles import ALONE_AT_RIM, WITHIN, Tiles, tile_at
from psvideo.solve.normals.loops.blocks import ONE, ZERO

REACH_PX = 4  # neighbours are looked at so far in every direction,
SPREAD_PX = 2.0  # with weights that fall off so,
SAME_COLOUR = np.float32(0.015)  # and with the colour: shares of red and blue that differ so much weigh a half;
SAME_LIGHT = np.float32(0.2)  # what would show a light that differs by this share of it weighs a quarter,
LEAST_SHARE = np.float32(1e-3)  # and nothing less than this;
WEIGHTS = np.array([0.1, 0.25, 0.5, 1.0, 1.0, 0.005, 0.005], np.float32)  # of states: no, one, two lights, solved,
# solved beside a hole, and so but odd or alone there
UNCOLOURED = np.float32(0.01)  # the square of what is not known of the colour of a pixel without light
THIRD, TINY = np.float32(1 / 3), np.float32(1e-6)
WINDOW = np.exp(
    -(np.arange(-REACH_PX, REACH_PX + 1)[:, None] ** 2 + np.arange(-REACH_PX, REACH_PX + 1)[None] ** 2)
    / (2 * SPREAD_PX**2)
).astype(np.float32)


@FUSED.inlined
def colour_of(p: Tiles, s: Said, row: int, col: int) -> tuple[np.float32, np.float32, np.float32]:
    """The shares of red and blue, and the square of what noise makes of them."""
    tile, y, x = tile_at(p, row, col), row & WITHIN, col & WITHIN
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


@FUSED.inlined
def known_of(p: Tiles, row: int, col: int) -> tuple[np.float32, np.float32, np.float32]:
    """A pixel's albedo times its normal (x, y, z)."""
    tile, y, x = tile_at(p, row, col), row & WITHIN, col & WITHIN
    channels, albedo = p.albedo.shape[1], ZERO
    for channel in range(channels):
        albedo += decoded(p.albedo[tile, channel, y, x])
    albedo /= np.float32(channels)
    a, b, c = p.normals[tile, 0, y, x], p.normals[tile, 1, y, x], p.normals[tile, 2, y, x]
    return albedo * decoded(a), albedo * decoded(b), albedo * decoded(c)


@FUSED.inlined
def misfit(s: Said, pixel: int, x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """By how much what an albedo times a normal (x, y, z) would show differs from what a pixel's lights show: the
    square, over that of SAME_LIGHT of it; 0 where none shows anything.

    What stands before a wall may have its colour, but seldom looks alike under two lights.
    """
    first, second = s.bright[pixel, 0], s.bright[pixel, 1]
    size = first * first + second * second
    if not size > ZERO:
        return ZERO
    first -= max(x * s.towards[pixel, 0, 0] + y * s.towards[pixel, 0, 1] + z * s.towards[pixel, 0, 2], ZERO)
    second -= max(x * s.towards[pixel, 1, 0] + y * s.towards[pixel, 1, 1] + z * s.towards[pixel, 1, 2], ZERO)
    return np.float32((first * first + second * second) / (SAME_LIGHT**2 * size))


@FUSED.inlined
def _summed(p: Tiles, s: Said, row: int, col: int) -> Sums:
    """Sums over the neighbours that are known, by how near they are, how like in colour, and how well they explain the
    pixel's light."""
    channels = p.albedo.shape[1]
    red, blue, noise = colour_of(p, s, row, col)
    weight = likeness = albedo = nx = ny = nz = reds = blues = ZERO
    down = right = downs = rights = both = ZERO
    pixel = p.places[tile_at(p, row, col), row & WITHIN, col & WITHIN]
    nx_down = ny_down = nz_down = nx_right = ny_right = nz_right = ZERO
    for y in range(max(row - REACH_PX, 0), min(row + REACH_PX + 1, p.rows)):
        v = y & WITHIN
        for x in range(max(col - REACH_PX, 0), min(col + REACH_PX + 1, p.cols)):
            tile, u = tile_at(p, y, x), x & WITHIN
            state = p.lights[tile, v, u]
            if state > ALONE_AT_RIM:
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
            fits = ONE / (ONE + misfit(s, pixel, there * THIRD * a, there * THIRD * b, there * THIRD * c))
            w *= fits * fits + LEAST_SHARE
            dy, dx = np.float32(y - row), np.float32(x - col)
            weight += w
            likeness += w * alike
            albedo += w * there * THIRD
            reds += w * share_red
            blues += w * share_blue
            nx, ny, nz = nx + w * a, ny + w * b, nz + w * c
            wy, wx = w * dy, w * dx
            down, right = down + wy, right + wx
            downs, rights, both = downs + wy * dy, rights + wx * dx, both + wy * dx
            nx_down, ny_down, nz_down = nx_down + wy * a, ny_down + wy * b, nz_down + wy * c
            nx_right, ny_right, nz_right = nx_right + wx * a, ny_right + wx * b, nz_right + wx * c
    return Sums(
        weight, albedo, reds, blues, nx, ny, nz, down, right, downs, rights, both, nx_down, ny_down, nz_down, nx_right,
        ny_right, nz_right, likeness,
    )  # fmt: skip


@FUSED.inlined
def from_neighbours(
    p: Tiles, s: Said, row: int, col: int, onward: np.float32
) -> tuple[
    np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32,
    np.float32,
]:  # fmt: skip
    """The normal (x, y, z), albedo, and shares of red and blue that a pixel's neighbours give it, those most that have
    its colour and explain its light; so much of their bend is taken ``onward``, so that a round surface stays round.

    Then a vector that lies in the surface, across the way from the neighbours to the pixel; 0 where they lie all
    around. How steep a surface is across that way changes along it as its steepness along it changes across it, since
    slopes are those of one depth: so that is known where nothing else of the next normal is. At last how alike in
    colour they are, 0 to 1.
    """
    sums = _summed(p, s, row, col)
    if not sums.weight > ZERO:
        return ZERO, ZERO, ONE, ZERO, THIRD, THIRD, ZERO, ZERO, ZERO, ZERO
    one = ONE / sums.weight
    albedo, reds, blues, alike = sums.albedo * one, sums.reds * one, sums.blues * one, sums.alike * one
    c = bend_of(sums, one)
    tx, ty, tz = level_across(c)
    nx = c.nx - onward * (c.down * c.x_row + c.right * c.x_col)
    ny = c.ny - onward * (c.down * c.y_row + c.right * c.y_col)
    nz = c.nz - onward * (c.down * c.z_row + c.right * c.z_col)
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    one = ONE / max(length, TINY)
    return nx * one, ny * one, nz * one, albedo, reds, blues, tx, ty, tz, alike
