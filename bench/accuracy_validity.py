"""What valid is worth: normals within 10° of the truth, of all that three lights gave (before), of valid and of others.

What a typical normal is said to be off by stands beside what all are off by in the mean.
"""

from collections.abc import Iterator

import numpy as np

from bench.accuracy_measure import (
    SHARED_DATA,
    Accuracy,
    Case,
    angles_deg,
    diligent_ball,
    gloss,
    rendered_bunny,
    ring,
    spread_subsets,
    turned,
    washington,
)
from psvideo.report.judge.typical_error import MEAN_OF_HELD
from psvideo.solve.normals.solving import Solving

OWN_LIGHTS = {3: (0, 1, 2), 4: (0, 1, 2, 3), 5: (0, 2, 4, 5, 7), 8: tuple(range(8))}
FAR_DEG = 10.0


def rows() -> Iterator[Accuracy]:
    """Give virtual scenes by lights, noise and error of the rig; broad sheen; real subjects."""
    for lights in (3, 4, 5, 8, 12):
        for noise in (0.0, 0.005):
            case = _twelve(noise=noise) if lights == 12 else gloss(OWN_LIGHTS[lights], noise=noise)
            for wrong_deg in (0.0, 2.0, 5.0):
                what = f"{lights} lights, {100 * noise:g} % noise, rig off by {wrong_deg:g}°"
                yield row(what, turned(case, wrong_deg), met=None if lights == 3 else 0.95)
    yield row("8 lights, broad sheen (exponent 20, strong)", gloss(roughness=0.55, scale=5, noise=0.003))
    yield row("12 lights, broad sheen (exponent 20, strong)", _twelve(roughness=0.55, scale=5, noise=0.003))
    if SHARED_DATA.is_dir():
        ball = diligent_ball()
        for lights in (8, 12):
            yield row(
                f"DiLiGenT ball, a set of {lights}", ball.choose(spread_subsets(ball.lit.directions, lights, 1)[0])
            )
        yield row("DiLiGenT ball, 48 lights", ball)
        yield row("rendered bunny", rendered_bunny())
        for thing in ("gray", "cat", "horse"):
            yield row(f"Washington's {thing}", washington(thing), met=0.95 if thing == "gray" else None)


def row(what: str, case: Case, *, met: float | None = 0.95) -> Accuracy:
    """Count the normals within 10°; ``met`` is the least share of the valid ones."""
    surface = Solving(error=True).solve(case.plates, case.lit, mask=case.mask)
    where = surface.measured & case.mask
    valid = surface.valid[where]
    share = (surface.valid & case.mask).sum() / case.mask.sum()
    common = f"valid {100 * share:.1f} %"
    if surface.misfit is not None:
        common += f", said to be off by {MEAN_OF_HELD * surface.misfit.error_deg:.1f}°"
    bar = "" if met is None else f">= {100 * met:g} % of valid"
    if np.isnan(case.truth[case.mask]).any():
        return Accuracy(what, "truth unknown", common)
    errors_deg = angles_deg(surface.normals[where], case.truth[where])
    near = errors_deg <= FAR_DEG
    words = f"{100 * near[valid].mean():.1f} % of valid" if valid.any() else "none valid"
    if not valid.all():
        words += f", {100 * near[~valid].mean():.0f} % of invalid"
    return Accuracy(
        what,
        f"{100 * near.mean():.1f} %, off by {errors_deg.mean():.1f}°",
        common,
        words,
        bar,
        None if met is None or not valid.any() else bool(near[valid].mean() >= met),
    )


def _twelve(*, roughness: float | None = None, scale: float = 1.0, noise: float = 0.0) -> Case:
    directions = np.concatenate([ring(4, 28), ring(8, 45)])
    return gloss((0,), scale=scale, noise=noise, roughness=roughness, directions=directions)
