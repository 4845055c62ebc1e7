"""plan.toml: the capture plan as a file (schema ``psvideo-plan/1``)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, Self

import tomlkit
from pydantic import Field, field_validator, model_validator

from psvideo.formats.contract import Contract, check_light_name, parse_toml, read_text
from psvideo.formats.frame_rates import parse_fps
from psvideo.formats.paths import path_of
from psvideo.model.camera import Camera, CfaPattern, Encoding, exposure_of
from psvideo.model.maximal_length import TAPS
from psvideo.model.plan import Mode, Plan, PlannedFlash, assemble_plan

SCHEMA = "psvideo-plan/1"

Power = Annotated[float, Field(ge=0, le=1)]


class _Camera(Contract):
    name: str = "camera"
    width_px: int = Field(gt=0)
    height_px: int = Field(gt=0)
    fps: int | float | str
    shutter_deg: float | None = Field(default=None, gt=0, le=360)
    exposure_s: float | None = Field(default=None, gt=0)
    readout_s: float | Literal["unknown"] | None = None
    transfer: str = "linear"
    black_level: float | None = None
    white_level: float | None = None
    cfa: CfaPattern | None = None

    @field_validator("fps")
    @classmethod
    def _fps_is_a_rate(cls, fps: float | str) -> float | str:
        parse_fps(fps)
        return fps

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if self.shutter_deg is not None and self.exposure_s is not None:
            raise ValueError("shutter_deg and exposure_s are both given; expected one of the two")
        period_s = float(1 / parse_fps(self.fps))
        if self.exposure_s is not None and self.exposure_s > period_s * (1 + 1e-6):
            raise ValueError(_too_long("exposure_s", self.exposure_s, period_s))
        if isinstance(self.readout_s, float) and abs(self.readout_s) > period_s * (1 + 1e-3):
            raise ValueError(_too_long("readout_s", self.readout_s, period_s))
        levels = (self.black_level, self.white_level)
        if levels[0] is not None and levels[1] is not None and levels[0] >= levels[1]:
            raise ValueError(f"black_level is {levels[0]:g}; expected below white_level, which is {levels[1]:g}")
        return self


def _too_long(name: str, value_s: float, period_s: float) -> str:
    said = f"{name} is {value_s:g}, longer than the frame period of {period_s:.6g} s"
    if abs(value_s) * 1e-3 > period_s:
        return said
    return f"{said}; times are in seconds, and {abs(value_s):g} ms is {value_s * 1e-3:g}"


class _Flash(Contract):
    lights: dict[str, Power]
    duration_s: float | None = Field(default=None, gt=0)

    @field_validator("lights")
    @classmethod
    def _names_can_name_files(cls, lights: dict[str, Power]) -> dict[str, Power]:
        for name in lights:
            check_light_name(name)
        return lights


class RoundTable(Contract):
    """How the strobe plays its list of flashes: what a plan's and a scene's ``[strobe]`` have in common."""

    mode: Mode = "rolling"
    dark_s: float | None = Field(default=None, ge=0)
    rise_s: float = Field(default=0.0, ge=0)
    fall_s: float = Field(default=0.0, ge=0)
    clock_tolerance_ppm: Annotated[float, Field(ge=0, le=10_000)] | Literal["unknown"] = 100.0
    dark_every: int = Field(default=1, ge=1)
    dark_code: int = 0

    @model_validator(mode="after")
    def _has_one_pattern(self) -> Self:
        if self.dark_code and self.dark_code not in TAPS:
            raise ValueError(f"dark_code is {self.dark_code}; expected an order from {min(TAPS)} to {max(TAPS)}, or 0")
        if self.dark_code and self.dark_every > 1:
            raise ValueError("dark_code and dark_every both say which rounds are dark; expected one of the two")
        return self

    def plan(self, camera: Camera, flashes: Sequence[PlannedFlash]) -> Plan:
        """Return the plan that plays these flashes for a camera."""
        return assemble_plan(
            camera=camera,
            flashes=flashes,
            dark_s=self.dark_s,
            mode=self.mode,
            rise_s=self.rise_s,
            fall_s=self.fall_s,
            clock_tolerance_ppm=self.clock_tolerance_ppm,
            dark_every=self.dark_every,
            dark_code=self.dark_code,
        )


class _Strobe(RoundTable):
    flash: list[_Flash] = Field(min_length=1)


class _PlanFile(Contract):
    schema_: str = Field(alias="schema")
    camera: _Camera
    strobe: _Strobe

    @model_validator(mode="after")
    def _has_what_its_mode_needs(self) -> Self:
        if not any(power > 0 for flash in self.strobe.flash for power in flash.lights.values()):
            raise ValueError("strobe.flash lights no light at all; expected at least one flash such as { key = 1.0 }")
        if self.strobe.mode == "synced":
            return self
        missing = [f"strobe.flash[{i + 1}].duration_s" for i, f in enumerate(self.strobe.flash) if f.duration_s is None]
        if self.camera.shutter_deg is None and self.camera.exposure_s is None:
            missing.append("camera.shutter_deg (or camera.exposure_s)")
        if self.camera.readout_s is None:
            missing.append('camera.readout_s (in seconds, or "unknown")')
        if missing:
            raise ValueError(f"a {self.strobe.mode} plan needs {' and '.join(missing)}, which is missing")
        return self


def read_plan(path: Path | str) -> Plan:
    """Read plan.toml: the camera, and which lights the strobe flashes when.

    Parameters
    ----------
    path
        The file; the keys are those of "The plan" in formats.md.

    Returns
    -------
    Plan
        ``lights``, ``camera``, ``flashes`` and what follows from them, times in seconds.

    Raises
    ------
    PsvideoError
        Names file, key, what was found and what was expected.

    Examples
    --------
    >>> import psvideo as ps
    >>> plan = ps.read_plan("take3/plan.toml")
    >>> plan.lights, plan.camera.height_px, plan.flashes[0].duration_s
    (('key', 'left', 'top'), 120, 0.001)
    """
    return parse_plan(read_text(path_of("path", path), kind=SCHEMA), source=str(path))


def parse_plan(text: str, *, source: str = "plan") -> Plan:
    """Read a plan from TOML text; ``source`` is what messages call it."""
    file = parse_toml(text, _PlanFile, SCHEMA, source=source)
    camera = _camera(file.camera)
    flashes = [
        PlannedFlash(lights=dict(flash.lights), duration_s=flash.duration_s or camera.frame_period_s)
        for flash in file.strobe.flash
    ]
    return file.strobe.plan(camera, flashes)


def _camera(file: _Camera) -> Camera:
    fps = parse_fps(file.fps)
    readout_s = None if file.readout_s == "unknown" else file.readout_s or 0.0
    encoding = Encoding(
        transfer=file.transfer, black_level=file.black_level, white_level=file.white_level, cfa=file.cfa
    )
    return Camera(
        name=file.name,
        width_px=file.width_px,
        height_px=file.height_px,
        fps=fps,
        exposure_s=exposure_of(fps, shutter_deg=file.shutter_deg, exposure_s=file.exposure_s),
        readout_s=readout_s,
        encoding=encoding,
    )


def format_plan(plan: Plan) -> str:
    """Return the plan as TOML text; reading it back gives an equal plan."""
    document = tomlkit.document()
    document["schema"] = SCHEMA
    document["camera"] = _camera_table(plan.camera)
    strobe = tomlkit.table()
    strobe["mode"] = plan.mode
    strobe["dark_s"] = plan.dark_s
    strobe["rise_s"] = plan.rise_s
    strobe["fall_s"] = plan.fall_s
    strobe["clock_tolerance_ppm"] = "unknown" if plan.clock_tolerance_ppm is None else plan.clock_tolerance_ppm
    if plan.dark_code:
        strobe["dark_code"] = plan.dark_code
    else:
        strobe["dark_every"] = plan.dark_every
    flashes = tomlkit.aot()
    for flash in plan.flashes:
        table = tomlkit.table()
        lights = tomlkit.inline_table()
        lights.update(dict(flash.lights))
        table["lights"] = lights
        table["duration_s"] = flash.duration_s
        flashes.append(table)
    strobe["flash"] = flashes
    document["strobe"] = strobe
    return tomlkit.dumps(document)


def _camera_table(camera: Camera) -> tomlkit.items.Table:
    table = tomlkit.table()
    table["name"] = camera.name
    table["width_px"] = camera.width_px
    table["height_px"] = camera.height_px
    table["fps"] = camera.fps.numerator if camera.fps.denominator == 1 else str(camera.fps)
    table["exposure_s"] = camera.exposure_s
    table["readout_s"] = "unknown" if camera.readout_s is None else camera.readout_s
    table["transfer"] = camera.encoding.transfer
    for key in ("black_level", "white_level", "cfa"):
        value = getattr(camera.encoding, key)
        if value is not None:
            table[key] = value
    return table
