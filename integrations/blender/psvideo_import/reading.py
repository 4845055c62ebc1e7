"""What lies in a folder of results: its sequences, and what delivery.json says of space, lights and camera."""

import json
import re
from dataclasses import dataclass, field
from pathlib import Path

SCHEMA = "psvideo-delivery/1"
ANY_LIGHT = {"name": "key", "direction": [0.4, 0.5, 0.768], "colour": [1.0, 1.0, 1.0]}


class NotResultsError(Exception):
    """The folder holds no results that can be read."""


@dataclass(frozen=True)
class Results:
    """A folder of results. ``first`` and ``count`` are of its normals' numbers; ``lights`` have a direction and a
    colour in the frame of the normals; ``focal`` and ``middle`` are in widths of the picture, None where unknown, and
    ``pixel_height`` in widths of a pixel."""

    folder: Path
    clip: str
    first: int
    count: int
    fps: tuple[int, int] | None = None
    space: str = "camera"
    y: str = "up"
    lights: list = field(default_factory=lambda: [ANY_LIGHT])
    focal: float | None = None
    middle: tuple[float, float] = (0.0, 0.0)
    pixel_height: float = 1.0
    camera_to_world: list | None = None

    def file(self, quantity: str) -> Path:
        """The first file of a quantity's sequence."""
        return self.folder / quantity / f"{self.clip}_{quantity}.{self.first:04d}.exr"


def read_results(path: Path) -> Results:
    """Read the folder that a path names, or that holds the file, or the file's folder. Raises NotResultsError."""
    folder = next((one for one in (path, path.parent, path.parent.parent) if (one / "normals").is_dir()), None)
    if folder is None:
        raise NotResultsError(f"{path}: no folder of psvideo results; choose the one that holds normals/ and albedo/")
    named = [re.fullmatch(r"(.+)_normals\.(\d+)\.exr", file.name) for file in sorted((folder / "normals").iterdir())]
    numbers = sorted((int(one[2]), one[1]) for one in named if one)
    if not numbers:
        raise NotResultsError(f"{folder / 'normals'}: holds no <clip>_normals.<number>.exr")
    first, clip = numbers[0]
    basic = {"folder": folder, "clip": clip, "first": first, "count": numbers[-1][0] - first + 1}
    return Results(**basic, **_said(folder / "delivery.json"))


def _said(path: Path) -> dict:
    """Return what delivery.json says; without it camera space, y up and one light are taken."""
    if not path.is_file():
        return {}
    try:
        said = json.loads(path.read_text(encoding="utf-8"))
        if said["schema"] != SCHEMA:
            raise NotResultsError(f"{path}: is of kind {said['schema']}, and this add-on reads {SCHEMA}")
        width, height = said["width_px"], said["height_px"]
        camera = said["camera"]
        known = {"fps": tuple(said["fps"]), "space": said["space"], "y": said["y"]}
        known |= {"lights": said["lights"] or [ANY_LIGHT], "camera_to_world": said["camera_to_world"]}
        if camera is not None:
            right, down = camera["principal_px"] or [(width - 1) / 2, (height - 1) / 2]
            known["focal"] = camera["focal_px"][0] / width
            known["pixel_height"] = tall = camera["focal_px"][0] / camera["focal_px"][1]
            known["middle"] = ((right + 0.5) / width - 0.5, (height / 2 - down - 0.5) / width * tall)
        return known
    except (ArithmeticError, KeyError, TypeError, ValueError) as fault:
        raise NotResultsError(f"{path}: cannot be read ({fault!r}); write the results again") from fault
