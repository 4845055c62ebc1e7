"""Animated meshes, cameras and materials as USD.

``usd_stage`` is the stage beside a delivery, written with ``usda`` as text, with its ``usd_material``;
``usd_animation`` the mesh over time; ``usd_camera`` reads a camera from a file, ``pose`` from a matrix.
"""

import importlib.util

from psvideo.errors import PsvideoError


def require_usd(what: str = '`mesh=["usd"]`', *, otherwise: str = '`mesh=["ply"]`') -> None:
    """Raise PsvideoError where the package that reads and writes USD is not installed; ``what`` asks for it."""
    if importlib.util.find_spec("pxr") is None:
        raise PsvideoError(
            f"{what}: needs the package usd-core, which is not installed. Install it (pip install usd-core, or "
            f'psvideo with its extra "usd"), or take {otherwise}.'
        )
