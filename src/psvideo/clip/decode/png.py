"""PNG: 8 and 16 bits, grey or RGB. Palettes and fewer bits, as masks have them, become 8 bits.

Decoded by imagecodecs, which raises on a truncated or damaged file, where others deliver the rest as black.
"""

import logging
import struct
from pathlib import Path

import imagecodecs

from psvideo.clip.decode.signatures import begins_like
from psvideo.clip.decoded import CodedPicture, Header
from psvideo.errors import PsvideoError

logging.getLogger("imagecodecs").addHandler(logging.NullHandler())  # its remarks on odd profiles are no user's concern

SIGNATURE = b"\x89PNG\r\n\x1a\n"
END = b"IEND\xaeB`\x82"
TAIL = 1024
COLOUR_TYPES = {0: 1, 2: 3, 3: 3, 4: 1, 6: 3}
ALPHA_TYPES = (4, 6)
COLOUR_TYPE_AT = 25
"""Where in a file the type of its colours stands (PNG specification, 11.2.1)."""
PALETTE = 3


def header(path: Path) -> Header:
    """Read what the file's first chunk says, and see that the last one is there."""
    with path.open("rb") as file:
        first = file.read(33)
        file.seek(max(path.stat().st_size - TAIL, 0))
        return _parse_header(path, first, file.read())


def decode(path: Path) -> CodedPicture:
    """Decode a whole picture; an alpha channel is left out."""
    data = path.read_bytes()
    head = _parse_header(path, data, data[-TAIL:])
    codes = imagecodecs.png_decode(data)
    if codes.ndim == 3:
        codes = codes[..., : head.channels] if head.channels > 1 else codes[..., 0]
    return CodedPicture(header=head, codes=codes)


def _parse_header(path: Path, data: bytes, tail: bytes) -> Header:
    whole = len(data) >= 33 and data.startswith(SIGNATURE) and data[12:16] == b"IHDR"
    if not whole and data.startswith(SIGNATURE[:4]):
        raise PsvideoError(
            f"{path}: begins like a PNG file and does not go on like one: it is truncated or damaged, as by a transfer "
            "that takes it for text and changes its line ends. Copy it again."
        )
    if not whole:
        raise PsvideoError(f"{path}: does not begin like a PNG file{begins_like(data)}.")
    if END not in tail:
        raise PsvideoError(f"{path}: ends before its last chunk (IEND): it is truncated. Copy it again.")
    width_px, height_px, bits, colour_type = struct.unpack(">IIBB", data[16:26])
    if colour_type not in COLOUR_TYPES or bits not in (1, 2, 4, 8, 16):
        raise PsvideoError(
            f"{path}: says that it has {bits} bits and colours of type {colour_type}, which PNG does not have: it is "
            "damaged. Copy it again."
        )
    alpha = ("the PNG files' alpha channel is left out",) if colour_type in ALPHA_TYPES else ()
    shades = f"the PNG files hold no more than {2**bits} {'colours' if colour_type == PALETTE else 'shades of grey'}"
    coarse = (f"{shades}, too few for shading; export them with 16 bits",)
    return Header(
        width_px=width_px,
        height_px=height_px,
        channels=COLOUR_TYPES[colour_type],
        bits=max(bits, 8),
        warnings=coarse if bits < 8 or colour_type == PALETTE else (),
        notes=alpha,
    )
