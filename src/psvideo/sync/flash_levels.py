"""What every flash of a clip gives, as a gain of its own on its light.

Rows' brightnesses are fitted under the gains, and the gains under the brightnesses, in turns, so that a light that is
dead for half of the clip counts as one that gives nothing then, and not as half as bright.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers
from psvideo.model.plan import Plan
from psvideo.model.timing import Flash
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import row_noise
from psvideo.sync.rowfit.tracking.misfires import first_seen, seen_flashes

ROWS = 60
PART_FRAMES = 512
"""Frames over which a light's brightnesses are taken to be the same, but for one gain a flash."""
TURNS = 4
TOUCHED = 4
"""A flash is looked for in this many frames from the first that may see any of it."""
SEEN = 0.02
"""Rows that have seen less than this of a flash, as a share of its squared light, do not show whether it fired, however
little noise there is: what the times' errors do to so few rows is not in it."""
GOES_ON = 0.5
"""Light of this share of what a lamp gives is light that goes on."""
SURE = 4.0
"""Standard errors by which a gain, and usual scatters by which a flash, must lie below what one that fired shows. With
so many a gain must be known to ``GOES_ON`` at all."""


@dataclass(frozen=True, kw_only=True)
class FlashLevels:
    """What flashes give, ``value`` (flash,), with its standard errors; NaN where too little was seen of one."""

    value: Doubles
    error: Doubles


def flash_levels(plan: Plan, found: ClipFit, lit: Sequence[Flash]) -> FlashLevels:
    """Return what every lit flash gives, with brightnesses that are fitted part by part."""
    rows = replace(found.rows.one_window(), doubt=None, restless=None).binned(ROWS)
    start_s, duration_s = (np.array([getattr(one, name) for one in lit]) for name in ("start_s", "duration_s"))
    number = {slot: n for n, slot in enumerate(plan.lit_slots)}
    unknown = np.array([number[one.slot] for one in lit])
    first = first_seen(found.rows, found.fit.beat, start_s)
    value, error = np.full(len(lit), np.nan), np.full(len(lit), np.inf)
    parts = max(round(len(rows.value) / PART_FRAMES), 1)
    edges = np.linspace(0, len(rows.value), parts + 1).astype(int)
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        span = slice(begin, min(end + TOUCHED, len(rows.value)))
        own = np.flatnonzero((first <= rows.index[end - 1]) & (first + TOUCHED > rows.index[begin]))
        if not len(own):
            continue
        part = _Part.of(found, rows.take(span), start_s[own], duration_s[own], unknown[own])
        level, unsure = part.levels(len(plan.lit_slots))
        here = (first[own] >= rows.index[begin]) | (begin == 0)
        value[own[here]], error[own[here]] = level[here], unsure[here]
    return FlashLevels(value=value, error=error)


@dataclass(frozen=True, kw_only=True)
class _Part:
    """Frames ``value`` (frame, row) and the flashes in them: of each its light ``unknown`` (flash,), the frames ``at``
    (flash, touched) that may have seen it, and what share of it their rows saw, ``seen`` (flash, touched, row)."""

    value: Doubles
    at: Integers
    seen: Doubles
    unknown: Integers

    @classmethod
    def of(
        cls,
        found: ClipFit,
        rows: Profiles,
        start_s: Doubles,
        duration_s: Doubles,
        unknown: Integers,
    ) -> "_Part":
        """Lay out flashes that start and last for some seconds."""
        at, seen = seen_flashes(rows, found.fit.beat, start_s, duration_s, touched=TOUCHED)
        return cls(value=rows.value, at=at, seen=seen, unknown=unknown)

    def levels(self, lights: int) -> tuple[Doubles, Doubles]:
        """Return what every flash gives, as a mean over rows, and its standard error, both of shape (flash,)."""
        gain = np.ones(len(self.unknown))
        for turn in range(TURNS):
            design = self._design(gain, lights)
            light = _solved(design, self.value)
            rest = self.value - np.einsum("fru,ru->fr", design, light)
            own = self.seen * light[:, 1:].T[self.unknown][:, None, :]
            power = (own**2).sum(axis=(1, 2))
            move = (own * rest[self.at]).sum(axis=(1, 2)) / np.maximum(power, 1e-30)
            gain = np.clip(gain + move * (1.0 if turn == 0 else 0.7), -1.0, 9.0)
        size = np.sqrt((light[:, 1:] ** 2).mean(axis=0))[self.unknown]
        whole = (light[:, 1:] ** 2).sum(axis=0)[self.unknown]
        noise = np.sqrt((own**2 * row_noise(rest) ** 2).sum(axis=(1, 2))) / np.maximum(power, 1e-30)
        level: Doubles = np.where((power > SEEN * whole) & (SURE * noise < GOES_ON), gain * size, np.nan)
        return level, noise * size

    def _design(self, gain: Doubles, lights: int) -> Doubles:
        """Return what rows saw of ambient light and of every light, shape (frame, row, 1 + light)."""
        design = np.zeros((*self.value.shape, 1 + lights))
        design[:, :, 0] = 1.0
        share = gain[:, None, None] * self.seen
        np.add.at(design.transpose(0, 2, 1), (self.at, 1 + self.unknown[:, None]), share)
        return design


def _solved(design: Doubles, value: Doubles) -> Doubles:
    """Return the brightnesses (row, unknown) that explain rows best."""
    normal = np.einsum("fru,frv->ruv", design, design, optimize=True)
    size = np.einsum("ruu->ru", normal)
    normal += 1e-6 * np.maximum(size, size.max())[:, :, None] * np.eye(design.shape[2])
    right = np.einsum("fru,fr->ru", design, value, optimize=True)
    found: Doubles = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
    return found
