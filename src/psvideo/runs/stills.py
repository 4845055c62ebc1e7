"""The whole of ``psvideo stills``: photographs of a still scene, one per light, and no plan."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np

from psvideo.calibrate.sphere.sighting import Looking
from psvideo.calibrate.still_pairs import Pairs, pair_stills
from psvideo.clip import Clip, Take, decoded_once
from psvideo.clip.stills import Photographs, look_at
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError, UsageError
from psvideo.export.asked import Asked, delivery_of
from psvideo.formats.light_list_writer import write_rig
from psvideo.formats.paths import path_if_given, path_of
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.rig_toml import format_rig
from psvideo.formats.whole_files import write_text
from psvideo.model.camera import Camera
from psvideo.model.choices import MapFiles, MeshKind, Program, Solver
from psvideo.model.plan import PlannedFlash, assemble_plan
from psvideo.model.quantities import Aov
from psvideo.model.rig import Rig
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.timed import read_or_find_timing
from psvideo.report.run_report import RunReport
from psvideo.runs.calibrate.mirror_sphere import focal_widths, radius_in_m
from psvideo.runs.delivery.delivering import metric_delivery
from psvideo.runs.instants.job import Job, OverTime
from psvideo.runs.instants.results import normals_run
from psvideo.runs.photographs.rti import write_rti
from psvideo.runs.photographs.still_doubts import curve_doubt, exposures_of, glance_at
from psvideo.runs.photographs.still_rig import KnownLights, lens_stated, listed_lights, sphere_lights
from psvideo.runs.steps.caller import PYTHON, Caller
from psvideo.runs.steps.lighting import read_lighting
from psvideo.runs.steps.output import Output
from psvideo.solve.instants import Instant

PLAN, RIG, LP = "plan.toml", "rig.toml", "lights.lp"
SETUP = "setup"
"""The folder in a result that holds how the photographs were taken to be: plan, rig, and the lights as a list."""
NO_DARK = (
    "No picture is named dark or ambient, so the room is assumed dark. If it was not, photograph the subject with "
    "every light off as well."
)


def stills(
    folder: Path | str,
    *,
    out: Path | str,
    lights: Path | str | None = None,
    sphere: Sequence[Path | str] = (),
    dark: Path | str | None = None,
    mask: Path | str | None = None,
    transfer: str | None = None,
    focal_px: float | None = None,
    focal_mm: float | None = None,
    sensor_mm: float | None = None,
    radius_mm: float | None = None,
    circle: Sequence[tuple[float, float, float]] = (),
    spheres: int = 1,
    solver: Solver = "auto",
    fill: bool = True,
    preset: Program | None = None,
    aov: Sequence[Aov] = (),
    mesh: Sequence[MeshKind] = (),
    encode: MapFiles | None = None,
    plates: bool = False,
    rti: bool = True,
    force: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> RunReport:
    """Write normals, albedo and validity of photographs of one still scene, one per light.

    - ``folder``: the photographs, of any names: JPEG, PNG, TIFF, EXR, DNG or a camera's raw files, of one size. One
      named ``dark`` or ``ambient`` shows the scene with every light off and is taken off the others; one named ``mask``
      is white where to solve. ``dark`` and ``mask`` name them where they lie elsewhere.
    - ``lights``: where the lights are: rig.toml, an .lp file, a DiLiGenT or UW list, or a table of names, directions
      and strengths. Or ``sphere``: pictures of a mirror sphere under the same lights, as a folder or a pattern
      (``ball/left_*.jpg``) for each place of the sphere, or picture by picture, those of one folder as one place; with
      ``radius_mm`` and the lens (``focal_px``, or ``focal_mm`` with ``sensor_mm``) two places give near lights their
      positions. ``spheres``: how many each picture holds; ``circle``: outlines found by hand, x, y and radius in
      pixels.
    - ``transfer``: how the files code light. Left out: as their ICC profile or PNG chunk says, else sRGB for 8 bits and
      linear for 16 bits, EXR and DNG. The report says which, and what speaks against it.
    - ``rti``: write ``rti/`` too, a polynomial texture map that OpenLIME shows in a web page, and the same as ``.ptm``
      (of distant lights).
    - ``solver``, ``fill``, ``preset``, ``aov``, ``mesh``, ``encode``, ``plates``, ``force``: as for ``normals``.

    Pictures are paired with lights by name where the names fit, else by order; the report says which. Written into
    ``out`` is what ``normals`` writes, and ``setup/`` with plan.toml, rig.toml and lights.lp: what was assumed.
    ``watch`` is handed every long loop, and ``caller`` the sentences that come on the way.

    Returns
    -------
    RunReport
        As ``normals`` returns it.

    Raises
    ------
    UsageError
        Where parameters do not fit together, or ``out`` exists.
    PsvideoError
        Where pictures and lights do not go together, or cannot be used.

    Examples
    --------
    >>> import psvideo as ps
    >>> report = ps.stills("stills/", lights="take3/rig.toml", out="still_results/")
    >>> [light.name for light in report.lights]
    ['key', 'left', 'top']
    """
    path = path_of("folder", folder)
    output = Output(folder=path_of("out", out), force=force, caller=caller)
    output.check()
    asked = Asked(preset=preset, aov=aov, mesh=mesh, encode=encode, plates=plates)
    delivery, _ = delivery_of(asked)
    looking = Looking(
        spheres=spheres,
        circles=tuple(circle),
        focal_px=focal_px,
        focal_widths=focal_widths(focal_px, focal_mm, sensor_mm),
    )
    known = _known_lights(
        path_if_given("lights", lights),
        [path_of("sphere", one) for one in sphere],
        looking,
        radius_m=radius_in_m(radius_mm),
        transfer=transfer,
        watch=watch,
        caller=caller,
    )
    pairs = pair_stills(
        path,
        known.called or known.rig.names,
        named=known.named,
        whose=known.whose,
        keep_names=known.own,
        dark=path_if_given("dark", dark),
        mask=path_if_given("mask", mask),
    )
    with tempfile.TemporaryDirectory(prefix="psvideo-stills-") as place:
        opened = _opened(path, pairs, known, looking, Path(place), transfer=transfer)
        take = Take(clip=opened.clip, numbers=opened.clip.numbers)
        for note in take.clip.notes:
            caller.say(note)
        lighting = read_lighting(take, opened.rig_path, pairs.mask)
        lighting.check(delivery)
        delivery = metric_delivery(delivery, aov, lighting, caller)
        over_time = OverTime(aligning=Aligning(align="none"))
        output = output.given(take, None, solver, fill, delivery, *lighting.identity)
        with decoded_once(take, output=output.folder) as kept:
            job = Job(
                take=kept,
                timing=read_or_find_timing(kept, None, first_light=None, watch=watch),
                lighting=lighting,
                delivery=delivery,
                solver=solver,
                fill=fill,
                over_time=over_time,
            )
            return normals_run(job, output, watch=watch, beside=partial(_write_beside, opened, rti=rti)).report


@dataclass(frozen=True, kw_only=True)
class _Opened:
    """Photographs as a clip, and their lights in the clip's order."""

    clip: Clip
    rig: Rig
    rig_path: Path


def _known_lights(
    lights: Path | None,
    spheres: Sequence[Path],
    looking: Looking,
    *,
    radius_m: float | None,
    transfer: str | None,
    watch: Watch,
    caller: Caller,
) -> KnownLights:
    if (lights is None) == (not spheres):
        raise UsageError(
            "`lights` and `sphere`: expected one of the two: a file that says where the lights are, or pictures of a "
            "mirror sphere under them."
        )
    if lights is not None:
        return listed_lights(lights)
    return sphere_lights(spheres, looking, radius_m=radius_m, transfer=transfer, watch=watch, caller=caller)


def _opened(
    folder: Path, pairs: Pairs, known: KnownLights, looking: Looking, place: Path, *, transfer: str | None
) -> _Opened:
    """Return the photographs as a clip; plan and rig are written into ``place``."""
    files = (*pairs.files, *([pairs.dark] if pairs.dark else []))
    pictures = look_at(files, transfer=transfer)
    _check_size(folder, pictures, known)
    rig = known.in_order(pairs.names)
    glance = glance_at(pictures, rig.lights)
    exposures, note, warning = exposures_of(glance, pictures, len(pairs.files))
    if exposures is not None:
        rig = _scaled(rig, exposures)
    rig, lens = _through_lens(rig, pictures, looking)
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
    write_text(place / PLAN, format_plan(plan))
    notes = (_assumed(pictures), pairs.how, *known.notes, *([note] if note else []), *lens, *_aside(pairs))
    clip = pictures.clip(folder, plan, place / PLAN, notes=notes)
    warned = (*clip.warnings, *known.warnings, *([warning] if warning else []))
    return _Opened(clip=replace(clip, curve_doubt=doubt or "", warnings=warned), rig=rig, rig_path=place / RIG)


def _check_size(folder: Path, pictures: Photographs, known: KnownLights) -> None:
    """Raise PsvideoError where lights' positions rest on pictures of another size: crops lose the lens's axis."""
    size_px = pictures.header.turn.size(pictures.header.width_px, pictures.header.height_px)
    if known.size_px is not None and known.size_px != size_px:
        raise PsvideoError(
            f"{folder}: the photographs are {size_px[0]} x {size_px[1]} pixels and those of the spheres "
            f"{known.size_px[0]} x {known.size_px[1]}. Expected one size, whole pictures of one camera: near lights "
            "are placed along the lens's axis, which crops lose. Give pictures that are neither cropped nor scaled, "
            "or leave `radius_mm` out for directions."
        )


def _through_lens(rig: Rig, pictures: Photographs, looking: Looking) -> tuple[Rig, tuple[str, ...]]:
    """Return the rig with the lens that was given, or that EXIF names; with what is to be said of it."""
    if rig.focal_px is not None:
        return rig, ()
    header = pictures.header
    wide_px = header.turn.size(header.width_px, header.height_px)[0]
    given_px = looking.focal_px or (looking.focal_widths * wide_px if looking.focal_widths else None)
    lens_px = given_px or lens_stated(pictures.stated)
    if lens_px is None:
        return rig, ()
    said = (
        ()
        if given_px
        else (f"The lens is assumed to be {lens_px:.6g} pixels long, as EXIF says; shapes depend on it.",)
    )
    return replace(rig, focal_px=(lens_px, lens_px)), said


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
    if pictures.brightest <= pictures.white:
        return f"{said} They hold light up to {pictures.white:.3g}: nothing below it counts as clipped."
    most, white = pictures.brightest, pictures.white
    return f"{said} They hold light up to {most:.3g}: highlights beyond {white:.3g} count as clipped."


def _aside(pairs: Pairs) -> tuple[str, ...]:
    said = [f"{pairs.dark.name} shows the ambient light, which was taken off." if pairs.dark else NO_DARK]
    said.append(f"{pairs.mask.name} says where to solve." if pairs.mask else "")
    said.append(f"Left aside: {', '.join(file.name for file in pairs.aside[:6])}." if pairs.aside else "")
    return tuple(one for one in said if one)


def _write_beside(opened: _Opened, folder: Path, instant: Instant, *, rti: bool) -> None:
    """Write what was taken for granted into the folder of results, and the relightable picture."""
    (folder / SETUP).mkdir(exist_ok=True)
    write_text(folder / SETUP / PLAN, format_plan(opened.clip.plan))
    write_text(folder / SETUP / RIG, format_rig(opened.rig))
    if all(light.direction is not None for light in opened.rig.lights):
        write_rig(folder / SETUP / LP, opened.rig)
        if rti:
            write_rti(folder, instant.round, opened.rig)
