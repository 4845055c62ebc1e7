"""Highlights and cast shadows: the virtual scene gloss.toml, least squares (before) and robust solving (after).

Compared over the pixels that all of the compared solvers call valid.
"""

from collections.abc import Iterator

import numpy as np

from bench.accuracy_l1 import l1_normals
from bench.accuracy_measure import Accuracy, Case, angles_deg, described, errors_deg, gloss
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.robust import huber1981

CASES: tuple[tuple[str, tuple[int, ...], float, float], ...] = (
    ("8 lights", tuple(range(8)), 1.0, 0.0),
    ("8 lights, 0.5 % noise", tuple(range(8)), 1.0, 0.005),
    ("8 lights, twice the highlights", tuple(range(8)), 2.0, 0.0),
    ("6 lights", (0, 1, 2, 3, 4, 6), 1.0, 0.0),
    ("5 lights", (0, 2, 4, 5, 7), 1.0, 0.0),
    ("4 lights, --solver robust", (0, 1, 2, 3), 1.0, 0.0),
)
L1_PIXELS = 4000


def rows() -> Iterator[Accuracy]:
    """Give every case, and the calibration of what is predicted."""
    cases = [(name, gloss(lights, scale=scale, noise=noise)) for name, lights, scale, noise in CASES]
    for name, case in cases:
        given = LitPlates(case.plates, case.lit)
        plain, careful = woodham1980.solve(given), huber1981.solve(given)
        both = plain.valid & careful.valid
        before, after = errors_deg(plain, case, both), errors_deg(careful, case, both)
        yield Accuracy(
            name, described(before), "robust", described(after), "better", bool(after.mean() < before.mean())
        )
    yield _beside_l1(cases[0][1])
    for name, case in cases:
        yield calibration(name, case)


def _beside_l1(case: Case) -> Accuracy:
    """Robust solving beside the exact minimum of absolute residuals over the same usable measurements."""
    careful = huber1981.solve(LitPlates(case.plates, case.lit))
    chosen = np.flatnonzero((careful.valid & case.mask).ravel())
    chosen = np.random.default_rng(2).choice(chosen, L1_PIXELS, replace=False)
    truth = case.truth.reshape(-1, 3)[chosen]
    l1 = angles_deg(l1_normals(case, chosen), truth)
    own = angles_deg(careful.normals.reshape(-1, 3)[chosen], truth)
    return Accuracy(
        "8 lights, beside a per-pixel L1",
        described(l1),
        "robust",
        described(own),
        "<= L1",
        bool(own.mean() <= l1.mean()),
    )


def calibration(name: str, case: Case) -> Accuracy:
    """Predicted standard error against the true error of the valid pixels."""
    surface = huber1981.solve(LitPlates(case.plates, case.lit))
    where = surface.valid & case.mask
    assert surface.error_deg is not None
    predicted, true = surface.error_deg[where], errors_deg(surface, case)
    within, twice = np.mean(true <= predicted), np.mean(true <= 2 * predicted)
    sound = np.mean(true <= 10)
    return Accuracy(
        f"{name}: predicted against true",
        f"{np.median(predicted):.2f}° predicted, {np.median(true):.2f}° true (medians)",
        "",
        f"{100 * within:.0f} % within it, {100 * twice:.0f} % within twice; "
        f"valid {100 * where[case.mask].mean():.1f} %, {100 * sound:.1f} % of them within 10°",
        "95 % within 10°",
        bool(sound >= 0.95),
    )
