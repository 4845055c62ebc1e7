"""Whole runs: a clip in, a folder of files out, with decoding, computing and writing side by side."""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo import __version__
from psvideo.align.rounds import Aligning, Rate, aligned
from psvideo.clip import Clip, read_mask
from psvideo.errors import PsvideoError, UsageError
from psvideo.export.mesh import animation_name
from psvideo.export.plates import plate_name, write_flash, write_plate
from psvideo.export.publish import refuse_folder, whole_folder
from psvideo.export.results import Delivery, is_written, mesh_file, write_surface
from psvideo.export.space import CAMERA_SPACE, Space
from psvideo.export.tags import Tags, sha256_of
from psvideo.export.usd import write_animation
from psvideo.export.writer import writing
from psvideo.files import write_text
from psvideo.integrate import Shaping, begun, depth_of, reservations, view_of
from psvideo.naming import named_by_rig, named_first
from psvideo.near_surface import NEAR_ITERATIONS, NearSurface, near_surface_of, near_trust
from psvideo.normals.illumination import illumination
from psvideo.normals.solving import Solver, Solving, trust_note
from psvideo.pipeline import (
    Instant,
    Method,
    Take,
    Watch,
    clip_rounds,
    denoised,
    find_clip_timing,
    lights_as_planned,
    surfaces,
    unwatched,
)
from psvideo.plan import Plan
from psvideo.rig import Rig
from psvideo.rigfile import read_rig
from psvideo.sequence import FIRST_NUMBER, check_separable, round_numbers
from psvideo.timing import Timing, format_timing, read_timing
from psvideo.view.contact import Strip, Tile, sheet
from psvideo.view.report import InstantFacts, RunReport, instant_facts, report_page, report_record
from psvideo.view.shading import exposure_for, normal_colours, smaller, srgb
from psvideo.view.steadiness import Sample, change, sample_of

Pixels = NDArray[np.uint8]
MARK = "timing.json"
"""The file by which a folder of plates or results is known."""
SHOWN_WIDTH_PX = 600
UNSURE_DEG = 5.0
"""A rig whose own standard error is so large is told of in the report; a guessed one says 20."""
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
        refuse_folder(self.folder, mark=MARK, force=self.force)


def timing_of(
    take: Take, given: Path | None, *, first_light: str | None, rig: Rig | None = None, watch: Watch = unwatched
) -> Timing:
    """Return a take's timing: the file that is given, else found from the picture.

    ``first_light`` names the light of the first complete flash. Left out, and with no marker in the plan, the lights'
    order is told by the ``rig`` where it can be. Raises PsvideoError where the file belongs to another clip.
    """
    if given is None:
        timing = find_clip_timing(take, first_light=first_light, watch=watch)
    else:
        timing = read_timing(given)
        wrong = _misfit(timing, take)
        if wrong:
            raise PsvideoError(f"{given}: {wrong}. Leave --timing out, or make it again with psvideo sync.")
        if first_light is not None:
            timing = named_first(take, timing, first_light)
    return timing if rig is None else named_by_rig(take, timing, rig)


def _misfit(timing: Timing, take: Take) -> str | None:
    """Return why a timing cannot be this clip's, None where it can."""
    plan = take.plan
    if timing.clip != take.clip.name:
        return f"is the timing of the clip {timing.clip!r}, and this clip is {take.clip.name!r}"
    if abs(timing.frame_period_s / plan.camera.frame_period_s - 1) > 1e-6:
        return f"has frames of {timing.frame_period_s:.6g} s, and the plan {plan.camera.frame_period_s:.6g} s"
    if [flash.index for flash in timing.flashes] != list(range(len(timing.flashes))):
        return "its flashes are not numbered 0, 1, 2 and so on without a hole"
    for flash in timing.flashes:
        if flash.slot >= len(plan.flashes) or dict(flash.lights) != dict(plan.flashes[flash.slot].lights):
            return f"its flash {flash.index} (slot {flash.slot}, {dict(flash.lights)}) is not in the plan's list"
    return None


def _settings(take: Take, timing: Timing, output: Output, *what: object) -> str:
    """Return what a run depends on as a digest; a stopped run is resumed only under the same."""
    numbers = f"{take.numbers[0]}-{take.numbers[-1]} ({len(take.numbers)})"
    plan = sha256_of(take.clip.plan_path)
    parts = [__version__, take.clip.path.resolve(), numbers, plan, format_timing(timing), output.start_number, *what]
    return hashlib.sha256("\n".join(map(str, parts)).encode()).hexdigest()


def sequence_fps(plan: Plan, rate: Rate = "round") -> Fraction:
    """Return the rate of rounds, or of the lights' flashes, at which a sequence is delivered; the mean where dark slots
    come between."""
    results = len(plan.lights) if rate == "flash" else 1
    if plan.mode == "synced":
        return results * plan.camera.fps / len(plan.flashes)
    return Fraction(results * plan.dark_every / plan.cycle_s).limit_denominator(100_000)


@dataclass(frozen=True, kw_only=True)
class OverTime:
    """What is done between instants: how plates are brought to one, and how many results are averaged at rest."""

    aligning: Aligning = field(default_factory=lambda: Aligning(align="none"))
    denoise: int = 1

    def check(self, plan: Plan) -> None:
        """Raise UsageError where a plan has no instant of its own for every light, and one is asked for."""
        alone = all(sum(power > 0 for power in plan.flashes[slot].lights.values()) == 1 for slot in plan.lit_slots)
        if self.aligning.rate == "flash" and not (alone and len(plan.lit_slots) == len(plan.lights)):
            raise UsageError(
                "--rate flash needs a plan in which every light flashes once a round, by itself; in this one lights "
                "flash together, or several times. Leave it out: one result per round is given."
            )


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
    settings = _settings(take, timing, output, method, flashes)
    with _folder(output, settings) as folder, writing() as write:
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


def _folder(output: Output, settings: str) -> AbstractContextManager[Path]:
    return whole_folder(output.folder, mark=MARK, force=output.force, resume=output.resume, settings=settings)


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


@dataclass(frozen=True, kw_only=True)
class Lighting:
    """What is solved with, read and checked before a long run begins: the rig, for near lights where the surface is
    taken to be, and where to solve."""

    rig_path: Path
    rig: Rig
    condition: float
    near: NearSurface | None = None
    mask: NDArray[np.bool_] | None = None

    @property
    def near_iterations(self) -> int:
        """How often the surface is made anew for near lights; 0 where there are none."""
        return 0 if self.near is None else self.near.iterations

    @property
    def near_notes(self) -> tuple[str, ...]:
        """What normals depend on where lights are near, in whole sentences."""
        return () if self.near is None else (near_trust(self.near),)

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is to be distrusted about the rig itself, in whole sentences."""
        worst = max(self.rig.lights, key=lambda light: light.error_deg or 0.0)
        if (worst.error_deg or 0.0) < UNSURE_DEG:
            return ()
        return (
            f"The rig file itself says that its lights are sure to {worst.error_deg:g} degrees only "
            f"({worst.name!r}): normals are wrong by about as much. Calibrate on a sphere.",
        )

    @property
    def mask_sha256(self) -> str | None:
        """The digest of the mask, None where there is none."""
        return None if self.mask is None else hashlib.sha256(self.mask.tobytes()).hexdigest()


def read_lighting(
    take: Take, rig_path: Path, mask_path: Path | None = None, *, near_iterations: int = NEAR_ITERATIONS
) -> Lighting:
    """Read rig and mask of a take; ``near_iterations`` is how often near lights' surface is made anew.

    Raises PsvideoError where they do not fit the plan, or give no normals.
    """
    clip = take.clip
    check_separable(clip.plan)
    rig = read_rig(rig_path, plan_lights=clip.plan.lights)
    lights = lights_as_planned(rig, clip.plan)
    near = near_surface_of(rig, lights, height_px=clip.height_px, width_px=clip.width_px, iterations=near_iterations)
    lit = illumination(lights, channels=clip.channels, ground=None if near is None else near.ground)
    mask = None if mask_path is None else read_mask(mask_path, width_px=clip.width_px, height_px=clip.height_px)
    return Lighting(rig_path=rig_path, rig=rig, condition=lit.condition, near=near, mask=mask)


def _solving(plan: Plan, solver: Solver, delivery: Delivery) -> Solving:
    solving = Solving(
        solver=solver, half=delivery.half, residual="residual" in delivery.aovs, error="error" in delivery.aovs
    )
    method = solving.method(len(plan.lights))
    if solving.error and method != "robust":
        raise UsageError(
            f"--aov error is what the robust solver predicts, and this run of {len(plan.lights)} lights uses "
            f"{method}. Add --solver robust, or leave --aov error out."
        )
    return solving


def normals_run(
    take: Take,
    timing: Timing,
    lighting: Lighting,
    output: Output,
    *,
    delivery: Delivery,
    solver: Solver = "auto",
    over_time: OverTime | None = None,
    watch: Watch = unwatched,
    picture_of: Callable[[Instant], Pixels] | None = None,
) -> NormalsResult:
    """Write normals, albedo and validity of every instant, timing.json and the report; return what is to be reported.

    ``picture_of`` makes the picture of one round; left out, it shows plates and surface.
    """
    clip, mask = take.clip, lighting.mask
    over_time = over_time or OverTime()
    over_time.check(clip.plan)
    tags = _tags(clip, lighting.rig_path, delivery.space, over_time.aligning.rate)
    shaping = Shaping(view=view_of(lighting.rig), plane=lighting.rig.plane) if delivery.needs_depth else None
    facts: list[InstantFacts] = []
    picture: Pixels | None = None
    seen: Sample | None = None
    solving = _solving(clip.plan, solver, delivery)
    method = solving.method(len(clip.plan.lights))
    light = (lighting.mask_sha256, method, lighting.near_iterations)
    settings = _settings(take, timing, output, tags, delivery, over_time, *light)
    with (
        _folder(output, settings) as folder,
        _animation(folder, clip.name, facts, delivery, tags, shaping),
        writing() as write,
    ):
        rounds = clip_rounds(take, timing, start_number=output.start_number, watch=watch)
        rounds = aligned(rounds, clip.plan.lights, over_time.aligning, first=output.start_number)
        found = surfaces(rounds, clip.plan, lighting.rig, mask=mask, solving=solving, near=lighting.near)
        for instant in found if over_time.denoise < 2 else denoised(found, over_time.denoise):
            if shaping is not None and shaping.first is None:
                shaping = begun(shaping, instant.surface)
            if not (output.resume and is_written(folder, clip.name, instant.round.number, delivery)):
                # the surface only: plates are many times larger, and must not wait for the files
                surface, at = instant.surface, (instant.round.number, instant.round.time_s)
                shaped = None if shaping is None else partial(depth_of, shaping, surface)
                write(
                    partial(write_surface, folder, clip.name, *at, surface, delivery=delivery, tags=tags, depth=shaped)
                )
                del surface
            before, seen = seen, sample_of(instant.surface)
            changed = None if before is None else change(before, seen)
            facts.append(instant_facts(instant.round, instant.surface, mask, changed))
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
            condition=lighting.condition,
            solver=method,
            trust=" ".join([trust_note(method, len(clip.plan.lights)), *lighting.near_notes]),
            instants=tuple(facts),
            warnings=(*lighting.doubts, *(() if shaping is None else reservations(shaping))),
        )
        write_text(folder / "timing.json", format_timing(timing))
        write_text(folder / "report.json", json.dumps(report_record(report), indent=1) + "\n")
        write_text(folder / "report.html", report_page(report, [("One round", picture)]))
    return NormalsResult(report=report, picture=picture)


def _tags(clip: Clip, rig_path: Path | None = None, space: Space = CAMERA_SPACE, rate: Rate = "round") -> Tags:
    return Tags(
        fps=sequence_fps(clip.plan, rate),
        colour=clip.colour,
        plan_sha256=sha256_of(clip.plan_path),
        rig_sha256=None if rig_path is None else sha256_of(rig_path),
        space=space.name,
        y=space.y,
        camera_fps=clip.plan.camera.fps,
        first_time_code=clip.time_code,
    )


@contextmanager
def _animation(
    folder: Path, clip: str, facts: Sequence[InstantFacts], delivery: Delivery, tags: Tags, shaping: Shaping | None
) -> Iterator[None]:
    """At the end of a block that wrote the meshes of all instants, make one animated file of them where asked for."""
    yield
    if shaping is None or not facts or "usd" not in delivery.meshes:
        return
    parts = {one.number: folder / mesh_file(clip, one.number, "usd") for one in facts}
    write_animation(folder / animation_name(clip), parts, tags.fps, metric=shaping.metric)
    for part in parts.values():
        part.unlink()


def look(instant: Instant) -> Pixels:
    """Return a picture of one instant for eyes: its plates, its normals and its albedo."""
    shown = [(plate.light, smaller(plate.image, SHOWN_WIDTH_PX)) for plate in instant.round.plates]
    exposure = exposure_for(shown[0][1])
    albedo = smaller(instant.surface.albedo, SHOWN_WIDTH_PX)
    normals = smaller(instant.surface.normals, SHOWN_WIDTH_PX)
    surface = [Tile("normals", normal_colours(normals)), Tile("albedo", srgb(albedo, exposure=exposure_for(albedo)))]
    plates = [Tile(light, srgb(picture, exposure=exposure)) for light, picture in shown]
    return sheet([Strip("Plates, one per light", plates), Strip("Surface", surface)], width_px=1200)
