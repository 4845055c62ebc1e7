"""Lines of the strobe link: checksums, and whole lines out of bytes that come in any pieces. Opens no port.

What is right stands in lights/protocol.md.
"""

import re
from binascii import crc_hqx
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

LONGEST_REQUEST = 96
LONGEST_REPLY = 250
"""Bytes before the line feed, checksum included."""
CRC_START = 0xFFFF
CHECKSUM = re.compile(r"\*([0-9A-F]{4})\Z")


class Error(IntEnum):
    """Why a controller refuses a line."""

    BYTES = 1
    LONG = 2
    CRC = 3
    COMMAND = 4
    WORDS = 5
    NUMBER = 6
    RANGE = 7
    STATE = 8
    LIMIT = 9
    INCOMPLETE = 10
    CHECK = 11
    FAULT = 12
    INTERLOCK = 13
    POWERS = 14


class LineError(ValueError):
    """A line that is not what the link allows; ``code`` is what a controller answers to it."""

    def __init__(self, code: Error, text: str) -> None:
        super().__init__(text)
        self.code = code


@dataclass(frozen=True, kw_only=True)
class TextLine:
    """One line without its end; ``fault``: bytes were wrong or too many, and ``text`` is empty then."""

    text: str
    fault: Error | None = None


def crc16(data: bytes) -> int:
    """Return the CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, not reflected.

    >>> hex(crc16(b"123456789"))
    '0x29b1'
    """
    return crc_hqx(data, CRC_START)


def seal(text: str) -> str:
    """Return a line with its checksum behind it.

    >>> seal("ID")
    'ID*A21B'
    """
    return f"{text}*{crc16(text.encode('ascii')):04X}"


def unseal(text: str) -> tuple[str, bool]:
    """Return a line without its checksum, and whether it had one; raises LineError where the checksum is wrong."""
    if "*" not in text:
        return text, False
    found = CHECKSUM.search(text)
    body = text[:-5]
    if found is None or "*" in body or int(found[1], 16) != crc16(body.encode("ascii")):
        raise LineError(Error.CRC, f"checksum behind {text.partition('*')[0][:20]}")
    return body, True


class LineReader:
    """Gathers bytes into lines, tolerant of everything: a bad or overlong line comes out as one fault.

    Never holds more than ``longest`` bytes and a carriage return.
    """

    def __init__(self, longest: int) -> None:
        self._longest = longest
        self._held = bytearray()
        self._too_long = False
        self._bad = False

    def feed(self, data: bytes) -> Iterator[TextLine]:
        """Take bytes in and yield every line that they end; empty lines are passed over."""
        *ends, rest = data.split(b"\n")
        for piece in ends:
            self._take(piece)
            line = self._end()
            if line is not None:
                yield line
        self._take(rest)

    def _take(self, piece: bytes) -> None:
        room = self._longest + 1 - len(self._held)
        self._bad = self._bad or any(not 0x20 <= byte <= 0x7E and byte != 0x0D for byte in piece)
        self._too_long = self._too_long or len(piece) > room
        self._held += piece[:room]

    def _end(self) -> TextLine | None:
        held, bad, too_long = bytes(self._held).removesuffix(b"\r"), self._bad, self._too_long
        self._held.clear()
        self._bad = self._too_long = False
        if bad or b"\r" in held:
            return TextLine(text="", fault=Error.BYTES)
        if too_long or len(held) > self._longest:
            return TextLine(text="", fault=Error.LONG)
        return TextLine(text=held.decode("ascii")) if held else None
