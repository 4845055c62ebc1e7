"""Whether two runs left the same bytes: the checksum of every file in a folder."""

import hashlib
from pathlib import Path

PER_RUN = ("report.json", "report.html")
"""They hold when a run was made and by which command, and with it the output's name and --resume."""

Digest = dict[str, str]
"""Checksums by the files' paths in their folder."""


def digest(out: Path, *, but: tuple[str, ...] = ()) -> Digest:
    """Return the checksum of every file in a folder, or of a single file, but of those with some names."""
    files = [path for path in sorted(out.rglob("*")) if path.is_file() and path.name not in but]
    assert files or out.is_file(), f"{out} holds no files to compare"
    return {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files or [out]}


def digest_of_results(out: Path) -> Digest:
    """Return the same of what a run found, without the files that differ from run to run."""
    return digest(out, but=PER_RUN)
