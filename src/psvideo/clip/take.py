"""A take: a clip that is open, and the frames of it that are to be used."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from psvideo.clip.kept import Kept, keeping_near
from psvideo.clip.record import Clip
from psvideo.errors import check_kind
from psvideo.model.irradiance.colours import Unmixing
from psvideo.model.plan import Plan


@dataclass(frozen=True, kw_only=True)
class Take:
    """A clip that is open, and the numbers of its frames that are to be used.

    Attributes
    ----------
    clip
        The footage: its size, and what is odd about it (``warnings``, ``notes``).
    numbers
        Of the frames to use.
    kept
        Holds pictures that are decoded already, and takes those that will be looked at again.
    unmixing
        How flashes of several colours are separated; the clip's plan is then as results show it. None: they are not.
    """

    clip: Clip
    numbers: tuple[int, ...]
    kept: Kept | None = None
    unmixing: Unmixing | None = None

    @property
    def plan(self) -> Plan:
        """The plan that the strobe played, with the lights that results show."""
        return self.clip.plan

    def unmixed(self, unmixing: Unmixing | None) -> "Take":
        """Return the take with its flashes separated by colour, once its timing was found."""
        if unmixing is None:
            return self
        return replace(self, clip=replace(self.clip, plan=unmixing.shown), unmixing=unmixing)


def check_take(take: object) -> None:
    """Raise UsageError where ``take`` is something else, such as a path."""
    check_kind("take", take, Take, "a Take: ps.open_take(path) opens one")


@contextmanager
def decoded_once(take: Take, *, output: Path) -> Iterator[Take]:
    """Give the take with a store for its decoded frames, on the disk of ``output``; at the end the store is gone."""
    with keeping_near(output) as kept:
        yield replace(take, kept=kept)
