"""psvideo normals: normal maps and albedo for every round of flashes."""

from pathlib import Path
from typing import Annotated, Any

import typer

from psvideo.cli.commands.sync import describe_timing
from psvideo.cli.console import Voice, plain, print_report, print_takes
from psvideo.cli.options.clip_and_run import (
    ClipPaths,
    FirstLight,
    Force,
    Frames,
    PieceOption,
    PlanPath,
    Resume,
    RigPath,
    Sharing,
    StartNumber,
    TimingPath,
)
from psvideo.cli.options.delivery import (
    AovOption,
    CameraName,
    CameraTimeOption,
    CameraToWorld,
    CodecOption,
    CompressionOption,
    EncodeOption,
    FloatOption,
    MeshOption,
    Multipart,
    NoPreview,
    Plates,
    PreviewOption,
    ProgramOption,
    Separate,
    SpaceOption,
    Weights,
    WithAmbient,
    YOption,
)
from psvideo.cli.options.per_light import parse_weights
from psvideo.cli.options.records import spread
from psvideo.cli.options.solving import (
    AlignOption,
    Denoise,
    DepthPath,
    DepthScale,
    Fill,
    FlatPath,
    FpsOption,
    MaskPath,
    NearIterations,
    ResyncOption,
    ShutterOption,
    SolverOption,
)
from psvideo.cli.options.typed import chosen_previews, parse_instants
from psvideo.model.choices import USUAL_COMPRESSION
from psvideo.model.units import counted


@spread
def normals(
    context: typer.Context,
    clips: ClipPaths,
    rig: RigPath,
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder to write.")],
    *,
    plan: PlanPath = None,
    timing: TimingPath = None,
    mask: MaskPath = None,
    flat: FlatPath = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    solver: SolverOption = "auto",
    fill: Fill = True,
    near_iterations: NearIterations = None,
    depth: DepthPath = None,
    depth_scale: DepthScale = None,
    preset: ProgramOption = None,
    space: SpaceOption = None,
    camera_to_world: CameraToWorld = None,
    camera: CameraName = None,
    camera_time: CameraTimeOption = None,
    y: YOption = None,
    align: AlignOption = "auto",
    fps: FpsOption = "round",
    shutter: ShutterOption = None,
    resync: ResyncOption = None,
    denoise: Denoise = 1,
    float32: FloatOption = False,
    aov: AovOption = None,
    mesh: MeshOption = None,
    encode: EncodeOption = None,
    separate: Separate = True,
    compression: CompressionOption = USUAL_COMPRESSION,
    multipart: Multipart = None,
    plates: Plates = False,
    with_ambient: WithAmbient = False,
    weight: Weights = None,
    preview: PreviewOption = None,
    no_preview: NoPreview = False,
    preview_codec: CodecOption = "both",
    start_number: StartNumber = 1001,
    force: Force = False,
    resume: Resume = False,
    piece: PieceOption = None,
    sharing: Sharing,
    voice: Voice,
) -> None:
    """Write normals, albedo and validity for every round of flashes; does sync and split by itself."""
    from psvideo.report.run_report import report_record
    from psvideo.runs.many_takes.normals_of_takes import normals_of_takes
    from psvideo.runs.normals import normals as solve

    options: dict[str, Any] = dict(  # noqa: C408, as they are called below
        rig=rig,
        plan=plan,
        timing=timing,
        mask=mask,
        flat=flat,
        frames=frames,
        first_light=first_light,
        solver=solver,
        fill=fill,
        near_iterations=near_iterations,
        depth=depth,
        depth_scale=depth_scale,
        align=align,
        fps=parse_instants(fps),
        shutter=shutter,
        resync=resync,
        denoise=denoise,
        preset=preset,
        space=space,
        camera_to_world=camera_to_world,
        camera=camera,
        camera_time=camera_time,
        y=y,
        float32=float32,
        aov=plain(aov),
        mesh=plain(mesh),
        encode=encode,
        compression=compression,
        multipart=multipart,
        plates=plates,
        with_ambient=with_ambient,
        weight=parse_weights(weight),
        preview=chosen_previews(preview, no_preview=no_preview),
        preview_codec=preview_codec,
        start_number=start_number,
    )
    common: dict[str, Any] = {"force": force, "resume": resume, "watch": voice.track, "caller": voice.caller(context)}
    if len(clips) > 1 or sharing.asked:
        results = normals_of_takes(clips, out=out, **vars(sharing), piece=piece, **common, **options)
        print_takes(voice, results)
        return
    report = solve(clips[0], out=out, piece=piece, **common, **options)
    voice.result(report_record(report))
    if piece is not None:
        voice.say(f"{out}: piece {piece} is solved, {counted(len(report.instants), 'instant')}; --resume ends the run.")
        return
    voice.say(describe_timing(report.timing))
    print_report(voice, report)
    voice.say(f"{out}: {counted(len(report.instants), 'instant')} written; see {out / 'report.html'}.")
