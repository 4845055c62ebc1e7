"""Whether a fit is to be believed, and the fit of the plan that was meant where the one given is wrong by far."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.coarse.seed import LEAST_REACH_PPM, Seed, gain_of
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.fit import ClipFit, find
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import refined_beat, robust_loss
from psvideo.sync.rowfit.standard_error import freedom
from psvideo.sync.rowfit.tracking.course import too_many
from psvideo.sync.rowfit.whatever_moves import contradicts, placed_fit, sure_place
from psvideo.sync.verdict.elsewhere import fits_elsewhere
from psvideo.sync.verdict.few_kinds import shows_the_same
from psvideo.sync.verdict.refusal import MOST_PPM
from psvideo.sync.verdict.rivals import (
    BETTER,
    CLEARLY,
    FAIR,
    Rival,
    best_rival,
    camera_rivals,
    double_rivals,
    strobe_rivals,
)

MIN_EXPLAINED, MIN_GAIN = 0.5, 0.3
"""A fit that explains less of the rows' changes, or takes less of the robust loss away, has not found a strobe."""
ACROSS = 0.5
"""But where the subject moves so much that flashes of one light differ, what counts is that flashes at other times
would leave so much more of what split ones show."""
LUCK = 0.25
"""Share of noise that the best place of a search explains beyond what brightnesses do anywhere."""
LOST = 0.5
"""Times whose standard error is more than this share of the shortest flash are not found."""
UNSURE_GAIN, UNSURE = 0.7, 0.1
"""A fit that takes less of the robust loss away, or is unsure by this share of a flash, is worth a second look."""
ADRIFT = 0.25
"""One that takes less of it away and is unsure by this share of a flash has found no strobe."""
MOVED = 0.05
"""So is one that had to move the exposure or the readout by more than this share."""
STILL = 0.9
"""A shutter other than the plan's is believed where it takes away this share of the robust loss, as it does unless the
subject moves."""
GAPPED = 0.8
"""A fit that needs frames to be missing and explains less than this share of the changes is worth one, too."""
EXCUSES = 2
"""A fit with this many excuses (missing frames, a clock beyond the plan's tolerance) must explain more."""
EXCUSED = 0.5
"""One whose only excuse is the clock must take this share of the robust loss away, or say what split flashes show: of
footage that was turned by 90 degrees a strobe of -4900 ppm takes 0.34 away, with all flashes 1.9 ms off."""
OTHER_LENGTHS = (0.5, 0.7, 1.4, 2.0)
LENGTH_FRAMES, LENGTH_ROWS, ROWS_EACH = 200, 48, 4
"""Frames and rows in which they are tried; of rows so many as a flash still spans this many, where there are: rows that
are averaged over a whole flash make it look longer."""
FLASHES_DIFFER = 0.7
"""Flashes of other lengths are likely where they leave less than this share of the robust loss."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """A fit, the plan under which it was made (another camera than the given plan's where that was wrong by far), and
    whether it is to be believed. ``seed`` is where the given plan's strobe was looked for first. ``other``: flashes at
    other times that explain the clip as well. ``placed``: it was found by what holds whatever moves."""

    plan: Plan
    found: ClipFit
    believed: bool
    seed: Seed
    other: Beat | None = None
    placed: bool = False


def believed_fit(plan: Plan, rows: Profiles) -> Verdict:
    """Return the best fit of a clip under the plan or, where another shutter or readout is far likelier, under that;
    where it is doubtful and contradicts what holds whatever moves, the place that this shows.

    ``rows`` are laid out from the picture's top row.
    """
    found = find(plan, rows)
    seed = found.seed
    if not doubtful(plan, found):
        return _unless_elsewhere(Verdict(plan=plan, found=found, believed=True, seed=seed))
    place = sure_place(plan, rows)
    if place is None:
        return _of_rivals(plan, rows, found)
    if not contradicts(plan, found, place):
        verdict = _of_rivals(plan, rows, found)
        if verdict.believed:
            return verdict
    return Verdict(plan=plan, found=placed_fit(plan, rows, place), believed=True, seed=seed, placed=True)


def _of_rivals(plan: Plan, rows: Profiles, found: ClipFit) -> Verdict:
    """Return the fit of a plan, which is doubtful, or that of the plan that was meant; whether others explain more."""
    seed = found.seed
    meant, found = _as_meant(plan, rows, found)
    believed = convincing(meant, found) and not _feigned(plan, found)
    if believed:
        rivals = _worth_trying(plan, meant, found)
        believed = not rivals or best_rival(meant, rows, rivals, beside=found) is None
    return _unless_elsewhere(Verdict(plan=meant, found=found, believed=believed, seed=seed))


def _unless_elsewhere(verdict: Verdict) -> Verdict:
    other = fits_elsewhere(verdict.plan, verdict.found) if verdict.believed else None
    return replace(verdict, believed=False, other=other) if other else verdict


def _as_meant(plan: Plan, rows: Profiles, found: ClipFit) -> tuple[Plan, ClipFit]:
    """Return the likeliest plan with another camera and its fit; the given ones unless they leave clearly more.

    Another exposure and another readout at once are tried only where neither the plan nor one of them convinces.
    """
    sure = convincing(plan, found)
    leaves = CLEARLY if sure else BETTER
    likelier = _likelier(plan, rows, found, camera_rivals(plan), leaves=leaves)
    if likelier is None and not sure:
        likelier = _likelier(plan, rows, found, double_rivals(plan), leaves=leaves)
    return likelier or (plan, found)


def _likelier(
    plan: Plan, rows: Profiles, found: ClipFit, rivals: Iterable[Rival], *, leaves: float
) -> tuple[Plan, ClipFit] | None:
    """Return the best of a plan's rivals and its fit of the whole clip; None unless that convinces and leaves less than
    the share ``leaves`` of the robust loss that the plan's fit leaves."""
    rival = best_rival(plan, rows, list(rivals), least=FAIR, leaves=leaves)
    if rival is None:
        return None
    again = find(rival.plan, rows, measured=("exposure_s",) if rival.fault == "shutter" else ())
    left, left_again = (1 - gain_of(one.rows, one.fit.rest) for one in (found, again))
    return (rival.plan, again) if convincing(rival.plan, again) and left_again < leaves * left else None


def convincing(plan: Plan, found: ClipFit) -> bool:
    """Return whether a fit has found a strobe, and not merely the least bad place for one.

    Brightnesses alone explain some of mere noise, which counts in short clips. Where all rows see a flash at once, a
    frame shows little more than which one it was: enough missing frames explain nearly all of any other strobe, unless
    they are missing by a rule.
    """
    rows, fit = found.rows, found.fit
    by_chance = 1 - freedom(plan, rows, fit.beat)
    share, explained = gain_of(rows, fit.rest), fit.explained
    often = too_many(found.steps, found.strayed, len(rows.value))
    adrift = found.slack_s == 0 and fit.shift_error_s > ADRIFT * plan.shortest_flash_s
    least = UNSURE_GAIN if adrift else EXCUSED if _clock_too_far(plan, found) else MIN_GAIN
    strobed = explained > max(MIN_EXPLAINED, by_chance + LUCK * (1 - by_chance)) and share > max(least, by_chance)
    told = (fit.beat.row_time_s > 0.0 or found.regular) and min(share, explained) > 0.9
    return (
        not shows_the_same(plan, rows, fit.beat)
        and (strobed or found.across > ACROSS)
        and (not often or told)
        and (_excuses(plan, found) < EXCUSES or share > UNSURE_GAIN)
        and abs(fit.beat.clock.mean_offset_ppm()) < MOST_PPM
        and (found.slack_s > 0 or fit.shift_error_s < LOST * plan.shortest_flash_s)
    )


def doubtful(plan: Plan, found: ClipFit) -> bool:
    """Return whether a fit leaves so much, or had to stray so far from the plan, that the plan may be wrong by far."""
    return (
        _moved(plan, found)
        or gain_of(found.rows, found.fit.rest) < UNSURE_GAIN
        or _unsure(plan, found)
        or _gaps_feigned(found)
        or not convincing(plan, found)
        or _excuses(plan, found) > 0
        or flashes_differ(plan, found)
    )


def _excuses(plan: Plan, found: ClipFit) -> int:
    """Return how many things a fit takes for given that nobody said: frames missing behind whole numbers, and a clock
    farther off than the plan says, and than a misnamed rate makes it. One is a fault of the take; with both, most
    plans can be made to fit."""
    return (found.steps > 0) + _clock_too_far(plan, found)


def _clock_too_far(plan: Plan, found: ClipFit) -> bool:
    ppm = abs(found.fit.beat.clock.mean_offset_ppm())
    return ppm > max(plan.clock_range_ppm, LEAST_REACH_PPM)


def _worth_trying(plan: Plan, meant: Plan, found: ClipFit) -> list[Rival]:
    """Return the rivals of a fit that is not beyond doubt. Frames that are missing in a pattern make another rate,
    which is no rival of theirs where the fit explains all."""
    if _unsure(meant, found) or _gaps_feigned(found) or flashes_differ(meant, found):
        return list(strobe_rivals(plan))
    excuses = _excuses(plan, found)
    if excuses == 1 and found.steps:
        return [one for one in strobe_rivals(plan) if one.fault != "rate"]
    return list(strobe_rivals(plan)) if excuses else []


def _moved(plan: Plan, found: ClipFit) -> bool:
    """Return whether a fit needs another exposure or readout than the plan's."""
    beat, camera = found.fit.beat, plan.camera
    moved = abs(beat.exposure_s / camera.exposure_s - 1) > MOVED
    if camera.readout_s:
        moved = moved or abs(beat.row_time_s * camera.height_px / abs(camera.readout_s) - 1) > MOVED
    return moved


def _feigned(plan: Plan, found: ClipFit) -> bool:
    """Return whether a subject that moves in step with the shutter, or a picture that was turned, may feign another
    exposure or readout.

    Where nothing moves, the true shutter explains nearly everything, and is as sure of the times.
    """
    unlike = gain_of(found.rows, found.fit.rest) < STILL or _unsure(plan, found)
    return _moved(plan, found) and unlike and found.across < ACROSS


def _unsure(plan: Plan, found: ClipFit) -> bool:
    return found.slack_s == 0 and found.fit.shift_error_s > UNSURE * plan.shortest_flash_s


def _gaps_feigned(found: ClipFit) -> bool:
    """Return whether holes may only stand for a strobe that drifts away from the plan's: true ones leave little."""
    return found.steps > 0 and found.fit.explained < GAPPED


def flashes_differ(plan: Plan, found: ClipFit) -> bool:
    """Return whether flashes much longer or shorter than the plan's, in the same places without tails, fit better."""
    beat = found.fit.beat
    shortest_s = plan.shortest_flash_s
    sharp = int(np.ceil(ROWS_EACH * beat.row_time_s * len(found.rows.place) / shortest_s))
    rows = found.rows.take(slice(0, LENGTH_FRAMES)).binned(max(LENGTH_ROWS, sharp))
    rest = unexplained(plan, rows, beat)
    limit = FLASHES_DIFFER * robust_loss(rows, rest, rest)
    tails_s = beat.rise_s + beat.fall_s - plan.rise_s - plan.fall_s
    for factor in OTHER_LENGTHS:
        longer_s = (factor - 1) * shortest_s
        flashes = tuple(replace(flash, duration_s=flash.duration_s + longer_s) for flash in plan.flashes)
        other = replace(plan, flashes=flashes, dark_s=plan.dark_s - longer_s)
        moved = beat.with_phase(beat.clock.phase_s - 0.5 * longer_s + tails_s)
        moved = replace(moved, rise_s=plan.rise_s, fall_s=plan.fall_s)
        if other.dark_s <= 0:
            continue
        if tails_s > 0:  # which stood for some of the other length, and moved the flashes with them
            moved = refined_beat(other, rows, moved, steps=4, first_scale=0.1)
        if robust_loss(rows, unexplained(other, rows, moved), rest) < limit:
            return True
    return False
