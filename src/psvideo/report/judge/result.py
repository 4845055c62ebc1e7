"""Judgements on what came out: sharpness, the rig's fit, valid normals, noise and flicker."""

from collections.abc import Iterator, Sequence

import numpy as np

from psvideo.report.judge.light import NAMED
from psvideo.report.judgement import Grade, Judgement
from psvideo.report.observe.observed import InstantFacts, Observed
from psvideo.report.observe.rigfit import RigFit
from psvideo.report.observe.steadiness import Change

SOFT_PX = 1.5
"""Sharpest edges that are softer are never worse than doubtful: a smooth subject has no others."""
MISFIT, LOST_MISFIT = 0.135, 0.25
"""Shares of the light that another rig would explain and this one cannot. A rig that was off by 1 to 5 degrees left
0.11 to 0.13 on photographs, two lights exchanged among five 0.18, a list in another order 0.19."""
NOT_MATTE = 0.1
STRENGTH_MISFIT, BY_STRENGTH, OTHER_STRENGTH = 0.05, 0.5, 1.25
"""Less is enough where other strengths of some lights take half of it away."""
COMMON_DEG = 3.0
"""A larger predicted error of the typical normal is no single pixel's fault."""
AGREE, DISAGREE = 0.3, -0.1
MOVING_FACTOR = 2.0
"""Where the picture moves, so many times more may be left unexplained before the rig is doubted: no rig explains what
moved between flashes."""
LEAST_VALID, HARDLY_VALID = 0.6, 0.2
"""Shares of the subject: three lights that stand well reach more of most subjects than the first."""
MOST_FLICKER_PERCENT = 1.0
AT_REST = 0.05
"""Noise is judged by results between which less of the picture than this moves."""
NOISY_DEG, LOST_NOISY_DEG = 4.0, 10.0


def focus(observed: Observed) -> Judgement:
    """Judge the sharpest edges."""
    if not observed.blurs_px:
        return Judgement(
            subject="focus", grade="unknown", found="Sharpness cannot be measured: no edge stands out of the noise."
        )
    blur_px = float(np.median(observed.blurs_px))
    found = f"The sharpest edges are blurred by {blur_px:.1f} px."
    if blur_px <= SOFT_PX:
        return Judgement(subject="focus", grade="good", found=found)
    return Judgement(
        subject="focus",
        grade="doubtful",
        found=f"{found} Nothing in the picture is in focus, or nothing in it has an edge.",
        advice="Focus on the subject by hand, close the aperture, and keep the camera still.",
    )


def rig(observed: Observed) -> Iterator[Judgement]:
    """Judge whether the rig's directions and strengths can have made these plates."""
    fit = None if observed.points is None else observed.points.fit(observed.light_at_points)
    wrong = None if fit is None else _misfit(observed.lights, fit)
    crossed = _crossed(observed)
    if wrong or crossed:
        yield from (one for one in (wrong, crossed) if one)
    elif common := _common(observed.facts):
        yield common
    elif fit is not None:
        yield _explained(fit)
    elif observed.slopes:
        yield Judgement(
            subject="rig",
            grade="good",
            found="The normals fit together as one surface's; with three lights no more of the rig can be checked.",
        )


def _explained(fit: RigFit) -> Judgement:
    left = 100 * fit.misfit
    if fit.misfit <= NOT_MATTE:
        found = f"The rig explains the plates: {left:.1f} % of the light is left over."
        return Judgement(subject="rig", grade="good", found=found)
    return Judgement(
        subject="matte",
        grade="doubtful",
        found=f"{left:.0f} % of the light does not come from a matte surface under this rig "
        f"({100 * fit.own_misfit:.0f} % under any rig): gloss, soft shadows, or directions a few degrees off.",
        advice='Measure the lights again on a sphere; `solver="robust"` leaves out highlights.',
    )


def _misfit(lights: Sequence[str], fit: RigFit) -> Judgement | None:
    off = [
        (light, strength)
        for light, strength in zip(lights, fit.strengths, strict=True)
        if not 1 / OTHER_STRENGTH < strength < OTHER_STRENGTH
    ]
    by_strength = bool(off) and fit.excess > STRENGTH_MISFIT and fit.scaled_misfit < BY_STRENGTH * fit.misfit
    if fit.excess <= MISFIT and not by_strength:
        return None
    grade: Grade = "bad" if fit.excess > LOST_MISFIT else "doubtful"
    found = f"The rig does not fit the plates: {100 * fit.misfit:.0f} % of the light cannot come from its lights"
    if by_strength:
        off.sort(key=lambda one: -abs(float(np.log(max(one[1], 1e-6)))))
        named = ", ".join(f"{light!r} {100 * strength:.0f} %" for light, strength in off[:NAMED])
        named += f" and {len(off) - NAMED} more," if len(off) > NAMED else ""
        return Judgement(
            subject="rig",
            grade=grade,
            found=f"{found}; with other strengths it would: {named} of what the rig says.",
            advice="Check the power and the driver of these lights, or calibrate the rig again.",
        )
    return Judgement(
        subject="rig",
        grade=grade,
        found=f"{found}.",
        advice="Use the rig file of this set-up; calibrate again if a light or the camera was moved; check that lights "
        "have the same names in plan and rig.",
    )


def _common(facts: Sequence[InstantFacts]) -> Judgement | None:
    """Judge what is unexplained in all pixels alike, which makes none of them invalid."""
    known = [one.misfit for one in facts if one.misfit is not None]
    most_deg = COMMON_DEG * (MOVING_FACTOR if _moves(facts) else 1)
    if not known or (error_deg := float(np.median([one.error_deg for one in known]))) <= most_deg:
        return None
    share = float(np.median([one.share for one in known]))
    return Judgement(
        subject="rig",
        grade="doubtful",
        found=f"In a typical pixel the lights of the rig do not explain the plates within {100 * share:.1f} %, which "
        f"may turn every normal by about {error_deg:.0f} degrees; validity does not show it.",
        advice="Calibrate the lights again; give more light where the plates are noisy.",
    )


def _crossed(observed: Observed) -> Judgement | None:
    agreement = float(np.median(observed.slopes)) if observed.slopes else 1.0
    if agreement > AGREE or not quiet(observed.facts) or (agreement > DISAGREE and _moves(observed.facts)):
        return None
    return Judgement(
        subject="rig",
        grade="bad" if agreement < DISAGREE else "doubtful",
        found=f"The normals cannot be those of one surface (agreement of slopes {agreement:.2f}, 1 at best): "
        "directions are mirrored or turned, or lights exchanged.",
        advice="Check that the rig file is in camera axes (x right, y up), belongs to this set-up, and names the "
        "lights as the plan does; calibrate again if anything was moved.",
    )


def _moves(facts: Sequence[InstantFacts]) -> bool:
    shares = [one.moving_share for one in facts if one.moving_share is not None]
    return bool(shares) and float(np.median(shares)) > AT_REST


def quiet(facts: Sequence[InstantFacts]) -> bool:
    """Tell whether normals are steady enough to be held against each other."""
    known = [one.change.normals_deg for one in facts if one.change is not None and (one.moving_share or 0.0) < AT_REST]
    return not known or float(np.median(known)) < NOISY_DEG


def validity(observed: Observed) -> Iterator[Judgement]:
    """Judge how much of the subject has a normal."""
    shares = [one.valid_share for one in observed.facts if one.valid_share is not None]
    if not shares:
        return
    usual, least = float(np.median(shares)), min(shares)
    found = f"{100 * usual:.0f} % of the subject has a normal to be trusted"
    if usual >= LEAST_VALID:
        yield Judgement(subject="validity", grade="good", found=f"{found} ({100 * least:.0f} % in the worst round).")
        return
    yield Judgement(
        subject="validity",
        grade="bad" if max(shares) < HARDLY_VALID and _common(observed.facts) is None else "doubtful",
        found=f"Only {found}.",
        advice="Give the subject more light, place the lights nearer to the camera's axis, or use more of them, so "
        "that three reach every part.",
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
