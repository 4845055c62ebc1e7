"""Why no strobe like the plan's was found in a clip: what the picture looks like instead, and what to do about it."""

from dataclasses import replace

import numpy as np

from psvideo.model.plan import UNKNOWN_CLOCK_PPM, Plan
from psvideo.model.units import counted, show_seconds
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.coarse.search import GridPlace, search
from psvideo.sync.rowfit.coarse.seed import SEARCH_ROWS, first_guess, gain_of
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles, unexplained
from psvideo.sync.verdict.overexposed import overexposed_throughout
from psvideo.sync.verdict.rivals import CLEARLY, Rival, best_rival, count_rivals, likely_rates, strobe_rivals

ALIKE = 0.2
"""Frames that see the cycle at times which differ by less than this share of the shortest flash are alike."""
SLOW = 3.0
"""A strobe that moves by no more than this many shortest flashes within a clip nearly keeps step with its frames."""
STEADY = 0.02
"""Rows that change by less than this share of their light from frame to frame saw no strobe."""
ALONE = 0.15
"""Rows that change by less than this share of what whole frames do change all together."""
REPEATS = 0.03
"""A picture repeats where a cycle's frames leave less than this share of its changes."""
NOISE = 0.15
"""Correlation of neighbouring rows' changes below which there is nothing but noise."""
WRONG_PERIOD_GAIN = 0.6
OTHER_PERIOD = 0.02
"""Share by which the time from flash to flash must be off to be called another one."""
MOST_PPM = 1.5 * UNKNOWN_CLOCK_PPM
"""No two clocks are further apart than this, errors of short clips included."""
LITTLE_MORE = 2.0
"""Times the robust loss that more lights leave, which fewer may."""
LEAST_ROWS = 2
"""Rows of which the time from one to the next can be asked for at all."""
PERIOD_FRAMES, PERIOD_ROWS = 14, 8
LEAST_GAP, LONGEST = 0.25, 2.5
"""Periods are tried from this share of a frame's period after a flash to this many of them."""
MOST_PERIODS = LONGEST - LEAST_GAP


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
    if _likeness(changes) < NOISE:
        return overexposed_throughout(rows) or (
            "no strobe like the plan's was found in the picture: what changes from frame to frame is noise, which "
            f"neighbouring rows do not share (mean level {float(rows.value.mean()):.2g} of saturation). Check that the "
            "lights flashed and are bright enough; open the lens or raise the gain."
        )
    return ""


def shows_the_same(plan: Plan, rows: Profiles, beat: Beat) -> bool:
    """Return whether a rolling shutter sees no more different frames, again and again, than a row has brightnesses:
    ambient light and lights then explain them wherever the flashes fell.

    Frames are alike that see the cycle at the same time, or nearly. A global shutter sees plates whole all the same.
    """
    if beat.row_time_s == 0.0:
        return False
    return _few_kinds(plan, rows, beat, ALIKE)


def shows_few(plan: Plan, rows: Profiles, beat: Beat) -> bool:
    """Return whether frames see no more than so many, each of them moved by ``SLOW`` flashes at most in the course of
    the clip: a subject that moves may explain that as well as flashes that do."""
    return _few_kinds(plan, rows, beat, SLOW)


def _few_kinds(plan: Plan, rows: Profiles, beat: Beat, moved: float) -> bool:
    """Return whether frames see the cycle around no more times than a row has brightnesses, and at those within so many
    of the shortest flash."""
    cycle_s, alike_s = plan.cycle_s * beat.clock.rate, ALIKE * plan.shortest_flash_s
    at_s = np.sort(rows.frame_start_s % cycle_s)
    gaps_s = np.diff(np.append(at_s, at_s[0] + cycle_s))
    apart = gaps_s > alike_s
    kinds = max(int(apart.sum()), 1)
    within_s = cycle_s - gaps_s[apart].sum()
    return kinds <= len(plan.lit_slots) + 1 and within_s < kinds * moved * plan.shortest_flash_s


def in_step_with_frames(plan: Plan) -> str:
    """Say that frames repeat so soon that any time would explain them, and what to do."""
    frames = round(plan.cycle_s / plan.camera.frame_period_s)
    return (
        f"the strobe keeps step with the camera: the same {counted(frames, 'picture')} come again and again, and a row "
        f"has as many brightnesses ({counted(len(plan.lit_slots), 'light')} and what else shines), so that any flash "
        "times would explain them. Film long enough for the clocks to drift apart by a flash, or plan another dark "
        f"time (dark_s = {plan.dark_s + 0.1 * plan.camera.frame_period_s:.4g} under [strobe])."
    )


def other_times_as_well(plan: Plan, found: ClipFit, other: Beat, *, at_once: bool) -> str:
    """Say that flashes at other times explain the picture as well, under another clock, and what to do; ``at_once``:
    all rows open at nearly the same time."""
    one, another = found.fit.beat.clock.mean_offset_ppm(), other.clock.mean_offset_ppm()
    why = (
        "All rows open at nearly the same time, so that whether the beginning or the end of an exposure cuts a flash "
        "shows only in the strobe's clock"
        if at_once
        else "It does not show well enough when each flash fired, as where hardly any row opens or closes during one "
        "while the subject moves, so that the strobe's clock is not known"
    )
    return (
        f"flashes at other times explain the picture as well. {why}, and it may be {one:+.0f} ppm off the camera's or "
        f"{another:+.0f} ppm. Film longer, until every flash has come in and gone out of the exposure, or plan another "
        "dark time, so that flashes fall all over the frame (dark_s = "
        f"{plan.dark_s + 0.1 * plan.camera.frame_period_s:.4g} under [strobe])."
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


def _likeness(changes: np.ndarray) -> float:
    """Return the correlation of neighbouring rows' changes from frame to frame."""
    if changes.shape[1] < 2:
        return 1.0
    above, below = changes[:, :-1], changes[:, 1:]
    return float((above * below).sum() / np.sqrt((above**2).sum() * (below**2).sum()))


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
    meant = best_rival(plan, rows, list(strobe_rivals(plan)))
    if meant is not None:
        return _described(plan, meant)
    played = _other_count(plan, rows)
    if played is not None:
        return (
            f"The picture fits {_round_words(played)} in turn, and the plan has {_round_words(plan)}: the strobe "
            "played another plan. Put the plan that it played beside the clip."
        )
    whole = rows.value.mean(axis=1)
    alone = float(((rows.value - whole[:, None]) - (rows.value - whole[:, None]).mean(axis=0)).std())
    if alone < ALONE * float((whole - whole.mean()).std()) and plan.camera.readout_s != 0:
        return (
            "All rows change together, as under flicker or automatic exposure, and not as under flashes. "
            "Check that the strobe played, and that exposure and gain were fixed."
        )
    return _other_strobe(plan, rows)


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


def _other_count(plan: Plan, rows: Profiles) -> Plan | None:
    """Return the plan with the number of lights that the picture fits. Two rounds fit as one, and a dark slot as one
    more light: of those that leave little more, it is one with fewer lights."""
    rivals = list(count_rivals(plan))
    meant = best_rival(plan, rows, rivals)
    if meant is None:
        return None
    length, lights = len(meant.plan.flashes), len(meant.plan.lights)
    simpler = [one for one in rivals if length % len(one.plan.flashes) == 0 and len(one.plan.lights) < lights]
    simplest = best_rival(meant.plan, rows, simpler, leaves=LITTLE_MORE) if simpler else None
    return (simplest or meant).plan


def _round_words(plan: Plan) -> str:
    dark = "a dark slot" if any(flash.is_dark for flash in plan.flashes) else "no dark slot"
    rare = f" in one round of {plan.dark_every}" if plan.dark_every > 1 else ""
    return f"{counted(len(plan.lit_slots), 'light')} and {dark}{rare}"


def _described(plan: Plan, rival: Rival) -> str:
    if rival.fault == "rate":
        rate, planned = float(rival.plan.camera.fps), float(plan.camera.fps)
        return (
            f"The picture fits a camera that ran at {rate:.6g} frames a second, and the plan says {planned:.6g}: put "
            f"the true frame rate (and the shutter that goes with it) into plan.toml, or film at {planned:.6g}."
        )
    meant = rival.plan
    parts = [
        f"{name} {other * 1e3:.4g} ms (plan: {planned * 1e3:.4g} ms)"
        for name, other, planned in (
            ("flashes of", meant.flashes[meant.lit_slots[0]].duration_s, plan.flashes[plan.lit_slots[0]].duration_s),
            ("dark times of", meant.dark_s, plan.dark_s),
        )
        if abs(other - planned) > 1e-9 * other
    ]
    return (
        f"The picture fits {' and '.join(parts)} far better: the strobe played another plan, or its durations were "
        "doubled or halved on the way. Put the plan that it played beside the clip."
    )


def _other_strobe(plan: Plan, rows: Profiles) -> str:
    if max(flash.duration_s for flash in plan.flashes) > MOST_PERIODS * rows.period_s:
        return ""  # no period that is tried has room for such a flash
    period_s, gain, planned = other_period(plan, rows)
    flash_s = plan.flashes[plan.lit_slots[0]].duration_s
    planned_s = plan.dark_s + flash_s
    if gain < WRONG_PERIOD_GAIN or abs(period_s / planned_s - 1) < OTHER_PERIOD:
        return ""
    if 1 - gain > CLEARLY * (1 - planned):
        return ""
    words = (
        f"The picture looks like a strobe that flashes every {period_s * 1e3:.4g} ms, and not every "
        f"{planned_s * 1e3:.4g} ms as planned"
    )
    for rate in likely_rates(plan):
        if abs(period_s / planned_s * float(plan.camera.fps / rate) - 1) < 0.5 * OTHER_PERIOD:
            return (
                f"{words}, as if the camera had run at {float(rate):.6g} frames a second instead of the plan's "
                f"{float(plan.camera.fps):.6g}. Check the frame rate, and the plan that the strobe played."
            )
    if period_s - flash_s < plan.camera.exposure_s * (1 - OTHER_PERIOD):
        words += (
            f"; its dark time is then shorter than the exposure of {plan.camera.exposure_s * 1e3:.4g} ms, so that rows "
            "hold two flashes mixed"
        )
    return f"{words}. Put the plan that it played beside the clip, or let it play this one."


def other_period(plan: Plan, rows: Profiles) -> tuple[float, float, float]:
    """Return the time from flash to flash that explains the picture best, how much of the loss it takes away, and how
    much the plan's own takes away of the same few frames."""
    part = rows.take(slice(0, min(PERIOD_FRAMES, len(rows.value)))).binned(PERIOD_ROWS).one_window()
    longest_s = max(flash.duration_s for flash in plan.flashes)
    step_s = longest_s / len(part.value)

    def best(dark_s: float) -> GridPlace:
        tried = replace(plan, dark_s=dark_s)
        return search(tried, part, range_ppm=0.0, start=first_guess(plan), readout_known=True)[0]

    def gain(dark_s: float) -> float:
        return gain_of(part, unexplained(replace(plan, dark_s=dark_s), part, best(dark_s).beat))

    periods_s = np.arange(longest_s + LEAST_GAP * rows.period_s, LONGEST * rows.period_s, step_s).tolist()
    period_s = min(periods_s, key=lambda one_s: best(one_s - longest_s).loss)
    return period_s, gain(period_s - longest_s), gain(plan.dark_s)
