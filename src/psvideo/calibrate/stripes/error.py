"""How certain a fitted frequency is, from the residuals as they are: they are not independent.

Texture, lines of the sensor and a model that is not quite right correlate residuals from row to row, from frame to
frame or along a block of columns. The error of the estimate is the spread of the sum of all rows' pulls on it, and that
is measured in several ways, each for another kind of correlation; the largest is taken.
"""

from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles

FEWEST_CLUSTERS = 4
REACHES_PERIODS = (0.0, 0.25, 0.5, 1.0)
"""How far apart residuals may be alike, in periods of the stripes."""
MOST_LEVERAGE = 0.8


@dataclass(frozen=True, kw_only=True)
class Pulls:
    """The residuals' pulls on the estimate, by row, by frame and by block of columns; ``information`` by row."""

    rows: Doubles
    information: Doubles
    frames: Doubles
    groups: Doubles


def standard_error(pulls: Pulls, period_rows: float) -> float:
    """Return the standard error of the estimate on which the pulls act.

    By rows: Newey and West 1987, over several reaches; by frames and blocks: sums of squares of the clusters' pulls
    (Liang and Zeger 1986). A fit bends towards the stretches that decide it, above all the ends of the picture, so
    their residuals are too small: they are enlarged as by leaving half a period out (jackknife; MacKinnon and White
    1985).
    """
    rows = pulls.rows.size
    reach = max(1, round(period_rows / 2))
    share = np.convolve(pulls.information, np.ones(reach), "same") / pulls.information.sum() + reach / rows
    enlarged = pulls.rows / (1 - np.clip(share, 0, MOST_LEVERAGE))
    by_rows = (_spread(enlarged, max(1, round(part * period_rows))) for part in REACHES_PERIODS)
    clusters = (part for part in (pulls.frames, pulls.groups) if part.size >= FEWEST_CLUSTERS)
    by_cluster = (float(part @ part) * part.size / (part.size - 1) for part in clusters)
    return float(np.sqrt(max(*by_rows, *by_cluster)) / pulls.information.sum())


def _spread(pulls: Doubles, reach: int) -> float:
    """Return the variance of a sum of pulls that are alike over less than ``reach`` rows."""
    likeness = np.array([pulls[lag:] @ pulls[: pulls.size - lag] for lag in range(min(reach, pulls.size))])
    taper = 1 - np.arange(likeness.size) / reach
    return float(2 * taper @ likeness - likeness[0])
