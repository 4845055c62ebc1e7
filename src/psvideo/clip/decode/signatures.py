"""The first bytes of each kind of file: recognises a picture with the wrong ending."""

KINDS = {
    b"\xff\xd8\xff": ("JPEG", ".jpg"),
    b"\x89PNG": ("PNG", ".png"),
    b"II*\0": ("TIFF", ".tif"),
    b"MM\0*": ("TIFF", ".tif"),
    b"v/1\x01": ("OpenEXR", ".exr"),
    b"SDPX": ("DPX", ".dpx"),
    b"XPDS": ("DPX", ".dpx"),
}

UNREAD = {b"heic": "HEIC", b"heix": "HEIC", b"mif1": "HEIC", b"msf1": "HEIC", b"avif": "AVIF", b"WEBP": "WebP"}
"""By what stands in bytes 8 to 11: kinds that phones and browsers write and psvideo does not read."""


def begins_like(data: bytes) -> str:
    """Return how a message on a file that does not begin as its ending says goes on, and ends.

    >>> begins_like(bytes([255, 216, 255, 224]))
    ', but like JPEG. Give it the ending .jpg'
    """
    if name := UNREAD.get(bytes(data[8:12])):
        return f", but like {name}, which is not read. Export it as 16-bit TIFF or PNG, or have the camera write JPEG"
    found = next((kind for start, kind in KINDS.items() if data.startswith(start)), None)
    return f", but like {found[0]}. Give it the ending {found[1]}" if found else ". Copy it again"
