"""What rounds at rest share: how far normals may be off beyond noise, which is looked for in every fourth of them.

What speaks against normals is smooth, and changes with the surface and its light only. Looking for it takes four tenths
of solving a round, and finds the same again, but for noise, where nothing changed since the last look.
"""

from dataclasses import dataclass, replace

from psvideo.plates.sequence import Round
from psvideo.solve.normals.trust.doubts import Doubts

LOOKS_EVERY = 4
"""It is looked for in rounds whose numbers this divides. As many rounds as are pooled (POOLED_ROUNDS) hold all looks
that are pooled, so that a run that begins with a block of them has the same mean in the next as one that began earlier.
"""


@dataclass(frozen=True, kw_only=True)
class AtRest:
    """The ``doubts`` of rounds up to ``number``, since which everything stood."""

    number: int
    doubts: Doubts

    @classmethod
    def since(cls, one: Round, doubts: Doubts) -> "AtRest | None":
        """Return what a round leaves to the next one: nothing where it moved, or where frames of it were missing."""
        whole = one.unsure is None and one.doubtful is None and all(plate.seen.all() for plate in one.plates)
        return cls(number=one.number, doubts=doubts) if whole else None

    def until(self, one: Round) -> Doubts:
        """Return the doubts that hold in the next round too, and whether it looks again; none where it moved."""
        stood = one.stood is not None and bool(one.stood.all()) and one.unsure is None
        if not stood or one.number != self.number + 1:
            return Doubts()
        return replace(self.doubts, look_again=one.number % LOOKS_EVERY == 0)
