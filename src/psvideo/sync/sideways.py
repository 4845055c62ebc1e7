"""Footage that was turned by 90 degrees without a word: the sensor's rows run along the columns of its pictures.

Every row of such a picture sees all of the readout at once, nearly as a global shutter would under another exposure.
So where rows show no strobe, or one of another camera than the plan's, columns are asked as well.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from psvideo.clip import Take, read_frames
from psvideo.errors import NoStrobeError
from psvideo.model.coded import Coded, CodedFrame
from psvideo.model.plan import Plan
from psvideo.model.rows.row_profiles import collect_with_doubt
from psvideo.model.timing import Timing
from psvideo.sync.find import as_profiles
from psvideo.sync.restarted import beyond_doubt
from psvideo.sync.rowfit.fit import find
from psvideo.sync.verdict.believed import MOVED, convincing
from psvideo.sync.verdict.refusal import nothing_to_find
from psvideo.sync.verdict.rivals import Rival, best_rival

MOST_FRAMES = 240
"""Frames whose columns are asked: they are decoded once more."""


@dataclass(frozen=True, eq=False)
class _Turned:
    index: int
    coded: Coded


def another_camera(plan: Plan, timing: Timing) -> bool:
    """Return whether a timing holds another exposure or readout than the plan's, by far."""
    camera = plan.camera
    found = [(timing.exposure_s, camera.exposure_s)]
    if camera.readout_s and timing.row_time_s is not None:
        found.append((abs(timing.row_time_s) * camera.height_px, abs(camera.readout_s)))
    return any(abs(one / planned - 1) > MOVED for one, planned in found)


def refuse_sideways(take: Take) -> None:
    """Raise NoStrobeError where the strobe is found along a take's columns, beyond doubt."""
    camera = take.plan.camera
    if take.plan.mode == "synced" or not camera.readout_s:
        return
    frames = read_frames(take.clip, take.numbers[:MOST_FRAMES], kept=take.kept)
    index, value, doubt = collect_with_doubt(_turned(frames))
    upright = replace(camera, width_px=camera.height_px, height_px=camera.width_px)
    plans = [replace(take.plan, camera=replace(upright, readout_s=sign * camera.readout_s)) for sign in (1, -1)]
    rows = as_profiles(plans[0], index, value, doubt)
    if nothing_to_find(plans[0], rows):
        return
    best = best_rival(plans[0], rows, [Rival(plan=one, fault="readout") for one in plans], leaves=np.inf)
    if best is None:
        return
    found = find(best.plan, rows)
    if convincing(best.plan, found) and beyond_doubt(best.plan, found):
        raise NoStrobeError(_words(take, clockwise=best.plan is plans[0]))


def _turned(frames: Iterator[CodedFrame]) -> Iterator[CodedFrame]:
    """Yield frames with their columns as rows."""
    for frame in frames:
        tone = frame.coded.tone
        codes = np.ascontiguousarray(np.asarray(frame.coded.codes).swapaxes(0, 1))
        yield _Turned(frame.index, Coded(codes=codes, tone=replace(tone, zero=tone.zero.T, gain=tone.gain.T)))


def _words(take: Take, *, clockwise: bool) -> str:
    camera = take.plan.camera
    how, name = ("clockwise", "clock") if clockwise else ("counterclockwise", "cclock")
    return (
        f"{take.clip.path}: the strobe is found along the columns of the pictures, and not along their rows: they were "
        "turned by 90 degrees after the camera had read them row by row. Use the file that the camera wrote, or turn "
        f"them back, {how} (ffmpeg -vf transpose={name}), with width_px = {camera.height_px} and height_px = "
        f"{camera.width_px} in the plan."
    )
