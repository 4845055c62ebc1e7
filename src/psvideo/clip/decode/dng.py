"""DNG and CinemaDNG: the sensor's own values, with the black and white levels and the colour filters the file states.

Tags follow Adobe's Digital Negative Specification 1.7. Pixels are decoded by tifffile and imagecodecs; LibRaw decodes
what these cannot. (It is not asked first: of a file with several lossless-JPEG strips it decodes the first one, leaves
zeros for the others and says nothing.) Values go through the LinearizationTable, and the picture is cut to ActiveArea
and DefaultCrop. White balance, colour matrices and opcodes are not applied.
"""

from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import rawpy
import tifffile
from numpy.typing import NDArray

from psvideo.clip.decode.tiff import LINEAR_RAW, MOSAIC, MOST_PAGES, check_places, pixels, sample_bits
from psvideo.clip.decoded import CodedPicture, Header, Levels, shot_of
from psvideo.errors import PsvideoError
from psvideo.model.turn import EXIF, UPRIGHT

FILTERS = "RGB"  # CFAPattern counts red, green, blue as 0, 1, 2
LINEARIZATION, BLACK_REPEAT, BLACK, BLACK_BY_COL, BLACK_BY_ROW, WHITE = range(50712, 50718)
CROP_ORIGIN, CROP_SIZE, ACTIVE_AREA = 50719, 50720, 50829
CFA_SIZE, CFA_PATTERN = 33421, 33422
TIME_CODES = 51043
ORIENTATION = 274
DROP_FRAME = 0x40  # the flag in the byte that counts frames
DECODED_BY_TIFFFILE = {1, 7, 8, 34892, 52546}  # not compressed; JPEG, lossless too; Deflate; lossy JPEG; JPEG XL


SHOT_TAGS = {
    "cameraMake": 271,
    "cameraModel": 272,
    "cameraSerialNumber": 50735,
    "lensModel": 42036,
    "reelName": 51081,
}
"""Tags of DNG and CinemaDNG."""


@dataclass(frozen=True, kw_only=True)
class Cut:
    """Which part of the decoded picture is delivered, and its top left pixel's place in the active area."""

    rows: slice
    cols: slice
    row_in_area: int
    col_in_area: int


def header(path: Path) -> Header:
    """Read the tags without decoding the pixels."""
    with tifffile.TiffFile(path) as file:
        return _header(path, file, _raw_page(path, file))


def decode(path: Path) -> CodedPicture:
    """Decode a whole picture: linearized values of the sensor, black not yet taken off."""
    with tifffile.TiffFile(path) as file:
        page = _raw_page(path, file)
        head = _header(path, file, page)
        codes = _codes(path, page)
        cut = _cut(path, page)
    codes = codes[cut.rows, cut.cols]
    return CodedPicture(header=head, codes=np.ascontiguousarray(codes if head.channels == 3 else codes[..., 0]))


def _raw_page(path: Path, file: tifffile.TiffFile) -> tifffile.TiffPage:
    """Return the full-size raw picture, which is the first page or among the first page's children."""
    pages = [page.aspage() for page in islice(file.pages, MOST_PAGES)]  # a damaged page may name itself as the next
    pages += [child.aspage() for page in pages for child in islice(page.pages or (), MOST_PAGES)]
    raw = [page for page in pages if page.photometric in (MOSAIC, LINEAR_RAW) and not page.is_reduced]
    if not raw:
        raise PsvideoError(f"{path}: holds no raw picture. Expected a DNG straight from the camera or its converter.")
    return raw[0]


def _header(path: Path, file: tifffile.TiffFile, page: tifffile.TiffPage) -> Header:
    check_places(path, page)
    cut = _cut(path, page)
    bits = sample_bits(path, page)
    table = _tag(page, LINEARIZATION)
    if table is not None:
        bits = 16
    white = _numbers(page, WHITE) or [2.0**bits - 1 if bits else 1.0]
    if len(set(white)) > 1:
        raise PsvideoError(
            f"{path}: has a white level for each channel ({white}); expected one. Convert the file again."
        )
    return Header(
        width_px=cut.cols.stop - cut.cols.start,
        height_px=cut.rows.stop - cut.rows.start,
        channels=3 if page.photometric == LINEAR_RAW and page.samplesperpixel == 3 else 1,
        bits=bits,
        black=_black(path, page, cut),
        white=white[0],
        cfa=_filters(path, page, cut) if page.photometric == MOSAIC else None,
        colour="unknown",
        turn=EXIF.get(int(_tag(file.pages[0].aspage(), ORIENTATION) or 1), UPRIGHT),
        time_code=_time_code(file.pages[0].aspage()),
        shot=shot_of({name: _tag(file.pages[0].aspage(), code) for name, code in SHOT_TAGS.items()}),
    )


def _codes(path: Path, page: tifffile.TiffPage) -> NDArray[Any]:
    """Decode to linearized values of shape (row, col, sample)."""
    if int(page.compression) not in DECODED_BY_TIFFFILE:
        return _decoded_by_libraw(path, page)
    codes: NDArray[Any] = pixels(page)
    table = _tag(page, LINEARIZATION)
    if table is None:
        return codes
    values = np.asarray(table, np.uint16)
    return np.asarray(values[np.minimum(codes, len(values) - 1)])


def _decoded_by_libraw(path: Path, page: tifffile.TiffPage) -> NDArray[Any]:
    """Decode by LibRaw, which linearizes by itself. Rows of nothing but 0 are a failure that it does not report."""
    with rawpy.imread(str(path)) as raw:
        codes = np.array(raw.raw_image)
    if codes.shape[:2] != (page.imagelength, page.imagewidth) or not codes.any(axis=1).all():
        raise PsvideoError(
            f"{path}: is damaged, or compressed in a way ({int(page.compression)}) that LibRaw does not decode whole. "
            "Copy it again, or convert the footage to uncompressed DNG."
        )
    return codes.reshape(*codes.shape[:2], -1)


def _cut(path: Path, page: tifffile.TiffPage) -> Cut:
    """Work out DefaultCrop, which counts (across, down) from the active area (top, left, bottom, right)."""
    top, left, bottom, right = map(int, _numbers(page, ACTIVE_AREA) or (0, 0, page.imagelength, page.imagewidth))
    col, row = (round(value) for value in _numbers(page, CROP_ORIGIN) or (0, 0))
    width_px, height_px = (
        round(value) for value in _numbers(page, CROP_SIZE) or (right - left - col, bottom - top - row)
    )
    rows = slice(top + row, top + row + height_px)
    cols = slice(left + col, left + col + width_px)
    if not (0 <= rows.start < rows.stop <= page.imagelength and 0 <= cols.start < cols.stop <= page.imagewidth):
        raise PsvideoError(f"{path}: its ActiveArea and DefaultCrop reach beyond its pixels. Convert the file again.")
    return Cut(rows=rows, cols=cols, row_in_area=row, col_in_area=col)


def _black(path: Path, page: tifffile.TiffPage, cut: Cut) -> Levels:
    """Return the black levels by position, from the delivered picture's top left pixel on."""
    if any(any(_numbers(page, tag) or ()) for tag in (BLACK_BY_COL, BLACK_BY_ROW)):
        raise PsvideoError(
            f"{path}: has black levels that change along rows or columns (BlackLevelDelta), which is not read. "
            "Give black_level in the plan after converting the files without them."
        )
    rows, cols = map(int, _numbers(page, BLACK_REPEAT) or (1, 1))
    levels = np.array(_numbers(page, BLACK) or [0.0])
    if levels.size == rows * cols * page.samplesperpixel:
        levels = levels.reshape(rows, cols, -1)
    if levels.size == 1:
        levels = np.broadcast_to(levels, (rows, cols, 1))
    if levels.ndim != 3 or np.ptp(levels, axis=2).any():
        raise PsvideoError(
            f"{path}: has black levels {levels.tolist()} that do not fit its pattern of {rows} x {cols}: expected one "
            "for each place of the pattern. Convert the file again."
        )
    if page.photometric == LINEAR_RAW and np.ptp(levels):
        raise PsvideoError(
            f"{path}: is a colour picture whose black levels differ from place to place, {levels[..., 0].tolist()}: "
            "expected one. Give black_level in the plan after converting the files to one level."
        )
    shifted = np.roll(levels[..., 0], (-cut.row_in_area, -cut.col_in_area), axis=(0, 1))
    return tuple(tuple(map(float, row)) for row in shifted)


def _filters(path: Path, page: tifffile.TiffPage, cut: Cut) -> str:
    """Return the colour filters of the delivered picture's top left 2 x 2 pixels, row by row."""
    size, pattern = _numbers(page, CFA_SIZE), list(bytes(_tag(page, CFA_PATTERN) or b""))
    if size != [2, 2] or sorted(pattern) != [0, 1, 1, 2]:
        raise PsvideoError(
            f"{path}: its colour filters are not a Bayer pattern of red, green and blue, which is needed."
        )
    place = np.array(pattern).reshape(2, 2)
    shifted = np.roll(place, (-cut.row_in_area, -cut.col_in_area), axis=(0, 1))
    return "".join(FILTERS[int(colour)] for colour in shifted.ravel())


def _tag(page: tifffile.TiffPage, code: int) -> Any:
    tag = page.tags.get(code)
    return None if tag is None else tag.value


def _numbers(page: tifffile.TiffPage, code: int) -> list[float] | None:
    """Return a tag's numbers; rationals come as pairs of numerator and denominator."""
    tag = page.tags.get(code)
    if tag is None:
        return None
    values = list(tag.value) if isinstance(tag.value, tuple | bytes) else [tag.value]
    if tag.dtype in (tifffile.DATATYPE.RATIONAL, tifffile.DATATYPE.SRATIONAL):
        return [float(Fraction(*pair)) for pair in zip(values[::2], values[1::2], strict=True)]
    return [float(value) for value in values]


def _time_code(page: tifffile.TiffPage) -> str | None:
    """Return the first of CinemaDNG's TimeCodes: SMPTE 12M decimal digits, frames first, flags in the high bits.

    ``;`` stands before the frame of a drop-frame code.
    """
    packed = bytes(_tag(page, TIME_CODES) or b"")
    if len(packed) < 4:
        return None
    digits = [byte & mask for byte, mask in zip(packed, (0x3F, 0x7F, 0x7F, 0x3F), strict=False)]
    frame, *rest = (f"{byte >> 4}{byte & 15}" for byte in digits)
    return ":".join(reversed(rest)) + (";" if packed[0] & DROP_FRAME else ":") + frame
