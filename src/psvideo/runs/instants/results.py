"""A whole normals run: a clip in, a folder of files out, with decoding, computing and writing side by side."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from psvideo.compute.heap import give_back
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError, UsageError
from psvideo.export.mesh_files import animation_name
from psvideo.export.sequences.result_files import mesh_file
from psvideo.export.usd.usd_animation import write_animation
from psvideo.formats.timing_json import format_timing
from psvideo.formats.whole_files import write_text
from psvideo.model.arrays import Pixels
from psvideo.model.units import listed
from psvideo.plates.align.comb import Comb
from psvideo.plates.sequence import coming
from psvideo.plates.several_lights.unmixed import unmixing_note
from psvideo.plates.used_flashes import used_of
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.run_report import RunReport
from psvideo.runs.delivery.beforehand import check_delivery, pass_doubts, say_instants, world_doubts
from psvideo.runs.delivery.for_programs import write_note, write_stage
from psvideo.runs.delivery.handover import Finished, write_previews, write_timeline
from psvideo.runs.instants.job import Found, Job
from psvideo.runs.instants.pieces import forget_pieces, pieced_together, pieces_begun, write_piece
from psvideo.runs.instants.plates import nothing_complete
from psvideo.runs.instants.reporting import run_report, write_report
from psvideo.runs.instants.shot_and_settings import Solved
from psvideo.runs.instants.solving import knowing_subject, write_instants
from psvideo.runs.steps.output import Output, begun_by, folder_of
from psvideo.solve.instants import Instant
from psvideo.solve.normals.solving import trust_note


@dataclass(frozen=True, kw_only=True)
class NormalsResult:
    """What a normals run gave: the report, and a picture of one round."""

    report: RunReport
    picture: Pixels


def normals_run(
    job: Job,
    output: Output,
    *,
    watch: Watch = unwatched,
    picture_of: Callable[[Instant], Pixels] | None = None,
    beside: Callable[[Path, Instant], None] | None = None,
) -> NormalsResult:
    """Write normals, albedo and validity of every instant, timing.json and the report; return what is to be reported.

    ``picture_of`` makes the picture of one round; left out, it shows plates and surface. ``beside`` writes more of
    every instant into the folder. What pieces have found already is taken over where the run is resumed.
    """
    job = _checked(job, output)
    give_back()  # frames as they were decoded for their timing lie otherwise than what comes
    with folder_of(output) as folder:
        if pieces_begun(folder):
            found = pieced_together(job, folder, watch=watch)
        else:
            job = knowing_subject(job, spare=folder, watch=watch)
            found = write_instants(job, folder, resume=output.resume, watch=watch, picture_of=picture_of, beside=beside)
        result = finished(job, folder, output, found, watch=watch)
        forget_pieces(folder)
        return result


def piece_run(job: Job, output: Output, piece: str, *, watch: Watch = unwatched) -> RunReport:
    """Solve a piece of a run, such as the third of ten, ``3/10``, into its unfinished folder; return its report.

    ``0/10`` notes what all pieces share, and solves none. Raises UsageError where ``piece`` is no such word.
    """
    job = _checked(job, output)
    with begun_by(output) as folder:
        return run_report(job.take, job.timing, write_piece(job, folder, piece, watch=watch).observed, output)


def _checked(job: Job, output: Output) -> Job:
    """Return the job with flashes separated by colour where the rig says so.

    Raises UsageError or PsvideoError where its parts do not fit together, before any work is done.
    """
    job = replace(job, take=job.take.unmixed(job.lighting.unmixing))
    take, timing, delivery, over_time, masks = job.take, job.timing, job.delivery, job.over_time, job.lighting.masks
    over_time.check(take.plan, unmixed=take.unmixing is not None)
    check_delivery(delivery, take, timing, job.start_number)
    if "motion" in delivery.aovs and over_time.aligning.align == "none":
        raise UsageError(
            "`aov='motion'` is what plates are brought to one instant by, and `align='none'` does not look for it. "
            "Leave one of the two out."
        )
    if masks is not None and masks.black:
        output.caller.say(f"{masks.path}: the masks of {listed(masks.black, 4)} are black: nothing is solved there.")
    if masks is not None and over_time.aligning.rate == "round":
        within = used_of(take, timing).flashes
        coming_rounds = coming(take.plan, timing.flashes, start=job.start_number, within=within).items()
        masks.check(number for number, lights in coming_rounds if lights >= set(take.plan.lights))
    due = say_instants(take, timing, over_time.aligning, output)
    if due is not None and masks is not None:
        masks.check(iter(due.numbers))
    return job


def finished(job: Job, folder: Path, output: Output, found: Found, *, watch: Watch = unwatched) -> NormalsResult:
    """Make of the files of all instants what needs them all, timing.json and the report; return it."""
    take, timing, lighting, delivery = job.take, job.timing, job.lighting, job.delivery
    give_back()  # movies' libraries come where pictures were
    if found.picture is None:
        raise PsvideoError(nothing_complete(take.clip, timing))
    method = job.solving.method(len(take.plan.lights))
    metric = job.shaping is not None and job.shaping.metric
    colours_said = () if take.unmixing is None else (unmixing_note(take.unmixing),)
    solved = Solved(
        lighting=lighting,
        solver=method,
        trust=" ".join([trust_note(method, len(take.plan.lights)), *lighting.near_notes, *colours_said]),
        depth=found.scale,
        warnings=(
            *lighting.doubts,
            *pass_doubts(job.asked, take.plan),
            *found.reserved,
            *world_doubts(delivery, lighting.rig, take.clip.width_px, metric=metric),
        ),
        aligned=job.over_time.aligning.align != "none",
        opened=isinstance(job.over_time.aligning.rate, Comb) and job.over_time.aligning.rate.open_s > 0,
    )
    if solved.depth:
        output.caller.say(output.caller.spell(solved.depth))
    report = run_report(take, timing, found.observed, output, solved=solved)
    write_text(folder / "timing.json", format_timing(timing))
    write_report(folder, report, [("One round", found.picture)])
    _hand_over(job, folder, output, found.observed.facts, metric=metric, watch=watch)
    return NormalsResult(report=report, picture=found.picture)


def _hand_over(
    job: Job, folder: Path, output: Output, facts: Sequence[InstantFacts], *, metric: bool, watch: Watch
) -> None:
    """Write what lies beside the sequences: one animation, movies, timeline, stage and note."""
    clip, delivery, fps, rig = job.take.clip, job.delivery, job.tags.fps, job.lighting.rig
    if "usd" in delivery.meshes:
        parts = {one.number: folder / mesh_file(clip.name, one.number, "usd") for one in facts}
        animation = folder / animation_name(clip.name)
        if not animation.is_file():
            write_animation(animation, parts, fps, metric=metric, space=delivery.space)
        for part in parts.values():
            part.unlink(missing_ok=True)
    run = Finished(folder=folder, target=output.folder, clip=clip, fps=fps, first_time_s=facts[0].time_s)
    plates = [f"plates/{light}" for light in clip.plan.lights]
    write_previews(run, delivery.previews, delivery.codec, plates=plates, watch=watch)
    write_timeline(run)
    if delivery.program is not None or "usd" in delivery.meshes:
        write_stage(run, delivery, rig, {one.number: one.time_s for one in facts}, metric=metric)
    write_note(run, delivery, rig, [one.number for one in facts], metric=metric, caller=output.caller)
