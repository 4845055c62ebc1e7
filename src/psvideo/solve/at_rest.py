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
    """The ``doubts`` of rounds up to ``number``: of those since which everything stood, and the last one's normals."""

    number: int
    doubts: Doubts

    @classmethod
    def since(cls, one: Round, doubts: Doubts) -> "AtRest":
        """Return what a round leaves to the next one: no looks where it moved, or where frames of it were missing."""
        whole = one.unsure is None and one.doubtful is None and all(plate.seen.all() for plate in one.plates)
        return cls(number=one.number, doubts=doubts if whole else Doubts(latest=doubts.latest))

    def until(self, one: Round) -> Doubts:
        """Return the doubts that hold in the next round too, and whether it looks again; no looks where it moved."""
        if one.number != self.number + 1:
            return Doubts()
        if one.stood is None or not one.stood.all() or one.unsure is not None:
            return Doubts(latest=self.doubts.latest, stood=one.stood)
        again = one.number % LOOKS_EVERY == 0 or not self.doubts.looks
        return replace(self.doubts, look_again=again, stood=one.stood)
