"""Pictures of a scene, one per light, from still photographs or plates: the curve they are read by, and what is odd."""

from dataclasses import replace
from pathlib import Path

from psvideo.calibrate.picture_sets import LightFiles, read_picture, read_sets
from psvideo.clip.stated import relative_exposures, says_as, stated_by
from psvideo.errors import UsageError
from psvideo.model.camera import Encoding
from psvideo.runs.photographs.opened_sets import LightSets, Reading


def sets_of_files(files: LightFiles, planned: Encoding | None, reading: Reading) -> LightSets:
    """Return pictures as sets; ``planned`` is how they code light where a plan says it. Raises UsageError where the
    first light of a clip's flashes is named: they are none."""
    if reading.first_light is not None:
        raise UsageError(
            f"`first_light` {reading.first_light}: is for strobed clips, and {files.folder} holds pictures that each "
            "show the light that they are named after. Leave it out."
        )
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
