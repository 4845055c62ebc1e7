"""What the page can show: sequences of pictures, each picture with its place in time, and what is known of them.

``index_of`` is what the browser gets. It names sequences by an id and pictures by their number, never by a path.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from psvideo.model.quantities import Shown
from psvideo.page.picture import Look, PagePicture

Reader = Callable[[int, Look], PagePicture]
"""Gives the picture of a number as it is to be looked at. Raises PsvideoError where it cannot be read."""


@dataclass(frozen=True, kw_only=True)
class ShownSequence:
    """Pictures of one quantity. ``times_s`` are the instants that the pictures show, on the camera's clock.

    Sequences of one ``timeline`` ("rounds", "frames"; of another result "r2.rounds") share their numbers; those of
    another are put beside them by time. ``slow``: pictures are computed when they are asked for, so none is made ahead.
    ``kind``, ``unit``, ``from_zero`` and ``hatched`` are those of the table of quantities. ``family``: what is shown at
    one exposure or in one range, to be compared; left out, the sequence by itself.
    """

    id: str
    label: str
    kind: Shown
    group: str
    timeline: str
    numbers: tuple[int, ...]
    times_s: tuple[float, ...]
    read: Reader
    unit: str = ""
    from_zero: bool = True
    hatched: bool = False
    y: str = "up"
    space: str = "camera"
    slow: bool = False
    family: str = ""


@dataclass(frozen=True, kw_only=True)
class Show:
    """Everything that the page can show of one folder. The first sequence's timeline is the one that is scrubbed.

    ``fps`` is 0 where no rate is known: pictures are counted then, and have no time.
    """

    name: str
    kind: Literal["results", "plates", "clip"]
    fps: float
    width_px: int
    height_px: int
    sequences: tuple[ShownSequence, ...]
    verdict: str = ""
    findings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    thinned: bool = False
    """Whether pictures were left out on purpose, so that holes in the numbers mean nothing."""
    report: Path | None = None
    """The page that says what was found; None where there is none."""
    timing: Callable[[], Mapping[str, object]] | None = None
    """Gives what the diagram of flashes is drawn from; None where nothing is known of them."""

    def sequence(self, name: str) -> ShownSequence | None:
        """Return the sequence with this id."""
        return next((sequence for sequence in self.sequences if sequence.id == name), None)


def index_of(show: Show) -> dict[str, object]:
    """Return what the browser gets to know of a show, as JSON's types."""
    return {
        "schema": "psvideo-page/1",
        "name": show.name,
        "kind": show.kind,
        "fps": show.fps,
        "width_px": show.width_px,
        "height_px": show.height_px,
        "verdict": show.verdict,
        "findings": list(show.findings),
        "notes": list(show.notes),
        "facts": dict(show.facts),
        "timing": show.timing is not None,
        "report": show.report is not None,
        "thinned": show.thinned,
        "sequences": [_entry(sequence) for sequence in show.sequences],
    }


def _entry(sequence: ShownSequence) -> dict[str, object]:
    return {
        "id": sequence.id,
        "label": sequence.label,
        "kind": sequence.kind,
        "group": sequence.group,
        "timeline": sequence.timeline,
        "numbers": list(sequence.numbers),
        "times_s": [round(time_s, 7) for time_s in sequence.times_s],
        "unit": sequence.unit,
        "from_zero": sequence.from_zero,
        "hatched": sequence.hatched,
        "y": sequence.y,
        "space": sequence.space,
        "slow": sequence.slow,
        "family": sequence.family or sequence.id,
    }
