"""The dark row held for ten minutes: a board in Python that drifts and jitters, filmed, followed and trimmed in a loop.

Time is virtual, the board's clock and the camera's apart: 900 ppm and a warm-up of 5 ppm a minute, a wander of 30 ppm
in 44 s, flashes that jitter by 2 microseconds. ``python -m bench.genlock --minutes 10``; by hours where it is asked.
``--firmware`` takes the AVR boards' own program in emulation in place of the board in Python, ``--pico`` the Pico's on
the model of its chip.
"""

import argparse
import math
import sys
import tempfile
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

from bench.table import Row, table

sys.path.append(str(Path(__file__).parents[1] / "tests" / "models"))  # the loop that the tests film in

from firmware_board import firmware_board
from pico import Pico
from strobed_loop import StrobedLoop

from psvideo.live.following.genlock import rows_around, target_of
from psvideo.live.following.holding import Holding
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash

MINUTES = 10.0
APART_PPM, WARMS_PPM, WANDERS_PPM, JITTER_S = 900.0, 5.0, 30.0, 2e-6
WITHIN_ROWS, AFTER_S = 2.0, 3.0
ROW = "20"


def rows(minutes: float = MINUTES) -> Iterator[Row]:
    """Hold the dark row of the board in Python for so long and yield how far it ever was from where it should be."""
    yield from _held(StrobedLoop(plan=_plan(), offset_ppm=_offset_ppm, jitter_s=JITTER_S, seed=2), minutes)


def firmware_rows(minutes: float = MINUTES) -> Iterator[Row]:
    """Yield the same of the firmware."""
    with tempfile.TemporaryDirectory() as folder, firmware_board(Path(folder)) as board:
        loop = StrobedLoop(plan=_plan(), offset_ppm=_offset_ppm, jitter_s=JITTER_S, seed=2, board=board)
        yield from _held(loop, minutes)


def pico_rows(minutes: float = MINUTES) -> Iterator[Row]:
    """Yield the same of the Pico's program."""
    yield from _held(
        StrobedLoop(plan=_plan(), offset_ppm=_offset_ppm, jitter_s=JITTER_S, seed=2, board=Pico()), minutes
    )


def _held(loop: StrobedLoop, minutes: float) -> Iterator[Row]:
    for _ in loop.film(4.0):
        if loop.chain.state == "locked":
            break
    lead_s = 1e-3 * loop.board.board.trim_lead_ms
    holding = Holding(chain=loop.chain, target=target_of(loop.plan.camera, ROW), ask=loop.ask, lead_s=lead_s)
    around, began_s = rows_around(loop.plan.camera), loop.host_s
    worst = 0.0
    for at_s in loop.film(AFTER_S + 60 * minutes, holding):
        if at_s > began_s + AFTER_S:
            worst = max(worst, abs(loop.true_row().short_of(holding.target, around)))
    name = f"{minutes:g} minutes, from {AFTER_S:g} s on"
    yield Row(f"{name}: farthest from the row", f"{worst:.2f} rows", f"<= {WITHIN_ROWS:g}", worst <= WITHIN_ROWS)
    yield Row(f"{name}: locks lost", str(len(loop.chain.followed) - 1), "0", len(loop.chain.followed) == 1)
    yield Row(f"{name}: largest trim", f"{holding.most_ppm} ppm", "", None)


def _offset_ppm(at_s: float) -> float:
    return APART_PPM + WARMS_PPM * at_s / 60 + WANDERS_PPM * math.sin(at_s / 7)


def _plan() -> Plan:
    camera = Camera(width_px=4, height_px=72, fps=Fraction(50), exposure_s=0.02, readout_s=0.018)
    flashes = [PlannedFlash(lights={name: 1.0}, duration_s=0.002) for name in ("key", "left", "right")]
    flashes.append(PlannedFlash(lights={}, duration_s=0.002))
    return Plan(camera=camera, flashes=tuple(flashes), dark_s=0.038, clock_tolerance_ppm=3000.0, mode="half-rate")


def main() -> int:
    """Hold it for as long as is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--minutes", type=float, default=MINUTES)
    parser.add_argument("--firmware", action="store_true", help="the AVR boards' program in emulation")
    parser.add_argument("--pico", action="store_true", help="the Pico's program on a model of its chip")
    asked = parser.parse_args()
    made = firmware_rows if asked.firmware else pico_rows if asked.pico else rows
    print(table(made(asked.minutes)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
