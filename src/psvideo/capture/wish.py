"""How long a flash may be, from what the user cares about: sharpness, the LEDs' limits, the rate, the light."""

import math
from dataclasses import dataclass

from psvideo.capture.request import Limits, ShootRequest
from psvideo.errors import UsageError
from psvideo.model.plan import default_dark_s
from psvideo.model.units import show_seconds

LONG_MARKER = 1.5
"""The marker flash of ``marker="long"`` is this much longer than the others: plainly so, and still cheap."""

NEEDS_SPEED = "`max_blur_px` needs `speed_px_s`, and the reverse: blur = speed x flash duration. Give both."

OPEN = "the time in which all rows are open"

LONGEST_SHARE_OF_EXPOSURE = 0.25
"""Unless the user says so, no flash is longer: a quarter of the exposure already costs a fifth of the rate (eq. 6)."""


@dataclass(frozen=True, kw_only=True)
class Bound:
    """One reason why a flash may not be longer than ``flash_s``."""

    flash_s: float
    why: str


def longest_flash(request: ShootRequest) -> Bound:
    """Return the longest flash that every limit allows, and the limit that decided.

    With a longer marker flash the limits hold for that one, and the others are shorter. Lights that are synced to the
    frames need no limit: they shine while all rows are open. Raises UsageError where nothing limits the flash, or where
    sharpness and LEDs leave too little light.
    """
    limits = request.limits
    refuse_blur_of_unknown_speed(limits)
    unlimited = limits.max_blur_px is None and limits.max_duty is None and limits.max_pulse_s is None
    if unlimited and request.mode == "synced" and _open_s(request) > 0:
        return Bound(flash_s=_open_s(request) / _longest_by(request), why=OPEN)
    if unlimited:
        if limits.speed_px_s is not None:
            raise UsageError(NEEDS_SPEED)
        raise UsageError(
            "Nothing says how long a flash should be. Give `flash_s` 0.8ms, or what limits it: `max_blur_px` 1 "
            "`speed_px_s` 800 (px/s), `max_duty` 0.1, `max_pulse_s` 1ms."
        )
    tightest = min(_bounds(request), key=lambda bound: bound.flash_s)
    flash_s = _rounded_down(tightest.flash_s / _longest_by(request))
    _refuse_too_dark(request, flash_s, tightest)
    return Bound(flash_s=flash_s, why=tightest.why)


def refuse_blur_of_unknown_speed(limits: Limits) -> None:
    """Raise UsageError where a largest blur is given, and not how fast the subject moves."""
    if limits.max_blur_px is not None and limits.speed_px_s is None:
        raise UsageError(NEEDS_SPEED)


def _bounds(request: ShootRequest) -> list[Bound]:
    limits, exposure_s = request.limits, request.camera.exposure_s
    bounds = [
        Bound(flash_s=LONGEST_SHARE_OF_EXPOSURE * exposure_s, why="the rate, of which longer ones cost over a fifth")
    ]
    if limits.max_blur_px is not None and limits.speed_px_s is not None:
        blur = f"{limits.max_blur_px:g} px of blur at {limits.speed_px_s:g} px/s"
        bounds.append(Bound(flash_s=limits.max_blur_px / limits.speed_px_s, why=blur))
    if limits.max_pulse_s is not None:
        bounds.append(
            Bound(flash_s=limits.max_pulse_s, why=f"the LEDs' longest pulse of {show_seconds(limits.max_pulse_s)}")
        )
    if limits.max_duty is not None:
        bounds.append(
            Bound(flash_s=flash_for_duty_s(request, limits.max_duty), why=f"the LEDs' duty of {limits.max_duty:.3g}")
        )
    if request.mode == "synced" and _open_s(request) > 0:
        bounds.append(Bound(flash_s=_open_s(request), why=OPEN))
    return bounds


def _open_s(request: ShootRequest) -> float:
    """Return for how long all rows are open together: as long as a light of a synced shoot may be on."""
    return request.camera.exposure_s - abs(request.camera.readout_s or 0.0)


def flash_for_duty_s(request: ShootRequest, max_duty: float) -> float:
    """Return the longest flash at which each of the lights, flashing once a round, is on for ``max_duty`` of the time.

    That is the long marker's where there is one; the other lights' flashes are shorter then, and the round with them.
    A round lasts so many times the longest flash (``flashes``), and a time besides that no flash changes.
    """
    period_s, dark_slots = request.camera.frame_period_s, _dark_slots_of_a_round(request)
    slots = len(request.lights) + dark_slots
    if request.mode == "synced":
        return max_duty * slots * period_s
    lit = 1 + (len(request.lights) - 1) / _longest_by(request)
    slot_s = request.dark_slot_s or 0.0
    flashes = lit if request.dark_slot_s else lit + dark_slots
    if request.mode == "half-rate" and not request.dark_s:
        # The longest slot, the flash or the dark one, starts every two frames; dark times shrink by its length.
        by_flash_s = _flash_at_duty(
            max_duty, flashes=flashes - slots, besides_s=slots * 2 * period_s + dark_slots * slot_s
        )
        by_slot_s = _flash_at_duty(
            max_duty, flashes=flashes, besides_s=slots * (2 * period_s - slot_s) + dark_slots * slot_s
        )
        return min(by_flash_s, by_slot_s) if request.marker in ("dark", "coded") else by_flash_s
    dark_s = request.dark_s or default_dark_s(
        request.camera, (), mode="rolling", clock_tolerance_ppm=request.clock_tolerance_ppm
    )
    return _flash_at_duty(max_duty, flashes=flashes, besides_s=slots * dark_s + dark_slots * slot_s)


def _flash_at_duty(max_duty: float, *, flashes: float, besides_s: float) -> float:
    """Return the flash that is ``max_duty`` of a round which lasts ``flashes`` times the flash and ``besides_s``."""
    share = max_duty * flashes
    return max_duty * besides_s / (1 - share) if share < 1 else math.inf


def _dark_slots_of_a_round(request: ShootRequest) -> float:
    """Return how many dark slots a round has in the mean, at least: a code has more than one in two rounds, and where
    the plan chooses how often they come they are few."""
    if request.marker == "coded":
        return 0.5
    return 1 / request.dark_every if request.marker == "dark" and request.dark_every else 0.0


def _longest_by(request: ShootRequest) -> float:
    """Return how many times the longest flash is as long as the others."""
    return LONG_MARKER if request.marker == "long" else 1.0


def _refuse_too_dark(request: ShootRequest, flash_s: float, tightest: Bound) -> None:
    if request.limits.max_stops is None:
        return
    exposure_s, power = request.camera.exposure_s, min(request.power.values())
    stops = math.log2(exposure_s / (flash_s * power))
    if stops <= request.limits.max_stops:
        return
    needed_s = exposure_s / power / 2**request.limits.max_stops
    speed = request.limits.speed_px_s
    blur = "" if speed is None else f" and {needed_s * speed:.3g} px of blur at {speed:g} px/s"
    raise UsageError(
        f"These wishes exclude each other: {tightest.why} allows a flash of {show_seconds(flash_s)}, which is "
        f"{stops:.1f} "
        f"stops darker than the same light left on; `max_stops` {request.limits.max_stops:g} needs "
        f"{show_seconds(needed_s)}{blur}. Allow more blur or more stops, slow the subject down, or bring "
        f"{2 ** (stops - request.limits.max_stops):.1f} times the light."
    )


def _rounded_down(seconds: float) -> float:
    """Return the duration cut to three figures, so that the plan reads well and no limit is passed.

    >>> _rounded_down(0.0012499)
    0.00124
    """
    digits = 2 - math.floor(math.log10(seconds))
    return math.floor(seconds * 10.0**digits * (1 + 1e-12)) / 10.0**digits
