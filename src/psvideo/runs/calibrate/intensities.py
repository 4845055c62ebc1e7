"""The whole of ``psvideo calibrate intensities``: any matte scene in, the rig with relative intensities out."""

from dataclasses import dataclass
from pathlib import Path

from psvideo.calibrate.cho2020 import measure_strengths
from psvideo.calibrate.flat_field import with_intensities
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import said_of
from psvideo.formats.rig_toml import format_rig, read_rig
from psvideo.formats.whole_files import write_text
from psvideo.model.rig import Rig, directions
from psvideo.runs.calibrate.reading import pictures_of, reading_of, rig_out, warn_of_unmeasured
from psvideo.runs.steps.caller import PYTHON, Caller


@dataclass(frozen=True, kw_only=True)
class Intensities:
    """The rig with relative intensities, their mean 1 in every channel, and each light's relative standard error."""

    rig: Rig
    error: tuple[float, ...]


def intensities(
    pictures: Path | str,
    *,
    rig: Path | str,
    out: Path | str,
    transfer: str | None = None,
    plan: Path | str | None = None,
    frames: str | None = None,
    first_light: str | None = None,
    force: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> Intensities:
    """Measure the relative intensities of four or more distant lights of known directions from any matte scene.

    ``rig`` is the file whose directions are known, ``out`` the rig file to write; the other parameters are those of
    ``matte_sphere``. Raises UsageError where the output exists, and PsvideoError where the scene shows too little.
    """
    rig_path = rig_out(out, force=force)
    read_rig(Path(rig))  # its faults are said before pictures are read, or a clip's flashes are sought
    found = pictures_of(Path(pictures), reading_of(plan, frames, first_light, transfer), watch=watch, caller=caller)
    known = read_rig(Path(rig), plan_lights=found.names)
    warn_of_unmeasured(known, found.names, caller)
    with said_of(rig):
        towards = directions(known.select(found.names))
    with said_of(pictures):
        strengths = measure_strengths(found, towards)
    made = with_intensities(known, strengths.intensity.tolist(), found)
    write_text(rig_path, format_rig(made))
    return Intensities(rig=made, error=tuple(float(error) for error in strengths.error))
