"""What to think about before a shoot: pure functions from a plan and its figures to cautions, each a paragraph.

Those on the request and on the marker are here, those on time and on lamps in ``cautions_on_time`` and
``cautions_on_lamps``. They are shown in the order in which ``shoot_cautions`` asks for them.
"""

from collections.abc import Iterator
from fractions import Fraction

from psvideo.capture.caution import Caution, note, warning
from psvideo.capture.cautions_on_lamps import (
    about_blur,
    about_seizures,
    about_the_leds,
    about_the_light_of_a_flash,
    about_the_lights,
)
from psvideo.capture.cautions_on_time import (
    about_blind_time,
    about_motion,
    about_synced_rows,
    about_the_margin,
    about_three_frames,
)
from psvideo.capture.request import Limits, ShootRequest
from psvideo.model.cost.shoot_figures import ShootFigures
from psvideo.model.marker import has_marker
from psvideo.model.plan import Plan
from psvideo.model.units import NTSC, show_rate, show_seconds

BOARD_LINES = 8
"""Lights of their own, or that never flash alone, that a known board has lines for (lights/protocol.toml)."""
BOARD_DARK_S, BOARD_FLASH_S = 100e-6, 0.05
"""The shortest dark time and the longest flash that every known board plays (lights/protocol.toml)."""
HALF_TICK_S = 0.25e-6
"""Boards round times to their ticks, of half a microsecond at most."""


def request_cautions(request: ShootRequest) -> tuple[Caution, ...]:
    """Return what is to be said about the camera's figures."""
    return (*_about_the_readout(request), *_about_the_rate(request))


def shoot_cautions(plan: Plan, figures: ShootFigures, *, limits: Limits | None = None) -> tuple[Caution, ...]:
    """Return what is to be said about the plan itself, whoever wrote it."""
    limits = limits or Limits()
    return (
        *about_the_lights(plan),
        *about_the_light_of_a_flash(plan, figures, limits),
        *about_blur(figures, limits),
        *_about_the_marker(plan),
        *_about_the_board(plan),
        *about_seizures(plan, figures),
        *about_the_margin(plan, figures),
        *about_blind_time(plan, figures),
        *about_three_frames(plan, figures),
        *about_motion(figures),
        *about_the_leds(plan, figures, limits),
        *about_synced_rows(plan, figures),
    )


def _about_the_readout(request: ShootRequest) -> Iterator[Caution]:
    preset = request.preset
    if request.camera.readout_s is None:
        yield note(
            "readout", "The readout time is unknown: figures that depend on it are left out until it is measured."
        )
    if preset is not None and preset.sure in ("single", "assumed"):
        yield warning(
            "readout",
            f"The readout of {show_seconds(abs(preset.readout_s))} for the {preset.name} rests on little "
            f"({preset.source}). "
            "Measure yours (calibration/README.md) and give it as `readout_s`.",
        )


def _about_the_rate(request: ShootRequest) -> Iterator[Caution]:
    fps, asked = request.camera.fps, request.asked_fps
    if request.mode == "synced":
        return
    if asked is not None and asked != fps:
        yield note(
            "fps",
            f"{asked} fps is what this mode is called; the plan says {show_rate(fps)}, which it records. If yours "
            "truly "
            f"records {asked}, give `size_px` and `readout_s` with `fps`.",
        )
    elif fps.denominator == 1 and fps % 6 == 0 and fps >= 24:
        exact: Fraction = fps * NTSC
        yield note(
            "fps",
            f"Many cameras that say {fps} fps record {float(exact):.5g}, 999 ppm slower, which is more than a crystal "
            f"clock is off. If yours does, write `fps` {exact}.",
        )


def _about_the_marker(plan: Plan) -> Iterator[Caution]:
    if plan.mode != "synced" and not has_marker(plan):
        yield warning(
            "marker",
            "Without a marker nothing in the footage shows which light is which: note the light of the first flash for "
            "`first_light`, or leave `marker` dark.",
        )
    if not any(flash.is_dark for flash in plan.flashes):
        yield note(
            "ambient",
            "Without a dark slot ambient light is taken off only where the subject stands still, and none in synced "
            "clips: keep the room dark.",
        )


def _about_the_board(plan: Plan) -> Iterator[Caution]:
    """Warn of what no known board plays; what is triggered by the camera has a controller of its own."""
    if plan.mode == "synced":
        return
    lines = len({plan.powers(name) for name in plan.lights})
    longest_s = max(flash.duration_s for flash in plan.flashes)
    faults = []
    if lines > BOARD_LINES:
        faults.append(f"{lines} lights take as many lines, and boards have {BOARD_LINES}: take fewer lights")
    if plan.dark_s < BOARD_DARK_S - HALF_TICK_S:
        faults.append(
            f"the dark time is {show_seconds(plan.dark_s)}, and theirs {show_seconds(BOARD_DARK_S)} at least: give a "
            "longer `dark_s`, or film slower"
        )
    if longest_s > BOARD_FLASH_S + HALF_TICK_S:
        faults.append(
            f"a flash lasts {show_seconds(longest_s)}, and theirs {show_seconds(BOARD_FLASH_S)} at most: give a "
            "shorter `flash_s`"
        )
    if faults:
        text = f"No board that psvideo knows plays this plan: {'; '.join(faults)}; or drive the lights by other means."
        yield warning("board", text)
