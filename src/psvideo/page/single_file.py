"""The page as one file that opens by itself, without psvideo or a network: its scripts, its style and some pictures.

Pictures are blocks as the server gives them, but with the bytes of their numbers apart (all first bytes, then all
second ones), which deflates better, deflated and written as base64.
"""

import base64
import hashlib
import json
import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from psvideo.errors import PsvideoError
from psvideo.formats.whole_files import check_ending, refuse_existing, whole_file
from psvideo.model.units import counted
from psvideo.page.assembled import assets
from psvideo.page.picture import Look, missing_block, picture_block
from psvideo.page.show import Show, ShownSequence, index_of

if TYPE_CHECKING:
    from psvideo.compute.progress import Watch

MARK = "psvideo-page/1"


@dataclass(frozen=True, kw_only=True)
class PageContents:
    """What a page that was written holds."""

    pictures: int
    missing: int
    width_px: int
    total_bytes: int

    @property
    def record(self) -> dict[str, int]:
        """The same for machines."""
        return {
            "pictures": self.pictures,
            "missing": self.missing,
            "width_px": self.width_px,
            "bytes": self.total_bytes,
        }

    @property
    def words(self) -> str:
        """The same for people."""
        missing = f", of which {self.missing} could not be read" if self.missing else ""
        size = f"{self.total_bytes / 1e6:.1f} MB"
        pictures = counted(self.pictures, "picture")
        return f"{pictures} {self.width_px} pixels wide{missing}, {size}. It opens in any browser."


def write_single_page(
    show: Show, path: Path, *, width_px: int, count: int, force: bool = False, watch: "Watch | None" = None
) -> PageContents:
    """Write a page that holds up to ``count`` pictures of each sequence, spread over it, at most ``width_px`` wide.

    Frames of a clip and comparisons stay out beside results or plates: they are not numbered alike, or cost minutes.
    Raises UsageError where the file exists and ``force`` is not given.
    """
    refuse_existing(path, force=force, mark=MARK)
    check_ending(path, ".html", ".htm", "", name="export")
    part = _part(show, width_px, count)
    wanted = [(sequence, number) for sequence in part.sequences for number in sequence.numbers]
    blocks: dict[str, str] = {}
    missing = 0
    watched = wanted if watch is None else watch(wanted, total=len(wanted), what="packing pictures", unit="pictures")
    for sequence, number in watched:
        packed, is_missing = _packed(sequence, number, part.width_px)
        blocks[f"{sequence.id}/{number}"] = packed
        missing += is_missing
    text = "".join(_page(part, blocks)).encode()
    with whole_file(path) as beside:
        beside.write_bytes(text)
    return PageContents(pictures=len(wanted), missing=missing, width_px=part.width_px, total_bytes=len(text))


def _part(show: Show, width_px: int, count: int) -> Show:
    """Return the part of a show that goes into the file, at the rate at which its pictures follow each other."""
    master = show.sequences[0]
    chosen = _spread(master.numbers, count)
    times_s = [time_s for number, time_s in zip(master.numbers, master.times_s, strict=True) if number in chosen]
    sequences = [
        _only(sequence, chosen if sequence.timeline == master.timeline else _nearest(sequence, times_s))
        for sequence in show.sequences
        if (sequence.timeline == master.timeline or sequence.timeline.endswith(".rounds")) and not sequence.slow
    ]
    width = min(width_px, show.width_px)
    fps = show.fps * max(len(chosen) - 1, 1) / max(len(master.numbers) - 1, 1)
    height = max(round(show.height_px * width / show.width_px), 1)
    return replace(
        show,
        sequences=tuple(sequences),
        fps=fps if len(chosen) > 1 else show.fps,
        width_px=width,
        height_px=height,
        notes=(),
        report=None,
        thinned=len(chosen) < len(master.numbers),
    )


def _spread(numbers: Sequence[int], count: int) -> frozenset[int]:
    places = np.linspace(0, len(numbers) - 1, min(count, len(numbers))).round().astype(int)
    return frozenset(numbers[place] for place in places)


def _nearest(sequence: ShownSequence, times_s: Sequence[float]) -> frozenset[int]:
    """Return the numbers of a sequence's pictures that are nearest to some instants."""
    own = np.array(sequence.times_s)
    return frozenset(sequence.numbers[int(np.abs(own - time_s).argmin())] for time_s in times_s)


def _only(sequence: ShownSequence, chosen: frozenset[int]) -> ShownSequence:
    kept = [
        (number, time_s) for number, time_s in zip(sequence.numbers, sequence.times_s, strict=True) if number in chosen
    ]
    return replace(sequence, numbers=tuple(one for one, _ in kept), times_s=tuple(time_s for _, time_s in kept))


def _packed(sequence: ShownSequence, number: int, width_px: int) -> tuple[str, bool]:
    """Return a picture's block as text, and whether it could not be read."""
    try:
        picture = sequence.read(number, Look(width_px=width_px))
    except PsvideoError:  # its words name folders of this machine, and the page goes to others
        return _text(missing_block(f"{sequence.label} {number} could not be read when this page was written.")), True
    whole = picture_block(picture)
    (length,) = struct.unpack("<I", whole[4:8])
    pixels = np.frombuffer(whole, np.uint8, offset=8 + length).reshape(-1, picture.pixels.dtype.itemsize)
    return _text(whole[: 8 + length] + pixels.T.tobytes()), False


def _text(packed: bytes) -> str:
    return base64.b64encode(zlib.compress(packed, 6)).decode("ascii")


def _page(show: Show, blocks: Mapping[str, str]) -> Iterator[str]:
    """Yield the file's text piece by piece."""
    own = {name: content.decode() for name, content in assets().items()}
    script, style = own["main.js"], own["style.css"]
    policy = (
        f"default-src 'none'; script-src 'sha256-{_digest(script)}'; style-src 'sha256-{_digest(style)}'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    page = own["index.html"].replace('<link rel="stylesheet" href="style.css">', f"<style>{style}</style>")
    page = page.replace('<script type="module" src="main.js"></script>\n', "")
    head, body = page.split("</head>", maxsplit=1)
    yield head.replace('<meta charset="utf-8">', f'<!-- {MARK} -->\n<meta charset="utf-8">', 1).replace(
        "<title>", f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n<title>', 1
    )
    yield "</head>"
    before, after = body.split("</body>", maxsplit=1)
    yield before
    yield _data("index", index_of(show))
    if show.timing is not None:
        yield _data("timing-record", _timing(show))
    for key, packed in blocks.items():
        yield f'<script type="application/octet-stream" id="block-{key}">{packed}</script>\n'
    yield f'<script type="module">{script}</script>\n</body>'
    yield after


def _timing(show: Show) -> object:
    try:
        return {} if show.timing is None else dict(show.timing())
    except PsvideoError as fault:
        return {"missing": str(fault)}


def _data(name: str, record: object) -> str:
    text = json.dumps(record).replace("<", "\\u003c")
    return f'<script type="application/json" id="{name}">{text}</script>\n'


def _digest(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
