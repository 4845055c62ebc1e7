"""What can be said of a folder of pictures that has no plan: as photographs, one per light, it needs none."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from psvideo.calibrate.light_files import find_stills
from psvideo.clip.reading import looks
from psvideo.clip.stated import says_as
from psvideo.clip.stills import Photographs, look_at
from psvideo.errors import PsvideoError
from psvideo.formats.clip_layout import PLAN_FILE
from psvideo.inspect.findings import Finding, ok, warn
from psvideo.model.units import counted, listed

FEWEST, MOST = 3, 300
"""This many photographs of one subject are taken; what has more pictures is a clip."""
SAME_EXPOSURE = 1.02


def photograph_findings(folder: Path) -> Iterator[Finding]:
    """Yield what a folder's pictures say of themselves. Raises PsvideoError where they do not belong together."""
    files = list[Path]()
    with contextlib.suppress(PsvideoError):
        found = find_stills(folder)
        files = [one[0] for one in found.by_light.values()]
    if not FEWEST <= len(files) <= MOST or (folder.parent / PLAN_FILE).is_file():
        return
    pictures = look_at(files)
    span = f"{files[0].name} to {files[-1].name}"
    yield ok(f"as photographs, {counted(len(files), 'light')}: {span}, {pictures.kind}, {looks(pictures.header)}")
    yield ok(f"read as {pictures.transfer!r}, {pictures.because}")
    yield from (warn(text) for text in pictures.header.warnings)
    yield from (ok(text) for text in pictures.header.notes)
    yield from _as_taken(pictures)
    beside = [*(f"{file.name} shows ambient light" for file in found.ambient), *_aside(found.left_aside)]
    if beside:
        yield ok("; ".join(beside))


def _as_taken(pictures: Photographs) -> Iterator[Finding]:
    head, first = pictures.header, pictures.stated[0]
    if not head.turn.is_none:
        upright = "{} x {}".format(*head.turn.size(head.width_px, head.height_px))
        yield ok(f"shown {head.turn}, {upright} pixels upright")
    said = [first.camera, f"a lens of {first.focal_px:.0f} pixels" if first.focal_px else ""]
    if any(said):
        yield ok(f"taken by {', with '.join(one for one in said if one)}, as EXIF says")
    exposures = [one.exposure for one in pictures.stated if one.exposure is not None and says_as(one, first)]
    if exposures and max(exposures) > SAME_EXPOSURE * min(exposures):
        yield warn(f"exposures differ by up to a factor {max(exposures) / min(exposures):.3g}, as EXIF says")


def _aside(files: tuple[Path, ...]) -> Iterator[str]:
    if files:
        shows = "shows" if len(files) == 1 else "show"
        yield f"{listed([file.name for file in files], FEWEST)} {shows} no light"
