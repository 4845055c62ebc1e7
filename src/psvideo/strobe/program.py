"""A plan as what a board plays: whole ticks, slots and steps, checked against the board's limits before it is sent.

    Plan + Capabilities + wiring -> Program -> requests

Durations and the dark time are rounded to the nearest tick once, and every cycle is the same whole number of ticks, so
nothing accumulates; ``Program.played`` is the plan with exactly the times and powers that are played.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from psvideo.errors import PsvideoError
from psvideo.model.cost.shoot_figures import slot_label
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.strobe.bursts import find_bursts, nearest_powers
from psvideo.strobe.limits import (
    LONGEST_CYCLE_S,
    LONGEST_DARK_TICKS,
    cycle_check,
    cycle_ticks,
    lit_ticks,
    share_ppm,
    slot_refusal,
    total_ppm,
)
from psvideo.strobe.link.lines import LONGEST_REQUEST
from psvideo.strobe.link.protocol import format_request
from psvideo.strobe.link.replies import Capabilities
from psvideo.strobe.link.requests import Arm, Lit, New, Request, Slot, Steps
from psvideo.strobe.wiring import wire

PS_PER_S = 10**12
STEPS_A_LINE = 20
"""Steps in one request: with three digits each they fit into a line."""


@dataclass(frozen=True, kw_only=True)
class Program:
    """What is sent to a board. ``slots`` are all different; ``steps`` name them; ``of_flash`` is each flash's slot."""

    played: Plan
    tick_ps: int
    lines: Mapping[str, int]
    slots: tuple[Slot, ...]
    of_flash: tuple[int, ...]

    @property
    def steps(self) -> tuple[int, ...]:
        """The slots of one cycle in order."""
        return tuple(self.of_flash[flash] for flash in self.played.cycle_slots)

    @property
    def cycle(self) -> tuple[Slot, ...]:
        """The flashes of one cycle in order."""
        return tuple(self.slots[step] for step in self.steps)

    @property
    def check(self) -> int:
        """The checksum by which the board knows that it was understood."""
        return cycle_check(self.cycle)

    @property
    def cycle_ticks(self) -> int:
        """The cycle's length."""
        return cycle_ticks(self.cycle)

    def upload(self) -> Iterator[Request]:
        """Yield what is to be sent to an idle board with the right wiring, up to the request that arms it."""
        yield New()
        yield from self.slots
        for first in range(0, len(self.steps), STEPS_A_LINE):
            yield Steps(first=first, slots=self.steps[first : first + STEPS_A_LINE])
        yield Arm(check=self.check)


def make_program(
    plan: Plan, caps: Capabilities, *, lines: Mapping[str, int] | None = None, source: str = "plan"
) -> Program:
    """Return a plan as a program for a board.

    ``lines`` wires lights to lines; lights that it leaves out take the free lines in the plan's order. Lights that
    always flash together, at one power, may share a line. Raises
    PsvideoError, with every number that is over a limit, where the board cannot play the plan; UsageError where the
    wiring cannot be.
    """
    if plan.mode == "synced":
        raise PsvideoError(
            f"{source}: is a synced plan, one flash per frame in step with the camera, and this controller has no wire "
            'from the camera: it keeps a clock of its own. Plan with `mode="rolling"` or `mode="half-rate"`; psvideo '
            "finds the flashes from the picture."
        )
    wired = wire(plan, caps, lines or {})
    faults = list(_lack_of_room(plan, caps))
    dark = to_ticks(plan.dark_s, caps.tick_ps)
    if dark < caps.min_dark or dark > LONGEST_DARK_TICKS:
        most = show_ticks(LONGEST_DARK_TICKS, caps)
        faults.append(
            f"the dark time is {show_ticks(dark, caps)}, and the board's is {show_ticks(caps.min_dark, caps)} to {most}"
        )
    made = [_make_slot(plan, number, dark, caps, wired) for number in range(len(plan.flashes))]
    faults += [slot for slot in made if isinstance(slot, str)]
    if faults:
        raise _cannot_play(source, faults)
    program = _assemble(plan, [slot for slot in made if not isinstance(slot, str)], caps, wired)
    faults += _over_limits(program, caps)
    if faults:
        raise _cannot_play(source, faults)
    return program


def _cannot_play(source: str, faults: Sequence[str]) -> PsvideoError:
    return PsvideoError(f"{source}: this board cannot play it: {'; '.join(faults)}. Nothing was sent to the board.")


def to_ticks(time_s: float, tick_ps: int) -> int:
    """Return a time in the nearest whole number of ticks.

    >>> to_ticks(0.0008, 500_000)
    1600
    """
    return round(time_s * PS_PER_S / tick_ps)


def show_ticks(ticks: int, caps: Capabilities) -> str:
    """Return ticks as people read times, with the ticks behind."""
    return f"{ticks * caps.tick_ps * 1e-9:.6g} ms ({ticks} ticks)"


def _lack_of_room(plan: Plan, caps: Capabilities) -> Iterator[str]:
    steps = len(plan.cycle_slots)
    if steps > caps.steps:
        yield f"a cycle is {steps} flashes, and the board holds {caps.steps} ({_pattern(plan)})"


def _pattern(plan: Plan) -> str:
    return f"dark_code is {plan.dark_code}" if plan.dark_code else f"dark_every is {plan.dark_every}"


def _make_slot(plan: Plan, number: int, dark: int, caps: Capabilities, lines: Mapping[str, int]) -> Slot | str:
    """Return a flash in ticks, or a clause that says what the board cannot do."""
    flash = plan.flashes[number]
    name = f"flash {number + 1} ({slot_label(flash)})"
    duration = to_ticks(flash.duration_s, caps.tick_ps)
    if not 0 < duration <= caps.max_flash:
        shortest = show_ticks(caps.min_on, caps)
        return (
            f"{name} lasts {show_ticks(duration, caps)}, and the board's flashes {shortest} to "
            f"{show_ticks(caps.max_flash, caps)}"
        )
    lit = {light: flash.lights[light] for light in flash.lit}
    if not lit:
        return Slot(slot=0, duration=duration, dark=dark, period=duration)
    bursts = find_bursts(list(lit.values()), duration, caps)
    if len(set(lit.values())) > caps.powers or bursts is None:
        return _power_fault(name, lit, duration, caps)
    pairs = sorted({(lines[light], on) for light, on in zip(lit, bursts.on, strict=True)})
    slot = Slot(
        slot=0,
        duration=duration,
        dark=dark,
        period=bursts.period,
        lit=tuple(Lit(line=line, on=on) for line, on in pairs),
    )
    refusal = slot_refusal(slot, caps) if dark >= caps.min_dark else None
    return slot if refusal is None else f"{name}: {refusal.text}, in ticks of {caps.tick_ps / 1e6:g} µs"


def _power_fault(name: str, lit: Mapping[str, float], duration: int, caps: Capabilities) -> str:
    powers = sorted(set(lit.values()))
    if len(powers) > caps.powers:
        return (
            f"{name} has {len(powers)} different powers ({', '.join(f'{power:g}' for power in powers)}), and "
            f"{caps.wiring} wiring plays {caps.powers} in a flash (give its lights one power, or take "
            '`wiring="direct"`)'
        )
    for light, power in lit.items():
        if find_bursts([power], duration, caps) is None:
            choices = " or ".join(f"{choice:.4g}" for choice in nearest_powers(power, duration, caps))
            return (
                f"{name} wants {light} at power {power:g}, which bursts of at least {show_ticks(caps.min_on, caps)} "
                f"with gaps of at least {show_ticks(caps.min_off, caps)} cannot give in "
                f"{show_ticks(duration, caps)}; the nearest that can be played: {choices}"
            )
    shown = ", ".join(f"{light} {power:g}" for light, power in lit.items())
    return f"{name} wants powers ({shown}) that no bursts of one period give together; round them, or part the flash"


def _assemble(plan: Plan, made: Sequence[Slot], caps: Capabilities, lines: Mapping[str, int]) -> Program:
    different = list(dict.fromkeys(made))
    tick_s = caps.tick_ps / PS_PER_S
    flashes = tuple(_as_played(flash, slot, tick_s, lines) for flash, slot in zip(plan.flashes, made, strict=True))
    return Program(
        played=replace(plan, flashes=flashes, dark_s=made[0].dark * tick_s),
        tick_ps=caps.tick_ps,
        lines=lines,
        slots=tuple(replace(slot, slot=place) for place, slot in enumerate(different)),
        of_flash=tuple(different.index(slot) for slot in made),
    )


def _as_played(flash: PlannedFlash, slot: Slot, tick_s: float, lines: Mapping[str, int]) -> PlannedFlash:
    powers = {light: power and lit_ticks(slot, lines[light]) / slot.duration for light, power in flash.lights.items()}
    return PlannedFlash(lights=powers, duration_s=slot.duration * tick_s)


def _over_limits(program: Program, caps: Capabilities) -> Iterator[str]:
    for slot in program.slots:
        long = len(format_request(slot).rstrip(b"\n"))
        if long > LONGEST_REQUEST:
            yield (
                f"a flash of {len(slot.lit)} lines takes a request of {long} bytes, and the board reads "
                f"{LONGEST_REQUEST} (lights that always flash together may hang on one line)"
            )
    if len(program.slots) > caps.slots:
        yield f"the plan has {len(program.slots)} different flashes, and the board holds {caps.slots}"
    cycle_s = program.cycle_ticks * program.tick_ps / PS_PER_S
    if cycle_s > LONGEST_CYCLE_S:
        yield f"the cycle lasts {cycle_s:.4g} s, and the longest is {LONGEST_CYCLE_S} s"
    for name, line in program.lines.items():
        share = share_ppm(program.cycle, line)
        if share > caps.max_line_ppm:
            yield f"{name} is on for {share / 1e4:.3g} % of the time, and the most is {caps.max_line_ppm / 1e4:.3g} %"
    total = total_ppm(program.cycle)
    if total > caps.max_total_ppm:
        yield f"all lights together are on for {total / 1e4:.3g} %, and the most is {caps.max_total_ppm / 1e4:.3g} %"
