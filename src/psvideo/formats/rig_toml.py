"""Rig files: rig.toml (schema ``psvideo-rig/1``), and the light lists of other programs.

Read as well: ``.lp`` (RTI), DiLiGenT's ``light_directions.txt`` with ``light_intensities.txt`` beside it, and a plain
list of unit vectors with its count on the first line (University of Washington). Lists without names belong to the
plan's lights in the order in which the plan first lights them.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Self

import numpy as np
import tomlkit
from pydantic import Field, field_validator, model_validator

from psvideo.errors import PsvideoError
from psvideo.formats.contract import Contract, check_light_name, parse_toml, read_text
from psvideo.formats.list_rows import counted, refuse_angles
from psvideo.formats.paths import path_of
from psvideo.model.rig import Light, Rig, Vector

SCHEMA = "psvideo-rig/1"
UNIT_LENGTH_TOLERANCE = 0.01
FARTHEST_LIGHT_M = 50.0
"""No near light is further from the camera; positions in millimetres are, from 5 cm on."""

DECIMAL_COMMA = re.compile(r"-?\d+,\d+")

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

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if (self.direction is None) == (self.position_m is None):
            raise ValueError(
                f"light {self.name!r} needs either direction (distant) or position_m (near), one of the two"
            )
        for key in ("direction", "axis"):
            vector = getattr(self, key)
            if vector is not None and abs(np.linalg.norm(vector) - 1.0) > UNIT_LENGTH_TOLERANCE:
                length = np.linalg.norm(vector)
                raise ValueError(
                    f"light {self.name!r}: {key} has length {length:.4g}, expected a unit vector (length 1)"
                )
        if self.colour is not None and not any(self.colour):
            raise ValueError(f"light {self.name!r}: colour is black; expected what the camera's channels see of it")
        away_m = 0.0 if self.position_m is None else float(np.linalg.norm(self.position_m))
        if away_m > FARTHEST_LIGHT_M:
            raise ValueError(
                f"light {self.name!r}: position_m is {away_m:.4g} metres from the camera, and a near light is at most "
                f"{FARTHEST_LIGHT_M:.0f}; if these are millimetres, divide them by 1000"
            )
        return self


class _View(Contract):
    focal_px: Pair | None = None
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
        Names for the lights of lists that carry none, in order; left out, they are numbered.

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
    text = read_text(path)
    if path.suffix == ".toml":
        return _in_front(parse_rig(text, source=str(path)), path)
    rows = _numbers(path, text)
    if path.suffix == ".lp" or len(rows[0]) == 1:
        rows = counted(path, rows)
    if not rows:
        raise PsvideoError(f"{path}: says that it lists 0 lights; expected a line for every light.")
    short = next((place for place, row in enumerate(rows, start=1) if len(row) < 3), None)
    if short:
        raise PsvideoError(
            f"{path}: light {short} has only {len(rows[short - 1])} of the three numbers x y z of the direction to the "
            "light (x right, y up, z towards the camera). Angles are to be made directions first."
        )
    vectors = np.array([row[:3] for row in rows], np.float64)
    lengths = np.linalg.norm(vectors, axis=1)
    if np.any(lengths < 1e-6):
        raise PsvideoError(
            f"{path}: vector {int(np.argmin(lengths)) + 1} has no length; expected directions to lights."
        )
    refuse_angles(path, vectors)
    beside = _diligent_strengths(path, len(rows))
    strengths = [tuple(row[3:6]) if len(row) == 6 else strength for row, strength in zip(rows, beside, strict=True)]
    names = _names(path, len(rows), plan_lights)
    lights = [
        Light(name=name, direction=_vector(vector), intensity=strength)
        for name, vector, strength in zip(names, vectors / lengths[:, None], strengths, strict=True)
    ]
    return _in_front(Rig(lights=tuple(lights)), path)


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
        surface_colour=None if surface.colour is None else _vector(surface.colour),
    )


def _light(file: _RigLight) -> Light:
    strength = file.intensity if isinstance(file.intensity, list) else [file.intensity]
    return Light(
        name=file.name,
        intensity=tuple(strength),
        direction=None if file.direction is None else _unit(file.direction),
        position_m=None if file.position_m is None else _vector(file.position_m),
        error_deg=file.error_deg,
        reference_duration_s=file.reference_duration_s,
        anisotropy=file.anisotropy,
        axis=None if file.axis is None else _unit(file.axis),
        colour=None if file.colour is None else _vector(file.colour),
    )


def _vector(values: Sequence[float] | np.ndarray[tuple[int], np.dtype[np.float64]]) -> Vector:
    return float(values[0]), float(values[1]), float(values[2])


def _unit(values: Sequence[float]) -> Vector:
    """Return a vector of exactly unit length; one that is so already to 1e-12 keeps its digits."""
    length = float(np.linalg.norm(values))
    return _vector(values) if abs(length - 1.0) < 1e-12 else _vector(np.asarray(values, np.float64) / length)


def _numbers(path: Path, text: str) -> list[list[float]]:
    """Return the numbers of each line; words (an .lp file's picture names) are left out."""
    comma = next((word for word in re.split(r"[\s;]+", text) if DECIMAL_COMMA.fullmatch(word)), None)
    if comma:
        raise PsvideoError(
            f"{path}: writes {comma!r}. Expected numbers with points, such as {comma.replace(',', '.')}."
        )
    lines = [re.split(r"[,;]" if re.search("[,;]", line) else r"\s+", line.strip()) for line in text.splitlines()]
    rows = [[float(word) for word in words if is_number(word)] for words in lines]
    rows = [row for row in rows if row]
    if not rows:
        raise PsvideoError(
            f"{path}: holds no numbers. Expected rig.toml, an .lp file, or one light direction x y z per line."
        )
    return rows


def is_number(word: str) -> bool:
    """Return whether a word of a list is a finite number."""
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False


def _diligent_strengths(path: Path, count: int) -> list[tuple[float, ...]]:
    """Return the intensities of the ``light_intensities.txt`` beside a DiLiGenT list, else 1 for every light."""
    beside = path.with_name("light_intensities.txt")
    if path.name != "light_directions.txt" or not beside.is_file():
        return [(1.0,)] * count
    rows = _numbers(beside, read_text(beside))
    if len(rows) != count:
        raise PsvideoError(f"{beside}: holds {len(rows)} intensities, and {path.name} beside it {count} directions.")
    return [tuple(row) for row in rows]


def _names(path: Path, count: int, plan_lights: Sequence[str]) -> list[str]:
    if not plan_lights:
        return [f"L{index}" for index in range(count)]
    if len(plan_lights) != count:
        raise PsvideoError(
            f"{path}: lists {count} lights, and the plan flashes {len(plan_lights)} ({', '.join(plan_lights)}). A list "
            "without names must hold exactly the plan's lights, in the order in which the plan first lights them."
        )
    return list(plan_lights)


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
