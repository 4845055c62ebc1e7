"""What the user wants of a shoot: the camera's mode, the lights, and the flash or what limits it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from psvideo.capture.cameras import HOW_TO_MEASURE, CameraMode, find_mode, find_model
from psvideo.errors import UsageError
from psvideo.model.camera import Camera, Encoding, exposure_of
from psvideo.model.plan import Mode
from psvideo.model.units import no_more, show_rate, show_seconds

Marker = Literal["dark", "coded", "long", "none"]

READOUT_SLACK = 1e-3
"""A readout may exceed the frame period by rounding, as plan.toml allows."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What bounds a flash: sharpness, the LEDs, and how much darker than continuous light the picture may be.

    ``max_duty`` is the largest share of time for which a light may be on, ``max_pulse_s`` its longest pulse.
    """

    max_blur_px: float | None = None
    speed_px_s: float | None = None
    max_duty: float | None = None
    max_pulse_s: float | None = None
    max_stops: float | None = None


@dataclass(frozen=True, kw_only=True)
class ShootRequest:
    """One shoot to plan. ``flash_s`` None asks for the longest flash that the limits allow.

    ``clock_tolerance_ppm`` is how far the camera's and the strobe's clock may be apart (None: unknown); ``dark_s`` and
    ``dark_every`` None choose the shortest safe dark time and a dark slot about twice a second.
    """

    camera: Camera
    lights: tuple[str, ...]
    power: Mapping[str, float]
    flash_s: Mapping[str, float] | None = None
    limits: Limits = field(default_factory=Limits)
    mode: Mode = "rolling"
    marker: Marker = "dark"
    dark_slot_s: float | None = None
    dark_every: int | None = None
    dark_s: float | None = None
    clock_tolerance_ppm: float | None = 100.0
    preset: CameraMode | None = None
    asked_fps: Fraction | None = None


@dataclass(frozen=True, kw_only=True)
class CameraWish:
    """The camera as the user gave it; None is what was left out. ``readout_known`` False: given as unknown."""

    name: str | None = None
    fps: Fraction | None = None
    size_px: tuple[int, int] | None = None
    readout_s: float | None = None
    readout_known: bool = True
    shutter_deg: float | None = None
    exposure_s: float | None = None
    encoding: Encoding = field(default_factory=Encoding)


def choose_camera(wish: CameraWish, *, mode: Mode) -> tuple[Camera, CameraMode | None]:
    """Return the camera, filled up from the table, and the table's row that was used (None: none was needed).

    Raises UsageError where the camera is not in the table and something is missing, and for impossible figures.
    """
    readout_given = wish.readout_s is not None or not wish.readout_known
    needs_table = not (wish.fps and wish.size_px and (readout_given or mode == "synced"))
    preset = None
    if needs_table or (wish.name and find_model(wish.name) and not readout_given):
        preset = _preset(wish, mode)
    fps = _truest_rate(wish.fps, preset)
    size_px = (preset.width_px, preset.height_px) if preset else wish.size_px
    if fps is None or size_px is None:
        raise UsageError("The camera needs its frame rate and size: add `fps` and `size_px`, or `camera` NAME.")
    readout_s = wish.readout_s if readout_given else preset.readout_s if preset else 0.0
    known = find_model(wish.name) if wish.name else ()
    camera = Camera(
        name=known[0].name if known else wish.name or "camera",
        width_px=size_px[0],
        height_px=size_px[1],
        fps=fps,
        exposure_s=_exposure_s(wish, fps),
        readout_s=readout_s,
        encoding=wish.encoding,
    )
    _refuse_impossible_readout(camera)
    return camera, None if readout_given else preset


def _truest_rate(asked: Fraction | None, preset: CameraMode | None) -> Fraction | None:
    """Return the rate to plan for: a whole number may be what a mode is called (120), and not what it records."""
    if preset is None or (asked is not None and asked.denominator > 1):
        return asked
    return preset.fps


def _preset(wish: CameraWish, mode: Mode) -> CameraMode:
    if wish.name is None:
        lacking = ["`fps`"] * (wish.fps is None) + ["`size_px`"] * (wish.size_px is None)
        if wish.readout_s is None and wish.readout_known and mode != "synced":
            lacking.append("`readout_s`")
        raise UsageError(
            f"{' and '.join(lacking)}: missing. Name a camera of the table (`camera`, see `list_cameras`), or describe "
            f"its mode: `fps` 120 `size_px` 1920x1080 `readout_s` 8.1ms. {HOW_TO_MEASURE}"
        )
    return find_mode(wish.name, fps=wish.fps, size_px=wish.size_px)


def _exposure_s(wish: CameraWish, fps: Fraction) -> float:
    period_s = float(1 / fps)
    if wish.exposure_s is not None and wish.shutter_deg is not None:
        raise UsageError("`shutter_deg` and `exposure_s` are both given. Give one of the two: they say the same thing.")
    if wish.exposure_s is not None:
        if wish.exposure_s > period_s * (1 + 1e-6):
            raise UsageError(
                f"`exposure_s` of {show_seconds(wish.exposure_s)} is longer than the frame period of "
                f"{show_seconds(period_s)} at {show_rate(fps)}. Give at most {show_seconds(no_more(period_s))}, or "
                "`shutter_deg` 360."
            )
        return wish.exposure_s
    shutter_deg = 360.0 if wish.shutter_deg is None else wish.shutter_deg
    if not 0 < shutter_deg <= 360:
        raise UsageError(
            f"`shutter_deg` {shutter_deg:g} is not a shutter angle. Give more than 0 and at most 360 degrees."
        )
    return exposure_of(fps, shutter_deg=shutter_deg)


def _refuse_impossible_readout(camera: Camera) -> None:
    readout_s, period_s = abs(camera.readout_s or 0.0), camera.frame_period_s
    if readout_s > period_s * (1 + READOUT_SLACK):
        raise UsageError(
            f"`readout_s` of {show_seconds(readout_s)} is impossible at {show_rate(camera.fps)}: a frame is read "
            f"within its period of {show_seconds(period_s)}. Check the unit and the mode that the figure was measured "
            "in."
        )
