"""Why no strobe like the plan's was found in a clip: what the picture looks like instead, and what to do about it."""

import numpy as np

from psvideo.model.plan import UNKNOWN_CLOCK_PPM, Plan
from psvideo.model.units import counted, show_seconds
from psvideo.sync.rowfit.coarse.seed import SEARCH_ROWS
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.quiet import NOISE, likeness, loud_part
from psvideo.sync.rowfit.strobed import least_frames as enough_to_tell
from psvideo.sync.rowfit.unlit import LEAST_SHARE
from psvideo.sync.verdict.other_strobe import other_plan, other_strobe
from psvideo.sync.verdict.overexposed import overexposed_throughout

STEADY = 0.02
"""Rows that change by less than this share of their light from frame to frame saw no strobe."""
ALONE = 0.15
"""Rows that change by less than this share of what whole frames do change all together."""
REPEATS = 0.03
"""A picture repeats where a cycle's frames leave less than this share of its changes."""
FLEETING = 0.25
"""What rows show on an average over a round changes by this share until the next one where the subject crosses the
picture in a few rounds. (Balls that cross it in 0.1 to 0.4 s: 0.08 to 0.68, most above 0.2; 24 that hardly move, under
another strobe: 0.04 to 0.16.)"""
SHOWN = 0.05
"""Rounds with less than this share of the brightest one's light show nothing."""
MOST_PPM = 1.5 * UNKNOWN_CLOCK_PPM
"""No two clocks are further apart than this, errors of short clips included."""
FILM_ON = "Film on while the strobe flashes. If it flashed, open the lens, raise the gain, or bring the lights nearer."
LEAST_ROWS = 2
"""Rows of which the time from one to the next can be asked for at all."""


def nothing_to_find(plan: Plan, rows: Profiles) -> str:
    """Return why no search is worth while, or nothing where one is: too few frames or rows, no change at all, or mere
    noise."""
    least = least_frames(plan)
    if len(rows.value) < least:
        return (
            f"holds {counted(len(rows.value), 'frame')}; finding the timing of a strobe with "
            f"{counted(len(plan.lit_slots), 'lit flash')} a round needs at least {least}, and 50 or more make it sure."
        )
    if rows.value.shape[1] < LEAST_ROWS:
        return (
            f"its pictures are {counted(rows.value.shape[1], 'row')} high, and when flashes fired shows in how their "
            f"light moves from row to row: expected {LEAST_ROWS} rows at least, as the camera reads them, and 100 or "
            "more for times that are worth it. Give the clip at the height at which it was filmed."
        )
    shortest_s = plan.shortest_flash_s
    if shortest_s > plan.camera.frame_period_s:
        return (
            f"the plan's flashes last {show_seconds(shortest_s)} and more, longer than a frame of "
            f"{show_seconds(plan.camera.frame_period_s)}: no row sees one whole. Times in plan.toml are in seconds: "
            f"duration_s = {shortest_s * 1e-3:g} is {show_seconds(shortest_s * 1e-3)}."
        )
    changes = _changes(plan, rows)
    if float(np.abs(changes).max()) < 1e-9:
        return overexposed_throughout(rows) or (
            "no strobe like the plan's was found in the picture: its rows do not change at all from frame to frame. "
            "Check that the lights flashed, that the lens was open, and that this is the right clip."
        )
    if likeness(changes) < NOISE:
        return overexposed_throughout(rows) or (
            "no strobe like the plan's was found in the picture: what changes from frame to frame is noise, which "
            f"neighbouring rows do not share (mean level {float(rows.value.mean()):.2g} of saturation). Check that the "
            "lights flashed and are bright enough; open the lens or raise the gain."
        )
    return _hardly_lit(plan, rows, least)


def _hardly_lit(plan: Plan, rows: Profiles, least: int) -> str:
    """Return that nearly all frames are dark, and fewer show flashes than can be timed; or nothing."""
    loud = loud_part(rows)
    count = loud.stop - loud.start
    if count >= least or count > LEAST_SHARE * len(rows.value):
        return ""
    return (
        f"no strobe like the plan's was found in the picture: {_where_dark(rows, loud)} It takes {least} frames with "
        f"flashes at least, and 50 or more make it sure. {FILM_ON}"
    )


def too_few_lit(plan: Plan, rows: Profiles) -> str:
    """Return that most of what is no noise may be too short to tell anything, where frames at either end are dark, and
    what to do; or nothing."""
    loud = loud_part(rows)
    count = loud.stop - loud.start
    if count == len(rows.value) or count >= enough_to_tell(plan):
        return ""
    flashes = counted(len(plan.lit_slots), "flash")
    return (
        f"{_where_dark(rows, loud).capitalize()} These are few to tell {flashes} a round by: 50 or more make it sure. "
        f"{FILM_ON}"
    )


def _where_dark(rows: Profiles, loud: slice) -> str:
    """Say which frames at either end are dark, and how many are not."""
    first, last = int(rows.index[loud.start]), int(rows.index[loud.stop - 1])
    ends = [f"{int(rows.index[0])} to {first - 1}"] if loud.start else []
    ends += [f"{last + 1} to {int(rows.index[-1])}"] if loud.stop < len(rows.value) else []
    return (
        f"frames {' and '.join(ends)} are dark and change by noise alone, as before the strobe begins, under a lens "
        f"cap, or under lights that are too weak, and {loud.stop - loud.start} of {len(rows.value)} show flashes."
    )


def least_frames(plan: Plan) -> int:
    """Return how many frames hold more than the brightnesses that are fitted to them."""
    return len(plan.lit_slots) + 3


def _changes(plan: Plan, rows: Profiles) -> np.ndarray:
    """Return how rows change from frames to others (frame, row) in which they see other flashes: soon, unless the
    strobe nearly keeps step with the frames. Then only rows beside a dark row change from one frame to the next."""
    value = rows.binned(SEARCH_ROWS).value
    onward = np.arange(1, max(len(value) // 2, 1) + 1)
    moved_s = np.abs((onward * rows.period_s + 0.5 * plan.cycle_s) % plan.cycle_s - 0.5 * plan.cycle_s)
    enough_s = min(plan.cycle_s / len(plan.cycle_slots), float(moved_s.max()))
    lag = int(onward[np.argmax(moved_s >= enough_s)])
    change: np.ndarray = value[lag:] - value[:-lag]
    return change


def why_not(plan: Plan, rows: Profiles) -> str:
    """Return what the picture looks like where no strobe like the plan's was found, and what to do; or nothing."""
    change = np.abs(np.diff(rows.value, axis=0))
    level = float(np.abs(rows.value).mean())
    if float(change.mean()) < STEADY * level:
        return (
            "The rows hardly change from frame to frame, as without any strobe, or with one so fast that every row "
            "sees the same light. Check that the lights flashed."
        )
    if _repeats(plan, rows):
        return (
            f"The picture repeats itself every {len(plan.cycle_slots)} frames, one flash a frame: the strobe seems to "
            'be triggered by the camera. If so, write mode = "synced" under [strobe] in plan.toml.'
        )
    together = _change_together(plan, rows)
    if fleeting(plan, rows) > FLEETING and not together:
        return (
            "From round to round the rows show another picture, as where the subject crosses the frame, or turns, "
            "within a few rounds: no light's brightness stays long enough for its flashes to be told. Let something "
            "that stands still share the picture with it, or film it at rest for a second of the same take. If it was "
            "at rest, check that plan.toml is the plan that the strobe played."
        )
    if rival := other_plan(plan, rows):
        return rival
    if together:
        return (
            "All rows change together, as under flicker or automatic exposure, and not as under flashes. "
            "Check that the strobe played, and that exposure and gain were fixed."
        )
    return other_strobe(plan, rows)


def _change_together(plan: Plan, rows: Profiles) -> bool:
    whole = rows.value.mean(axis=1)
    alone = float(((rows.value - whole[:, None]) - (rows.value - whole[:, None]).mean(axis=0)).std())
    return alone < ALONE * float((whole - whole.mean()).std()) and plan.camera.readout_s != 0


def clock_too_far(plan: Plan, found: ClipFit) -> str:
    """Return which number of the plan to doubt where the fit slipped to a clock beyond those searched; or nothing."""
    ppm = found.fit.beat.clock.mean_offset_ppm()
    if abs(ppm) < MOST_PPM or found.steps:
        return ""
    flash_s = plan.cycle_s / len(plan.cycle_slots)
    return (
        f"It puts the strobe's clock {ppm:+.0f} ppm off the camera's, beyond the {UNKNOWN_CLOCK_PPM:.0f} ppm that are "
        f"searched: one flash every {flash_s * (1 + ppm * 1e-6) * 1e3:.4g} ms, where the plan says "
        f"{flash_s * 1e3:.4g} ms. No clock is off by so much: check duration_s and dark_s of the strobe, and fps "
        f"({float(plan.camera.fps):.6g}) and exposure of the camera."
    )


def _repeats(plan: Plan, rows: Profiles) -> bool:
    """Return whether the picture is the same in every cycle's frames, as where the camera triggers the strobe."""
    cycle, frames = len(plan.cycle_slots), len(rows.value)
    if frames < 2 * cycle + 1 or cycle < 2:
        return False
    place = rows.index % cycle
    change = rows.value - rows.value.mean(axis=0)
    left = sum(float(((part - part.mean(axis=0)) ** 2).sum()) for part in (change[place == n] for n in range(cycle)))
    return left * frames / (frames - cycle) < REPEATS * float((change**2).sum())


def fleeting(plan: Plan, rows: Profiles) -> float:
    """Return by which share what rows show over a round usually changes until the next one; 0 where too few rounds show
    anything. Rounds are averaged, so that which lights flashed when hardly matters."""
    round_s = plan.cycle_s / len(plan.dark_rounds)
    each = max(round(round_s / rows.period_s), 1)
    few = rows.binned(SEARCH_ROWS).value
    few = few - np.sort(few, axis=0)[min(1, len(few) - 1)]
    count = len(few) // each
    shown = few[: count * each].reshape(count, each, -1).mean(axis=1)
    size = np.abs(shown).sum(axis=1)
    lit = np.flatnonzero(np.minimum(size[1:], size[:-1]) > SHOWN * size.max(initial=0.0))
    if not len(lit):
        return 0.0
    apart = np.abs(np.diff(shown, axis=0)).sum(axis=1) / np.maximum(size[1:] + size[:-1], 1e-30)
    return float(np.median(apart[lit]))
