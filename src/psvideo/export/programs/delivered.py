"""One delivery as other programs need to know it: names, numbers, rate, size, lights."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from psvideo.export.sequences.result_files import Delivery


@dataclass(frozen=True, kw_only=True)
class SeenLight:
    """A lamp as the middle of the surface sees it: the way to it in the frame of the normals, and its colour."""

    name: str
    direction: Sequence[float]
    colour: Sequence[float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Delivered:
    """What other programs have to know of one delivery.

    ``numbers`` rise; ``lights`` are empty where they have no one direction.
    """

    clip: str
    numbers: tuple[int, ...]
    fps: Fraction
    width_px: int
    height_px: int
    metric: bool
    delivery: Delivery
    lights: tuple[SeenLight, ...] = ()

    @property
    def first(self) -> int:
        """The number of the first instant."""
        return self.numbers[0]

    @property
    def last(self) -> int:
        """The number of the last instant."""
        return self.numbers[-1]
