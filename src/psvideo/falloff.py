"""How the light of each lamp falls off over the picture, beyond what the rig explains: lens vignetting, narrow lamps.

``psvideo calibrate flat-field --flat FILE`` measures it on a white target; ``psvideo normals --flat FILE`` divides it
out. A light's falloff is ``exp(polynomial)`` of degree DEGREE in column and row over half the picture's width, 1 where
its intensity in the rig was measured. Beyond the target, where nothing was measured, it stays as at the edge.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tomlkit
from numpy.typing import NDArray
from pydantic import Field

from psvideo.camera import FloatArray
from psvideo.errors import PsvideoError
from psvideo.tomlfile import Contract, read_toml

SCHEMA = "psvideo-flat/1"
DEGREE = 4
POWERS = tuple((across, down) for total in range(DEGREE + 1) for down in range(total + 1) for across in [total - down])
"""Powers of column and row of a polynomial's terms, in the file's order."""


@dataclass(frozen=True, kw_only=True)
class Falloff:
    """Every light's falloff over pictures of one size; ``box`` (left, top, right, bottom) is where it was measured.

    ``lights`` are names with their polynomial's coefficients.
    """

    width_px: int
    height_px: int
    box: tuple[int, int, int, int]
    lights: tuple[tuple[str, tuple[float, ...]], ...]

    def field(self, light: str) -> NDArray[np.float32]:
        """Return what share of its light arrives at every pixel (row, col), 1 where the intensity was measured.

        Raises PsvideoError where the light was not measured.
        """
        known = dict(self.lights)
        if light not in known:
            raise PsvideoError(
                f"The flat field holds no light {light!r}; it holds {', '.join(known)}. Measure it with all lights of "
                "the plan (psvideo calibrate flat-field --flat)."
            )
        left, top, right, bottom = self.box
        cols = np.clip(np.arange(self.width_px), left, right - 1)
        rows = np.clip(np.arange(self.height_px), top, bottom - 1)
        across, down = terms(cols, rows, width_px=self.width_px, height_px=self.height_px)
        total = sum(factor * np.outer(down**j, across**i) for factor, (i, j) in zip(known[light], POWERS, strict=True))
        return np.exp(total).astype(np.float32)


def terms(
    cols: NDArray[np.integer], rows: NDArray[np.integer], *, width_px: int, height_px: int
) -> tuple[FloatArray, FloatArray]:
    """Return columns and rows counted from the picture's middle, in half its width."""
    half = width_px / 2
    across: FloatArray = (cols.astype(np.float64) - (width_px - 1) / 2) / half
    down: FloatArray = (rows.astype(np.float64) - (height_px - 1) / 2) / half
    return across, down


class _Light(Contract):
    name: str
    coefficients: Annotated[list[float], Field(min_length=len(POWERS), max_length=len(POWERS))]


class _File(Contract):
    schema_: Literal["psvideo-flat/1"] = Field(alias="schema")
    width_px: int = Field(gt=0)
    height_px: int = Field(gt=0)
    box: Annotated[list[int], Field(min_length=4, max_length=4)]
    light: Annotated[list[_Light], Field(min_length=1)]


def read_falloff(path: Path, *, width_px: int, height_px: int) -> Falloff:
    """Read a flat field for pictures of this size. Raises PsvideoError where it is none, or of another size."""
    file = read_toml(path, _File, SCHEMA)
    if (file.width_px, file.height_px) != (width_px, height_px):
        raise PsvideoError(
            f"{path}: was measured on pictures of {file.width_px} x {file.height_px} pixels, and these are "
            f"{width_px} x {height_px}. Measure the flat field with the same camera and mode."
        )
    left, top, right, bottom = file.box
    if not (0 <= left < right <= width_px and 0 <= top < bottom <= height_px):
        raise PsvideoError(f"{path}: box {file.box} is not inside the picture of {width_px} x {height_px} pixels.")
    lights = tuple((light.name, tuple(light.coefficients)) for light in file.light)
    return Falloff(width_px=width_px, height_px=height_px, box=(left, top, right, bottom), lights=lights)


def format_falloff(falloff: Falloff) -> str:
    """Return a flat field as TOML text; reading it back gives an equal one."""
    document = tomlkit.document()
    document["schema"] = SCHEMA
    document["width_px"], document["height_px"] = falloff.width_px, falloff.height_px
    document["box"] = list(falloff.box)
    lights = tomlkit.aot()
    for name, coefficients in falloff.lights:
        table = tomlkit.table()
        table["name"], table["coefficients"] = name, list(coefficients)
        lights.append(table)
    document["light"] = lights
    return tomlkit.dumps(document)
