"""Animated meshes and cameras as USD."""

import importlib.util

from psvideo.errors import PsvideoError


def require_usd(what: str = '`mesh=["usd"]`', *, otherwise: str = '`mesh=["ply"]`') -> None:
    """Raise PsvideoError where the package that reads and writes USD is not installed; ``what`` asks for it."""
    if importlib.util.find_spec("pxr") is None:
        raise PsvideoError(
            f"{what}: needs the package usd-core, which is not installed. Install it (pip install usd-core, or "
            f'psvideo with its extra "usd"), or take {otherwise}.'
        )
