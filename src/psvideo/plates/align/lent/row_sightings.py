"""When flashes of a light showed every row around an instant, and how everything moves there by that.

Below 360 degrees a flash is seen by a part of the rows. Of each light two sketches are made up: every row of one shows
the last flash that showed it up to the instant, and of the other the first one after. So each row has times of its own,
by which flow between the two becomes a velocity.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Flags, Floats
from psvideo.plates.align.by_surface import BySurface
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.velocity.all_lights import AllLights
from psvideo.plates.align.velocity.brightness import evened
from psvideo.plates.align.velocity.flow import BLOCK_PX, Sketch, changed
from psvideo.plates.align.velocity.followed import Followed, Pair
from psvideo.plates.align.velocity.moving import followed_at


@dataclass(frozen=True, kw_only=True)
class RowPair:
    """A light's two sketches around an instant, and the times since and until what their rows show, (2, row): 0 where
    no two flashes showed a row."""

    pair: Pair
    spans_s: Floats


def row_pair(shots: Sequence[Sketch], time_s: float) -> RowPair | None:
    """Return what a light's sketches, each of the rows that its own flash showed, say of an instant; None where no two
    show the same row. Where no flash after the instant showed a row, or none before it, two on one side do."""
    shots = sorted(shots, key=lambda shot: shot.time_s)
    times_s = np.array([shot.time_s for shot in shots])
    seen = np.stack([shot.seen.reshape(len(shot.codes), -1).all(axis=1) for shot in shots])
    places = np.cumsum(seen, axis=0, dtype=np.intp)
    count = places[-1]
    until = (seen & (times_s <= time_s)[:, None]).sum(axis=0)
    first = np.clip(until, 1, np.maximum(count - 1, 1))  # of a row's flashes, the last one up to the instant
    known = count >= 2
    if not known.any():
        return None
    one, other = (_chosen(seen, places, which) for which in (first, first + 1))
    other = np.where(known, other, one)
    before, after = (_made_up(shots, which, known) for which in (one, other))
    spans_s = np.stack([time_s - times_s[one], times_s[other] - time_s]) * known
    return RowPair(pair=Pair(before=before, after=evened(before, after)), spans_s=spans_s.astype(np.float32))


def _chosen(seen: Flags, places: NDArray[np.intp], which: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return of every row the shot that was the first, second ... to show it, (row,)."""
    return np.asarray(np.argmax(seen & (places == which), axis=0), np.intp)


def _made_up(shots: Sequence[Sketch], which: NDArray[np.intp], known: Flags) -> Sketch:
    """Return the sketch whose rows are each of one of the shots; ``known`` are those that count."""
    codes = np.empty_like(shots[0].codes)
    for place in np.unique(which):
        codes[which == place] = shots[place].codes[which == place]
    size = max(codes.shape[1] // BLOCK_PX, 1), max(codes.shape[0] // BLOCK_PX, 1)
    blocks = np.asarray(cv2.resize(codes.astype(np.float32), size, interpolation=cv2.INTER_AREA), np.float32)
    return Sketch(
        number=shots[0].number,
        time_s=shots[0].time_s,
        codes=codes,
        seen=known[:, None],
        blocks=blocks,
        white=shots[0].white,
    )


def motion_by_rows(shots: Mapping[str, Sequence[Sketch]], time_s: float, lamps: Lamps | None) -> Followed | None:
    """Return how everything moves at an instant by the sketches of every light, which shine as the ``lamps``; None
    where nothing changes."""
    found = {light: row_pair(of_light, time_s) for light, of_light in shots.items() if of_light}
    known = {light: one for light, one in found.items() if one is not None}
    if not any(changed(one.pair.before, one.pair.after).any() for one in known.values()):
        return None
    pairs = {light: one.pair for light, one in known.items()}
    surface = BySurface.of(lamps, pairs, {}) if len(pairs) == len(shots) else None

    def choose(lights: AllLights, proposals: Sequence[Floats], found: Followed, still: Flags) -> Followed:
        return found if surface is None else surface.chosen(lights, proposals, found, still)

    rows_s = np.stack([one.spans_s for one in known.values()])
    motion = followed_at([*pairs.values()], time_s, choose=choose, rows_s=rows_s)
    return motion if motion.moves.any() else None
