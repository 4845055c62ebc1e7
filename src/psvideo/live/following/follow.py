"""The strobe's clock, followed frame by frame from a lock on: predicted, held against what came, corrected.

The model is the finder's own (``sync.rowfit``): the brightness of every row under every light is fitted to the latest
frames, and what is left of them moves the clock. A frame that was not predicted is looked at more closely: frames went
missing before it, or the light changed; where nothing explains it, the lock is lost, and said to be.
"""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from psvideo.live.following.between_frames import unseen_s
from psvideo.live.following.foretold import Learnt, learnt_from
from psvideo.live.following.frame_places import FramePlaces
from psvideo.live.following.lateness import late_by
from psvideo.live.following.lock import Lock
from psvideo.live.following.phase_filter import Measured, PhaseFilter, started
from psvideo.live.following.seen_share import LATEST, SeenShare
from psvideo.live.following.trims import Trims, trimmed
from psvideo.live.following.window import HeldFrame, Window, window_of
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat, FoundClock
from psvideo.sync.rowfit.coarse.seed import GOOD_SEED
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.steps_ahead import LEAST

State = Literal["seeking", "locked", "unsure", "lost"]
EVERY = 8
"""Frames between two corrections of the clock."""
LOOKED = 3
"""Frames that were not predicted until others are taken for missing before them."""
MOST_REPEATS = -LEAST
"""Frames in a row that may all show the moment of the one before them, as the finder has it: more are a still picture.
"""
ASTRAY, LEAST_ASTRAY_ROWS = 8.0, 0.1
"""A strobe that stands by more standard errors, and more rows, from where its clock has it is another one: one that was
started again. Where frames are missing it stands within 2 errors, else hardly ever within 15."""


UNIFORM = 12.0**-0.5
"""The standard deviation of what may be anywhere in a stretch, as a share of its length."""


@dataclass(kw_only=True)
class Follower:
    """Follows one lock. ``places`` says where its frames stand in time.

    ``measured`` is what windows of frames said of the clock, against the lock's own and at untrimmed times; ``span``
    the places in time of the first and the last frame that were followed; ``doubted_from`` is the place from which it
    is not known whether they show this strobe, None while it is locked.
    """

    plan: Plan
    lock: Lock
    beat: Beat
    phase: PhaseFilter
    window: Window
    state: State = "locked"
    places: FramePlaces = field(default_factory=FramePlaces)
    span: tuple[int, int] | None = None
    doubted_from: int | None = None
    measured: list[Measured] = field(default_factory=list)
    trims: Trims = field(default_factory=Trims)
    _learnt: Learnt | None = None
    _seen: SeenShare = field(default_factory=SeenShare)
    _odd: list[int] = field(default_factory=list)
    _fresh: int = 0
    _repeats: int = 0

    @property
    def clock(self) -> FoundClock:
        """The strobe's clock as it is known now."""
        return self.phase.clock

    @property
    def error_rows(self) -> float:
        """The standard error of the flashes' times at the latest frame, in rows; of a strobe that is held where no row
        shows its flashes, they may be anywhere in between."""
        at_s = self.phase.at_s if self.span is None else self.span[1] * self.window.period_s
        anywhere_s = unseen_s(self.plan, self.lock.camera, self.clock, at_s) if self.trims.at_s else 0.0
        return float(np.hypot(self.phase.error_at_s(at_s), anywhere_s * UNIFORM)) / self._row_s

    @property
    def _row_s(self) -> float:
        return self.beat.row_time_s or self.window.period_s / self.plan.camera.height_px

    @property
    def _beat_now(self) -> Beat:
        return replace(self.beat, clock=self.clock)

    def begin_at(self, place: int) -> None:
        """Begin what is followed at a place in time, where it began before that."""
        if self.span is not None:
            self.span = max(self.span[0], place), self.span[1]

    def trimmed(self, at_s: float, ppm: float) -> None:
        """Foresee that the strobe, from a time on, comes later by this many ppm of the time that passes."""
        since_s = self.window.frames[0].place * self.window.period_s if self.window.frames else at_s
        self.phase = trimmed(self.phase, self.trims, at_s, ppm, since_s=since_s)

    def add(self, number: int, value: Doubles, doubt: Doubles | None = None, *, same: bool = False) -> int:
        """Take in a frame by the source's number and return its place in time; ``value`` (row,) is its profile.

        ``same``: its codes are those of the frame before. A frame that comes twice is left out.
        """
        place = self.places.place_of(number)
        if self.window.frames and place <= self.window.frames[-1].place:
            return place
        if same and self._is_repeat(place):
            self._repeats += 1
            self.places = self.places.with_repeats(number)
            return self.window.frames[-1].place
        self.window.add(HeldFrame(place=place, value=value, doubt=doubt))
        self.span = (place if self.span is None else self.span[0], place)
        self._fresh += 1
        if self._learnt is not None and self.state != "lost":
            self._hold_against_foretold(self._learnt)
        if self._fresh >= EVERY and len(self.window.frames) >= LATEST:
            self._correct()
        return self.window.frames[-1].place

    def _is_repeat(self, place: int) -> bool:
        """Return whether a frame of the same codes as the one before was sent twice: that one was foretold, and is not
        what is foretold of this place. Where nothing is lit frames may be the same, and time goes on."""
        if self.state != "locked" or self._learnt is None or self._repeats >= MOST_REPEATS:
            return False
        before = self.window.frames[-1].place
        if before != place - 1 or before in self._odd:
            return False
        here = replace(self.window.profiles(1), index=np.array([place]))
        return self._learnt.are_odd(self._learnt.losses(here, self._beat_now))

    def _hold_against_foretold(self, learnt: Learnt) -> None:
        """Look for missing frames where the latest were not predicted, and else take the light for changed.

        A frame that was sent again may stand for another that was lost: then one is missing right after it.
        """
        latest, repeats = self.window.profiles(1), self._repeats
        self._repeats = 0
        if repeats and (lost := learnt.missing_before(latest, self._beat_now, most=repeats)):
            self._miss(int(latest.index[0]), lost)
            return
        if not learnt.are_odd(learnt.losses(latest, self._beat_now)):
            self._odd = self._odd[-LOOKED:] if self._odd and latest.index[0] - self._odd[-1] < LOOKED else []
            return
        self._odd.append(int(latest.index[0]))
        if len(self._odd) != LOOKED:
            return
        first = self._odd[0]
        missing = learnt.missing_before(self.window.profiles(self.window.count_from(first)), self._beat_now)
        if missing:
            self._miss(first, missing)
        elif not self.window.changes or first - self.window.changes[-1] > EVERY:
            self.window.changes.append(first)
            self._doubt(first)

    def _miss(self, first: int, count: int) -> None:
        """Take frames for missing before the one at the place ``first``."""
        self._moved(first, count, self.places.with_hole(first - self.places.late, count))
        self._odd = []

    def _moved(self, first: int, by: int, places: FramePlaces) -> None:
        """Put the frames from the place ``first`` on by so many places later."""
        self.places = places
        self.window.moved(first, by)
        self.span = (self.span or (0, 0))[0], self.window.frames[-1].place

    def _doubt(self, first: int) -> None:
        """Be not sure of the strobe from a place on, where that was not doubted before."""
        self.state = "unsure"
        self.doubted_from = first if self.doubted_from is None else self.doubted_from

    def _correct(self) -> None:
        """Move the clock by what the latest frames leave, and judge whether the strobe is still seen in them."""
        new, self._fresh = self._fresh, 0
        if self._no_hole():
            return
        rows, beat = self.window.profiles(), self._beat_now
        rest = unexplained(self.plan, rows, beat)
        self._judge(rows, rest)
        if self.state == "locked":
            at_s = float(rows.frame_start_s.mean())
            shift_s, error_s = late_by(self.plan, rows, beat, rest)
            trims_s = self.trims.doubt_s(self.trims.untrimmed_s(float(rows.frame_start_s[0])))
            error_s = float(np.hypot(error_s, trims_s) * np.sqrt(len(rows.value) / new))
            one = Measured(at_s=at_s, late_s=shift_s, error_s=error_s)
            untrimmed_s = self.trims.untrimmed_s(at_s)
            self.measured.append(replace(one, at_s=untrimmed_s, late_s=self._late_s(untrimmed_s) + shift_s))
            self.phase = self.phase.corrected(one)
        self._learn(rows)

    def _no_hole(self) -> bool:
        """Return whether the last hole is none, and lose the strobe then: behind it another one was started."""
        if not self.places.holes or self._learnt is None:
            return False
        hole, first = self.places.holes[-1], self.places.first_after_last_hole()
        since = self.window.count_from(first)
        if not EVERY <= since < len(self.window.frames) or not self._is_astray(self._learnt, since):
            return False
        self._moved(first, -hole.count, self.places.without_last_hole())
        self.state, self.doubted_from = "lost", first - hole.count
        return True

    def _is_astray(self, learnt: Learnt, latest: int) -> bool:
        """Return whether the strobe in the last frames stands elsewhere than its clock foretold."""
        rows = self.window.profiles(latest)
        late_s, error_s = learnt.late_by(rows, self._beat_now)
        error_s = float(np.hypot(error_s, self.phase.error_at_s(float(rows.frame_start_s.mean()))))
        return abs(late_s) > max(ASTRAY * error_s, LEAST_ASTRAY_ROWS * self._row_s)

    def _judge(self, rows: Profiles, rest: Doubles) -> None:
        """Judge whether the latest frames show the strobe where the clock has it, and as well as those before did.

        Right after a change of light nobody knows: new brightnesses explain a few frames wherever flashes are.
        """
        if self.state == "unsure" and self.window.since_change() < LATEST:
            return
        self._seen = self._seen.of_latest(rows, rest, self._learnt)
        good = self._seen.is_good(after_change=self.state != "locked")
        if good and (self.state == "locked" or not self._is_another()):
            self.state, self.doubted_from = "locked", None
            self._seen = self._seen.as_usual()
        elif self.state == "locked":
            self._doubt(int(rows.index[-LATEST]))
        else:
            self.state = "lost"

    def _is_another(self) -> bool:
        """Return whether what is seen after a doubt is not the strobe from before it, as far as is known yet."""
        begins = self.window.frames[-LATEST].place
        if self.state == "lost" and (self._seen.share <= GOOD_SEED or begins < (self.doubted_from or 0)):
            return True
        return self._learnt is not None and self._is_astray(self._learnt, LATEST)

    def _learn(self, rows: Profiles) -> None:
        """Fit brightnesses to the frames since the light last changed, once these show every light; not to frames that
        may show another strobe, for what is fitted to them explains them."""
        known = self.window.since_change()
        if self._learnt is not None and (known < LATEST or self.state != "locked"):
            return
        frames = rows.take(slice(len(rows.value) - known, len(rows.value))).one_window()
        self._learnt = learnt_from(self.plan, frames, self._beat_now)

    def _late_s(self, untrimmed_s: float) -> float:
        """Return by how much a flash comes later than the lock's own clock has it, trims left aside; the time is the
        one at which it would come without any trim."""
        base, now = self.lock.beat.clock, self.clock
        strobe_s = (untrimmed_s - base.phase_s) / base.rate
        return now.phase_s + strobe_s * now.rate - untrimmed_s


def following(plan: Plan, lock: Lock) -> Follower:
    """Return what follows the strobe from a lock on."""
    return Follower(
        plan=plan,
        lock=lock,
        beat=lock.beat,
        phase=started(lock.beat.clock, lock.at_s, lock.error_s, lock.error_ppm),
        window=window_of(plan, lock.beat),
    )
