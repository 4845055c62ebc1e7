"""The rig: where the lights are and how strong, as measured by calibration or given by the user.

Camera frame: x right, y up, z from the surface towards the camera. A distant light has a direction, the unit vector
from the surface to the light; a near light has a position in metres, origin at the optical centre, scene at negative z.
"""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace

import numpy as np

from psvideo.errors import PsvideoError, UsageError, check_kind, nearest
from psvideo.model.arrays import Doubles
from psvideo.model.units import counted

Vector = tuple[float, float, float]
LEAST_LIGHTS = 3
"""Fewer lights give no normals."""


def too_few_measured(measured: int, *, shown: int) -> bool:
    """Return whether fewer than half of the lights that were shown were measured, or fewer than the three that normals
    need, though so many were shown: what was measured is chance then.

    >>> [too_few_measured(measured, shown=4) for measured in (1, 2, 3)], too_few_measured(1, shown=2)
    ([True, True, False], False)
    """
    return 2 * measured < shown or measured < LEAST_LIGHTS <= shown


def vector(values: Sequence[float] | Doubles) -> Vector:
    """Return three numbers as records hold them."""
    return float(values[0]), float(values[1]), float(values[2])


UNIT_TOLERANCE = 0.01
"""A unit vector's length may be off by this much: two digits a number, as people write them."""
ROUNDED = 1e-9
"""Vectors whose length is off by more are made unit ones."""


def three_numbers(name: str, given: object, expected: str) -> Doubles:
    """Return a parameter as three finite numbers, shape (3,); raises UsageError where it is anything else."""
    try:
        numbers = np.asarray(given, np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise UsageError(f"`{name}` is {given!r:.60}; expected {expected}.")
    return numbers


@dataclass(frozen=True, kw_only=True)
class Light:
    """One light. ``plate = albedo * intensity * max(0, n . direction)`` at power 1 and the reference duration.

    Attributes
    ----------
    name
        As in the plan.
    intensity
        One number or one per channel, above 0; for a near light the irradiance at 1 m.
    direction
        Of a distant light: the unit vector from the surface to it, in the camera's frame.
    position_m
        Of a near light, instead of a direction: where it is in metres, the origin at the optical centre.
    error_deg
        The direction's standard error in degrees, where calibration gave one.
    reference_duration_s
        For how long the light shone when its intensity was measured; None means as long as the plan flashes it.
    anisotropy, axis
        Of a near light: it falls off with this power of the cosine from its axis, the unit vector the way it shines.
    colour
        Of a coloured light: how much of its intensity the camera's red, green and blue see on white. None: white.
    """

    name: str
    intensity: tuple[float, ...] = (1.0,)
    direction: Vector | None = None
    position_m: Vector | None = None
    error_deg: float | None = None
    reference_duration_s: float | None = None
    anisotropy: float | None = None
    axis: Vector | None = None
    colour: Vector | None = None

    def __post_init__(self) -> None:
        if np.ndim(self.intensity) != 1:
            raise UsageError(
                f"`intensity` of light {self.name!r} is {self.intensity!r:.60}; expected one number in a tuple, "
                "(0.8,), or one per channel, (0.8, 0.7, 0.5)."
            )
        for name in ("direction", "position_m", "axis"):
            given = getattr(self, name)
            if given is None:
                continue
            vector = three_numbers(name, given, "three numbers (x, y, z): x right, y up, z towards the camera")
            length = float(np.linalg.norm(vector))
            if name != "position_m" and abs(length - 1) > UNIT_TOLERANCE:
                raise UsageError(
                    f"`{name}` of light {self.name!r} has length {length:.4g}; expected a unit vector. Divide it by "
                    "its length; how strong a light is belongs into `intensity`."
                )
            if name != "position_m" and abs(length - 1) > ROUNDED:
                object.__setattr__(self, name, tuple((vector / length).tolist()))
        if self.colour is not None:
            three_numbers("colour", self.colour, "what red, green and blue see of the light: three numbers from 0 on")
        if (self.direction is None) == (self.position_m is None):
            both = "neither" if self.direction is None else "both"
            raise UsageError(
                f"Light {self.name!r} has {both} of `direction` and `position_m`; expected a direction of a distant "
                "light, or the position of a near one."
            )

    @property
    def by_channel(self) -> tuple[float, ...]:
        """The intensity in the camera's channels: times the colour, where the light has one."""
        if self.colour is None:
            return self.intensity
        strengths = self.intensity if len(self.intensity) == 3 else self.intensity[:1] * 3
        return tuple(strength * part for strength, part in zip(strengths, self.colour, strict=True))


@dataclass(frozen=True)
class Rig:
    """The lights, with the camera's perspective and a first guess of the surface where near lights need them.

    Attributes
    ----------
    lights
        One Light each; near and distant ones may stand side by side.
    focal_px, principal_px
        The lens: focal lengths (x, y) and principal point (col, row) in pixels; None where it is not known.
    plane
        (a, b, c, d) of the plane a x + b y + c z + d = 0 in which the subject stands, camera's frame, in metres.
    surface_colour
        What is known of the subject's colour, red, green and blue in any unit: needed where one flash of several
        colours is all there is. None: not known.
    """

    lights: tuple[Light, ...]
    _: KW_ONLY
    focal_px: tuple[float, float] | None = None
    principal_px: tuple[float, float] | None = None
    plane: tuple[float, float, float, float] | None = None
    surface_colour: Vector | None = None

    def __post_init__(self) -> None:
        given: object = self.lights
        if not (isinstance(given, Sequence) and all(isinstance(one, Light) for one in given)):
            raise UsageError(
                f"`lights` of a Rig are of type {type(given).__name__}; expected a tuple of Lights, each "
                "ps.Light(name=..., direction=(x, y, z)). Directions as an array (light, 3) go to ps.solve_images as "
                "they are."
            )

    @property
    def names(self) -> tuple[str, ...]:
        """The lights' names, in the file's order."""
        return tuple(light.name for light in self.lights)

    def select(self, names: Sequence[str]) -> tuple[Light, ...]:
        """Return the named lights in the given order; raises PsvideoError that names the ones the rig lacks."""
        by_name = {light.name: light for light in self.lights}
        lacking = [name for name in names if name not in by_name]
        if lacking:
            raise PsvideoError(
                f"The rig has no light named {', '.join(map(repr, lacking))}, which the plan flashes or pictures are "
                f"named after; {nearest(lacking[0], by_name)} Give the lights the same names there and in the rig file."
            )
        return tuple(by_name[name] for name in names)

    def ordered(self, names: Sequence[str]) -> "Rig":
        """Return the rig with the named lights only, in the given order; raises as ``select``.

        >>> rig = Rig(lights=(Light(name="key", direction=(0, 0, 1)), Light(name="left", direction=(-0.6, 0, 0.8))))
        >>> rig.ordered(["left", "key"]).names
        ('left', 'key')
        """
        return replace(self, lights=self.select(names))


def check_rig(rig: object) -> None:
    """Raise UsageError where ``rig`` is something else, such as a path or directions."""
    check_kind("rig", rig, Rig, "a Rig: ps.read_rig(path) reads one, ps.Rig(lights=[...]) holds Lights")


def directions(lights: Sequence[Light]) -> Doubles:
    """Return the unit directions of distant lights, shape (light, 3); raises PsvideoError where a light is near."""
    near = [light.name for light in lights if light.direction is None]
    if near:
        raise PsvideoError(
            f"Light {near[0]!r} has a position (a near light), and nothing says where the surface is. Add [camera] and "
            "[surface] to the rig, or give the light a direction: the unit vector from the middle of the surface to it."
        )
    return np.array([light.direction for light in lights], np.float64)


def intensities(lights: Sequence[Light], channels: int) -> Doubles:
    """Return the lights' intensities, shape (light, channel); one number stands for all channels.

    Raises PsvideoError where a light has another count of channels than the pictures.
    """
    for light in lights:
        if len(light.by_channel) not in (1, channels):
            what = "intensities" if light.colour is None else "channels in its colour"
            raise PsvideoError(
                f"Light {light.name!r} has {len(light.by_channel)} {what} and the pictures have "
                f"{counted(channels, 'channel')}; expected one number, or one per channel."
            )
    return np.array([np.broadcast_to(light.by_channel, channels) for light in lights], np.float64)
