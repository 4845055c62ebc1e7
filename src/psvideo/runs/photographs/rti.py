"""Photographs as a relightable picture: a polynomial texture map in the files that Relight writes for the web, and as
.ptm for programs on the desk.

The light of every pixel is a polynomial of the light's direction, times the pixel's colour (T. Malzbender, D. Gelb and
H. Wolters, "Polynomial texture maps", SIGGRAPH 2001). OpenLIME, the viewer of museums and archives, shows ``info.json``
with its planes; what is highlight or shadow in the photographs stays, as far as six numbers can hold it.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.export.ptm_file import write_ptm
from psvideo.formats.screen_pictures import write_jpeg
from psvideo.formats.whole_files import write_text
from psvideo.model.arrays import Doubles, Floats, Pixels
from psvideo.model.rig import Rig, directions, intensities
from psvideo.model.srgb import srgb_share
from psvideo.pictures.on_screen import exposure_for
from psvideo.plates.sequence import Round
from psvideo.solve.passes.plate_rows import BAND_PIXELS, PlateRows

FOLDER = "rti"
PTM = "relight.ptm"
LARGEST_PX = 4096
"""The longer side of the planes: graphics cards hold textures of this many pixels everywhere."""
QUALITY = 95
RIDGE = 1e-3
"""What keeps few lights from making polynomials that burst between them, as a share of the equations' trace."""
CUT_PERCENT = (0.05, 99.95)
"""Numbers of a plane between these percentiles are kept; its 8 bits are spread over them."""
PLANES = 9
THIN = 4
"""Every fourth row and column say how bright the pictures are."""
RED_GREEN_BLUE, TERMS = 3, 6
ZERO, ONE = np.zeros(3), np.ones(3)


def write_rti(folder: Path, one: Round, rig: Rig) -> None:
    """Write ``rti/`` of a round whose plates stand in the order of the rig's distant lights: planes, and a .ptm."""
    rows = PlateRows.of([plate.picture for plate in one.plates], None)
    step = max(-(-max(rows.shape[:2]) // LARGEST_PX), 1)
    lamps = directions(rig.lights)
    strengths = intensities(rig.lights, 1 if len(rows.shape) == 2 else 3)
    exposure = min(
        exposure_for(plate.picture.thinned(max(step, THIN)) / np.float32(of.mean()))
        for plate, of in zip(one.plates, strengths, strict=True)
    )
    base, terms = _fitted(rows, lamps, strengths / exposure, step)
    _write_map(folder / FOLDER, base, terms, lamps)


def _write_map(target: Path, base: Pixels, terms: NDArray[np.float16], lamps: Doubles) -> None:
    """Write planes, info.json and the .ptm of a colour (row, col, 3) and polynomials (row, col, 6)."""
    target.mkdir(parents=True, exist_ok=True)
    scale, bias = [1.0] * RED_GREEN_BLUE, [0.0] * RED_GREEN_BLUE
    write_jpeg(target / "plane_0.jpg", base, quality=QUALITY)
    ends = [np.percentile(terms[..., n], CUT_PERCENT) for n in range(TERMS)]
    low, high = np.stack(ends, axis=-1)
    span = np.maximum(high - low, 1e-3)
    write_ptm(target / PTM, base, terms, low, span)
    scale += [float(f"{value:.6g}") for value in span]
    bias += [float(f"{value:.6g}") for value in -low / span]
    for number, first in enumerate(range(0, TERMS, 3), start=1):
        part = slice(first, first + 3)
        write_jpeg(target / f"plane_{number}.jpg", _codes(terms[..., part], low[part], span[part]), quality=QUALITY)
    info = {
        "width": base.shape[1],
        "height": base.shape[0],
        "format": "jpg",
        "type": "ptm",
        "colorspace": "lrgb",
        "nplanes": PLANES,
        "quality": QUALITY,
        "materials": [{"scale": scale, "bias": bias}],
        "lights": [float(f"{value:.6g}") for value in lamps.ravel()],
    }
    write_text(target / "info.json", json.dumps(info, indent=1) + "\n")


def terms_of(lights: Doubles) -> Doubles:
    """Return the polynomial's terms for directions (light, 3): 1, x, y, x squared, x times y, y squared."""
    x, y = lights[:, 0], lights[:, 1]
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)


def _fitted(rows: PlateRows, lamps: Doubles, strengths: Doubles, step: int) -> tuple[Pixels, NDArray[np.float16]]:
    """Return the colour of every pixel in codes (row, col, 3), its largest channel 255, and the polynomials
    (row, col, 6)."""
    high, wide = rows.shape[0] // step, rows.shape[1] // step
    base, terms = np.empty((high, wide, 3), np.uint8), np.empty((high, wide, TERMS), np.float16)
    basis = terms_of(lamps)
    used = np.arange(TERMS) < (TERMS if len(lamps) >= TERMS else RED_GREEN_BLUE)
    equations = (basis * used).T @ (basis * used)
    solving = np.linalg.solve(equations + RIDGE * np.trace(equations) / TERMS * np.eye(TERMS), (basis * used).T)

    def fit(first: int, last: int) -> None:
        seen = [_shown(rows.light(n, first * step, last * step), step, strengths[n]) for n in range(len(lamps))]
        colour = np.mean(seen, axis=0)
        colour = colour / np.maximum(colour.max(axis=-1, keepdims=True), 1e-4)
        base[first:last] = _codes(colour, ZERO, ONE)
        square = np.maximum((colour**2).sum(axis=-1), 1e-4)
        levels = [(one * colour).sum(axis=-1) / square for one in seen]
        terms[first:last] = np.tensordot(np.stack(levels, axis=-1), solving, axes=(-1, -1))

    over_ranges(fit, high, each=max(BAND_PIXELS // (wide * step * step), 1))
    return base, terms


def _shown(light: Floats, step: int, strength: Sequence[float] | Doubles) -> Floats:
    """Return a plate's rows as a screen shows them, (row, col, 3), each pixel the mean of ``step`` by ``step``."""
    high, wide = light.shape[0] // step, light.shape[1] // step
    blocks = light[:, : wide * step].reshape(high, step, wide, step, -1)
    even = blocks.mean(axis=(1, 3)) / np.asarray(strength, np.float32)
    return np.broadcast_to(srgb_share(even), (high, wide, 3))


def _codes(plane: NDArray[np.floating], low: Doubles, span: Doubles) -> Pixels:
    """Return 8-bit codes that go from ``low`` to so much more, (row, col, 3)."""
    codes = np.empty(plane.shape, np.uint8)
    for row, shown in zip(plane, codes, strict=True):
        shown[:] = 255 * np.clip((row - low) / span, 0, 1) + 0.5
    return codes
