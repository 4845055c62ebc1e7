"""The figure of docs/depth.md: the demo's bust as a mesh, seen from where no camera stood."""

import tomllib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import tomlkit
import trimesh
from docs.figures.staging import Figure, Pixels, exr_file, figure, psvideo, row
from numpy.typing import NDArray

from psvideo.synth.scenes import builtin_scene
from psvideo.synth.subject.rays import Caster

FRAMES = 12
"""Two rounds of the demo's scene."""
SIDE_PX = 336
VIEWS = {"from the camera": 0, "35 degrees to the side": 35, "75 degrees to the side": 75}
LAMP = np.array([-0.35, 0.45, 0.82])
BEHIND = (0.5, 0.15, 0.18)
"""The colour of faces that are seen from behind."""
GROUND = 0.16


def depth_bust(folder: Path) -> Figure:
    """Film and solve the bust without its wall, and look at its mesh from three sides."""
    folder.mkdir(parents=True)
    scene = tomllib.loads(builtin_scene().read_text(encoding="utf-8"))
    scene["frames"] = FRAMES
    scene["object"] = scene["object"][:1]  # without the wall
    (folder / "scene.toml").write_text(tomlkit.dumps(scene), encoding="utf-8")
    clip, out = folder / "clip", folder / "out"
    said = psvideo("synth", folder / "scene.toml", "-o", clip)
    inside = exr_file(clip / "truth" / "mask.exr") > 0
    cv2.imwrite(str(folder / "mask.png"), np.where(inside, 255, 0).astype(np.uint8))
    mask = folder / "mask.png"
    said += psvideo("normals", clip, "--rig", clip / "rig.toml", "--mask", mask, "--mesh", "ply", "-o", out)
    mesh = trimesh.load_mesh(sorted((out / "mesh").glob("*.ply"))[0], process=False)
    views = [(name, _seen(mesh, np.deg2rad(angle))) for name, angle in VIEWS.items()]
    return figure([row("A bust from its normals: its mesh from three sides", *views)], said)


def _seen(mesh: trimesh.Trimesh, angle: float) -> Pixels:
    """Return a mesh turned about the vertical, without perspective."""
    turn = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
    vertices = np.asarray(mesh.vertices, np.float64)
    middle, wide = (vertices.min(axis=0) + vertices.max(axis=0)) / 2, float(np.ptp(vertices[:, :2], axis=0).max())
    turned = (vertices - middle) @ turn.T
    grid = (np.arange(SIDE_PX) + 0.5) / SIDE_PX - 0.5
    x, y = np.meshgrid(grid * 1.1 * wide, -grid * 1.1 * wide)
    origins = np.stack([x, y, np.full_like(x, 4 * wide)], axis=-1).reshape(-1, 3)
    faces = np.asarray(mesh.faces, np.int32)
    hit = Caster(turned, faces).first(origins, np.broadcast_to([0.0, 0.0, -1.0], origins.shape))
    return _shaded(turned[faces], hit).reshape(SIDE_PX, SIDE_PX, 3)


def _shaded(corners: NDArray[np.float64], hit: NDArray[np.intp]) -> Pixels:
    """Return colours (pixel, 3) of the faces that are hit; counterclockwise faces are seen from before."""
    ways = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    ways /= np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-12)
    shade = 0.15 + 0.85 * np.maximum(ways @ (LAMP / np.linalg.norm(LAMP)), 0)
    colours = np.where(ways[:, 2:] > 0, shade[:, None], BEHIND)
    seen = np.where((hit >= 0)[:, None], colours[hit], GROUND)
    return np.asarray(np.clip(seen, 0, 1) * 255, np.uint8)


DEPTH: dict[str, Callable[[Path], Figure]] = {"depth_bust": depth_bust}
"""By the picture's name: docs/pictures/NAME.png."""
