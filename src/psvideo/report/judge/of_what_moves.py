"""Judgement on what moves: how much of it came out, which shares of the whole picture hide before a still wall."""

from collections.abc import Iterator, Sequence

import numpy as np

from psvideo.report.judge.of_validity import HARDLY_VALID, LEAST_VALID
from psvideo.report.judge.typical_error import NOISY_DEG, by_noise_deg
from psvideo.report.judgement import Grade, Judgement
from psvideo.report.observe.facts import InstantFacts

FEWEST_ROUNDS = 0.5
"""What moves in a smaller share of the results is passing by."""


def what_moves(facts: Sequence[InstantFacts], *, aligned: bool = False) -> Iterator[Judgement]:
    """Judge which share is trusted of what moves and three lights reach. Nothing is said where hardly anything moves,
    where noise spoils normals anyway, and of plates that were not aligned where three lights check nothing: what is
    trusted there may be wrong, and the line on motion says by how much."""
    shares = [one.moving_valid_share for one in facts if one.moving_valid_share is not None]
    if len(shares) < FEWEST_ROUNDS * len(facts) or by_noise_deg(facts) > NOISY_DEG:
        return
    usual = float(np.median(shares)) if shares else 0.0
    if not shares or (usual >= LEAST_VALID and not aligned):
        return
    grade: Grade = "good" if usual >= LEAST_VALID else "doubtful" if max(shares) >= HARDLY_VALID else "bad"
    few = "" if grade == "good" else "Only "
    yield Judgement(
        subject="what moves",
        grade=grade,
        found=f"{few}{100 * usual:.0f} % of what moves and three lights reach, moving shadows too, has a normal to be "
        "trusted.",
        advice=""
        if grade == "good"
        else "Move slower, raise the frame rate or flash fewer lights, and give fine detail to follow"
        + ("." if aligned else "; leave `align` at auto, which brings the plates together."),
    )
