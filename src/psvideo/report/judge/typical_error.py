"""How far off a typical normal is, by what shows it: what lights leave unexplained, noise, albedo with the slope."""

from collections.abc import Sequence

import numpy as np

from psvideo.report.observe.against_noise import usual
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.observed import Observed
from psvideo.solve.normals.trust.unchecked import ALL_EXPLAINED

COMMON_DEG = 3.0
"""What a typical normal may be off by beyond noise."""
LOST_DEG = 15.0
"""From here on a normal says little of the surface: photographs under directions that were 1 to 8 degrees off came to
13, and a bear under eight lights nearly in one plane to 18."""
MEAN_OF_HELD = 0.83
"""Predicted errors hold two thirds of the true ones; this is the mean as a share of it, for errors in two directions
(Rayleigh)."""
CHANGE_OF_SPREAD = 1.18
"""The median difference of two normals, in standard deviations of one (both directions together; Rayleigh)."""
HARDLY_OFF = 0.05
"""Four directions that are 5 degrees off leave 1 to 3 % of the light, 10 degrees 2 to 6 % (normals are 4 to 10 degrees
off), 20 degrees 6 to 11 %."""
AT_REST = 0.05
"""Noise is judged by results between which less of the picture than this moves."""
NOISY_DEG, LOST_NOISY_DEG = 4.0, 10.0


def three_fire(observed: Observed) -> bool:
    """Return whether as few lights give light as explain any surface."""
    return int(observed.firing.sum()) == ALL_EXPLAINED


def off_deg(observed: Observed) -> float | None:
    """Return how far off a typical normal is by more than noise, in the mean; None where nothing says so."""
    known = [one.misfit.error_deg for one in observed.facts if one.misfit is not None]
    return MEAN_OF_HELD * float(np.median(known)) if known else None


def likely_deg(observed: Observed) -> float | None:
    """Return how far off a typical normal is likely to be beyond noise, in the mean; None where nothing says so. Grades
    go by ``off_deg``, which is more under lights that stand far apart: it is never far too small."""
    known = [one.likely_deg for one in observed.facts if one.likely_deg is not None]
    return MEAN_OF_HELD * float(np.median(known)) if known else None


def by_noise_deg(facts: Sequence[InstantFacts]) -> float:
    """Return by how much noise turns a typical normal, in the mean; 0 where nothing says so."""
    known = [one.misfit.noise_deg for one in facts if one.misfit is not None]
    return MEAN_OF_HELD * float(np.median(known)) if known else 0.0


def distance_unknown_share(observed: Observed) -> float:
    """Return in which share of the subject near lights' distance is not known."""
    known = [one.misfit.distance_share for one in observed.facts if one.misfit is not None]
    return float(np.median(known)) if known else 0.0


def by_slope_deg(facts: Sequence[InstantFacts]) -> float:
    """Return by how much typical normals are turned, in the mean, as albedo that goes with the slope shows it; 0 where
    nothing does."""
    return float(np.median([one.slope_deg for one in facts])) if facts else 0.0


def steady_beyond_noise(observed: Observed) -> bool:
    """Return whether normals at rest change so little between results that noise is not to blame for what is not
    trusted, and the rig explains the plates: of few lights nothing else separates gloss or compression from noise.

    What is not trusted shows the mean of several rounds, which hides their noise: the plates' own counts as well."""
    known = [one.change.normals_deg for one in observed.facts if one.change is not None]
    steady = bool(known) and max(float(np.median(known)), noise_changes_deg(observed)) < COMMON_DEG
    return steady and rig_explains(observed)


def noise_changes_deg(observed: Observed) -> float:
    """Return by how much the plates' noise turns a typical normal that faces the camera from one round to the next, in
    the median; 0 where the rig or the noise is not known."""
    if observed.points is None or not observed.closely.noises:
        return 0.0
    lights = observed.points.vectors[:, observed.firing].mean(axis=0)
    spread = np.linalg.pinv(lights / np.abs(lights[:, 2]).max())  # by the brightest light, as the noise is
    turned = float(np.sqrt(np.sum(spread[:2] ** 2))) / usual(observed.closely.noises).pixel_ratio
    return CHANGE_OF_SPREAD * float(np.degrees(turned))


def rig_explains(observed: Observed) -> bool:
    """Return whether the rig explains what each light gives."""
    fit = observed.rig_fit
    return fit is not None and fit.excess <= HARDLY_OFF


def moves(facts: Sequence[InstantFacts], *, share: float = AT_REST) -> bool:
    """Return whether a usual round shows motion, of more than a ``share`` of the picture."""
    shares = [one.moving_share for one in facts if one.moving_share is not None]
    return bool(shares) and float(np.median(shares)) > share


def quiet(facts: Sequence[InstantFacts], *, change_deg: float = NOISY_DEG, noise_deg: float = NOISY_DEG) -> bool:
    """Return whether normals are steady enough to be compared with each other: those at rest change by less than
    ``change_deg`` between results, and noise turns a typical one by less than ``noise_deg``."""
    known = [one.change.normals_deg for one in facts if one.change is not None and (one.moving_share or 0.0) < AT_REST]
    return by_noise_deg(facts) < noise_deg and (not known or float(np.median(known)) < change_deg)
