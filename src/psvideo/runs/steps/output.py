"""Where a run writes, at what rate its sequences play, and with which settings a stopped run may be resumed."""

import hashlib
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from psvideo import __version__
from psvideo.clip import Clip, Take
from psvideo.errors import UsageError
from psvideo.export.sequences.tags import Tags, sha256_of
from psvideo.export.space import CAMERA_SPACE, Space
from psvideo.formats.clocks_json import read_clocks
from psvideo.formats.frame_rates import broadcast_fps
from psvideo.formats.free_folders import refuse_folder
from psvideo.formats.paths import not_there
from psvideo.formats.whole_folders import begun_folder, whole_folder
from psvideo.model.choices import Rate
from psvideo.model.plan import Plan
from psvideo.plates.align.comb import Comb, comb_of
from psvideo.plates.sequence import FIRST_NUMBER
from psvideo.runs.steps.caller import PYTHON, Caller

MARK = "timing.json"
"""The file by which a folder of plates or results is known."""


@dataclass(frozen=True, kw_only=True)
class Output:
    """Where a run writes, what it may do there, and who called it.

    ``settings`` is a digest of what the run is given: a stopped run is resumed only under the same, and where nothing
    resumes it, as of photographs, nothing is ``kept``.
    """

    folder: Path
    force: bool = False
    resume: bool = False
    start_number: int = FIRST_NUMBER
    caller: Caller = PYTHON
    settings: str = ""
    kept: bool = True

    def check(self) -> None:
        """Raise UsageError where the folder exists and may not be replaced, before any work is done."""
        if not self.resume:
            refuse_folder(self.folder, mark=MARK, force=self.force)

    def given(self, take: Take, timing: Path | None, *what: object) -> "Output":
        """Return the same with the digest of what the run is given: footage, plan, a timing file, and ``what`` else.

        Raises AllDoneError or UsageError where a run that is to be resumed has ended, or was another.
        """
        parts = [__version__, self.start_number, *_identity(take), None if timing is None else sha256_of(timing), *what]
        settings = hashlib.sha256("\n".join(map(str, parts)).encode()).hexdigest()
        refuse_folder(self.folder, mark=MARK, force=self.force, resume=self.resume, settings=settings)
        return replace(self, settings=settings)


def _identity(take: Take) -> list[object]:
    """Return what distinguishes a take from others, and from itself once its plan, its strobe's log (by which the plan
    is as played) or a file of it was changed. Raises PsvideoError where a file of it is gone."""
    clip = take.clip
    files = clip.files if clip.is_movie else [clip.file_of(number) for number in take.numbers]
    try:
        facts = [(path.name, path.stat().st_size, path.stat().st_mtime_ns) for path in files]
    except FileNotFoundError as fault:
        raise not_there(Path(fault.filename)) from None
    return [clip.path.resolve(), sha256_of(clip.plan_path), clip.plan, take.numbers, facts]


def folder_of(output: Output) -> AbstractContextManager[Path]:
    """Return the block that writes the folder whole or not at all."""
    return whole_folder(
        output.folder,
        mark=MARK,
        force=output.force,
        resume=output.resume,
        settings=output.settings,
        kept=output.kept,
    )


def begun_by(output: Output) -> AbstractContextManager[Path]:
    """Return the block that writes a part of the folder, which stays unfinished."""
    return begun_folder(output.folder, mark=MARK, force=output.force, settings=output.settings)


def sequence_fps(plan: Plan, rate: Rate | Comb = "round") -> Fraction:
    """Return the rate of rounds, of the lights' flashes, or that was asked for, at which a sequence is delivered; the
    mean where dark slots come between."""
    if isinstance(rate, Comb):
        return rate.fps
    results = len(plan.lit_slots) if rate == "flash" else 1
    if plan.mode == "synced":
        return results * plan.camera.fps / len(plan.flashes)
    return Fraction(results * len(plan.dark_rounds) / plan.cycle_s).limit_denominator(100_000)


def rounds_of(take: Take) -> int:
    """Return about how many rounds a take holds."""
    plan = take.plan
    if plan.mode == "synced":
        return len(take.numbers) // len(plan.flashes)
    return int(len(take.numbers) * plan.camera.frame_period_s / plan.cycle_s * len(plan.dark_rounds))


def rate_of(
    fps: str | float | Fraction, plan: Plan, *, shutter: float | None = None, resync: Path | None = None, clip: str = ""
) -> Rate | Comb:
    """Return which instants are asked for: by a word, or by a rate; with ``resync``, a clocks.json, those that other
    cameras show too of this ``clip``. Raises UsageError where there are none such."""
    if fps in ("round", "flash") and shutter is not None:
        raise UsageError("`shutter` is open for a share of a steady rate's time: add `fps`, such as 24 or frame.")
    if fps in ("round", "flash", "frame") and resync is not None:
        raise UsageError("`resync`: cameras share the instants of a steady rate. Add `fps`, such as 24.")
    if fps == "round":
        return "round"
    if fps == "flash":
        return "flash"
    camera = plan.camera
    if fps == "frame":
        return comb_of(camera.fps, camera, shutter_deg=shutter)
    try:
        exact = broadcast_fps(str(fps))
    except ValueError as fault:
        raise UsageError(f"`fps` {fps}: {fault}; or one of round, flash, frame.") from None
    clocks = None if resync is None else read_clocks(resync)
    return comb_of(exact, camera, shutter_deg=shutter, clocks=clocks, clip=clip)


def take_rate(
    fps: str | float | Fraction, take: Take, *, shutter: float | None = None, resync: Path | None = None
) -> Rate | Comb:
    """Return which instants of a take are asked for, as ``rate_of``; "frame" is each of its frames, also where a
    movie's rate varies: their numbers count places of the common step then."""
    clip = take.clip
    if fps != "frame" or resync is not None or clip.places_per_frame == 1:
        return rate_of(fps, clip.filmed_plan, shutter=shutter, resync=resync, clip=clip.name)
    if shutter is not None:
        raise UsageError("`shutter`: this movie's frames vary in rate. Give a steady `fps` with it, such as 24.")
    only = tuple(number - clip.numbers[0] for number in clip.numbers)
    return replace(comb_of(clip.plan.camera.fps, clip.plan.camera), only=only)


def tags_of(clip: Clip, rig_path: Path | None = None, space: Space = CAMERA_SPACE, rate: Rate | Comb = "round") -> Tags:
    """Return what every file of a run says of itself."""
    return Tags(
        fps=sequence_fps(clip.plan, rate),
        colour=clip.colour,
        plan_sha256=sha256_of(clip.plan_path),
        rig_sha256=None if rig_path is None else sha256_of(rig_path),
        space=space.name,
        y=space.y,
        camera_fps=clip.filmed_plan.camera.fps,
        first_time_code=clip.time_code,
        shot=clip.header.shot,
    )
