"""A whole normals run: a clip in, a folder of files out, with decoding, computing and writing side by side."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.clip import Take
from psvideo.compute.progress import Watch, unwatched
from psvideo.compute.threads import writing
from psvideo.errors import PsvideoError, UsageError
from psvideo.export.mesh_files import animation_name
from psvideo.export.result_files import Delivery, is_written, mesh_file
from psvideo.export.tags import Tags
from psvideo.export.usd.usd_animation import write_animation
from psvideo.formats.timing_json import format_timing
from psvideo.formats.whole_files import write_text
from psvideo.model.choices import Solver
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.model.timing import Timing
from psvideo.plates.align.comb import Comb
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.gather import first_ambient, gather
from psvideo.plates.sequence import AMBIENT, coming
from psvideo.plates.unmixed import unmixing_note
from psvideo.report.observe.observed import InstantFacts
from psvideo.report.run_report import RunReport
from psvideo.runs.delivering import (
    check_delivery,
    pass_doubts,
    passes_asked,
    say_instants,
    surface_job,
    world_doubts,
    write_plates,
    write_specular,
)
from psvideo.runs.depths import shape_of
from psvideo.runs.handover import Finished, write_note, write_previews, write_stage, write_timeline
from psvideo.runs.lighting import Lighting
from psvideo.runs.look import look
from psvideo.runs.output import Output, folder_of, tags_of
from psvideo.runs.plates import nothing_complete
from psvideo.runs.reporting import Solved, observing, run_report, write_report
from psvideo.solve.depth import Shaping, reservations
from psvideo.solve.instants import Instant, denoised, surfaces
from psvideo.solve.normals.solving import Solving, trust_note

Pixels = NDArray[np.uint8]
SPECULAR_OF_LIGHTS = "specular_of_lights"
"""The folder of what exceeds the diffuse model under each light, sequences as those of the plates."""
SAMPLE_ROUND = 3
"""The round that the report shows, counted from 1; the first where there are fewer."""


@dataclass(frozen=True, kw_only=True)
class OverTime:
    """What is done between instants: how plates are brought to one, and how many results are averaged at rest."""

    aligning: Aligning = field(default_factory=Aligning)
    denoise: int = 1

    def check(self, plan: Plan, *, unmixed: bool = False) -> None:
        """Raise UsageError where a plan has no instant of its own for every light, and one is asked for; flashes that
        are taken apart by colour (``unmixed``) show all their lights at once."""
        if isinstance(self.aligning.rate, Comb) and self.aligning.align == "none":
            raise UsageError(
                "`fps` asks for instants between the flashes, and `align='none'` makes none: plates would be repeated. "
                "Leave one of the two out."
            )
        alone = unmixed or all(len(plan.flashes[slot].lit) == 1 for slot in plan.lit_slots)
        once = unmixed or len(plan.lit_slots) == len(plan.lights)
        if self.aligning.rate == "flash" and not (alone and once):
            raise UsageError(
                '`fps="flash"` needs a plan in which every light flashes once a round, by itself; in this one lights '
                "flash together, or several times. Leave it out: one result per round is given."
            )


@dataclass(frozen=True, kw_only=True)
class NormalsResult:
    """What a normals run gave: the report, and a picture of one round."""

    report: RunReport
    picture: Pixels


def _solving(solver: Solver, delivery: Delivery, *, fill: bool) -> Solving:
    return Solving(
        solver=solver,
        half=delivery.half,
        residual="residual" in delivery.aovs,
        error="error" in delivery.aovs,
        fill=fill,
    )


def normals_run(
    take: Take,
    timing: Timing,
    lighting: Lighting,
    output: Output,
    *,
    delivery: Delivery,
    solver: Solver = "auto",
    over_time: OverTime | None = None,
    fill: bool = True,
    watch: Watch = unwatched,
    picture_of: Callable[[Instant], Pixels] | None = None,
    beside: Callable[[Path, Instant], None] | None = None,
) -> NormalsResult:
    """Write normals, albedo and validity of every instant, timing.json and the report; return what is to be reported.

    ``picture_of`` makes the picture of one round; left out, it shows plates and surface. ``beside`` writes more of
    every instant into the folder.
    """
    take = take.unmixed(lighting.unmixing)
    clip = take.clip
    over_time = over_time or OverTime()
    over_time.check(clip.plan, unmixed=take.unmixing is not None)
    check_delivery(delivery, take, timing, output.start_number)
    if "motion" in delivery.aovs and over_time.aligning.align == "none":
        raise UsageError(
            "`aov='motion'` is what plates are brought to one instant by, and `align='none'` does not look for it. "
            "Leave one of the two out."
        )
    if lighting.masks is not None and over_time.aligning.rate == "round":
        coming_rounds = coming(clip.plan, timing.flashes, start=output.start_number).items()
        lighting.masks.check(number for number, lights in coming_rounds if lights >= set(clip.plan.lights))
    due = say_instants(take, timing, over_time.aligning, output)
    if due is not None and lighting.masks is not None:
        lighting.masks.check(iter(due.numbers))
    tags = tags_of(clip, lighting.rig_path, delivery.space, over_time.aligning.rate)
    shaping = lighting.shaping if delivery.needs_depth else None
    observed = observing(take, lighting.rig, lighting.masks)
    picture: Pixels | None = None
    solving = _solving(solver, delivery, fill=fill)
    method = solving.method(len(clip.plan.lights))
    asked = passes_asked(delivery)
    with (
        folder_of(output) as folder,
        _at_the_end(folder, take, output, observed.facts, delivery, tags, shaping, lighting.rig, watch),
        writing() as write,
    ):
        mixed = delivery.mix.of(AMBIENT) > 0
        rounds = gather(
            take,
            timing,
            aligning=over_time.aligning,
            with_ambient=mixed or delivery.plates,
            start_number=output.start_number,
            watch=watch,
            each_plate=observed.look,
            each_window=observed.look_at_window,
        )
        ambient = first_ambient(take, timing) if mixed else None
        found = surfaces(
            rounds,
            clip.plan,
            lighting.rig,
            masks=lighting.masks,
            solving=replace(solving, spare=folder),
            near=lighting.near,
            falloff=lighting.falloff,
            asked=asked,
        )
        for instant in found if over_time.denoise < 2 else denoised(found, over_time.denoise):
            shaping, shaped = shape_of(shaping, lighting, instant)
            ambient = (instant.round.ambient or ambient) if mixed else None
            if delivery.plates:
                write_plates(
                    folder / "plates",
                    clip.name,
                    instant.round,
                    tags,
                    compression=delivery.compression,
                    resume=output.resume,
                    write=write,
                )
                write_specular(
                    folder / SPECULAR_OF_LIGHTS, clip.name, instant, tags, compression=delivery.compression, write=write
                )
            if not (output.resume and is_written(folder, clip.name, instant.round.number, delivery)):
                # the surface only: plates are many times larger, and must not wait for the files
                write(surface_job(folder, clip, instant, delivery, tags, depth=shaped, ambient=ambient))
            del shaped  # it holds the surface too
            if beside is not None:
                beside(folder, instant)
            observed.add(instant.round, instant.surface)
            if len(observed.facts) in (1, SAMPLE_ROUND):
                picture = (picture_of or look)(instant)
            del instant  # its plates would be held while the next round gathers
        if picture is None:
            raise PsvideoError(nothing_complete(clip, timing))
        colours_said = () if take.unmixing is None else (unmixing_note(take.unmixing),)
        solved = Solved(
            lighting=lighting,
            solver=method,
            trust=" ".join([trust_note(method, len(clip.plan.lights)), *lighting.near_notes, *colours_said]),
            warnings=(
                *lighting.doubts,
                *pass_doubts(asked, clip.plan),
                *(() if shaping is None else reservations(shaping)),
                *world_doubts(delivery, lighting.rig, clip.width_px, metric=shaping is not None and shaping.metric),
            ),
            aligned=over_time.aligning.align != "none",
        )
        report = run_report(take, timing, observed, output, solved=solved)
        write_text(folder / "timing.json", format_timing(timing))
        write_report(folder, report, [("One round", picture)])
    return NormalsResult(report=report, picture=picture)


@contextmanager
def _at_the_end(
    folder: Path,
    take: Take,
    output: Output,
    facts: Sequence[InstantFacts],
    delivery: Delivery,
    tags: Tags,
    shaping: Shaping | None,
    rig: Rig,
    watch: Watch,
) -> Iterator[None]:
    """At the end of a block that wrote the files of all instants, make of them what needs them all."""
    yield
    if not facts:
        return
    clip = take.clip
    metric = shaping is not None and shaping.metric
    if "usd" in delivery.meshes:
        parts = {one.number: folder / mesh_file(clip.name, one.number, "usd") for one in facts}
        write_animation(folder / animation_name(clip.name), parts, tags.fps, metric=metric, space=delivery.space)
        for part in parts.values():
            part.unlink()
    run = Finished(folder=folder, target=output.folder, clip=clip, fps=tags.fps, first_time_s=facts[0].time_s)
    plates = [f"plates/{light}" for light in clip.plan.lights]
    write_previews(run, delivery.previews, delivery.codec, plates=plates, watch=watch)
    write_timeline(run)
    if delivery.program is not None or "usd" in delivery.meshes:
        write_stage(run, delivery, rig, {one.number: one.time_s for one in facts}, metric=metric)
    write_note(run, delivery, rig, first=facts[0].number, last=facts[-1].number, metric=metric, caller=output.caller)
