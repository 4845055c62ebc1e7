"""Finding a clip's frames in a folder: numbered images of one kind, in the order of the number that ends the stem."""

import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from psvideo.errors import PsvideoError
from psvideo.formats.clip_layout import FRAMES
from psvideo.formats.paths import check_text

KINDS = {
    ".png": "png",
    ".exr": "exr",
    ".tif": "tiff",
    ".tiff": "tiff",
    ".dng": "dng",
    ".dpx": "dpx",
    ".jpg": "jpeg",
    ".jpeg": "jpeg",
    **dict.fromkeys((".cr2", ".cr3", ".nef", ".nrw", ".arw", ".raf", ".orf", ".rw2", ".pef", ".srw"), "raw"),
}
RAWS = ("dng", "raw")
"""Kinds that hold the sensor's own values: linear, with the levels and colour filters that the file states."""
USUAL_KINDS = (*sorted(ending for ending, kind in KINDS.items() if kind != "raw"), "cameras' raw files")
"""What messages list."""
MOVIES = (
    *(".mov", ".mp4", ".mkv", ".mxf", ".m4v", ".3gp", ".avi", ".webm", ".mts", ".m2ts", ".ts", ".mpg", ".mpeg"),
    *(".y4m", ".nut", ".wmv", ".flv"),
)
TO_PICTURES = "export the pictures as 16-bit TIFF, PNG or DNG; a phone's camera can be set to JPEG or raw"
TO_FOOTAGE = "export it with its maker's program, as DNG, EXR or ProRes"
UNREAD = {
    **dict.fromkeys((".heic", ".heif", ".hif", ".avif", ".webp", ".jxl", ".jp2", ".j2k", ".jxr"), TO_PICTURES),
    **dict.fromkeys((".bmp", ".gif", ".psd", ".tga", ".pbm", ".pgm", ".ppm", ".pnm"), TO_PICTURES),
    **dict.fromkeys((".hdr", ".pfm", ".cin", ".sgi"), "export the pictures as EXR"),
    **dict.fromkeys((".x3f", ".3fr", ".iiq", ".fff"), "convert the pictures to DNG"),
    **dict.fromkeys((".braw", ".r3d", ".crm", ".ari", ".arx", ".nev", ".mlv"), TO_FOOTAGE),
}
"""What cameras write and psvideo does not read, and what to do with it."""
NUMBERED = re.compile(r"(.*?)(\d+)", re.DOTALL)
BRACKETED = re.compile(r"(.*?)\((\d+)\)", re.DOTALL)
"""As Windows names many files at once, ``shot (12)``; where a name ends in a number, such files are copies."""


@dataclass(frozen=True, kw_only=True)
class NumberedImages:
    """Numbered images: their kind, files in ascending order, numbers, and the images that were passed over."""

    kind: str
    files: tuple[Path, ...]
    numbers: tuple[int, ...]
    passed_over: tuple[Path, ...] = ()


def find_sequence(folder: Path) -> NumberedImages:
    """Return the one sequence of numbered images in a folder or in its ``frames/``.

    Raises PsvideoError where there is none, or where it is not clear which images are meant.
    """
    beside, within = _images(folder), _images(folder / FRAMES)
    if _numbered(beside) and _numbered(within):
        raise PsvideoError(
            f"{folder}: numbered images lie in the folder ({_numbered(beside)[0].name}, …) and in its frames/ too "
            f"({_numbered(within)[0].name}, …). Leave the clip's frames in one of the two places."
        )
    images = within if _numbered(within) else beside
    frames = _numbered(images)
    if not frames:
        raise PsvideoError(f"{folder}: {_nothing(folder, images)}")
    _refuse_mixture(frames)
    check_text(frames[0])
    numbers = tuple(_number(file) for file in frames)
    taken = set(frames)
    passed_over = tuple(image for image in images if image not in taken)
    return NumberedImages(
        kind=KINDS[frames[0].suffix.lower()], files=tuple(frames), numbers=numbers, passed_over=passed_over
    )


def unread_in(folder: Path) -> str:
    """Return a sentence on a folder's files that cameras write and psvideo does not read; empty without such files."""
    found = sorted(entry.name for entry in folder.iterdir() if entry.suffix.lower() in UNREAD)
    return unread(Path(found[0]), more=len(found) - 1) if found else ""


def unread(file: Path, *, more: int = 0) -> str:
    """Return what to do with a file that cameras write and psvideo does not read; empty for others."""
    advice, others = UNREAD.get(file.suffix.lower(), ""), f" (and {more} more)" if more else ""
    return advice and f"{file.name}{others} is {file.suffix[1:].upper()}, which is not read: {advice}."


def _images(folder: Path) -> list[Path]:
    try:
        entries = list(folder.iterdir()) if folder.is_dir() else []
    except OSError as fault:
        raise PsvideoError(f"{folder}: cannot be read ({fault.strerror}). Check the folder's permissions.") from fault
    files = (entry for entry in entries if entry.suffix.lower() in KINDS and not entry.name.startswith("."))
    return sorted(files)


def _numbered(images: list[Path]) -> list[Path]:
    found = [[image for image in images if kind.fullmatch(image.stem)] for kind in (NUMBERED, BRACKETED)]
    return sorted(found[0] or found[1], key=lambda image: (_number(image), image))


def _number(file: Path) -> int:
    return int(numbered_name(file)[1])


def number_of(file: Path) -> int | None:
    """Return the number that ends a file's stem, None where there is none."""
    match = NUMBERED.fullmatch(file.stem)
    return int(match[2]) if match else None


def numbered_name(file: Path) -> tuple[str, str]:
    """Return what comes before a frame's number in its file's name, and the number's digits; none where it has none.

    >>> numbered_name(Path("take.0001.png")), numbered_name(Path("shot (12).png"))
    (('take.', '0001'), ('shot (', '12'))
    """
    match = NUMBERED.fullmatch(file.stem) or BRACKETED.fullmatch(file.stem)
    return (file.stem[: match.start(2)], match[2]) if match else (file.stem, "")


def _nothing(folder: Path, images: list[Path]) -> str:
    """Say why a folder holds no clip."""
    movies = sorted(file.name for file in folder.iterdir() if file.suffix.lower() in MOVIES)
    if movies:
        held = "a movie" if len(movies) == 1 else f"{len(movies)} movies"
        itself = "the movie itself" if len(movies) == 1 else "one of them"
        return f"holds {held} and no numbered images. Name {itself}: {folder / movies[0]}"
    found = f"holds images without a number at the end of the name ({images[0].name})" if images else "holds no images"
    kinds = ", ".join(USUAL_KINDS)
    said = f"{found}; expected numbered frames such as name.0001.png ({kinds}) here or in frames/."
    return f"{said} {_instead(folder)}".rstrip()


def _instead(folder: Path) -> str:
    """Say what the user may have meant: a clip inside, what psvideo made of one, or files that are to be converted."""
    if other := unread_in(folder) or (unread_in(folder / FRAMES) if (folder / FRAMES).is_dir() else ""):
        return other
    if (folder / "timing.json").is_file():
        return "This is what psvideo made of a clip (timing.json): name the clip itself."
    clips = sorted(plan.parent for plan in folder.glob("*/plan.toml"))
    return f"A clip lies in it: name {clips[0]}." if clips else ""


def _refuse_mixture(frames: list[Path]) -> None:
    """Refuse two kinds of images, two sequences, or two files of one number."""
    first = frames[0]
    for file in frames:
        if KINDS[file.suffix.lower()] != KINDS[first.suffix.lower()]:
            what = "images of two kinds"
        elif numbered_name(file)[0] != numbered_name(first)[0]:
            what = "two sequences"
        else:
            continue
        raise PsvideoError(
            f"{first.parent}: holds {what}, {first.name} and {file.name}; expected the frames of one clip. "
            "Move the others elsewhere."
        )
    for file, follower in pairwise(frames):
        if _number(file) == _number(follower):
            raise PsvideoError(
                f"{first.parent}: {file.name} and {follower.name} have the same number; expected one file per frame. "
                "Move one of them elsewhere."
            )
