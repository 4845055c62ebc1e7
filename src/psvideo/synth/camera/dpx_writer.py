"""DPX files as a film scanner or a camera would leave them: SMPTE ST 268, big-endian, one RGB element.

Ten bits lie three to a 32-bit word, filled at the low end (method A); sixteen bits lie as they are.
"""

import struct

import numpy as np
from numpy.typing import NDArray

HEADER_BYTES = 2048
RGB = 50
LINEAR_TRANSFER = 2


def dpx_bytes(codes: NDArray[np.uint16], bits: int) -> bytes:
    """Return a DPX file of the codes (row, col, 3), which have 10 or 16 bits."""
    rows, cols = codes.shape[:2]
    if bits == 10:
        wide = codes.astype(np.uint32)
        data = ((wide[..., 0] << 22) | (wide[..., 1] << 12) | (wide[..., 2] << 2)).astype(">u4").tobytes()
    else:
        data = codes.astype(">u2").tobytes()
    header = bytearray(b"\xff" * HEADER_BYTES)
    struct.pack_into(">4sI8sI", header, 0, b"SDPX", HEADER_BYTES, b"V2.0\0\0\0\0", HEADER_BYTES + len(data))
    struct.pack_into(">III", header, 20, 1, 1664, 384)
    for place, length in ((36, 100), (136, 24), (160, 100), (260, 200), (460, 200)):
        header[place : place + length] = bytes(length)
    struct.pack_into(">HHII", header, 768, 0, 1, cols, rows)
    struct.pack_into(">I", header, 780, 0)
    struct.pack_into(
        ">BBBBHHI", header, 800, RGB, LINEAR_TRANSFER, LINEAR_TRANSFER, bits, 1 if bits == 10 else 0, 0, HEADER_BYTES
    )
    return bytes(header) + data
