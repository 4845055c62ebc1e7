"""Which of an EXR file's channels are its picture: Y alone, or R, G and B, at the top level or in one layer."""

from collections.abc import Callable
from pathlib import Path

from psvideo.errors import PsvideoError

GREY_NAMES = ("Y", "L", "V")
Choose = Callable[[list[list[str]]], tuple[int, tuple[str, ...]]]
"""Takes the channels' names of every part, and returns a part's index and one or three of its names."""


def picture_channels(path: Path, parts: list[list[str]]) -> tuple[int, tuple[str, ...]]:
    """Find the picture: Y alone, or R, G and B, at the top level or in one layer, in the first part if it shows one."""
    pictures = [(part, names) for part, found in enumerate(parts) for names in _pictures_in(found)]
    nearest = [picture for picture in pictures if picture[0] == 0] or pictures
    if len(nearest) == 1:
        return nearest[0]
    found = parts[0] if nearest and nearest[0][0] == 0 else [name for part in parts for name in part]
    several = f"more than one {'layer' if found is parts[0] else 'picture'}" if nearest else "neither Y nor R, G, B"
    raise PsvideoError(
        f"{path}: holds {several} (channels {', '.join(sorted(found))}); expected one picture, in the channels "
        "R, G, B or in Y. Write such a file from the layer that is meant."
    )


def _pictures_in(found: list[str]) -> list[tuple[str, ...]]:
    layers = {name.rpartition(".")[0]: None for name in found}
    return [names for layer in layers if (names := _picture_in(layer, found))]


def _picture_in(layer: str, found: list[str]) -> tuple[str, ...]:
    prefix = f"{layer}." if layer else ""
    colour = tuple(prefix + name for name in "RGB")
    if all(name in found for name in colour):
        return colour
    return next(((prefix + name,) for name in GREY_NAMES if prefix + name in found), ())
