"""FFV1's checksums of its slices (RFC 9043, section 4.9): FFmpeg paints a damaged slice over with the picture before
it, and hands the frame out as a whole one."""

import zlib

FOOTER = 8
"""Bytes behind a slice: its size in three, its state in one, and the checksum in four."""
BITS_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
"""The checksum reads the highest bit of a byte first, and zlib's the lowest."""
ZERO = 0xFFFFFFFF
"""What zlib begins and ends with where a checksum begins at 0, as these do."""


class SliceChecks:
    """Says which packets of one stream are damaged, once a packet of it has shown that its slices have checksums."""

    def __init__(self) -> None:
        self._have_checksums = False

    def damaged(self, packet: bytes) -> bool:
        """Return whether a packet's checksums do not hold; False of a stream that has shown none yet."""
        hold = _hold(packet)
        self._have_checksums = self._have_checksums or hold
        return self._have_checksums and not hold


def _hold(packet: bytes) -> bool:
    """Return whether a packet is slices one behind the other, the last one's footer last, and each checksum holds."""
    end = len(packet)
    while end > 0:
        begin = end - int.from_bytes(packet[end - FOOTER : end - FOOTER + 3]) - FOOTER
        if begin < 0 or zlib.crc32(packet[begin:end].translate(BITS_REVERSED), ZERO) != ZERO:
            return False
        end = begin
    return bool(packet)
