"""Objects of a scene: a shape that is sized, placed and moved."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles, Floats
from psvideo.synth.scene_tables import AlbedoTable, ObjectTable
from psvideo.synth.subject.material import PLAIN, colour, pattern_albedo, sample_texture
from psvideo.synth.subject.meshes import builtin_names, builtin_shape
from psvideo.synth.subject.shape import Shape, load_shape, load_texture


@dataclass(frozen=True, kw_only=True)
class Body:
    """A shape with its table. ``rest_m`` are its vertices at their size, centred, before they are turned."""

    table: ObjectTable
    shape: Shape
    rest_m: Doubles
    rest_normals: Doubles
    texture: Floats | None

    def pose(self, time_s: float) -> tuple[Doubles, Doubles]:
        """Return vertices (vertex, 3) in metres and normals (vertex, 3) at a time on the camera's clock."""
        turn = Rotation.from_euler("xyz", self.table.rotate_deg, degrees=True)
        shift = np.array(self.table.position_m)
        motion = self.table.motion
        if motion is not None:
            swing = motion.swing_deg * np.sin(2 * np.pi * motion.swing_hz * time_s)
            axis = np.array(motion.axis) / np.linalg.norm(motion.axis)
            turn = turn * Rotation.from_rotvec(axis * np.deg2rad(motion.spin_deg_per_s * time_s + swing))
            shift = shift + np.array(motion.velocity_m_per_s) * time_s
            shift = shift + np.array(motion.sway_m) * np.sin(2 * np.pi * motion.sway_hz * time_s)
        return turn.apply(self.rest_m) + shift, turn.apply(self.rest_normals)

    def albedo(self, corners: np.ndarray, weights: Doubles) -> Floats:
        """Return the albedo at points given as vertex triples (point, 3) and their weights (point, 3)."""
        table = self.table.albedo
        if not isinstance(table, AlbedoTable):
            return np.broadcast_to(colour(table), (len(corners), 3))
        if self.texture is not None and self.shape.uv is not None:
            return sample_texture(self.texture, _mix(self.shape.uv, corners, weights))
        if table.pattern != "own":
            return pattern_albedo(table, _mix(self.rest_m, corners, weights))
        if self.shape.colours is not None:
            return _mix(self.shape.colours.astype(np.float64), corners, weights).astype(np.float32)
        return np.full((len(corners), 3), PLAIN, np.float32)


def _mix(values: Doubles, corners: np.ndarray, weights: Doubles) -> Doubles:
    return np.asarray(np.einsum("pcx,pc->px", values[corners], weights))


def make_body(table: ObjectTable, folder: Path) -> Body:
    """Load or generate an object's mesh and size it. ``folder`` is where the scene's relative paths start."""
    shape = builtin_shape(table.mesh) if table.mesh in builtin_names() else load_shape(folder / table.mesh)
    low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    middle = 0.5 * (low + high) if table.centre else np.zeros(3)
    scale = table.scale if table.height_m is None else table.height_m / max(high[1] - low[1], 1e-300)
    stretch = scale * np.array(table.stretch)
    normals = shape.normals / stretch
    texture = shape.texture
    if isinstance(table.albedo, AlbedoTable):
        if table.albedo.texture is not None:
            texture = _texture(table.mesh, shape, folder / table.albedo.texture)
        elif table.albedo.pattern != "own":
            texture = None
    return Body(
        table=table,
        shape=shape,
        rest_m=(shape.vertices - middle) * stretch,
        rest_normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        texture=texture,
    )


def _texture(mesh: str, shape: Shape, path: Path) -> Floats:
    if shape.uv is None:
        raise PsvideoError(
            f"{path}: cannot be laid on the mesh {mesh!r}, which has no texture coordinates. Unwrap the mesh, or "
            "give it a procedural albedo instead of a texture."
        )
    return load_texture(path)
