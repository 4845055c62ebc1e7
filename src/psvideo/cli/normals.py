"""psvideo normals: normal maps and albedo for every round of flashes."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from psvideo.align.rounds import Aligning
from psvideo.cli.console import Voice, tell_kept
from psvideo.cli.opening import open_and_tell
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
from psvideo.export.results import Delivery
from psvideo.export.space import choose_space
from psvideo.export.usd import require_usd
from psvideo.near_surface import MOST_ITERATIONS, NEAR_ITERATIONS
from psvideo.pipeline import decoded_once
from psvideo.runs import Output, OverTime, normals_run, read_lighting, timing_of
from psvideo.view.report import findings, report_record, verdict


class SpaceName(StrEnum):
    """The frame of the delivered normals."""

    camera = "camera"
    world = "world"
    tangent = "tangent"


class YDirection(StrEnum):
    """Which way the green channel points."""

    up = "up"
    down = "down"


class SolverName(StrEnum):
    """How normals are solved."""

    auto = "auto"
    least_squares = "least-squares"
    robust = "robust"


class Aov(StrEnum):
    """What may be written besides."""

    residual = "residual"
    error = "error"
    depth = "depth"
    position = "position"


class MeshKind(StrEnum):
    """Kinds of files for the surface as a mesh."""

    ply = "ply"
    usd = "usd"


class AlignName(StrEnum):
    """How plates of one round are brought to one instant."""

    none = "none"
    flow = "flow"
    auto = "auto"


class RateName(StrEnum):
    """Which instants are shown."""

    round = "round"
    flash = "flash"


class Encoding(StrEnum):
    """Other encodings of the same maps."""

    png16 = "png16"


def normals(
    clip: ClipPath,
    rig: Annotated[Path, typer.Option("--rig", help="Where the lights are: rig.toml, .lp, DiLiGenT or UW list.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder to write.")],
    plan: PlanPath = None,
    timing: TimingPath = None,
    mask: Annotated[Path | None, typer.Option("--mask", help="A picture, white where to solve.")] = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    solver: Annotated[
        SolverName,
        typer.Option(help="auto: robust against highlights and shadows from five lights on."),
    ] = SolverName.least_squares,
    near_iterations: Annotated[
        int,
        typer.Option(
            help="Near lights only: how often their distances are taken anew from the depth of the normals found.",
            min=0,
            max=MOST_ITERATIONS,
        ),
    ] = NEAR_ITERATIONS,
    space: Annotated[SpaceName, typer.Option(help="Camera axes, the world's, or a flat card's.")] = SpaceName.camera,
    camera_to_world: Annotated[
        Path | None, typer.Option("--camera-to-world", help="For --space world: a text file, 3 x 3 or 4 x 4 matrix.")
    ] = None,
    y: Annotated[YDirection, typer.Option("--y", help="up as in OpenGL, down as in DirectX.")] = YDirection.up,
    align: Annotated[
        AlignName,
        typer.Option(help="Move plates of one round to one instant by flow; auto: where it moves."),
    ] = AlignName.none,
    rate: Annotated[RateName, typer.Option(help="One result per round, or per flash.")] = RateName.round,
    denoise: Annotated[int, typer.Option(min=1, max=64, help="Average up to N results where nothing moves.")] = 1,
    float32: Annotated[bool, typer.Option("--float", help="Store normals as 32-bit floats.")] = False,
    aov: Annotated[
        list[Aov] | None, typer.Option("--aov", help="Write this besides; may be given several times.")
    ] = None,
    mesh: Annotated[
        list[MeshKind] | None,
        typer.Option("--mesh", help="Write meshes besides: ply, one per instant; usd, one animated file."),
    ] = None,
    encode: Annotated[
        Encoding | None, typer.Option("--encode", help="Write 16-bit PNG maps of 0 to 1 besides.")
    ] = None,
    separate: Annotated[
        bool, typer.Option("--separate", help="One sequence per quantity; this is the default.")
    ] = True,
    multipart: Annotated[bool, typer.Option("--multipart", help="Write one EXR with all quantities besides.")] = False,
    start_number: StartNumber = 1001,
    force: Force = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Write normals, albedo and validity for every round of flashes; does sync and split by itself."""
    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    output = Output(folder=out, force=force, resume=resume, start_number=start_number)
    output.check()
    delivery = Delivery(
        space=choose_space(space.value, y.value, camera_to_world),
        half=not float32,
        aovs=tuple(dict.fromkeys(name.value for name in aov or ())),
        meshes=tuple(dict.fromkeys(kind.value for kind in mesh or ())),
        png16=encode is Encoding.png16,
        multipart=multipart,
    )
    if "usd" in delivery.meshes:
        require_usd()
    over_time = OverTime(aligning=Aligning(align=align.value, rate=rate.value), denoise=denoise)
    take = open_and_tell(clip, voice, plan=plan, frames=frames)
    over_time.check(take.plan)
    lighting = read_lighting(take, rig, mask, near_iterations=near_iterations)
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
    voice.say(verdict(report))
    for sentence in findings(report):
        voice.warn(sentence)
    voice.say(f"{out}: {len(report.instants)} instants written; see {out / 'report.html'}.")
