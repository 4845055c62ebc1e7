"""The whole of ``psvideo normals``: a clip and a rig in, a folder of normals, albedo and validity out."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import partial
from pathlib import Path

from psvideo.clip import Take, decoded_once
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import UsageError
from psvideo.export.asked import Asked, delivery_of
from psvideo.export.sequences.result_files import Delivery
from psvideo.export.usd import require_usd
from psvideo.formats.free_folders import unfinished_folder_of
from psvideo.formats.paths import path_if_given, path_of
from psvideo.model.choices import (
    PREVIEWS,
    USUAL_COMPRESSION,
    Align,
    CameraTime,
    Compression,
    MapFiles,
    MeshKind,
    MovieCodec,
    Preview,
    Program,
    Solver,
    SpaceName,
    YDirection,
)
from psvideo.model.quantities import Aov
from psvideo.model.rig import Rig
from psvideo.model.timing import Timing
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.named_timing import read_or_find_timing
from psvideo.plates.sequence import FIRST_NUMBER
from psvideo.report.run_report import RunReport
from psvideo.runs.delivery.beforehand import metric_delivery
from psvideo.runs.instants.job import Job, OverTime
from psvideo.runs.instants.piece_notes import noted_timing
from psvideo.runs.instants.results import normals_run, piece_run
from psvideo.runs.steps.caller import PYTHON, Caller, said_rig, said_timing, say_kept, say_of_clip
from psvideo.runs.steps.lighting import AskedLighting, read_lighting
from psvideo.runs.steps.output import Output, take_rate
from psvideo.sync.open_take import open_take

MOST_AVERAGED = 64


def normals(
    clip: Path | str,
    *,
    rig: Path | str | None = None,
    out: Path | str,
    plan: Path | str | None = None,
    timing: Path | str | None = None,
    mask: Path | str | None = None,
    flat: Path | str | None = None,
    frames: str | None = None,
    first_light: str | None = None,
    solver: Solver = "auto",
    fill: bool = True,
    near_iterations: int | None = None,
    depth: Path | str | None = None,
    depth_scale: float | None = None,
    align: Align = "auto",
    fps: str | float | Fraction = "round",
    shutter: float | None = None,
    resync: Path | str | None = None,
    denoise: int = 1,
    preset: Program | None = None,
    space: SpaceName | None = None,
    camera_to_world: Path | str | None = None,
    camera: str | None = None,
    camera_time: CameraTime | None = None,
    y: YDirection | None = None,
    float32: bool = False,
    aov: Sequence[Aov] = (),
    mesh: Sequence[MeshKind] = (),
    encode: MapFiles | None = None,
    compression: Compression = USUAL_COMPRESSION,
    multipart: bool | None = None,
    plates: bool = False,
    with_ambient: bool = False,
    weight: Mapping[str, float] | None = None,
    preview: Sequence[Preview] = PREVIEWS,
    preview_codec: MovieCodec = "both",
    start_number: int = FIRST_NUMBER,
    force: bool = False,
    resume: bool = False,
    piece: str | None = None,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> RunReport:
    """Write normals, albedo and validity for every round of flashes; find the timing and rebuild the plates on the way.

    What is read:

    - ``clip``: a folder of numbered frames with plan.toml, or a movie file. ``plan`` names the plan where it does not
      lie beside the footage.
    - ``rig``: where the lights are: rig.toml, an .lp file, a DiLiGenT or UW list; or a folder of rigs, of which that
      one is taken that is named after the clip. Left out, rig.toml beside the footage.
    - ``timing``: timing.json of this clip; left out, the flashes are found from the picture. ``first_light`` names the
      light of the clip's first complete flash, for plans without a marker.
    - ``frames``: file numbers to use, such as ``"1-100"`` or ``"1-100x2"``; left out, all.
    - ``mask``: a picture of the frames' size, white where to solve, or a folder or numbered pattern
      (``masks/mask.####.png``) with one per result. ``flat``: how light falls off over the picture,
      from ``calibrate flat-field``.
    - ``depth``: known depth, an EXR in metres along the optical axis or a 16-bit PNG in millimetres, or a folder with
      one per result; ``depth_scale``: metres per unit of it (left out: 1 for floats, 0.001 for integers).

    How it is solved:

    - ``solver``: "auto" is robust against highlights and shadows from five lights on. ``fill`` gives what fewer
      than three lights reach a best estimate, which is not valid; without it there are zeros. ``near_iterations``: how
      often near lights' distances are taken again from the depth of the normals found, 0 to 10 (left out: 1, and 0
      with ``depth``).
    - ``align``: "auto" brings the plates of a round to one instant where something moves, "flow" looks for motion
      everywhere, "none" leaves them. ``fps``: one result per "round", per "flash", per camera "frame", or a number a
      second, exactly (a Fraction; whole or decimal numbers are taken as they are written), at most as many as the
      camera took. ``shutter``: the angle, up to 360 degrees of such a rate, for which a shutter is open in beauty and
      plates; surfaces are those of its middle. ``resync``: a clocks.json of several cameras (``sync_cameras``), which
      then show the same instants of such a rate under the same numbers. ``denoise``: average up to this many results, 1
      to 64, where nothing moves.

    What is written, into the folder ``out`` (float16 EXR sequences, numbered from ``start_number``):

    - ``preset``: what this program wants, where no other parameter says otherwise, and a note on how to load it.
    - ``space`` (left out: "camera"), with ``camera_to_world`` for "world": a USD file with the camera (which one:
      ``camera``; how its time codes count: ``camera_time``), or a text file with a 3 x 3 or 4 x 4 matrix. ``y``: which
      way green points (left out: "up"). ``float32``: normals in 32 bits.
    - ``aov``: what else is written: "depth", "residual", "error", "source", "position", "beauty", "age", "reach",
      "specular", "alpha", "motion". ``mesh``: "ply", one per instant; "usd", one animated file. ``encode``: 16-bit
      PNG maps too. ``multipart``: one EXR with all quantities too. ``plates``: the plates too. ``compression``: how
      EXR files are packed, always without loss: "zip", "zips" (for Nuke), "piz", "rle" (where disks are fast) or
      "none".
    - ``weight``: how strong a light is in the beauty plate, by name (1 where not named); ``with_ambient`` leaves
      ambient light in it. ``preview``: movies for eyes, coded as ``preview_codec``; empty for none.
    - ``force`` replaces an ``out`` that exists; ``resume`` goes on where a run that was stopped
      left off, and raises AllDoneError where none was and ``out`` is finished. ``piece``: solve only a piece of the
      run, such as the third of ten, "3/10", beside other processes that solve the others; ``resume`` then ends it.

    ``watch`` is handed every long loop, and ``caller`` the sentences that come on the way.

    Returns
    -------
    RunReport
        What lies in the folder as report.json too: ``verdict``, ``findings``, ``instants``, and ``timing``.

    Raises
    ------
    UsageError
        Where parameters do not fit together, or ``out`` exists, before any work is done.
    PsvideoError
        Where files cannot be used or hold no complete round.

    Examples
    --------
    >>> import psvideo as ps
    >>> report = ps.normals("take3/", rig="take3/rig.toml", out="results/", aov=["residual"])
    >>> len(report.instants)
    2
    """
    clip_path, rig_given = path_of("clip", clip), path_if_given("rig", rig)
    output = Output(
        folder=path_of("out", out),
        force=force,
        resume=resume or piece is not None,
        start_number=start_number,
        caller=caller,
    )
    output.check()
    asked = Asked(
        preset=preset,
        space=space,
        camera_to_world=path_if_given("camera_to_world", camera_to_world),
        camera=camera,
        camera_time=camera_time,
        y=y,
        float32=float32,
        aov=aov,
        mesh=mesh,
        encode=encode,
        compression=compression,
        multipart=multipart,
        plates=plates,
        with_ambient=with_ambient,
        weight=weight or {},
        preview=preview,
        preview_codec=preview_codec,
    )
    delivery = _delivery(asked, caller)
    known = AskedLighting(
        mask=path_if_given("mask", mask),
        flat=path_if_given("flat", flat),
        near_iterations=near_iterations,
        depth=path_if_given("depth", depth),
        depth_scale=depth_scale,
    )
    known.check()
    _check_averaged(denoise)
    take = open_take(clip_path, plan=path_if_given("plan", plan), frames=frames)
    rig_path = said_rig(rig_given, clip_path, caller.say)
    rate = take_rate(fps, take, shutter=shutter, resync=path_if_given("resync", resync))
    over_time = OverTime(aligning=Aligning(align=align, rate=rate), denoise=denoise)
    say_of_clip(take.clip, caller)
    lighting = read_lighting(take, rig_path, known)
    over_time.check(take.plan, unmixed=lighting.unmixing is not None)
    lighting.check(delivery)
    delivery = metric_delivery(delivery, asked.aov, lighting, caller)
    timing_path = path_if_given("timing", timing)
    output = output.given(take, timing_path, first_light, solver, fill, over_time, delivery, *lighting.identity)
    timed = partial(_timed, output=output, path=timing_path, first_light=first_light, rig=lighting.flashed, watch=watch)
    with decoded_once(take, output=output.folder) as kept:
        job = Job(
            take=kept,
            timing=timed(kept),
            lighting=lighting,
            delivery=delivery,
            solver=solver,
            over_time=over_time,
            fill=fill,
            start_number=start_number,
        )
        return _solved(job, output, piece=piece, watch=watch)


def _check_averaged(results: int) -> None:
    """Raise UsageError where so many results cannot be averaged."""
    if not 1 <= results <= MOST_AVERAGED:
        raise UsageError(f"`denoise` {results}: expected a number from 1 to {MOST_AVERAGED}.")


def _delivery(asked: Asked, caller: Caller) -> Delivery:
    """Return what is to be delivered; says where that goes against a program's preset."""
    delivery, at_odds = delivery_of(asked)
    for sentence in at_odds:
        caller.warn(sentence)
    if "usd" in delivery.meshes:
        require_usd()
    return delivery


def _timed(
    take: Take, *, output: Output, path: Path | None, first_light: str | None, rig: Rig | None, watch: Watch
) -> Timing:
    """Return when flashes fired: by a file; as the pieces of a run that goes on noted it; or found in the picture."""
    goes_on = output.resume and path is None
    noted = noted_timing(unfinished_folder_of(output.folder)) if goes_on else None
    found = noted or read_or_find_timing(take, path, first_light=first_light, rig=rig, watch=watch)
    return said_timing(found, output.caller)


def _solved(job: Job, output: Output, *, piece: str | None, watch: Watch) -> RunReport:
    """Solve the whole run, or a piece of it, into the output's folder."""
    if piece is not None:
        return piece_run(job, output, piece, watch=watch)
    done = normals_run(job, output, watch=watch)
    say_kept(job.take.kept, output.caller)
    return done.report
