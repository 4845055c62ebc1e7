"""What calibrations of lights begin with: which outputs may be written, and the pictures, one per light."""

from collections.abc import Sequence
from pathlib import Path

from psvideo.calibrate.light_pictures import LightPictures, mean_of_sets
from psvideo.clip.transfer import check_transfer
from psvideo.compute.progress import Watch
from psvideo.errors import UsageError
from psvideo.formats.rig_toml import SCHEMA
from psvideo.formats.whole_files import PICTURE_MARK, check_ending, refuse_existing
from psvideo.model.rig import Rig
from psvideo.model.units import listed
from psvideo.runs.photographs.light_sets import sets_of
from psvideo.runs.photographs.opened_sets import Reading
from psvideo.runs.steps.caller import Caller

MOST_NAMED = 6


def rig_out(out: Path | str, *, force: bool) -> Path:
    """Return where the rig goes. Raises UsageError where its name would not be read as a rig's, or something is there
    that may not be replaced."""
    check_ending(Path(out), ".toml", name="out")
    refuse_existing(Path(out), force=force, mark=SCHEMA)
    return Path(out)


def picture_beside(out: Path, *, force: bool) -> Path:
    """Return where the picture beside a rig goes. Raises UsageError where one is there that may not be replaced. One
    that no rig stands beside is left over from a calibration that failed, and may."""
    path = out.with_suffix(".png")
    refuse_existing(path, force=force or not out.exists(), mark=PICTURE_MARK)
    return path


def picture_of_failure(out: Path) -> Path:
    """Return where the picture of a calibration that fails goes: under a name of its own where a rig is there, which
    keeps its picture. Raises UsageError where one is there that may not be replaced."""
    path = out.with_suffix(".failed.png" if out.exists() else ".png")
    refuse_existing(path, force=True, mark=PICTURE_MARK)
    return path


def reading_of(plan: Path | str | None, frames: str | None, first_light: str | None, transfer: str | None) -> Reading:
    """Return how pictures are to be read. Raises UsageError where the curve named is not known."""
    check_transfer(transfer)
    given = None if plan is None else Path(plan)
    return Reading(plan=given, frames=frames, first_light=first_light, transfer=transfer)


def check_albedo(albedo: float) -> None:
    """Raise UsageError where the albedo of a target or a sphere cannot be meant."""
    if not 0 < albedo <= 1:
        raise UsageError(f"`albedo` {albedo:g}: expected a share above 0 and up to 1.")


def warn_of_unmeasured(known: Rig, names: Sequence[str], caller: Caller) -> None:
    """Warn of lights of a rig of which there is no picture: the rig that is written is without them."""
    lacking = [repr(light.name) for light in known.lights if light.name not in names]
    if lacking:
        what = "has no picture here and is" if len(lacking) == 1 else "have no picture here and are"
        caller.warn(
            f"{len(lacking)} of the rig's {len(known.lights)} lights {what} not in the rig that is "
            f"written: {listed(lacking, MOST_NAMED)}. Strengths can only be compared within one set of pictures: take "
            "the missing ones, too"
        )


def pictures_of(path: Path, reading: Reading, *, watch: Watch, caller: Caller) -> LightPictures:
    """Return the mean picture of a scene under each light, and hand on what is odd about the pictures."""
    opened = sets_of(path, reading, watch=watch, caller=caller)
    if opened.taken_as_dark:
        caller.say(
            "No picture is named ambient or dark, so the room is assumed dark. If it was not, its light counts as the "
            "lamps': take a picture with every lamp off as well."
        )
    return mean_of_sets(opened.sets)
