"""psvideo: normals and albedo for every instant, from strobed rolling-shutter video."""

from typing import Any


def __getattr__(name: str) -> Any:
    if name == "__version__":  # read when asked for: importlib.metadata takes a tenth of a second, and most never ask
        from importlib.metadata import version

        return version("psvideo")
    raise AttributeError(f"module 'psvideo' has no attribute {name!r}")
