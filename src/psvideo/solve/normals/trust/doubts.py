"""What signs come to: how far normals may be off beyond noise, as one look or several at the same surface show it.

Looks at what stands still differ by noise alone. Their mean is nearer than each of them, and moves by a share of it
only when one takes the place of another.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from psvideo.model.arrays import Flags, Floats
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.trust.doubting import Doubting, doubt_deg
from psvideo.solve.normals.trust.repeats import Repeat, noise_times
from psvideo.solve.normals.trust.signs import Signs

LIKELY_USUAL = np.float32(0.75)
"""What is usual around a pixel lies so far from what it surely is to what it likely is."""
POOLED_LOOKS = 4
"""The mean is of this many looks, the last ones."""


@dataclass(frozen=True, kw_only=True)
class Doubt:
    """What one look shows, (row, col) of the points, in degrees: how far normals may be off beyond noise, and what of
    it is usual around them; the others as in ``Signs``."""

    doubt_deg: Floats
    usual_deg: Floats
    lost_deg: Floats
    by_slope_deg: Floats
    shadows_lit: float
    explained: float

    @classmethod
    def of(cls, signs: Signs, how: Doubting) -> "Doubt":
        """Return what signs come to. Noise that grows where lights are left aside is part of the doubt, so it does not
        count as a pixel's own misfit as well."""
        nearly = signs.misfit_deg + LIKELY_USUAL * (signs.likely_misfit_deg - signs.misfit_deg)
        return cls(
            doubt_deg=doubt_deg(signs, how=how),
            usual_deg=np.float32(how.own) * np.hypot(nearly, signs.lost_deg),
            lost_deg=signs.lost_deg,
            by_slope_deg=np.broadcast_to(np.float32(signs.by_slope_deg), nearly.shape),
            shadows_lit=signs.shadows_lit,
            explained=signs.explained,
        )


@dataclass(frozen=True, kw_only=True)
class Doubts:
    """The last ``looks`` at a surface since anything changed, the ``noise`` of the last one's plates, None before the
    first, and whether to ``look_again`` rather than go by them. ``latest`` are the normals of the round before, and
    ``stood`` (row, col), on a grid of its own over the picture, is where nothing changed since then. ``repeated``: the
    looks know of a repeat how large noise is."""

    looks: tuple[Doubt, ...] = ()
    noise: PlateNoise | None = None
    look_again: bool = True
    latest: Repeat | None = None
    stood: Flags | None = None
    repeated: bool = False

    @property
    def known_noise(self) -> PlateNoise | None:
        """The noise of plates that need not be looked at again; None where they need."""
        return None if self.look_again else self.noise

    def and_of(self, look: Doubt, noise: PlateNoise) -> "Doubts":
        """Return the last looks, another one among them."""
        return Doubts(looks=(*self.looks, look)[-POOLED_LOOKS:], noise=noise, repeated=self.repeated)

    def beside(self, now: Repeat) -> "tuple[Doubts, Floats | None]":
        """Return these doubts where another round shows ``now``, and by how much the square of noise is larger at every
        point than detail shows it, None where no repeat tells. A first repeat that does makes them look again, and
        looks before it count no more; later ones are asked when they look."""
        if self.latest is None or self.stood is None or (self.repeated and not self.look_again):
            return self, None
        times = noise_times(self.latest, now, self.stood)
        if times is None or self.repeated:
            return replace(self, repeated=True), times
        return replace(self, repeated=True, looks=(), look_again=True), times

    @cached_property
    def mean(self) -> Doubt:
        """What the looks show together."""
        return self.looks[0] if len(self.looks) == 1 else _mean(self.looks)


def _mean(looks: Sequence[Doubt]) -> Doubt:
    mean: dict[str, Any] = {
        one.name: sum(getattr(look, one.name) for look in looks) / np.float32(len(looks)) for one in fields(Doubt)
    }
    return Doubt(**mean | {name: float(mean[name]) for name in ("shadows_lit", "explained")})
