"""TIFF: grey or RGB, 8 to 16 bits or half and single floats; compressed, tiled or plain."""

import logging
import sys
from itertools import islice
from math import prod
from pathlib import Path

import numpy as np
import tifffile
from numpy.typing import NDArray

from psvideo.clip.decoded import CodedPicture, Header, PictureInFile
from psvideo.clip.in_file import RowsInFile
from psvideo.errors import PsvideoError

# tifffile writes to its own log what it thinks of odd tags; what matters of it is raised here.
logging.getLogger("tifffile").addHandler(logging.NullHandler())

STAYS_FROM_BYTES = 1 << 27
"""Samples of this many bytes and more (22 megapixels in colour) stay in their file where they lie there as they are."""
OF_CLIP_STAYS_FROM_BYTES = 1 << 20
"""The same of a clip's frames, of which a round and a half would be held: smaller ones cost less than reading them
piece by piece."""
MOST_PAGES = 32
"""A picture and its thumbnails are fewer."""
NATIVE = "<" if sys.byteorder == "little" else ">"
GREY, RGB, MOSAIC, LINEAR_RAW = 1, 2, 32803, 34892  # values of the tag PhotometricInterpretation


def header(path: Path) -> Header:
    """Read what the file says without decoding its pixels."""
    with tifffile.TiffFile(path) as file:
        return _header(path, _only_page(path, file))


def decode(path: Path) -> CodedPicture:
    """Decode a whole picture; alpha and other extra channels are left out."""
    with tifffile.TiffFile(path) as file:
        page = _only_page(path, file)
        return _decoded(page, _header(path, page))


def opened(path: Path, *, of_clip: bool = False) -> CodedPicture | PictureInFile:
    """Return a picture; where it is large and lies in its file as it would in memory, it is left there. ``of_clip``:
    one of many of which a few are held at a time."""
    with tifffile.TiffFile(path) as file:
        page = _only_page(path, file)
        head = _header(path, page)
        plain = bool(page.is_memmappable) and page.planarconfig == 1 and page.samplesperpixel == head.channels
        if (
            not plain
            or file.byteorder != NATIVE
            or page.nbytes < (OF_CLIP_STAYS_FROM_BYTES if of_clip else STAYS_FROM_BYTES)
        ):
            return _decoded(page, head)
        shape = (page.imagelength, page.imagewidth, *((head.channels,) if head.channels > 1 else ()))
        begin, kind = page.dataoffsets[0], np.dtype(page.dtype)
        return PictureInFile(header=head, codes=RowsInFile.at(path, begin, kind, shape, stays_open=of_clip))


def _decoded(page: tifffile.TiffPage, head: Header) -> CodedPicture:
    codes = pixels(page)[..., : head.channels]
    return CodedPicture(header=head, codes=codes[..., 0] if head.channels == 1 else np.ascontiguousarray(codes))


def pixels(page: tifffile.TiffPage) -> NDArray[np.generic]:
    """Decode a page to (row, col, sample); ``check_places`` comes first."""
    picture = np.asarray(page.asarray(maxworkers=1))
    if picture.ndim == 2:
        return picture[..., None]
    return np.moveaxis(picture, 0, -1) if page.planarconfig == 2 else picture


def check_places(path: Path, page: tifffile.TiffPage) -> None:
    """Refuse a file that does not hold every strip or tile: decoders give zeros for those that are not there."""
    size = path.stat().st_size
    offsets, counts = page.dataoffsets, page.databytecounts
    held = sum(count > 0 and offset + count <= size for offset, count in zip(offsets, counts, strict=False))
    expected = max(len(offsets), len(counts), prod(page.chunked), 1)
    if held < expected:
        raise PsvideoError(
            f"{path}: {expected - held} of its {expected} strips or tiles are empty or lie beyond the end of the file: "
            "it is truncated. Copy it again."
        )


def sample_bits(path: Path, page: tifffile.TiffPage) -> int | None:
    """Return the depth of a page's samples, None for floating point; raises PsvideoError for depths not read here."""
    bits = page.bitspersample
    if page.sampleformat == 3 and bits in (16, 32):
        return None
    if page.sampleformat != 1 or not 8 <= bits <= 16:
        raise PsvideoError(
            f"{path}: holds samples of {bits} bits, sample format {page.sampleformat}; expected unsigned integers of 8 "
            "to 16 bits, or floats of 16 or 32. Export the frames as such."
        )
    return int(bits)


def _only_page(path: Path, file: tifffile.TiffFile) -> tifffile.TiffPage:
    """Return the page that holds the picture; reduced copies of it (thumbnails) do not count."""
    found = list(islice(file.pages, MOST_PAGES))  # a damaged page may name itself as the one that follows
    pages = [page.aspage() for page in found if not page.aspage().is_reduced]
    if not found:  # many programs write what a file holds at its end
        raise PsvideoError(f"{path}: ends before it says what it holds: it is truncated. Copy it again.")
    if len(pages) != 1 or len(found) == MOST_PAGES:
        raise PsvideoError(f"{path}: holds {len(pages)} pictures; expected one per file. Export one file per frame.")
    return pages[0]


def _header(path: Path, page: tifffile.TiffPage) -> Header:
    check_places(path, page)
    channels = {GREY: 1, RGB: 3, MOSAIC: 1}.get(int(page.photometric))
    if channels is None or page.samplesperpixel < channels:
        kind = tifffile.PHOTOMETRIC(page.photometric).name
        raise PsvideoError(
            f"{path}: its photometric interpretation is {kind}; expected grey (black is zero) or RGB. "
            "Export the frames as such."
        )
    notes = ("the TIFF files' extra channels (alpha) are left out",) if page.samplesperpixel > channels else ()
    return Header(
        width_px=page.imagewidth,
        height_px=page.imagelength,
        channels=channels,
        bits=sample_bits(path, page),
        notes=notes,
    )
