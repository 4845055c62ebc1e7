"""The passes of one instant that artists may ask for, made from its plates and its surface."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Mask, Samples
from psvideo.model.surface import Surface
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.plate_noise import noise_of
from psvideo.solve.passes.alpha_matte import soft_matte
from psvideo.solve.passes.light_by_light import Explaining, reach_of, specular_of
from psvideo.solve.passes.plate_rows import PlateRows

FEWEST_FOR_SPECULAR = 4
"""Three lights explain any three brightnesses exactly: nothing is left over."""


@dataclass(frozen=True, kw_only=True)
class AskedPasses:
    """Which passes are asked for; ``weights`` are the lights' in the specular sum, 1 where not named, and ``each``
    asks for it light by light as well."""

    reach: bool = False
    specular: bool = False
    alpha: bool = False
    each: bool = False
    weights: Mapping[str, float] = field(default_factory=dict)

    @property
    def any(self) -> bool:
        """Whether anything is asked for."""
        return self.reach or self.specular or self.alpha


@dataclass(frozen=True, kw_only=True)
class Passes:
    """What was asked for of one instant; None where it was not.

    reach: (row, col), how many lights reach a pixel. specular: (row, col[, 3]), linear light, what the plates' sum
    holds beyond the diffuse model; ``specular_of`` holds the same of each light by itself, half floats.
    alpha: (row, col), 0 to 1, how much of a pixel the subject covers.
    """

    reach: NDArray[np.uint16] | None = None
    specular: NDArray[np.float32] | None = None
    alpha: NDArray[np.float32] | None = None
    specular_of: tuple[NDArray[np.float16], ...] = ()


def passes_of(
    asked: AskedPasses,
    plates: Sequence[Samples] | Sequence[Mixture],
    surface: Surface,
    lit: Illumination,
    *,
    seen: Mask | None = None,
    mask: Mask | None = None,
) -> Passes:
    """Return the passes asked for of plates, one per light, that are clipped from 1.0 on."""
    noise = noise_of(plates)
    rows = PlateRows.of(plates, seen)
    explaining = Explaining(rows=rows, surface=surface, lit=lit, noise=noise, mask=mask)
    weights = [asked.weights.get(name, 1.0) for name in lit.names]
    specular, each = specular_of(explaining, weights, each=asked.each) if asked.specular else (None, ())
    return Passes(
        reach=reach_of(explaining) if asked.reach else None,
        specular=specular,
        specular_of=each,
        alpha=soft_matte(rows, noise, mask=mask) if asked.alpha else None,
    )
