"""Names of pictures in lists of lights: what ends them, and what is left without."""

PICTURE_ENDINGS = (
    *(".png", ".exr", ".tif", ".tiff", ".dng", ".dpx", ".jpg", ".jpeg", ".heic", ".webp", ".bmp", ".gif", ".tga"),
    *(".cr2", ".cr3", ".nef", ".nrw", ".arw", ".raf", ".orf", ".rw2", ".pef", ".srw", ".ppm", ".pgm"),
)
"""What may end a picture's name in a list, also where the picture itself has been exported as another kind."""


def without_ending(word: str) -> str:
    """Return a picture's name without its ending; a light's name keeps what follows a point.

    >>> [without_ending(word) for word in ("IMG_1.JPG", "key.left", ".png")]
    ['IMG_1', 'key.left', '.png']
    """
    ending = "." + word.rpartition(".")[2].lower()
    return word[: -len(ending)] if ending in PICTURE_ENDINGS and word[: -len(ending)] else word
