"""What lies beside the sequences of a finished run for any program: movies for eyes, and a timeline."""

import os
import shutil
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from urllib.parse import quote

from psvideo.clip import Clip
from psvideo.clip.folder import number_of, numbered_name
from psvideo.compute.progress import Watch
from psvideo.export.programs.otio import Footage, Images, timeline_text
from psvideo.export.sequences.result_files import MOVIE_SUFFIXES
from psvideo.formats.whole_files import write_text
from psvideo.model.choices import CODECS, MovieCodec, Preview
from psvideo.runs.delivery.previews import PreviewedInstant, preview_name, write_preview
from psvideo.runs.delivery.relit import KEPT, relit_file

OTHER_RATES = ("flashes",)
"""Folders whose pictures do not come once an instant."""


@dataclass(frozen=True, kw_only=True)
class Finished:
    """A run whose sequences are written: where (``folder``, which becomes ``target``), from what and how fast."""

    folder: Path
    target: Path
    clip: Clip
    fps: Fraction
    first_time_s: float


def write_timeline(run: Finished) -> None:
    """Write ``<clip>.otio``, which ties all sequences of the folder to the clip."""
    found = sorted(_sequences(run.folder).items())
    images = [_images(run, name, files) for name, files in found]
    text = timeline_text(run.clip.name, images, _footage(run))
    write_text(run.folder / f"{run.clip.name}.otio", text)


def write_previews(
    run: Finished, previews: Sequence[Preview], codec: MovieCodec, *, plates: Sequence[str], watch: Watch
) -> None:
    """Make the movies asked for; ``plates`` are the sequences (folders) that the one of plates shows."""
    if not previews:
        return
    found = _sequences(run.folder)
    for preview in previews:
        names = {"relit": ("normals", "albedo"), "plates": tuple(plates)}.get(preview, (preview,))
        numbers = sorted(set.intersection(*(set(found.get(name, {})) for name in names)))
        instants = [
            PreviewedInstant(
                number=number,
                files={name.rpartition("/")[2]: found[name][number] for name in names},
                relit=kept if (kept := relit_file(run.folder, number)).is_file() else None,
            )
            for number in numbers
        ]
        paths = {
            each: run.folder / preview_name(run.clip.name, preview, MOVIE_SUFFIXES[each]) for each in CODECS[codec]
        }
        missing = {each: path for each, path in paths.items() if not path.is_file()}
        if instants and missing:
            write_preview(missing, preview, instants, fps=run.fps, watch=watch)
    shutil.rmtree(run.folder / KEPT, ignore_errors=True)


def _sequences(folder: Path) -> dict[str, dict[int, Path]]:
    """Return the pictures of every sequence, by folder and number; the one of multipart files has no folder."""
    found: dict[str, dict[int, Path]] = defaultdict(dict)
    for path in (*folder.rglob("[!.]*.exr"), *folder.rglob("[!.]*.png")):
        number = number_of(path)
        name = path.parent.relative_to(folder).as_posix()
        if number is not None and name not in OTHER_RATES:
            found["" if name == "." else name][number] = path
    return dict(found)


def _images(run: Finished, name: str, files: dict[int, Path]) -> Images:
    first, last = min(files), max(files)
    prefix = files[first].stem.removesuffix(f"{first:04d}")
    return Images(
        name=name or f"{run.clip.name} (all parts)",
        folder=f"{quote(name)}/" if name else "",
        prefix=prefix,
        suffix=files[first].suffix,
        first=first,
        count=last - first + 1,
        fps=run.fps,
    )


def _footage(run: Finished) -> Footage:
    """Return the clip as the timeline's footage, named relative to the folder that the run becomes."""
    clip, fps = run.clip, run.clip.plan.camera.fps
    start = int(run.first_time_s * fps)
    frames = clip.numbers[-1] - clip.numbers[0] + 1
    if clip.is_movie:
        media: Images | str = quote(_relative(clip.files[0], run.target))
    else:
        first = clip.files[0]
        prefix, written = numbered_name(first)
        media = Images(
            name=clip.name,
            folder=quote(_relative(first.parent, run.target)) + "/",
            prefix=prefix,
            suffix=first.name.removeprefix(prefix + written),
            first=clip.numbers[0],
            count=frames,
            fps=fps,
            digits=len(written) if written.startswith("0") or len(written) == len(str(clip.numbers[-1])) else 0,
        )
    return Footage(name=clip.name, media=media, frames=frames, fps=fps, start=start)


def _relative(path: Path, folder: Path) -> str:
    """Return a path relative to a folder, or as it is where there is no way (another drive)."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return path.resolve().as_uri()
