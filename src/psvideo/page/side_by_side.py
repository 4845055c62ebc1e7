"""Several results on one page: the first as it is, the others' sequences beside its own, by number or by time."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from psvideo.errors import UsageError
from psvideo.page.show import Show, ShownSequence

SAME_SHAPE = 0.01
"""Two pictures' aspects may differ by this share: results are made at other sizes, and sizes are whole numbers."""


def side_by_side(shows: Sequence[Show], paths: Sequence[Path]) -> Show:
    """Return what several folders of results have to show, each sequence in a group of its folder's name.

    The others' ids begin with ``r2.``, ``r3.`` and so on; where their instants are numbered otherwise, they are put
    beside the first one's by time. Raises UsageError where a folder holds no results, or pictures of another shape.
    """
    first = shows[0]
    if len(shows) == 1:
        return first
    names = _names(paths)
    sequences = list(_named(first, names[0], ""))
    for place, (show, path) in enumerate(zip(shows, paths, strict=True)):
        _check(show, path, first, paths[0])
        if place:
            sequences += _named(show, names[place], f"r{place + 1}.", beside=first)
    findings = [f"{name}: {words}" for name, show in zip(names, shows, strict=True) for words in show.findings]
    return replace(first, name=" | ".join(names), sequences=tuple(sequences), findings=tuple(findings))


def _check(show: Show, path: Path, first: Show, first_path: Path) -> None:
    if show.kind != "results":
        raise UsageError(f"{path}: holds no results (normals). Only these are put side by side: name other folders.")
    shapes = [one.height_px / max(one.width_px, 1) for one in (show, first)]
    if abs(shapes[0] / shapes[1] - 1) > SAME_SHAPE:
        raise UsageError(
            f"{path}: its pictures are {show.width_px} x {show.height_px} pixels, and those of {first_path} "
            f"{first.width_px} x {first.height_px}: they have another shape. Look at them one after the other."
        )


def _named(show: Show, name: str, before: str, *, beside: Show | None = None) -> list[ShownSequence]:
    """Return a show's sequences under other ids; of all but the first show without its clip."""
    own = [one for one in show.sequences if beside is None or one.group == "Results"]
    alike = beside is None or own[0].numbers == beside.sequences[0].numbers
    return [
        replace(
            one,
            id=before + one.id,
            group=name if one.group == "Results" else one.group,
            timeline=one.timeline if alike else f"{before}{one.timeline}",
            family=one.family or one.id,
        )
        for one in own
    ]


def _names(paths: Sequence[Path]) -> list[str]:
    """Return the folders' names, with their parents' where two are called alike."""
    names = [path.resolve().name for path in paths]
    counts = Counter(names)
    return [
        name if counts[name] == 1 else f"{path.resolve().parent.name}/{name}"
        for name, path in zip(names, paths, strict=True)
    ]
