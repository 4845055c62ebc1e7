"""The whole of ``psvideo split``: a clip in, a folder of plates out."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path

from psvideo.clip import decoded_once
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import UsageError
from psvideo.formats.paths import path_if_given, path_of
from psvideo.formats.rig_folder import rig_of_take
from psvideo.formats.rig_toml import read_rig
from psvideo.model.choices import USUAL_COMPRESSION, Compression, MovieCodec, PlatesPreview, SplitMethod
from psvideo.model.irradiance.colours import unmixing_of
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.beauty import Mix, mix_of
from psvideo.plates.named_timing import read_or_find_timing
from psvideo.plates.sequence import FIRST_NUMBER
from psvideo.report.run_report import RunReport
from psvideo.runs.instants.job import OverTime
from psvideo.runs.instants.plates import Extras, split_run
from psvideo.runs.steps.caller import PYTHON, Caller, said_timing, say_kept, say_of_clip
from psvideo.runs.steps.output import Output, take_rate
from psvideo.sync.open_take import open_take


def split(
    clip: Path | str,
    *,
    out: Path | str,
    plan: Path | str | None = None,
    timing: Path | str | None = None,
    frames: str | None = None,
    first_light: str | None = None,
    rig: Path | str | None = None,
    method: SplitMethod = "weights",
    flashes: bool = False,
    beauty: bool = False,
    with_ambient: bool = False,
    weight: Mapping[str, float] | None = None,
    fps: str | float | Fraction = "round",
    shutter: float | None = None,
    resync: Path | str | None = None,
    preview: Sequence[PlatesPreview] = (),
    preview_codec: MovieCodec = "both",
    compression: Compression = USUAL_COMPRESSION,
    start_number: int = FIRST_NUMBER,
    force: bool = False,
    resume: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> RunReport:
    """Rebuild one plate per flash and write one EXR sequence per light into ``out``, ambient light taken off.

    - ``clip``: a folder of numbered frames with plan.toml, or a movie file. ``plan`` names the plan where it does not
      lie beside the footage. ``frames``: file numbers to use, such as ``"1-100"`` or ``"1-100x2"``; left out, all.
    - ``timing``: timing.json of this clip; left out, the flashes are found from the picture. ``first_light`` names the
      light of the clip's first complete flash, for plans without a marker; ``rig``, where the lights are, gives their
      order too, and is compared with the plates in the report.
    - ``method``: by the rows' "weights", or Algorithm 1 of Hudon et al. ("hudon2015"), to compare with.
    - ``flashes``: every flash by itself too. ``beauty``: the sum of all lights too, each as strong as
      ``weight`` says (by name; 1 where not named), with ambient light where ``with_ambient``. ``preview``: movies for
      eyes, coded as ``preview_codec``. ``compression``: how EXR files are packed,
      always without loss: "zip", "zips", "piz", "rle" or "none".
    - ``fps``: plates of one instant per "flash", per camera "frame", or a number a second, exactly, brought there by
      the alignment; left out, every plate shows its own flash. ``shutter``: the angle, up to 360 degrees of such a
      rate, for which a shutter is open in them. ``resync``: a clocks.json of several cameras (``sync_cameras``), which
      then show the same instants of such a rate under the same numbers.
    - ``start_number``: the number of the first round's files. ``force`` replaces an ``out`` that exists; ``resume``
      goes on where a run that was stopped left off, and raises AllDoneError where none was and ``out`` is finished.

    ``watch`` is handed every long loop, and ``caller`` the sentences that come on the way.

    Returns
    -------
    RunReport
        What lies in the folder as report.json too; its ``timing`` names every flash's plate.

    Raises
    ------
    UsageError
        Where parameters do not fit together, or ``out`` exists, before any work is done.
    PsvideoError
        Where files cannot be used or hold no complete round.

    Examples
    --------
    >>> import psvideo as ps
    >>> report = ps.split("take3/", out="plates/")
    >>> report.timing.flashes[1].plate
    'left/take3_left.1001.exr'
    """
    output = Output(folder=path_of("out", out), force=force, resume=resume, start_number=start_number, caller=caller)
    output.check()
    extras = Extras(
        flashes=flashes,
        mix=_beauty(weight or {}, with_ambient=with_ambient, asked=beauty or "beauty" in preview),
        previews=tuple(dict.fromkeys(preview)),
        codec=preview_codec,
        compression=compression,
    )
    take = open_take(path_of("clip", clip), plan=path_if_given("plan", plan), frames=frames)
    say_of_clip(take.clip, caller)
    rate = take_rate(fps, take, shutter=shutter, resync=path_if_given("resync", resync))
    over_time = OverTime(aligning=Aligning(rate=rate))
    known = None if rig is None else read_rig(rig_of_take(rig, take.clip.path), plan_lights=take.plan.lights)
    unmixing = None if known is None else unmixing_of(take.plan, known, channels=take.clip.channels)
    extras.check(take.unmixed(unmixing).plan)
    over_time.check(take.plan, unmixed=unmixing is not None)
    given = path_if_given("timing", timing)
    output = output.given(take, given, first_light, known, method, extras, over_time)
    with decoded_once(take, output=output.folder) as kept:
        found = read_or_find_timing(kept, given, first_light=first_light, rig=known, watch=watch)
        shown = known if unmixing is None else unmixing.rig
        apart = kept.unmixed(unmixing)
        done = split_run(
            apart,
            said_timing(found, caller),
            output,
            method=method,
            extras=extras,
            aligning=None if rate == "round" else over_time.aligning,
            known=shown,
            watch=watch,
        )
        say_kept(kept.kept, caller)
    return done.report


def _beauty(weight: Mapping[str, float], *, with_ambient: bool, asked: bool) -> Mix | None:
    """Return how lights are mixed in the beauty plate, None where it is not asked for. Raises UsageError where its
    lights are weighed all the same."""
    mix = mix_of(weight, with_ambient=with_ambient)
    if mix.weights and not asked:
        raise UsageError("`with_ambient` and `weight`: belong to the beauty plate. Add `beauty`, or leave them out.")
    return mix if asked else None
