"""What ``psvideo capture-plan`` shows people: the figures of a shoot as tables for the terminal."""

from collections.abc import Iterator, Sequence

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from psvideo.capture.cameras import CameraMode
from psvideo.capture.planning import Shoot
from psvideo.model.cost.shoot_figures import LEAST_MISSING, ShootFigures, SlotFigures
from psvideo.model.plan import Plan
from psvideo.model.units import show_ppm, show_rate, show_seconds


def shoot_report(shoot: Shoot, *, preset: CameraMode | None) -> Iterator[RenderableType]:
    """Yield the report: the camera, what decides the shoot, one line per flash and one per light."""
    yield Text(_camera_line(shoot.plan, preset), style="bold")
    if shoot.chosen:
        yield Text(f"Flash chosen: {shoot.chosen}.")
    yield _deciding(shoot.plan, shoot.figures)
    yield _per_flash(shoot.figures.slots)
    yield _per_light(shoot.figures)


def camera_table(modes: Sequence[CameraMode]) -> Table:
    """Return the table of camera modes, for people."""
    table = Table(box=None, pad_edge=False)
    for name in ("camera", "mode", "size", "fps", "readout", "rests on"):
        table.add_column(name, no_wrap=name != "mode", justify="right" if name in ("fps", "readout") else "left")
    for mode in modes:
        readout = "global" if mode.readout_s == 0 else f"{mode.readout_s * 1e3:.2f} ms"
        size = f"{mode.width_px}x{mode.height_px}"
        table.add_row(mode.name, mode.mode, size, f"{float(mode.fps):.5g}", readout, mode.sure)
    return table


def _camera_line(plan: Plan, preset: CameraMode | None) -> str:
    camera = plan.camera
    readout = "global shutter" if camera.readout_s == 0 else "readout unknown"
    if camera.readout_s:
        order = ", bottom row first" if camera.readout_s < 0 else ""
        readout = f"readout {show_seconds(abs(camera.readout_s))}{order}"
    source = f" ({preset.sure})" if preset else ""
    shutter = f"shutter {camera.shutter_deg:.4g}° = {show_seconds(camera.exposure_s)}"
    size = f"{camera.width_px} x {camera.height_px}"
    return f"{camera.name}, {size} at {show_rate(camera.fps)}, {shutter}, {readout}{source}"


def _deciding(plan: Plan, figures: ShootFigures) -> Table:
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="cyan", no_wrap=True)
    table.add_column()
    for name, value in _deciding_rows(plan, figures):
        table.add_row(name, value)
    return table


def _deciding_rows(plan: Plan, figures: ShootFigures) -> Iterator[tuple[str, str]]:
    fps = float(plan.camera.fps)
    yield "results", f"{figures.result_rate_hz:.2f} a second, one per round of {show_seconds(figures.round_s)}"
    yield "flashes", f"{figures.flash_rate_hz:.2f} a second, {figures.flash_rate_hz / fps:.1%} of the frame rate"
    if figures.dark_slot_rate_hz:
        rounds = "each round" if plan.dark_every == 1 else f"one round of {plan.dark_every}"
        if plan.dark_code:
            rounds = f"rounds by a code that repeats every {show_seconds(plan.cycle_s)}"
        yield "dark slots", f"{figures.dark_slot_rate_hz:.2f} a second, in {rounds}"
    yield "dark time", show_seconds(plan.dark_s) + _margin(plan, figures)
    if plan.mode != "synced":
        yield "partial rows", f"{figures.partial_row_share:.1%} of each plate, {_partial_rows(plan)}"
    if figures.missing_row_share >= LEAST_MISSING:
        yield "missing rows", f"{figures.missing_row_share:.1%} of each plate, seen by no frame"
    if figures.motion_per_flash_px is not None:
        yield (
            "motion",
            f"{figures.motion_per_flash_px:.3g} px from flash to flash, {figures.motion_per_round_px:.3g} px a round",
        )


def _partial_rows(plan: Plan) -> str:
    """Say what rows are made of that no frame holds whole: a row is blind between two frames below 360 degrees."""
    blind_s = plan.camera.frame_period_s - plan.camera.exposure_s
    if blind_s < 1e-6 * plan.camera.frame_period_s:
        return "put together from two frames"
    if blind_s >= max(plan.flashes[slot].duration_s for slot in plan.lit_slots):
        return "scaled up from what one frame saw"
    return "scaled up from what one or two frames saw"


def _margin(plan: Plan, figures: ShootFigures) -> str:
    if figures.margin_ppm is None or plan.mode != "rolling":
        return ""
    known = "unknown" if plan.clock_tolerance_ppm is None else show_ppm(plan.clock_tolerance_ppm)
    return f", the exposure and a margin of {show_ppm(figures.margin_ppm)} (clocks: {known})"


def _per_flash(slots: Sequence[SlotFigures]) -> Table:
    has_blur = any(slot.blur_px is not None for slot in slots)
    table = Table(box=None, pad_edge=False)
    columns = ["flash", "length", "light", "stops", "frames", "dark row moves", *(["blur"] if has_blur else [])]
    for name in columns:
        table.add_column(name, justify="left" if name == "flash" else "right", no_wrap=True)
    for slot in slots:
        table.add_row(*_flash_row(slot), *([f"{slot.blur_px:.3g} px"] if slot.blur_px is not None else []))
    return table


def _flash_row(slot: SlotFigures) -> tuple[str, ...]:
    light = "-" if slot.stops is None else f"{100 * slot.light_share:.3g}%"
    stops = "-" if slot.stops is None else f"{-slot.stops:+.1f}"
    move = "-" if slot.dark_row_move_px is None else f"{slot.dark_row_move_px:+.1f} rows"
    return slot.label, show_seconds(slot.duration_s), light, stops, _frames(slot), move


def _frames(slot: SlotFigures) -> str:
    if slot.frames_min == slot.frames_max:
        return "?" if slot.frames_max is None else str(slot.frames_max)
    return f"{slot.frames_min}-{slot.frames_max} ({slot.frames_max}: {slot.most_frames_share:.0%})"


def _per_light(figures: ShootFigures) -> Table:
    table = Table(box=None, pad_edge=False)
    for name in ("light", "rate", "on for", "longest pulse"):
        table.add_column(name, justify="left" if name == "light" else "right", no_wrap=True)
    for light in figures.lights:
        rate, duty = f"{light.rate_hz:.2f} Hz", f"{light.duty:.2%}"
        table.add_row(light.name, rate, duty, show_seconds(light.longest_pulse_s))
    return table
