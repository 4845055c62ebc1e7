"""What can be said of a clip: whether its frames are alike and fit the plan, before any long run begins."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from psvideo.clip.decode.decoders import read_header
from psvideo.clip.linear import white_of_others
from psvideo.clip.opening import open_clip
from psvideo.clip.reading import looks, read_frames
from psvideo.clip.record import Clip
from psvideo.errors import PsvideoError
from psvideo.formats.clip_layout import find_plan
from psvideo.formats.rig_folder import RIG_FILE
from psvideo.inspect.about_movie import movie_findings
from psvideo.inspect.about_photographs import photograph_findings
from psvideo.inspect.about_plan import length_finding, plan_findings, rig_findings
from psvideo.inspect.findings import Description, Fact, Finding, caught, fault, ok, warn
from psvideo.model.rows.clipping import SATURATED
from psvideo.model.units import counted, listed
from psvideo.report.judge.of_saturation import hidden_saturation
from psvideo.report.observe.hidden_level import may_hide, numbers_to_look_at, rising_samples

MANY = 3
SATURATED_SHARE = 0.01
DIM = 0.05
NO_LIGHT = 1e-6
"""Less than a code of 16 bits by an order: rounding."""


def describe_clip(path: Path, plan: Path | None) -> Description:
    """Describe a folder of frames or a movie, with the plan that belongs to it."""
    what = "clip folder" if path.is_dir() else "movie"
    try:
        clip = open_clip(path, plan=plan)
    except PsvideoError as error:
        of_itself = photograph_findings if path.is_dir() else movie_findings
        own = () if _has_plan(path, plan) else tuple(caught(of_itself(path)))
        return Description(path=path, kind=what, findings=(*own, fault(error)))
    findings = tuple(caught(_findings(clip)))
    return Description(path=path, kind=what, facts=_facts(clip), findings=findings)


def _has_plan(path: Path, plan: Path | None) -> bool:
    try:
        find_plan(path, given=plan)
    except PsvideoError:
        return False
    return True


def _facts(clip: Clip) -> dict[str, Fact]:
    return {
        "name": clip.name,
        "kind_of_files": clip.kind,
        "width_px": clip.width_px,
        "height_px": clip.height_px,
        "channels": clip.channels,
        "bits": clip.header.bits,
        "cfa": clip.cfa,
        "colour": clip.colour,
        "frames": len(clip.numbers),
        "first_number": clip.numbers[0],
        "last_number": clip.numbers[-1],
        "dropped_frames": sum(count for _, count in clip.dropped),
        "time_code": clip.time_code,
        "fps": float(clip.filmed_plan.camera.fps),
        "mode": clip.plan.mode,
        "lights": list(clip.plan.lights),
    }


def _findings(clip: Clip) -> Iterator[Finding]:
    first, last = clip.numbers[0], clip.numbers[-1]
    span = f"number {first}" if first == last else f"numbered {first} to {last}"
    yield ok(f"{counted(len(clip.numbers), 'frame')}, {span}: {clip.kind}, {looks(clip.header)}")
    yield from (warn(text) for text in clip.warnings)
    yield from (ok(text) for text in clip.notes)
    yield from _hole_findings(clip)
    yield from _likeness_findings(clip)
    yield from plan_findings(clip.filmed_plan)
    yield length_finding(clip.plan, clip.numbers)
    rig = clip.plan_path.with_name(RIG_FILE)
    if rig.is_file():
        yield from rig_findings(rig, clip.plan)
    yield from _level_findings(clip)
    if may_hide(clip):
        some = read_frames(clip, numbers_to_look_at(clip, clip.numbers))
        if saturation := hidden_saturation([rising_samples(frame.image) for frame in some], clip):
            yield warn(saturation.sentence)


def _hole_findings(clip: Clip) -> Iterator[Finding]:
    found = clip.dropped
    if not found:
        return
    shown = listed([f"{count} after {after}" for after, count in found], MANY, things="places")
    if clip.plan.mode == "synced":
        yield ok(f"the numbers have holes ({shown}): these frames, and the flashes in them, are missing")
    else:
        yield warn(f"{counted(sum(count for _, count in found), 'frame')} dropped: {shown}")


def _likeness_findings(clip: Clip) -> Iterator[Finding]:
    """Read every file's header: a frame of another size or depth, or an unreadable one, stops a run half way."""
    if clip.is_movie:
        return
    wrong = []
    for file in clip.files:
        try:
            found = looks(read_header(clip.kind, file))
        except PsvideoError as error:
            wrong.append(str(error))
            continue
        if found != looks(clip.header):
            wrong.append(f"{file}: is {found}, unlike the first frame")
    yield from (fault(text) for text in wrong[:MANY])
    if len(wrong) > MANY:
        yield fault(f"{len(wrong) - MANY} more frames like these")
    if not wrong:
        yield ok("all frames' headers are alike")


def level(light: float) -> str:
    """Return light in words: what is next to black is black, not -4.28e-07.

    >>> level(-4.28e-07), level(0.00123)
    ('0', '0.00123')
    """
    return f"{0.0 if abs(light) < NO_LIGHT else light:.3g}"


def _level_findings(clip: Clip) -> Iterator[Finding]:
    """Decode a few frames and hold their light against the levels: 0 is black, 1 saturation."""
    chosen = sorted({clip.numbers[0], clip.numbers[len(clip.numbers) // 2], clip.numbers[-1]})
    frames = (frame for number in chosen for frame in read_frames(clip, [number]))  # one by one: a movie seeks
    light = np.concatenate([frame.image.ravel() for frame in frames])
    low, high = (float(value) for value in np.percentile(light, (1, 99.9)))
    saturated = float(np.mean(light >= SATURATED))
    levels = f"light from {level(low)} to {level(high)} (1st and 99.9th percentile; 0 is black, 1 saturation)"
    if low < -DIM or high > 1.2:
        yield warn(f"{levels}: the plan's black_level or white_level does not fit the files' codes")
    elif saturated > SATURATED_SHARE:
        yield warn(f"{levels}: {saturated:.1%} of the pixels are saturated")
    elif high < DIM and white_of_others(clip.header, clip.encoding):
        return  # why all is dark is among the clip's warnings
    elif high < DIM:
        yield warn(f"{levels}: very dark, or white_level is not counted in the files' codes")
    else:
        yield ok(levels)
