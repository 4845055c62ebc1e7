"""What motion costs: how many normals are lost, and how far the others are off, by pixels from flash to flash.

Measured on virtual subjects that slide and tumble before a wall (a mottled ball, a painted bust, a bare box; 3 and 5
lights, a camera's noise), solved as runs do: `python -m bench.motion_costs`. What rest costs is taken off.
"""

from dataclasses import dataclass

import numpy as np

STEPS_PX = (0.0, 1.0, 4.0, 16.0)
LOST, WORST_LOST = (0.0, 0.05, 0.17, 0.23), (0.0, 0.16, 0.44, 0.8)
OFF_DEG, WORST_OFF_DEG = (0.0, 0.4, 1.1, 5.0), (0.0, 0.7, 2.1, 19.0)
"""With alignment: the mean of the subjects and motions, and the worst of them."""
UNALIGNED_DEG = (0.0, 2.6, 9.0, 20.0)
"""Without it: the mean. Who tumbles fast, or has no texture, is nearer to this."""
LEAST_PX = 0.5
"""Less costs nothing that shows."""


@dataclass(frozen=True, kw_only=True)
class MotionCost:
    """Shares of the moving subject's trusted normals that are ``lost``, and by how many degrees the others are off: as a
    rule, at worst, and without alignment."""

    lost: float
    worst_lost: float
    off_deg: float
    worst_off_deg: float
    unaligned_deg: float


def motion_cost(step_px: float) -> MotionCost:
    """Return what motion by so many pixels from flash to flash costs; beyond the table, as at its end."""

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
    """Return the cost of so many pixels from flash to flash in words, with alignment and without."""
    cost = motion_cost(step_px)
    return (
        f"of the normals there about {100 * cost.lost:.0f} % are lost (at worst {100 * cost.worst_lost:.0f} %) and the "
        f"others off by about {cost.off_deg:.1f} degrees more than at rest (at worst {cost.worst_off_deg:.0f}); without "
        f"alignment by about {cost.unaligned_deg:.0f}"
    )
