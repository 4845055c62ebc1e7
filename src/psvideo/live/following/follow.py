"""The strobe's clock, followed frame by frame from a lock on: predicted, held against what came, corrected.

The model is the finder's own (``sync.rowfit``): the brightness of every row under every light is fitted to the latest
frames, and what is left of them moves the clock. A frame that was not predicted is looked at more closely: frames went
missing before it, or the light changed; where nothing explains it, the lock is lost, and said to be.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from psvideo.live.following.first_shown import first_shown
from psvideo.live.following.foretold import shift_of
from psvideo.live.following.lock import Lock
from psvideo.live.following.phase_filter import Measured, PhaseFilter, started
from psvideo.live.following.trims import Trims, trimmed
from psvideo.live.following.window import HeldFrame, Window, window_of
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat, FoundClock
from psvideo.sync.rowfit.coarse.seed import GOOD_SEED, gain_of
from psvideo.sync.rowfit.normal_equations import projected
from psvideo.sync.rowfit.profiles import Profiles, brightnesses, unexplained
from psvideo.sync.rowfit.refine import CAUCHY, GLOBALS, errors_of_residuals, explained
from psvideo.sync.rowfit.standard_error import sandwich
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS, losses_of
from psvideo.sync.rowfit.tracking.steps_ahead import MOST
from psvideo.sync.verdict.believed import MIN_EXPLAINED, MIN_GAIN

State = Literal["seeking", "locked", "unsure", "lost"]
EVERY = 8
"""Frames between two corrections of the clock."""
LOOKED = 3
"""Frames that were not predicted until others are taken for missing before them."""
LATEST = 24
"""Frames by which it is judged whether the strobe is still seen."""
LEFT, LEFT_AFTER_CHANGE, SLOWLY = 0.6, 0.85, 8
"""Where the strobe explains less than this share of what it usually does (a mean over this many corrections), it is as
likely to be another one; the more so after a change, as a strobe that was started again is one."""
HELD = 0.33
"""A correction moves the clock by no more than this share of a flash."""
ASTRAY, LEAST_ASTRAY_ROWS = 8.0, 0.1
"""A strobe that stands by more standard errors, and more rows, from where its clock has it is another one: one that was
started again. Where frames are missing it stands within 2 errors, else hardly ever within 15."""
NOTHING = 1e-3
"""Frames that change by this share of what the strobe's light changes (ten stops less) show nothing of it, and what is
fitted to them explains it all."""
STEP_COST = 0.02
"""What every frame that is taken for missing costs, in mean losses of a frame: cycles may look alike."""


@dataclass(frozen=True, kw_only=True)
class Hole:
    """Frames that were found missing: ``count`` of them before the frame at the place ``before``, as numbered."""

    before: int
    count: int


@dataclass(kw_only=True)
class Follower:
    """Follows one lock. ``extra`` is by how many frames the picture says that frames come later than numbered.

    ``holes`` are frames that are missing without a word, ``repeated`` the numbers of those that show the same moment
    as the one before them. ``measured`` is what windows of frames said of the clock, against the lock's own, ``span``
    the places in time of the first and the last frame that were followed; ``doubted_from`` is the place from which it
    is not known whether they show this strobe, None while it is locked.
    """

    plan: Plan
    lock: Lock
    beat: Beat
    phase: PhaseFilter
    window: Window
    state: State = "locked"
    extra: int = 0
    span: tuple[int, int] | None = None
    doubted_from: int | None = None
    holes: list[Hole] = field(default_factory=list)
    repeated: list[int] = field(default_factory=list)
    measured: list[Measured] = field(default_factory=list)
    trims: Trims = field(default_factory=Trims)
    share: float = 1.0
    _light: Doubles | None = None
    _learnt: Profiles | None = None
    _usual: float = 0.0
    _odd: list[int] = field(default_factory=list)
    _fresh: int = 0
    _usual_share: float = GOOD_SEED

    @property
    def clock(self) -> FoundClock:
        """The strobe's clock as it is known now."""
        return self.phase.clock

    @property
    def error_rows(self) -> float:
        """The standard error of the flashes' times at the latest frame, in rows."""
        at_s = self.phase.at_s if self.span is None else self.span[1] * self.window.period_s
        return self.phase.error_at_s(at_s) / self._row_s

    @property
    def _row_s(self) -> float:
        return self.beat.row_time_s or self.window.period_s / self.plan.camera.height_px

    def missing_before(self, number: int) -> int:
        """Return how many frames were found missing before a numbered one."""
        return sum(hole.count for hole in self.holes if hole.before <= number)

    def later_at(self, number: int) -> int:
        """Return by how many frames this lock has a numbered one later than the lock's first: less than none where
        more are repeated than missing."""
        return self.missing_before(number) - sum(again <= number for again in self.repeated)

    def forget_after(self, number: int) -> None:
        """Forget which frames beyond a number are missing or repeated: another lock knows better."""
        self.holes[:] = [hole for hole in self.holes if hole.before <= number]
        self.repeated[:] = [again for again in self.repeated if again <= number]

    def begin_at(self, place: int) -> None:
        """Begin what is followed at a place in time, where it began before that."""
        if self.span is not None:
            self.span = max(self.span[0], place), self.span[1]

    def trimmed(self, at_s: float, ppm: float) -> None:
        """Foresee that the strobe, from a time on, comes later by this many ppm of the time that passes."""
        since_s = self.window.frames[0].index * self.window.period_s if self.window.frames else at_s
        self.phase = trimmed(self.phase, self.trims, at_s, ppm, since_s=since_s)

    def add(self, index: int, value: Doubles, doubt: Doubles | None = None) -> int:
        """Take in the frame that is numbered ``index`` and return its place in time; ``value`` (row,) is its profile.

        A frame that comes twice is left out.
        """
        place = index + self.extra
        if self.window.frames and place <= self.window.frames[-1].index:
            return place
        self.window.add(HeldFrame(index=place, value=value, doubt=doubt))
        self.span = (place if self.span is None else self.span[0], place)
        self._fresh += 1
        if self._light is not None and self.state != "lost":
            self._hold_against_foretold(index)
        if self._fresh >= EVERY and len(self.window.frames) >= LATEST:
            self._correct()
        return self.window.frames[-1].index

    def _hold_against_foretold(self, index: int) -> None:
        """Look for missing frames where the latest were not predicted, and else take the light for changed."""
        latest = self.window.profiles(1)
        if self._losses(latest)[0] < self._usual + SUSPICIOUS:
            self._odd = self._odd[-LOOKED:] if self._odd and latest.index[0] - self._odd[-1] < LOOKED else []
            return
        self._odd.append(int(latest.index[0]))
        if len(self._odd) != LOOKED:
            return
        first = self._odd[0]
        frames = self.window.profiles(sum(frame.index >= first for frame in self.window.frames))
        extra = self._missing(frames)
        if extra:
            self.holes.append(Hole(before=first - self.extra, count=extra))
            self.window.moved(first, extra)
            self.extra += extra
            self.span = (self.span or (0, 0))[0], self.window.frames[-1].index
            self._odd = []
        elif not self.window.changes or first - self.window.changes[-1] > EVERY:
            self.window.changes.append(first)
            self._doubt(first)

    def _doubt(self, first: int) -> None:
        """Be not sure of the strobe from a place on, where that was not doubted before."""
        self.state = "unsure"
        self.doubted_from = first if self.doubted_from is None else self.doubted_from

    def _no_hole(self) -> bool:
        """Return whether the last hole is none, and lose the strobe then: behind it another one was started."""
        if not self.holes or self._light is None:
            return False
        hole = self.holes[-1]
        first = hole.before + self.extra + sum(again > hole.before for again in self.repeated)
        since = sum(frame.index >= first for frame in self.window.frames)
        if not EVERY <= since < len(self.window.frames) or not self._is_astray(since):
            return False
        self.holes.pop()
        self.extra -= hole.count
        self.window.moved(first, -hole.count)
        self.span = (self.span or (0, 0))[0], self.window.frames[-1].index
        self.state, self.doubted_from = "lost", first - hole.count
        return True

    def _is_astray(self, latest: int) -> bool:
        """Return whether the strobe in the last frames stands elsewhere than its clock foretold."""
        assert self._learnt is not None  # noqa: S101
        assert self._light is not None  # noqa: S101
        rows, beat = self.window.profiles(latest), replace(self.beat, clock=self.clock)
        shift_s, error_s = shift_of(self.plan, rows, beat, learnt=self._learnt, light=self._light)
        error_s = float(np.hypot(error_s, self.phase.error_at_s(float(rows.frame_start_s.mean()))))
        return abs(shift_s) > max(ASTRAY * error_s, LEAST_ASTRAY_ROWS * self._row_s)

    def _missing(self, frames: Profiles) -> int:
        """Return how many frames are missing before some that were not predicted, 0 where that explains nothing."""
        tried = [replace(frames, index=frames.index + extra) for extra in range(MOST + 1)]
        losses = np.array([self._losses(one).mean() for one in tried])
        best = int((losses + STEP_COST * np.arange(len(losses))).argmin())
        return best if losses[best] < min(self._usual, losses[0] - SUSPICIOUS) + SUSPICIOUS else 0

    def _losses(self, rows: Profiles) -> Doubles:
        assert self._learnt is not None  # noqa: S101
        assert self._light is not None  # noqa: S101
        return losses_of(self.plan, self._learnt, rows, replace(self.beat, clock=self.clock), self._light)

    def _correct(self) -> None:
        """Move the clock by what the latest frames leave, and judge whether the strobe is still seen in them."""
        new, self._fresh = self._fresh, 0
        if self._no_hole():
            return
        rows, beat = self.window.profiles(), replace(self.beat, clock=self.clock)
        rest = unexplained(self.plan, rows, beat)
        self._judge(rows, rest)
        if self.state == "locked":
            at_s = float(rows.frame_start_s.mean())
            shift_s, error_s = _shift(self.plan, rows, beat, rest)
            error_s *= float(np.sqrt(len(rows.value) / new))
            self.measured.append(Measured(at_s=at_s, late_s=self._late_s(at_s) + shift_s, error_s=error_s))
            self.phase = self.phase.corrected(at_s, shift_s, error_s)
        self._learn(rows)

    def _judge(self, rows: Profiles, rest: Doubles) -> None:
        """Judge whether the latest frames show the strobe where the clock has it, and as well as those before did.

        Right after a change of light nobody knows: new brightnesses explain a few frames wherever flashes are.
        """
        if self.state == "unsure" and self.window.since_change() < LATEST:
            return
        latest = rows.take(slice(len(rows.value) - LATEST, len(rows.value)))
        self.share = 0.0 if self._shows_nothing(latest) else gain_of(latest, rest[-LATEST:])
        left = LEFT if self.state == "locked" else LEFT_AFTER_CHANGE
        least = max(MIN_GAIN, left * self._usual_share)
        good = self.share > least and explained(latest, rest[-LATEST:]) > MIN_EXPLAINED
        if good and (self.state == "locked" or not self._is_another()):
            self.state, self.doubted_from = "locked", None
            self._usual_share += (self.share - self._usual_share) / SLOWLY
        elif self.state == "locked":
            self._doubt(int(latest.index[0]))
        else:
            self.state = "lost"

    def _shows_nothing(self, rows: Profiles) -> bool:
        """Return whether rows hardly change, against what they did when brightnesses were last learnt."""
        if self._learnt is None:
            return False
        return float(rows.value.std(axis=0).max()) < NOTHING * float(self._learnt.spread.max())

    def _is_another(self) -> bool:
        """Return whether what is seen after a doubt is not the strobe from before it, as far as is known yet."""
        begins = self.window.frames[-LATEST].index
        if self.state == "lost" and (self.share <= GOOD_SEED or begins < (self.doubted_from or 0)):
            return True
        return self._light is not None and self._is_astray(LATEST)

    def _learn(self, rows: Profiles) -> None:
        """Fit brightnesses to the frames since the light last changed, once these show every light; not to frames that
        may show another strobe, for what is fitted to them explains them."""
        known = self.window.since_change()
        if self._light is not None and (known < LATEST or self.state != "locked"):
            return
        learnt = rows.take(slice(len(rows.value) - known, len(rows.value))).one_window()
        beat = replace(self.beat, clock=self.clock)
        self._light, self._learnt = brightnesses(self.plan, learnt, beat), learnt
        self._usual = float(np.median(self._losses(learnt)))

    def _late_s(self, at_s: float) -> float:
        """Return by how much flashes come later at a time than the lock's own clock says, trims left aside."""
        base, now = self.lock.beat.clock, self.clock
        strobe_s = (at_s - base.phase_s) / base.rate
        return now.phase_s + strobe_s * now.rate - at_s


def following(plan: Plan, lock: Lock) -> Follower:
    """Return what follows the strobe from a lock on."""
    return Follower(
        plan=plan,
        lock=lock,
        beat=lock.beat,
        phase=started(lock.beat.clock, lock.at_s, lock.error_s, lock.error_ppm),
        window=window_of(plan, lock.beat),
    )


def caught_up(
    plan: Plan,
    lock: Lock,
    values: Sequence[Doubles],
    doubts: Sequence[Doubles | None] | None = None,
    *,
    numbers: Sequence[int] | None = None,
) -> Follower:
    """Return what follows the strobe after the frames that the lock was found in, whose profiles these are.

    ``numbers`` are the frames' own (left out: their places in time): where the lock has frames come later than these
    say, and later than those before, frames are missing, as where the follower finds it; a frame that has the place of
    the one before repeats it. What is followed begins at the first frame in which the strobe is seen.
    """
    follower, places = following(plan, lock), lock.places.tolist()
    doubts = doubts or [None] * len(values)
    numbers = places if numbers is None else numbers
    later = follower.extra = places[0] - numbers[0]
    for number, place, value, doubt in zip(numbers, places, values, doubts, strict=True):
        more, later = place - number - later, place - number
        follower.extra += more
        if more > 0:
            follower.holes.append(Hole(before=number, count=more))
        follower.repeated.extend([number] * -more)
        follower.add(number, value, doubt)
    follower.begin_at(first_shown(plan, lock, values, doubts))
    return follower


def _shift(plan: Plan, rows: Profiles, beat: Beat, rest: Doubles) -> tuple[float, float]:
    """Return by how much all flashes come later than a beat says, and the standard error: one robust step."""
    scale = errors_of_residuals(rows, rest, 0.0)
    weight = 1.0 / (1.0 + (rest / (CAUCHY * scale)) ** 2) / scale**2
    basis = np.zeros((len(rows.window_start) + 1 + len(GLOBALS), 1))  # what a fit may free is held here
    basis[: len(rows.window_start) + 1] = 1.0
    _, hessian, scores, _ = projected(plan, rows, beat, weight, basis, tails=False)
    shortest_s = plan.shortest_flash_s
    known = np.full((1, 1), shortest_s**-2.0)
    shift_s = float(scores.sum() / (hessian[0, 0] + known[0, 0]))
    most_s = HELD * shortest_s
    least_s = (hessian[0, 0] + known[0, 0]) ** -0.5  # where few rows show the phase, none of them may differ
    error_s = max(float(np.sqrt(sandwich(hessian, scores, known)[0, 0])), float(least_s))
    return float(np.clip(shift_s, -most_s, most_s)), error_s
