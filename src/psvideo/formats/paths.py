"""Paths that somebody hands over: text or ``pathlib.Path``, checked before anything is opened."""

from pathlib import Path

from psvideo.errors import check_kind


def path_of(name: str, given: Path | str) -> Path:
    """Return a parameter as a path; raises UsageError where it is neither text nor a path.

    >>> path_of("rig", "lights/rig.toml").name
    'rig.toml'
    """
    check_kind(name, given, (str, Path), "a path, as text or pathlib.Path")
    return Path(given)


def path_if_given(name: str, given: Path | str | None) -> Path | None:
    """Return a parameter that may be left out as a path; raises as ``path_of``."""
    return None if given is None else path_of(name, given)
