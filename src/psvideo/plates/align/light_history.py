"""What is held of each light while plates come in: sketches of the last rounds, and plates as long as they are needed.

Plates are most of a run's memory: one is released as soon as no instant, of those that wait and those to come, can be
made from it, and packed once it was found to move. Sketches are a fiftieth of that, and stay a round longer.

Three lights a, b, c in three rounds, and the instant ``*`` of the second one, at its middle:

    a1   b1   c1      a2   b2   c2      a3   b3   c3
                           *
    a: from a2 and a3        b: b2, as it is        c: from c1 and c2

So c is made once c2 is there, and a waits for a3. It need not wait where nothing moves: c1 and c2 are alike, so nothing
moved until c2, and a2 serves as it is (``_stood``). Where c1 is missing, c would wait for c3: not where a2 and a3 are
alike (``_rests``). c2 is held for the instant of round 3, until that round's first lights show that nothing moved
since (``_stands_on``).
"""

from collections import deque
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from psvideo.model.arrays import Flags, Floats
from psvideo.plates.align.packed import PutBy, packed
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.velocity.brightness import evened
from psvideo.plates.align.velocity.flow import Changes, Sketch, changes, sketch_of, white_of
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.align.velocity.own_flow import OwnFlows
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.sequence import POOLED_ROUNDS

BESIDE = 9
"""What moves is found up to half as many blocks beside those that changed."""


@dataclass(frozen=True, kw_only=True)
class Shot:
    """A light in one round: what flow sees of it, None where no flow is asked for; and its plate, while it is held."""

    round: int
    time_s: float
    sketch: Sketch | None
    plate: LightPlate | None


@dataclass(frozen=True, kw_only=True)
class Around:
    """The shots of a light, one round apart, that lie around an instant or nearest to it; twice the same where there is
    only one, or where it shows that very instant."""

    before: Shot
    after: Shot

    def share(self, time_s: float) -> float:
        """Return how far the nearer of two shots is from an instant, as a share of what lies between them."""
        spans_s = abs(time_s - self.before.time_s), abs(self.after.time_s - time_s)
        return min(spans_s) / abs(self.after.time_s - self.before.time_s)

    def nearest(self, time_s: float) -> LightPlate:
        """Return the plate that is nearest in time, of those that are held."""
        held = [shot for shot in (self.before, self.after) if shot.plate is not None]
        plate = min(held, key=lambda shot: abs(shot.time_s - time_s)).plate
        if plate is None:
            raise ValueError("an instant needs at least one of its two plates")
        return plate


@dataclass(kw_only=True)
class DueInstant:
    """An instant that is to be shown, of a round, and the lights' plates at it that are made already; ``moving``
    are the lights that were found to move and wait for each other, ``motion`` how, once it was found, and ``unsure`` by
    how much their plates may be off for it.
    ``guessed``: what is doubtful is shown as it most likely is, for nothing is measured in it."""

    number: int
    time_s: float
    round: int
    made: dict[str, LightPlate] = field(default_factory=dict)
    moving: set[str] = field(default_factory=set)
    motion: Followed | None = None
    unsure: Floats | None = None
    guessed: bool = False


@dataclass(kw_only=True)
class Held:
    """The shots of every light by round, and the instants that wait for later ones.

    ``sketched`` says whether flow is asked for, ``keep_all`` whether instants lie at every flash, ``trusts_rest``
    whether lights that show nothing move speak for the others, and ``with_ambient`` whether dark slots come. ``newest``
    is the round that plates come of, ``whole`` the last one that was complete (None before any was), and ``middle_s``
    its middle. ``motion`` says by light and round what was compared with the round before, and where it had moved;
    ``drift`` where it had since the ``first`` sketch of a light in a block of rounds that are pooled. ``put_by`` takes
    codes of packed plates. ``own_flows`` are those of the plates around the last instant of which nothing is measured.
    ``lamps`` is how the lights shine, None where that is not known. ``coded``: plates are made of a movie's frames.
    """

    lights: tuple[str, ...]
    sketched: bool
    keep_all: bool
    trusts_rest: bool
    with_ambient: bool
    whites: dict[str, float] = field(default_factory=dict)
    put_by: PutBy | None = None
    lamps: Lamps | None = None
    coded: bool = False
    shots: dict[str, dict[int, Shot]] = field(default_factory=dict)
    waiting: deque[DueInstant] = field(default_factory=deque)
    ambient: dict[int, LightPlate] = field(default_factory=dict)
    motion: dict[tuple[str, int], Changes] = field(default_factory=dict)
    drift: dict[tuple[str, int], Flags] = field(default_factory=dict)
    first: dict[str, Sketch] = field(default_factory=dict)
    own_flows: OwnFlows = field(default_factory=OwnFlows)
    newest: int = 0
    whole: int | None = None
    middle_s: float = 0.0
    ended: bool = False

    def take(self, plate: LightPlate) -> dict[str, float] | None:
        """Hold one more plate; return the times of its round's plates where it was the last that this lacked."""
        self.newest = plate.number
        if plate.light not in self.lights:
            self.ambient[plate.number] = plate
            return None
        sketch = None
        if self.sketched:
            if plate.light not in self.whites:
                self.whites[plate.light] = white_of(plate)
            sketch = sketch_of(plate, white=self.whites[plate.light], coded=self.coded)
            self._look_for_drift(plate.light, sketch)
        shot = Shot(round=plate.number, time_s=plate.time_s, sketch=sketch, plate=plate)
        self.shots.setdefault(plate.light, {})[plate.number] = shot
        times_s = {
            light: self.shots[light][plate.number].time_s
            for light in self.lights
            if plate.number in self.shots.get(light, {})
        }
        if len(times_s) < len(self.lights):
            return None
        self.whole, self.middle_s = plate.number, float(np.mean(list(times_s.values())))
        return times_s

    def _look_for_drift(self, light: str, sketch: Sketch) -> None:
        """Hold a sketch against the first one of its block of rounds, from the second after that on."""
        if sketch.number % POOLED_ROUNDS == 0:
            self.first[light] = sketch
        elif (first := self.first.get(light)) is not None and 1 < sketch.number - first.number < POOLED_ROUNDS:
            self.drift[light, sketch.number] = changes(first, evened(first, sketch)).stirred

    def around(self, light: str, instant: DueInstant) -> Around | None:
        """Return what a light's plate at an instant is made from; None where that is still to come."""
        before, own, after = (self.shots[light].get(instant.round + step) for step in (-1, 0, 1))
        if own is None or own.plate is None:
            raise ValueError(f"light {light} of round {instant.round} is gone before instant {instant.number} is made")
        if own.time_s == instant.time_s:
            return Around(before=own, after=own)
        if before is not None and own.time_s > instant.time_s:
            return Around(before=before, after=own)
        if self._stood(instant):
            return Around(before=own, after=own)
        if after is not None:
            return Around(before=own, after=after)
        if not (self.ended or self.newest > instant.round + 1 or self._rests(instant)):
            return None
        return Around(before=before or own, after=own)

    def sure_around(self, light: str, instant: DueInstant) -> Around:
        """Return what a light's plate at an instant is made from, which is there. Raises ValueError where it is not."""
        around = self.around(light, instant)
        if around is None:
            raise ValueError(f"light {light} of instant {instant.number} is still to come")
        return around

    def pair_around(self, light: str, instant: DueInstant) -> tuple[Shot, Shot] | None:
        """Return a light's shots before and after an instant, one of which may show it, whether or not anything moved
        between them, or twice that one where there is no other; None where there is none."""
        shots, own = self.shots[light], self.shots[light][instant.round]
        other = shots.get(instant.round + (-1 if own.time_s >= instant.time_s else 1))
        if other is None:
            return (own, own) if own.time_s == instant.time_s else None
        return (other, own) if other.time_s < own.time_s else (own, other)

    def own_shot(self, light: str, instant: DueInstant) -> Shot:
        """Return a light's shot in an instant's round, with the plate that was handed on from there to be shown."""
        shot, made = self.shots[light][instant.round], instant.made.get(light)
        return shot if made is None else replace(shot, plate=replace(made, number=shot.round, time_s=shot.time_s))

    def take_back(self, light: str, instant: DueInstant) -> None:
        """Hold a light's plate again that was handed on as it is: its picture is to be moved after all."""
        self.shots[light][instant.round] = self.own_shot(light, instant)
        del instant.made[light]
        instant.moving.add(light)

    def plates_of(self, instant: DueInstant) -> list[LightPlate]:
        """Return the plates of lights under which something moves that an instant is made from, of those held."""
        around = [self.sure_around(light, instant) for light in instant.moving]
        return [shot.plate for one in around for shot in (one.before, one.after) if shot.plate is not None]

    def moved_since(self, light: str, round_number: int) -> bool | None:
        """Return whether a light's plate shows motion since that of the round before; None where one of them is not
        there or no flow is asked for."""
        key, shots = (light, round_number), self.shots.get(light, {})
        if key not in self.motion:
            before, own = shots.get(round_number - 1), shots.get(round_number)
            if before is None or own is None or before.sketch is None or own.sketch is None:
                return None
            self.motion[key] = changes(before.sketch, evened(before.sketch, own.sketch))
        return bool(self.motion[key].moved.any())

    def stood(self, number: int) -> Flags | None:
        """Return where nothing changed since the round before, nor since the first of its block, under any light, nor
        until the next round as far as that was looked at; None where any light was not compared."""
        if any(self.moved_since(light, number) is None for light in self.lights):
            return None
        moved = np.any(self._stirred(number), axis=0)
        return ~moved if moved.any() else np.ones((1, 1), np.bool_)

    def calm(self, number: int) -> Flags | None:
        """Return where nothing changed in a round by more than a codec leaves, nor beside it, as far as any light was
        compared; None where no codec makes plates differ."""
        stirred = self._stirred(number) if self.coded else []
        if not stirred:
            return None
        around = cv2.dilate(np.any(stirred, axis=0).astype(np.uint8), np.ones((BESIDE, BESIDE), np.uint8))
        return np.asarray(around == 0, np.bool_)

    def _stirred(self, number: int) -> list[Flags]:
        """Return what was stirred since the round before, until the next one, and since the first of the block, under
        every light of which that is known."""
        seen = [self.motion.get((light, other)) for light in self.lights for other in (number, number + 1)]
        drifts = [self.drift[light, number] for light in self.lights if (light, number) in self.drift]
        return [one.stirred for one in seen if one is not None] + drifts

    def _stood(self, instant: DueInstant) -> bool:
        """Return whether nothing moved in an instant's round: no light shows motion since the round before, and all
        those after the instant, one at least, were compared. So nothing began to move before the last of them.

        The lights before the instant need not wait for the next round then.
        """
        if not self.trusts_rest:
            return False
        since = {light: self.moved_since(light, instant.round) for light in self.lights}
        late = [light for light in self.lights if self.shots[light][instant.round].time_s > instant.time_s]
        return bool(late) and not any(since.values()) and all(since[light] is False for light in late)

    def _stands_on(self) -> bool:
        """Return whether the lights in the first half of a round all show that nothing moved since the round before,
        which was the last whole one: of that, nothing is needed any more."""
        whole = self._last_whole()
        early = [light for light in self.lights if self.shots[light][whole].time_s <= self.middle_s]
        since = [self.moved_since(light, whole + 1) for light in early]
        return self.trusts_rest and bool(since) and all(one is False for one in since)

    def _rests(self, instant: DueInstant) -> bool:
        """Return whether all lights before an instant, one at least, were compared with the next round, and none moves.

        The lights after it, of which the round before lacks plates, need not wait for the next round then.
        """
        early = [light for light in self.lights if self.shots[light][instant.round].time_s < instant.time_s]
        seen = self.newest > instant.round and all(light in instant.made for light in early)
        return self.trusts_rest and bool(early) and seen and not instant.moving

    def lacks_ambient(self, instant: DueInstant) -> bool:
        """Return whether a round's dark slot is wanted and may still come."""
        return self.with_ambient and not (self.ended or self.newest > instant.round or instant.round in self.ambient)

    def _last_whole(self) -> int:
        """Return the last round that was complete; before there is one, the round that plates come of."""
        return self.newest if self.whole is None else self.whole

    def let_go(self) -> None:
        """Forget what no instant can be made from: none of those that wait, nor of rounds to come."""
        oldest = min([self.newest, self._last_whole(), *(one.round for one in self.waiting)]) - 1
        for number in [number for number in self.ambient if number <= oldest]:
            del self.ambient[number]
        for seen in (self.motion, self.drift):
            for key in [key for key in seen if key[1] < oldest]:
                seen.pop(key)
        for light, shots in self.shots.items():
            near = {number for one in self.waiting if light not in one.made for number in self._rounds_of(light, one)}
            for number, shot in list(shots.items()):
                if number < oldest:
                    del shots[number]
                elif shot.plate is not None and number not in near and not self._is_for_later(shot):
                    shots[number] = replace(shot, plate=None)

    def _rounds_of(self, light: str, instant: DueInstant) -> tuple[int, int]:
        """Return the rounds whose plates of a light an instant is made from; at the clip's end the first is enough."""
        late = self.shots[light][instant.round].time_s > instant.time_s
        before = late and instant.round - 1 in self.shots[light]
        return instant.round, instant.round - 1 if before else instant.round + 1

    def pack(self, light: str, around: Around) -> None:
        """Hold the plates around an instant, which moved, in less memory: none of them will pass as it is."""
        shots = self.shots[light]
        for shot in (around.before, around.after):
            if (plate := shot.plate) is not None:
                smaller = replace(plate, picture=packed(plate.picture, plate.saturation, self.put_by))
                shots[shot.round] = replace(shot, plate=smaller)

    def _is_for_later(self, shot: Shot) -> bool:
        """Return whether a plate may serve an instant of a round that is not complete yet."""
        coming = self.newest if self.whole is None or self.newest > self.whole else self.newest + 1
        if shot.round < coming - 1:
            return False
        if self.keep_all or shot.round != self.whole:
            return True
        return shot.time_s > self.middle_s and not self._stands_on()
