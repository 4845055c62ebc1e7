"""What a piece of a run found, noted beside its files until all pieces are done: one .npz file for each."""

import json
import zipfile
from array import array
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from psvideo.errors import PsvideoError
from psvideo.formats.timing_json import format_timing, parse_timing
from psvideo.formats.whole_files import whole_file, write_text
from psvideo.model.surface import Metal, Reflectance, RivalLobes, Subject
from psvideo.model.timing import Timing
from psvideo.report.observe.close_looks import CloseLooks
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigpoints import PointLight
from psvideo.report.observe.worst import Thumbnail, Worst
from psvideo.runs.instants.job import Found

FOLDER = ".pieces"
"""In the folder that a run writes, until it is whole."""
TIMING, SUBJECT = "timing.json", "subject.json"
BESIDE_TIMING = ("row_time_error_s", "phase_error_s", "notes")
"""What a timing's own file does not hold."""
FACTS = TypeAdapter(tuple[InstantFacts, ...])
CLOSE_LOOKS = TypeAdapter(CloseLooks)


def write_notes(folder: Path, numbers: range, found: Found) -> None:
    """Note what a range of instants gave; its files are whole by then."""
    seen = found.observed
    record = {
        "numbers": [numbers.start, numbers.stop],
        "first": seen.first,
        "facts": [asdict(one) for one in seen.facts],
        "counts": {light: counted.tolist() for light, counted in seen.counts.items()},
        "closely": asdict(seen.closely),
        "ambient_measured": list(seen.ambient_measured.items()),
        "beyond_mask": seen.beyond_mask.tolist(),
        "dark_evenness": seen.dark_evenness.tolist(),
        "worst": [{"number": one.number, "badness": one.badness, "why": one.why} for one in seen.thumbnails],
        "reserved": found.reserved,
        "scale": found.scale,
    }
    arrays: dict[str, NDArray[Any]] = {f"light{n}": one.light for n, one in enumerate(seen.light_at_points)}
    arrays |= {f"white{n}": one.white for n, one in enumerate(seen.light_at_points)}
    arrays |= {f"normals{n}": one.normals for n, one in enumerate(seen.thumbnails)}
    arrays |= {f"valid{n}": one.valid for n, one in enumerate(seen.thumbnails)}
    if found.picture is not None:
        arrays["picture"] = found.picture
    arrays["record"] = np.frombuffer(json.dumps(record).encode(), np.uint8)
    with whole_file(folder / FOLDER / f"{numbers.start}-{numbers.stop}.npz") as beside, beside.open("wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]


def note_timing(folder: Path, timing: Timing) -> None:
    """Note the timing that all pieces use, with what timing.json does not hold; what a piece noted before stays."""
    path = folder / FOLDER / TIMING
    if not path.is_file():
        beside = {name: getattr(timing, name) for name in BESIDE_TIMING}
        write_text(path, json.dumps({"timing": format_timing(timing), **beside}))


def noted_timing(folder: Path) -> Timing | None:
    """Return the timing that pieces noted, None where none did. Raises PsvideoError where its file is damaged."""
    path = folder / FOLDER / TIMING
    if not path.is_file():
        return None
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        timing = parse_timing(json.loads(record["timing"]), source=str(path))
        return replace(timing, **{name: record[name] for name in BESIDE_TIMING[:2]}, notes=tuple(record["notes"]))
    except (OSError, ValueError, KeyError, TypeError) as fault:
        raise PsvideoError(f"{path}: cannot be read ({fault}). {_ADVICE}") from fault


def note_subject(folder: Path, subject: Subject) -> None:
    """Note what all pieces take the subject for; what a piece noted before stays."""
    path = folder / FOLDER / SUBJECT
    if not path.is_file():
        write_text(path, json.dumps({"reflectance": subject.reflectance, "metal": subject.metal}))


def noted_subject(folder: Path) -> Subject | None:
    """Return the subject that pieces noted, None where none did. Raises PsvideoError where its file is damaged."""
    path = folder / FOLDER / SUBJECT
    if not path.is_file():
        return None
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        known, metal = record["reflectance"], record["metal"]
        return Subject(
            reflectance=None if known is None else Reflectance(*map(float, known)),
            metal=None if metal is None else _metal(*metal),
        )
    except (OSError, ValueError, KeyError, TypeError) as fault:
        raise PsvideoError(f"{path}: cannot be read ({fault}). {_ADVICE}") from fault


def _metal(shown: list[float], rivals: list[tuple[list[float], float]]) -> Metal:
    every = (RivalLobes(tuple(map(float, lobes)), float(likely)) for lobes, likely in rivals)
    return Metal(tuple(map(float, shown)), tuple(every))


def noted(folder: Path) -> Iterator[tuple[range, Found]]:
    """Give what pieces found, in the order of their first instants; pieces that were cut in two ways overlap.

    Raises PsvideoError where a file is damaged.
    """
    for path in sorted((folder / FOLDER).glob("[!.]*.npz"), key=lambda one: [int(n) for n in one.stem.split("-")]):
        try:
            yield _read(path)
        except (OSError, ValueError, KeyError, TypeError, ValidationError, zipfile.BadZipFile) as fault:
            raise PsvideoError(f"{path}: cannot be read ({fault}). {_ADVICE}") from fault


def _read(path: Path) -> tuple[range, Found]:
    with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
        record = json.loads(arrays["record"].tobytes())
        lights = [name for name in arrays.files if name.startswith("light")]
        observed = Observed(
            lights=tuple(record["counts"]),
            first=record["first"],
            facts=KeptFacts(FACTS.validate_python(record["facts"])),
            counts={light: np.array(counted, np.int64) for light, counted in record["counts"].items()},
            closely=CLOSE_LOOKS.validate_python(record["closely"]),
            light_at_points=[PointLight(arrays[f"light{n}"], arrays[f"white{n}"]) for n in range(len(lights))],
            ambient_measured={int(begins): share for begins, share in record["ambient_measured"]},
            beyond_mask=array("d", record["beyond_mask"]),
            dark_evenness=array("d", record["dark_evenness"]),
            worst=Worst(
                Thumbnail(**one, normals=arrays[f"normals{n}"], valid=arrays[f"valid{n}"])
                for n, one in enumerate(record["worst"])
            ),
        )
        picture = arrays["picture"] if "picture" in arrays.files else None
    found = Found(observed=observed, picture=picture, reserved=tuple(record["reserved"]), scale=record["scale"])
    return range(*record["numbers"]), found


_ADVICE = "Remove it, then run the command with `resume` again: what it held is found once more."
