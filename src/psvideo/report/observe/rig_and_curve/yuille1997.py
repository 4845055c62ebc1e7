"""Which one change of all normals would make them a surface's, and how much nearer to one it would bring them.

A rig whose directions are wrong as a whole (turned, tilted, or three of them each its own way) changes every normal b
to A b by one matrix, which any number of plates explains. Slopes of a surface do not turn in circles, and that is
linear in two rows of A's cofactors: c1 . (b x db/dx) + c2 . (b x db/dy) = 0, with (1, 0, 0) and (0, 1, 0) for a right
rig (A. Yuille and D. Snow, "Shape and albedo from multiple images using integrability", CVPR 1997). What these rows
leave open are slopes that all grow alike, or by one slant: there A is taken for a turn.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles
from psvideo.model.rig import Rig
from psvideo.report.observe.rig_and_curve.slopes import (
    BLUR_PX,
    LEAST_PIXELS,
    NORMAL_MEDIAN,
    Averaged,
    noise_of_slopes,
)

MOST_POINTS = 12_000
FACING = 0.2
CREASE = 0.25
"""Normals that turn by more radians from pixel to pixel show a crease, or one thing before another."""
BESIDE_PX = 7
CLEAR = 32.0
"""A point counts where its normals turn by this many times the square that noise makes of them."""
OUTLIER = 2.0
"""Residuals are taken for Cauchy's, this many times their median wide."""
ROUNDS, ENOUGH, SHIFTS = 30, 1e-4, 2
FEWER = 4
"""Each round begins near its end where every fourth point was asked before."""
LEAST_TOLD = 0.02
"""Changes of which points show so little (eigenvalues, each unknown's size apart) are taken for none: a cylinder, waves
or the edges of a few faces show some changes and not others."""
WIDEST, A_LITTLE = 1.5, 0.01
"""A picture's width over the focal length is no more than a lens of 24 mm gives on film. Of a lens that is not known it
may be anything up to this: what is seen beside the axis looks turned."""
FARTHEST_AXIS = 1 / 3
"""A lens shifts by 12 mm on a film 36 mm wide (Canon TS-E, Nikon PC), and a picture cropped to three fifths at one side
has its axis as far from its middle: normals of a right rig then look tilted, just as if the rig were."""


@dataclass(frozen=True, kw_only=True)
class Lean:
    """One change of all normals. ``lean_deg`` is how far it turns one in the mean, and ``gain`` by how much less it
    leaves over than the normals as they are, as a share of what it leaves. ``turn_deg`` (x, y, z) is the turn in it,
    the axis times the angle, and ``rest_deg`` how far what is no turn turns a normal in the mean. ``off_axis`` is how
    far from the picture's middle its axis would lie, in widths of the picture, if that were to explain what it can, and
    ``least_deg`` the lean that is left then; both are None where the lens is known. ``moving_share`` is how much of the
    picture moved meanwhile."""

    lean_deg: float
    gain: float
    turn_deg: tuple[float, float, float]
    rest_deg: float
    off_axis: float | None = None
    least_deg: float | None = None
    moving_share: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Lens:
    """How a picture was seen: its ``width`` over the focal length, and where the axis meets it, ``right`` of its middle
    and ``up``, in widths of the picture."""

    width: float
    right: float = 0.0
    up: float = 0.0

    @classmethod
    def of(cls, rig: Rig | None, *, height_px: int, width_px: int) -> "Lens | None":
        """Return the lens that a rig names, None where it names none."""
        if rig is None or rig.focal_px is None or rig.principal_px is None:
            return None
        col, row = rig.principal_px
        middle = ((width_px - 1) / 2, (height_px - 1) / 2)
        return cls(
            width=width_px / rig.focal_px[0], right=(col - middle[0]) / width_px, up=(middle[1] - row) / width_px
        )


def lean(small: Averaged, *, lens: Lens | None = None) -> Lean | None:
    """Return the change that makes measured normals a surface's; None where too few of them bend.

    lens: how the picture was seen; None where that is not known: by any lens, its axis in the middle of the picture.
    """
    seen = _bending(small)
    n, ways, x, y = seen
    if len(n) < LEAST_PIXELS:
        return None
    if lens is not None:
        found = _through(seen, lens)
        return _described(found.rows, found.gain, n)
    far = _crossed(n, ways)
    by_lens = (_crossed(*_in_view(n, ways, x, y, A_LITTLE)) - far) / A_LITTLE
    free = _fitted(far, by_lens)
    lens = Lens(width=float(np.clip(free.more, 0, WIDEST)))
    found = _through(seen, lens, near=free)
    shifted, nearly = _shifted(seen, lens, found)
    left = _through(seen, shifted, near=nearly)
    gain = min(found.gain, _over_as_they_are(seen, lens, found, far, by_lens))
    return replace(
        _described(found.rows, gain, n),
        off_axis=float(np.hypot(shifted.right, shifted.up)),
        least_deg=_described(left.rows, left.gain, n).lean_deg,
    )


def _through(seen: "_Bending", lens: Lens, *, near: "_Fitted | None" = None) -> "_Fitted":
    """Find the change that makes normals a surface's that was seen through a lens; ``near`` is one not far from it."""
    crossed = _crossed(*_in_view(seen.normals, seen.ways, seen.x - lens.right, seen.y - lens.up, lens.width))
    return _fitted(crossed, None, near=near)


def _over_as_they_are(seen: "_Bending", lens: Lens, found: "_Fitted", far: Doubles, by_lens: Doubles) -> float:
    """Return the gain of what was ``found`` through a lens over normals as they are through the lens that suits these:
    what bends one way only (a pipe) fits any lens, each with a lean of its own, and noise chooses among them."""
    still, slope = far[0] + far[4], by_lens[0] + by_lens[4]
    own, _, _ = _reweighted(slope[None], still, np.zeros(1))
    suits = Lens(width=float(np.clip(own[0], 0, WIDEST)))
    as_they_are = _crossed(*_in_view(seen.normals, seen.ways, seen.x, seen.y, suits.width))
    leaning = _crossed(*_in_view(seen.normals, seen.ways, seen.x, seen.y, lens.width))
    left = np.einsum("ij,ijp->p", found.rows, leaning.reshape(2, 3, -1))
    return _gain(left, as_they_are[0] + as_they_are[4], _wide(left))


def _shifted(seen: "_Bending", lens: Lens, found: "_Fitted") -> "tuple[Lens, _Fitted]":
    """Return a lens of the same width whose axis lies where that explains most, and a change not far from what is left
    then: there the rows' last columns are -width times ``right`` and ``up``, which the same of a turned rig cannot be
    told from."""
    for turn in range(SHIFTS):
        by = found.rows[:, 2] / -max(lens.width, A_LITTLE)
        at = np.array([lens.right, lens.up]) + by
        at *= min(1.0, FARTHEST_AXIS / max(float(np.hypot(*at)), 1e-12))
        lens = replace(lens, right=float(at[0]), up=float(at[1]))
        if turn + 1 < SHIFTS:
            found = _through(seen, lens, near=found)
    return lens, found


class _Bending(NamedTuple):
    """Normals (point, 3), how they change over a picture's width to the right and upwards, (2, point, 3), and where
    they lie, x and y in such widths from the picture's middle."""

    normals: Doubles
    ways: Doubles
    x: Doubles
    y: Doubles


def _bending(seen: Averaged) -> _Bending:
    """Return normals that bend by more than noise and in one piece."""
    valid, small = seen
    noise = noise_of_slopes(valid, small)
    blurred = np.asarray(cv2.GaussianBlur(small * valid[..., None], (0, 0), BLUR_PX), np.float32)
    planes = np.moveaxis(blurred, -1, 0).copy()  # numpy is slow along a short last axis
    planes /= np.maximum(np.sqrt((planes * planes).sum(axis=0)), np.float32(1e-6))
    right, up = np.zeros_like(planes), np.zeros_like(planes)  # at the rim nothing is whole
    right[:, :, 1:-1] = (planes[:, :, 2:] - planes[:, :, :-2]) / 2
    up[:, 1:-1] = (planes[:, :-2] - planes[:, 2:]) / 2
    bend = (right * right).sum(axis=0) + (up * up).sum(axis=0)
    around = np.ones((BESIDE_PX, BESIDE_PX), np.uint8)
    whole = cv2.erode((valid & (planes[2] > FACING)).astype(np.uint8), around, borderValue=0) > 0
    torn = cv2.dilate((whole & (bend > CREASE**2)).astype(np.uint8), around) > 0
    down, across = np.nonzero(whole & ~torn & (bend > CLEAR * noise))
    each = -(-max(len(down), 1) // MOST_POINTS)
    down, across = down[::each], across[::each]
    rows, cols = valid.shape
    normals, *ways = (plane[:, down, across].T.astype(np.float64) for plane in (planes, right, up))
    place = (across - (cols - 1) / 2) / cols, ((rows - 1) / 2 - down) / cols
    return _Bending(normals, cols * np.stack(ways), *place)


def _in_view(n: Doubles, ways: Doubles, x: Doubles, y: Doubles, wide: float) -> tuple[Doubles, Doubles]:
    """Return normals and their changes as a view from far away would have them: along a ray (wide x, wide y, -1) slopes
    of the logarithm of depth are as n1 and n2 over n3 - wide (x n1 + y n2)."""
    seen, changes = n.copy(), ways.copy()
    seen[:, 2] -= wide * (x * n[:, 0] + y * n[:, 1])
    changes[..., 2] -= wide * (x * ways[..., 0] + y * ways[..., 1] + n[:, :2].T)
    return seen, changes


def _crossed(n: Doubles, ways: Doubles) -> Doubles:
    """Return b x db/dx and b x db/dy, (6, point); what faces the camera counts for more."""
    (x, y, z), facing = n.T, np.maximum(n[:, 2] / np.linalg.norm(n, axis=1), FACING)
    planes = [(y * c - z * b, z * a - x * c, x * b - y * a) for a, b, c in np.moveaxis(ways, -1, 1)]
    return np.asarray(np.concatenate(planes) * facing)


class _Fitted(NamedTuple):
    """``rows``, c1 and c2 (2, 3); how much of one ``more`` unknown; and how much less that leaves over, as a
    share."""

    rows: Doubles
    more: float
    gain: float


def _fitted(crossed: Doubles, more: Doubles | None, *, near: _Fitted | None = None) -> _Fitted:
    """Find c1 = (1 + a, b, c) and c2 = (d, 1 - a, e): their size is left open. ``more`` (6, point): what one unknown
    adds to ``crossed``; ``near`` is where to begin."""
    still = crossed[0] + crossed[4]
    terms = [crossed[0] - crossed[4], *crossed[[1, 2, 3, 5]]]
    terms += [] if more is None else [more[0] + more[4]]
    slopes = np.stack(terms)
    found = np.zeros(len(terms))
    if near is not None:
        (_, b, c), (d, one_less, e) = near.rows
        found[:5] = 1 - one_less, b, c, d, e
    elif len(still) >= FEWER * LEAST_PIXELS:
        found, _, _ = _reweighted(slopes[:, ::FEWER].copy(), still[::FEWER].copy(), found)
    found, left, width = _reweighted(slopes, still, found)
    a, b, c, d, e = found[:5]
    rows = np.array([[1 + a, b, c], [d, 1 - a, e]])
    return _Fitted(rows=rows, more=float(found[-1]), gain=_gain(left, still, width))


def _gain(left: Doubles, still: Doubles, width: float) -> float:
    """Return by how much less is ``left`` (point,) than ``still`` was, as a share, for residuals so wide."""
    cost, none = (float(np.mean(np.log1p((one / width) ** 2))) for one in (left, still))
    return none / max(cost, 1e-12) - 1


def _wide(left: Doubles) -> float:
    return OUTLIER * median(np.abs(left)) / NORMAL_MEDIAN + 1e-12


def _reweighted(slopes: Doubles, still: Doubles, found: Doubles) -> tuple[Doubles, Doubles, float]:
    """Return the unknowns that leave least over of ``still`` (point,), round by round from those ``found``; what they
    leave, and how wide that is. ``slopes`` (unknown, point) is what each adds."""
    for _ in range(ROUNDS):
        left = still + np.einsum("ip,i->p", slopes, found)
        width = _wide(left)
        weighted = slopes / (1 + (left / width) ** 2)
        squares, pull = weighted @ slopes.T, np.einsum("ip,p->i", weighted, still)  # BLAS would cut sums by threads
        before, found = found, -_solved(squares, pull)
        if np.abs(found - before).max() < ENOUGH:
            break
    return found, left, width


def _solved(squares: Doubles, pull: Doubles) -> Doubles:
    """Solve normal equations for what they determine; the rest is 0."""
    sizes = np.sqrt(np.diag(squares)) + 1e-12
    told, ways = np.linalg.eigh(squares / sizes / sizes[:, None])
    kept = ways[:, told > LEAST_TOLD] / np.sqrt(told[told > LEAST_TOLD])
    return np.asarray(kept @ (kept.T @ (pull / sizes)) / sizes)


def _described(rows: Doubles, gain: float, normals: Doubles) -> Lean:
    across = np.cross(*rows)
    cofactors = np.vstack([rows, across / np.linalg.norm(across)])
    left, sizes, right = np.linalg.svd(cofactors)
    turn = np.asarray(cv2.Rodrigues(left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right)[0]).ravel()
    return Lean(
        lean_deg=_turned_deg(normals, np.linalg.inv(cofactors)),
        gain=gain,
        turn_deg=(float(np.degrees(turn[0])), float(np.degrees(turn[1])), float(np.degrees(turn[2]))),
        rest_deg=_turned_deg(normals, right.T @ np.diag(1 / np.maximum(sizes, 1e-6)) @ right),
    )


def _turned_deg(normals: Doubles, by: Doubles) -> float:
    """Return how far a matrix turns normals (point, 3) in the mean."""
    x, y, z = normals.T.copy()  # numpy is slow along a short last axis
    turned = [x * by[0, axis] + y * by[1, axis] + z * by[2, axis] for axis in range(3)]
    sizes = np.sqrt(turned[0] ** 2 + turned[1] ** 2 + turned[2] ** 2)
    cosines = (turned[0] * x + turned[1] * y + turned[2] * z) / np.maximum(sizes, 1e-12)
    return float(np.degrees(np.arccos(np.clip(cosines, -1, 1))).mean())
