"""Metals of two scanned shapes, as microfacets and three older formulas mirror: solved by their highlights, and not."""

from collections.abc import Callable, Iterator
from itertools import product
from typing import NamedTuple

import cv2
import numpy as np

from bench.accuracy_measure import SHARED_DATA, angles_deg, photographed, read_image
from psvideo.model.arrays import Doubles, Mask
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving

SHAPES, COUNTS = ("cat", "bear"), (9, 16, 48)
UP = np.array([0.0, 0.0, 1.0])
MATERIALS = {
    "metallic paint": (0.15, 0.4, 0.45),
    "bronze": (0.05, 0.6, 0.35),
    "brushed metal": (0.02, 0.7, 0.25),
    "rough metal": (0.02, 0.7, 0.6),
    "very rough metal": (0.03, 0.8, 0.5),
    "satin varnish, no metal": (0.3, 0.2, 0.4),
}
"""Diffuse share, strength and roughness of the highlight. Paint varies the diffuse share by 0.4."""
FORMULAS = ("microfacets", "ward", "beckmann", "phong")
LEAST = 1e-3


class Solved(NamedTuple):
    """Means over sets: degrees over every pixel by least squares, without the look for metal and with it; percent
    trusted, percent of the subject trusted and over 10 degrees, and held by the claim and twice."""

    material: str
    least_squares: str
    without: str
    deg: str
    trusted: str
    trusted_and_wrong: str
    claims: str
    bar: str
    met: bool


class _Set(NamedTuple):
    deg: float
    trusted: float
    wrong: float
    within: float
    twice: float


def rows() -> Iterator[Solved]:
    """Solve every set of every material."""
    every = list[tuple[float, _Set, _Set]]()
    for name in MATERIALS:
        sets = [_solved(name, *one) for one in product(SHAPES, FORMULAS, COUNTS)]
        every += sets
        yield _row(name, sets)
    yield _row("all", every)


def _solved(material: str, shape: str, formula: str, count: int) -> tuple[float, _Set, _Set]:
    truth, mask = _scanned(shape)
    lights = _spread(photographed("bear").lit.directions, count)
    plates = _shot(truth, mask, lights, MATERIALS[material], formula)
    g = np.linalg.lstsq(lights, plates[:, mask], rcond=None)[0].T
    plain = angles_deg(g / np.maximum(np.linalg.norm(g, axis=1, keepdims=True), 1e-9), truth[mask])
    lit = Illumination(directions=lights, intensities=np.ones((count, 1)))
    found = (_measured(plates, lit, truth, mask, metal=metal) for metal in (False, True))
    return float(plain.mean()), *found  # type: ignore[return-value]


def _measured(plates: Doubles, lit: Illumination, truth: Doubles, mask: Mask, *, metal: bool) -> _Set:
    surface = Solving(error=True, metal=metal).solve([*plates.astype(np.float32)], lit, mask=mask)
    off, claim = angles_deg(surface.normals[mask], truth[mask]), np.asarray(surface.error_deg)[mask]
    valid = surface.valid[mask]
    return _Set(
        deg=float(off.mean()),
        trusted=float(valid.mean()),
        wrong=float((valid & (off > 10)).mean()),
        within=float((off <= claim).mean()),
        twice=float((off <= 2 * claim).mean()),
    )


def _scanned(shape: str) -> tuple[Doubles, Mask]:
    """Return normals and mask of one of DiLiGenT's scans, every second pixel of it."""
    folder = SHARED_DATA / "diligent_gt" / shape
    mask = read_image(folder / "mask.png", cv2.IMREAD_GRAYSCALE) > 127
    normals = read_image(folder / "normal_map.png", cv2.IMREAD_UNCHANGED)[..., ::-1] / 65535 * 2 - 1
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-9)
    down, across = np.nonzero(mask)
    part = np.s_[down.min() - 6 : down.max() + 7 : 2, across.min() - 6 : across.max() + 7 : 2]
    return normals[part], mask[part]


def _spread(directions: Doubles, count: int) -> Doubles:
    """Return so many directions that are far apart, the one nearest to the axis first."""
    chosen = [int(np.argmax(directions[:, 2]))]
    while len(chosen) < count:
        chosen.append(int(np.argmin((directions @ directions[chosen].T).max(axis=1))))
    return np.asarray(directions[chosen])


def _shot(normals: Doubles, mask: Mask, lights: Doubles, material: tuple[float, float, float], formula: str) -> Doubles:
    """Return plates (light, row, col) with a camera's noise; the ninth tenth of what is brightest is 0.7."""
    diffuse, strength, roughness = material
    rng = np.random.default_rng(0)
    paint = cv2.GaussianBlur(rng.standard_normal(mask.shape), (0, 0), 8)
    diffuse = diffuse * np.clip(1 + 0.4 * paint / paint.std(), 0.2, None) / np.pi
    shown = np.stack([
        np.maximum(normals @ light, 0) * (diffuse + strength * LOBES[formula](normals, light, roughness))
        for light in lights
    ])  # fmt: skip
    shown = np.minimum(shown * mask * 0.7 / np.percentile(shown[:, mask].max(axis=0), 90), 1.5)
    noise = 0.004 * np.sqrt(shown + 0.02) * rng.standard_normal(shown.shape)
    return np.asarray(np.maximum(shown + noise, 0))


def _cosines(normals: Doubles, light: Doubles) -> tuple[Doubles, Doubles, Doubles]:
    """Return the cosines to half way, to the light and to the camera."""
    half = (light + UP) / np.linalg.norm(light + UP)
    h, c, facing = (np.maximum(normals @ way, LEAST) for way in (half, light, UP))
    return h, c, facing


def _microfacets(normals: Doubles, light: Doubles, roughness: float) -> Doubles:
    """B. Walter et al., EGSR 2007."""
    h, c, facing = _cosines(normals, light)
    square = roughness**2
    facets = square / np.pi / (h * h * (square - 1) + 1) ** 2
    seen = [2 * each / (each + np.sqrt(square + (1 - square) * each * each)) for each in (c, facing)]
    return np.asarray(facets * seen[0] * seen[1] / (4 * c * facing))


def _ward(normals: Doubles, light: Doubles, roughness: float) -> Doubles:
    """G. Ward, "Measuring and modeling anisotropic reflection", 1992."""
    h, c, facing = _cosines(normals, light)
    gauss = np.exp(-(1 / (h * h) - 1) / roughness**2)
    return np.asarray(gauss / (4 * np.pi * roughness**2 * np.sqrt(c * facing)))


def _beckmann(normals: Doubles, light: Doubles, roughness: float) -> Doubles:
    """R. Cook and K. Torrance, "A reflectance model for computer graphics", 1982."""
    h, c, facing = _cosines(normals, light)
    facets = np.exp(-(1 / (h * h) - 1) / roughness**2) / (np.pi * roughness**2 * h**4)
    along = float((light + UP)[2] / np.linalg.norm(light + UP))
    seen = np.minimum(1, np.minimum(2 * h * facing / along, 2 * h * c / along))
    return np.asarray(facets * seen / (4 * c * facing))


def _phong(normals: Doubles, light: Doubles, roughness: float) -> Doubles:
    """J. F. Blinn, 1977; the power that is as broad as a roughness."""
    power = 2 / roughness**2 - 2
    return np.asarray((power + 8) / (8 * np.pi) * _cosines(normals, light)[0] ** max(power, 1))


LOBES: dict[str, Callable[[Doubles, Doubles, float], Doubles]] = {
    "microfacets": _microfacets,
    "ward": _ward,
    "beckmann": _beckmann,
    "phong": _phong,
}


def _row(material: str, sets: list[tuple[float, _Set, _Set]]) -> Solved:
    plain = float(np.mean([one[0] for one in sets]))
    before, now = (_Set(*(float(value) for value in np.mean([one[k] for one in sets], axis=0))) for k in (1, 2))
    return Solved(
        material=material,
        least_squares=f"{plain:.1f}",
        without=f"{before.deg:.1f}",
        deg=f"{now.deg:.1f}",
        trusted=f"{100 * before.trusted:.0f} -> {100 * now.trusted:.0f} %",
        trusted_and_wrong=f"{100 * before.wrong:.1f} -> {100 * now.wrong:.1f} %",
        claims=f"{100 * before.within:.0f}/{100 * before.twice:.0f} -> {100 * now.within:.0f}/{100 * now.twice:.0f}",
        bar="of what is trusted over 10 deg <= 3 %",
        met=now.wrong <= 0.03 * now.trusted,
    )
