"""psvideo: normals and albedo for every instant, from strobed rolling-shutter video."""

from importlib.metadata import version

__version__ = version("psvideo")
