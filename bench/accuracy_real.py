"""Real subjects, and another renderer's: plain least squares over everything (before), robust solving (after)."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bench.accuracy_measure import (
    SHARED_DATA,
    Accuracy,
    Case,
    described,
    diligent_ball,
    errors_deg,
    rendered_bunny,
    spread_subsets,
    washington_sphere,
)
from bench.accuracy_robust import calibration
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.robust import huber1981

DIM = replace(huber1981.USABLE, dark_level=0.0005)  # DiLiGenT's 16-bit exposures are short


def rows() -> Iterator[Accuracy]:
    """Give the real subjects; nothing where they are not on this machine."""
    if not SHARED_DATA.is_dir():
        yield Accuracy("the real captures (../shared/data) are not on this machine")
        return
    ball = diligent_ball()
    yield _row(ball, "DiLiGenT ball, 48 lights", 1.9)
    yield _subsets(ball, 12, 20, 2.8)
    yield _subsets(ball, 8, 20, None)
    bunny, sphere = rendered_bunny(), washington_sphere()
    yield _row(bunny, "rendered bunny, cast shadows, 25 lights", None)
    yield _row(sphere, "Washington's matte sphere, 12 lights", None)
    for name, case in (("bunny", bunny), ("matte sphere", sphere)):
        yield calibration(name, case)


def _row(case: Case, name: str, bar_deg: float | None) -> Accuracy:
    before = errors_deg(woodham1980.solve(LitPlates(case.plates, case.lit), usable=woodham1980.EVERYTHING), case)
    after = errors_deg(huber1981.solve(LitPlates(case.plates, case.lit), usable=DIM), case)
    bar = "better" if bar_deg is None else f"<= {bar_deg:g}°"
    met = bool(after.mean() <= (before.mean() if bar_deg is None else bar_deg))
    return Accuracy(name, described(before), "robust", described(after), bar, met)


def _subsets(case: Case, lights: int, count: int, bar_deg: float | None) -> Accuracy:
    """The mean over random sets of lights that are well spread."""
    means = []
    for chosen in spread_subsets(case.lit.directions, lights, count):
        some = case.choose(chosen)
        plain = woodham1980.solve(LitPlates(some.plates, some.lit), usable=woodham1980.EVERYTHING)
        careful = huber1981.solve(LitPlates(some.plates, some.lit), usable=DIM)
        means.append(
            (errors_deg(plain, some).mean(), errors_deg(careful, some).mean(), careful.valid[case.mask].mean())
        )
    plain_deg, careful_deg, valid = np.mean(means, axis=0)
    worst = max(mean for _, mean, _ in means)
    return Accuracy(
        f"DiLiGenT ball, {count} random sets of {lights} lights",
        f"{plain_deg:.2f}°",
        "robust",
        f"{careful_deg:.2f}° (worst set {worst:.2f}°), {100 * valid:.1f} % valid",
        "better" if bar_deg is None else f"<= {bar_deg:g}°",
        bool(careful_deg <= (plain_deg if bar_deg is None else bar_deg)),
    )
