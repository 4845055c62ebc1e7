"""What can be said of a folder that psvideo wrote: plates, or results; whether its sequences go together."""

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

from psvideo.clip.decode import exr
from psvideo.clip.folder import number_of
from psvideo.errors import PsvideoError
from psvideo.formats.clip_layout import PLAN_FILE, SETUP
from psvideo.formats.timing_json import read_timing
from psvideo.inspect.findings import Description, Fact, Finding, caught, fault, ok, warn
from psvideo.model.quantities import ALWAYS, QUANTITIES
from psvideo.model.units import counted


def is_plates(folder: Path) -> bool:
    """Return whether ``split`` wrote this folder: a timing beside one folder of plates per light, and no plan."""
    if not (folder / "timing.json").is_file() or (folder / PLAN_FILE).is_file():
        return False
    return bool(_sequences(folder)) and not is_results(folder)


def is_results(folder: Path) -> bool:
    """Return whether ``normals`` wrote this folder."""
    return any((folder / "normals").glob("*.exr"))


def is_of_photographs(folder: Path) -> bool:
    """Return whether ``stills`` wrote this folder: the rate that its files name is one that programs know, and no one
    filmed at it."""
    return (folder / SETUP / PLAN_FILE).is_file()


def solved_takes_in(folder: Path) -> tuple[Path, ...]:
    """Return the folders of results or plates in a folder that is neither of them nor a clip: those of several takes.
    Empty where there are none."""
    if (folder / PLAN_FILE).is_file() or is_results(folder) or is_plates(folder):
        return ()
    inside = sorted(entry for entry in folder.iterdir() if entry.is_dir() and not entry.name.startswith("."))
    return tuple(entry for entry in inside if is_results(entry) or is_plates(entry))


def describe_takes(folder: Path) -> Description:
    """Describe a folder of results or plates of several takes: what each is, and what does not fit in any."""
    found = [describe_output(take) for take in solved_takes_in(folder)]
    findings = [finding for one in found for finding in _in_short(one)]
    facts: dict[str, Fact] = {"takes": [one.path.name for one in found]}
    return Description(path=folder, kind="results of several takes", facts=facts, findings=tuple(findings))


def _in_short(take: Description) -> Iterator[Finding]:
    """Say what a take's folder holds and what is wrong with it, by its name."""
    normals = take.facts.get("normals")
    held = f", {counted(normals, 'result')}" if isinstance(normals, int) else ""
    yield ok(f"{take.path.name}: {take.kind}{held}")
    for finding in take.findings:
        if finding.level != "ok":
            yield replace(finding, text=f"{take.path.name}: {finding.text}")


def output_around(path: Path) -> Path | None:
    """Return the folder of results or plates that a path is a part of: a folder or file in it, or a movie for eyes."""
    if (path / PLAN_FILE).is_file():
        return None
    around = (path.parent, path.parent.parent) if path.parent.name == "preview" else (path.parent,)
    return next((folder for folder in around if is_results(folder) or is_plates(folder)), None)


def describe_output(folder: Path) -> Description:
    """Describe a folder of plates or of results."""
    sequences = _sequences(folder)
    kind = "results folder" if is_results(folder) else "plates folder"
    findings = tuple(caught(_findings(folder, sequences, kind)))
    facts: dict[str, Fact] = {"sequences": list(sequences), **{name: len(files) for name, files in sequences.items()}}
    return Description(path=folder, kind=kind, facts=facts | _said_in_headers(sequences), findings=findings)


def _said_in_headers(sequences: dict[str, list[Path]]) -> dict[str, Fact]:
    """Return what the first files' headers say of space, direction of y, rate and colour; what is not said is None."""
    heads = {name: exr.contents(files[0])[1] for name, files in sequences.items() if name in ALWAYS}
    normals = heads.get("normals", {})
    return {
        "space": normals.get("psvideo:space"),
        "y": normals.get("psvideo:y"),
        "fps": normals.get("framesPerSecond"),
        "colour": heads.get("albedo", {}).get("colorInteropID"),
        "time_code": normals.get("timeCode"),
    }


def _sequences(folder: Path) -> dict[str, list[Path]]:
    """Return the EXR files of every folder inside, by the folder's name."""
    inside = sorted(entry for entry in folder.iterdir() if entry.is_dir() and not entry.name.startswith("."))
    found = {entry.name: sorted(entry.glob("[!.]*.exr")) for entry in inside}
    return {name: files for name, files in found.items() if files}


def _findings(folder: Path, sequences: dict[str, list[Path]], kind: str) -> Iterator[Finding]:
    for name, files in sequences.items():
        numbers = [number for file in files if (number := number_of(file)) is not None]
        channels, attributes = exr.contents(files[0])
        span = f"numbered {min(numbers)} to {max(numbers)}, " if numbers else ""
        size = f"{attributes['width_px']} x {attributes['height_px']}"
        unit = f", in {QUANTITIES[name].unit}" if name in QUANTITIES and QUANTITIES[name].unit else ""
        yield ok(f"{name}: {counted(len(files), 'file')}, {span}{size}, channels {', '.join(channels)}{unit}")
    said = _said_in_headers(sequences)
    if said["space"] is not None:
        yield ok(_in_words(said, photographs=is_of_photographs(folder)))
    if kind == "results folder":
        yield from _results_go_together(sequences)
    if (folder / "timing.json").is_file():
        yield from _plates_are_there(folder)


SLOWEST = Fraction(1, 2)
"""Results a second below which they are no film, but photographs: their rate says nothing."""


def _in_words(said: dict[str, Fact], *, photographs: bool) -> str:
    """Say in which frame and colours results are, and how fast they go, where they are of no photographs."""
    direction = {"up": "y up (OpenGL)", "down": "y down (DirectX)"}.get(str(said["y"]), "y is not said")
    parts = [f"normals in {said['space']} space, {direction}"]
    if said["colour"] is not None:
        parts.append(f"albedo in {said['colour']}, linear")
    if said["fps"] is not None and not photographs and Fraction(str(said["fps"])) >= SLOWEST:
        parts.append(f"{float(Fraction(str(said['fps']))):.6g} results a second")
    if said["time_code"] is not None:
        parts.append(f"from time code {said['time_code']}")
    return "; ".join(parts)


def _results_go_together(sequences: dict[str, list[Path]]) -> Iterator[Finding]:
    numbers = {name: {number_of(file) for file in files} for name, files in sequences.items()}
    for name in ALWAYS:
        if name not in numbers:
            yield warn(f"there is no {name}/ beside normals/")
        elif numbers[name] != numbers["normals"]:
            differ = len(numbers[name] ^ numbers["normals"])
            yield fault(
                f"{name}/ and normals/ do not hold the same numbers ({differ} differ): "
                "the run was stopped; run it again with `resume`"
            )


def _plates_are_there(folder: Path) -> Iterator[Finding]:
    """Check that every plate that the timing lists is a file that can be opened."""
    plates = [flash.plate for flash in read_timing(folder / "timing.json").flashes if flash.plate]
    missing = [plate for plate in plates if not (folder / plate).is_file()]
    if missing:
        yield fault(f"timing.json lists {missing[0]} and {counted(len(missing) - 1, 'more plate')} that are not here")
    elif plates:
        yield ok(f"all {len(plates)} plates that timing.json lists are here")
    for plate in plates:
        try:
            if plate not in missing:
                exr.contents(folder / plate)
        except PsvideoError as error:
            yield fault(error)
