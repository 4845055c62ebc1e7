"""The compiled loops of bilateral integration: how much each side of a pixel counts, and the equations that follow.

X. Cao et al. 2022, section 4: at each pixel p and in each direction the one-sided steps a d+ and a d-, with a the
facing, are weighed against each other by w+ = 1 / (1 + exp(-k ((a d-)^2 - (a d+)^2))), w- = 1 - w+. The energy is the
sum over p of w+ (a d+ - n)^2 + w- (a d- - n)^2. Where a neighbour is missing, the step that a smooth surface would
make, a d = n, stands in for comparing (the paper leaves that open).
"""

from typing import Any, NamedTuple

import numpy as np

from psvideo.compute.compiled import REORDERED
from psvideo.model.arrays import Floats
from psvideo.solve.depth.checkerboard import HALF, ONE, ZERO
from psvideo.solve.depth.view import Slopes

LEAST_SHARE = np.float32(1e-6)
"""A part held by less would float away on rounding errors."""
STEEPEST = np.float32(7.9)
# the coefficients of tanh(x) = x p(x^2) / q(x^2), accurate to 32 bits within STEEPEST (as in Eigen's ptanh)
P = tuple(
    np.float32(x)
    for x in (
        4.89352455891786e-03, 6.37261928875436e-04, 1.48572235717979e-05, 5.12229709037114e-08,
        -8.60467152213735e-11, 2.00018790482477e-13, -2.76076847742355e-16,
    )
)  # fmt: skip
Q = tuple(
    np.float32(x) for x in (4.89352518554385e-03, 2.26843463243900e-03, 1.18534705686654e-04, 1.19825839466702e-06)
)


class Shares(NamedTuple):
    """How much a pixel's steps to the right and down count against the opposite ones, (row, col) each, 0 to 1."""

    rightward: Floats
    downward: Floats


@REORDERED.inlined
def logistic(evidence: Any) -> Any:
    """The logistic function, between LEAST_SHARE and 1 less that, in operations that run on whole vectors."""
    x = min(max(HALF * evidence, -STEEPEST), STEEPEST)
    s = x * x
    over = x * (P[0] + s * (P[1] + s * (P[2] + s * (P[3] + s * (P[4] + s * (P[5] + s * P[6]))))))
    under = Q[0] + s * (Q[1] + s * (Q[2] + s * Q[3]))
    return min(max(HALF + HALF * over / under, LEAST_SHARE), ONE - LEAST_SHARE)


@REORDERED.called
def _weigh(ahead: Any, behind: Any, slope: Any, sharpness: Any, share: Any) -> Any:
    """Fill a line of shares of the step ahead; return the line's energy."""
    energy = ZERO
    for c in range(len(slope)):
        share[c] = logistic(sharpness * (behind[c] * behind[c] - ahead[c] * ahead[c]))
    for c in range(len(slope)):
        one, other = ahead[c] - slope[c], behind[c] - slope[c]
        energy += share[c] * one * one + (ONE - share[c]) * other * other
    return energy


@REORDERED.called
def _row_steps(height: Any, facing: Any, slope: Any, ahead: Any, behind: Any) -> None:
    """Fill a line's steps ahead and behind, along the row."""
    cols = len(slope)
    for c in range(cols - 1):
        step = np.float32(height[c + 1] - height[c])
        ahead[c] = facing[c] * step if facing[c + 1] > ZERO else slope[c]
        behind[c + 1] = facing[c + 1] * step if facing[c] > ZERO else slope[c + 1]
    ahead[cols - 1], behind[0] = slope[cols - 1], slope[0]


@REORDERED.called
def _col_steps(height: Any, facing: Any, slope: Any, aspect: Any, row: int, to: int, out: Any) -> None:
    """Fill a line's steps towards the next row, or from the one before."""
    sign = np.float32(to - row)
    if to < 0 or to >= height.shape[0]:
        for c in range(slope.shape[1]):
            out[c] = slope[row, c]
        return
    here, there, own, other, wanted = height[row], height[to], facing[row], facing[to], slope[row]
    for c in range(len(out)):
        step = sign * np.float32(there[c] - here[c])
        out[c] = aspect * own[c] * step if other[c] > ZERO else wanted[c]


@REORDERED.kept
def weigh_sides(
    height: Any, slopes: Slopes, sharpness: Any, shares: Shares, lines: Any, first: int, last: int, energy: float
) -> float:
    """Fill some rows' shares of their right and lower steps; return the energy at the height, added to that of the
    rows before.

    ``sharpness`` is k, 0 for equal shares; ``lines`` (2, col) is memory.
    """
    facing, across, down, aspect = slopes
    ahead, behind = lines[0], lines[1]
    for row in range(first, last):
        _row_steps(height[row], facing[row], across[row], ahead, behind)
        energy += _weigh(ahead, behind, across[row], sharpness, shares.rightward[row])
        _col_steps(height, facing, down, aspect, row, row + 1, ahead)
        _col_steps(height, facing, down, aspect, row, row - 1, behind)
        energy += _weigh(ahead, behind, down[row], sharpness, shares.downward[row])
    return energy


@REORDERED.inlined
def _tie(share: Any, facing: Any, slope: Any, next_share: Any, next_facing: Any, next_slope: Any) -> Any:
    """The tie of two neighbours, and the flow between them that their slopes ask for; 0 where one is not valid."""
    if facing <= ZERO or next_facing <= ZERO:
        return ZERO, ZERO
    ahead, behind = share * facing, (ONE - next_share) * next_facing
    return ahead * facing + behind * next_facing, ahead * slope + behind * next_slope


@REORDERED.kept
def fill_equations(
    height: Any, slopes: Slopes, shares: Shares, ties: Any, lacking: Any, share: float, first: int, last: int
) -> None:
    """Fill some rows' ties and add to what every pixel's equation lacks at a share of a height, as boards (see
    ``checkerboard.py``)."""
    facing, across, down, aspect = slopes
    rightward, downward = shares
    rows, cols = height.shape
    for r in range(first, last):
        for c in range(cols - 1):
            colour, k, to = (r + c) % 2, c // 2 + 1, (c + 1) // 2 + 1
            tie, flow = _tie(
                rightward[r, c], facing[r, c], across[r, c], rightward[r, c + 1], facing[r, c + 1], across[r, c + 1]
            )
            ties[0, colour, r + 1, k] = tie
            lack = np.float32(tie * (share * (height[r, c + 1] - height[r, c])) - flow)
            lacking[colour, r + 1, k] += lack
            lacking[1 - colour, r + 1, to] -= lack
        if r + 1 < rows:
            for c in range(cols):
                colour, k = (r + c) % 2, c // 2 + 1
                tie, flow = _tie(
                    downward[r, c], facing[r, c] * aspect, down[r, c],
                    downward[r + 1, c], facing[r + 1, c] * aspect, down[r + 1, c],
                )  # fmt: skip
                ties[1, colour, r + 1, k] = tie
                lack = np.float32(tie * (share * (height[r + 1, c] - height[r, c])) - flow)
                lacking[colour, r + 1, k] += lack
                lacking[1 - colour, r + 2, k] -= lack


@REORDERED.kept
def add_board(board: Any, height: Any, first: int, last: int) -> None:
    """Add some rows of a board to a height (row, col)."""
    for r in range(first, last):
        for c in range(height.shape[1]):
            height[r, c] += board[(r + c) % 2, r + 1, c // 2 + 1]


@REORDERED.kept
def write_board(values: Any, board: Any, first: int) -> None:
    """Put a picture (row, col) onto a board, from the row ``first`` on."""
    for r in range(first, first + values.shape[0]):
        for c in range(values.shape[1]):
            board[(r + c) % 2, r + 1, c // 2 + 1] = values[r - first, c]


@REORDERED.kept
def pull_to_pins(pins: Any, height: Any, wanted: Any, lacking: Any, first: int, last: int) -> None:
    """Add to what some rows' equations lack what pins pull a height (row, col) towards the wanted one."""
    for r in range(first, last):
        for c in range(height.shape[1]):
            colour, k = (r + c) % 2, c // 2 + 1
            lacking[colour, r + 1, k] += pins[colour, r + 1, k] * np.float32(wanted[r, c] - height[r, c])
