"""Photographs as a clip with a plan and a rig, what was assumed of them, and what of it lies beside the results."""

from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from psvideo.calibrate.sphere.sphere_view import Looking
from psvideo.calibrate.still_pairs import Pairs
from psvideo.clip import Clip
from psvideo.clip.stills import Photographs, look_at
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.clip_layout import PLAN_FILE, SETUP
from psvideo.formats.light_lists.light_list_writer import write_rig
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.rig_folder import RIG_FILE
from psvideo.formats.rig_toml import format_rig
from psvideo.formats.whole_files import write_text
from psvideo.model.camera import Camera
from psvideo.model.plan import PlannedFlash, assemble_plan
from psvideo.model.rig import Rig
from psvideo.runs.photographs.glance import glance_at
from psvideo.runs.photographs.rti import write_rti
from psvideo.runs.photographs.still_doubts import curve_doubt, dark_doubt, exposures_of
from psvideo.runs.photographs.still_rig import KnownLights, lens_stated
from psvideo.solve.instants import Instant

RIG, LP = RIG_FILE, "lights.lp"
SAME_FOCAL = 0.001
"""Focal lengths that differ by a smaller share are the same, rounded."""
NO_DARK = (
    "No picture is named dark or ambient, so the room is assumed dark. If it was not, photograph the subject with "
    "every light off as well."
)


@dataclass(frozen=True, kw_only=True)
class StillClip:
    """Photographs as a clip, and their lights in the clip's order."""

    clip: Clip
    rig: Rig
    rig_path: Path


def still_clip(
    folder: Path,
    pairs: Pairs,
    known: KnownLights,
    looking: Looking,
    place: Path,
    *,
    transfer: str | None,
    white_level: float | None = None,
) -> StillClip:
    """Return the photographs as a clip; plan and rig are written into ``place``."""
    files = (*pairs.files, *([pairs.dark] if pairs.dark else []))
    pictures = look_at(files, transfer=transfer, white_level=white_level)
    _check_size(folder, pictures, known)
    rig = known.at(pairs.places, pairs.names)
    glance = glance_at(pictures, rig.lights)
    exposures, note, warning = exposures_of(glance, pictures, len(pairs.files))
    if exposures is not None:
        rig = _scaled(rig, exposures[: len(rig.lights)])
        glance = None if glance is None else glance.exposed(exposures)
    rig, lens = _through_lens(rig, pictures, looking, known)
    doubt = curve_doubt(glance, pictures)
    write_text(place / RIG, format_rig(rig))
    plan = assemble_plan(
        camera=Camera(
            name=pictures.stated[0].camera or "camera",
            width_px=pictures.header.width_px,
            height_px=pictures.header.height_px,
            fps=Fraction(1),
            exposure_s=1.0,
            readout_s=0.0,
            encoding=pictures.encoding,
        ),
        flashes=_flashes(pairs),
        dark_s=None,
        mode="synced",
    )
    write_text(place / PLAN_FILE, format_plan(plan))
    notes = (_assumed(pictures), pairs.how, *known.notes, *([note] if note else []), *lens, *_aside(pairs))
    clip = pictures.clip(folder, plan, place / PLAN_FILE, notes=notes)
    doubts = (warning, dark_doubt(glance, pictures, pairs.aside))
    warned = (*clip.warnings, *known.warnings, *(one for one in doubts if one))
    uneven = () if exposures is None or not pairs.dark else tuple(exposures.tolist())
    clip = replace(clip, curve_doubt=doubt or "", warnings=warned, exposures=uneven)
    return StillClip(clip=clip, rig=rig, rig_path=place / RIG)


def _check_size(folder: Path, pictures: Photographs, known: KnownLights) -> None:
    """Raise PsvideoError where lights' positions rest on pictures of another size: crops lose the lens's axis."""
    size_px = _size_px(pictures)
    near = any(light.position_m is not None for light in known.rig.lights)
    if near and known.size_px is not None and known.size_px != size_px:
        raise PsvideoError(
            f"{folder}: the photographs are {size_px[0]} x {size_px[1]} pixels and those of the spheres "
            f"{known.size_px[0]} x {known.size_px[1]}. Expected one size, whole pictures of one camera: near lights "
            "are placed along the lens's axis, which crops lose. Give pictures that are neither cropped nor scaled, "
            "or leave `radius_mm` out for directions."
        )


def _size_px(pictures: Photographs) -> tuple[int, int]:
    return pictures.header.turn.size(pictures.header.width_px, pictures.header.height_px)


def _through_lens(rig: Rig, pictures: Photographs, looking: Looking, known: KnownLights) -> tuple[Rig, tuple[str, ...]]:
    """Return the rig with the lens that was given, or that EXIF names; with what is to be said of it. Raises UsageError
    where the rig has another lens than is given."""
    rig, left_out = _of_its_size(rig, pictures, known)
    width_px, height_px = _size_px(pictures)
    given_px = None if left_out else looking.view(width_px=width_px, height_px=height_px).focal_px
    if rig.focal_px is not None:
        if given_px is not None and abs(given_px / rig.focal_px[0] - 1) > SAME_FOCAL:
            raise UsageError(
                f"`focal_px` is {given_px:.6g}, and {known.whose} says that the lens is {rig.focal_px[0]:.6g} pixels "
                "long. Leave it out, or put it right in [camera] focal_px of the rig."
            )
        return rig, ()
    lens_px = given_px or lens_stated(pictures.stated)
    if lens_px is None:
        return rig, left_out
    said = (
        left_out
        if given_px
        else (
            *left_out,
            f"The lens is assumed to be {lens_px:.6g} pixels long, as EXIF says; shapes depend on it.",
        )
    )
    return replace(rig, focal_px=(lens_px, lens_px)), said


def _of_its_size(rig: Rig, pictures: Photographs, known: KnownLights) -> tuple[Rig, tuple[str, ...]]:
    """Return the rig without the lens of spheres whose pictures have another size than the photographs."""
    size_px = _size_px(pictures)
    if known.size_px is None or known.size_px == size_px or rig.focal_px is None:
        return rig, ()
    note = (
        f"The photographs are {size_px[0]} x {size_px[1]} pixels and those of the spheres {known.size_px[0]} x "
        f"{known.size_px[1]}, cropped or scaled, so the spheres' lens and its axis are not taken for the photographs'. "
        "Give whole pictures, or a rig with [camera] focal_px."
    )
    return replace(rig, focal_px=None, principal_px=None), (note,)


def _flashes(pairs: Pairs) -> list[PlannedFlash]:
    lit = [PlannedFlash(lights={name: 1.0}, duration_s=0.5) for name in pairs.names]
    return lit + ([PlannedFlash(lights={}, duration_s=0.5)] if pairs.dark else [])


def _scaled(rig: Rig, factors: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Rig:
    lights = tuple(
        replace(light, intensity=tuple(float(one * factor) for one in light.intensity))
        for light, factor in zip(rig.lights, factors, strict=True)
    )
    return replace(rig, lights=lights)


def _assumed(pictures: Photographs) -> str:
    said = f"The pictures were read as {pictures.transfer!r}, {pictures.because}."
    if pictures.white is None:
        return said
    if pictures.header.bits is not None:
        return f"{said} They saturate at code {pictures.white:g}, as you say."
    if pictures.brightest <= pictures.white:
        return f"{said} They hold light up to {pictures.white:.3g}: nothing below it counts as clipped."
    most, white = pictures.brightest, pictures.white
    return f"{said} They hold light up to {most:.3g}: highlights beyond {white:.3g} count as clipped."


def _aside(pairs: Pairs) -> tuple[str, ...]:
    said = [f"{pairs.dark.name} shows the ambient light, which was taken off." if pairs.dark else NO_DARK]
    said.append(f"{pairs.mask.name} says where to solve." if pairs.mask else "")
    said.append(f"Left aside: {', '.join(file.name for file in pairs.aside[:6])}." if pairs.aside else "")
    return tuple(one for one in said if one)


def write_setup(opened: StillClip, folder: Path, instant: Instant, *, rti: bool) -> None:
    """Write what was taken for granted into the folder of results, and the relightable picture."""
    (folder / SETUP).mkdir(exist_ok=True)
    write_text(folder / SETUP / PLAN_FILE, format_plan(opened.clip.plan))
    write_text(folder / SETUP / RIG, format_rig(opened.rig))
    if all(light.direction is not None for light in opened.rig.lights):
        write_rig(folder / SETUP / LP, opened.rig)
        if rti:
            write_rti(folder, instant.round, opened.rig)
