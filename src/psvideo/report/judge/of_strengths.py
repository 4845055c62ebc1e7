"""Which lights are not as strong as the rig says, where that explains what the rig leaves over."""

from collections.abc import Sequence

from psvideo.report.observe.rig_and_curve.rigfit import RigFit

STRENGTH_MISFIT, BY_STRENGTH, OTHER_STRENGTH = 0.05, 0.5, 1.25
"""Of the light that another rig would explain, what counts where other strengths of some lights, half of them at most,
take half of it away."""
OTHER_LAMP, BY_LAMP, TURNED_DEG, OF_OWN = 1.12, 0.6, 1.5, 1.5
"""Under many lights strengths that shadows and highlights change little count where they leave at most the second
share, turn normals by more than the third, and leave no more than so many times what no rig would explain: other
directions leave more. On photographs of a bear, a cat, a ball and a sphere, 8 to 12 lights: none of 45 sets with right
rigs, 1 of 135 with directions that are off by 3 to 10 degrees. Two lights that are 1.3 and 0.75 times as strong are
named in 28 of 45 sets, of 8 in 14 of 16; a single one of ten mostly does no harm. Beside a light of 6 % of the others',
which the rig says as well, they are in 25 of 45, and 1 of 45 right sets is called wrong. The bear's first 19
photographs are a quarter brighter than the rest, and named."""


def other_strengths(lights: Sequence[str], fit: RigFit) -> list[tuple[str, float]]:
    """Return the lights that are not as strong as the rig says, with what they are over that: half of them at most, and
    none where other strengths explain no more than other directions or a surface that shines would."""
    if fit.excess > STRENGTH_MISFIT and fit.scaled_misfit < BY_STRENGTH * fit.misfit:
        off = _off(lights, fit.strengths, OTHER_STRENGTH)
        if off:
            return off
    lamps = fit.lamps
    if lamps is None or lamps.turned_deg < TURNED_DEG:
        return []
    if lamps.left_free > min(BY_LAMP * lamps.left, OF_OWN * fit.own_misfit):
        return []
    return _off(lights, lamps.ratios, OTHER_LAMP)


def _off(lights: Sequence[str], strengths: Sequence[float], factor: float) -> list[tuple[str, float]]:
    """Return the lights whose strengths differ by more than a factor; none where those are more than half."""
    off = [one for one in zip(lights, strengths, strict=True) if not 1 / factor < one[1] < factor]
    return off if len(off) <= len(lights) / 2 else []
