"""From normals to shape: depth along the camera's axis, and a mesh cut where depth jumps.

``view`` says how normals and depth belong together. ``cao2022`` finds the height with its jumps: ``integration`` and
``reweighting`` go round, ``multigrid`` solves each round (``checkerboard`` holds its grids; ``torn_blocks`` and
``between_blocks`` make the coarser ones).
``simchony1990`` is the fast path for whole rectangles. ``scale`` gives the height a scale by its ``anchors``,
``shaping`` keeps that over a clip, and ``mesh`` makes triangles of it. Under near lights ``torn_surfaces`` says what is
integrated apart, and ``placing`` how far away it is, by ``falloff_evidence``.
"""

from psvideo.solve.depth.cao2022 import Height, Integration, integrate
from psvideo.solve.depth.mesh import Mesh, mesh_of
from psvideo.solve.depth.scale import Depth, depth_of_height
from psvideo.solve.depth.shaping import Shaping, begun, depth_of, kept_beside, reservations, scale_note
from psvideo.solve.depth.view import View, view_of

__all__ = [
    "Depth",
    "Height",
    "Integration",
    "Mesh",
    "Shaping",
    "View",
    "begun",
    "depth_of",
    "depth_of_height",
    "integrate",
    "kept_beside",
    "mesh_of",
    "reservations",
    "scale_note",
    "view_of",
]
