"""Judgements on what came out: sharpness, valid normals, how far off they are, noise and flicker."""

from collections.abc import Iterator, Sequence

import numpy as np

from psvideo.report.judge.of_strengths import other_strengths
from psvideo.report.judgement import Grade, Judgement
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.steadiness import Change
from psvideo.solve.normals.trust.unchecked import ALL_EXPLAINED

SOFT_PX = 1.5
"""Sharpest edges that are softer are never worse than doubtful: a smooth subject has no others."""
COMMON_DEG = 3.0
"""What a typical normal may be off by beyond noise."""
LOST_DEG = 15.0
"""From here on a normal says little of the surface: photographs under directions that were 1 to 8 degrees off came to
13, and a bear under eight lights nearly in one plane to 18."""
MEAN_OF_HELD = 0.83
"""Predicted errors hold two thirds of the true ones; this is the mean as a share of it, for errors in two directions
(Rayleigh)."""
LITTLE_NOISE_DEG = 1.0
"""Where noise turns normals by less, more light makes none of them trusted."""
NOT_MATTE = 0.1
"""From this share of the light on that another rig would explain and this one cannot, directions are doubted."""
MOSTLY = 0.7
"""Or from this share of what is left over on: of matte subjects a rig that is off leaves little else (0.9 of it, one of
five lights 5 degrees off; 0 under haze and of gloss, which no rig explains)."""
HARDLY_OFF = 0.05
"""Four directions that are 5 degrees off leave 1 to 3 % of the light, 10 degrees 2 to 6 % (normals are 4 to 10 degrees
off), 20 degrees 6 to 11 %."""
UNKNOWN_DISTANCE = 0.1
"""From this share of the subject on, what is not known of near lights' distance is said: it costs as many normals."""
MOVING_FACTOR = 2.0
"""Where the picture moves, this many times more may be left unexplained: no rig explains what moved between flashes."""
LEAST_VALID, HARDLY_VALID = 0.6, 0.2
"""Shares of the subject: three lights that stand well reach more of most subjects than the first."""
NONE_VALID = 0.05
"""With less, what is good for a look is all that is left: no take to be used where no line says how far normals are
off. (A cat under twelve directions that are a few degrees off: as little, and accuracy says by how much.)"""
MOST_FLICKER_PERCENT = 1.0
AT_REST = 0.05
"""Noise is judged by results between which less of the picture than this moves."""
NOISY_DEG, LOST_NOISY_DEG = 4.0, 10.0
CLIPPING_FIRST = (
    "See the line on clipping first: what clips is no measurement, and more light clips more. Beyond that, place the "
    "lights nearer to the camera's axis, or use more of them, so that three reach every part."
)
EXPOSURE_FIRST = "See the line on exposure first: noise alone may turn normals that far."
RIG_FIRST = "See the line on the rig first: normals that are off for the lights' sake are no better for more light."
HALF = 0.5
"""From this share of what normals are off by on, albedo that goes with the slope is what shows it: more lights at the
same angle to the lens would not."""
GOES_WITH_SLOPE = (
    "goes with the slope, which paint seldom does: light shines through the surface (skin, wax) or comes from "
    "everywhere (haze, flare, a bright room), the surface shines, or lamps are not as strong as the rig says"
)
BESIDE_THE_OTHERS = (
    "These lights cannot tell which, nor take it off: six or more do that stand at different angles to the lens, one "
    "of them close beside it. Or measure strengths on a white card (psvideo calibrate flat-field), clear the air and "
    "darken the room"
)
CURVE_FIRST = "First read the files by their own curve: a wrong one looks like motion and like an uneven surface."


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


def first_of_all(lines: Sequence[Judgement], *, curve_doubted: bool = False) -> str:
    """Return which of the lines said so far to mend before validity is looked at, empty where none; ``curve_doubted``:
    the files are likely read by another curve than their own."""
    doubted = {one.subject for one in lines if one.grade in ("doubtful", "bad")}
    if curve_doubted:
        return CURVE_FIRST
    if "exposure" in doubted:
        return EXPOSURE_FIRST
    if "clipping" in doubted:
        return CLIPPING_FIRST
    return RIG_FIRST if "rig" in doubted else ""


def validity(observed: Observed, *, first: str = "") -> Iterator[Judgement]:
    """Judge how much of the subject has a normal to be trusted, and what the rest lacks; ``first`` is what to do before
    anything else, as ``first_of_all`` says it."""
    known = [one for one in observed.facts if one.valid_share is not None]
    if not known:
        return
    shares = [one.valid_share or 0.0 for one in known]
    usual, least = float(np.median(shares)), min(shares)
    found = f"{100 * usual:.0f} % of the subject has a normal to be trusted"
    if usual >= LEAST_VALID:
        yield Judgement(subject="validity", grade="good", found=f"{found} ({100 * least:.0f} % in the worst round).")
        return
    reached = [one.measured_share for one in known if one.measured_share is not None]
    enough = bool(reached) and float(np.median(reached)) >= LEAST_VALID
    beyond_deg = off_deg(observed)
    if beyond_deg is None and _off_by_albedo(observed):
        beyond_deg = by_slope_deg(observed.facts)
    by_surface = enough and (
        _steady(observed)
        if beyond_deg is None
        else max(COMMON_DEG, by_noise_deg(observed.facts)) < beyond_deg <= LOST_DEG
    )
    said = by_surface and (
        beyond_deg is not None or max(shares) >= NONE_VALID
    )  # accuracy has its line, and its measure
    lost = max(shares) < HARDLY_VALID and not said
    grade: Grade = "bad" if lost else "doubtful"
    if enough:
        yield Judgement(
            subject="validity",
            grade=grade,
            found=f"Three lights reach {100 * np.median(reached):.0f} % of the subject, and {found}: elsewhere its "
            "predicted error is too large."
            + (" These normals serve a look, and no measurement." if usual < NONE_VALID else ""),
            advice=first or _trusting(observed),
        )
        return
    yield Judgement(
        subject="validity",
        grade=grade,
        found=f"Only {found}.",
        advice=first
        or "Give the subject more light, place the lights nearer to the camera's axis, or use more of them, so "
        "that three reach every part.",
    )


def _trusting(observed: Observed) -> str:
    """Say what would make more normals to be trusted: what accuracy says is to blame, or more light where noise is."""
    said = any(one.grade in ("doubtful", "bad") for one in accuracy(observed))
    if _three(observed) and by_slope_deg(observed.facts) > COMMON_DEG:
        return (
            f"Albedo {GOES_WITH_SLOPE}; or paint does so here. Three lights cannot tell. Use a fourth light, which "
            "shows how far normals are off, or six or more at different angles to the lens, which take most of it off. "
            '`aov=["error"]` says how far off each pixel may be.'
        )
    if off_deg(observed) is None and _steady(observed) and not said:
        return (
            "Measure the lights again, clear the air and darken the room, or use more lights; brighter ones do not "
            'help. `aov=["error"]` says how far off each pixel may be.'
        )
    noise_deg = by_noise_deg(observed.facts)
    if moves(observed.facts) and noise_deg > NOISY_DEG:
        return (
            f"Noise alone turns a typical normal by {noise_deg:.0f} degrees: give more light, or use more lights. What "
            'moves must move slower besides, if it is lost then. `aov=["error"]` says how far off each pixel may be.'
        )
    if moves(observed.facts):
        return (
            "Move slower, raise the frame rate or flash fewer lights, and give fine detail to follow: plates of what "
            "moves must be brought together. If nothing moved, light flickers, or the movie's coding changes the "
            'pictures. `aov=["error"]` says how far off each pixel may be.'
        )
    if said and noise_deg < LITTLE_NOISE_DEG:
        return "More light does not help; the line on the typical error says what does."
    if next(distance(observed), None) is not None:
        return "More lights help, and a depth that is known; the line on distance says why."
    return "Give more light, or use more lights" + (
        "." if said else '; `aov=["error"]` says how far off each pixel may be.'
    )


def accuracy(observed: Observed) -> Iterator[Judgement]:
    """Judge how far off a typical normal is by more than noise, and what makes it so."""
    error_deg = off_deg(observed)
    if error_deg is None and (by_albedo := _off_by_albedo(observed)):
        yield by_albedo
        return
    if error_deg is None and _three(observed) and _solved(observed.facts):
        yield Judgement(
            subject="accuracy",
            grade="unknown",
            found="How far normals are off beyond noise is not known: three lights explain any surface, also one that "
            "shines or lies in other light, and cannot check each other. On photographs of a ball, a bear, a "
            "cat and a sphere typical normals were off by 3 to 11 degrees under three. Four lights and more show it.",
            advice='`aov=["error"]` counts what such surfaces left, and how far noise spreads.',
        )
    if error_deg is None or error_deg < by_noise_deg(observed.facts):  # what noise hides cannot be told from it
        return
    amount = f"about {error_deg:.0f} degrees" if error_deg > 1.5 else "no more than about a degree"
    found = f"Beyond noise, a typical normal is off by {amount}"
    if error_deg <= COMMON_DEG * (MOVING_FACTOR if moves(observed.facts) else 1):
        yield Judgement(subject="accuracy", grade="good", found=f"{found}.")
        return
    cause, advice = _why_off(observed)
    yield Judgement(
        subject="accuracy",
        grade="bad" if error_deg > LOST_DEG else "doubtful",
        found=f"{found}: {cause}.",
        advice=f'{advice}; `aov=["error"]` says how far off each pixel may be.',
    )


def _off_by_albedo(observed: Observed) -> Judgement | None:
    """Judge how far off a typical normal is where nothing but albedo that goes with the slope shows it."""
    slope_deg = by_slope_deg(observed.facts)
    if slope_deg <= COMMON_DEG or _three(observed) or not _explained(observed):
        return None
    return Judgement(
        subject="accuracy",
        grade="bad" if slope_deg > LOST_DEG else "doubtful",
        found=f"A typical normal is off by about {slope_deg:.0f} degrees: albedo {GOES_WITH_SLOPE}.",
        advice=f'{BESIDE_THE_OTHERS}; `aov=["error"]` says how far off each pixel may be.',
    )


def _why_off(observed: Observed) -> tuple[str, str]:
    """Return what makes normals wrong beyond noise, and what to do about it."""
    if any(one.shows for one in observed.astray):
        return "the pictures are not aligned", "See the line on motion"
    fit = observed.rig_fit
    if fit is not None and fit.exchanged is not None:
        return "two lights are exchanged", "See the line on the rig"
    if fit is not None and other_strengths(observed.firing_lights, fit):
        return "some lights are not as strong as the rig says", "See the line on the rig"
    if fit is not None and fit.excess > min(NOT_MATTE, MOSTLY * fit.misfit):
        return (
            "other directions of the lights would explain more: they are a few degrees off, or the surface is glossy",
            "Measure the lights on a sphere beside the subject",
        )
    alike = by_slope_deg(observed.facts) > HALF * (off_deg(observed) or 0.0)
    return (
        "the surface is not quite matte, or light comes by way of others (gloss, creases, soft shadows)",
        f"More lights, far apart{' and at other angles to the lens than these' if alike else ''}, average it out",
    )


def distance(observed: Observed) -> Iterator[Judgement]:
    """Judge how much of the subject lies where near lights' distance is not known, which is no fault of its surface."""
    known = [one.misfit.distance_share for one in observed.facts if one.misfit is not None]
    share = float(np.median(known)) if known else 0.0
    if share > UNKNOWN_DISTANCE:
        yield Judgement(
            subject="distance",
            grade="doubtful",
            found=f"The lights are near, and in {100 * share:.0f} % of the subject their light does not say how far "
            "away it is (in shadow beside what stands before it, where few lights reach, or where it is dim): the "
            "distance is a guess there, and normals may be turned too far to be trusted.",
            advice="Give a depth that is known (`depth`), place the lights farther away, or use more of them.",
        )


def _three(observed: Observed) -> bool:
    return int(observed.firing.sum()) == ALL_EXPLAINED


def _solved(facts: Sequence[InstantFacts]) -> bool:
    return any(one.valid_share is not None for one in facts)


def off_deg(observed: Observed) -> float | None:
    """Return how far off a typical normal is by more than noise, in the mean; None where nothing says so."""
    known = [one.misfit.error_deg for one in observed.facts if one.misfit is not None]
    return MEAN_OF_HELD * float(np.median(known)) if known else None


def by_noise_deg(facts: Sequence[InstantFacts]) -> float:
    """Return by how much noise turns a typical normal, in the mean; 0 where nothing says so."""
    known = [one.misfit.noise_deg for one in facts if one.misfit is not None]
    return MEAN_OF_HELD * float(np.median(known)) if known else 0.0


def by_slope_deg(facts: Sequence[InstantFacts]) -> float:
    """Return by how much typical normals are turned, in the mean, as albedo that goes with the slope shows it; 0 where
    nothing does."""
    return float(np.median([one.slope_deg for one in facts])) if facts else 0.0


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


def _steady(observed: Observed) -> bool:
    """Return whether normals at rest change so little between results that noise is not to blame for what is not
    trusted, and the rig explains the plates: of few lights nothing else separates gloss or compression from noise."""
    known = [one.change.normals_deg for one in observed.facts if one.change is not None]
    return _explained(observed) and bool(known) and float(np.median(known)) < COMMON_DEG


def _explained(observed: Observed) -> bool:
    """Return whether the rig explains what each light gives."""
    fit = observed.rig_fit
    return fit is not None and fit.excess <= HARDLY_OFF


def moves(facts: Sequence[InstantFacts]) -> bool:
    """Return whether a usual round shows motion."""
    shares = [one.moving_share for one in facts if one.moving_share is not None]
    return bool(shares) and float(np.median(shares)) > AT_REST


def by_level(facts: Sequence[InstantFacts]) -> list[InstantFacts]:
    """Return the instants of which a change is known, the largest change of level first."""
    known = [one for one in facts if one.change is not None]
    return sorted(known, key=lambda one: -abs(change_of(one).level_percent))


def change_of(facts: InstantFacts) -> Change:
    """Return the change to an instant. Raises ValueError where it is not known."""
    if facts.change is None:
        raise ValueError(f"the change to instant {facts.number} is not known")
    return facts.change
