"""What motion costs with runs' alignment, by px from flash to flash: the table of `model/cost/motion_cost.py`.

python -m bench.motion_costs. Virtual subjects before a mottled wall slide or tumble; a camera's noise is on them. Lost
is what is trusted at rest and no more; degrees are the mean error of what is trusted, and of every pixel.
"""

from collections.abc import Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from bench.accuracy_measure import angles_deg
from bench.accuracy_motion import ASLANT, BOX, BUST, MOTTLED, Filmed, filmed, slide, turn
from psvideo.model.choices import Align
from psvideo.plates.align.rounds import Aligning
from psvideo.solve.normals.solving import Solving

BALL = {"mesh": "sphere", "height_m": 0.4, "albedo": MOTTLED}
SUBJECTS = {"ball, 3 lights": (BALL, 3), "bare box, 5 lights": (BOX, 5), "bust, 5 lights": (BUST, 5)}
STEPS_PX = (1.0, 4.0, 16.0)
NOISE = 0.002


class Cost(NamedTuple):
    """The share of the subject that is trusted, its mean error, that of every pixel, and the share beyond 10 degrees of
    what is trusted."""

    trusted: float
    trusted_deg: float
    every_deg: float
    far: float


def costs(clip: Filmed, how: Aligning) -> Cost:
    """Return what the second round shows, solved as runs do."""
    one = clip.shown(how)[1]
    seen = np.stack([plate.pixels_seen for plate in one.plates])
    moves = None if one.motion is None else one.motion.moves
    images = [plate.image for plate in one.plates]
    surface = Solving(error=True).solve(images, clip.lit, seen=seen, unsure=one.unsure, moves=moves)
    truth, subject = clip.truth(one.time_s)
    good = subject & surface.valid
    trusted = angles_deg(surface.normals[good], truth[good])
    shown = subject & surface.shown
    every = angles_deg(surface.normals[shown], truth[shown])
    return Cost(
        float(good.sum() / subject.sum()), float(trusted.mean()), float(every.mean()), float(np.mean(trusted > 10))
    )


def measured(steps_px: tuple[float, ...] = STEPS_PX) -> Iterator[tuple[str, float, dict[str, Cost]]]:
    """Yield subject, motion and px per flash, and the costs with and without alignment."""
    motions: dict[str, Any] = {"slides": slide, "tumbles": lambda px: turn(px, ASLANT)}
    ways: tuple[Align, ...] = ("none", "auto")
    for name, (subject, lights) in SUBJECTS.items():
        rest = costs(filmed(lights, None, noise=NOISE, subject=subject), Aligning())
        yield f"{name}, at rest", 0.0, {"auto": rest}
        for px, (motion, moves) in product(steps_px, motions.items()):
            clip = filmed(lights, moves(px), noise=NOISE, subject=subject)
            yield f"{name}, {motion}", px, {align: costs(clip, Aligning(align=align)) for align in ways}


def main() -> None:
    """Print the table."""
    for name, px, ways in measured():
        words = [
            f"{align}: {100 * one.trusted:.1f} % trusted, {one.trusted_deg:.2f} deg, {100 * one.far:.1f} % over 10, "
            f"every pixel {one.every_deg:.2f}"
            for align, one in ways.items()
        ]
        print(f"{name}, {px:g} px: " + "; ".join(words), flush=True)


if __name__ == "__main__":
    main()
