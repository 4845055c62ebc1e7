"""A ball of few triangles. A scene that moves is built again for every flash, which costs more than to look at it."""

from pathlib import Path

import trimesh

from psvideo.synth.subject.meshes.basic import sphere

COARSE_BALL = "ball.ply"
"""What a scene calls it: "sphere" with a seventh of the triangles, round to 0.05 px where it is 160 px wide."""


def write_coarse_ball(folder: Path) -> None:
    """Write the mesh beside the scenes of a folder."""
    ball = sphere(columns=96)
    trimesh.Trimesh(ball.vertices, ball.faces, process=False).export(folder / COARSE_BALL)
