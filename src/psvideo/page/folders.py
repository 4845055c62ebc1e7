"""What a folder of results or plates has to show, and the clip that it was made from beside it."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from psvideo.clip.folder import MOVIES
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.contract import read_json
from psvideo.formats.timing_json import read_timing, timing_record
from psvideo.inspect.about_output import is_of_photographs, is_plates, is_results, solved_takes_in
from psvideo.model.quantities import QUANTITIES
from psvideo.model.units import counted
from psvideo.page.file_times import file_times_s
from psvideo.page.footage import show_of_clip, with_clip
from psvideo.page.sequence_files import files_in, first_header, rate_of, sequence_of, size_and_rate
from psvideo.page.show import Show

FLASHES = "flashes"
"""Where split writes every flash by itself, beside the plates."""
PLATE, AMBIENT = QUANTITIES["plate"], QUANTITIES["ambient"]


def show_of(path: Path, *, clip: Path | None = None, plan: Path | None = None) -> Show:
    """Return what a folder that psvideo wrote, or a clip, has to show.

    Beside results and plates stand the frames of their ``clip``; left out, the clip is looked for next to the folder,
    under the name in its timing.json. ``plan`` is the clip's, where it does not lie beside it. Raises PsvideoError
    where the path is nothing that can be shown.
    """
    if not path.exists():
        raise PsvideoError(f"{path}: there is no such file or folder. Name a folder of results or plates, or a clip.")
    if path.is_dir() and (takes := solved_takes_in(path)):
        held = f"holds results of {counted(len(takes), 'take')}"
        raise UsageError(f"{path}: {held}. Name one, such as {takes[0]}; several are shown side by side.")
    if not path.is_dir() or not (is_results(path) or is_plates(path)):
        if clip is not None:
            raise UsageError(f"`clip`: goes with a folder of results or plates, and {path} is none. Leave it out.")
        return _clip(path, plan)
    show = _results(path) if is_results(path) else _plates(path)
    if clip is not None:
        return with_clip(show, clip, plan=plan, timing=path / "timing.json")
    return _with_clip_beside(show, path)


def _clip(path: Path, plan: Path | None) -> Show:

    try:
        return show_of_clip(path, plan=plan)
    except PsvideoError as fault:
        raise PsvideoError(f"{fault} Results and plates, which normals and split write, can be shown too.") from None


def _with_clip_beside(show: Show, path: Path) -> Show:
    """Add the clip that lies next to a folder, where one of the right name does; say so where it cannot be used."""
    timing = path / "timing.json"
    if not timing.is_file():
        return show
    folder = path.resolve().parent / read_timing(timing).clip
    movies = [movie for ending in MOVIES if (movie := folder.with_name(folder.name + ending)).is_file()]
    clip = folder if folder.is_dir() and folder != path.resolve() else next(iter(movies), None)
    if clip is None:
        return show
    try:
        return with_clip(show, clip, timing=timing)
    except PsvideoError as fault:
        return replace(show, notes=(*show.notes, f"The clip beside this folder is not shown. {fault}"))


def _results(path: Path) -> Show:
    known = [
        row
        for row in QUANTITIES.values()
        if row.written != "plates" and row.shown != "never" and files_in(path / row.name)
    ]
    first = files_in(path / known[0].name)
    times_s = file_times_s(first, rate_of(first_header(first)))
    sequences = [sequence_of(path / row.name, row, like=(tuple(sorted(first)), times_s)) for row in known]
    width_px, height_px, fps = size_and_rate(path / known[0].name)
    if is_of_photographs(path):
        fps = 0.0
    report = _report(path / "report.json")
    return Show(
        name=path.resolve().name if not report else str(report.get("clip", path.name)),
        kind="results",
        fps=fps,
        width_px=width_px,
        height_px=height_px,
        sequences=tuple(sequences),
        verdict=str(report.get("verdict", "")),
        findings=tuple(str(sentence) for sentence in _list(report.get("findings"))),
        facts=dict(_facts(report)),
        report=path / "report.html" if (path / "report.html").is_file() else None,
        timing=_timing_of(path / "timing.json") if fps else None,  # photographs were flashed at no time
    )


def _plates(path: Path) -> Show:
    folders = sorted(entry for entry in path.iterdir() if entry.is_dir() and files_in(entry))
    folders = [folder for folder in folders if folder.name != FLASHES]
    folders.sort(key=lambda folder: folder.name == AMBIENT.name)
    if not folders:
        raise PsvideoError(
            f"{path}: holds single flashes and no plates of a light; expected a folder for each light, as psvideo "
            f"split writes them. Run it again, or bring them back beside {FLASHES}/."
        )
    sequences = [
        replace(sequence_of(folder, PLATE), label=folder.name, group="Plates", id=f"plate-{place}", family="camera")
        for place, folder in enumerate(folders)
    ]
    width_px, height_px, fps = size_and_rate(folders[0])
    return Show(
        name=path.resolve().name,
        kind="plates",
        fps=fps,
        width_px=width_px,
        height_px=height_px,
        sequences=tuple(sequences),
        timing=_timing_of(path / "timing.json"),
    )


def _timing_of(path: Path) -> partial[Mapping[str, object]] | None:
    return partial(_read_timing, path) if path.is_file() else None


def _read_timing(path: Path) -> Mapping[str, object]:
    return timing_record(read_timing(path))


def _report(path: Path) -> Mapping[str, object]:
    """Return report.json, nothing where there is none. Raises PsvideoError where it is damaged."""
    if not path.is_file():
        return {}
    return read_json(path, advice="Run psvideo normals again, or remove it.")


def _list(value: object) -> list[object]:
    return value if isinstance(value, list) else []


def _facts(report: Mapping[str, object]) -> Iterator[tuple[str, str]]:
    if lights := _list(report.get("lights")):
        yield "Lights", ", ".join(map(str, lights))
    if solver := report.get("solver"):
        yield "Solver", str(solver)
    if version := report.get("version"):
        yield "Made with", f"psvideo {version}"
