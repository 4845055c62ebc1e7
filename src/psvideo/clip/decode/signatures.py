"""How files of other kinds begin: what a picture with the wrong ending is."""

KINDS = {
    b"\xff\xd8\xff": ("JPEG", ".jpg"),
    b"\x89PNG": ("PNG", ".png"),
    b"II*\0": ("TIFF", ".tif"),
    b"MM\0*": ("TIFF", ".tif"),
    b"v/1\x01": ("OpenEXR", ".exr"),
    b"SDPX": ("DPX", ".dpx"),
    b"XPDS": ("DPX", ".dpx"),
}


def begins_like(data: bytes) -> str:
    """Return how a message on a file that does not begin as its ending says goes on, and ends.

    >>> begins_like(bytes([255, 216, 255, 224]))
    ', but like JPEG. Give it the ending .jpg'
    """
    found = next((kind for start, kind in KINDS.items() if data.startswith(start)), None)
    return f", but like {found[0]}. Give it the ending {found[1]}" if found else ". Copy it again"
