"""Whole runs: a clip in, a folder of files out, with decoding, computing and writing side by side."""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo import __version__
from psvideo.clip import Clip, read_mask
from psvideo.errors import PsvideoError
from psvideo.export.plates import plate_name, write_flash, write_plate
from psvideo.export.publish import whole_folder
from psvideo.export.results import Delivery, is_written, write_surface
from psvideo.export.space import CAMERA_SPACE, Space
from psvideo.export.tags import Tags, sha256_of
from psvideo.export.writer import writing
from psvideo.files import refuse_existing, write_text
from psvideo.normals.illumination import illumination
from psvideo.pipeline import (
    Instant,
    Method,
    Take,
    Watch,
    clip_rounds,
    find_clip_timing,
    lights_as_planned,
    surfaces,
    unwatched,
)
from psvideo.plan import Plan
from psvideo.rigfile import read_rig
from psvideo.sequence import FIRST_NUMBER, round_numbers
from psvideo.timing import Timing, format_timing, read_timing
from psvideo.view.contact import Strip, Tile, sheet
from psvideo.view.report import InstantFacts, RunReport, instant_facts, report_page, report_record
from psvideo.view.shading import exposure_for, normal_colours, smaller, srgb

Pixels = NDArray[np.uint8]
SHOWN_WIDTH_PX = 600
SAMPLE_ROUND = 3
"""The round that the report shows, counted from 1; the first where there are fewer."""


@dataclass(frozen=True, kw_only=True)
class Output:
    """Where a run writes, and what it may do there."""

    folder: Path
    force: bool = False
    resume: bool = False
    start_number: int = FIRST_NUMBER

    def check(self) -> None:
        """Raise UsageError where the folder exists and may not be replaced, before any work is done."""
        refuse_existing(self.folder, force=self.force)


def timing_of(take: Take, given: Path | None, *, first_light: str | None, watch: Watch = unwatched) -> Timing:
    """Return a take's timing: the file that is given, else found from the picture.

    Raises PsvideoError where the file belongs to another clip.
    """
    if given is None:
        return find_clip_timing(take, first_light=first_light, watch=watch)
    timing = read_timing(given)
    if timing.clip != take.clip.name:
        raise PsvideoError(
            f"{given}: is the timing of the clip {timing.clip!r}, and this clip is {take.clip.name!r}. "
            "Leave --timing out, or make it again with psvideo sync."
        )
    return timing


def sequence_fps(plan: Plan) -> Fraction:
    """Return the rate of rounds, which is that of every delivered sequence; the mean where dark slots are rarer."""
    if plan.mode == "synced":
        return plan.camera.fps / len(plan.flashes)
    return Fraction(plan.dark_every / plan.cycle_s).limit_denominator(100_000)


def split_run(
    take: Take,
    timing: Timing,
    output: Output,
    *,
    method: Method = "weights",
    flashes: bool = False,
    watch: Watch = unwatched,
) -> Timing:
    """Write one sequence per light, ambient where there are dark slots, and timing.json; return what that holds."""
    clip = take.clip
    tags = _tags(clip)
    written: set[str] = set()
    with whole_folder(output.folder, force=output.force, resume=output.resume) as folder, writing() as write:
        each = (lambda plate: write(partial(write_flash, folder, clip.name, plate, tags))) if flashes else None
        for one in clip_rounds(
            take, timing, method=method, start_number=output.start_number, watch=watch, each_flash=each
        ):
            for plate in (*one.plates, *((one.ambient,) if one.ambient else ())):
                name = plate_name(clip.name, plate.light, plate.number)
                written.add(name)
                if not (output.resume and (folder / name).is_file()):
                    write(partial(write_plate, folder, clip.name, plate, tags))
        if not written:
            raise PsvideoError(_nothing_complete(clip, timing))
        timing = _with_plates(timing, clip.name, written, start_number=output.start_number)
        write_text(folder / "timing.json", format_timing(timing))
    return timing


def _nothing_complete(clip: Clip, timing: Timing) -> str:
    return (
        f"{clip.path}: holds no round in which every flash is complete ({len(timing.flashes)} flashes are seen), so "
        "there is nothing to write. Use more frames: a round needs as many as it has flashes, and one or two more."
    )


def _with_plates(timing: Timing, clip: str, written: set[str], *, start_number: int) -> Timing:
    """Note every flash's plate where one was written of the light that it shows alone, or of the ambient light."""
    numbers = round_numbers(timing.flashes, start=start_number)
    flashes = []
    for flash, number in zip(timing.flashes, numbers, strict=True):
        lit = [light for light, power in flash.lights.items() if power > 0]
        name = plate_name(clip, lit[0] if lit else "ambient", number)
        noted = flash.complete and len(lit) <= 1 and name in written
        flashes.append(replace(flash, plate=name if noted else None))
    return replace(timing, flashes=tuple(flashes))


@dataclass(frozen=True, kw_only=True)
class NormalsResult:
    """What a normals run gave: the report, and a picture of one round."""

    report: RunReport
    picture: Pixels


def normals_run(
    take: Take,
    timing: Timing,
    rig_path: Path,
    output: Output,
    *,
    delivery: Delivery,
    mask_path: Path | None = None,
    watch: Watch = unwatched,
    picture_of: Callable[[Instant], Pixels] | None = None,
) -> NormalsResult:
    """Write normals, albedo and validity of every round, timing.json and the report; return what is to be reported.

    ``picture_of`` makes the picture of one round; left out, it shows plates and surface.
    """
    clip = take.clip
    rig = read_rig(rig_path, plan_lights=clip.plan.lights)
    mask = None if mask_path is None else read_mask(mask_path, width_px=clip.width_px, height_px=clip.height_px)
    lit = illumination(lights_as_planned(rig, clip.plan), channels=clip.channels)
    tags = _tags(clip, rig_path, delivery.space)
    facts: list[InstantFacts] = []
    picture: Pixels | None = None
    with whole_folder(output.folder, force=output.force, resume=output.resume) as folder, writing() as write:
        rounds = clip_rounds(take, timing, start_number=output.start_number, watch=watch)
        residual = "residual" in delivery.aovs
        for instant in surfaces(rounds, clip.plan, rig, mask=mask, half=delivery.half, residual=residual):
            if not (output.resume and is_written(folder, clip.name, instant.round.number, delivery)):
                write(partial(_write_instant, folder, clip.name, instant, delivery, tags))
            facts.append(instant_facts(instant.round, instant.surface, mask))
            if len(facts) in (1, SAMPLE_ROUND):
                picture = (picture_of or look)(instant)
            del instant  # its plates would be held while the next round gathers
        if picture is None:
            raise PsvideoError(_nothing_complete(clip, timing))
        report = RunReport(
            clip=clip.name,
            version=__version__,
            timing=timing,
            lights=clip.plan.lights,
            condition=lit.condition,
            instants=tuple(facts),
        )
        write_text(folder / "timing.json", format_timing(timing))
        write_text(folder / "report.json", json.dumps(report_record(report), indent=1) + "\n")
        write_text(folder / "report.html", report_page(report, [("One round", picture)]))
    return NormalsResult(report=report, picture=picture)


def _tags(clip: Clip, rig_path: Path | None = None, space: Space = CAMERA_SPACE) -> Tags:
    return Tags(
        fps=sequence_fps(clip.plan),
        colour=clip.colour,
        plan_sha256=sha256_of(clip.plan_path),
        rig_sha256=None if rig_path is None else sha256_of(rig_path),
        space=space.name,
        y=space.y,
        camera_fps=clip.plan.camera.fps,
        first_time_code=clip.time_code,
    )


def _write_instant(folder: Path, clip: str, instant: Instant, delivery: Delivery, tags: Tags) -> None:
    one = instant.round
    write_surface(folder, clip, one.number, one.time_s, instant.surface, delivery=delivery, tags=tags)


def look(instant: Instant) -> Pixels:
    """Return a picture of one instant for eyes: its plates, its normals and its albedo."""
    shown = [(plate.light, smaller(plate.image, SHOWN_WIDTH_PX)) for plate in instant.round.plates]
    exposure = exposure_for(shown[0][1])
    albedo = smaller(instant.surface.albedo, SHOWN_WIDTH_PX)
    normals = smaller(instant.surface.normals, SHOWN_WIDTH_PX)
    surface = [Tile("normals", normal_colours(normals)), Tile("albedo", srgb(albedo, exposure=exposure_for(albedo)))]
    plates = [Tile(light, srgb(picture, exposure=exposure)) for light, picture in shown]
    return sheet([Strip("Plates, one per light", plates), Strip("Surface", surface)], width_px=1200)
