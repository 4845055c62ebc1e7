"""How the normals of a pixel's neighbours bend: a straight course through them, which the pixel continues; compiled."""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.solve.normals.loops.blocks import ONE, ZERO

LEAST_SPREAD = np.float32(0.1)  # of neighbours' places, a variance: fewer do not show a bend
LEAST_AWAY_PX, LEAST_FACING = np.float32(0.3), np.float32(0.15)


class Bend(NamedTuple):
    """How neighbours' normals run, as a straight line through their mean.

    ``down`` and ``right`` are their mean place, in rows and columns from the pixel, ``vy``, ``vx`` and ``vxy`` the
    (co)variances of their places. The normal is (nx, ny, nz) there, and changes by (x_row, y_row, z_row) for each row
    and (x_col, y_col, z_col) for each column.
    """

    down: np.float32
    right: np.float32
    vy: np.float32
    vx: np.float32
    vxy: np.float32
    nx: np.float32
    ny: np.float32
    nz: np.float32
    x_row: np.float32
    y_row: np.float32
    z_row: np.float32
    x_col: np.float32
    y_col: np.float32
    z_col: np.float32


class Sums(NamedTuple):
    """Weighted sums over a pixel's neighbours: of 1, of albedo, of shares of red and blue, of normals; of places, rows
    ``down`` and columns ``right`` of the pixel, their squares and their product; of normals times places; of how alike
    in colour they are."""

    weight: np.float32
    albedo: np.float32
    reds: np.float32
    blues: np.float32
    nx: np.float32
    ny: np.float32
    nz: np.float32
    down: np.float32
    right: np.float32
    downs: np.float32
    rights: np.float32
    both: np.float32
    nx_down: np.float32
    ny_down: np.float32
    nz_down: np.float32
    nx_right: np.float32
    ny_right: np.float32
    nz_right: np.float32
    alike: np.float32


@FUSED.inlined
def level_across(course: Bend) -> tuple[np.float32, np.float32, np.float32]:
    """The vector that lies in the surface across the way from the neighbours to the pixel; 0 where they lie all
    around."""
    down, right, vy, vx, vxy, nx, ny, nz, x_row, y_row, z_row, x_col, y_col, z_col = course
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
def bend_of(sums: Sums, one: np.float32) -> Bend:
    """How neighbours' normals run, from their sums and 1 over the sum of weights."""
    nx, ny, nz, down, right = sums.nx * one, sums.ny * one, sums.nz * one, sums.down * one, sums.right * one
    vy, vx = sums.downs * one - down * down + LEAST_SPREAD, sums.rights * one - right * right + LEAST_SPREAD
    vxy = sums.both * one - down * right
    determinant = ONE / (vy * vx - vxy * vxy)
    # the straight course of the neighbours' normals: what they change by for each row and column
    ax, ay, az = sums.nx_down * one - down * nx, sums.ny_down * one - down * ny, sums.nz_down * one - down * nz
    bx, by, bz = sums.nx_right * one - right * nx, sums.ny_right * one - right * ny, sums.nz_right * one - right * nz
    x_row, x_col = (ax * vx - bx * vxy) * determinant, (bx * vy - ax * vxy) * determinant
    y_row, y_col = (ay * vx - by * vxy) * determinant, (by * vy - ay * vxy) * determinant
    z_row, z_col = (az * vx - bz * vxy) * determinant, (bz * vy - az * vxy) * determinant
    return Bend(down, right, vy, vx, vxy, nx, ny, nz, x_row, y_row, z_row, x_col, y_col, z_col)
