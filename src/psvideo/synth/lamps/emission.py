"""How an LED gives off a flash: a square pulse whose edges follow its 1/e rise and fall times."""

from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles

Bursts = tuple[tuple[float, float], ...]

TAILS = 16.0
"""After this many fall times a tail has given off all but 1e-7 of its light."""


@dataclass(frozen=True, kw_only=True)
class Emission:
    """How an LED answers its drive: 1/e rise and fall times in seconds, 0 for a perfect square."""

    rise_s: float = 0.0
    fall_s: float = 0.0

    def energy(self, since_s: Doubles, duration_s: float) -> Doubles:
        """Return the energy given off up to ``since_s`` seconds after the drive's start, in seconds of full light.

        >>> float(Emission().energy(np.array(0.5), 2.0)), float(Emission().energy(np.array(9.0), 2.0))
        (0.5, 2.0)
        """
        lit_s = np.clip(since_s, 0.0, duration_s)
        reached = 1.0
        given = lit_s
        if self.rise_s > 0:
            given = lit_s + self.rise_s * np.expm1(-lit_s / self.rise_s)
            reached = -np.expm1(-duration_s / self.rise_s)
        if self.fall_s > 0:
            after_s = np.clip(since_s - duration_s, 0.0, None)
            given = given - reached * self.fall_s * np.expm1(-after_s / self.fall_s)
        return given

    def whole(self, duration_s: float) -> float:
        """Return the energy of the whole flash, tail included, in seconds of full light."""
        return float(self.energy(np.array(np.inf), duration_s))

    def share(self, since_s: Doubles, duration_s: float, bursts_s: Bursts = ()) -> Doubles:
        """Return the energy given off so far as a fraction of the whole flash's, 0 to 1.

        ``bursts_s`` are starts (after the flash's) and lengths where the drive is not on throughout. Their tails add
        up, which is exact where rise and fall are alike.

        >>> float(Emission().share(np.array(0.5), 1.0, ((0.0, 0.1), (0.9, 0.1))))
        0.5
        """
        if not bursts_s:
            return self.energy(since_s, duration_s) / self.whole(duration_s)
        given = sum(
            (self.energy(since_s - start_s, length_s) for start_s, length_s in bursts_s), np.zeros_like(since_s)
        )
        return given / sum(self.whole(length_s) for _, length_s in bursts_s)

    def lasts_s(self, duration_s: float) -> float:
        """Return how long after the drive's start there is light, but for 1e-7 of the tail."""
        return duration_s + TAILS * self.fall_s
