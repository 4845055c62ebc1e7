"""A folder that a recorder is still writing: its frames in the order of their numbers, as soon as each is whole."""

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from psvideo.clip.decode.decoders import opened
from psvideo.clip.decoded import CodedPicture, Header, PictureInFile
from psvideo.clip.filters import check_live_filters
from psvideo.clip.folder import KINDS, number_of
from psvideo.clip.linear import in_codes
from psvideo.clip.reading import looks
from psvideo.clip.record import Frame
from psvideo.errors import PsvideoError
from psvideo.formats.clip_layout import FRAMES
from psvideo.model.camera import Camera

LOOK_S = 0.004
"""Between two looks into the folder."""
WHOLE_S = 2.0
"""A file that cannot be decoded for this long is damaged, and not merely still being written."""
MOST_DAMAGED = 3
"""Where more files in a row stay unreadable, it is no accident: their kind, or their disk, cannot be read."""
LOOKS = 0.25
"""Looking takes no more than this share of the time in which nothing new comes: folders hold tens of thousands."""
LATE_S = 0.25
"""A number that is left out is waited for so long after a later one came: recorders write with several threads."""
QUIET_S = 10.0
"""After this long without a new frame the recorder has ended."""


def read_growing(
    folder: Path,
    camera: Camera,
    *,
    quiet_s: float = QUIET_S,
    whole_s: float = WHOLE_S,
    noted: Callable[[str], None] = lambda note: None,
) -> Iterator[Frame]:
    """Give the frames that appear in a folder or its ``frames/``, until none has for ``quiet_s``.

    Numbers that are left out count as dropped frames, unless their files come a moment late. A file that cannot be
    read is looked at again for ``whole_s``, as it may be half written; then it is left out, and ``noted`` gets a
    sentence that names it. Raises PsvideoError where the folder is not there, where frames are not the camera's, and
    where files one after the other, or all of them, stay unreadable.
    """
    if not folder.is_dir():
        raise PsvideoError(f"{folder}: there is no such folder. Name the one that the recorder writes into.")
    done, first, look = -1, None, ""
    passed: dict[Path, set[str]] = {}
    seen_s: dict[int, float] = {}
    heard_s = time.monotonic()
    damaged: list[PsvideoError] = []
    while time.monotonic() - heard_s < quiet_s:
        looked_s = time.monotonic()
        new, before = _new_files(folder, done, passed), done
        took_s = time.monotonic() - looked_s
        seen_s |= {number: time.monotonic() for number, _ in new if number not in seen_s}
        for number, file in new:
            if first is not None and number > done + 1 and time.monotonic() - seen_s[number] < LATE_S:
                break  # the one before may still come
            try:
                picture = _whole(file, whole_s)
            except PsvideoError as fault:
                damaged.append(fault)
                if len(damaged) > MOST_DAMAGED:
                    raise
                noted(f"{file}: could not be read for {whole_s:g} s, and was left out: a dropped frame.")
                done = number
                continue
            damaged.clear()
            _check_alike(file, picture.header, camera, look)
            first, look, done = number if first is None else first, looks(picture.header), number
            yield Frame(index=number - first, number=number, coded=in_codes(picture, camera.encoding))
        if done > before:
            seen_s = {number: at_s for number, at_s in seen_s.items() if number > done}
            heard_s = time.monotonic()
        else:
            time.sleep(max(LOOK_S, took_s * (1 / LOOKS - 1)))
    if first is None and damaged:
        raise damaged[0]
    if first is None:
        raise PsvideoError(
            f"{folder}: no frame appeared in {quiet_s:g} s; expected numbered images ({', '.join(sorted(KINDS)[:6])}, "
            "…). Start the recorder, then psvideo live again."
        )


def _check_alike(file: Path, head: Header, camera: Camera, look: str) -> None:
    """Raise PsvideoError where a frame is not as the camera's, or does not look as those before (``look``)."""
    if (head.width_px, head.height_px) != (camera.width_px, camera.height_px) or look not in ("", looks(head)):
        expected = look or f"{camera.width_px} x {camera.height_px} pixels"
        raise PsvideoError(
            f"{file}: is {looks(head)}; expected {expected}, as the plan and the frames before say. Use the "
            "plan of this mode, and an empty folder for each take."
        )
    check_live_filters(file, head, camera.encoding.cfa)


def _new_files(folder: Path, after: int, passed: dict[Path, set[str]]) -> list[tuple[int, Path]]:
    """Return the numbered images beyond a number, in order; hidden files are not yet whole.

    ``passed`` names what was looked at before and is none of them. Raises PsvideoError where two have one number.
    """
    places = (folder / FRAMES, folder) if (folder / FRAMES).is_dir() else (folder,)
    found: dict[int, Path] = {}
    for place in places:
        known = passed.setdefault(place, set())
        for name in sorted(set(os.listdir(place)) - known):  # noqa: PTH208  # a path for each would take 20 times as long
            number = None if name.startswith(".") else _image_number(Path(name))
            if number is None or number <= after:
                known.add(name)
                continue
            if number in found:
                raise PsvideoError(
                    f"{found[number]} and {place / name}: are both numbered {number}, so which is the frame is not "
                    "known. Let the recorder write one kind of file, and each take into a folder of its own."
                )
            found[number] = place / name
    return sorted(found.items())


def _image_number(file: Path) -> int | None:
    return number_of(file) if file.suffix.lower() in KINDS else None


def _whole(file: Path, whole_s: float) -> CodedPicture | PictureInFile:
    """Decode a file, again and again while it is being written. Raises PsvideoError where it cannot for ``whole_s``."""
    began_s = time.monotonic()
    while True:
        try:
            return opened(KINDS[file.suffix.lower()], file)
        except PsvideoError:
            if time.monotonic() - began_s > whole_s:
                raise
            time.sleep(LOOK_S)
