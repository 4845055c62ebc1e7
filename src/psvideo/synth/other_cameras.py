"""Several cameras that film one scene and one strobe, each on its own clock: one of them as a scene of its own."""

from typing import Any

import numpy as np
from pydantic import ValidationError

from psvideo.errors import PsvideoError, UsageError
from psvideo.synth.scene import Scene
from psvideo.synth.scene_tables import OtherCameraTable, StrobeTable
from psvideo.synth.shotplan import true_clock

OWN = ("starts_s", "beside_m", "clock_offset_ppm", "frames", "dropped")
"""Keys of another camera that are not ``[camera]``'s."""


def filmed_by(scene: Scene, camera: str | None, *, source: str) -> Scene:
    """Return the scene as one of its cameras films it, None for the first; ``source`` is the name that messages give
    the scene's file.

    Things stand where that camera sees them, and have moved for as long when its first frame opens; the strobe's phase
    and rate are those on its clock.

    Raises UsageError for a camera that the scene does not have, PsvideoError where its tables do not fit together.
    """
    if camera is None or camera == scene.camera.name:
        return scene
    other = next((one for one in scene.other_camera if one.name == camera), None)
    if other is None:
        names = [scene.camera.name, *(one.name for one in scene.other_camera)]
        raise UsageError(f"{source}: has no camera {camera!r}; expected one of: {', '.join(names)}.")
    if fault := _not_shared(scene.strobe):
        raise PsvideoError(f"{source}: several cameras see one strobe, and {fault}.")
    try:
        return Scene.model_validate(_seen_by(scene, other))
    except ValidationError as broken:
        words = "; ".join(error["msg"].removeprefix("Value error, ") for error in broken.errors())
        raise PsvideoError(f"{source}: other_camera {camera!r}: {words}.") from None


def _not_shared(strobe: StrobeTable) -> str | None:
    """Return what of a strobe would not be the same for all cameras, None where all is."""
    if strobe.mode != "rolling":
        return f"strobe.mode is {strobe.mode!r}, which follows one camera's frames: expected 'rolling'"
    if strobe.dark_s is None:
        return (
            "strobe.dark_s is left out, so that it would follow from each one's exposure: expected seconds, at least "
            "the longest exposure"
        )
    if strobe.jitter_s:
        return "strobe.jitter_s is drawn anew for every clip: expected 0"
    return None


def _seen_by(scene: Scene, other: OtherCameraTable) -> dict[str, Any]:
    """Return what a scene file would hold that has only the other camera."""
    data = scene.model_dump(by_alias=True)
    given = other.model_dump(exclude_none=True, exclude=set(OWN))
    shutter = {"shutter_deg": None, "exposure_s": None} if {"shutter_deg", "exposure_s"} & set(given) else {}
    offset_ppm = scene.strobe.clock_offset_ppm if other.clock_offset_ppm is None else other.clock_offset_ppm
    for thing in (*data["object"], *(light for light in data["light"] if light["position_m"] is not None)):
        thing["position_m"] = (np.array(thing["position_m"]) - other.beside_m).tolist()
    place = scene.other_camera.index(other)
    return data | {
        "other_camera": [],
        "name": f"{scene.name}_{place + 2}",
        "seed": scene.seed + place + 1,
        "starts_s": scene.starts_s + other.starts_s,
        "frames": other.frames or scene.frames,
        "camera": data["camera"] | shutter | given,
        "plan": data["plan"] | _not_claimed(scene, other),
        "strobe": data["strobe"] | {"clock_offset_ppm": offset_ppm, "phase_s": _phase_s(scene, other, offset_ppm)},
        "output": data["output"] | {"dropped": other.dropped},
    }


def _not_claimed(scene: Scene, other: OtherCameraTable) -> dict[str, None]:
    """Return what the plan is to claim no more: figures of the first camera, where the other one has its own. That
    nothing is known of the readout holds for both."""
    claims = {"fps": scene.plan.fps, "readout_s": scene.plan.readout_s}
    return {key: None for key, said in claims.items() if getattr(other, key) is not None and said != "unknown"}


def _phase_s(scene: Scene, other: OtherCameraTable, offset_ppm: float) -> float:
    """Return when the cycle that the first camera's phase is of begins, on the other one's clock."""
    clock = true_clock(scene)
    strobe_s = float(clock.strobe_time_s(np.array([other.starts_s]))[0])
    return -strobe_s * (1 + 1e-6 * offset_ppm) - 0.5e-6 * clock.drift_ppm_per_s * strobe_s**2
