"""How a live run stands, made up: what lines and pages are to say of it."""

from psvideo.live.status import LiveState, LiveStatus
from psvideo.model.timing import Order


def standing(*, at_s: float, state: LiveState, fps: float, frames: int, order: Order | None = None) -> LiveStatus:
    """Return how things stand at a time, of a small picture of which nothing was solved."""
    return LiveStatus(
        at_s=at_s,
        state=state,
        fps=fps,
        frames=frames,
        lost=0,
        results=0,
        results_per_s=0.0,
        age_s=None,
        oldest_s=None,
        phase_error_rows=None,
        clock_offset_ppm=None,
        order=order,
        width_px=96,
        height_px=72,
    )
