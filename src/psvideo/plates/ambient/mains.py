"""Mains light: how much brighter or darker each row's exposure was than the ambient light's mean.

Lamps on the mains pulse at 100 or 120 Hz. An exposure of another length than whole pulses collects more or less of
them, each row at another phase: stripes that move from frame to frame. Between two dark slots the phases of every row
are known from the clock, so that one amplitude and phase, the same for all rows, is found from how the rows' means
changed. Two pairs of dark slots in a row must agree: a shadow that crosses the rows may look like a ripple
once, but not twice. The lamps' share of the light is taken to be the same all over the picture.

Where the fit of the clip's timing found a ripple, it is known from the first plate on, and from far more rows than two
dark slots have: what these show takes its place only where it is known better.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.rows.ripple import MOST_SWING, Exposures, Ripple, swing
from psvideo.plates.split import Plate

PULSES_HZ = (100.0, 120.0)
EXPLAINED = 0.8
"""A ripple is believed where it explains this share of the rows' changes, beyond one change of level."""
LEAST_TURN = 0.3
"""Dark slots must differ at least this much in phase (of 2 at most, RMS) to show a ripple."""
LEAST_ROWS = 16
LEAST_SWING = 1e-3
AGREES = 0.3
"""Two findings agree that differ by no more than this share of themselves, which is 0.3 in phase as well."""
LONGEST_UNSEEN = 4
"""Dark slots for which a ripple is taken to go on that is not seen: the mains wander, by up to 0.2 Hz."""
ROUGH = 0.02
"""A clip's own ripple that is known no better than to this share gives way to what pairs of dark slots agree on."""


@dataclass(frozen=True, kw_only=True)
class RowLight:
    """The rows of a plate: their means (row,), and whose exposures went into them, ``opened``. ``good`` (row,) is False
    where a row was not seen, holds no light or is clipped."""

    mean: Doubles
    opened: Exposures
    good: NDArray[np.bool_]

    @classmethod
    def of(cls, plate: Plate, mean: Doubles, clipped: NDArray[np.bool_]) -> "RowLight":
        """Return the rows of a plate that still holds its ambient light, of their means and which are clipped."""
        good = plate.seen & (mean > 0) & ~clipped
        return cls(mean=mean, opened=Exposures(shares=plate.shares, middles_s=plate.middles_s), good=good)


@dataclass(frozen=True, kw_only=True)
class Mains:
    """What dark slots showed of mains light up to the one whose ``rows`` these are.

    ``last`` is what the last pair of slots showed, ``agreed`` what two pairs agreed on, ``unseen`` slots ago;
    ``timed`` is what the whole clip showed when it was timed.
    """

    rows: RowLight
    last: Ripple | None = None
    agreed: Ripple | None = None
    unseen: int = 0
    timed: Ripple | None = None

    @property
    def ripple(self) -> Ripple | None:
        """What is known best: the whole clip's, unless that is rough and two pairs of slots agreed."""
        if self.timed is None or (self.agreed is not None and self.timed.error > ROUGH * abs(self.timed.amplitude)):
            return self.agreed
        return self.timed

    def next(self, rows: RowLight) -> "Mains":
        """Return what is known with one more dark slot."""
        found = find_ripple(self.rows, rows)
        if found is not None and self.last is not None and _agree(found, self.last):
            return replace(self, rows=rows, last=found, agreed=found, unseen=0)
        if self.agreed is None or self.unseen == LONGEST_UNSEEN:
            return replace(self, rows=rows, last=found, agreed=None, unseen=0)
        return replace(self, rows=rows, last=found, unseen=self.unseen + 1)


def _agree(one: Ripple, other: Ripple) -> bool:
    return one.hz == other.hz and abs(one.amplitude - other.amplitude) < AGREES * abs(other.amplitude)


def find_ripple(before: RowLight, after: RowLight) -> Ripple | None:
    """Return the ripple by which the rows of two dark slots differ, None where none is seen clearly."""
    good = before.good & after.good
    if good.sum() < LEAST_ROWS:
        return None
    change = np.log(after.mean[good] / before.mean[good])
    weight = np.minimum(before.mean, after.mean)[good]
    weight = weight / weight.max()
    tried = [_fitted(before, after, hz, good, change, weight) for hz in PULSES_HZ]
    best = max((one for one in tried if one is not None), key=lambda one: one[0], default=None)
    clear = best is not None and best[0] > EXPLAINED and abs(best[1].amplitude) > LEAST_SWING
    return best[1] if best is not None and clear else None


def _fitted(
    before: RowLight,
    after: RowLight,
    hz: float,
    good: NDArray[np.bool_],
    change: Doubles,
    weight: Doubles,
) -> tuple[float, Ripple] | None:
    """Fit one change of level and one ripple (Gauss-Newton); return the share of the change explained, and it."""
    early, late = before.opened.phasor(hz)[good], after.opened.phasor(hz)[good]
    if np.sqrt(np.mean(np.abs(late - early) ** 2)) < LEAST_TURN:
        return None
    amplitude = 0j
    for _ in range(5):
        low, high = swing(amplitude, early), swing(amplitude, late)
        turn = late / high - early / low
        slopes = np.stack([np.ones(len(turn)), turn.real, -turn.imag], axis=1) * weight[:, None]
        rest = (change - np.log(high / low)) * weight
        (_, real, imaginary), *_ = np.linalg.lstsq(slopes, rest, rcond=1e-3)
        amplitude += complex(real, imaginary)
        if abs(amplitude) > MOST_SWING:
            return None
    left = change - np.log(swing(amplitude, late) / swing(amplitude, early))
    left = left - np.average(left, weights=weight**2)
    flat = change - np.average(change, weights=weight**2)
    explained = 1 - float(((left * weight) ** 2).sum() / max(((flat * weight) ** 2).sum(), 1e-18))
    return explained, Ripple(hz=hz, amplitude=amplitude)
