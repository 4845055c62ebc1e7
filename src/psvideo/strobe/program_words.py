"""What a program does on a board, for people and for machines: what is played, how exactly, and what to beware of."""

from collections.abc import Iterator

from psvideo.model.cost.shoot_figures import shoot_figures, slot_label
from psvideo.model.plan import Plan
from psvideo.strobe.limits import share_ppm
from psvideo.strobe.link.replies import Capabilities
from psvideo.strobe.program import PS_PER_S, Program
from psvideo.strobe.seizures import flash_rates

SHOWN_PPM = 1.0


def describe_program(program: Program, caps: Capabilities) -> Iterator[str]:
    """Yield lines for people: the flashes as they are played, the wiring, the cycle, and how often things flash."""
    tick_ms = program.tick_ps * 1e-9
    for number, flash in enumerate(program.played.flashes):
        slot = program.slots[program.of_flash[number]]
        bursts = f", bursts of {slot.period * tick_ms:.4g} ms" if slot.lit and slot.period < slot.duration else ""
        powers = ", ".join(f"{name} at {flash.lights[name]:.4g}" for name in flash.lit)
        what = powers or slot_label(flash)
        yield f"flash {number + 1}: {what}, {slot.duration * tick_ms:.6g} ms = {slot.duration} ticks{bursts}"
    yield f"dark time: {program.slots[0].dark * tick_ms:.6g} ms = {program.slots[0].dark} ticks"
    lines = ", ".join(f"{name} on line {line}" for name, line in program.lines.items())
    yield f"{caps.wiring} wiring: {lines}"
    shares = ", ".join(f"{name} {share_ppm(program.cycle, line) / 1e4:.3g} %" for name, line in program.lines.items())
    yield f"on for a share of the time: {shares} (at most {caps.max_line_ppm / 1e4:g} %)"
    cycle_ms = program.cycle_ticks * tick_ms
    yield (
        f"cycle: {cycle_ms:.6g} ms, {len(program.steps)} flashes of {caps.steps}, "
        f"{len(program.slots)} different ones of {caps.slots}"
    )
    yield "; ".join(f"{rate.what} {rate.hz:.1f} Hz" for rate in flash_rates(program.played))


def program_cautions(plan: Plan, program: Program, caps: Capabilities) -> Iterator[str]:
    """Yield what to beware of: a margin that the board's clock may eat up, and a rate that rounding changes."""
    margin_ppm = shoot_figures(program.played).margin_ppm
    if plan.mode == "rolling" and margin_ppm is not None and margin_ppm < caps.tolerance_ppm:
        yield (
            f"the board's clock may be {caps.tolerance_ppm:g} ppm off, and the dark time leaves a margin of "
            f"{margin_ppm:.0f} ppm: if it runs fast, two flashes mix near the dark row. Plan with `strobe_clock_ppm` "
            f"{caps.tolerance_ppm:g}, or take a board with a crystal"
        )
    rounding_ppm = (program.played.cycle_s / plan.cycle_s - 1) * 1e6
    way = "longer" if rounding_ppm > 0 else "shorter"
    if abs(rounding_ppm) >= SHOWN_PPM:
        yield (
            f"in whole ticks of {caps.tick_ps / 1e6:g} µs the cycle is {abs(rounding_ppm):.1f} ppm {way} than planned; "
            "psvideo sync learns it from the log (`log`); without it that looks like a clock offset"
        )


def program_record(program: Program, caps: Capabilities) -> dict[str, object]:
    """Return the program as data for machines."""
    return {
        "tick_ps": program.tick_ps,
        "wiring": caps.wiring,
        "lines": dict(program.lines),
        "slots": [
            {
                "duration_ticks": slot.duration,
                "dark_ticks": slot.dark,
                "period_ticks": slot.period,
                "on_ticks": {str(lit.line): lit.on for lit in slot.lit},
            }
            for slot in program.slots
        ],
        "steps": list(program.steps),
        "cycle_ticks": program.cycle_ticks,
        "cycle_s": program.cycle_ticks * program.tick_ps / PS_PER_S,
        "check": program.check,
        "rates_hz": {rate.what: rate.hz for rate in flash_rates(program.played)},
    }
