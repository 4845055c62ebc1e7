"""Which rig belongs to a take: the one named, the one of its name in a folder of rigs, or rig.toml beside the footage.

A calibration of each of several takes writes such a folder.
"""

from collections.abc import Sequence
from pathlib import Path

from psvideo.errors import PsvideoError, UsageError, nearest
from psvideo.formats.paths import path_of, take_name
from psvideo.model.units import listed

RIG_FILE = "rig.toml"
"""What a rig is called that lies beside its footage."""
RIGS = (".toml", ".lp", ".txt")
"""What rigs and light lists end with."""
NAMED = 5
"""This many takes without a rig are named, and how many more there are is said."""


def rig_of_take(rig: Path | str | None, clip: Path) -> Path:
    """Return the rig of a take: the file itself, of a folder of rigs the one that is named after the take, or, left
    out, the one beside the footage.

    Raises UsageError where there is none, or where the folder has several of that name.
    """
    if rig is None:
        return _beside(clip)
    path = path_of("rig", rig)
    if not path.is_dir():
        return path
    name = take_name(clip)
    found = [path / f"{name}{suffix}" for suffix in RIGS if (path / f"{name}{suffix}").is_file()]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(one.name for one in found)
        raise UsageError(f"`rig` {path}: holds {names}, and {clip} has one rig. Take the others away, or name one.")
    raise UsageError(f"`rig` {path}: holds no rig for {clip}; expected {name}.toml. {_advice(path, name)}")


def rig_beside(clip: Path) -> Path | None:
    """Return the rig that lies in a clip's folder, or beside a movie; None where there is none."""
    path = (clip if clip.is_dir() else clip.parent) / RIG_FILE
    return path if path.is_file() else None


def _beside(clip: Path) -> Path:
    path = rig_beside(clip)
    if path is None:
        raise UsageError(
            f"{clip}: there is no {RIG_FILE} {'here' if clip.is_dir() else 'beside it'}, the file that says where the "
            "lights are. psvideo calibrate mirror-sphere measures them on a chrome ball: put its rig beside the "
            "footage, or name it with `rig`."
        )
    return path


def check_rigs(rig: Path | str | None, clips: Sequence[Path | str]) -> None:
    """Raise UsageError, which names them all, where a folder of rigs has none for some of several takes, or two."""
    if rig is None or not path_of("rig", rig).is_dir():
        return
    missing = []
    for clip in (path_of("clips", one) for one in clips):
        try:
            rig_of_take(rig, clip)
        except PsvideoError as fault:
            missing.append((clip, fault))
    if len(missing) == 1:
        raise missing[0][1]
    if missing:
        named = listed([take_name(clip) for clip, _ in missing], NAMED)
        raise UsageError(
            f"`rig` {rig}: holds no rig, or several, for {len(missing)} of {len(clips)} takes: {named}. A take's "
            f"rig is named after it: {take_name(missing[0][0])}.toml. {_advice(path_of('rig', rig), '')}"
        )


def _advice(folder: Path, name: str) -> str:
    """Return which rigs a folder holds, and what else to do."""
    there = sorted({one.stem for one in folder.iterdir() if one.suffix in RIGS})
    if not there:
        return "It holds none at all. Name a rig file, or the folder that a calibration of each take was written into."
    return f"{nearest(name, there).capitalize()} Rename rigs after their takes, or name one rig file for all."
