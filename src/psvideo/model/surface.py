"""The surface at one instant, as photometric stereo gives it: which way every pixel faces, and how much it reflects."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import UsageError, check_kind

Pixels = NDArray[np.floating]

MEASURED, TWO_LIGHTS, ONE_LIGHT, NO_LIGHT = np.uint8(1), np.uint8(2), np.uint8(3), np.uint8(4)
"""Where a pixel's normal is from (``Surface.source``): three lights or more, two and the albedo around it, one and the
normals around it, or those alone. 0 is what the picture does not show."""


class Reflectance(NamedTuple):
    """What a subject shows beyond n . l: c^2, what rough clay throws back towards the light, and 1 - c of what light
    shines through, as shares of its albedo; h^8, h^32 and h^128 in units of albedo.

    c is n . l, and h is n . half way between light and camera.
    """

    curve: float
    rough: float
    soft: float
    broad: float
    middle: float
    narrow: float


class RivalLobes(NamedTuple):
    """Lobes, as those of ``Metal``, of a surface that is flatter or steeper, and how likely they are: what the best
    leave unexplained over what these do, 0 to 1."""

    shown: tuple[float, ...]
    likely: float


class Metal(NamedTuple):
    """What bare metal, and paint full of metal flakes, shows under a light, every pixel in a scale of its own.

    shown: shares of n . l, of lobes h^2, h^4, h^8 up to h^256, and of the same times n . l; h is n . half way between
        light and camera. They sum up to 1.
    rivals: what would explain it too, if worse.
    """

    shown: tuple[float, ...]
    rivals: tuple[RivalLobes, ...]


@dataclass(frozen=True, kw_only=True)
class Subject:
    """What the rounds of a take share of their subject. ``reflectance``: beyond n . l, None where that explains little
    and the subject counts as matte. ``metal``: what it shows in n . l's place, None where it is none."""

    reflectance: Reflectance | None
    metal: Metal | None = None


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """What the lights leave unexplained in a typical pixel of one picture, whichever pixel that is.

    share: of the pixel's own light, as a standard deviation; noise and a rig that is wrong make it. The solver never
        takes it for less than 0.3 %.
    error_deg: the normal's predicted standard error there, without what noise makes of it.
    noise_deg: what noise makes of it.
    distance_share: the share of the subject where near lights' distance is known so little that a normal may be turned
        too far for it to be trusted; such places say nothing of ``error_deg``.
    reflectance: what the subject shows beyond n . l, None where that explains little.
    sigmas: how far off each light's measurements are, over those of a light of mean strength; empty where the noise is
        not known.
    """

    share: float
    error_deg: float
    noise_deg: float = 0.0
    distance_share: float = 0.0
    reflectance: Reflectance | None = None
    sigmas: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Distances:
    """How far away near lights' falloff puts what a picture shows, on every ``step``-th row and column of it.

    depth_m: (row, col), of single places along the camera's axis, in metres, above 0 everywhere.
    costs: (ratio, row, col), how badly the distances ``plane_m`` (row, col) times e^``logs`` (ratio,) explain the light
        of every ``each``-th of these rows and columns; ``weight`` (row, col), how much that counts.
    """

    depth_m: NDArray[np.float32]
    step: int
    costs: NDArray[np.float32]
    weight: NDArray[np.float32]
    plane_m: NDArray[np.float32]
    logs: NDArray[np.float64]
    each: int


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Normals, albedo and what to think of them, per pixel; all arrays are finite everywhere.

    Attributes
    ----------
    normals
        Shape (row, col, 3), unit vectors in the camera frame (x right, y up, z to the camera); (0, 0, 0) where there is
        none: where not valid, or, of a surface that was filled, where ``source`` is 0.
    albedo
        Shape (row, col) or (row, col, channel), linear light: a plate is albedo * intensity * max(0, n . l). One fixed
        scale, never stretched to its own maximum; 0 where there is no normal.
    valid
        Shape (row, col), True where the normal was measured and is to be trusted.
    residual
        Shape (row, col), root mean square over the measurements used of what the fit does not explain, in units of
        sensor saturation; 0 where not valid. None where it was not asked for. Three measurements of one channel are
        always explained exactly, right or wrong.
    error_deg
        Shape (row, col), the normal's standard error in degrees as the solver judges it; 0 where there is no normal.
        None where it was not asked for.
    source
        Shape (row, col), uint8: how a pixel got its normal, MEASURED, TWO_LIGHTS, ONE_LIGHT or NO_LIGHT; 0 where there
        is none. None where nothing was filled, and all that is not valid is 0.
    misfit
        What is common to the picture; None where the solver does not look for it, or three lights explain all.
    slope_deg
        By how many degrees a typical normal is turned as albedo that goes with the slope shows it, which paint does
        not: a sheen, haze, a lamp of another strength. 0 where nobody looked for it.
    likely_deg
        How far off a typical normal is likely to be beyond noise, as a standard error, by what is predicted and how the
        lights stand: what a report says of the picture. None where nothing shows it, as under three lights.
    shadows_lit
        Whether light from other surfaces is seen in the subject's shadows, 0 to 1; 0 where nobody looked for it.
    distances
        How far away the falloff of near lights puts what is shown; None where it was not asked, or agrees with the
        rig's plane.

    Notes
    -----
    Arrays are float32, or float16 where a solver was asked for half floats. Channels lie in separate planes in memory,
    so ``normals[..., 0]`` is contiguous.
    """

    normals: Pixels
    albedo: Pixels
    valid: NDArray[np.bool_]
    residual: Pixels | None = None
    error_deg: Pixels | None = None
    misfit: Misfit | None = None
    source: NDArray[np.uint8] | None = None
    slope_deg: float = 0.0
    likely_deg: float | None = None
    shadows_lit: float = 0.0
    distances: Distances | None = None

    @property
    def shown(self) -> NDArray[np.bool_]:
        """Shape (row, col), True where there is a normal, measured or not."""
        return self.valid if self.source is None else self.source > 0

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Shape (row, col), True where three lights or more gave the normal, to be trusted or not."""
        return self.valid if self.source is None else self.valid | (self.source == MEASURED)

    def __post_init__(self) -> None:
        """Raise UsageError where these are no arrays, or their shapes do not belong together."""
        for name in ("normals", "albedo", "valid"):
            check_kind(name, getattr(self, name), np.ndarray, "a numpy array")
        size = self.valid.shape
        shapes = [self.normals.shape[:2], self.albedo.shape[:2]]
        shapes += [plane.shape for plane in (self.residual, self.error_deg, self.source) if plane is not None]
        if len(size) != 2 or any(shape != size for shape in shapes) or self.normals.shape != (*size, 3):
            raise UsageError(
                f"`normals` {self.normals.shape}, `albedo` {self.albedo.shape} and `valid` {size} do not match; "
                "expected (row, col, 3), (row, col) or (row, col, 3), and (row, col) of one picture."
            )


def check_surface(surface: object) -> None:
    """Raise UsageError where ``surface`` is something else, such as its normals alone."""
    made = "ps.solve_images gives one, ps.Surface(normals=..., albedo=..., valid=...) holds arrays"
    check_kind("surface", surface, Surface, f"a Surface: {made}")
