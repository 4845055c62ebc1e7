"""Rig files: rig.toml (schema ``psvideo-rig/1``). ``read_rig`` reads the light lists of other programs as well."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Self

import numpy as np
import tomlkit
from pydantic import Field, field_validator, model_validator

from psvideo.errors import PsvideoError
from psvideo.formats.contract import Contract, check_light_name, parse_toml, read_text
from psvideo.formats.light_lists.light_list_reader import read_light_list
from psvideo.formats.paths import path_of
from psvideo.model.irradiance.ground import FARTHEST_M
from psvideo.model.rig import UNIT_TOLERANCE, Light, Rig, Vector, vector

SCHEMA = "psvideo-rig/1"

Triple = Annotated[list[float], Field(min_length=3, max_length=3)]
Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Strength = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0)]
Colour = Annotated[list[Share], Field(min_length=3, max_length=3)]


class _RigLight(Contract):
    name: str = Field(min_length=1)
    direction: Triple | None = None
    position_m: Triple | None = None
    intensity: Strength | Annotated[list[Strength], Field(min_length=1, max_length=3)] = 1.0
    error_deg: float | None = Field(default=None, ge=0)
    reference_duration_s: float | None = Field(default=None, gt=0)
    anisotropy: float | None = Field(default=None, ge=0)
    axis: Triple | None = None
    colour: Colour | None = None

    @field_validator("name")
    @classmethod
    def _name_can_name_files(cls, name: str) -> str:
        return check_light_name(name)

    @field_validator("intensity", mode="before")
    @classmethod
    def _gives_light(cls, strength: object) -> object:
        if isinstance(strength, int | float) and not isinstance(strength, bool) and strength <= 0:
            raise ValueError(
                "expected greater than 0 or a list (a light that stayed dark keeps the strength that it has when it "
                "fires: pictures show that it was dark, and normals are solved without it)"
            )
        return strength

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if (self.direction is None) == (self.position_m is None):
            raise ValueError(
                f"light {self.name!r} needs either direction (distant) or position_m (near), one of the two"
            )
        for key in ("direction", "axis"):
            vector = getattr(self, key)
            if vector is not None and abs(np.linalg.norm(vector) - 1.0) > UNIT_TOLERANCE:
                length = np.linalg.norm(vector)
                raise ValueError(
                    f"light {self.name!r}: {key} has length {length:.4g}, expected a unit vector (length 1)"
                )
        if self.colour is not None and not any(self.colour):
            raise ValueError(f"light {self.name!r}: colour is black; expected what the camera's channels see of it")
        away_m = 0.0 if self.position_m is None else float(np.linalg.norm(self.position_m))
        if away_m > FARTHEST_M:
            raise ValueError(
                f"light {self.name!r}: position_m is {away_m:.4g} metres from the camera, and a near light is at most "
                f"{FARTHEST_M:.0f}; if these are millimetres, divide them by 1000"
            )
        return self


class _View(Contract):
    focal_px: Annotated[list[Strength], Field(min_length=2, max_length=2)] | None = None
    principal_px: Pair | None = None


class _Surface(Contract):
    plane: Annotated[list[float], Field(min_length=4, max_length=4)] | None = None
    colour: Annotated[list[Strength], Field(min_length=3, max_length=3)] | None = None


class _RigFile(Contract):
    schema_: str = Field(alias="schema")
    light: list[_RigLight] = Field(min_length=1)
    camera: _View = Field(default_factory=_View)
    surface: _Surface | None = None

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [light.name for light in self.light]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"two lights have the name {twice[0]!r}; expected a name of its own for each")
        return self


def read_rig(path: Path | str, *, plan_lights: Sequence[str] = ()) -> Rig:
    """Read where the lights are and how strong.

    Parameters
    ----------
    path
        rig.toml, an .lp list (RTI), DiLiGenT's light_directions.txt with light_intensities.txt beside it, or a plain
        list of unit vectors with its count on the first line.
    plan_lights
        The lights that are needed; names for the lights of lists that name none of these, in order. Left out, lights
        are called as the list calls them or their pictures, else they are numbered.

    Returns
    -------
    Rig
        ``lights``, each with ``name``, ``direction`` (unit vector from the surface, camera's frame) or ``position_m``,
        and ``intensity``; the lens and the subject's plane where the file gives them.

    Raises
    ------
    PsvideoError
        Names the file, what was found and what was expected.

    Examples
    --------
    >>> import psvideo as ps
    >>> rig = ps.read_rig("take3/rig.toml")
    >>> rig.names
    ('key', 'left', 'top')
    >>> [round(part, 3) for part in rig.lights[0].direction]
    [0.488, 0.39, 0.781]
    """
    path = path_of("path", path)
    if path.suffix == ".toml" or path.is_dir():  # a folder is refused, and the rigs in it are named
        rig = _in_front(parse_rig(read_text(path, kind=SCHEMA), source=str(path)), path)
        try:
            rig.select(plan_lights)
        except PsvideoError as fault:
            raise PsvideoError(f"{path}: {fault}") from None
        return rig
    return _in_front(read_light_list(path, plan_lights=plan_lights), path)


def _in_front(rig: Rig, path: Path) -> Rig:
    """Return the rig; raise PsvideoError where no light can reach what the camera sees."""
    heights = [light.direction[2] for light in rig.lights if light.direction is not None]
    if heights and len(heights) == len(rig.lights) and max(heights) <= 0:
        raise PsvideoError(
            f"{path}: every light stands behind the subject (z is {max(heights):.2g} at most). Expected directions "
            "from the surface to the light in the camera's axes: x right, y up, z towards the camera. Turn the sign "
            "of z, and of y where it counts downwards."
        )
    return rig


def parse_rig(text: str, *, source: str = "rig") -> Rig:
    """Read a rig from TOML text; ``source`` is what messages call it."""
    file = parse_toml(text, _RigFile, SCHEMA, source=source)
    view, surface = file.camera, file.surface or _Surface()
    return Rig(
        lights=tuple(_light(light) for light in file.light),
        focal_px=None if view.focal_px is None else (view.focal_px[0], view.focal_px[1]),
        principal_px=None if view.principal_px is None else (view.principal_px[0], view.principal_px[1]),
        plane=None if (at := surface.plane) is None else (at[0], at[1], at[2], at[3]),
        surface_colour=None if surface.colour is None else vector(surface.colour),
    )


def _light(file: _RigLight) -> Light:
    strength = file.intensity if isinstance(file.intensity, list) else [file.intensity]
    return Light(
        name=file.name,
        intensity=tuple(strength),
        direction=None if file.direction is None else _unit(file.direction),
        position_m=None if file.position_m is None else vector(file.position_m),
        error_deg=file.error_deg,
        reference_duration_s=file.reference_duration_s,
        anisotropy=file.anisotropy,
        axis=None if file.axis is None else _unit(file.axis),
        colour=None if file.colour is None else vector(file.colour),
    )


def _unit(values: Sequence[float]) -> Vector:
    """Return a vector of exactly unit length; one that is so already to 1e-12 keeps its digits."""
    length = float(np.linalg.norm(values))
    return vector(values) if abs(length - 1.0) < 1e-12 else vector(np.asarray(values, np.float64) / length)


def format_rig(rig: Rig) -> str:
    """Return the rig as TOML text; reading it back gives an equal rig."""
    document = tomlkit.document()
    document["schema"] = SCHEMA
    lights = tomlkit.aot()
    for light in rig.lights:
        lights.append(_light_table(light))
    document["light"] = lights
    view = {"focal_px": rig.focal_px, "principal_px": rig.principal_px}
    if any(view.values()):
        document["camera"] = {key: list(pair) for key, pair in view.items() if pair}
    surface = {"plane": rig.plane, "colour": rig.surface_colour}
    if any(surface.values()):
        document["surface"] = {key: list(values) for key, values in surface.items() if values}
    return tomlkit.dumps(document)


def _light_table(light: Light) -> tomlkit.items.Table:
    table = tomlkit.table()
    table["name"] = light.name
    keys = ("direction", "position_m", "intensity", "colour", "error_deg", "reference_duration_s", "anisotropy", "axis")
    for key in keys:
        value = getattr(light, key)
        if key == "intensity" and len(value) == 1:
            value = value[0]
        if value is not None:
            table[key] = list(value) if isinstance(value, tuple) else value
    return table
