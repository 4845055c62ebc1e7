"""One plate per light, the light that each shows, and what of them counts: what every solver starts from."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

from psvideo.model.arrays import Floats, Mask, Samples
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.normals.illumination import Illumination

Plates = Sequence[Samples] | Sequence[Mixture]


@dataclass(frozen=True)
class LitPlates:
    """Plates, one per light of ``lit`` in its order, each (row, col) or (row, col, 3), all of one type: float32 with
    1.0 = saturation, or uint16 codes, for which (code - ``black_level``) * ``scale`` is that; or pictures that are not
    made yet, of which no more than a band of rows ever is.

    ``seen``: which rows (light, row) or pixels (light, row, col) every light shows; ``mask`` (row, col): where to
    solve; both everything where they are left out. ``unsure`` (light, row, col), on a grid of its own over the picture,
    is by how much plates may be off for motion; ``moves`` (row, col), on that grid, where something was followed;
    ``steadied``: beside that plates were brought together by one shift of the whole picture. ``arc_deg`` (row, col),
    on that grid too, is by how much normals may be off because what moves turns between two plates of a light.
    """

    plates: Plates
    lit: Illumination
    _: KW_ONLY
    seen: Mask | None = None
    mask: Mask | None = None
    unsure: Floats | None = None
    moves: Mask | None = None
    steadied: bool = False
    arc_deg: Floats | None = None
    black_level: float = 0.0
    scale: float = 1.0

    @property
    def moved(self) -> bool:
        """Whether any plate may be off for motion."""
        return self.unsure is not None and bool(self.unsure.any())
