"""A rig guessed from pictures alone (uncalibrated photometric stereo): for a first look, not for measuring.

The pictures of a matte surface under distant lights have rank three (H. Hayakawa, "Photometric stereo under a light
source with arbitrary motion", JOSA A 11(11), 1994): lights and surface come out up to a 3 x 3 matrix, which
assumptions fix. Lights of equal strength (six or more), or a surface of equal albedo, leave a rotation; that the
normals belong to a surface (integrability; A. Yuille and D. Snow, "Shape and albedo from multiple images using
integrability", CVPR 1997) leaves convex or concave; the subject is assumed to bulge towards the camera.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from psvideo.calibrate.cho2020 import LIT
from psvideo.calibrate.light_pictures import LightPictures
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.choices import Prior
from psvideo.model.rig import Light, Rig, vector

LEAST_FOR_EQUAL_LIGHTS = 6
LEAST_PIXELS = 1000
ROUNDS = 3
KEPT = 0.9
SMOOTH_PX = 2.0
STARTS, BEST_STARTS = 4000, 6
LEAST_SINGULAR = 1e-3
MOST_SPREAD = 0.1
"""How unequal what the prior calls equal may come out."""
LEAST_EXPLAINED = 0.98
"""Share of the pictures that rank three must hold: the rest is gloss, shadow and light from neighbours."""
ERROR_DEG = 20.0
"""What is written as every direction's standard error: on real spheres guesses were off by 6 to 22 degrees."""


@dataclass(frozen=True, kw_only=True)
class Guess:
    """A guessed rig; ``explained`` is the share of the pictures that rank three holds, ``spread`` how unequal what the
    prior calls equal came out (relative standard deviation)."""

    rig: Rig
    prior: Prior
    explained: float
    spread: float


def guess_rig(pictures: LightPictures, *, prior: Prior | None = None) -> Guess:
    """Return a rig from pictures of a matte subject under three or more distant lights.

    Raises PsvideoError where there is too little to go by, or where the prior contradicts the pictures.
    """
    chosen = _prior(len(pictures.names), prior)
    grey = pictures.grey.astype(np.float64)
    mask = _lit_by_all(pictures, grey)
    factor, codes, explained = _factorised(grey[:, mask])
    if explained < LEAST_EXPLAINED:
        raise PsvideoError(
            f"A matte surface explains {explained:.1%} of these pictures; expected {LEAST_EXPLAINED:.0%} or more. "
            "Gloss, shadows or near lights spoil a guess: show a matte thing alone, or calibrate on a sphere."
        )
    bend = _root(_metric(factor if chosen == "equal-lights" else codes))
    if chosen == "equal-lights":
        lit, surface = factor @ bend, codes @ np.linalg.inv(bend).T
    else:
        lit, surface = factor @ np.linalg.inv(bend).T, codes @ bend
    lit = lit @ _upright(surface, mask).T
    equal = np.linalg.norm(lit if chosen == "equal-lights" else surface, axis=1)
    spread = float(equal.std() / equal.mean())
    if spread > MOST_SPREAD:
        raise PsvideoError(
            f"What `prior` {chosen} assumes to be equal comes out unequal by {spread:.0%}, so directions cannot be "
            "guessed. Try the other `prior`, take out gloss and shadow, or calibrate on a sphere."
        )
    return Guess(rig=_rig_of(pictures.names, lit), prior=chosen, explained=explained, spread=spread)


def _prior(lights: int, wished: Prior | None) -> Prior:
    """Return what is taken for equal. Raises PsvideoError where this many lights do not show their directions."""
    chosen: Prior = wished or ("equal-lights" if lights >= LEAST_FOR_EQUAL_LIGHTS else "equal-albedo")
    if lights < (LEAST_FOR_EQUAL_LIGHTS if chosen == "equal-lights" else 3):
        raise PsvideoError(
            f"{lights} lights do not show their directions by themselves: expected three or more, and six or more of "
            "equal strength for `prior='equal-lights'`. Calibrate on a sphere instead."
        )
    return chosen


def _rig_of(names: Sequence[str], lit: Doubles) -> Rig:
    """Return lights whose vectors (light, 3) are direction times strength, their mean strength 1."""
    lengths = np.linalg.norm(lit, axis=1)
    strengths = lengths / lengths.mean()
    return Rig(
        lights=tuple(
            Light(name=name, direction=vector(way / length), intensity=(float(f"{strength:.6g}"),), error_deg=ERROR_DEG)
            for name, way, length, strength in zip(names, lit, lengths, strengths, strict=True)
        )
    )


def _lit_by_all(pictures: LightPictures, grey: Doubles) -> NDArray[np.bool_]:
    clipped = pictures.saturated if pictures.saturated.ndim == 3 else pictures.saturated.any(axis=3)
    least, most = grey.min(axis=0), grey.max(axis=0)
    seen: NDArray[np.bool_] = np.all(pictures.seen, axis=0)[:, None]
    shown = (least > LIT * most) & (most > 0.05 * np.percentile(most, 99)) & ~clipped.any(axis=0)
    mask: NDArray[np.bool_] = shown & seen
    if mask.sum() < LEAST_PIXELS:
        raise PsvideoError(
            f"Only {int(mask.sum())} pixels are lit by every light and not saturated; expected {LEAST_PIXELS} or more "
            "to guess directions from. Calibrate on a sphere instead."
        )
    return mask


def _factorised(values: Doubles) -> tuple[Doubles, Doubles, float]:
    """Return lights (light, 3) and surface (pixel, 3) up to a matrix, and the share of energy that they explain."""
    ways, sizes, _ = np.linalg.svd(values @ values.T)
    factor = ways[:, :3] * sizes[:3] ** 0.25
    codes: Doubles = np.linalg.lstsq(factor, values, rcond=None)[0].T.astype(np.float64)
    codes /= (scale := float(np.median(np.linalg.norm(codes, axis=1))))
    return factor * scale, codes, float(sizes[:3].sum() / sizes.sum())


def _metric(vectors: Doubles) -> Doubles:
    """Return the symmetric matrix B with ``v B v = 1`` for vectors (n, 3), those that fit best.

    Raises PsvideoError where the vectors leave it open: on a cone (lights in a regular ring) or in a plane.
    """
    kept = np.ones(len(vectors), np.bool_)
    x, y, z = vectors.T
    equations = np.stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z], axis=1)
    for _ in range(ROUNDS):
        (a, b, c, d, e, f), _, _, sizes = np.linalg.lstsq(equations[kept], np.ones(int(kept.sum())), rcond=None)
        rest = np.abs(equations @ np.array([a, b, c, d, e, f]) - 1)
        kept = rest <= np.quantile(rest, KEPT) if len(vectors) > 100 else kept
    if sizes[-1] < LEAST_SINGULAR * sizes[0]:
        raise PsvideoError(
            "These pictures fit several directions of the lights equally well, as where lights stand in a regular "
            "ring, or the subject faces few ways. Try the other `prior`, or calibrate on a sphere."
        )
    return np.array([[a, d, e], [d, b, f], [e, f, c]])


def _root(square: Doubles) -> Doubles:
    sizes, ways = np.linalg.eigh(square)
    if sizes[0] <= 0:
        raise PsvideoError(
            "No lights of equal strength (or no surface of equal albedo) explain these pictures, so directions cannot "
            "be guessed. Try the other `prior`, take out gloss and shadow, or calibrate on a sphere."
        )
    root: Doubles = ways * np.sqrt(sizes)
    return root


def _upright(surface: Doubles, mask: NDArray[np.bool_]) -> Doubles:
    """Return the rotation (or reflection) that makes scaled normals (pixel, 3) a surface that bulges to the camera."""
    turn = _integrable(surface, mask)
    turned = surface @ turn.T
    if np.median(turned[:, 2]) < 0:
        turn, turned = -turn, -turned
    row, col = np.nonzero(mask)
    outward = ((col - col.mean()) * turned[:, 0] - (row - row.mean()) * turned[:, 1]).sum()
    return turn if outward > 0 else np.diag([-1.0, -1.0, 1.0]) @ turn


def _integrable(surface: Doubles, mask: NDArray[np.bool_]) -> Doubles:
    """Return the rotation R under which scaled normals c (pixel, 3) belong to a surface.

    Of b = R c must hold ``(b x b_x) . x + (b x b_y) . y = 0``, and a rotation of c turns the cross products alike: a
    quadratic form in R's first two rows, whose least value over many rotations is looked for and then refined.
    """
    field = np.zeros((*mask.shape, 3))
    field[mask] = surface
    weight = cv2.GaussianBlur(mask.astype(np.float64), (0, 0), SMOOTH_PX)
    field = cv2.GaussianBlur(field, (0, 0), SMOOTH_PX) / np.maximum(weight, 1e-6)[..., None]
    inner = mask[1:-1, 1:-1] & mask[1:-1, 2:] & mask[1:-1, :-2] & mask[2:, 1:-1] & mask[:-2, 1:-1]
    here = field[1:-1, 1:-1][inner]
    by_x = (field[1:-1, 2:] - field[1:-1, :-2])[inner]
    by_y = (field[:-2, 1:-1] - field[2:, 1:-1])[inner]
    scale = 1 / np.maximum((here**2).sum(axis=1, keepdims=True), 1e-12)
    equations = np.concatenate([np.cross(here, by_x) * scale, np.cross(here, by_y) * scale], axis=1)
    starts = Rotation.random(STARTS, rng=np.random.default_rng(0)).as_matrix()
    kept = np.ones(len(equations), np.bool_)
    for _ in range(ROUNDS):
        form = equations[kept].T @ equations[kept]
        rows = starts[:, :2].reshape(-1, 6)
        cost = np.einsum("ni,ij,nj->n", rows, form, rows)
        found = [_refined(starts[n], form) for n in np.argsort(cost)[:BEST_STARTS]]
        turn = min(found, key=lambda one: float(one[:2].ravel() @ form @ one[:2].ravel()))
        rest = np.abs(equations @ turn[:2].ravel())
        kept = rest <= np.quantile(rest, KEPT)
    return turn


def _refined(start: Doubles, form: Doubles) -> Doubles:
    unit = form / np.trace(form)

    def cost(by: Doubles) -> float:
        rows = (Rotation.from_rotvec(by).as_matrix() @ start)[:2].ravel()
        return float(rows @ unit @ rows)

    by = minimize(cost, np.zeros(3), method="BFGS").x  # type: ignore[no-untyped-call]
    turned: Doubles = Rotation.from_rotvec(by).as_matrix() @ start
    return turned
