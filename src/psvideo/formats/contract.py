"""TOML and JSON files under contract: strict, versioned, and with every mistake named at once.

A file that breaks its contract gets one paragraph that names file, key, what was found and what was expected; an
unknown key is answered with the nearest known one.
"""

import contextlib
import json
import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from psvideo.errors import PsvideoError
from psvideo.formats.contract_mistakes import mistakes_in_words
from psvideo.formats.paths import check_file
from psvideo.formats.separators import toml_separators


class Contract(BaseModel):
    """Base of the file models: no unknown keys, no silent conversion of text to numbers."""

    model_config = ConfigDict(extra="forbid", strict=True, populate_by_name=True, allow_inf_nan=False)


TAKEN_NAMES = ("ambient", "flashes")
UNFIT_FOR_FILES = set('/\\:*?"<>|')


def check_light_name(name: str) -> str:
    """Return a light's name; raises ValueError where it cannot name folders and files, which it does for plates."""
    unfit = any(letter in UNFIT_FOR_FILES or ord(letter) < 32 for letter in name)
    if not name or unfit or name[0] in ". " or name[-1] in ". " or name.lower() in TAKEN_NAMES:
        raise ValueError(
            f"{name!r} cannot be a light's name, because it names folders and files: expected letters, digits, - or _, "
            f"and not {' or '.join(TAKEN_NAMES)}"
        )
    return name


Model = TypeVar("Model", bound=Contract)
SHOWS_KIND = 4096
"""Letters of a file among which its schema stands: first, or behind a comment or two."""
MOST_BYTES = 1 << 28
"""The longest text that is read: the timing of a take of hours has a quarter of it."""


def read_toml(path: Path, model: type[Model], schema: str) -> Model:
    """Read a TOML file whose ``schema`` key is e.g. ``psvideo-plan/1``. Raises PsvideoError for every kind of fault."""
    return parse_toml(read_text(path, kind=schema), model, schema, source=str(path))


def read_text(path: Path, *, kind: str = "") -> str:
    """Read a small text file; raises PsvideoError where it is missing or no text. ``kind`` is a word that files of the
    wanted kind begin with: where a folder is named, the files in it that hold it are."""
    if path.is_dir():
        raise PsvideoError(f"{path}: is a folder, and a file is expected. {_named_inside(path, kind)}")
    try:
        check_file(path)
        if path.stat().st_size > MOST_BYTES:
            raise PsvideoError(f"{path}: is too large for a text that psvideo reads. Name the file that is meant.")
        return path.read_text(encoding="utf-8-sig")  # without the mark that Windows puts first
    except FileNotFoundError:
        raise PsvideoError(f"{path}: there is no such file. Check the name, or write the file first.") from None
    except UnicodeDecodeError as fault:
        data = path.read_bytes()
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            raise PsvideoError(f"{path}: is text in UTF-16. Save it as UTF-8.") from None
        if not any(byte < 32 and byte not in b"\t\n\f\r" for byte in data):  # accents as old programs write them
            letter = data[fault.start : fault.start + 1].decode("cp1252", errors="replace")
            raise PsvideoError(
                f"{path}: is text, but not in UTF-8 (byte {fault.start} may be a {letter!r} as Windows writes it). "
                "Save it as UTF-8."
            ) from None
        raise PsvideoError(f"{path}: is not text (byte {fault.start} is not UTF-8). Name another file.") from None
    except OSError as fault:
        raise PsvideoError(f"{path}: cannot be read as text ({fault}). Check the file and its permissions.") from fault


def _named_inside(folder: Path, kind: str) -> str:
    """Return the advice to name one of a folder's text files: of the wanted kind where there is one, else of any."""
    inside = sorted(found for found in folder.glob("*.toml") if found.is_file())
    fit = [found for found in inside if kind and kind in _beginning(found)]
    return f"Name the file in it: {' or '.join(map(str, fit or inside))}." if inside else "Name a file."


def _beginning(path: Path) -> str:
    with contextlib.suppress(OSError), path.open(encoding="utf-8-sig", errors="replace") as file:
        return file.read(SHOWS_KIND)
    return ""


def read_json(path: Path, *, advice: str) -> dict[str, Any]:
    """Read a JSON file that holds an object. Raises PsvideoError that ends with ``advice`` where it does not."""
    text = read_text(path)
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as fault:  # nested without end, numbers of thousands of digits
        raise PsvideoError(f"{path}: not a JSON object ({fault}). {advice}") from fault
    if not isinstance(data, dict):
        raise PsvideoError(f"{path}: not a JSON object but {type(data).__name__}. {advice}")
    return data


def parse_toml(text: str, model: type[Model], schema: str, *, source: str) -> Model:
    """Check TOML text against its model. ``source`` is the name that messages give it."""
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as fault:  # TOMLDecodeError; numbers or tables without end
        advice = toml_separators(text) or "Mend that line (TOML 1.0)."
        raise PsvideoError(f"{source}: not a TOML file: {fault}. {advice}") from fault
    return parse_record(data, model, schema, source=source)


def parse_record(data: dict[str, Any], model: type[Model], schema: str, *, source: str, advice: str = "") -> Model:
    """Check what a TOML or JSON file holds against its model. ``source`` is the name that messages give it; ``advice``:
    a sentence on what to do, after them."""
    check_schema(data.get("schema"), schema, source=source)
    try:
        return model.model_validate(data)
    except ValidationError as fault:
        raise PsvideoError(f"{mistakes_in_words(source, model, fault)} {advice}".rstrip()) from None


def check_schema(found: object, expected: str, *, source: str) -> None:
    """Refuse a file of another kind or of a newer major version (``name/major``)."""
    kind, major = expected.split("/")
    if found is None:
        raise PsvideoError(
            f"{source}: key 'schema' is missing; expected schema = \"{expected}\" as the file's first line."
        )
    name, _, version = str(found).partition("/")
    if name != kind:
        raise PsvideoError(f"{source}: schema is {found!r}, expected {expected!r}. This is another kind of file.")
    if not version.isdecimal() or int(version) != int(major):
        raise PsvideoError(
            f"{source}: schema is {found!r}; this psvideo reads {expected!r}. "
            "A newer file needs a newer psvideo: upgrade, or write the file again with this version."
        )
