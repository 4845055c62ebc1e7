"""Live: processor time of every frame and of every result, a mosaic of 8 bits under four lights, by stage.

``python -m bench.live --seconds 60 --size 720 --fps 120`` films by the clock on the wall before that, with the page
open in Chromium, on a machine on which nothing else runs; left out, both modes one after the other.
"""

import argparse
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

from psvideo.compute.heap import set_as_commands_do

if TYPE_CHECKING:
    from bench.table import Row

SIZES = {720: 120, 1080: 60}
"""Rows of a frame, and frames a second."""


def rows() -> "Iterator[Row]":
    """Run every stage of the chain on two modes."""
    from bench import live_stages

    return live_stages.rows()


def main() -> int:
    """Measure by the wall's clock, against the bars, and what every stage costs by itself beside it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--size", type=int, choices=SIZES, help="rows of a frame")
    parser.add_argument("--fps", type=int)
    asked = parser.parse_args()
    set_as_commands_do()
    from bench import live_stages, live_wall  # they load numpy
    from bench.table import table

    for size, fps in SIZES.items():
        if asked.size in (None, size):
            print(table(live_wall.rows(size, asked.fps or fps, asked.seconds)), flush=True)
    print(table(live_stages.rows()), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
