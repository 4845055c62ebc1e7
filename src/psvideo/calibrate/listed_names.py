"""Which picture a name of a list means: by the whole name, by numbers less zeros before them, or by its beginning."""

import re
import unicodedata
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from psvideo.calibrate.still_names import bears, meant_by
from psvideo.formats.light_lists.picture_names import without_ending


def pictures_meant(names: Sequence[str], files: Sequence[Path]) -> list[list[Path]]:
    """Return for every name of a list the files that it may mean: in the first way in which each means one, else in the
    first in which every file is meant once, else what their whole names say."""
    stems = [stem_of(name) for name in names]
    ways = (partial(_by_whole_name, stems=stems), _by_number, _by_beginning)
    found = [[way(stem, files) for stem in stems] for way in ways]
    exact = (one for one in found if all(len(each) == 1 for each in one))
    fewer = (one for one in found if all_found(one, files))
    return next(exact, None) or next(fewer, found[0])


def all_found(matches: Sequence[Sequence[Path]], files: Sequence[Path]) -> bool:
    """Return whether every picture is meant by one name, and no name means several: only lights are left over."""
    return sorted(file for one in matches for file in one) == sorted(files) and all(len(one) < 2 for one in matches)


def stem_of(name: str) -> str:
    """Return a name of a list, a path perhaps, as the stem that its picture should have."""
    return without_ending(re.split(r"[\\/]", name.strip())[-1])


def _alike(stem: str) -> str:
    """Return a stem in which letters that look the same are the same: a Mac writes accents as letters of their own."""
    return unicodedata.normalize("NFC", stem).casefold()


def _by_whole_name(stem: str, files: Sequence[Path], *, stems: Sequence[str]) -> list[Path]:
    """Return the files of a name, or those whose name ends with it, as with a light's, and with no longer one of the
    list's ``stems``."""
    exact = [file for file in files if _alike(file.stem) == _alike(stem) or _alike(file.name) == _alike(stem)]
    return exact or [file for file in files if bears(file, stem) and meant_by(file, stems) == stem]


def _by_number(stem: str, files: Sequence[Path]) -> list[Path]:
    """Return the files of a name where zeros before numbers do not count: ``img1`` and ``img01``."""
    return [file for file in files if _unpadded(file.stem) == _unpadded(stem)]


def _unpadded(stem: str) -> str:
    return re.sub(r"(?<!\d)0+(?=\d)", "", _alike(stem))


def _by_beginning(stem: str, files: Sequence[Path]) -> list[Path]:
    """Return the files whose name goes on after the list's, or ends before it: what was exported gets a word more."""
    mine = _alike(stem)
    return [file for file in files if _goes_on(_alike(file.stem), mine) or _goes_on(mine, _alike(file.stem))]


def _goes_on(longer: str, shorter: str) -> bool:
    return longer.startswith(shorter) and not longer[len(shorter) :][:1].isalnum()
