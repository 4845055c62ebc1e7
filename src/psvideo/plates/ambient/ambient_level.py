"""Ambient light as plates take it off: in 16 bits, each row over its own range.

A row's codes are good to half a 65535th of what it spans: of ambient light that is 2 % of saturation a fiftieth of the
last bit of a 16-bit code, and what reading it costs beside every plate is halved.
"""

from dataclasses import dataclass

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent
from psvideo.model.arrays import Codes16, Image
from psvideo.model.coded import Coded, Tone

MOST_CODE = np.float32(65535)
TINY = np.float32(1e-12)
HALF, SIXTH = np.float32(0.5), np.float32(1 / 6)


@dataclass(frozen=True, kw_only=True, eq=False)
class AmbientLevel:
    """Ambient light, (row, col) or (row, col, channel), in codes: ``light = least + step * code``, both (row,).

    narrow: (row, col // 2), its mean over two columns each and over channels.
    """

    codes: Codes16
    least: Image
    step: Image
    narrow: Image

    @classmethod
    def room(cls, shape: tuple[int, ...]) -> "AmbientLevel":
        """Return room for ambient light of a shape."""
        rows, cols = shape[:2]
        return cls(
            codes=np.empty(shape, np.uint16),
            least=np.empty(rows, np.float32),
            step=np.empty(rows, np.float32),
            narrow=np.empty((rows, cols // 2), np.float32),
        )

    @classmethod
    def of(cls, image: Image) -> "AmbientLevel":
        """Return a picture of ambient light in codes."""
        level = cls.room(image.shape)
        pack_rows(np.ascontiguousarray(image, np.float32).reshape(len(image), -1), *level.planes, level.channels)
        return level

    @property
    def channels(self) -> int:
        """How many samples a pixel has."""
        return int(np.prod(self.codes.shape[2:]))

    @property
    def planes(self) -> tuple[Codes16, Image, Image, Image]:
        """The codes as (row, sample), and what else is known of rows, as compiled loops take them."""
        return self.codes.reshape(len(self.codes), -1), self.least, self.step, self.narrow

    @property
    def coded(self) -> Coded:
        """The light as a picture in codes."""
        zero, gain = -self.least.astype(np.float64) / self.step, self.step.astype(np.float64)
        return Coded(codes=self.codes, tone=Tone(zero=zero[:, None], gain=gain[:, None]))


@FUSED.kept
def pack_rows(light: Image, codes: Codes16, least: Image, step: Image, narrow: Image, channels: int) -> None:
    """Pack every row of ``light`` (row, sample)."""
    given, out, low, high, grey = lent(light), lent(codes), lent(least), lent(step), lent(narrow)
    for row in range(given.shape[0]):
        pack_row(given[row], out[row], low, high, grey[row], row, channels)


@FUSED.inlined
def pack_row(line: Image, codes: Codes16, least: Image, step: Image, narrow: Image, row: int, channels: int) -> None:
    """Pack one row of light, ``line`` (sample,); ``least`` and ``step`` are those of all rows."""
    low, high = _ends(line)
    one = max((high - low) / MOST_CODE, TINY)
    least[row], step[row] = low, one
    per = np.float32(1) / one
    for sample in range(line.shape[0]):
        codes[sample] = np.uint16((line[sample] - low) * per + HALF)
    if channels == 3:
        for col in range(narrow.shape[0]):
            a, b, c = line[6 * col], line[6 * col + 1], line[6 * col + 2]
            narrow[col] = (a + b + c + line[6 * col + 3] + line[6 * col + 4] + line[6 * col + 5]) * SIXTH
        return
    share = np.float32(1 / (2 * channels))
    for col in range(narrow.shape[0]):
        total = np.float32(0)
        for sample in range(2 * col * channels, 2 * (col + 1) * channels):
            total += line[sample]
        narrow[col] = total * share


@FUSED.inlined
def _ends(line: Image) -> tuple[np.float32, np.float32]:
    """The least and the largest of a row's numbers, by their bits in an order that integers have: floats are compared
    one by one."""
    bits = line.view(np.int32)
    low, high = np.int32(0x7FFFFFFF), np.int32(-0x7FFFFFFF)
    for sample in range(bits.shape[0]):
        place = np.int32(bits[sample] ^ ((bits[sample] >> 31) & 0x7FFFFFFF))
        low = place if place < low else low
        high = place if place > high else high
    ends = np.empty(2, np.int32)
    ends[0], ends[1] = low ^ ((low >> 31) & 0x7FFFFFFF), high ^ ((high >> 31) & 0x7FFFFFFF)
    both = ends.view(np.float32)
    return both[0], both[1]


@FUSED.inlined
def unpack_row(codes: Codes16, least: np.float32, step: np.float32, line: Image) -> None:
    """Fill ``line`` with the light of a row."""
    for sample in range(line.shape[0]):
        line[sample] = least + step * np.float32(codes[sample])
