"""The whole of ``psvideo calibrate colours``: pictures of a white card in, the rig with every light's colour out."""

from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from psvideo.calibrate.led_colours import LedColours, measure_led_colours, with_colours
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import said_of
from psvideo.formats.clip_layout import PLAN_FILE
from psvideo.formats.plan_toml import read_plan
from psvideo.formats.rig_toml import format_rig, read_rig
from psvideo.formats.whole_files import write_text
from psvideo.model.irradiance.colours import MOST_COLOUR_CONDITION
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.runs.calibrate.flat_field import white_target
from psvideo.runs.calibrate.reading import check_albedo, pictures_of, reading_of, rig_out
from psvideo.runs.steps.caller import PYTHON, Caller


@dataclass(frozen=True, kw_only=True)
class ColourCalibration:
    """What a white card showed of every light's colour, and the rig with it."""

    found: LedColours
    rig: Rig


def colours(
    pictures: Path | str,
    *,
    rig: Path | str,
    out: Path | str,
    albedo: float = 0.9,
    box: tuple[int, int, int, int] | None = None,
    transfer: str | None = None,
    plan: Path | str | None = None,
    frames: str | None = None,
    first_light: str | None = None,
    force: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> ColourCalibration:
    """Measure what the camera's channels see of every coloured light, on a white card; write the rig with colours.

    - ``pictures``: a folder of stills, one per light alone, of plates, or a clip whose plan flashes one light at a
      time: the card faces the camera, or lies in the plane that the rig gives. A ``plan`` that flashes several lights
      at once says which colours must differ; else those of lights in one place must. ``transfer``, ``frames`` and
      ``first_light``: as for ``matte_sphere``.
    - ``rig``: whose directions or positions are known. ``out``: the rig file to write: each light's ``colour``, and its
      intensity in its brightest channel. ``force`` replaces it where it exists.
    - ``albedo``: the card's, above 0 and up to 1. ``box``: the card's part of the picture: left, top, right, bottom in
      pixels.

    Raises UsageError where the output exists or values cannot be, and PsvideoError where the card clips, the pictures
    are grey, or colours cannot be separated.
    """
    rig_path = rig_out(out, force=force)
    check_albedo(albedo)
    read_rig(Path(rig))  # its faults are said before pictures are read, or a clip's flashes are sought
    found = pictures_of(Path(pictures), reading_of(plan, frames, first_light, transfer), watch=watch, caller=caller)
    known = read_rig(Path(rig), plan_lights=found.names)
    target, ground = white_target(found, known, Path(rig), albedo=albedo, box=box)
    with said_of(pictures):
        measured = measure_led_colours(found, known, target, ground=ground, plan=_plan_of(pictures, plan))
    if not measured.known and measured.condition > MOST_COLOUR_CONDITION:
        nearly = f"nearly the same (condition number {measured.condition:.3g})"
        alike = nearly if isfinite(measured.condition) else "the same"
        caller.warn(
            f"the colours of {' and '.join(measured.together)} are {alike}, and nothing says which lights flash "
            "together: those two must not. Give the shoot's `plan`, which says it"
        )
    made = with_colours(known, measured)
    write_text(rig_path, format_rig(made))
    return ColourCalibration(found=measured, rig=made)


def _plan_of(pictures: Path | str, plan: Path | str | None) -> Plan | None:
    """Return the plan that is given, or that lies beside the pictures."""
    path = Path(pictures) / PLAN_FILE if plan is None else Path(plan)
    return read_plan(path) if plan is not None or path.is_file() else None
