"""Where to solve: one mask for all results, or one per result from a sequence."""

import hashlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from psvideo.clip.folder import KINDS, find_sequence
from psvideo.clip.maps.mask import read_mask, read_one_of_many
from psvideo.clip.record import holes
from psvideo.compute.threads import in_order
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Mask

PLACEHOLDER = re.compile(r"%0?\d*d|#+|@+|\*")
"""What stands for the number in a pattern of file names: mask.%04d.png, mask.####.png, mask.*.png."""


@dataclass(frozen=True, kw_only=True)
class Masks:
    """Masks of a run: a ``still``, (row, col) bool, True where to solve, or ``files`` by the number of their result.

    ``black`` are the numbers of those that leave nothing to solve.
    """

    path: Path | None = None
    still: Mask | None = None
    files: Mapping[int, Path] = field(default_factory=dict)
    black: tuple[int, ...] = ()
    sha256: str = ""

    def at(self, number: int) -> Mask:
        """Return the mask of the result with this number; raises PsvideoError where there is none."""
        if self.still is not None:
            return self.still
        self.check([number])
        return read_one_of_many(self.files[number])

    def check(self, numbers: Iterable[int]) -> None:
        """Raise PsvideoError where the result with any of these numbers has no mask."""
        lacking = [number for number in numbers if number not in self.files] if self.still is None else []
        if lacking:
            raise PsvideoError(
                f"{self.path}: has no mask for result {lacking[0]}; its files are numbered {min(self.files)} to "
                f"{max(self.files)}. Expected one per result, numbered as the results are (see `start_number`): paint "
                "them over plates or normals of an earlier run, or give one mask that holds for all."
            )


def open_masks(path: Path, *, width_px: int, height_px: int) -> Masks:
    """Return the mask in a picture, or those of a folder or of a numbered pattern; all are read and checked.

    Of a sequence some may be black: nothing is solved there, as where the subject has left the picture. Raises
    PsvideoError where one cannot be read or has another size than the frames, where numbers are missing between them,
    and where all are black everywhere.
    """
    files = _files(path)
    if files is None:
        mask = read_mask(path, width_px=width_px, height_px=height_px)
        return Masks(path=path, still=mask, sha256=hashlib.sha256(mask.tobytes()).hexdigest())
    missing = holes(sorted(files))
    if missing:
        before, count = missing[0]
        raise PsvideoError(
            f"{path}: the masks have a hole: after number {before}, {count} of them "
            f"{'is' if count == 1 else 'are'} missing. Expected one mask per result, without gaps, or one that holds "
            "for all; paint what is missing, or copy the mask before."
        )
    digest = hashlib.sha256()
    jobs = (partial(read_one_of_many, file, width_px=width_px, height_px=height_px) for file in files.values())
    black = []
    for number, mask in zip(files, in_order(jobs, ahead=4, name="masks"), strict=True):
        digest.update(mask.tobytes())
        if not mask.any():
            black.append(number)
    if len(black) == len(files):
        read_mask(files[black[0]])  # says what is wrong with the first
    return Masks(path=path, files=files, black=tuple(black), sha256=digest.hexdigest())


def _files(path: Path) -> dict[int, Path] | None:
    """Return the masks of a sequence by number, None where the path is that of one picture."""
    if path.is_dir():
        sequence = find_sequence(path)
        return dict(zip(sequence.numbers, sequence.files, strict=True))
    placeholder = PLACEHOLDER.search(path.name)
    if placeholder is None or path.is_file():
        return None
    before, after = (re.escape(part) for part in (path.name[: placeholder.start()], path.name[placeholder.end() :]))
    pattern = re.compile(f"{before}([0-9]+){after}")
    found: dict[int, Path] = {}
    for file in _pictures(path.parent):
        if match := pattern.fullmatch(file.name):
            other = found.setdefault(int(match[1]), file)
            if other != file:
                raise PsvideoError(
                    f"{path}: {other.name} and {file.name} have one number. Expected one mask per result: remove one."
                )
    if not found:
        raise PsvideoError(
            f"{path}: no file is named like this. Expected numbered masks, such as mask.####.png for mask.1001.png and "
            "those after it."
        )
    return dict(sorted(found.items()))


def _pictures(folder: Path) -> list[Path]:
    if not folder.is_dir():
        raise PsvideoError(f"{folder}: there is no such folder of masks. Check the name.")
    return sorted(file for file in folder.iterdir() if file.suffix.lower() in KINDS)
