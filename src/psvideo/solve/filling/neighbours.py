"""The normal, albedo and colour that a pixel's neighbours suggest, those of its own colour most; compiled."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded
from psvideo.solve.filling.looking import Said
from psvideo.solve.filling.tiles import ODD_AT_RIM, WITHIN, Tiles, tile_at
from psvideo.solve.normals.loops.blocks import ONE, ZERO

REACH_PX = 4  # neighbours are looked at so far in every direction,
SPREAD_PX = 2.0  # with weights that fall off so,
SAME_COLOUR = np.float32(0.015)  # and with the colour: shares of red and blue that differ so much weigh a half;
SAME_LIGHT = np.float32(0.2)  # what would show a light that differs by this share of it weighs a quarter,
LEAST_SHARE = np.float32(1e-3)  # and nothing less than this;
WEIGHTS = np.array([0.1, 0.25, 0.5, 1.0, 1.0, 0.1], np.float32)  # of states: no, one, two lights, solved
UNCOLOURED = np.float32(0.01)  # the square of what is not known of the colour of a pixel without light
LEAST_SPREAD = np.float32(0.1)  # of neighbours' places, a variance: fewer do not show a bend
LEAST_AWAY_PX, LEAST_FACING = np.float32(0.3), np.float32(0.15)
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
def _level_across(
    down: np.float32, right: np.float32, vy: np.float32, vx: np.float32, vxy: np.float32,
    nx: np.float32, ny: np.float32, nz: np.float32,
    x_row: np.float32, y_row: np.float32, z_row: np.float32, x_col: np.float32, y_col: np.float32, z_col: np.float32,
) -> tuple[np.float32, np.float32, np.float32]:  # fmt: skip
    """The vector that lies in the surface across the way from the neighbours to the pixel, whose mean place is
    (down, right) of it, with (co)variances (vy, vx, vxy), from their mean normal and what it changes by for each row
    and column; 0 where they lie all around."""
    away = np.sqrt(down * down + right * right)
    if not away > LEAST_AWAY_PX:
        return ZERO, ZERO, ZERO
    # slopes, -x / z for each column (p) and y / z for each row (q), and what they change by
    z = max(nz, LEAST_FACING)
    slope_p, slope_q, one = -nx / z, ny / z, ONE / z
    p_row, p_col = (-x_row - slope_p * z_row) * one, (-x_col - slope_p * z_col) * one
    q_row, q_col = (y_row - slope_q * z_row) * one, (y_col - slope_q * z_col) * one
    # along the way u that growth goes, and across it
    u_row, u_col = -down / away, -right / away
    across = slope_q * u_col - slope_p * u_row
    one_way = (q_col * u_col + q_row * u_row) * u_col - (p_col * u_col + p_row * u_row) * u_row
    other_way = (p_row * u_col - p_col * u_row) * u_col + (q_row * u_col - q_col * u_row) * u_row
    along_spread = vy * u_row * u_row + vx * u_col * u_col + np.float32(2) * vxy * u_row * u_col
    across_spread = vy * u_col * u_col + vx * u_row * u_row - np.float32(2) * vxy * u_row * u_col
    across += away * (one_way * along_spread + other_way * across_spread) / (along_spread + across_spread)
    one = ONE / np.sqrt(ONE + across * across)
    return -u_row * one, -u_col * one, across * one


@FUSED.inlined
def from_neighbours(
    p: Tiles, s: Said, row: int, col: int, onward: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """The normal (x, y, z), albedo, and shares of red and blue that a pixel's neighbours give it, those most that have
    its colour and explain its light; so much of their bend is taken ``onward``, so that a round surface stays round.

    At last a vector that lies in the surface, across the way from the neighbours to the pixel; 0 where they lie all
    around. How steep a surface is across that way changes along it as its steepness along it changes across it, since
    slopes are those of one depth: so that is known where nothing else of the next normal is.
    """
    channels = p.albedo.shape[1]
    red, blue, noise = colour_of(p, s, row, col)
    weight = albedo = nx = ny = nz = reds = blues = ZERO
    down = right = downs = rights = both = ZERO
    pixel = p.places[tile_at(p, row, col), row & WITHIN, col & WITHIN]
    nx_down = ny_down = nz_down = nx_right = ny_right = nz_right = ZERO
    for y in range(max(row - REACH_PX, 0), min(row + REACH_PX + 1, p.rows)):
        v = y & WITHIN
        for x in range(max(col - REACH_PX, 0), min(col + REACH_PX + 1, p.cols)):
            tile, u = tile_at(p, y, x), x & WITHIN
            state = p.lights[tile, v, u]
            if state > ODD_AT_RIM:
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
        return ZERO, ZERO, ONE, ZERO, THIRD, THIRD, ZERO, ZERO, ZERO
    one = ONE / weight
    albedo, reds, blues = albedo * one, reds * one, blues * one
    nx, ny, nz, down, right = nx * one, ny * one, nz * one, down * one, right * one
    vy, vx = downs * one - down * down + LEAST_SPREAD, rights * one - right * right + LEAST_SPREAD
    vxy = both * one - down * right
    determinant = ONE / (vy * vx - vxy * vxy)
    # the straight course of the neighbours' normals: what they change by for each row and column
    ax, ay, az = nx_down * one - down * nx, ny_down * one - down * ny, nz_down * one - down * nz
    bx, by, bz = nx_right * one - right * nx, ny_right * one - right * ny, nz_right * one - right * nz
    x_row, x_col = (ax * vx - bx * vxy) * determinant, (bx * vy - ax * vxy) * determinant
    y_row, y_col = (ay * vx - by * vxy) * determinant, (by * vy - ay * vxy) * determinant
    z_row, z_col = (az * vx - bz * vxy) * determinant, (bz * vy - az * vxy) * determinant
    tx, ty, tz = _level_across(
        down, right, vy, vx, vxy, nx, ny, nz, x_row, y_row, z_row, x_col, y_col, z_col
    )  # fmt: skip
    nx -= onward * (down * x_row + right * x_col)
    ny -= onward * (down * y_row + right * y_col)
    nz -= onward * (down * z_row + right * z_col)
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    one = ONE / max(length, TINY)
    return nx * one, ny * one, nz * one, albedo, reds, blues, tx, ty, tz
