"""What bringing a round to one instant costs at 1080p where everything moves, in milliseconds by stage.

``python -m bench.aligning [--lights 8 4] [--cache FOLDER]``: a relief that slides 2 px from flash to flash, in colour,
read from uncompressed TIFF; processor (of all threads) and wall. Beside it, OpenCV's cubic ``remap`` of as many plates.
"""

import argparse
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from bench.whole_run import CACHE
from bench.whole_run_clips import COLS, ROWS, ClipOf, filmed
from psvideo.compute.heap import set_as_commands_do
from psvideo.formats.rig_toml import read_rig
from psvideo.plates.align import light_history, rounds
from psvideo.plates.gather import gather
from psvideo.sync.open_take import open_take
from psvideo.sync.take_timing import find_timing

ROUNDS = 3
STAGES: tuple[tuple[Any, str, str], ...] = (
    (rounds, "_make_moving", "a round brought to its instant"),
    (rounds, "followed_at", "following"),
    (rounds, "plate_at", "plates moved, blended and packed"),
    (light_history, "sketch_of", "sketches, before that"),
)
Spent = dict[str, list[tuple[float, float]]]


@contextmanager
def _timed() -> Iterator[Spent]:
    """Give what the stages take from here on, processor and wall seconds of every call."""
    spent: Spent = defaultdict(list)
    plain = [getattr(module, name) for module, name, _ in STAGES]

    def watched(function: Callable[..., Any], what: str) -> Callable[..., Any]:
        def run(*given: Any, **named: Any) -> Any:
            begun = time.process_time(), time.perf_counter()
            try:
                return function(*given, **named)
            finally:
                spent[what].append((time.process_time() - begun[0], time.perf_counter() - begun[1]))

        return run

    for (module, name, what), function in zip(STAGES, plain, strict=True):
        setattr(module, name, watched(function, what))
    try:
        yield spent
    finally:
        for (module, name, _), function in zip(STAGES, plain, strict=True):
            setattr(module, name, function)


def costs(lights: int, cache: Path, *, turns: int = 3) -> dict[str, tuple[float, float]]:
    """Return processor and wall milliseconds of every stage, an instant, the least of some turns."""
    clip = ClipOf(kind="tiff", lights=lights, moving=True, everything=True)
    path, rig = filmed(clip, cache, frames=clip.frames_of(ROUNDS))
    take = open_take(path)
    timing, how = find_timing(take), rounds.Aligning(lights=read_rig(rig).lights)
    found: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for _ in range(turns + 1):  # the first one compiles
        with _timed() as spent:
            for _ in gather(take, timing, aligning=how):
                pass
        count = len(spent[STAGES[0][2]])
        for what, calls in spent.items():
            processor_s, wall_s = np.sum(calls, axis=0) / count
            found[what].append((1e3 * processor_s, 1e3 * wall_s))
    return {what: min(each[1:]) for what, each in found.items()}


def remapped(count: int) -> tuple[float, float]:
    """Return processor and wall milliseconds of OpenCV's cubic interpolation of so many pictures."""
    x, y = np.meshgrid(np.arange(COLS, dtype=np.float32), np.arange(ROWS, dtype=np.float32))
    picture = np.random.default_rng(0).random((ROWS, COLS, 3), np.float32)
    begun = time.process_time(), time.perf_counter()
    for _ in range(count):
        cv2.remap(picture, x + np.float32(7.3), y + np.float32(1.2), cv2.INTER_CUBIC)
    return 1e3 * (time.process_time() - begun[0]), 1e3 * (time.perf_counter() - begun[1])


def main() -> None:
    """Print the table."""
    set_as_commands_do()
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lights", type=int, nargs="+", default=[8, 4])
    parser.add_argument("--cache", type=Path, default=CACHE)
    given = parser.parse_args()
    given.cache.mkdir(parents=True, exist_ok=True)
    for lights in given.lights:
        for what, (processor_ms, wall_ms) in {
            **costs(lights, given.cache),
            "OpenCV's cubic remap of both plates": remapped(2 * lights),
        }.items():
            print(f"{lights} lights, {what}: {processor_ms:.0f} ms of a processor, {wall_ms:.0f} ms on the clock")


if __name__ == "__main__":
    main()
