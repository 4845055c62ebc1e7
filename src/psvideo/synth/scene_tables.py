"""The tables of a scene file, frozen records whose fields are the file's keys; docs/synth.md says what each means."""

from fractions import Fraction
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from psvideo.formats.contract import Contract
from psvideo.formats.frame_rates import parse_fps
from psvideo.formats.plan_toml import RoundTable
from psvideo.model.camera import CfaPattern

Triple = Annotated[list[float], Field(min_length=3, max_length=3)]
Positive = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Strength = Annotated[float, Field(ge=0)]
Colour = Strength | Annotated[list[Strength], Field(min_length=3, max_length=3)]
Kind = Literal["png16", "png8", "tif", "exr", "dng", "dpx"]


class CameraTable(Contract):
    """The camera: its size, clock and shutter, how it projects, and how its files encode light."""

    name: str = "virtual camera"
    width_px: int = Field(gt=0)
    height_px: int = Field(gt=0)
    fps: int | float | str
    shutter_deg: float | None = Field(default=None, gt=0, le=360)
    exposure_s: Positive | None = None
    readout_s: float
    view: Literal["orthographic", "perspective"] = "orthographic"
    width_m: Positive = 1.0
    focal_px: Positive | None = None
    principal_px: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None
    rays: int = Field(default=1, ge=1, le=8)
    colour: Literal["rgb", "grey"] = "rgb"
    cfa: CfaPattern | None = None
    transfer: Literal["linear", "srgb", "rec709", "slog3", "logc3"] = "linear"
    bits: int = Field(default=12, ge=8, le=16)
    black_level: float | None = Field(default=None, ge=0)
    white_level: float | None = Field(default=None, gt=0)
    full_well_e: Strength = 0.0
    read_e: Strength = 0.0

    @property
    def rate(self) -> Fraction:
        """Frames per second as an exact ratio."""
        return parse_fps(self.fps)

    @property
    def principal(self) -> tuple[float, float]:
        """Column and row of the pixel that the camera looks straight at; the picture's middle where not given."""
        x, y = self.principal_px or [0.5 * (self.width_px - 1), 0.5 * (self.height_px - 1)]
        return x, y

    @property
    def channels(self) -> int:
        """Colour channels of the rendered light: 3, or 0 for a grey picture of shape (row, col)."""
        return 0 if self.colour == "grey" else 3

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        period_s = float(1 / self.rate)
        if (self.shutter_deg is None) == (self.exposure_s is None):
            raise ValueError("expected shutter_deg or exposure_s, one of the two")
        if self.exposure_s is not None and self.exposure_s > period_s * (1 + 1e-9):
            raise ValueError(f"exposure_s is {self.exposure_s:g}, longer than the frame period of {period_s:.6g} s")
        if abs(self.readout_s) > period_s * (1 + 1e-9):
            raise ValueError(f"readout_s is {self.readout_s:g}, longer than the frame period of {period_s:.6g} s")
        if self.view == "perspective" and self.focal_px is None:
            raise ValueError("a perspective view needs focal_px")
        if self.colour == "grey" and self.cfa is not None:
            raise ValueError('a grey camera has no colour filters; leave out cfa, or set colour = "rgb"')
        if self.black_level is not None and self.white_level is not None and self.black_level >= self.white_level:
            raise ValueError(f"black_level is {self.black_level:g}; expected below white_level ({self.white_level:g})")
        return self


class FlashTable(Contract):
    """One flash of a round: the power of every light that is on ({} = dark slot)."""

    lights: dict[str, Share]
    duration_s: Positive


class StrobeTable(RoundTable):
    """The strobe: the plan that it plays, and how its clock truly runs (which the plan does not say)."""

    flash_s: Positive = 0.0008
    marker: bool = True
    flash: list[FlashTable] = Field(default_factory=list)
    phase_s: float | None = None
    clock_offset_ppm: Annotated[float, Field(ge=-50_000, le=50_000)] = 0.0
    drift_ppm_per_s: float = 0.0
    jitter_s: Strength = 0.0


class LightTable(Contract):
    """One light: distant (direction) or near (position_m); intensity as in rig.toml."""

    name: str = Field(min_length=1)
    direction: Triple | None = None
    position_m: Triple | None = None
    intensity: Colour = 0.8
    colour: Annotated[list[Strength], Field(min_length=3, max_length=3)] | None = None
    anisotropy: Strength = 0.0
    axis: Triple | None = None

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if (self.direction is None) == (self.position_m is None):
            raise ValueError(f"light {self.name!r} needs direction (distant) or position_m (near), one of the two")
        for key in ("direction", "axis"):
            vector = getattr(self, key)
            if vector is not None and not any(vector):
                raise ValueError(f"light {self.name!r}: {key} has no length")
        if self.anisotropy and (self.position_m is None or self.axis is None):
            raise ValueError(f"light {self.name!r}: anisotropy needs position_m and axis")
        return self


class AmbientTable(Contract):
    """Light that does not flash: what one whole exposure collects of it on a white surface."""

    level: Colour = 0.0
    sky: Share = 0.0
    occlusion_rays: int = Field(default=0, ge=0, le=1024)
    flicker_hz: Strength = 0.0
    flicker_depth: Share = 0.0


class AlbedoTable(Contract):
    """A procedural albedo in the object's own space (metres, before it is turned), or a picture on the mesh's UVs."""

    pattern: Literal["constant", "noise", "marble", "stripes", "checker", "bands", "own"] = "constant"
    colour: Colour = 0.7
    second: Colour = 0.2
    size_m: Positive = 0.05
    axis: Triple = Field(default_factory=lambda: [0.0, 1.0, 0.0])
    bands_m: list[Annotated[list[float], Field(min_length=2, max_length=2)]] = Field(default_factory=list)
    texture: str | None = None


class SpecularTable(Contract):
    """A normalised Blinn-Phong lobe on top of the Lambertian part."""

    strength: Strength = 0.05
    roughness: Annotated[float, Field(gt=0, le=1)] = 0.25


class MotionTable(Contract):
    """How an object moves: spin about an axis through its position, steady travel, and a sinusoidal sway."""

    axis: Triple = Field(default_factory=lambda: [0.0, 1.0, 0.0])
    spin_deg_per_s: float = 0.0
    swing_deg: float = 0.0
    swing_hz: Strength = 0.0
    velocity_m_per_s: Triple = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    sway_m: Triple = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    sway_hz: Strength = 0.0

    @model_validator(mode="after")
    def _has_an_axis(self) -> Self:
        if not any(self.axis):
            raise ValueError("motion: axis has no length")
        return self


class ObjectTable(Contract):
    """One object: a built-in mesh's name or a mesh file, where it stands, what it looks like, how it moves."""

    mesh: str
    height_m: Positive | None = None
    scale: Positive = 1.0
    stretch: Annotated[list[Positive], Field(min_length=3, max_length=3)] = Field(default_factory=lambda: [1.0] * 3)
    rotate_deg: Triple = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    position_m: Triple = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    centre: bool = True
    shading: Literal["smooth", "flat"] = "smooth"
    casts_shadow: bool = True
    albedo: Colour | AlbedoTable = Field(default_factory=lambda: AlbedoTable(pattern="own"))
    specular: SpecularTable | None = None
    motion: MotionTable | None = None


class ClaimTable(Contract):
    """What plan.toml says where it differs from the truth."""

    fps: int | float | str | None = None
    readout_s: float | Literal["unknown"] | None = None
    tails: bool = True


class OutputTable(Contract):
    """The files that the camera leaves: their kind, their numbers, and which of them are missing."""

    kind: Kind = "png16"
    first_number: int = Field(default=1, ge=0)
    dropped: list[Annotated[int, Field(ge=0)]] = Field(default_factory=list)


class OtherCameraTable(Contract):
    """Another camera that films the same scene and strobe: what is left out is the first one's."""

    name: str = Field(min_length=1)
    starts_s: float = 0.0
    beside_m: Triple = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    clock_offset_ppm: Annotated[float, Field(ge=-50_000, le=50_000)] | None = None
    frames: int | None = Field(default=None, ge=1)
    dropped: list[Annotated[int, Field(ge=0)]] = Field(default_factory=list)
    width_px: int | None = Field(default=None, gt=0)
    height_px: int | None = Field(default=None, gt=0)
    fps: int | float | str | None = None
    shutter_deg: float | None = Field(default=None, gt=0, le=360)
    exposure_s: Positive | None = None
    readout_s: float | None = None
    width_m: Positive | None = None
    focal_px: Positive | None = None
    principal_px: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None
