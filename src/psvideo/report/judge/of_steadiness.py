"""Judgements on sharpness, and on noise and flicker where nothing moves."""

from collections.abc import Iterator, Sequence

import numpy as np

from psvideo.report.judge.typical_error import AT_REST, LOST_NOISY_DEG, NOISY_DEG
from psvideo.report.judgement import Judgement
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.steadiness import Change

SOFT_PX = 1.5
"""Sharpest edges that are softer are never worse than doubtful: a smooth subject has no others."""
MOST_FLICKER_PERCENT = 1.0


def focus(observed: Observed) -> Judgement:
    """Judge the sharpest edges."""
    if not observed.closely.blurs_px:
        return Judgement(
            subject="focus", grade="unknown", found="Sharpness cannot be measured: no edge stands out of the noise."
        )
    blur_px = float(np.median(observed.closely.blurs_px))
    found = f"The sharpest edges are blurred by {blur_px:.1f} px."
    if blur_px <= SOFT_PX:
        return Judgement(subject="focus", grade="good", found=found)
    return Judgement(
        subject="focus",
        grade="doubtful",
        found=f"{found} Nothing in the picture is in focus, or nothing in it has an edge.",
        advice="Focus on the subject by hand, close the aperture, and keep the camera still.",
    )


def steadiness(facts: Sequence[InstantFacts]) -> Iterator[Judgement]:
    """Judge noise and flicker where nothing moves."""
    known = by_level([one for one in facts if (one.moving_share or 0.0) < AT_REST])
    if not known:
        return
    worst, level = known[0], abs(change_of(known[0]).level_percent)
    noise_deg = float(np.median([change_of(one).normals_deg for one in known]))
    if level > MOST_FLICKER_PERCENT:
        yield Judgement(
            subject="flicker",
            grade="doubtful",
            found="The scene flickers: from one result to the next, albedo at rest changes by up to "
            f"{level:.1f} % as a whole (number {worst.number}).",
            advice="Check the LEDs' supply and the camera's automatics.",
        )
    if noise_deg > NOISY_DEG:
        yield Judgement(
            subject="noise",
            grade="bad" if noise_deg > LOST_NOISY_DEG else "doubtful",
            found=f"Normals at rest change by {noise_deg:.1f} degrees from one result to the next.",
            advice="Give more light or open the lens; `denoise` averages what stands still.",
        )
    elif level <= MOST_FLICKER_PERCENT:
        yield Judgement(
            subject="flicker",
            grade="good",
            found=f"At rest, normals change by {noise_deg:.2f} degrees and light by up to {level:.2f} % from one "
            "result to the next.",
        )


def by_level(facts: Sequence[InstantFacts]) -> list[InstantFacts]:
    """Return the instants of which a change is known, the largest change of level first."""
    known = [one for one in facts if one.change is not None]
    return sorted(known, key=lambda one: -abs(change_of(one).level_percent))


def change_of(facts: InstantFacts) -> Change:
    """Return the change to an instant. Raises ValueError where it is not known."""
    if facts.change is None:
        raise ValueError(f"the change to instant {facts.number} is not known")
    return facts.change
