"""The truth beside a virtual clip: when every flash fired, what it showed, and the surface that it showed it of."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from psvideo.formats.exr_files import write_exr
from psvideo.model.arrays import Floats
from psvideo.model.plan import Plan
from psvideo.synth.lamps.traced import TracedLight
from psvideo.synth.lamps.true_flashes import TrueClock, TrueFlash
from psvideo.synth.scene import Scene
from psvideo.synth.subject.render import Hits


def write_picture(path: Path, image: Floats) -> None:
    """Write an image (row, col) or (row, col, 3) as 32-bit EXR."""
    planes = {"Y": image} if image.ndim == 2 else dict(zip("RGB", np.moveaxis(image, -1, 0), strict=True))
    write_exr(path, planes, half=False)


def write_true_surface(folder: Path, hits: Hits, channels: int, name: str = "") -> None:
    """Write normals, albedo and mask: ``normals.exr``, or ``normals/<name>.exr`` where the scene moves."""
    surface = {"normals": true_normals(hits), "albedo": true_albedo(hits, channels), "mask": true_mask(hits)}
    for key, image in surface.items():
        write_picture(folder / key / f"{name}.exr" if name else folder / f"{key}.exr", image)


def true_normals(hits: Hits) -> Floats:
    """Return unit normals (row, col, 3), 0 where nothing is hit; a pixel's rays are averaged and made unit again."""
    mean = hits.image(hits.normal).astype(np.float64)
    length = np.linalg.norm(mean, axis=-1, keepdims=True)
    return np.asarray(np.divide(mean, length, out=np.zeros_like(mean), where=length > 0), np.float32)


def true_albedo(hits: Hits, channels: int) -> Floats:
    """Return the albedo, (row, col, 3), or its mean over the colours, (row, col), for a grey camera."""
    return as_seen(hits.image(hits.albedo), channels)


def true_mask(hits: Hits) -> Floats:
    """Return the share of each pixel's rays that hit anything, (row, col), 0 to 1."""
    return hits.image(np.ones(len(hits.sample), np.float32))


def as_seen(image: Floats, channels: int) -> Floats:
    """Return a rendered picture with the camera's channels: a grey camera sees the mean of the colours."""
    return image if channels else np.asarray(image.mean(axis=-1), np.float32)


def write_timing(folder: Path, plan: Plan, flashes: tuple[TrueFlash, ...], plates: Mapping[int, str]) -> None:
    """Write timing.json; ``plates`` names the file of each flash (by index) whose plate was written."""
    rows = []
    for flash in flashes:
        row: dict[str, object] = {
            "index": flash.index,
            "slot": flash.slot,
            "light": "+".join(flash.lit) or None,
            "lights": dict(flash.lights),
            "start_s": flash.start_s,
            "duration_s": flash.duration_s,
            "complete": flash.complete,
        }
        if flash.bursts_s:
            row["bursts"] = len(flash.bursts_s)
        rows.append(row | ({"plate": plates[flash.index]} if flash.index in plates else {}))
    data = {"row_time_s": plan.camera.row_time_s, "flashes": rows}
    (folder / "timing.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def write_scene_truth(
    folder: Path, scene: Scene, plan: Plan, clock: TrueClock, clipped: float, traced: TracedLight | None
) -> None:
    """Write scene.json: what the plan beside the footage does not say."""
    data: dict[str, object] = {
        "phase_s": clock.phase_s,
        "clock_offset_ppm": clock.offset_ppm,
        "drift_ppm_per_s": clock.drift_ppm_per_s,
        "jitter_s": clock.jitter_s,
        "fps": str(plan.camera.fps),
        "exposure_s": plan.camera.exposure_s,
        "readout_s": plan.camera.readout_s,
        "rise_s": plan.rise_s,
        "fall_s": plan.fall_s,
        "dropped_frames": sorted(scene.dropped),
        "clipped_share": clipped,
        "scene": scene.model_dump(by_alias=True),
    }
    if traced is not None:
        trace = traced.trace
        data["trace"] = {"board": trace.board, "hz": trace.hz, "wiring": trace.wiring, "cycle": traced.first_cycle}
    (folder / "scene.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
