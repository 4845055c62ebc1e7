"""Small folders as psvideo leaves them, made by OpenEXR alone: a ball whose normals are known by its equation."""

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import OpenEXR

ROWS, COLS, COUNT, FIRST = 48, 64, 6, 1001
RATE = Fraction(30000, 1001)


def ball() -> tuple[np.ndarray, np.ndarray]:
    """Return normals (row, col, 3), x right, y up, z to the camera, of a ball in the picture's middle, and its mask."""
    radius = 0.45 * ROWS
    x = (np.arange(COLS) + 0.5 - COLS / 2)[None, :] / radius
    y = -(np.arange(ROWS) + 0.5 - ROWS / 2)[:, None] / radius
    inside = x**2 + y**2 < 0.98
    z = np.sqrt(np.where(inside, 1 - x**2 - y**2, 0))
    normals = np.stack([x + 0 * y, y + 0 * x, z], axis=-1) * inside[..., None]
    return normals.astype(np.float32), inside


def albedo(number: int) -> np.ndarray:
    """Return an albedo (row, col, 3) that differs from number to number: a ramp in red, a level in green and blue."""
    ramp = np.broadcast_to(np.linspace(0.2, 0.8, COLS, dtype=np.float32)[None, :], (ROWS, COLS))
    return np.stack([ramp, np.full_like(ramp, 0.5), np.full_like(ramp, 0.1 * (number - FIRST + 1))], axis=-1)


CAMERA = np.array([[0.0, 0.0, 1.0, 3.0], [0.6, 0.8, 0.0, -2.0], [-0.8, 0.6, 0.0, 5.0], [0.0, 0.0, 0.0, 1.0]])
"""A camera-to-world matrix: where the camera's axes point in the world (columns), and where it stands."""


def write(
    path: Path,
    channels: dict[str, np.ndarray],
    number: int,
    *,
    y: str = "up",
    world: bool = False,
    time_s: float | None = None,
) -> None:
    """Write one EXR as formats.md says results are; ``time_s`` left out: rounds are as long as each other."""
    header = {
        "type": OpenEXR.scanlineimage,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "framesPerSecond": RATE,
        "psvideo:time_s": 0.1 + (number - FIRST) / float(RATE) if time_s is None else time_s,
        "psvideo:space": "world" if world else "camera",
        "psvideo:y": y,
    }
    if world:
        header["psvideo:camera_to_world"] = " ".join(f"{number:.9g}" for number in CAMERA.ravel())
    path.parent.mkdir(parents=True, exist_ok=True)
    stored = {name: np.ascontiguousarray(plane) for name, plane in channels.items()}
    OpenEXR.File(header, stored).write(str(path))


def rgb(image: np.ndarray) -> dict[str, np.ndarray]:
    """Return a picture's planes as half floats."""
    return {name: image[..., channel].astype(np.float16) for channel, name in enumerate("RGB")}


SCALE_M = 2.0
"""How many metres one width of the picture is in the position pass."""


def points() -> np.ndarray:
    """Return the ball's points (row, col, 3) in the camera's frame, in metres; (0, 0, 0) around it."""
    normals, inside = ball()
    radius_m = 0.45 * ROWS / COLS * SCALE_M
    points: np.ndarray = (normals * radius_m + np.array([0, 0, -4.0])) * inside[..., None]
    return points


def placed(vectors: np.ndarray, *, y: str, world: bool, inside: np.ndarray, shift: bool = False) -> np.ndarray:
    """Return vectors of the camera's frame as a file holds them."""
    found = vectors
    if world:
        found = (vectors @ CAMERA[:3, :3].T + (CAMERA[:3, 3] if shift else 0)) * inside[..., None]
    turned: np.ndarray = (found * np.array([1, -1 if y == "down" else 1, 1])).astype(np.float32)
    return turned


def results(folder: Path, *, y: str = "up", world: bool = False, position: bool = False) -> Path:
    """Write a folder of results: normals, albedo, validity, depth and maybe points in 32 bits, timing and report."""
    normals, inside = ball()
    seen = placed(normals, y=y, world=world, inside=inside)
    depth = np.where(inside, 1 - 0.3 * normals[..., 2], 0).astype(np.float32)
    where = placed(points(), y=y, world=world, inside=inside, shift=True)
    for number in range(FIRST, FIRST + COUNT):
        write(folder / "normals" / f"take_normals.{number}.exr", rgb(seen), number, y=y, world=world)
        write(folder / "albedo" / f"take_albedo.{number}.exr", rgb(albedo(number)), number, y=y, world=world)
        write(folder / "valid" / f"take_valid.{number}.exr", {"Y": inside.astype(np.float16)}, number, y=y, world=world)
        write(folder / "depth" / f"take_depth.{number}.exr", {"Y": depth}, number, y=y, world=world)
        if position:
            planes = {name: where[..., axis] for axis, name in enumerate("RGB")}
            write(folder / "position" / f"take_position.{number}.exr", planes, number, y=y, world=world)
    (folder / "timing.json").write_text(json.dumps(timing()))
    report = {"clip": "take", "verdict": "This take is usable.", "findings": [], "lights": ["key", "left"]}
    (folder / "report.json").write_text(json.dumps(report))
    return folder


def timing() -> dict[str, object]:
    """Return a timing record of two lights and a dark slot, with one dropped frame."""
    slots = [({"key": 1.0}, 0), ({"left": 1.0}, 1), ({}, 2)]
    flashes = [
        {
            "index": index,
            "slot": slots[index % 3][1],
            "lights": slots[index % 3][0],
            "start_s": 0.005 + 0.0111 * index,
            "duration_s": 0.001,
            "complete": True,
        }
        for index in range(18)
    ]
    return {
        "schema": "psvideo-timing/1",
        "clip": "take",
        "frame_period_s": 0.01,
        "exposure_s": 0.01,
        "row_time_s": 0.01 / ROWS,
        "clock_offset_ppm": 31.2,
        "phase_error_rows": 0.012,
        "order": "marker",
        "dropped_frames": [{"after": 7, "count": 1}],
        "flashes": flashes,
    }
