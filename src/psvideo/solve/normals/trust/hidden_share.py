"""How much of what is not matte lights hide from being held against each other: a normal and an albedo follow it."""

from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.trust.unchecked import ALL_EXPLAINED, FEW_LIGHTS, turned_unseen

ENOUGH_LIGHTS = 12
"""What ``hidden`` is measured by: this many lights hide little of what is not matte."""
TELLING, TELLING_OF_FOUR, FOUR_BESIDE_SLOPE, HIDDEN_POWER, MOST_HIDDEN = 2.6, 16.0, 24.0, 0.8, 2.0
"""How far lights hide what is not matte beside sets of lights that turn normals unseen (``turned_unseen``) so many
times, five and six of them, or four, or four where albedo by slope counts as well, with this power of it, and up to so
much more. Over 490 sets of 4 to 8 lights of bear, cat, ball, bunny and grey sphere, errors over claims of a subject go
with that measure to the powers 0.4 to 0.6 (half of this one is used, ``few_power``), and not with the lights' condition
number. More would trust less that is wrong, and claim medians that are over 1.5 times too large."""


def hidden_of(lit: Illumination, *, plain: bool, beside_slope: bool = True) -> float:
    """Return how many times more than ``ENOUGH_LIGHTS`` these lights hide of what is not matte, since a normal and an
    albedo follow it: by their number or, of four to six, by how they stand, whichever is more.

    plain: residuals are of least squares, whose mean squares are for each measurement left free: their number does not
    matter. beside_slope: what albedo shows is counted by itself (``by_slope.py``).
    """
    lights = len(lit.directions)
    by_number = 1.0 if plain else hidden_by(lights) / hidden_by(ENOUGH_LIGHTS)
    few = ALL_EXPLAINED < lights <= FEW_LIGHTS
    return max(by_number, _hidden_by_places(lit, plain=plain, beside_slope=beside_slope)) if few else by_number


def _hidden_by_places(lit: Illumination, *, plain: bool, beside_slope: bool) -> float:
    """Return the same of few lights by how they stand: how much farther than others they turn normals unseen, as a
    power, up to ``MOST_HIDDEN``. Least squares is what solves four, and their measure of its own."""
    of_four = FOUR_BESIDE_SLOPE if beside_slope else TELLING_OF_FOUR
    times = turned_unseen(lit) / (of_four if plain else TELLING)
    return min(float(times**HIDDEN_POWER), MOST_HIDDEN)


def hidden_by(lights: int) -> float:
    """Return all lights over those that a normal and an albedo leave to be held against them.

    >>> hidden_by(5), hidden_by(12)
    (2.5, 1.3333333333333333)
    """
    return lights / max(lights - 3, 1)
