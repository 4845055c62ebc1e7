"""The whole of ``psvideo stills``: photographs of a still scene, one per light, and no plan."""

import tempfile
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from pathlib import Path

from psvideo.calibrate.light_files import find_stills
from psvideo.calibrate.sphere.sphere_view import Looking
from psvideo.calibrate.still_pairs import pair_stills
from psvideo.clip import Take, decoded_once
from psvideo.clip.transfer import check_transfer
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import UsageError
from psvideo.export.asked import Asked, delivery_of
from psvideo.formats.paths import path_if_given, path_of
from psvideo.model.choices import MapFiles, MeshKind, Program, Solver
from psvideo.model.quantities import Aov
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.named_timing import read_or_find_timing
from psvideo.report.run_report import RunReport
from psvideo.runs.calibrate.mirror_sphere import looking_for, radius_in_m
from psvideo.runs.delivery.beforehand import metric_delivery
from psvideo.runs.instants.job import Job, OverTime
from psvideo.runs.instants.results import normals_run
from psvideo.runs.photographs.still_clip import still_clip, write_setup
from psvideo.runs.photographs.still_rig import KnownLights, listed_lights, sphere_lights
from psvideo.runs.steps.caller import PYTHON, Caller
from psvideo.runs.steps.lighting import AskedLighting, read_lighting
from psvideo.runs.steps.output import Output
from psvideo.solve.instants import Instant

STILL_HZ = Fraction(24)
"""What programs take a single picture for; one that stood for the pictures' number would be a rate of nothing."""


def stills(
    folder: Path | str,
    *,
    out: Path | str,
    lights: Path | str | None = None,
    sphere: Sequence[Path | str] = (),
    dark: Path | str | None = None,
    mask: Path | str | None = None,
    transfer: str | None = None,
    white_level: float | None = None,
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
      linear for 16 bits, EXR and DNG. The report says which, and what speaks against it. ``white_level``: the code at
      which they saturate, where that is not the largest one: 4095 of 12 bits in files of 16.
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
    output = Output(folder=path_of("out", out), force=force, caller=caller, kept=False)
    output.check()
    check_transfer(transfer)
    if lights is not None and not sphere:
        _refuse_words_on_spheres(radius_mm=radius_mm, circle=circle, spheres=spheres)
    if "motion" in aov:
        raise UsageError("`aov='motion'`: photographs of a still scene show no motion. Leave it out.")
    asked = Asked(preset=preset, aov=aov, mesh=mesh, encode=encode, plates=plates)
    delivery, _ = delivery_of(asked)
    if path.is_dir():
        find_stills(path)  # a folder without pictures is refused before balls are measured
    looking = looking_for(spheres, circle, focal_px, focal_mm, sensor_mm)
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
        opened = still_clip(path, pairs, known, looking, Path(place), transfer=transfer, white_level=white_level)
        for note in opened.clip.notes:
            caller.say(note)
        take = Take(clip=opened.clip, numbers=opened.clip.numbers)
        lighting = read_lighting(take, opened.rig_path, AskedLighting(mask=pairs.mask))
        lighting.check(delivery)
        delivery = metric_delivery(delivery, aov, lighting, caller)
        output = output.given(take, None, solver, fill, delivery, *lighting.identity)
        how = partial(Job, lighting=lighting, delivery=delivery, solver=solver, fill=fill)
        return _solved(take, how, output, beside=partial(write_setup, opened, rti=rti), watch=watch)


def _solved(
    take: Take, how: Callable[..., Job], output: Output, *, beside: Callable[[Path, Instant], None], watch: Watch
) -> RunReport:
    """Solve photographs as a clip of one round in which nothing moves; ``beside`` writes what else is kept of them."""
    with decoded_once(take, output=output.folder) as kept:
        timing = read_or_find_timing(kept, None, first_light=None, watch=watch)
        at_rest = OverTime(aligning=Aligning(align="none"))
        job = how(take=kept, timing=timing, over_time=at_rest, shown_at_hz=STILL_HZ)
        return normals_run(job, output, watch=watch, beside=beside).report


def _refuse_words_on_spheres(
    *, radius_mm: float | None, circle: Sequence[tuple[float, float, float]], spheres: int
) -> None:
    """Raise UsageError where something is said of mirror spheres and none is photographed."""
    given = [("radius_mm", radius_mm is not None), ("circle", bool(circle)), ("spheres", spheres != 1)]
    for name, said in given:
        if said:
            raise UsageError(
                f"`{name}` describes mirror spheres, and `lights` says where the lights are without any. Leave it out, "
                "or give `sphere` instead of `lights`."
            )


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
    """Return the lights that a file lists, or that mirror spheres show. Raises UsageError where not one is given."""
    if (lights is None) == (not spheres):
        raise UsageError(
            "`lights` and `sphere`: expected one of the two: a file that says where the lights are, or pictures of a "
            "mirror sphere under them."
        )
    if lights is not None:
        return listed_lights(lights)
    return sphere_lights(spheres, looking, radius_m=radius_m, transfer=transfer, watch=watch, caller=caller)
