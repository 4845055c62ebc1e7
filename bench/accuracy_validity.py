"""What valid is worth: normals within 10° of the truth, of all that are solved (before), of valid and of invalid ones.

A rig that is wrong spoils all normals alike and makes none of them invalid; what is typical of the picture says so.
"""

from collections.abc import Iterator
from dataclasses import replace

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
from psvideo.solve.normals.robust import huber1981
from psvideo.solve.normals.robust.weighing import EVERYTHING_DEG, Reweighting

OWN_LIGHTS = {3: (0, 1, 2), 4: (0, 1, 2, 3), 5: (0, 2, 4, 5, 7), 8: tuple(range(8))}
EVERYTHING = Reweighting(most_error_deg=EVERYTHING_DEG)
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
            yield row(f"Washington's {thing}", washington(thing), most_invalid=0.1)


def row(what: str, case: Case, *, met: float | None = 0.95, most_invalid: float | None = None) -> Accuracy:
    """Count the normals within 10°; ``met`` is the least share of the valid ones."""
    usable = replace(huber1981.USABLE, dark_level=0.0005) if case.name.startswith("DiLiGenT") else huber1981.USABLE
    careful = huber1981.solve(case.plates, case.lit, usable=usable)
    solved = huber1981.solve(case.plates, case.lit, usable=usable, reweighting=EVERYTHING, misfit=careful.misfit)
    where = solved.valid & case.mask
    valid = careful.valid[where]
    typical = careful.misfit
    common = "" if typical is None else f", typical {typical.error_deg:.1f}° ({100 * typical.share:.1f} % unexplained)"
    share = (careful.valid & case.mask).sum() / case.mask.sum()
    bar = "" if met is None else f">= {100 * met:g} % of valid"
    if np.isnan(case.truth[case.mask]).any():
        done = None if most_invalid is None else bool(share >= 1 - most_invalid)
        return Accuracy(what, "truth unknown", f"valid {100 * share:.1f} %{common}", "", ">= 90 % valid", done)
    near = angles_deg(solved.normals[where], case.truth[where]) <= FAR_DEG
    words = f"{100 * near[valid].mean():.1f} % of valid"
    if not valid.all():
        words += f", {100 * near[~valid].mean():.0f} % of invalid"
    return Accuracy(
        what,
        f"{100 * near.mean():.1f} %",
        f"valid {100 * share:.1f} %{common}",
        words,
        bar,
        None if met is None else bool(near[valid].mean() >= met),
    )


def _twelve(*, roughness: float | None = None, scale: float = 1.0, noise: float = 0.0) -> Case:
    directions = np.concatenate([ring(4, 28), ring(8, 45)])
    return gloss((0,), scale=scale, noise=noise, roughness=roughness, directions=directions)
