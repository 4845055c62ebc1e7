"""Pictures of a scene, one per light, from what a user names: stills, plates, or a synced or strobed clip.

``open_light_sets`` gives one set per round, which shows the scatter between frames; ``read_images`` their mean.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_files import find_stills
from psvideo.calibrate.light_folder import find_light_pictures, shows_lights
from psvideo.calibrate.light_pictures import LightPictures, mean_of_sets, pictures_of_round
from psvideo.calibrate.picture_sets import LightFiles, read_picture, read_sets
from psvideo.calibrate.still_places import Place
from psvideo.clip import Take
from psvideo.clip.folder import MOVIES
from psvideo.clip.stated import relative_exposures, says_as, stated_by
from psvideo.clip.transfer import find_curve
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.paths import path_if_given, path_of
from psvideo.formats.plan_toml import PLAN_FILE, read_plan
from psvideo.model.camera import Encoding
from psvideo.model.plan import Plan, reference_duration_s
from psvideo.plates.align.rounds import UNMOVED
from psvideo.plates.gather import gather
from psvideo.runs.steps.caller import PYTHON, Caller
from psvideo.sync.open_take import open_take
from psvideo.sync.take_timing import find_timing

MOST_SETS = 12
"""Rounds that are read where the user names no frames: more would hardly make a calibration better."""
MOST_DIFFERENT = 0.2
"""Share of its light by which a light's pictures may differ. Noise and motion at the edges of a subject stay below, an
exposure wrong by a quarter of a stop reaches it, and so do, of twelve photographs under other lights, some two."""
RUN_PX = 16
"""Noise of a sum over this many pixels is a quarter of the pixels' own, beside their light."""


@dataclass(frozen=True, kw_only=True)
class LightSets:
    """What shows each light by itself, as many times as it was taken. ``sets`` can be gone through once.

    ``room`` is a picture under room light, where one lies beside stills or plates; ``taken_as_dark`` whether nothing
    shows these with all lamps off.
    """

    name: str
    names: tuple[str, ...]
    sets: Iterator[LightPictures]
    room: NDArray[np.float32] | None = None
    taken_as_dark: bool = False
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How pictures of lights are to be read.

    ``plan`` names the plan where none lies beside the pictures; ``frames`` chooses file numbers of a clip, or sets
    counted from 1; ``transfer`` says how stills code light (left out: as the plan says; without a plan as the files do,
    else sRGB for JPEG, and linear for other kinds). A clip is read as its plan says.
    """

    plan: Path | None = None
    frames: str | None = None
    first_light: str | None = None
    transfer: str | None = None
    most: int = MOST_SETS


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
    return replace(opened, sets=_compared(opened.sets, path, caller))


def open_photographs(place: Place, reading: Reading) -> LightSets:
    """Open single photographs, one per light. Raises PsvideoError where two are of one light."""
    files = find_stills(place.files)
    renamed = {place.names.get(found[0], light): found for light, found in files.by_light.items()}
    files = replace(files, by_light=renamed)
    return _of_files(files, None, reading)


def _in_runs(images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return sums over short runs of columns: of a dark picture with small highlights, noise is most of each pixel."""
    sums: NDArray[np.float32] = np.add.reduceat(images, np.arange(0, images.shape[2], RUN_PX), axis=2)
    return sums


def _compared(sets: Iterator[LightPictures], where: Path, caller: Caller) -> Iterator[LightPictures]:
    """Hand on sets as they come, and say at the end which light's pictures differ from its first one."""
    first: LightPictures | None = None
    worst, light, at = 0.0, "", 0
    for number, one in enumerate(sets, start=1):
        first = first or one
        both = (first.seen & one.seen).reshape(*one.seen.shape, *[1] * (one.images.ndim - 2))
        axes = tuple(range(1, one.images.ndim))
        away = np.abs(_in_runs(one.images - first.images)).sum(axis=axes, where=both)
        shares = away / np.maximum(np.abs(_in_runs(one.images + first.images)).sum(axis=axes, where=both) / 2, 1e-9)
        if shares.max() > worst:
            worst, light, at = float(shares.max()), one.names[int(shares.argmax())], number
        yield one
    if worst > MOST_DIFFERENT:
        caller.warn(
            f"{where}: pictures 1 and {at} of light {light!r} differ by {worst:.0%} of their light. Expected pictures "
            "of one still scene, each light in a folder of its own with one exposure: the mean is taken. Where the "
            "folders are scenes of their own, name one of them; where the subject or the exposure changed, choose "
            "pictures with `frames`, or take them again."
        )


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
        _refuse_other_curve(take, reading.transfer)
        return _of_clip(take, reading, watch)
    plan = None if plan_path is None else read_plan(plan_path)
    lights = () if plan is None else plan.lights
    files = find_light_pictures(path, lights=lights)
    return _of_files(files, None if plan is None else plan.camera.encoding, reading)


def _of_files(files: LightFiles, planned: Encoding | None, reading: Reading) -> LightSets:
    """Return pictures as sets; ``planned`` is how they code light where a plan says it."""
    read, notes = _encoding(files, planned, reading.transfer)
    aside = tuple(f"{one}: is assumed to be no light's {_kind(one)} and left aside" for one in files.left_aside)
    sets = read_sets(files, encoding=read, frames=reading.frames, most=None if reading.frames else reading.most)
    room = None if files.room is None else read_picture(files.room, read)[0]
    return LightSets(
        name=files.folder.resolve().name,
        names=files.names,
        sets=sets,
        room=room,
        taken_as_dark=not files.ambient and not files.ambient_is_off,
        warnings=(*aside, *_uneven(files)),
        notes=notes,
    )


def _uneven(files: LightFiles) -> tuple[str, ...]:
    """Say where photographs were exposed differently, and what was made of it."""
    stated = [stated_by(paths[0]) for paths in files.by_light.values()]
    relative = relative_exposures(stated)
    times = files.ambient_times(0)
    said = []
    if relative is not None:
        said.append("strengths that are measured are those of these exposures, not of the lights alone")
    if times:
        said.append("the ambient light was scaled by it before it was taken off")
        if not says_as(stated_by(files.ambient_at(0)), stated[0]):
            said.append(f"{files.ambient_at(0).name} does not say how it was exposed, and is taken for a usual one")
    return (f"{files.folder}: by their EXIF the pictures were exposed differently: {'; '.join(said)}",) if said else ()


def _kind(path: Path) -> str:
    return "folder" if path.is_dir() else "picture"


def _encoding(files: LightFiles, planned: Encoding | None, transfer: str | None) -> tuple[Encoding, tuple[str, ...]]:
    """Return how pictures are read, and what to say of it: as somebody says, as the plan does, else as they do."""
    if planned is not None:
        return replace(planned, transfer=transfer or planned.transfer), ()
    if transfer is not None:
        return Encoding(transfer=transfer), ()
    curve, because = files.curve()
    return Encoding(transfer=curve), (f"the pictures are read as {curve!r}, {because}; `transfer` names another curve",)


def _refuse_other_curve(take: Take, transfer: str | None) -> None:
    """Raise UsageError where a clip's frames are to be read by another curve than they will be solved by."""
    planned = take.clip.encoding.transfer
    if transfer is not None and find_curve(transfer) is not find_curve(planned):
        raise UsageError(
            f"{take.clip.path}: is a clip, and its frames are read as {planned!r} as {take.clip.plan_path} says, not "
            f"as `transfer` {transfer!r}. Leave it out, or put the plan's [camera] transfer right: what is measured "
            "and what is solved must be read alike."
        )


def _of_clip(take: Take, reading: Reading, watch: Watch) -> LightSets:
    timing = find_timing(take, first_light=reading.first_light, watch=watch)
    plan = take.plan
    whole = gather(take, timing, aligning=UNMOVED, watch=watch)
    shown = partial(pictures_of_round, flashes_s=_flashes_s(plan))
    sets = map(shown, islice(whole, None if reading.frames else reading.most))
    guessed = (_guess(take, timing.order_note),) if timing.order == "guess" else ()
    return LightSets(
        name=take.clip.name,
        names=plan.lights,
        sets=_at_least_one(sets, take),
        warnings=(*take.clip.warnings, *guessed),
        notes=(*take.clip.notes, *timing.notes),
    )


def _flashes_s(plan: Plan) -> tuple[float, ...] | None:
    """Return the full flashes that plates show; of a synced plan only the exposure counts."""
    return None if plan.mode == "synced" else tuple(reference_duration_s(plan, light) for light in plan.lights)


def _guess(take: Take, note: str) -> str:
    return (
        f"{take.clip.path}: the plan has no marker, so which light is which is a guess ({note or 'nothing shows it'}). "
        "Name the light of the first complete flash with `first_light`."
    )


def _at_least_one(sets: Iterator[LightPictures], take: Take) -> Iterator[LightPictures]:
    count = 0
    for one in sets:
        count += 1
        yield one
    if not count:
        raise PsvideoError(
            f"{take.clip.path}: holds no round in which every light is complete, so there is nothing to calibrate "
            f"from. Use more frames: {len(take.numbers)} were read."
        )
