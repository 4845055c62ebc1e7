"""Which flashes several cameras share, and how their clocks stand to each other for it.

Every camera finds the flashes on its own clock. The marker says where in the strobe's cycle a clip begins; clips that
run at the same time share flashes, so of all whole cycles that may lie between two clips only those are possible at
which they overlap. Where more than one is, nothing is chosen: the user must say roughly when the clips began.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from psvideo.errors import PsvideoError, UsageError
from psvideo.model.arrays import Doubles
from psvideo.model.camera_clocks import CameraClock, CameraClocks, Numbering
from psvideo.model.marker import cycle_places
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.model.units import MISNAMED_PPM, counted
from psvideo.strobe.as_played import CAMERA_CLOCK_PPM
from psvideo.sync.same_strobe import refuse_other_strobe, refuse_unnumbered

LEAST_SHARED = 8
"""Flashes that two clips must share: a rate from fewer says nothing."""
CLEAR = 4.0
"""Standard errors by which a drift, or another strobe, must show."""
LEAST_ERROR_S = 0.2e-6
"""No time is taken to be known better than so: shutters and LEDs are not."""
NEAR, HALF = 0.25, 0.5
"""A start that is given decides between cycles where it is off by less than the first share of one. Off by more than
the second it is nearer to another one, even where the clips share flashes in this one only."""


@dataclass(frozen=True, kw_only=True)
class CameraTake:
    """What one camera saw: its plan, and the timing that was found in its clip.

    ``numbers`` are those of all its frames, ascending, by which errors name them; None: their places in time.
    """

    plan: Plan
    timing: Timing
    numbers: tuple[int, ...] | None = None


def camera_clocks(takes: Sequence[CameraTake], *, starts_s: Sequence[float] | None = None) -> CameraClocks:
    """Return the cameras' clocks against the first one's.

    ``starts_s`` says roughly when every clip began, on any one clock: it decides where the marker leaves several whole
    cycles possible. Raises PsvideoError where the cameras saw different strobes, where a clip's strobe
    started again, where clips share too few flashes, and where which flashes they share is not known.
    """
    first = takes[0]
    for take in takes:
        refuse_other_strobe((first.plan, first.timing), (take.plan, take.timing))
        refuse_unnumbered(take.plan, take.timing, take.numbers)
    cycle_s = first.plan.cycle_s
    cameras, decided, notes = [], True, []
    for k, take in enumerate(takes):
        wanted_s = None if starts_s is None else starts_s[k] - starts_s[0]
        possible = _possible(first, take)
        decided &= len(possible) == 1
        number = _chosen(first, take, possible, wanted_s)
        cameras.append(_clock(first, take, number))
        notes += _notes(first.timing, take.timing, cameras[-1])
    numbering: Numbering = "marker" if decided else "given"
    return CameraClocks(
        cameras=tuple(cameras),
        numbering=numbering,
        cycle_s=cycle_s,
        first_instant_s=first.plan.camera.middle_s,
        notes=tuple(notes),
    )


def _slots(timing: Timing) -> list[int]:
    return [flash.slot for flash in timing.flashes]


def _possible(first: CameraTake, take: CameraTake) -> list[int]:
    """Return the numbers that a clip's flash 0 may have among the first clip's, where they share any flash.

    A cycle of two lights and a dark slot, of which the first clip saw 7 flashes and the other one 5. Its places in the
    cycle, 1 against 2, leave every third number, and of these only -2, 1 and 4 let both share any::

        first clip, 0 to 6:                b . a b . a b
        the other, its 0 at -5:  . a b . a                      shares none
                         at -2:        . a b . a                shares 3: b . a
                         at  1:              . a b . a          shares all 5
                         at  4:                    . a b . a    shares 3: . a b
    """
    cycle = len(first.plan.cycle_slots)
    counts = len(first.timing.flashes), len(take.timing.flashes)
    ours, theirs = (cycle_places(each.plan, _slots(each.timing)) for each in (first, take))
    apart = {(place - base) % cycle for place in theirs for base in ours}
    if first is take:
        return [0]
    return [number for number in range(1 - counts[1], counts[0]) if number % cycle in apart]


def _chosen(first: CameraTake, take: CameraTake, possible: Sequence[int], wanted_s: float | None) -> int:
    names = f"{take.timing.clip} and {first.timing.clip}"
    if len(possible) > 1 and wanted_s is None:
        choices = ", ".join(f"{began_s:+.3f}" for began_s in _began_s(first, take, possible[:6]))
        more = ", ..." if len(possible) > 6 else ""
        raise PsvideoError(
            f"{names}: the strobe repeats itself every {first.plan.cycle_s:.4g} s, so which flashes they share is not "
            f"certain: if both ran at the same time, {take.timing.clip} may have begun {choices}{more} s after "
            f"{first.timing.clip}; if not, they share none. Say roughly when each clip began, in seconds of any clock "
            f"(`starts_s`), or {_told_apart(first.plan)}."
        )
    if wanted_s is not None and possible:
        possible = [_nearest(first, take, possible, wanted_s)]
    shared = max(
        (_overlap(first, take, number)[1] - _overlap(first, take, number)[0] for number in possible), default=0
    )
    if shared < LEAST_SHARED:
        raise PsvideoError(
            f"{names} share {counted(shared, 'flash')}; expected {LEAST_SHARED} at least. Name clips that were "
            "recorded at the same time as the first one."
        )
    return possible[0]


def _told_apart(plan: Plan) -> str:
    """Say what makes cycles differ in a plan that is shot anew."""
    if plan.dark_code:
        return "record longer clips, or fewer lights, for which boards hold a longer code than this plan's"
    return "plan with a code (`marker` coded)"


def _nearest(first: CameraTake, take: CameraTake, possible: Sequence[int], wanted_s: float) -> int:
    """Return which of the possible numbers goes with the start that is given.

    Raises UsageError where none does: one that is nearer by a whole cycle is not among them, as the clips would share
    nothing; or where the start lies between two.
    """
    cycle_s = first.plan.cycle_s
    began_s = _began_s(first, take, possible)
    nearest = int(np.abs(began_s - wanted_s).argmin())
    number, nearest_s = possible[nearest], float(began_s[nearest])
    said = f"`starts_s`: {take.timing.clip} is said to begin {wanted_s:+.3f} s after {first.timing.clip}"
    if abs(nearest_s - wanted_s) > HALF * cycle_s:
        raise UsageError(
            f"{said}, and then they share no flashes: only clips that ran at the same time do. By what the flashes "
            f"show, with a cycle of {cycle_s:.4g} s, the nearest start at which they would is {nearest_s:+.3f} s. Name "
            "clips that ran at the same time as the first one, or give other starts."
        )
    if len(possible) > 1 and abs(nearest_s - wanted_s) > NEAR * cycle_s:
        raise UsageError(
            f"{said}, and the nearest that the flashes allow is {nearest_s:+.3f} s; with a cycle of {cycle_s:.4g} s "
            f"that decides nothing. Give starts that are right to a fifth of a cycle, or {_told_apart(first.plan)}."
        )
    return number


def _began_s(first: CameraTake, take: CameraTake, numbers: Sequence[int]) -> Doubles:
    """Return how long after the first clip another began, were its flash 0 the first clip's flash of each of some
    possible ``numbers``: (number,), in seconds of the first camera.

    A flash that the first clip saw is where it was found. Those before it follow from the strobe's rate on that clock:
    100 ppm are 30 ms in five minutes, most of a cycle.
    """
    found_s, before = first.timing.start_s, max(0, -min(numbers))
    place = cycle_places(first.plan, _slots(first.timing))[0]
    strobe_s = first.plan.train(place - before, before + len(found_s)).start_s
    rate = np.polyfit(strobe_s[before:] - strobe_s[before], found_s, 1)[0] if len(found_s) > 1 else 1.0
    early_s = found_s[0] + rate * (strobe_s[:before] - strobe_s[before])
    began_s: Doubles = np.concatenate([early_s, found_s])[before + np.asarray(numbers)] - take.timing.flashes[0].start_s
    return began_s


def _overlap(first: CameraTake, take: CameraTake, number: int) -> tuple[int, int]:
    """Return the first clip's flashes that both saw, as a range."""
    return max(0, number), min(len(first.timing.flashes), number + len(take.timing.flashes))


def _clock(first: CameraTake, take: CameraTake, number: int) -> CameraClock:
    begin, end = _overlap(first, take, number)
    reference_s = first.timing.start_s[begin:end]
    camera_s = take.timing.start_s[begin - number : end - number]
    known_s = float(np.hypot(first.timing.phase_error_s or 0.0, take.timing.phase_error_s or 0.0))
    error_s = 0.0 if first is take else max(known_s, LEAST_ERROR_S)
    ahead_s = reference_s - camera_s
    fit = np.polynomial.Polynomial.fit(camera_s, ahead_s, 1)
    if _rms_s(fit(camera_s) - ahead_s) > error_s:
        bent = np.polynomial.Polynomial.fit(camera_s, ahead_s, 2)
        fit = bent if _rms_s(bent(camera_s) - ahead_s) < 0.5 * _rms_s(fit(camera_s) - ahead_s) else fit
    left_s = _rms_s(fit(camera_s) - ahead_s)
    if left_s > CLEAR * error_s:
        raise PsvideoError(
            f"{take.timing.clip} and {first.timing.clip} do not follow one clock: their flashes are "
            f"{left_s * 1e6:.3g} us off a steady drift, and known to {error_s * 1e6:.2g} us. Did the "
            "cameras see different strobes, or does a clip lack frames that its timing does not list?"
        )
    powers = (*fit.convert().coef, 0.0, 0.0)
    return CameraClock(
        clip=take.timing.clip,
        first_flash=number,
        offset_s=float(powers[0]),
        rate_ppm=float(powers[1]) * 1e6,
        drift_ppm_per_s=2e6 * float(powers[2]),
        shared=end - begin,
        error_s=float(np.hypot(error_s, left_s)),
    )


def _rms_s(times_s: np.ndarray) -> float:
    return float(np.sqrt(np.mean(times_s**2)))


def _notes(first: Timing, timing: Timing, clock: CameraClock) -> list[str]:
    """Say where clocks are further apart than cameras' are. Raises PsvideoError where no frame rate explains it."""
    apart = abs(clock.rate_ppm)
    if apart <= 2 * CAMERA_CLOCK_PPM:
        return []
    told = f"{timing.clip} and {first.clip}: their clocks are {clock.rate_ppm:+.0f} ppm apart"
    if abs(apart - MISNAMED_PPM) <= 2 * CAMERA_CLOCK_PPM:
        return [f"{told}: one plan's frame rate is probably misnamed by 1.001 (24 for 23.976)."]
    raise PsvideoError(
        f"{told}, and cameras' clocks are within {2 * CAMERA_CLOCK_PPM:g} ppm of each other. The cameras saw different "
        "strobes, or a plan's frame rate is wrong."
    )
