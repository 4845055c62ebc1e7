"""A whole split: a clip in, a folder of plates out."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from psvideo.clip import Clip, Take
from psvideo.compute.progress import Watch, unwatched
from psvideo.compute.threads import Submit, writing
from psvideo.errors import PsvideoError
from psvideo.export.sequences.plate_files import plate_name, write_flash, write_plate
from psvideo.export.sequences.tags import Tags
from psvideo.formats.timing_json import format_timing
from psvideo.formats.whole_files import write_text
from psvideo.model.choices import USUAL_COMPRESSION, Compression, MovieCodec, Preview, SplitMethod
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.model.timing import Timing
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.beauty import BEAUTY, Mix, beauty_of
from psvideo.plates.flash_plates import first_ambient
from psvideo.plates.gather import gather
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.sequence import AMBIENT, Round, round_numbers
from psvideo.plates.split import Plate
from psvideo.report.run_report import RunReport
from psvideo.runs.delivery.beforehand import say_instants
from psvideo.runs.delivery.delivering import plates_of
from psvideo.runs.delivery.handover import Finished, write_previews, write_timeline
from psvideo.runs.delivery.look import SAMPLE_ROUND, plates_sheet
from psvideo.runs.instants.reporting import observing, run_report, write_report
from psvideo.runs.steps.output import Output, folder_of, tags_of


@dataclass(frozen=True, kw_only=True)
class SplitResult:
    """What a split run gave: the timing with every plate's file, and the report."""

    timing: Timing
    report: RunReport


@dataclass(frozen=True, kw_only=True)
class Extras:
    """What a split writes beside the plates: every flash by itself, their sum as the ``mix`` says, movies."""

    flashes: bool = False
    mix: Mix | None = None
    previews: tuple[Preview, ...] = ()
    codec: MovieCodec = "both"
    compression: Compression = USUAL_COMPRESSION

    def check(self, plan: Plan) -> None:
        """Raise UsageError or PsvideoError where the plan does not have what is asked for."""
        if self.mix is not None:
            self.mix.check(plan)
            if BEAUTY in plan.lights:
                raise PsvideoError(
                    f"A light of the plan is named {BEAUTY!r}, and so is the folder of the lights' sum: both cannot be "
                    "written. Rename the light in plan and rig, or leave `beauty` out."
                )


def split_run(
    take: Take,
    timing: Timing,
    output: Output,
    *,
    method: SplitMethod = "weights",
    extras: Extras = Extras(),
    aligning: Aligning | None = None,
    known: Rig | None = None,
    watch: Watch = unwatched,
) -> SplitResult:
    """Write one sequence per light, ambient where there are dark slots, timing.json and the report.

    ``aligning`` brings plates to instants of a rate; left out, every plate shows its own flash. ``known`` is the rig,
    if there is one, to be compared with the plates.
    """
    clip = take.clip
    observed, picture = observing(take, known), None
    tags = tags_of(clip, rate="round" if aligning is None else aligning.rate)
    say_instants(take, timing, aligning, output)
    extras.check(clip.plan)
    written: set[str] = set()
    times_s: list[float] = []
    with (
        folder_of(output) as folder,
        _at_the_end(folder, take, output, times_s, extras, tags, watch),
        writing() as write,
    ):
        files = _Files(folder=folder, clip=clip, tags=tags, extras=extras, resume=output.resume, write=write)
        gathered = gather(
            take,
            timing,
            aligning=aligning,
            method=method,
            start_number=output.start_number,
            watch=watch,
            each_flash=files.write_flash if extras.flashes else None,
            each_window=observed.look_at_window,
        )
        ambient = first_ambient(take, timing) if extras.mix is not None and extras.mix.of(AMBIENT) else None
        for one in gathered:
            times_s.append(one.time_s)
            ambient = one.ambient or ambient
            written |= files.write_round(one, ambient)
            observed.add(one)
            if len(observed.facts) in (1, SAMPLE_ROUND):
                picture = plates_sheet(one)
            del one  # it would be held while the next round gathers
        if picture is None:
            raise PsvideoError(nothing_complete(clip, timing))
        if aligning is None:
            timing = _with_plates(timing, clip.name, written, start_number=output.start_number)
        write_text(folder / "timing.json", format_timing(timing))
        report = run_report(take, timing, observed, output)
        write_report(folder, report, [("One round", picture)])
    return SplitResult(timing=timing, report=report)


@dataclass(frozen=True, kw_only=True)
class _Files:
    """The plates' files: where they lie, what they say of themselves, and what takes the writing of each."""

    folder: Path
    clip: Clip
    tags: Tags
    extras: Extras
    resume: bool
    write: Submit

    def write_flash(self, plate: Plate) -> None:
        """Write one flash by itself."""
        turn, compression = self.clip.turn, self.extras.compression
        self.write(
            partial(write_flash, self.folder, self.clip.name, plate, self.tags, turn=turn, compression=compression)
        )

    def write_round(self, one: Round, ambient: LightPlate | None) -> set[str]:
        """Write a round's plates, their sum among them where it is asked for; return their names. What a run that was
        stopped has written stays."""
        mix, compression = self.extras.mix, self.extras.compression
        whole = one.lights == self.clip.plan.lights
        sums = (beauty_of(one, mix, ambient),) if mix is not None and whole else ()
        names = set()
        for plate in (*plates_of(one), *sums):
            name = plate_name(self.clip.name, plate.light, plate.number)
            names.add(name)
            if not (self.resume and (self.folder / name).is_file()):
                self.write(partial(write_plate, self.folder, self.clip.name, plate, self.tags, compression=compression))
        return names


@contextmanager
def _at_the_end(
    folder: Path, take: Take, output: Output, times_s: list[float], extras: Extras, tags: Tags, watch: Watch
) -> Iterator[None]:
    """At the end of a block that wrote all plates, make of them what needs them all."""
    yield
    if times_s:
        run = Finished(folder=folder, target=output.folder, clip=take.clip, fps=tags.fps, first_time_s=times_s[0])
        lights = take.plan.lights
        write_previews(run, extras.previews, extras.codec, plates=lights, watch=watch)
        write_timeline(run)


def nothing_complete(clip: Clip, timing: Timing) -> str:
    """Return what to say of a clip that gives no single round."""
    return (
        f"{clip.path}: holds no round in which every flash is complete ({len(timing.flashes)} flashes are seen), so "
        "there is nothing to write. Use more frames: a round needs as many as it has flashes, and one or two more."
    )


def _with_plates(timing: Timing, clip: str, written: set[str], *, start_number: int) -> Timing:
    """Note every flash's plate where one was written of the light that it shows alone, or of the ambient light."""
    numbers = round_numbers(timing.flashes, start=start_number)
    flashes = []
    for flash, number in zip(timing.flashes, numbers, strict=True):
        name = plate_name(clip, flash.lit[0] if flash.lit else "ambient", number)
        noted = flash.complete and len(flash.lit) <= 1 and name in written
        flashes.append(replace(flash, plate=name if noted else None))
    return replace(timing, flashes=tuple(flashes))
