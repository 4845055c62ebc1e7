"""A flat field as a file: how the light of each lamp falls off over the picture (schema ``psvideo-flat/1``)."""

from pathlib import Path
from typing import Annotated, Literal

import tomlkit
from pydantic import Field

from psvideo.errors import PsvideoError
from psvideo.formats.contract import Contract, read_toml
from psvideo.model.irradiance.falloff import POWERS, Falloff

SCHEMA = "psvideo-flat/1"


class _FlatLight(Contract):
    name: str
    coefficients: Annotated[list[float], Field(min_length=len(POWERS), max_length=len(POWERS))]


class _File(Contract):
    schema_: Literal["psvideo-flat/1"] = Field(alias="schema")
    width_px: int = Field(gt=0)
    height_px: int = Field(gt=0)
    box: Annotated[list[int], Field(min_length=4, max_length=4)]
    light: Annotated[list[_FlatLight], Field(min_length=1)]


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
