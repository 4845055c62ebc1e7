"""psvideo normals: normal maps and albedo for every round of flashes."""

from enum import StrEnum
from math import inf
from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice, command_line, counted, tell_kept, tell_report
from psvideo.cli.delivery_options import (
    AovOption,
    CameraName,
    CameraTimeOption,
    CameraToWorld,
    CodecName,
    CodecOption,
    EncodeOption,
    FloatOption,
    MeshOption,
    Multipart,
    Plates,
    PreviewOption,
    ProgramOption,
    Separate,
    SpaceOption,
    Weights,
    WithAmbient,
    YOption,
)
from psvideo.cli.options import (
    ClipPath,
    FirstLight,
    Force,
    Frames,
    Json,
    PlanPath,
    Quiet,
    Resume,
    StartNumber,
    TimingPath,
    Verbose,
)
from psvideo.cli.sync import describe_timing
from psvideo.errors import UsageError
from psvideo.solve.near_limits import MOST_ITERATIONS, NEAR_ITERATIONS


class SolverName(StrEnum):
    """How normals are solved."""

    auto = "auto"
    least_squares = "least-squares"
    robust = "robust"


class AlignName(StrEnum):
    """How plates of one round are brought to one instant."""

    none = "none"
    flow = "flow"
    auto = "auto"


class RateName(StrEnum):
    """Which instants are delivered."""

    round = "round"
    flash = "flash"


def normals(
    context: typer.Context,
    clip: ClipPath,
    rig: Annotated[Path, typer.Option("--rig", help="Where the lights are: rig.toml, .lp, DiLiGenT or UW list.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder to write.")],
    plan: PlanPath = None,
    timing: TimingPath = None,
    mask: Annotated[Path | None, typer.Option("--mask", help="A picture, white where to solve.")] = None,
    flat: Annotated[
        Path | None, typer.Option(help="How light falls off over the picture, from psvideo calibrate flat-field.")
    ] = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    solver: Annotated[
        SolverName,
        typer.Option(help="auto: robust against highlights and shadows from five lights on."),
    ] = SolverName.auto,
    near_iterations: Annotated[
        int | None,
        typer.Option(
            help="Near lights only: how often their distances are taken anew from the depth of the normals found. "
            f"[default: {NEAR_ITERATIONS}; 0 with --depth]",
            min=0,
            max=MOST_ITERATIONS,
        ),
    ] = None,
    depth: Annotated[
        Path | None,
        typer.Option(
            "--depth",
            help="Known depth: an EXR in metres along the optical axis or a 16-bit PNG in millimetres, or a folder "
            "with one per result. Near lights find the surface there, and depth its scale.",
        ),
    ] = None,
    depth_scale: Annotated[
        float | None,
        typer.Option("--depth-scale", help="Metres per unit of --depth. [default: 1 for floats, 0.001 for integers]"),
    ] = None,
    program: ProgramOption = None,
    space: SpaceOption = None,
    camera_to_world: CameraToWorld = None,
    camera: CameraName = None,
    camera_time: CameraTimeOption = None,
    y: YOption = None,
    align: Annotated[
        AlignName,
        typer.Option(
            help="Bring the plates of a round, which show different instants, to one. auto: where something moves; "
            "flow: look for motion everywhere; none: leave them as they are."
        ),
    ] = AlignName.auto,
    rate: Annotated[
        RateName, typer.Option(help="One result per round, or one per flash: as many times more as there are lights.")
    ] = RateName.round,
    denoise: Annotated[int, typer.Option(min=1, max=64, help="Average up to N results where nothing moves.")] = 1,
    float32: FloatOption = False,
    aov: AovOption = None,
    mesh: MeshOption = None,
    encode: EncodeOption = None,
    separate: Separate = True,
    multipart: Multipart = None,
    plates: Plates = False,
    with_ambient: WithAmbient = False,
    weight: Weights = None,
    preview: PreviewOption = None,
    preview_codec: CodecOption = CodecName.vp9,
    start_number: StartNumber = 1001,
    force: Force = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Write normals, albedo and validity for every round of flashes; does sync and split by itself."""
    from psvideo.cli.delivery import Asked, delivery_of
    from psvideo.cli.opening import open_and_tell
    from psvideo.clip import decoded_once
    from psvideo.export.usd.core import require_usd
    from psvideo.plates.align.rounds import Aligning
    from psvideo.report.run_report import report_record
    from psvideo.runs import Output, OverTime, normals_run, read_lighting, timing_of

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    output = Output(folder=out, force=force, resume=resume, start_number=start_number, command=command_line(context))
    output.check()
    asked = Asked(
        program=program,
        space=space,
        camera_to_world=camera_to_world,
        camera=camera,
        camera_time=camera_time,
        y=y,
        float32=float32,
        aovs=aov or (),
        meshes=mesh or (),
        encode=encode,
        multipart=multipart,
        plates=plates,
        with_ambient=with_ambient,
        weights=weight or (),
        previews=preview or (),
        codec=preview_codec,
    )
    delivery, at_odds = delivery_of(asked)
    for sentence in at_odds:
        voice.warn(sentence)
    if "usd" in delivery.meshes:
        require_usd()
    if depth_scale is not None and (depth is None or not 0 < depth_scale < inf):
        raise UsageError(
            f"--depth-scale {depth_scale:g}: expected metres per unit, above 0, of the file given as --depth."
        )
    over_time = OverTime(aligning=Aligning(align=align.value, rate=rate.value), denoise=denoise)
    take = open_and_tell(clip, voice, plan=plan, frames=frames)
    over_time.check(take.plan)
    lighting = read_lighting(
        take, rig, mask, near_iterations=near_iterations, depth_path=depth, metres_per_unit=depth_scale, flat_path=flat
    )
    lighting.check(delivery)
    with decoded_once(take, output=out) as take:
        found = timing_of(take, timing, first_light=first_light, rig=lighting.rig, watch=voice.track)
        report = normals_run(
            take,
            found,
            lighting,
            output,
            delivery=delivery,
            solver=solver.value,
            over_time=over_time,
            watch=voice.track,
        ).report
        tell_kept(voice, take.kept)
    voice.result(report_record(report))
    voice.say(describe_timing(found))
    for note in found.notes:
        voice.warn(note)
    tell_report(voice, report)
    voice.say(f"{out}: {counted(len(report.instants), 'instant')} written; see {out / 'report.html'}.")
