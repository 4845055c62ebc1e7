"""The versions in constraints.txt install on every Python that pyproject.toml allows, its first releases too."""

import re
from importlib.metadata import distributions
from pathlib import Path

from packaging.specifiers import SpecifierSet

ROOT = Path(__file__).resolve().parents[1]
PYTHONS = ("3.11.0", "3.12.0", "3.13.0")


def pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    named = (line.split("==") for line in lines if "==" in line)
    return {letters(name): version for name, version in named}


def letters(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def test_what_is_pinned_and_installed_runs_on_the_first_release_of_every_python() -> None:
    wanted = {
        found.name: found.metadata["Requires-Python"]
        for found in distributions()
        if pins().get(letters(found.name)) == found.version and "Requires-Python" in found.metadata
    }
    refusing = {name: said for name, said in wanted.items() if not all(map(SpecifierSet(said).contains, PYTHONS))}
    assert len(wanted) > 30
    assert refusing == {}
