"""What programs are told of a finished run: how to load it, its stage with camera and lights, and its lights."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from psvideo.clip import Clip
from psvideo.export.programs.blender_addon import ADDON_FILE, addon_zip
from psvideo.export.programs.delivered import Delivered, SeenLight
from psvideo.export.programs.delivery_json import DELIVERY_FILE, delivery_text
from psvideo.export.programs.loading_notes import loading_note, note_name
from psvideo.export.programs.nuke_script import nuke_script, script_name
from psvideo.export.sequences.result_files import Delivery
from psvideo.export.space import CAMERA_SPACE, Space, placed
from psvideo.export.usd.usd_stage import StageView, stage_name, stage_text
from psvideo.formats.whole_files import whole_file, write_text
from psvideo.model.irradiance.ground import ground_of
from psvideo.model.irradiance.intensity import lights_as_planned
from psvideo.model.irradiance.near_light import is_near, near_field
from psvideo.model.rig import Light, Rig
from psvideo.runs.delivery.handover import Finished
from psvideo.runs.steps.caller import Caller
from psvideo.solve.normals.illumination import illumination


def write_note(
    run: Finished, delivery: Delivery, rig: Rig, numbers: Sequence[int], *, metric: bool, caller: Caller
) -> None:
    """Write delivery.json; for a program how to load the delivery into it, in the caller's words, and what does that:
    a script for Nuke, an add-on for Blender."""
    clip = run.clip
    made = replace(_delivered(run, delivery, numbers, metric=metric), lights=lights_seen(rig, clip, delivery.space))
    write_text(run.folder / DELIVERY_FILE, delivery_text(made, rig))
    if delivery.program is not None:
        write_text(run.folder / note_name(delivery.program), caller.spell(loading_note(delivery.program, made)))
    if delivery.program == "nuke":
        write_text(run.folder / script_name(clip.name), nuke_script(made))
    if delivery.program == "blender":
        with whole_file(run.folder / ADDON_FILE) as beside:
            beside.write_bytes(addon_zip())


def write_stage(run: Finished, delivery: Delivery, rig: Rig, instants: Mapping[int, float], *, metric: bool) -> None:
    """Write ``<clip>.usda``: camera, lights, card or mesh and material; ``instants`` are times (s) by number."""
    clip, numbers = run.clip, sorted(instants)
    made = _delivered(run, delivery, numbers, metric=metric)
    text = stage_text(made, numbers, _stage_view(rig, clip, delivery.space, instants))
    write_text(run.folder / stage_name(clip.name), text)


def lights_seen(rig: Rig, clip: Clip, space: Space) -> tuple[SeenLight, ...]:
    """Return the shoot's lights in the frame of delivered normals, near ones as the middle of the surface sees them.

    None where the camera moves through the world: then they have no one direction.
    """
    if space.moving is not None:
        return ()
    lights = lights_as_planned(rig, clip.plan)
    near = is_near(lights)
    ground = ground_of(rig, height_px=clip.height_px, width_px=clip.width_px) if near and rig.plane else None
    if near and ground is None:
        return ()
    lit = illumination(lights, channels=3 if clip.channels == 3 else 1, ground=ground)
    strengths = np.broadcast_to(lit.intensities, (len(lights), 3))
    directions = placed(lit.directions, space)
    return tuple(
        SeenLight(name=light.name, direction=direction.tolist(), colour=colour.tolist())
        for light, direction, colour in zip(lights, directions, strengths, strict=True)
    )


def _delivered(run: Finished, delivery: Delivery, numbers: Sequence[int], *, metric: bool) -> Delivered:
    clip = run.clip
    return Delivered(
        clip=clip.name,
        numbers=tuple(numbers),
        fps=run.fps,
        width_px=clip.width_px,
        height_px=clip.height_px,
        metric=metric,
        delivery=delivery,
    )


def _stage_view(rig: Rig, clip: Clip, space: Space, instants: Mapping[int, float]) -> StageView:
    """Return the camera and the lights of a stage, in the camera's frame."""
    lights = lights_as_planned(rig, clip.plan)
    focal, middle, pixel_height = None, (0.0, 0.0), 1.0
    if rig.focal_px is not None:
        col, row = rig.principal_px or ((clip.width_px - 1) / 2, (clip.height_px - 1) / 2)
        focal, pixel_height = rig.focal_px[0] / clip.width_px, rig.focal_px[0] / rig.focal_px[1]
        middle = (
            (col + 0.5) / clip.width_px - 0.5,
            (0.5 * clip.height_px - row - 0.5) / clip.width_px * pixel_height,
        )
    near = {light.name: light for light in _with_axes(lights, rig, clip)}
    moving = space.moving is not None
    posed = [number for number in instants if space.name == "world" and (moving or number == min(instants))]
    fps = clip.filmed_plan.camera.fps
    return StageView(
        focal=focal,
        middle=middle,
        pixel_height=pixel_height,
        away_m=rig.plane[3] / rig.plane[2] if rig.plane and rig.plane[2] else None,
        poses={number: space.at(instants[number], number, fps).matrix for number in posed},
        lights=[one for one in lights_seen(rig, clip, CAMERA_SPACE) if one.name not in near],
        near=[*near.values()],
    )


def _with_axes(lights: Sequence[Light], rig: Rig, clip: Clip) -> tuple[Light, ...]:
    """Return the near ones among lights; they shine at the surface's middle where the rig gives no axis."""
    near = tuple(light for light in lights if light.position_m is not None)
    if not near or rig.plane is None:
        return near
    ground = ground_of(rig, height_px=clip.height_px, width_px=clip.width_px)
    axes = near_field(near, ground).axes.tolist()
    return tuple(replace(light, axis=tuple(axis)) for light, axis in zip(near, axes, strict=True))
