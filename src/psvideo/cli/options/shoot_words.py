"""From the words typed for ``capture-plan`` to the request that they mean."""

import math
from collections.abc import Sequence
from typing import TypeVar, get_args

from psvideo.capture.request import CameraWish, Limits, Marker, ShootRequest, choose_camera
from psvideo.cli.options.capture import ShootWords
from psvideo.cli.options.per_light import parse_lights, parse_per_light, parse_powers
from psvideo.cli.options.typed import (
    parse_fraction,
    parse_metres,
    parse_positive_seconds,
    parse_rate,
    parse_seconds,
    parse_size_px,
    parse_speed_px_s,
)
from psvideo.clip.transfer import check_transfer
from psvideo.errors import UsageError
from psvideo.model.camera import CFA_PATTERNS, Encoding
from psvideo.model.plan import UNKNOWN_CLOCK_PPM, Mode

UNKNOWN = "unknown"
Choice = TypeVar("Choice", bound=str)


def parse_request(words: ShootWords) -> ShootRequest:
    """Return the request. Raises UsageError that names the option, what was typed and what is allowed."""
    modes: tuple[Mode, ...] = get_args(Mode)
    markers: tuple[Marker, ...] = get_args(Marker)
    mode = _choice(words.mode, modes, option="--mode")
    wish = _camera_wish(words)
    camera, preset = choose_camera(wish, mode=mode)
    lights = parse_lights(words.lights)
    marker = _choice(words.marker or _usual_marker(mode), markers, option="--marker")
    if words.dark_every is not None and words.dark_every < 1:
        raise UsageError(f"--dark-every {words.dark_every} is not a count of rounds. Give a whole number from 1 up.")
    if mode == "synced" and words.dark is not None:
        raise UsageError(
            "--dark has no meaning with --mode synced: the trigger says when each flash comes. Leave it out."
        )
    if marker not in ("dark", "coded") and (words.dark_slot or words.dark_every):
        raise UsageError(f"--dark-slot and --dark-every belong to a dark slot, and --marker {marker} has none.")
    if marker == "coded" and (words.dark_every or mode == "synced"):
        raise UsageError("--marker coded says itself which rounds are dark: leave --dark-every and --mode synced out.")
    return ShootRequest(
        camera=camera,
        preset=preset,
        asked_fps=wish.fps,
        lights=lights,
        power=parse_powers(words.power, lights),
        flash_s=_flashes(words, lights),
        limits=_limits(words, camera.width_px),
        mode=mode,
        marker=marker,
        dark_slot_s=_time(words.dark_slot, "--dark-slot"),
        dark_every=words.dark_every,
        dark_s=_time(words.dark, "--dark"),
        clock_tolerance_ppm=_clock_tolerance_ppm(words),
    )


def _usual_marker(mode: Mode) -> Marker:
    """A triggered strobe needs no marker: its lights come in order from frame 0."""
    return "none" if mode == "synced" else "dark"


def _camera_wish(words: ShootWords) -> CameraWish:
    readout_s = None
    is_unknown = words.readout is not None and words.readout.strip().lower() == UNKNOWN
    if words.readout is not None and not is_unknown:
        is_global = words.readout.strip().lower() == "global"
        readout_s = 0.0 if is_global else parse_seconds(words.readout, option="--readout")
    return CameraWish(
        name=words.camera,
        fps=None if words.fps is None else parse_rate(words.fps),
        size_px=None if words.size is None else parse_size_px(words.size),
        readout_s=readout_s,
        readout_known=not is_unknown,
        shutter_deg=words.shutter,
        exposure_s=_time(words.exposure, "--exposure"),
        encoding=_encoding(words),
    )


def _encoding(words: ShootWords) -> Encoding:
    for option, level in (("--black", words.black), ("--white", words.white)):
        if level is not None and not math.isfinite(level):
            raise UsageError(f"{option} {level:g}: expected a code value, a finite number.")
    if words.black is not None and words.white is not None and words.black >= words.white:
        raise UsageError(
            f"--black {words.black:g} is not below --white {words.white:g}. Give the code of black and of saturation."
        )
    check_transfer(words.transfer)
    cfa = None if words.cfa is None else _choice(words.cfa.upper(), CFA_PATTERNS, option="--cfa")
    return Encoding(transfer=words.transfer, black_level=words.black, white_level=words.white, cfa=cfa)


def _flashes(words: ShootWords, lights: Sequence[str]) -> dict[str, float] | None:
    if words.flash is None:
        return None
    parts = parse_per_light(words.flash, lights, option="--flash")
    return {name: parse_positive_seconds(value, option="--flash") for name, value in parts.items()}


def _limits(words: ShootWords, width_px: int) -> Limits:
    for option, value in (("--max-blur", words.max_blur), ("--max-stops", words.max_stops)):
        if value is not None and not 0 < value < float("inf"):
            raise UsageError(f"{option} {value:g} is not above zero. Give a number such as 1.")
    field_width_m = None if words.field_width is None else parse_metres(words.field_width, option="--field-width")
    speed_px_s = None
    if words.speed is not None:
        speed_px_s = parse_speed_px_s(words.speed, field_width_m=field_width_m, width_px=width_px)
    return Limits(
        max_blur_px=words.max_blur,
        speed_px_s=speed_px_s,
        max_duty=None if words.max_duty is None else parse_fraction(words.max_duty, option="--max-duty"),
        max_pulse_s=_time(words.max_pulse, "--max-pulse"),
        max_stops=words.max_stops,
    )


def _clock_tolerance_ppm(words: ShootWords) -> float | None:
    """Return how far the clocks may be apart: each its tolerance off, one up and the other down."""
    if words.strobe_clock_ppm.strip().lower() == UNKNOWN:
        return None
    try:
        strobe_ppm = float(words.strobe_clock_ppm)
    except ValueError:
        raise UsageError(
            f"--strobe-clock-ppm {words.strobe_clock_ppm!r} is not a number. Give parts per million (a crystal: 50) "
            "or unknown."
        ) from None
    for option, ppm in (("--camera-clock-ppm", words.camera_clock_ppm), ("--strobe-clock-ppm", strobe_ppm)):
        if not ppm >= 0:
            raise UsageError(f"{option} {ppm:g} is not a tolerance. Give 0 or more parts per million.")
    together_ppm = words.camera_clock_ppm + strobe_ppm
    if together_ppm > UNKNOWN_CLOCK_PPM:
        raise UsageError(
            f"--camera-clock-ppm and --strobe-clock-ppm make {together_ppm:g} ppm together; a plan holds at most "
            f"{UNKNOWN_CLOCK_PPM:g}. Give --strobe-clock-ppm unknown, which takes as much."
        )
    return together_ppm


def _time(text: str | None, option: str) -> float | None:
    return None if text is None else parse_positive_seconds(text, option=option)


def _choice(text: str, allowed: Sequence[Choice], *, option: str) -> Choice:
    for choice in allowed:
        if text == choice:
            return choice
    raise UsageError(f"{option} {text!r} is not known. Allowed are {', '.join(allowed)}.")
