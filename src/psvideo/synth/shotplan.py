"""From a scene to its records: the plan that the strobe plays, the one that the clip comes with, the rig, the clock."""

import dataclasses

import numpy as np

from psvideo.formats.frame_rates import parse_fps
from psvideo.model.camera import Camera, Encoding, exposure_of
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Light, Rig, Vector, vector
from psvideo.synth.camera.encode import codes_of
from psvideo.synth.lamps.true_flashes import TrueClock
from psvideo.synth.scene import Scene
from psvideo.synth.scene_tables import CameraTable, Kind, LightTable


def camera_of(table: CameraTable, kind: Kind) -> Camera:
    """Return the camera; EXR and DNG files carry their levels themselves, and DNG its mosaic."""
    scale = codes_of(table, kind)
    stated = Encoding(transfer=table.transfer, black_level=scale.black, white_level=scale.white, cfa=table.cfa)
    encoding = Encoding(transfer=table.transfer, cfa=table.cfa if kind == "exr" else None)
    return Camera(
        name=table.name,
        width_px=table.width_px,
        height_px=table.height_px,
        fps=table.rate,
        exposure_s=exposure_of(table.rate, shutter_deg=table.shutter_deg, exposure_s=table.exposure_s),
        readout_s=table.readout_s,
        encoding=encoding if kind in ("exr", "dng") else stated,
    )


def true_plan(scene: Scene) -> Plan:
    """Return the plan as it is really played, with the camera as it really is."""
    listed = tuple(PlannedFlash(lights=dict(f.lights), duration_s=f.duration_s) for f in scene.strobe.flash)
    return scene.strobe.plan(camera_of(scene.camera, scene.output.kind), listed or _one_flash_per_light(scene))


def _one_flash_per_light(scene: Scene) -> tuple[PlannedFlash, ...]:
    """Return the round where the scene lists none: every light once, then a dark slot as marker."""
    duration_s = scene.strobe.flash_s
    lit = [PlannedFlash(lights={light.name: 1.0}, duration_s=duration_s) for light in scene.light]
    return (*lit, PlannedFlash(lights={}, duration_s=duration_s)) if scene.strobe.marker else tuple(lit)


def claimed_plan(scene: Scene) -> Plan:
    """Return the plan that lies beside the footage: the true one, or what the scene lets it claim instead."""
    plan, claim = true_plan(scene), scene.plan
    camera = plan.camera
    if claim.fps is not None:
        fps = parse_fps(claim.fps)
        camera = dataclasses.replace(camera, fps=fps, exposure_s=camera.exposure_s * float(camera.fps / fps))
    if claim.readout_s is not None:
        camera = dataclasses.replace(camera, readout_s=None if claim.readout_s == "unknown" else claim.readout_s)
    if not claim.tails:
        plan = dataclasses.replace(plan, rise_s=0.0, fall_s=0.0)
    return dataclasses.replace(plan, camera=camera)


def reference_durations_s(plan: Plan) -> dict[str, float]:
    """Return the duration at which a light's intensity is meant: that of its first flash in the round."""
    found: dict[str, float] = {}
    for flash in plan.flashes:
        for name in flash.lit:
            found.setdefault(name, flash.duration_s)
    return found


def true_rig(scene: Scene, subject_m: float | None = None) -> Rig:
    """Return the rig with the lights where they truly are.

    ``subject_m`` is how far before the camera the subject stands: where lights are near, the crew measured it, too.
    """
    reference_s = reference_durations_s(true_plan(scene))
    camera = scene.camera
    perspective = camera.view == "perspective" and camera.focal_px is not None
    focal = camera.focal_px or 0.0
    near = any(light.position_m is not None for light in scene.light)
    return Rig(
        plane=(0.0, 0.0, 1.0, round(subject_m, 3)) if perspective and near and subject_m is not None else None,
        lights=tuple(_light(light, reference_s.get(light.name)) for light in scene.light),
        focal_px=(focal, focal) if perspective else None,
        principal_px=camera.principal if perspective else None,
    )


def _light(table: LightTable, reference_duration_s: float | None) -> Light:
    strength = table.intensity if isinstance(table.intensity, list) else [table.intensity]
    return Light(
        name=table.name,
        intensity=tuple(strength),
        direction=None if table.direction is None else _unit(table.direction),
        position_m=None if table.position_m is None else vector(table.position_m),
        reference_duration_s=reference_duration_s,
        anisotropy=table.anisotropy or None,
        axis=None if table.axis is None else _unit(table.axis),
        colour=None if table.colour is None else vector(table.colour),
    )


def _unit(values: list[float]) -> Vector:
    return vector(np.asarray(values, np.float64) / np.linalg.norm(values))


def true_clock(scene: Scene) -> TrueClock:
    """Return how the strobe's clock truly runs; a phase that the scene leaves open is drawn from its seed."""
    strobe = scene.strobe
    phase_s = strobe.phase_s
    if phase_s is None:
        phase_s = float(np.random.default_rng([scene.seed, 0]).uniform(0.0, true_plan(scene).cycle_s))
    return TrueClock(
        phase_s=phase_s,
        offset_ppm=strobe.clock_offset_ppm,
        drift_ppm_per_s=strobe.drift_ppm_per_s,
        jitter_s=strobe.jitter_s,
        seed=scene.seed,
    )
