"""Bytes into lines, checksums, words."""

from array import array

from link import LARGEST_NUMBER, LONGEST_REQUEST, RefusedError


def _crc_of_byte(byte):
    crc = byte << 8
    for _ in range(8):
        crc = crc << 1 ^ (0x1021 if crc & 0x8000 else 0)
    return crc & 0xFFFF


CRC_TABLE = array("H", [_crc_of_byte(byte) for byte in range(256)])


def crc16(data, crc=0xFFFF):
    """CRC-16/CCITT-FALSE, going on from ``crc``."""
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ CRC_TABLE[crc >> 8 ^ byte]
    return crc


def seal(text):
    return f"{text}*{crc16(text.encode()):04X}"


def unseal(text):
    """The line without its checksum, which must be right where there is a ``*``."""
    if "*" in text and ("*" in text[:-5] or text != seal(text[:-5])):
        raise RefusedError("crc", "checksum")
    return text[:-5] if "*" in text else text


def number(word):
    if not word.isdigit() or int(word) > LARGEST_NUMBER:
        raise RefusedError("number", f"number {word[:20]}")
    return int(word)


def lit_word(word):
    line, _, on = word.partition(":")
    return number(line), number(on)


class LineReader:
    """Bytes into lines, one byte at a time; never holds more than a line that is just too long."""

    def __init__(self):
        self._forget()

    def _forget(self):
        self.held = bytearray()
        self.bad = self.long = False

    def take(self, byte):
        """Take a byte. Returns None, or where a line ends (error or None, text)."""
        if byte == 10:
            return self._end()
        self.bad = self.bad or not (32 <= byte <= 126 or byte == 13)
        if len(self.held) > LONGEST_REQUEST:
            self.long = True
        else:
            self.held.append(byte)
        return None

    def _end(self):
        held, bad, long = bytes(self.held), self.bad, self.long
        self._forget()
        if held.endswith(b"\r"):
            held = held[:-1]
        if bad or b"\r" in held:
            return "bytes", ""
        if long or len(held) > LONGEST_REQUEST:
            return "long", ""
        return (None, held.decode()) if held else None
