"""Pictures of a scene, one per light, from what a user names: stills, plates, or a synced or strobed clip.

``open_light_sets`` gives one set per round, which shows the scatter between frames; ``read_images`` their mean.
"""

from dataclasses import replace
from pathlib import Path

from psvideo.calibrate.light_files import find_stills
from psvideo.calibrate.light_folder import find_light_pictures, shows_lights
from psvideo.calibrate.light_pictures import LightPictures, mean_of_sets
from psvideo.calibrate.still_places import Place
from psvideo.clip.folder import MOVIES
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.clip_layout import PLAN_FILE
from psvideo.formats.paths import path_if_given, path_of
from psvideo.formats.plan_toml import read_plan
from psvideo.runs.photographs.opened_sets import LightSets, Reading
from psvideo.runs.photographs.same_scene import compared
from psvideo.runs.photographs.sets_of_clip import refuse_other_curve, sets_of_clip
from psvideo.runs.photographs.sets_of_files import sets_of_files
from psvideo.runs.steps.caller import PYTHON, Caller
from psvideo.sync.open_take import open_take


def read_images(path: Path | str, *, transfer: str | None = None, plan: Path | str | None = None) -> LightPictures:
    """Read pictures of one still scene, one per light, into linear light.

    Parameters
    ----------
    path
        A folder of still photographs, one per light, in the order of their names (L2 before L10): PNG, TIFF, EXR, DNG,
        DPX or JPEG, turned upright as EXIF says that they lie. A picture named ambient or dark shows the scene with
        every light off and is taken off the others; those named room or mask are left aside, and so is one of another
        name beside many numbered ones: the log (``psvideo``) names what was. Or a folder with one folder of pictures
        per light, as ``split`` writes it, or a clip, whose flashes are found first; of these, the mean over up to
        twelve rounds.
    transfer
        How the files code light: "linear", "srgb", "rec709", "slog3" and others by OpenColorIO's names. Left out: as
        the plan says; without a plan as the files do, else sRGB for JPEG, and linear for others. The log says which.
    plan
        The plan, where it does not lie beside the pictures: names the lights, and says how the files code light.

    Returns
    -------
    LightPictures
        ``images`` (light, row, col) or (light, row, col, 3), float32, linear, 1.0 = the largest code; ``names`` of the
        lights, in the same order; ``saturated``, of the images' shape, True where a value was clipped; ``ambient``, or
        None.

    Raises
    ------
    PsvideoError
        Where there are no pictures, two of one light, or pictures that differ in size, or one cannot be read.

    Examples
    --------
    >>> import psvideo as ps
    >>> pictures = ps.read_images("stills/")
    >>> pictures.names, pictures.images.shape
    (('key', 'left', 'top'), (3, 120, 160, 3))
    """
    reading = Reading(transfer=transfer, plan=path_if_given("plan", plan))
    return mean_of_sets(sets_of(path_of("path", path), reading, watch=unwatched, caller=PYTHON).sets)


def sets_of(path: Path, reading: Reading, *, watch: Watch, caller: Caller) -> LightSets:
    """Open pictures of a scene, one per light, and hand on what is odd about them."""
    opened = open_light_sets(path, reading, watch=watch)
    for warning in opened.warnings:
        caller.warn(warning)
    for note in opened.notes:
        caller.detail(note)
    return replace(opened, sets=compared(opened.sets, path, caller))


def open_photographs(place: Place, reading: Reading) -> LightSets:
    """Open single photographs, one per light. Raises PsvideoError where two are of one light."""
    files = find_stills(place.files)
    renamed = {place.names.get(found[0], light): found for light, found in files.by_light.items()}
    files = replace(files, by_light=renamed)
    return sets_of_files(files, None, reading)


def open_light_sets(path: Path, reading: Reading = Reading(), *, watch: Watch = unwatched) -> LightSets:
    """Open stills, plates or a clip; of a strobed clip, the flashes are found first.

    Raises PsvideoError where there is nothing to read, or where it does not fit the plan.
    """
    if not path.exists():
        raise PsvideoError(f"{path}: is not there. Name a folder of stills or plates, or a clip.")
    if path.is_file() and path.suffix.lower() not in MOVIES:
        raise UsageError(f"{path}: is one file. Name the folder that holds the pictures, or a movie ({MOVIES[0]}, …).")
    plan_path = reading.plan or (path / PLAN_FILE if (path / PLAN_FILE).is_file() else None)
    if path.is_file() or (plan_path is not None and not shows_lights(path, read_plan(plan_path).lights)):
        take = open_take(path, plan=reading.plan, frames=reading.frames)
        refuse_other_curve(take, reading.transfer)
        return sets_of_clip(take, reading, watch)
    plan = None if plan_path is None else read_plan(plan_path)
    lights = () if plan is None else plan.lights
    files = find_light_pictures(path, lights=lights)
    return sets_of_files(files, None if plan is None else plan.camera.encoding, reading)
