"""The lights as the solvers see them: directions and intensities as arrays, checked to span all three directions."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.ground import Ground
from psvideo.model.irradiance.near_light import NearField, is_near, middle_directions, near_field
from psvideo.model.rig import LEAST_LIGHTS, Light, directions, intensities
from psvideo.solve.depth.view import View

MAX_CONDITION = 20.0
"""Lights within about 3 degrees of one plane; a normal's error is the noise's times this."""


@dataclass(frozen=True, kw_only=True)
class Illumination:
    """The lights. ``directions`` (light, 3) are unit vectors from the surface to the light; ``intensities`` is
    (light, channel): a plate is albedo * intensity * max(0, n . direction). With near lights both hold in the middle of
    the surface, and ``near`` says what they are in every pixel. ``view`` is the camera's: gloss and roughness depend on
    the way to it, too."""

    directions: Doubles
    intensities: Doubles
    names: tuple[str, ...] = ()
    near: NearField | None = None
    view: View = field(default_factory=View)

    @cached_property
    def shares(self) -> Doubles:
        """By how much each channel counts (channel,), beside what a surface's own colour says: all 1 under white light.

        Divided by its light a channel that lights hardly send holds as much more noise. Where noise is alike in all
        channels, this is one over what the lights' mean square makes of it: with lights of one colour, that of a least
        squares fit. It is the same for all lights, for what a surface of another colour shows must compare.
        """
        divided_by = self.intensities / self.intensities.mean(axis=1, keepdims=True)
        return np.asarray(1 / np.mean(1 / divided_by**2, axis=0))

    @cached_property
    def noise_shares(self) -> tuple[float, float]:
        """What combining the channels of a grey surface leaves of a channel's noise variance, in the dark and of what
        grows with light: both one over the number of channels under white light."""
        shares, total = self.shares, self.shares.sum()
        times = self.intensities.mean(axis=1, keepdims=True) / self.intensities
        return float(1 / total), float((shares**2 * times).sum(axis=1).mean() / total**2)

    @cached_property
    def noisiness(self) -> Doubles:
        """How noisy a light's measurement is, its channels combined (light,), over all lights' root mean square:
        1 for all where their colours are alike, whatever their strengths."""
        divided_by = self.intensities / self.intensities.mean(axis=1, keepdims=True)
        squares = (self.shares**2 / divided_by**2).sum(axis=1)
        return np.asarray(np.sqrt(squares / squares.mean()))

    @property
    def singular_values(self) -> Doubles:
        """The three singular values of the directions, largest first; the last is 0 where all lie in one plane."""
        values: Doubles = np.linalg.svd(self.directions, compute_uv=False).astype(np.float64)
        return values

    @property
    def condition(self) -> float:
        """The directions' condition number: 1.0 at best, infinite where all lights lie in one plane."""
        largest, _, smallest = self.singular_values
        return float(largest / smallest) if smallest > 1e-12 * largest else float("inf")


def illumination(
    lights: Sequence[Light], *, channels: int, ground: Ground | None = None, view: View = View()
) -> Illumination:
    """Return the lights as arrays, fit for solving pictures of 1 or 3 channels as the camera's ``view`` is; near ones
    need a ``ground``, which knows the view.

    Raises PsvideoError where there are fewer than three lights, where one is near without a ground or cannot stand
    where it is said to, where one has no or a negative intensity, and where they are so nearly coplanar that no normal
    could be trusted (condition number above MAX_CONDITION).
    """
    names = tuple(light.name for light in lights)
    if len(lights) < LEAST_LIGHTS:
        raise PsvideoError(
            f"Normals need at least three lights, and here are {len(lights)} ({', '.join(names) or 'none'}). "
            "Flash three or more lights that do not lie in one plane with the subject."
        )
    lit = _arrays(lights, channels, ground, view)
    for name, strengths in zip(names, lit.intensities, strict=True):
        if not (np.isfinite(strengths).all() and (strengths > 0).all()):
            raise PsvideoError(
                f"Light {name!r} has the intensity {', '.join(f'{value:g}' for value in strengths)}; expected numbers "
                "above 0. Measure the light, or take it out of the rig and the plan."
            )
    _refuse_coplanar(lit)
    return lit


def _arrays(lights: Sequence[Light], channels: int, ground: Ground | None, view: View) -> Illumination:
    names, strengths = tuple(light.name for light in lights), intensities(lights, channels)
    if ground is None or not is_near(lights):
        return Illumination(directions=directions(lights), intensities=strengths, names=names, view=view)
    near = near_field(lights, ground)
    at_middle = strengths * near.middle_gain[:, None]
    view = View(focal_px=ground.focal_px, principal_px=ground.principal_px)
    return Illumination(directions=middle_directions(near), intensities=at_middle, names=names, near=near, view=view)


def _refuse_coplanar(lit: Illumination) -> None:
    if lit.condition <= MAX_CONDITION:
        return
    values = ", ".join(f"{value:.3g}" for value in lit.singular_values)
    raise PsvideoError(
        f"The lights {', '.join(lit.names)} lie nearly in one plane with the subject: their directions' condition "
        f"number is {lit.condition:.3g} (at most {MAX_CONDITION:g} is accepted), singular values {values}. Across that "
        "plane normals would be noise. Move a light out of the plane (spread the lights around the lens rather than "
        "along a line), add one, or check the rig's directions."
    )
