"""The whole of ``psvideo calibrate convert``: a rig in, the file of lights that another program reads out."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from psvideo.errors import UsageError
from psvideo.formats.light_lists.light_list_writer import files_of, write_rig
from psvideo.formats.rig_toml import SCHEMA, read_rig
from psvideo.formats.whole_files import refuse_existing
from psvideo.model.rig import Rig
from psvideo.model.units import counted
from psvideo.runs.steps.caller import PYTHON, Caller


@dataclass(frozen=True, kw_only=True)
class ConvertedRig:
    """The rig that was read, and the files that hold it now: two for DiLiGenT."""

    rig: Rig
    files: tuple[Path, ...]


def convert(
    rig: Path | str,
    *,
    out: Path | str,
    name: Sequence[str] = (),
    force: bool = False,
    caller: Caller = PYTHON,
) -> ConvertedRig:
    """Write a rig as rig.toml, as an .lp file (RTI), or as DiLiGenT's two lists of directions and intensities.

    ``rig`` is a rig.toml, an .lp file, or a DiLiGenT or UW list; the name of ``out`` sets the kind: *.toml, *.lp or
    light_directions.txt. ``name``: for a list that names none of them, the lights' names in order; ``force``
    replaces what exists. ``caller`` is warned of what the kind cannot hold. Raises UsageError where an output exists
    or its name shows no kind, and PsvideoError where the rig cannot be read, or a light is near and lists hold
    directions only.
    """
    path = Path(out)
    files = files_of(path)
    for file in files:
        refuse_existing(file, force=force, mark=SCHEMA if file.suffix == ".toml" else None)
    if name and Path(rig).suffix == ".toml":
        raise UsageError(f"`name`: {rig} names its lights itself. Leave it out, or change the names in that file.")
    if name:
        _check_names(Path(rig), name)
    found = read_rig(Path(rig))
    if name:
        renamed = zip(found.lights, name, strict=True)
        found = replace(found, lights=tuple(replace(light, name=own) for light, own in renamed))
    for sentence in write_rig(path, found):
        caller.warn(sentence)
    return ConvertedRig(rig=found, files=files)


def _check_names(path: Path, names: Sequence[str]) -> None:
    """Raise UsageError where there are not as many names as the list has lights, or where one of them is the name that
    the list itself gives to another light."""
    listed = read_rig(path).names
    if any(name in listed and name != own for name, own in zip(names, listed, strict=False)):
        raise UsageError(
            f"`name`: {path} names its lights itself ({', '.join(listed)}), and some of these names are given to other "
            "lights here. Leave it out, or give every light its own name or a new one."
        )
    if len(listed) != len(names):
        raise UsageError(
            f"`name`: {path} lists {counted(len(listed), 'light')}, and is given {counted(len(names), 'name')} "
            f"({', '.join(names)}). Give one for each light, in the list's order{_typed(names)}."
        )


def _typed(names: Sequence[str]) -> str:
    """Return what to type where several names were given as one word, with commas or spaces between; else ""."""
    apart = re.split(r"[\s,;]+", " ".join(names).strip())
    return ": " + " ".join(f"`name` {one}" for one in apart) if len(apart) > len(names) else ""
