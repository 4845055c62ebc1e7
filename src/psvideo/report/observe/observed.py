"""What a run sees of a take, gathered round by round: a few numbers a round, and sums that do not grow.

Shares are counted on thinned pictures. What takes longer (sharpness, the rig's fit, slopes) is looked at in
rounds 1, 2, 4, 8 and so on, so that ten thousand rounds cost hardly more than a hundred.
"""

from array import array
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from psvideo.clip import Masks
from psvideo.compute.ranks import quantile
from psvideo.model.arrays import Integers
from psvideo.model.channels import brightest_channel
from psvideo.model.marker import NOT_FIRING
from psvideo.model.surface import Surface
from psvideo.model.turn import UPRIGHT, Turn
from psvideo.plates.ambient.ambient_regression import Separated
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.sequence import AMBIENT, Round
from psvideo.report.observe.alignment.astray import astray
from psvideo.report.observe.close_looks import CloseLooks
from psvideo.report.observe.facts import FAINT, Dark, Seen, instant_facts, thinned_round
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.levels import BINS, Levels, count_levels
from psvideo.report.observe.rig_and_curve.rigfit import RigFit
from psvideo.report.observe.rig_and_curve.rigpoints import PointLight, RigPoints
from psvideo.report.observe.rig_and_curve.yuille1997 import Lens
from psvideo.report.observe.steadiness import Change, Sample, change, sample_of
from psvideo.report.observe.thinned import step_of, thin_surface, thinned
from psvideo.report.observe.watched_motion import WatchedMotion, shaken
from psvideo.report.observe.worst import Thumbnail, Worst

UNEVEN = 0.5
"""A picture of things that are brighter and darker, or turned from the light, holds less than this where it is dim, of
what it holds where it is bright."""


def _evenness(image: NDArray[np.float32]) -> float:
    low, high = (quantile(image, share) for share in (0.05, 0.95))
    return float(low / max(high, FAINT))


def _numbers() -> "array[float]":
    return array("d")


@dataclass(kw_only=True)
class Observed:
    """What was seen of a take so far; ``add`` takes in one round after the other.

    ``masks`` are where to look, None for all that is lit; ``lens`` is how the picture was seen, None where that is not
    known; ``points`` is where the rig is held against the plates.
    ``only`` are the numbers of rounds that are noted, None for all; the others serve to hold these against.
    ``ambient_measured`` (by window's first frame) is in which share of the picture ambient light could be measured
    without a dark slot.
    ``dark_evenness`` is, round by round, ambient light where it is dim beside that where it is bright; 0 where the
    lights' own pictures are even, for then nothing shows what it falls on.
    ``first`` is the number of the clip's first round.
    ``closely`` is what closer looks found, in rounds 1, 2, 4, 8 and so on, and ``light_at_points`` what lit
    the points then.
    ``turn`` is how frames, which lie as the sensor read them, were turned to stand upright, as plates do.
    ``stills`` says that the pictures of a round are photographs, each under its own light.
    ``motion`` is what moves between the plates of one light, as they pass.
    """

    lights: tuple[str, ...]
    masks: Masks | None = None
    lens: Lens | None = None
    points: RigPoints | None = None
    only: range | None = None
    first: int | None = None
    stills: bool = False
    turn: Turn = UPRIGHT
    facts: KeptFacts = field(default_factory=KeptFacts)
    counts: dict[str, Integers] = field(default_factory=dict)
    closely: CloseLooks = field(default_factory=CloseLooks)
    light_at_points: list[PointLight] = field(default_factory=list)
    ambient_measured: dict[int, float] = field(default_factory=dict)
    beyond_mask: "array[float]" = field(default_factory=_numbers)
    dark_evenness: "array[float]" = field(default_factory=_numbers)
    worst: Worst = field(default_factory=Worst)
    motion: WatchedMotion = field(default_factory=WatchedMotion)
    _sample: Sample | None = None
    _dark: Dark | None = None
    _passed: bool = False
    _fit: tuple[tuple[int, bytes], RigFit | None] | None = field(default=None, init=False)
    """What the rig's fit was asked of, so many rounds and these lights, and what came out: a report asks three times,
    and with a hundred lights each would take 0.3 s."""

    def look(self, plate: LightPlate) -> None:
        """Look at a plate before it is moved to one instant: motion is seen in those of one light, and ambient
        light in the dark slots."""
        self._passed = True
        self.motion.glance(plate, self.lights)
        if plate.light == AMBIENT:
            self._look_at_dark(plate)

    def look_at_window(self, found: Separated) -> None:
        """Look at the ambient light that a window of frames showed without a dark slot."""
        known = found.known if found.known.ndim == 2 else found.known[:, None]
        known = np.broadcast_to(known, found.image.shape[:2])
        self._dark = Dark(level=np.array(brightest_channel(thinned(found.image))), known=thinned(known))
        self.ambient_measured[found.begins] = float(found.stood.mean())

    def _look_at_dark(self, plate: LightPlate) -> None:
        step = step_of(*plate.shape[:2])
        known = np.array(plate.pixels_seen[::step, ::step])
        if known.any():
            self._dark = Dark(level=np.array(brightest_channel(plate.picture.thinned(step))), known=known)

    def add(self, one: Round, surface: Surface | None = None) -> None:
        """Take in one round, and the surface that was solved from it, if any."""
        deque(self.adding(one, surface), maxlen=0)

    def adding(self, one: Round, surface: Surface | None = None) -> Iterator[None]:
        """Take in one round as ``add`` does, a little before every step: for whoever has more to do meanwhile.

        The next round is begun after the last step.
        """
        if one.ambient is not None:
            self._look_at_dark(one.ambient)
        if self.only is not None and one.number not in self.only:
            self._sample = None if surface is None else sample_of(surface)
            return
        self.first = one.number if self.first is None else self.first
        mask = None if self.masks is None else self.masks.at(one.number)
        seen = thinned_round(one, mask)
        yield
        self.beyond_mask.append(seen.beyond)
        if self._dark is not None:
            shown = self._dark.level[self._dark.known]
            self.dark_evenness.append(_evenness(shown) if _evenness(seen.bright.max(axis=0)) < UNEVEN else 0.0)
        if not self._passed:
            for plate in one.plates:
                self.motion.glance(plate, self.lights)
        self.motion.watch_brightest(self.lights)
        yield
        some = None if surface is None else thin_surface(surface)
        moving, stirs = shaken(self.motion.latest, one), self.motion.stirring(one.time_s)
        shakes = moving is not None and moving is not self.motion.latest
        changed = self._change(surface, some, shakes=shakes)
        stirs = moving.changed if moving is not None and shakes else stirs
        facts = instant_facts(
            one, surface, mask, changed, seen=seen, some=some, moving=moving, stirs=stirs, dark=self._dark
        )
        self.facts.append(facts)
        yield
        for plate, light in zip(one.plates, seen.light, strict=True):
            counted = count_levels(light, plate.saturation)
            self.counts[plate.light] = self.counts.get(plate.light, np.zeros(BINS + 2, np.int64)) + counted
        if (one.number - self.first + 1).bit_count() == 1:
            yield from self._looking_closely(one, surface, some, seen)
        if surface is not None:
            self.worst.offer(facts, surface)

    def followed_by(self, other: "Observed") -> None:
        """Take in what was seen of the rounds after these."""
        self.facts.extend(other.facts)
        for light, counted in other.counts.items():
            self.counts[light] = self.counts.get(light, np.zeros(BINS + 2, np.int64)) + counted
        self.closely.followed_by(other.closely)
        self.light_at_points += other.light_at_points
        self.ambient_measured |= other.ambient_measured
        self.beyond_mask += other.beyond_mask
        self.dark_evenness += other.dark_evenness
        self.worst.join(other.worst)

    def levels(self, light: str) -> Levels:
        """Return a light's counts over the take."""
        return Levels(self.counts.get(light, np.zeros(BINS + 2, np.int64)))

    @property
    def firing(self) -> NDArray[np.bool_]:
        """Which lights give light at all, (light,)."""
        known = [one.levels for one in self.facts if len(one.levels) == len(self.lights)]
        if not known:
            return np.ones(len(self.lights), np.bool_)
        usual = np.median(np.array(known), axis=0)
        return np.asarray(usual >= NOT_FIRING * usual.max(), np.bool_)

    @property
    def firing_lights(self) -> tuple[str, ...]:
        """The names of the lights that give light, in the order of a rig fit's."""
        return tuple(light for light, fires in zip(self.lights, self.firing, strict=True) if fires)

    @property
    def rig_fit(self) -> RigFit | None:
        """What the points say of the rig so far, by the lights that fire; None where it cannot be said."""
        if self.points is None:
            return None
        firing = self.firing
        asked = len(self.light_at_points), firing.tobytes()
        if self._fit is None or self._fit[0] != asked:
            self._fit = asked, self.points.fit(self.light_at_points, firing)
        return self._fit[1]

    @property
    def thumbnails(self) -> tuple[Thumbnail, ...]:
        """Small pictures of the worst instants, the worst first."""
        return self.worst.thumbnails

    def _looking_closely(self, one: Round, surface: Surface | None, some: Surface | None, seen: Seen) -> Iterator[None]:
        points = self.points if one.lights == self.lights else None
        yield from self.closely.look_at_plates(one, seen, watched=self.motion.watched)
        yield
        if surface is not None:
            yield from self.closely.look_at_surface(
                *(surface, some, seen),
                lights=len(self.lights),
                lens=self.lens,
                moving_share=self.facts[-1].moving_share or 0.0,
            )
            yield
            if points is not None:
                self.closely.look_into_shadow(surface, seen, points)
        if points is not None:
            self.light_at_points.append(points.light(one))
            if self.stills and one.number == self.first and seen.subject.any():
                self._look_at_places(one, seen, points)

    def _look_at_places(self, one: Round, seen: Seen, points: RigPoints) -> None:
        shape = one.plates[0].shape[:2]
        ends = (np.flatnonzero(seen.subject.any(axis=axis))[[0, -1]] for axis in (1, 0))
        step = step_of(*shape)
        down, across = (
            slice(int(first) * step, min((int(last) + 1) * step, size))
            for (first, last), size in zip(ends, shape, strict=True)
        )
        found = astray(one.plates, points, (down, across))
        self.closely.astray += [] if found is None else [found]

    def _change(self, surface: Surface | None, some: Surface | None, *, shakes: bool) -> Change | None:
        """Hold a surface against the one before; nothing is at rest in one that the camera ``shakes``."""
        before, self._sample = self._sample, None if surface is None or shakes else sample_of(surface, some)
        return None if before is None or self._sample is None else change(before, self._sample)
