"""Reading a clip's frames: lazily, in order, decoded some frames ahead of the one that is worked on."""

import contextlib
from bisect import bisect_left
from collections.abc import Callable, Generator, Iterable, Iterator
from functools import partial
from typing import Any

import numpy as np
from fileseq.exceptions import MaxSizeException, ParseException
from fileseq.frameset import FrameSet
from numpy.typing import NDArray

from psvideo.clip.decode.decoders import opened
from psvideo.clip.decoded import CodedPicture, Header, PictureInFile
from psvideo.clip.kept import Kept
from psvideo.clip.linear import in_codes
from psvideo.clip.record import Clip, Frame
from psvideo.compute.threads import in_order, thread_count
from psvideo.errors import PsvideoError, UsageError
from psvideo.model.units import counted

Picture = CodedPicture | PictureInFile
CHECKED_ROWS = 256
"""Rows of a picture that are looked at in one go for what is no number."""


def read_frames(
    clip: Clip,
    numbers: Iterable[int] | None = None,
    *,
    ahead: int = 2,
    threads: int | None = None,
    kept: Kept | None = None,
    keep: bool = False,
    in_files: bool = False,
) -> Iterator[Frame]:
    """Give the clip's frames in their codes, in ascending order, each decoded once; ``numbers`` chooses some of them.

    Up to ``ahead`` frames are decoded in advance by ``threads``, left out by half of those that compute: rebuilding,
    solving and encoding want the others. So memory does not grow with the clip. The threads end when the iterator is
    used up, closed, or ends in an error. Frames that are in ``kept`` are read back from there; with ``keep`` the others
    are put into it once they are decoded, unless their files hold plain codes themselves. ``in_files``: frames stay in
    their files, where they lie there as they would in memory, or else in that of ``kept``, and rows are read whenever
    somebody wants them; for those who hold many. Raises PsvideoError that names the file where a frame is missing,
    damaged, or of another size or depth than the first.
    """
    chosen = clip.numbers if numbers is None else tuple(sorted(set(numbers)))
    absent = set(chosen) - set(clip.numbers)
    if absent:
        raise UsageError(f"{clip.path}: has no frame number {min(absent)}; {_span(clip.numbers)}.")
    if not chosen:
        return iter(())
    decoded = _decoder(clip, [number for number in chosen if kept is None or number not in kept], in_files)
    keep = keep and not holds_plain_codes(clip)
    jobs = (partial(_picture, clip, number, decoded, kept, keep, in_files) for number in chosen)
    workers = 1 if clip.is_movie else threads or max(thread_count() // 2, 1)
    return _as_frames(clip, in_order(jobs, ahead=ahead, threads=workers, name="decode"))


def holds_plain_codes(clip: Clip) -> bool:
    """Return whether the frames' files hold their codes as they are, so that reading them again is decoding enough."""
    head = clip.header
    bytes_per_code = 2 if head.bits is None else -(-head.bits // 8)
    size = head.width_px * head.height_px * head.channels * bytes_per_code
    return not clip.is_movie and clip.files[0].stat().st_size >= size


def parse_range(text: str, numbers: Iterable[int]) -> tuple[int, ...]:
    """Return those of a clip's frame numbers that a range such as ``1-100x2`` or ``1-20,40`` names.

    Raises UsageError where the range cannot be read or names none of the frames.
    """
    present = tuple(numbers)
    try:
        wanted = set(FrameSet(text if text.strip() else "none"))
    except MaxSizeException:
        raise UsageError(f"`frames` {text}: names more frames than any clip has; {_span(present)}.") from None
    except (ParseException, ValueError):
        raise UsageError(f"`frames` {text}: is not a frame range. Write for example 1-100 or 1-100x2.") from None
    for part in text.split(","):
        ends = tuple(FrameSet(part)) if part.strip() else ()
        if len(ends) > 1 and ends[0] > ends[-1]:
            raise UsageError(f"`frames` {text}: {part.strip()} runs backwards. Write the first frame first.")
    chosen = tuple(number for number in present if number in wanted)
    if not chosen:
        raise UsageError(f"`frames` {text}: names none of the clip's frames; {_span(present)}.")
    return chosen


def _span(numbers: tuple[int, ...]) -> str:
    if len(numbers) == 1:
        return f"its only frame has the number {numbers[0]}"
    return f"its {len(numbers)} frames are numbered {numbers[0]} to {numbers[-1]}"


def _decoder(clip: Clip, numbers: list[int], in_files: bool) -> Callable[[int], Picture]:
    """Return what decodes a frame; a movie's are asked for in the order of ``numbers``."""
    if not clip.is_movie:
        return lambda number: opened(clip.kind, clip.file_of(number), of_clip=in_files)
    from psvideo.clip.decode.movies.movie_frames import read_movie

    stamps = [clip.timestamps[bisect_left(clip.numbers, number)] for number in numbers]
    pictures = read_movie(clip.path, stamps, numbers)
    return lambda _: next(pictures)


def _picture(
    clip: Clip, number: int, decoded: Callable[[int], Picture], kept: Kept | None, keep: bool, in_files: bool
) -> tuple[int, Picture]:
    """Read a frame's picture back where it is kept, else decode it, and keep it if that is wanted."""
    if kept is not None and number in kept:
        return number, kept.get(number, in_file=in_files)
    picture = decoded(number)
    _check_like_first(clip, picture.header, _name(clip, number))
    _check_finite(picture, _name(clip, number))
    if kept is not None and keep and isinstance(picture, CodedPicture):
        kept.put(number, picture)
    elif kept is not None and in_files and isinstance(picture, CodedPicture):
        return number, kept.passing(picture)
    return number, picture


def _as_frames(clip: Clip, pictures: Generator[tuple[int, Picture]]) -> Iterator[Frame]:
    with contextlib.closing(pictures):
        yield from map(partial(_frame, clip), pictures)  # holds no picture while its frame is worked on


def _frame(clip: Clip, numbered: tuple[int, Picture]) -> Frame:
    number, picture = numbered
    return Frame(index=clip.index_of(number), number=number, coded=in_codes(picture, clip.encoding))


def _check_finite(picture: Picture, name: str) -> None:
    """Refuse a picture that holds values that are not numbers."""
    if picture.header.bits is not None:
        return
    bands = (picture.codes[first : first + CHECKED_ROWS] for first in range(0, len(picture.codes), CHECKED_ROWS))
    missing = sum(0 if _is_finite(band) else int((~np.isfinite(band)).sum()) for band in bands)
    if missing:
        raise PsvideoError(
            f"{name}: holds {missing} values that are not numbers (NaN or "
            "infinity). Write the frame again with finite pixels."
        )


def _is_finite(codes: NDArray[Any]) -> bool:
    if codes.dtype == np.float16:  # numpy has no fast sum of halves; beyond these bits they are no numbers
        bits = np.ascontiguousarray(codes).view(np.uint16)  # from infinity on, of either sign
        return int(bits.view(np.int16).max()) < 0x7C00 and int(bits.max()) < 0xFC00
    return bool(np.isfinite(codes.sum(dtype=np.float64)))


def _name(clip: Clip, number: int) -> str:
    return f"{clip.path}, frame {number}" if clip.is_movie else str(clip.file_of(number))


def _check_like_first(clip: Clip, found: Header, name: str) -> None:
    """Refuse a frame that is not of the first one's size, channels and depth."""
    if looks(found) != looks(clip.header):
        raise PsvideoError(
            f"{name}: is {looks(found)}; the clip's first frame, {clip.files[0].name}, is {looks(clip.header)}. "
            "All frames of a clip must be alike: export this one again, or move what does not belong here elsewhere."
        )


def looks(head: Header) -> str:
    """Say a picture's size, channels and depth: what all frames of a clip have in common."""
    depth = f"{head.bits} bits" if head.bits else "floating point"
    filters = f", filters {head.cfa}" if head.cfa else ""
    return f"{head.width_px} x {head.height_px} pixels, {counted(head.channels, 'channel')}, {depth}{filters}"
