"""From row profiles to the clip's times: seed, track, sharpen, and set free what the plan does not know exactly."""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.camera import FloatArray
from psvideo.plan import UNKNOWN_CLOCK_PPM, Plan
from psvideo.rowfit.beat import Beat, StrobeClock
from psvideo.rowfit.bend import LEAST_WINDOWS, bend
from psvideo.rowfit.jitter import Jitter, jitter, shift_error_s
from psvideo.rowfit.profiles import Profiles, unexplained
from psvideo.rowfit.refine import Fit, clearest, explained, refine, robust_loss, scaled
from psvideo.rowfit.search import search
from psvideo.rowfit.track import Track, frame_losses, settled, track

SEARCH_ROWS = 36
TRACK_ROWS = 60
COARSE_ROWS = 288
SEED_FRAMES = 48
MISNAMED_PPM = 1100.0
"""The search reaches this far at least, so that a frame rate misnamed by 1.001 is found."""
ENOUGH_SAMPLES = 250_000
"""Row means that the last fit needs; a clip that has more gets its rows averaged, which bounds memory and time."""
FLASH_ROWS = 8
"""Rows that a flash must still span after that."""
GOOD_SEED, FAIR_SEED = 0.7, 0.3
"""A seed that takes away this share of the robust loss is taken at once; one that takes away less calls for a wider
search."""
CLEAR = 5.0
"""A time leaves the plan's value only when it is off by so many standard errors."""
BETTER, LEAST_GAIN = 1e-3, 30.0
"""And only where that takes away such a share of the robust loss, and so much of it: a subject that moves in step with
the dark row bends errors and estimates alike."""
SURER = 0.8
"""Share of the standard error that must be left before brightnesses are fitted anew in windows half as long."""
SOFT_ROWS, ALIKE, SOFT_GAIN = 1.5, 1.5, 0.08
"""Edges soft by less than so many rows, alike (within a factor) at a flash's start and end, may as well be rows that
compression or scaling has blurred: flashes are moved for it only where that takes away such a share of the robust loss
(H.264 makes up 0.02 to 0.05 of it, tails of a row 0.1 to 0.5)."""
MOST_WINDOWS = 400
MAINS_HZ = (100.0, 120.0)
FLICKERS = 0.8
"""Flicker is believed where it leaves less than this share of the squares that are left without it, and less than this
share of what frequencies that mains do not have leave: where many rows saturate, anything that swings explains much."""
OTHER_SWINGS = (-2.5, -1.5, 1.5, 2.5)
"""Frequencies tried instead, as swings more or fewer in a window: near enough to be alike, far enough to be told."""


@dataclass(frozen=True, kw_only=True)
class Found:
    """The fit of a whole clip: its rows with the times that their frames truly have, and which frames are repeats.

    ``steps`` counts the places where frames follow otherwise than the numbering tells; ``soft_s`` is how soft the edges
    are where that was not taken for LEDs' tails, else 0.
    """

    fit: Fit
    rows: Profiles
    track: Track
    jitter: Jitter
    steps: int
    soft_s: float = 0.0


def find(plan: Plan, rows: Profiles) -> Found:
    """Return the times of a clip; ``Fit.explained`` tells how well they explain it."""
    seed, frames = find_seed(plan, rows)
    if seed.upward:
        rows = rows.turned()
    window = window_frames(plan)
    memory = max(window, int(1.2 * plan.cycle_s / rows.period_s))
    tracked = track(plan, rows.binned(TRACK_ROWS), seed, frames, memory=memory)
    told = np.diff(rows.index)
    tracked = replace(tracked, beat=replace(tracked.beat, clock=_clock_of(plan, tracked)))
    tracked = replace(tracked, index=settled(plan, rows.binned(TRACK_ROWS), tracked.index, tracked.beat))
    keep = ~tracked.repeated
    rows = replace(
        rows,
        value=np.ascontiguousarray(rows.value[keep]),
        index=tracked.index[keep],
        doubt=None if rows.doubt is None else np.ascontiguousarray(rows.doubt[keep]),
    ).windowed(window)
    fine = rows.binned(_rows_needed(plan, rows, seed))
    free: tuple[str, ...] = () if plan.camera.readout_s is not None else ("row_time_s",)
    fit = _with_flicker(plan, fine, _fit(plan, fine, tracked.beat, free), free)
    fine, fit, apart_s = _in_short_windows(plan, fine, fit, free)
    freed, soft_s = _believed(plan, fine, fit, free)
    if freed is not fit:
        apart_s = _window_error_s(plan, fine, freed)
    fit = freed
    steps = int((np.diff(tracked.index) != told).sum())
    stray = jitter(plan, fine, fit)
    known_s = max(fit.shift_error_s, shift_error_s(plan, fine, fit))
    error_s = float(np.sqrt(known_s**2 + stray.error_s**2 + apart_s**2))
    fit = replace(fit, shift_error_s=error_s)
    return Found(fit=fit, rows=fine, track=tracked, jitter=stray, steps=steps, soft_s=soft_s)


def _rows_needed(plan: Plan, rows: Profiles, beat: Beat) -> int:
    """Return to how many rows a clip may be averaged without blurring its flashes."""
    shortest_s = min(plan.flashes[slot].duration_s for slot in plan.lit_slots)
    sharp = int(FLASH_ROWS * beat.row_time_s * len(rows.place) / shortest_s)
    return max(COARSE_ROWS, ENOUGH_SAMPLES // len(rows.value), sharp)


def window_frames(plan: Plan) -> int:
    """Return how many frames see every light several times."""
    return max(24, 6 * (len(plan.lit_slots) + 1))


def first_guess(plan: Plan) -> Beat:
    camera = plan.camera
    readout_s = camera.readout_s or 0.0
    return Beat(
        clock=StrobeClock(phase_s=0.0, offset_ppm=0.0),
        row_time_s=abs(readout_s) / camera.height_px,
        exposure_s=camera.exposure_s,
        upward=readout_s < 0,
        rise_s=plan.rise_s,
        fall_s=plan.fall_s,
    )


def find_seed(plan: Plan, rows: Profiles) -> tuple[Beat, slice]:
    """Search some stretches of the clip and return the beat that explains one of them best, and that stretch."""
    guess = first_guess(plan)
    range_ppm = max(plan.clock_range_ppm, MISNAMED_PPM)
    best: tuple[float, Beat, slice] | None = None
    for frames in _stretches(plan, rows):
        for reach in dict.fromkeys((range_ppm, UNKNOWN_CLOCK_PPM)):
            beat, share = _seeded(plan, rows.take(frames), guess, reach)
            if best is None or share > best[0]:
                best = share, beat, frames
            if best[0] > FAIR_SEED:
                break
        if best is not None and best[0] > GOOD_SEED:
            break
    assert best is not None  # noqa: S101
    return best[1], best[2]


def _stretches(plan: Plan, rows: Profiles) -> list[slice]:
    """Return the stretches to look at: a cycle and a half, so that the marker is among them, then shorter ones."""
    frames = len(rows.value)
    length = min(frames, max(SEED_FRAMES, int(1.5 * plan.cycle_s / rows.period_s) + 2))
    starts = [0, (frames - length) // 2, frames - length]
    short = min(frames, max(24, length // 2))
    more = [(frames - short) // 4, (frames - short) * 3 // 4, 0]
    spans = [(start, length) for start in starts] + [(start, short) for start in more]
    return [slice(start, start + count) for start, count in dict.fromkeys(spans)]


def _seeded(plan: Plan, rows: Profiles, guess: Beat, range_ppm: float) -> tuple[Beat, float]:
    """Search one stretch and sharpen the best places found; return the best and what it explains."""
    known = plan.camera.readout_s is not None
    turned = rows.turned() if guess.upward else rows
    places = search(plan, turned.binned(SEARCH_ROWS), range_ppm=range_ppm, start=guess, readout_known=known, keep=3)
    free = () if known else ("row_time_s",)
    tried = []
    for place in places:
        if place.loss > 1.5 * places[0].loss:
            continue
        part = rows.turned() if place.beat.upward else rows
        part = part.binned(COARSE_ROWS // 2)
        fit = refine(plan, part, place.beat, free=free, steps=6)
        tried.append((gain_of(part, unexplained(plan, part, fit.beat)), fit.beat))
    share, beat = max(tried, key=lambda pair: pair[0])
    return beat, share


def gain_of(rows: Profiles, rest: FloatArray) -> float:
    """Return which share of the robust loss that each row's mean leaves in every window a fit takes away."""
    bounds = np.append(rows.window_start, len(rows.value))
    means = np.repeat(
        np.add.reduceat(rows.value, rows.window_start) / np.diff(bounds)[:, None], np.diff(bounds), axis=0
    )
    before = float(frame_losses(rows, rows.value - means).mean())
    return 1.0 - float(frame_losses(rows, rest).mean()) / max(before, 1e-12)


def _clock_of(plan: Plan, tracked: Track) -> StrobeClock:
    """Return a straight clock through the track's anchors, or a bent one where they stray from it."""
    clock = tracked.beat.clock
    if len(tracked.at_s) < 2:
        return clock
    line = np.polyfit(tracked.at_s, tracked.late_s, 1)
    stray_s = tracked.late_s - np.polyval(line, tracked.at_s)
    pivot_s = float(tracked.at_s.mean())
    straight = clock.shifted(float(np.polyval(line, pivot_s)), 1e6 * float(line[0]), pivot_s=pivot_s)
    shortest_s = min(plan.flashes[slot].duration_s for slot in plan.lit_slots)
    if np.median(np.abs(stray_s)) < 0.02 * shortest_s:
        return straight
    return straight.bent(tracked.at_s, stray_s)


def _in_short_windows(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> tuple[Profiles, Fit, float]:
    """Fit brightnesses anew more often where the subject moves so much that this makes the times surer.

    Return too how far apart the times are with and without: an error that neither of the two fits can know of.
    """
    short = rows.windowed(max(window_frames(plan) // 2, len(rows.value) // MOST_WINDOWS))
    other = _fit(plan, short, fit.beat, free)
    apart_s = float(np.sqrt(np.mean(_apart_s(rows, fit.beat, other.beat) ** 2)))
    taken, better = (short, other) if other.shift_error_s < SURER * fit.shift_error_s else (rows, fit)
    return taken, better, apart_s


def _window_error_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return how far apart the times are when brightnesses are fitted anew twice as often."""
    twice = rows.windowed(max(len(rows.value) // (2 * len(rows.window_start)), 1))
    other = _fit(plan, twice, fit.beat, tuple(fit.errors_s))
    return float(np.sqrt(np.mean(_apart_s(rows, fit.beat, other.beat) ** 2)))


def _apart_s(rows: Profiles, one: Beat, other: Beat) -> FloatArray:
    """Return how far two clocks are apart at the windows' ends, shape (window + 1,)."""
    strobe_s = (rows.ends_s - one.clock.phase_s) / one.clock.rate
    straight_s = other.clock.phase_s + strobe_s * other.clock.rate
    apart_s: FloatArray = straight_s + other.clock.bend(straight_s) - rows.ends_s - one.clock.bend(rows.ends_s)
    return apart_s


def _believed(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> tuple[Fit, float]:
    """Let go of what the picture tells otherwise, but of tails only where blurred rows do not look the same.

    Return too how soft the edges are where that was not taken for tails. A tail moves the start of its flash by as much
    as it is long, a blur does not: where both would do, a wrong tail is worse.
    """
    names = _may_differ(plan)
    freed = _freed(plan, rows, fit, free, names)
    short_s, long_s = sorted((freed.beat.rise_s, freed.beat.fall_s))
    given = plan.rise_s > 0 or plan.fall_s > 0
    if given or short_s == 0 or long_s > min(ALIKE * short_s, SOFT_ROWS * freed.beat.row_time_s):
        return freed, 0.0
    before = robust_loss(rows, fit.rest, fit.rest)
    if before - robust_loss(rows, freed.rest, fit.rest) > SOFT_GAIN * before:
        return freed, 0.0
    others = tuple(name for name in names if name not in ("rise_s", "fall_s"))
    return _freed(plan, rows, fit, free, others), long_s


def _freed(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...], may_differ: tuple[str, ...]) -> Fit:
    """Let go of the plan's values where the picture clearly tells otherwise, one after another, the clearest first."""
    refused: set[str] = set()
    while True:
        names = tuple(name for name in may_differ if name not in free and name not in refused)
        name = clearest(plan, rows, fit, free, names, at_least=LEAST_GAIN)
        if name is None:
            return fit
        tried = _fit(plan, rows, fit.beat, (*free, name))
        before = robust_loss(rows, fit.rest, fit.rest)
        gain = before - robust_loss(rows, tried.rest, fit.rest)
        off_s = abs(getattr(tried.beat, name) - getattr(fit.beat, name))
        if gain > max(BETTER * before, LEAST_GAIN) and off_s > CLEAR * tried.errors_s[name]:
            fit, free = tried, (*free, name)
        else:
            refused.add(name)


def _fit(plan: Plan, rows: Profiles, beat: Beat, free: tuple[str, ...]) -> Fit:
    if beat.clock.knot_s and len(rows.window_start) >= LEAST_WINDOWS:
        rest = unexplained(plan, rows, beat)
        rough = Fit(
            beat=beat,
            rest=rest,
            weight=scaled(rows, rest, 0.0) ** -2.0,
            shift_error_s=0.0,
            errors_s={},
            explained=explained(rows, rest),
        )
        return bend(plan, rows, rough, free=free)
    straight = replace(beat, clock=replace(beat.clock, knot_s=(), bend_s=()))
    return bend(plan, rows, refine(plan, rows, straight, free=free), free=free)


def _may_differ(plan: Plan) -> tuple[str, ...]:
    names = ("exposure_s", "row_time_s", "rise_s", "fall_s")
    return names if plan.camera.readout_s != 0 else tuple(name for name in names if name != "row_time_s")


def _with_flicker(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> Fit:
    """Try ambient light that flickers with the mains, and keep it where it explains much of what is left."""

    def left(hz: float) -> float:
        beat = replace(fit.beat, beat_hz=(hz,))
        return float((fit.weight * unexplained(plan, rows, beat, fit.weight) ** 2).sum())

    hz = min(MAINS_HZ, key=left)
    least = left(hz)
    if least > FLICKERS * fit.loss:
        return fit
    window_s = float(np.median(np.diff(rows.ends_s)))
    if least > FLICKERS * float(np.median([left(hz + swings / window_s) for swings in OTHER_SWINGS])):
        return fit
    return _fit(plan, rows, replace(fit.beat, beat_hz=(hz,)), free)
