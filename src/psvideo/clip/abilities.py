"""Which kinds of footage the libraries that are installed here can read."""

from importlib import import_module

MOVIE_CODECS = {"ProRes": "prores", "H.264": "h264", "H.265 (HEVC)": "hevc", "DNxHD and DNxHR": "dnxhd", "FFV1": "ffv1"}
"""What cameras and recorders write, by FFmpeg's names of the decoders."""


def movie_decoders() -> dict[str, bool]:
    """Tell of each kind of movie whether it can be decoded. Raises ImportError where PyAV cannot be loaded."""
    codec = import_module("av.codec")
    return {name: decoder in codec.codecs_available for name, decoder in MOVIE_CODECS.items()}


def raw_library() -> str:
    """Return the version of LibRaw that decodes DNG. Raises ImportError where rawpy cannot be loaded."""
    return ".".join(str(part) for part in import_module("rawpy").libraw_version)


def curve_library() -> str:
    """Return OpenColorIO's version. Raises ImportError where it cannot be loaded."""
    return str(import_module("PyOpenColorIO").GetVersion())


def exr_library() -> str:
    """Return OpenEXR's version. Raises ImportError where it cannot be loaded."""
    return str(import_module("OpenEXR").OPENEXR_VERSION)
