"""Name the lights of a clip that shows no marker: by the light that the user names, or by the rig's directions.

For the rig, small plates of one cycle are rebuilt at up to three places of the clip, and only their frames are decoded.
Below 360 degrees, where every flash is missed by some rows, the next cycles lend these.
All places that give an order must give the same; else the order stays a guess, and the timing says why.
"""

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.clip import Take
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Image
from psvideo.model.first_light import TOGETHER, check_first_light, first_lit, is_called
from psvideo.model.marker import alike_turns
from psvideo.model.plan import HasLights
from psvideo.model.rig import Rig
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.timing import Timing, places_in_time, timed_camera
from psvideo.plates.flash_plates import clip_plates
from psvideo.plates.nearest_rows import MOST_LATER, has_blind_time
from psvideo.plates.split import Plate
from psvideo.sync.order_by_rig import RigTurn, named_by_turn, order_by_rig, why_undecided

PLACES = 3
"""Cycles that are looked at, spread over the clip."""
SMALL_PX = 64
"""The small plates' longer side: enough to see where light comes from, and hardly any noise."""


def named_first(take: Take, timing: Timing, first_light: str) -> Timing:
    """Return a timing, read from a file, whose first complete lit flash is the named light's.

    Raises UsageError where the plan has no such light, and PsvideoError where the cycle's marker says otherwise.
    """
    check_first_light(take.plan, first_light)
    for turn in alike_turns(take.plan):
        named = named_by_turn(take.plan, timing, turn)
        first = _first_complete(named)
        if first is not None and is_called(first, first_light):
            return replace(named, order="given", order_note="")
    seen = _first_complete(timing)
    raise PsvideoError(
        f"`first_light` {first_light} does not fit the timing: its first complete flash is "
        f"{TOGETHER.join(seen.lit) if seen else 'none'}'s, "
        f"and no turn of the cycle by which flashes stay alike makes it {first_light}'s. "
        "Leave the option out, or leave `timing` out to find the flashes again."
    )


def _first_complete(timing: Timing) -> HasLights | None:
    return first_lit(flash for flash in timing.flashes if flash.complete)


def named_by_rig(take: Take, timing: Timing, rig: Rig) -> Timing:
    """Return the timing with the order that the rig's directions give, where the order was a guess.

    Where they do not give it, the names stay as they were guessed; ``order_note`` says why, either way. Raises
    PsvideoError where the rig lacks a light of the plan.
    """
    if timing.order != "guess":
        return timing
    refusal = why_undecided(take.plan, rig)
    verdict = RigTurn(turn=None, why=refusal) if refusal else _agreed(list(_verdicts(take, timing, rig)))
    if verdict.turn is None:
        return replace(timing, order_note=f"The rig does not show the order of the lights: {verdict.why}.")
    note = f"The rig shows the order of the lights: {verdict.why}."
    return replace(named_by_turn(take.plan, timing, verdict.turn), order="rig", order_note=note)


def _agreed(verdicts: list[RigTurn]) -> RigTurn:
    """Return the verdict of all places together: none may contradict another."""
    if not verdicts:
        return RigTurn(turn=None, why="the clip holds no whole cycle of complete flashes")
    decided = [verdict for verdict in verdicts if verdict.turn is not None]
    if len({verdict.turn for verdict in decided}) > 1:
        return RigTurn(turn=None, why="different parts of the clip give different orders")
    return decided[0] if decided else verdicts[0]


def _verdicts(take: Take, timing: Timing, rig: Rig) -> Iterator[RigTurn]:
    """Judge cycles at the clip's start, middle and end, as far as they do not overlap."""
    cycle = len(take.plan.cycle_slots)
    lending = MOST_LATER if has_blind_time(timed_camera(take.plan, timing)) else 0
    starts = [n for n in range(len(timing.flashes) - cycle + 1) if _whole(timing, n, cycle)]
    last_end = -1
    for start in (starts[place * (len(starts) - 1) // (PLACES - 1)] for place in range(PLACES if starts else 0)):
        if start >= last_end:
            last_end = start + cycle
            pictures = _small_plates(take, timing, range(start, min(last_end + lending * cycle, len(timing.flashes))))
            if all(slot in pictures for slot in take.plan.lit_slots):
                lit = {slot: pictures[slot] for slot in take.plan.lit_slots}
                yield order_by_rig(take.clip.shown_plan, rig, lit)


def _whole(timing: Timing, start: int, count: int) -> bool:
    return all(flash.complete for flash in timing.flashes[start : start + count])


def _small_plates(take: Take, timing: Timing, flashes: range) -> dict[int, Image]:
    """Rebuild some flashes from the frames that they touch, and return small pictures of them by slot: each slot's
    first, and what that lacks from its next ones."""
    camera = timed_camera(take.plan, timing)
    first, last = frames_touched(camera, timing.start_s, timing.duration_s)
    begin, end = int(first[flashes.start]), int(last[flashes.stop - 1])
    places = places_in_time(timing, take.clip.numbers)
    near = tuple(number for number in take.numbers if number in places and begin <= places[number] <= end)
    if not near:
        return {}
    plates = clip_plates(replace(take, numbers=near), timing)
    turn = take.clip.turn
    pictures: dict[int, Image] = {}
    unseen: dict[int, NDArray[np.bool_]] = {}
    for plate in (one for one in plates if one.flash.index in flashes):
        slot = plate.flash.slot
        picture, lacks = _small(plate)
        picture, lacks = turn.upright(picture), turn.upright(lacks)
        if slot not in pictures:
            pictures[slot], unseen[slot] = picture, lacks
            continue
        lent = unseen[slot] & ~lacks
        pictures[slot] = np.where(lent if picture.ndim == 2 else lent[..., None], picture, pictures[slot])
        unseen[slot] = unseen[slot] & lacks
    return pictures


def _small(plate: Plate) -> tuple[Image, NDArray[np.bool_]]:
    """Return a small picture of a plate: 0 where any of it was unseen, 1.0 where any of it was saturated; and where it
    was unseen."""
    shown = plate.image
    rows, cols = shown.shape[:2]
    shrink = max(max(rows, cols) / SMALL_PX, 1.0)
    size = (max(round(cols / shrink), 1), max(round(rows / shrink), 1))

    def smaller(image: Image) -> Image:
        return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.float32)

    small = smaller(shown)
    small[smaller((shown >= 1.0).astype(np.float32)) > 0] = 1.0
    seen = np.repeat(plate.seen[:, None], cols, axis=1).astype(np.float32)
    unseen = smaller(seen) < 1.0 - 1e-4
    small[unseen] = 0.0
    return small, unseen
