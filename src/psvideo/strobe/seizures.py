"""What eyes make of a plan: how often each light, the round and the whole scene flash, and which of it is dangerous.

Light that flashes at 3 to 70 Hz can cause seizures in photosensitive people (IEEE 1789-2015; docs/shoot.md).
"""

from dataclasses import dataclass

from psvideo.model.cost.shoot_figures import SEIZURE_HZ, shoot_figures
from psvideo.model.plan import Plan


@dataclass(frozen=True, kw_only=True)
class Rate:
    """How often something that is seen repeats."""

    what: str
    hz: float

    @property
    def is_dangerous(self) -> bool:
        """True between 3 and 70 Hz."""
        return SEIZURE_HZ[0] <= self.hz <= SEIZURE_HZ[1]


def flash_rates(plan: Plan) -> tuple[Rate, ...]:
    """Return the rates of a plan that is played: all flashes, the round, dark slots, their pattern, and each light."""
    figures = shoot_figures(plan)
    dark = (Rate(what="dark slots", hz=figures.dark_slot_rate_hz),) if figures.dark_slot_rate_hz else ()
    pattern = () if figures.pattern_hz is None else (Rate(what="the pattern of dark slots", hz=figures.pattern_hz),)
    return (
        Rate(what="all flashes together", hz=figures.flash_rate_hz),
        Rate(what="the round of lights", hz=figures.result_rate_hz),
        *dark,
        *pattern,
        *(Rate(what=f"light {light.name}", hz=light.rate_hz) for light in figures.lights),
    )


def seizure_warning(plan: Plan) -> str | None:
    """Return the warning that people must read before the first flash; None where no rate is dangerous."""
    rates = flash_rates(plan)
    dangerous = [rate for rate in rates if rate.is_dangerous]
    if not dangerous:
        return None
    higher = [rate for rate in rates if rate.hz > SEIZURE_HZ[1]]
    above = f" Higher, and seen less: {_list(higher)}." if higher else ""
    return (
        f"FLASHING LIGHT, dangerous for photosensitive people: {_list(dangerous)}, between {SEIZURE_HZ[0]:g} and "
        f"{SEIZURE_HZ[1]:g} Hz.{above} It can cause seizures in people who do not know that they are photosensitive. "
        "Warn everybody in the room, let no photosensitive person stay, and look away from the lights. Ctrl-C, or "
        "pulling the board's cable, makes it dark."
    )


def _list(rates: list[Rate]) -> str:
    """Return rates as a list in which those that are alike stand together."""
    groups: dict[str, list[str]] = {}
    for rate in rates:
        groups.setdefault(f"{rate.hz:.1f} Hz", []).append(rate.what)
    return "; ".join(f"{', '.join(names)} at {hz}" for hz, names in groups.items())
