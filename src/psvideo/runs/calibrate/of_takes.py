"""Several calibrations in one go: a rig for every take, one report over all, and which lights did not stay the same.

A set whose lights are moved or knocked is calibrated again and again; the report says in which take that shows.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.paths import path_of
from psvideo.formats.rig_toml import SCHEMA
from psvideo.formats.whole_files import PICTURE_MARK, refuse_existing, write_text
from psvideo.model.rig import Rig
from psvideo.report.rigs_report import LightOfTake, RigResult, rigs_page, rigs_record, worst_rigs_first
from psvideo.report.stood_still import changes
from psvideo.runs.calibrate.colours import colours
from psvideo.runs.calibrate.flat_field import flat_field
from psvideo.runs.calibrate.intensities import intensities
from psvideo.runs.calibrate.matte_sphere import matte_sphere
from psvideo.runs.calibrate.mirror_sphere import mirror_sphere
from psvideo.runs.many_takes.cluster import Cluster, connected
from psvideo.runs.many_takes.handed_out import called_apart
from psvideo.runs.many_takes.several_takes import names_of, whole_options
from psvideo.runs.steps.caller import PYTHON, Caller

Calibration = Literal["mirror-sphere", "matte-sphere", "flat-field", "colours", "intensities"]
RUNS: Mapping[Calibration, Callable[..., object]] = {
    "mirror-sphere": mirror_sphere,
    "matte-sphere": matte_sphere,
    "flat-field": flat_field,
    "colours": colours,
    "intensities": intensities,
}


def calibrate_takes(
    calibration: Calibration,
    pictures: Sequence[Path | str],
    *,
    out: Path | str,
    workers: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
    **options: Any,
) -> tuple[RigResult, ...]:
    """Calibrate on each of several takes; write a rig for each into a folder, and one report over all.

    - ``calibration``: which. ``pictures``: in the order in which they were shot, each a folder of stills or of plates,
      or a clip, with one place of the sphere. ``options`` are those of the calibration.
    - ``out``: the folder; rigs (and pictures) are named after the takes. ``force`` replaces those that exist.
    - ``workers``: this many processes on this computer; ``scheduler``: the workers of a dask cluster, by its address;
      both need the extra ``psvideo[dask]``. With neither, one take is measured after the other here.

    Returns what became of every take, the worst first: one that cannot be measured does not keep the others. A light
    that stands elsewhere, or shines otherwise, than in the takes before it by more than both errors explain is among
    its take's findings.

    Raises UsageError where parameters do not fit together or an output exists, before any work is done, and
    PsvideoError where no scheduler answers, or it is gone.
    """
    folder, paths = path_of("out", out), [path_of("pictures", path) for path in pictures]
    if folder.suffix == ".toml" or folder.is_file():
        raise UsageError(f"{folder}: names a file, and every take gets its own rig. Name a folder.")
    if options.get("flat") is not None:
        raise UsageError("`flat` is the falloff of a single take. Leave it out here, and measure that take alone.")
    rigs = {path: folder / f"{name}.toml" for path, name in zip(paths, names_of("pictures", paths), strict=True)}
    for rig in rigs.values():
        refuse_existing(rig, force=force, mark=SCHEMA)
        if calibration in ("mirror-sphere", "matte-sphere"):
            refuse_existing(rig.with_suffix(".png"), force=force, mark=PICTURE_MARK)
    whole = {**whole_options(RUNS[calibration], options), "force": force}
    one = partial(_measured, calibration=calibration, folder=folder.resolve(), options=whole)
    found: dict[Path, RigResult] = {}
    for path, result in _done(one, rigs, Cluster(workers=workers, scheduler=scheduler), watch):
        warnings = tuple(caller.spell(words) for words in result.findings)
        found[path] = replace(result, take=path, rig=rigs[path], fault=caller.spell(result.fault), findings=warnings)
    results = worst_rigs_first(changes([found[path] for path in paths]))
    write_text(folder / "report.json", json.dumps(rigs_record(results), indent=1) + "\n")
    write_text(folder / "report.html", rigs_page(results))
    return results


def _done(
    one: "partial[RigResult]", rigs: dict[Path, Path], cluster: Cluster, watch: Watch
) -> Iterator[tuple[Path, RigResult]]:
    """Give every take with what was measured, as it is done."""
    if not cluster.named:
        for path in watch(rigs, total=len(rigs), what="calibrating", unit="takes"):
            yield path, one((path.resolve(), rigs[path].name))
        return
    cluster.check()
    given = {(path.resolve(), rig.name): path for path, rig in rigs.items()}
    with connected(cluster) as client:
        for key, result in called_apart(client, one, [*given], watch=watch, what="calibrating"):
            if isinstance(result, str):  # its worker failed, and not the footage
                result = RigResult(take=key[0], rig=rigs[given[key]], fault=result)
            yield given[key], result


@dataclass
class _Heard:
    """Keeps what a calibration warns of, for the report."""

    warnings: list[str] = field(default_factory=list)

    def caller(self) -> Caller:
        return Caller(say=_unheard, warn=self.warnings.append, detail=_unheard)


def _unheard(_: str) -> None:
    """Leave out what is said on the way: of many takes it would be without end."""


def _measured(which: tuple[Path, str], *, calibration: Calibration, folder: Path, options: dict[str, Any]) -> RigResult:
    """Measure one take, here or in a worker, and write its rig."""
    path, name = which
    heard, out = _Heard(), folder / name
    try:
        lights = _lights(calibration, path, out=out, caller=heard.caller(), **options)
    except (PsvideoError, OSError) as fault:
        return RigResult(take=path, rig=out, fault=str(fault))
    return RigResult(take=path, rig=out, lights=lights, findings=tuple(heard.warnings))


def _lights(calibration: Calibration, path: Path, **options: Any) -> tuple[LightOfTake, ...]:
    """Return the lights that a calibration shows, with the relative errors of their intensities where it has them."""
    if calibration == "mirror-sphere":
        mirror = mirror_sphere([path], **options)
        return _of_rig(mirror.rig, {}, missing=[light.name for light in mirror.lights if light.fault])
    if calibration == "matte-sphere":
        matte = matte_sphere(path, **options)
        errors = {light.name: light.intensity_error for light in matte.lights}
        return _of_rig(matte.rig, errors, missing=[light.name for light in matte.lights if light.fault])
    if calibration == "flat-field":
        flat = flat_field(path, **options)
        return _of_rig(flat.rig, {light.name: light.intensity_error for light in flat.lights})
    if calibration == "colours":
        card = colours(path, **options)
        return _of_rig(card.rig, dict(zip(card.found.names, card.found.error.max(axis=-1).tolist(), strict=True)))
    scene = intensities(path, **options)
    return _of_rig(scene.rig, dict(zip((light.name for light in scene.rig.lights), scene.error, strict=True)))


def _of_rig(rig: Rig, errors: dict[str, float], missing: Sequence[str] = ()) -> tuple[LightOfTake, ...]:
    known = tuple(
        LightOfTake(
            name=light.name,
            direction=light.direction,
            error_deg=light.error_deg,
            intensity=sum(light.intensity) / len(light.intensity),
            intensity_error=errors.get(light.name),
        )
        for light in rig.lights
    )
    return known + tuple(LightOfTake(name=name, missing=True) for name in missing)
