"""Where the strobe may have paused though its fit goes on: flashes in a row that never fired."""

import numpy as np

from psvideo.model.plan import Plan
from psvideo.model.rows.shutter import frames_touched
from psvideo.sync.flashes_seen import fitted_camera, flashes_of_fit
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.unfired import unfired_of


def silent(plan: Plan, found: ClipFit) -> list[tuple[int, int]]:
    """Return the first and the last place in time of the frames that saw a flash which never fired, or several such
    flashes one after another, for each such row of flashes."""
    flashes = flashes_of_fit(plan, found, found.fit.beat)
    unfired = unfired_of(plan, found, flashes)
    lit = [flash for flash in flashes if not flash.is_dark]
    off = np.array([flash.index in unfired.never | unfired.beside for flash in lit], np.int64)
    edges = np.flatnonzero(np.diff(off, prepend=0, append=0))
    camera = fitted_camera(plan, found.fit)
    spans = []
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        start_s, duration_s = (
            np.array([getattr(one, name) for one in lit[begin:end]]) for name in ("start_s", "duration_s")
        )
        first, last = frames_touched(camera, start_s, duration_s)
        spans.append((int(first[0]), int(last[-1])))
    return spans
