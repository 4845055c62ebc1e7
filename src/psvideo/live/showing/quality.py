"""Quality that steps down instead of falling behind, and grows back: by how much the live picture is made smaller.

A pure function of what was measured in each second. Where results come late or seldom, or frames wait, the picture is
made smaller. Where a larger one would leave time to spare, by what results have cost, it grows by one size; after a
growth that did not hold it waits twice as long before the next. Every change is said.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

MOST_AGE_S = 0.2
"""From the end of an exposure to the picture it may take this long."""
LEAST_RATE = 15.0
"""Results a second that look like motion; fewer are enough only where the strobe's rounds come more slowly."""
MOST_RATE = 17.0
"""More results a second nobody sees: they would only take time from frames and pages."""
MOST_BEHIND_S = 0.1
"""Frames that are fetched this much later than they were wait somewhere, and cameras have room for half a second."""
MOST_BUSY, SPARE_BUSY = 0.9, 0.65
"""Share of the time that making results may take; and that it would take at the next larger size, for that to be
tried. Between them lies what the guess may be wrong by."""
SPARE_AGE = 0.75
"""Share of ``MOST_AGE_S`` that the guess of the age at the next larger size may come to."""
LATE = 2
"""Seconds in a row without time until the picture is made smaller: one second may be anybody's."""
CALM, LONGEST_CALM = 3, 96
"""Seconds in a row with time to spare until the picture is made larger: at first, and after many vain growths."""
HELD = 60
"""Seconds after which a larger size has held: growing is as quick as at first again."""
FRESH = 1
"""Seconds after a change that are not judged: the ring fills, and what a size needs is made."""
HELPS = 0.8
"""A smaller picture that is drawn no sooner than after this share of the time before does not help its viewers: what
they lack is not the picture's size. Then it is judged for ``LONGEST_CALM`` seconds by when it is made."""
PER_PIXEL = 0.5
"""Share of a result's cost that is taken to grow with its pixels until that is known: a fifth to 0.7 were measured."""
FIRST_PIXELS = 250_000
"""The picture begins at no more pixels than this."""
STEPS = (1, 2, 3, 4, 6, 8)


@dataclass(frozen=True, kw_only=True)
class LiveSecond:
    """What was measured in a second in which there were results.

    ``age_s``: from the coming of a result's last frame until it was drawn; ``made_age_s``: until it was made, both of
    the second's oldest, since every picture is to be in time. ``made_s``: what making one took, the median.
    ``rate``: results a second; ``rounds_per_s``: what the strobe gives.
    ``behind_s``: by how much later frames were fetched than in the seconds before.
    """

    age_s: float
    made_age_s: float
    made_s: float
    rate: float
    rounds_per_s: float
    behind_s: float = 0.0

    @property
    def busy(self) -> float:
        """Share of the second that making results took."""
        return self.made_s * self.rate

    @property
    def is_late(self) -> bool:
        """Whether there was no time for what was done; few results count where it was making them that took long."""
        few = self.rate < 0.9 * min(LEAST_RATE, self.rounds_per_s) and self.busy > MOST_BUSY / 2
        return few or self.age_s > MOST_AGE_S or self.busy > MOST_BUSY or self.behind_s > MOST_BEHIND_S

    @property
    def as_made(self) -> "LiveSecond":
        """The same second, for viewers who draw what there is as soon as it is made."""
        return replace(self, age_s=self.made_age_s)

    def spares(self, made_s: float) -> bool:
        """Return whether time would be left if making a result took so long, and drawing it as much longer."""
        drawing_s = max(self.age_s - self.made_age_s, 0.0) * made_s / max(self.made_s, 1e-9)
        age_s = self.made_age_s + made_s - self.made_s + drawing_s
        busy = made_s * min(MOST_RATE, self.rounds_per_s)
        return busy <= SPARE_BUSY and age_s <= SPARE_AGE * MOST_AGE_S and not self.is_late


@dataclass(frozen=True, kw_only=True)
class Quality:
    """The live picture's ``step``: a pixel of it is this many of the camera's wide; ``steps`` are those that there are.

    ``late``, ``calm``: seconds in a row without time, and with time to spare; ``wait``: this many of the latter let it
    grow. ``since``: seconds at this step; ``grew``: whether it was a growth that led here, and is not yet known to
    hold; ``before_s``: what a result cost just before it. ``dearer``: how much dearer results got when the picture grew
    to a step, of those that it grew to. ``drawn_s``: how old pictures were when they were made smaller for that alone;
    ``by_made``: seconds in which it does not count when they are drawn.
    """

    step: int
    steps: tuple[int, ...] = STEPS
    late: int = 0
    calm: int = 0
    wait: int = CALM
    since: int = FRESH
    grew: bool = False
    before_s: float | None = None
    dearer: Mapping[int, float] = field(default_factory=dict)
    drawn_s: float | None = None
    by_made: int = 0

    def after_second(self, second: LiveSecond) -> "Quality":
        """Return the quality after a second: as it was, with one more second counted, or of another size."""
        if self.since < FRESH:
            return replace(self, since=self.since + 1)
        viewed = self._judging_viewers(second)
        if viewed.by_made:
            return replace(viewed, by_made=viewed.by_made - 1)._resized(second.as_made)
        return viewed._resized(second)

    def _judging_viewers(self, second: LiveSecond) -> "Quality":
        """Where the picture was made smaller for viewers alone: leave aside when they draw it, if that did not help."""
        if self.drawn_s is None:
            return self
        helped = second.age_s <= HELPS * self.drawn_s
        return replace(self, drawn_s=None, by_made=0 if helped else LONGEST_CALM)

    def _with_costs(self, second: LiveSecond) -> "Quality":
        """Note what a second says of this size: whether it held, whether there was time, how much dearer it is."""
        held = self.grew and self.since + 1 >= HELD
        dearer = {} if self.before_s is None else {self.step: second.made_s / max(self.before_s, 1e-9)}
        return replace(
            self,
            late=self.late + 1 if second.is_late else 0,
            wait=CALM if held else self.wait,
            since=self.since + 1,
            grew=self.grew and not held,
            before_s=None,
            dearer={**self.dearer, **dearer},
        )

    def _resized(self, second: LiveSecond) -> "Quality":
        """Return the quality at the size that a second, and those before it, leave time for."""
        now = self._with_costs(second)
        larger = now._next(-1)
        spare = larger != self.step and second.spares(second.made_s * now.dearer_by(larger))
        now = replace(now, calm=self.calm + 1 if spare else 0)
        if now.late >= LATE:
            return now._smaller(second)
        if now.calm >= now.wait:
            return replace(now, step=larger, calm=0, late=0, since=0, grew=True, before_s=second.made_s)
        return now

    def dearer_by(self, larger: int) -> float:
        """Return by how much dearer a result will be at a larger size: as it was the last time, or by half of what its
        pixels say where it never was; never more than by all of them."""
        pixels = _pixels(larger) / _pixels(self.step)
        return float(min(max(self.dearer.get(larger, 1 + PER_PIXEL * (pixels - 1)), 1.0), pixels))

    def _smaller(self, second: LiveSecond) -> "Quality":
        """Return the next smaller size, or the one below it where that would not help enough."""
        step = self._next(1)
        wanted_s = MOST_BUSY / max(min(LEAST_RATE, second.rounds_per_s), 1e-9)
        if second.made_s * _pixels(step) / _pixels(self.step) > wanted_s:
            step = replace(self, step=step)._next(1)
        if step == self.step:
            return self
        wait = min(2 * self.wait, LONGEST_CALM) if self.grew else self.wait
        drawn_s = None if second.as_made.is_late else second.age_s
        return replace(self, step=step, late=0, calm=0, since=0, grew=False, wait=wait, before_s=None, drawn_s=drawn_s)

    def _next(self, way: int) -> int:
        at = self.steps.index(self.step) + way
        return self.steps[min(max(at, 0), len(self.steps) - 1)]


def first_quality(width_px: int, height_px: int, *, mosaic: bool) -> Quality:
    """Return the quality to begin with; a mosaic becomes colour by cells of two pixels at least."""
    steps = STEPS[1:] if mosaic else STEPS
    step = next((one for one in steps if width_px * height_px * _pixels(one) <= FIRST_PIXELS), steps[-1])
    return Quality(step=step, steps=steps)


def _pixels(step: int) -> float:
    """Return a picture's pixels as a share of the camera's."""
    return 1.0 / step**2
