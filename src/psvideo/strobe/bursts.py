"""Power within a flash: bursts so short that a row sees them as a steady, weaker light.

A line is on for ``on`` ticks of every ``period`` ticks: the pulse-width-modulated bursts of Hudon et al. (2015). The
period divides the flash evenly where it can; else only the last gap is cut short, never the last burst, so that a
flash gives ``bursts * on`` ticks of light exactly. At least two bursts make a flash: one would be a shorter flash.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from psvideo.strobe.link.replies import Capabilities

POWER_TOLERANCE = 0.005
"""A power is played when it is met within this share of itself; what was really played goes into the log."""
FEWEST_BURSTS = 2


@dataclass(frozen=True, kw_only=True)
class Bursts:
    """How a flash is cut up: ``on`` (light,) ticks of light in every period; ``power`` (light,) is what that gives."""

    period: int
    on: tuple[int, ...]
    power: tuple[float, ...]


def find_bursts(powers: Sequence[float], duration: int, caps: Capabilities) -> Bursts | None:
    """Return the bursts that give all ``powers`` (above 0, at most 1) in one flash of ``duration`` ticks.

    Of those that meet every power within the tolerance: periods that divide the flash evenly first, then the shortest.
    None where there are none.
    """
    if all(power == 1 for power in powers):
        return Bursts(period=duration, on=(duration,) * len(powers), power=(1.0,) * len(powers))
    uneven = None
    for bursts in _choices(powers, duration, caps):
        if _close(bursts, powers):
            if duration % bursts.period == 0:
                return bursts
            uneven = uneven or bursts
    return uneven


def _choices(powers: Sequence[float], duration: int, caps: Capabilities) -> Iterator[Bursts]:
    """Yield bursts that the board plays, the shortest period first."""
    for count in range(_most_bursts(duration, caps), FEWEST_BURSTS - 1, -1):
        period = -(-duration // count)
        on = tuple(period if power == 1 else round(power * duration / count) for power in powers)
        if all(_playable(ticks, period, count, duration, caps) for ticks in on):
            given = tuple(1.0 if ticks == period else count * ticks / duration for ticks in on)
            yield Bursts(period=period, on=on, power=given)


def _most_bursts(duration: int, caps: Capabilities) -> int:
    return duration // (caps.min_on + caps.min_off)


def _playable(on: int, period: int, count: int, duration: int, caps: Capabilities) -> bool:
    """Return whether a board plays these bursts and the last one is whole; a line at full power has no bursts."""
    if period > caps.max_period:
        return False
    last = duration - (count - 1) * period
    if on == period:
        return last >= caps.min_on
    return caps.min_on <= on <= min(period - caps.min_off, last)


def _close(bursts: Bursts, powers: Sequence[float]) -> bool:
    return all(abs(given - power) <= POWER_TOLERANCE * power for given, power in zip(bursts.power, powers, strict=True))


def nearest_powers(power: float, duration: int, caps: Capabilities) -> tuple[float, ...]:
    """Return the next lower and the next higher power (or one of them) that a flash of this length can have."""
    playable = {1.0}
    for count in range(FEWEST_BURSTS, _most_bursts(duration, caps) + 1):
        period = -(-duration // count)
        most = min(period - caps.min_off, duration - (count - 1) * period)
        wanted = int(power * duration / count)
        for on in (min(max(wanted, caps.min_on), most), min(max(wanted + 1, caps.min_on), most)):
            if _playable(on, period, count, duration, caps):
                playable.add(count * on / duration)
    below = [given for given in playable if given <= power]
    above = [given for given in playable if given > power]
    return (*([max(below)] if below else []), *([min(above)] if above else []))
