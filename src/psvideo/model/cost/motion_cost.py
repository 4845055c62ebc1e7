"""What motion costs: how many normals are lost, and how far the others are off, by pixels from flash to flash.

Measured on virtual subjects that slide and tumble before a wall (a mottled ball, a painted bust, a bare box; 3 and 5
lights, a camera's noise), solved as runs do: `python -m bench.motion_costs`. What rest costs is taken off.
"""

from dataclasses import dataclass

import numpy as np

STEPS_PX = (0.0, 1.0, 4.0, 16.0)
LOST, WORST_LOST = (0.0, 0.03, 0.11, 0.53), (0.0, 0.08, 0.30, 0.99)
OFF_DEG, WORST_OFF_DEG = (0.0, 0.9, 2.1, 13.0), (0.0, 2.5, 5.2, 28.8)
"""With alignment: the mean of the subjects and motions, and the worst of them. Sliding costs least, tumbling most."""
UNALIGNED_DEG = (0.0, 4.1, 12.4, 27.0)
"""Without it: the mean."""
LEAST_PX = 0.5
"""Less costs nothing that shows."""


@dataclass(frozen=True, kw_only=True)
class MotionCost:
    """The share of a moving subject's trusted normals that are ``lost``, and by how many degrees all of its normals,
    measured or filled in, are off beyond what they are at rest: as a rule, at worst, and without alignment."""

    lost: float
    worst_lost: float
    off_deg: float
    worst_off_deg: float
    unaligned_deg: float


def motion_cost(step_px: float) -> MotionCost:
    """Return what motion by this many pixels from flash to flash costs; beyond the table, as at its end."""

    def at(values: tuple[float, ...]) -> float:
        return float(np.interp(np.log2(1 + step_px), np.log2(1 + np.array(STEPS_PX)), values))

    return MotionCost(
        lost=at(LOST),
        worst_lost=at(WORST_LOST),
        off_deg=at(OFF_DEG),
        worst_off_deg=at(WORST_OFF_DEG),
        unaligned_deg=at(UNALIGNED_DEG),
    )


def cost_words(step_px: float) -> str:
    """Return the cost of this many pixels from flash to flash in words, with alignment and without."""
    cost = motion_cost(step_px)
    return (
        f"about {100 * cost.lost:.0f} % of the normals there are lost (at worst {100 * cost.worst_lost:.0f} %; what "
        "slides loses least, what tumbles most), and "
        f"with what is filled in they are off by about {cost.off_deg:.1f} degrees more than at rest (at worst "
        f"{cost.worst_off_deg:.0f}); without alignment by about {cost.unaligned_deg:.0f}"
    )
