"""Judgements on the rig: whether its directions and strengths can have made the plates."""

from collections.abc import Iterator, Sequence

from psvideo.model.units import listed
from psvideo.report.judge.of_strengths import other_strengths
from psvideo.report.judge.rig_by_facing import facing_away, facing_inwards
from psvideo.report.judge.rig_by_lean import normals_lean
from psvideo.report.judge.rig_by_plates import (
    lights_exchanged,
    lights_near,
    other_curve,
    rig_explains,
    rig_misfits,
    shining_surface,
)
from psvideo.report.judge.rig_by_slopes import lights_crossed, surface_shines
from psvideo.report.judge.rig_of_three import three_lights
from psvideo.report.judge.typical_error import moves
from psvideo.report.judge.weak_lamps import weaker_than_rig
from psvideo.report.judgement import NAMED, Judgement
from psvideo.report.observe.observed import Observed
from psvideo.solve.normals.trust.unchecked import ALL_EXPLAINED

MOST_MOVES, APART_PX = 0.5, 3.0
"""Where more than the first share of the picture moves, by more than the second within a round, plates that were not
brought together say nothing of the rig: fine detail of a right one gave slopes that agree by -0.2."""


def rig(
    observed: Observed, *, guessed: bool = False, curve_doubt: str = "", apart_px: float = 0.0
) -> Iterator[Judgement]:
    """Judge whether the rig's directions and strengths can have made these plates. ``guessed``: which light is which
    is a guess; ``curve_doubt``: why pictures were likely coded by another curve, where that is known; ``apart_px``: how
    far what moves is from the first plate of a round to the last, 0 where plates were brought together."""
    fit = observed.rig_fit
    firing = observed.firing_lights
    swapped = None if fit is None else lights_exchanged(firing, fit)
    if swapped:
        yield swapped
        return
    said = Judgement(subject="rig", grade="doubtful", found=_sentence(curve_doubt)) if curve_doubt else None
    curve = said or (None if fit is None else other_curve(fit))
    wrong = None if fit is None or curve else rig_misfits(firing, fit)
    weaker = weaker_than_rig(observed)  # which leans normals, too, so that they are no surface's
    crossed = None if weaker else lights_crossed(observed, guessed=guessed) or facing_inwards(observed, guessed=guessed)
    away = facing_away(observed)
    leaning = None if curve or wrong or crossed or away or weaker else normals_lean(observed)
    by_strength = fit is not None and bool(other_strengths(firing, fit))
    shines = wrong is not None and not (crossed or away or by_strength) and surface_shines(observed)
    near = None if fit is None or curve or shines else lights_near(fit)
    if fit is not None and shines:
        yield shining_surface(fit)
        return
    doubted = [one for one in (curve, wrong, crossed, away, near, None if near else leaning) if one]
    moved = apart_px > APART_PX and moves(observed.facts, share=MOST_MOVES)
    if doubted and not said and (moved or any(one.shows for one in observed.closely.astray)):
        yield Judgement(
            subject="rig",
            grade="unknown",
            found="Whether rig and curve are right is not known: the lights' pictures are not aligned (subject or "
            "camera moved from one to the next), and that looks the same as a wrong rig. See the line on motion.",
        )
        return
    yield from doubted
    if any(one.subject == "rig" for one in doubted):
        return
    if weaker:
        yield _beside_weaker(weaker)
    elif fit is not None:
        yield rig_explains(fit, lights=int(observed.firing.sum()))
    elif observed.closely.slopes and int(observed.firing.sum()) == ALL_EXPLAINED:
        yield three_lights(observed)
    elif observed.closely.slopes:  # of more lights too few points are lit by all, so that nothing else is known
        yield Judgement(subject="rig", grade="good", found="The normals fit together as one surface's.")


def _beside_weaker(weaker: Sequence[str]) -> Judgement:
    """Say that lights that give less than the rig says hide whether its directions are right."""
    named = listed([repr(light) for light in weaker], NAMED)
    return Judgement(
        subject="rig",
        grade="unknown",
        found=f"Whether the rig's directions are right is not known: less light than it says comes from {named}. See "
        "the line on lights.",
    )


def _sentence(said: str) -> str:
    return f"{said[0].upper()}{said.removesuffix('.')[1:]}."
