"""What a timing diagram shows, in seconds and rows: frames as parallelograms, flashes as bands, and who saw what.

Made from the plan alone, for a given start phase; nothing here knows pixels of a picture.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.camera import Camera
from psvideo.model.cost.shoot_figures import slot_label
from psvideo.model.plan import Plan

FEWEST_FRAMES, MOST_FRAMES = 4, 7
DARK_ROW_SHARE = 0.05
"""A gap between two flashes that is wider than this share of the rows is a dark area, no dark row."""


@dataclass(frozen=True, kw_only=True)
class Span:
    """Rows ``from_row`` to ``to_row`` of a frame that saw a share of a flash: ``from_share`` fading to ``to_share``."""

    flash: int
    from_row: float
    to_row: float
    from_share: float
    to_share: float


@dataclass(frozen=True, kw_only=True)
class FrameSpans:
    """One frame: when its top edge and its bottom edge open, what its rows saw, and where its dark row lies."""

    index: int
    top_s: float
    bottom_s: float
    spans: tuple[Span, ...]
    dark_rows: tuple[float, ...]

    def opens_s(self, row: float, rows: int) -> float:
        """Return when a row opens; it closes an exposure later."""
        return self.top_s + (self.bottom_s - self.top_s) * row / rows


@dataclass(frozen=True, kw_only=True)
class FlashSpan:
    """One flash on the camera's clock; ``place`` numbers the kinds of flash, for colours; dark slots are -1."""

    label: str
    start_s: float
    end_s: float
    place: int


@dataclass(frozen=True, kw_only=True)
class Timeline:
    """Everything that the diagram shows, from ``start_s`` to ``end_s``."""

    camera: Camera
    start_s: float
    end_s: float
    frames: tuple[FrameSpans, ...]
    flashes: tuple[FlashSpan, ...]
    kinds: tuple[str, ...]


def timeline(plan: Plan, *, phase_s: float | None = None, frames: int | None = None) -> Timeline:
    """Return what the first frames of a shoot see if flash 0 of a cycle starts ``phase_s`` after frame 0 begins.

    ``phase_s`` None is 0, and for a triggered (synced) plan the middle of the time in which all rows are open.
    ``frames`` None shows about one round. An unknown readout is drawn as long as the frame.
    """
    camera = plan.camera
    if camera.readout_s is None:
        camera = replace(camera, readout_s=camera.frame_period_s)
    readout_s = abs(camera.readout_s or 0.0)
    count = frames or min(max(_frames_of_a_round(plan) + 1, FEWEST_FRAMES), MOST_FRAMES)
    end_s = (count - 1) * camera.frame_period_s + readout_s + camera.exposure_s
    if phase_s is None:
        first_s = plan.flashes[plan.cycle_slots[0]].duration_s
        phase_s = (readout_s + camera.exposure_s - first_s) / 2 if plan.mode == "synced" else 0.0
    flashes = _flashes(plan, phase_s, end_s)
    return Timeline(
        camera=camera,
        start_s=0.0,
        end_s=end_s,
        frames=tuple(_frame(camera, index, flashes) for index in range(-_frames_before(camera), count)),
        flashes=flashes,
        kinds=_kinds(plan),
    )


def _frames_of_a_round(plan: Plan) -> int:
    round_s = sum(flash.duration_s + plan.dark_s for flash in plan.flashes)
    return round(round_s / plan.camera.frame_period_s)


def _frames_before(camera: Camera) -> int:
    """Return how many frames that began before time zero are still open then."""
    return int(np.ceil((abs(camera.readout_s or 0.0) + camera.exposure_s) / camera.frame_period_s - 1e-9)) - 1


def _kinds(plan: Plan) -> tuple[str, ...]:
    return tuple(dict.fromkeys(slot_label(plan.flashes[slot]) for slot in plan.lit_slots))


def _flashes(plan: Plan, phase_s: float, end_s: float) -> tuple[FlashSpan, ...]:
    shortest_s = min(flash.duration_s for flash in plan.flashes) + plan.dark_s
    before = 2 + int(max(phase_s, 0.0) / shortest_s)
    count = before + 2 + int(end_s / shortest_s) + int(abs(phase_s) / shortest_s)
    train = plan.train(-before, count)
    starts_s = train.start_s + phase_s
    if plan.mode == "synced":
        starts_s = np.arange(-before, count - before, dtype=np.float64) * plan.camera.frame_period_s + phase_s
    kinds = _kinds(plan)
    spans = []
    for slot, start_s, duration_s in zip(train.slot, starts_s, train.duration_s, strict=True):
        flash = plan.flashes[slot]
        label = slot_label(flash)
        place = -1 if flash.is_dark else kinds.index(label)
        spans.append(FlashSpan(label=label, start_s=float(start_s), end_s=float(start_s + duration_s), place=place))
    return tuple(spans)


def _frame(camera: Camera, index: int, flashes: tuple[FlashSpan, ...]) -> FrameSpans:
    start_s = index * camera.frame_period_s
    readout_s = camera.readout_s or 0.0
    lit = [(number, flash) for number, flash in enumerate(flashes) if flash.place >= 0]
    spans = [span for number, flash in lit for span in _spans(camera, start_s, flash, number)]
    return FrameSpans(
        index=index,
        top_s=start_s + max(-readout_s, 0.0),
        bottom_s=start_s + max(readout_s, 0.0),
        spans=tuple(spans),
        dark_rows=tuple(_dark_rows(camera, start_s, flashes)),
    )


def _spans(camera: Camera, start_s: float, flash: FlashSpan, number: int) -> list[Span]:
    """Return the rows of a frame that saw a flash, as pieces on which the share is constant or changes evenly."""
    exposure_s, duration_s = camera.exposure_s, flash.end_s - flash.start_s
    on_s, off_s = flash.start_s - start_s, flash.end_s - start_s
    shorter_s = min(exposure_s, duration_s)
    offsets_s = np.array([on_s - exposure_s, on_s - exposure_s + shorter_s, off_s - shorter_s, off_s])
    shares = np.array([0.0, shorter_s / duration_s, shorter_s / duration_s, 0.0])
    if not camera.readout_s:
        share = float(np.interp(0.0, offsets_s, shares))
        rows = float(camera.height_px)
        return [Span(flash=number, from_row=0.0, to_row=rows, from_share=share, to_share=share)] if share > 0 else []
    rows_at = _row_at(camera, offsets_s)
    if rows_at[0] > rows_at[-1]:
        rows_at, shares = rows_at[::-1], shares[::-1]
    edges = np.clip(rows_at, 0.0, camera.height_px)
    corners = list(zip(edges.tolist(), np.interp(edges, rows_at, shares).tolist(), strict=True))
    return [
        Span(flash=number, from_row=top, to_row=bottom, from_share=above, to_share=below)
        for (top, above), (bottom, below) in pairwise(corners)
        if bottom - top > 1e-6
    ]


def _dark_rows(camera: Camera, start_s: float, flashes: tuple[FlashSpan, ...]) -> list[float]:
    """Return the middles of the dark rows: where one flash has ended and the next is yet to come when a row is open."""
    if not camera.readout_s:
        return []
    rows = []
    for flash, following in pairwise(flashes):
        gap_s = np.array([flash.end_s - start_s, following.start_s - camera.exposure_s - start_s])
        top, bottom = sorted(_row_at(camera, gap_s).tolist())
        is_thin = bottom - top < DARK_ROW_SHARE * camera.height_px
        middle = (top + bottom) / 2
        if flash.place >= 0 and following.place >= 0 and is_thin and 0 <= middle <= camera.height_px:
            rows.append(middle)
    return rows


def _row_at(camera: Camera, offset_s: Doubles) -> Doubles:
    """Return the row (a continuous coordinate, 0 is the top edge) that opens at an offset from its frame's start."""
    first = 0.0 if camera.row_time_s > 0 else float(camera.height_px)
    return first + offset_s / camera.row_time_s
