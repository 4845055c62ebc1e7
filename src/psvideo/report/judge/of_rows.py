"""Judgements on rows and frames: rows that nobody saw, or under two flashes, and frames that are missing or repeat."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from psvideo.model.cost.in_step import IN_STEP, blind_share, dark_s_out_of_step, frames_in_step, never_shown
from psvideo.model.cost.rows_of_flashes import mixed_share
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.model.units import counted, listed
from psvideo.report.judgement import Grade, Judgement
from psvideo.report.observe.observed import Observed

MIXED, LOST_MIXED = 0.02, 0.2
"""Shares of rows that hold two flashes, from which a take is doubtful, and bad."""
MOST_UNSEEN, LOST_UNSEEN = 0.02, 0.3
"""Shares of a round's rows that no frame saw, from which a take is doubtful, and bad."""
SPOILT = 0.1
"""Where frames are missing, this share of the rounds may lose rows for it, and one of several: the others serve."""
BLIND = 0.97
"""A camera whose exposure is a smaller share of its frame misses flashes while the shutter is closed."""
NAMED = 3
"""At most this many places of missing frames are named."""


@dataclass(frozen=True)
class _Rows:
    """Shares of a round's rows: at most so many were ``unseen``, at most so many ``borrowed`` from other rounds.

    ``rounds`` are what each round of a whole take lacks, empty where only its start was looked at. ``show_ambient``
    says that ambient light, too, is known only where rows saw a part of a flash: there is no dark slot.
    """

    unseen: float
    borrowed: float
    rounds: tuple[float, ...]
    show_ambient: bool


def coverage(plan: Plan, timing: Timing, observed: Observed, *, take_s: float | None = None) -> Iterator[Judgement]:
    """Judge which rows were seen by nobody, or under two flashes, and why. ``take_s`` is how long the take lasts of
    which only a part was looked at: the rest shows more rows below 360 degrees, and shows the ambient light of rows
    where there is no dark slot."""
    rows = _rows_of(plan, timing, observed, take_s)
    said = [] if plan.mode == "synced" else [*_mixed(plan, timing), *_blind(plan, timing, rows)]
    holes = list(_dropped(timing, observed, alone=not (rows.show_ambient or is_blind(timing))))
    if rows.unseen > MOST_UNSEEN and not said and not _lost_in_holes(timing, observed, rows):
        said.append(_unexplained(timing, rows))
    yield from said
    yield from holes
    if not said and not holes:
        seen = (
            f"All but {100 * rows.unseen:.2g} % of the rows were seen"
            if rows.unseen
            else "Every row of every round was seen"
        )
        yield Judgement(subject="rows", grade="good", found=f"{seen}; no frame is missing.")


def _rows_of(plan: Plan, timing: Timing, observed: Observed, take_s: float | None) -> _Rows:
    """Return what rounds lack; of a take that lasts ``take_s`` and is only begun, what they will lack at its end."""
    unseen = max((one.unseen_share for one in observed.facts), default=0.0)
    borrowed = max((one.borrowed_share for one in observed.facts), default=0.0)
    blind = is_blind(timing)
    show_ambient = plan.mode != "synced" and not blind and not any(flash.is_dark for flash in plan.flashes)
    if take_s is None:
        return _Rows(unseen, borrowed, tuple(one.unseen_share for one in observed.facts), show_ambient)
    if unseen > MOST_UNSEEN and blind and not in_step(plan, timing):
        never = never_shown(_as_found(plan, timing), lasts_s=take_s, clock_offset_ppm=timing.clock_offset_ppm)
        unseen, borrowed = min(unseen, never), min(borrowed + unseen, 1.0)
    if show_ambient:
        unseen = 0.0  # more frames show the ambient light of more rows
    return _Rows(unseen, borrowed, (), show_ambient)


def _lost_in_holes(timing: Timing, observed: Observed, rows: _Rows) -> bool:
    """Return whether missing frames, which have a line of their own, are all that rows lack for."""
    lost = sum(one.unseen_share > MOST_UNSEEN for one in observed.facts)
    return bool(timing.dropped_frames) and (rows.unseen <= LOST_UNSEEN or _few(lost, len(observed.facts)))


def _unexplained(timing: Timing, rows: _Rows) -> Judgement:
    share = f"{100 * rows.unseen:.0f} % of a round's rows"
    if rows.show_ambient:
        found = (
            f"In up to {share} ambient light is not known: without a dark slot it is found from rows that saw a part "
            "of a flash, and these saw whole flashes only."
        )
        advice = "Film longer, or add a dark slot to the plan."
    else:
        found = f"Up to {share} were seen by no frame."
        advice = (
            "See the line on missing frames first."
            if timing.dropped_frames
            else "Use all frames (no steps in `frames`), and shoot at 360 degrees."
        )
    return Judgement(subject="rows", grade=_grade(rows.unseen), found=found, advice=advice)


def _grade(unseen: float) -> Grade:
    return "bad" if unseen > LOST_UNSEEN else "doubtful"


def _few(spoilt: int, rounds: int) -> bool:
    """Return whether so few rounds are spoilt that the others serve."""
    return spoilt <= max(SPOILT * rounds, 1) and spoilt < rounds


def _mixed(plan: Plan, timing: Timing) -> Iterator[Judgement]:
    dark_s = plan.dark_s * (1 + timing.clock_offset_ppm * 1e-6)
    share = mixed_share(plan, exposure_s=timing.exposure_s, dark_s=dark_s)
    if share > MIXED:
        yield Judgement(
            subject="rows",
            grade="bad" if share > LOST_MIXED else "doubtful",
            found=f"The dark time of {dark_s * 1e3:.4g} ms is shorter than the exposure of "
            f"{timing.exposure_s * 1e3:.4g} ms: about {100 * share:.0f} % of the rows hold two flashes, and "
            "plates are cut there.",
            advice=f"Lengthen the dark time to at least {timing.exposure_s * 1e3:.4g} ms: make the plan again with "
            "psvideo capture-plan.",
        )


def is_blind(timing: Timing) -> bool:
    """Return whether the shutter is closed for so long that every flash is missed by some rows."""
    return timing.exposure_s / timing.frame_period_s < BLIND


def opened(timing: Timing) -> str:
    """Say for how long the shutter is open."""
    return f"the shutter is open for {360 * timing.exposure_s / timing.frame_period_s:.0f} degrees only"


def _as_found(plan: Plan, timing: Timing) -> Plan:
    return replace(plan, camera=replace(plan.camera, exposure_s=timing.exposure_s))


def in_step(plan: Plan, timing: Timing) -> bool:
    """Tell whether flashes meet the same rows again and again, so that some rows never see some lights."""
    found = _as_found(plan, timing)
    return is_blind(timing) and never_shown(found, clock_offset_ppm=timing.clock_offset_ppm) > IN_STEP


def _blind(plan: Plan, timing: Timing, rows: _Rows) -> Iterator[Judgement]:
    """Judge a shutter that is closed for a part of the time. At a whole take's two ends few other rounds show the rows
    that one lacks, and the rest serves."""
    unseen, borrowed, rounds = rows.unseen, rows.borrowed, rows.rounds
    serves = unseen <= LOST_UNSEEN or _few(sum(one > LOST_UNSEEN for one in rounds), len(rounds))
    if not is_blind(timing):
        return
    shutter = opened(timing)
    if unseen > MOST_UNSEEN and in_step(plan, timing):
        other_s = dark_s_out_of_step(_as_found(plan, timing))
        yield Judgement(
            subject="rows",
            grade=_grade(unseen),
            found=f"Up to {100 * unseen:.0f} % of a round's rows see a light in no round: {shutter}, and the strobe "
            f"keeps step with the frames, so that every {frames_in_step(plan)} frames its flashes meet the same rows.",
            advice="Shoot at 360 degrees"
            + (", or in rolling mode" if plan.mode == "half-rate" else "")
            + ("." if other_s is None else f", or with a dark time (dark_s) of {other_s * 1e3:.4g} ms."),
        )
    elif borrowed > MOST_UNSEEN and serves:
        share = blind_share(_as_found(plan, timing), clock_offset_ppm=timing.clock_offset_ppm)
        shares = f"about {100 * share:.0f}" if share > MOST_UNSEEN else f"up to {100 * borrowed:.0f}"  # mean, or worst
        yield Judgement(
            subject="rows",
            grade="doubtful",
            found=f"{shutter.capitalize()}: {shares} % of a round's rows come from other rounds. What "
            f"stands still loses nothing by it, of what moves more is lost than at 360 degrees.{_lacking(rows)}",
            advice="Shoot at 360 degrees" + (", or film longer." if _too_short(rows) else "."),
        )
    elif unseen > MOST_UNSEEN:
        yield Judgement(
            subject="rows",
            grade=_grade(unseen),
            found=f"Up to {100 * unseen:.0f} % of a round's rows were seen by no frame: {shutter}.",
            advice="Shoot at 360 degrees.",
        )


def _too_short(rows: _Rows) -> bool:
    """Return whether a take of which only the start was looked at is too short to show all rows."""
    return not rows.rounds and rows.unseen > MOST_UNSEEN


def _lacking(rows: _Rows) -> str:
    """Say how many rounds lack rows that no other round shows, nothing where none does."""
    rounds = rows.rounds
    if _too_short(rows):
        return (
            f" Beyond these, about {100 * rows.unseen:.0f} % see a light in no round of so short a take: flashes fall "
            "at nearly the same rows from round to round."
        )
    lack = sum(one > MOST_UNSEEN for one in rounds)
    if not lack:
        return ""
    return (
        f" In {lack} of {len(rounds)} rounds no other one near by shows all rows: up to {100 * max(rounds):.0f} % lack."
    )


def _dropped(timing: Timing, observed: Observed, *, alone: bool) -> Iterator[Judgement]:
    """Say which frames are missing or repeat, and how many rounds that spoils where rows lack for that ``alone``."""
    holes, again = timing.dropped_frames, timing.repeated_frames
    missing = sum(hole.count for hole in holes)
    spoilt = [one.number for one in observed.facts if one.unseen_share > 0]
    if missing:
        where = listed([f"{hole.count} after number {hole.after}" for hole in holes], NAMED, things="places")
        grave = alone and len(spoilt) > 1 and not _few(len(spoilt), len(observed.facts))
        yield Judgement(
            subject="frames",
            grade="doubtful",
            found=f"{counted(missing, 'frame')} {'is' if missing == 1 else 'are'} missing ({where}); the rows "
            "there are not valid"
            + (f", which spoils {len(spoilt)} of {len(observed.facts)} rounds." if grave else "."),
            advice="Of numbered files, copy the take again first. Else use a faster card or a lower data rate; with a "
            "phone, an app that records at a constant frame rate.",
        )
    if again:
        yield Judgement(
            subject="frames",
            grade="doubtful",
            found=f"{counted(len(again), 'frame')} {'repeats' if len(again) == 1 else 'repeat'} the one before (first: "
            f"number {again[0]}).",
            advice="Export the take without frame-rate conversion.",
        )
