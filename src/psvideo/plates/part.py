"""A part of a take's frames that is gathered by itself, to the same plates as all of them would give.

What plates owe to frames elsewhere is little: the ambient light up to the part's first flash, which earlier dark slots
show, and the white by which sketches of a light's plates are coded, which its first plate sets. Both are handed in.
"""

from dataclasses import dataclass, field

from psvideo.plates.ambient.ambient_followed import Ambient


@dataclass(frozen=True, kw_only=True)
class Part:
    """The frames to gather, and what is known from the frames before.

    numbers: of the frames, ascending, those of the take between a first and a last one.
    whites: by light, the white of the clip's first plate; lights that are missing are put in as their plates come.
    ambient: what the dark slots before the part's first complete flash showed; None where there is none.
    """

    numbers: tuple[int, ...]
    whites: dict[str, float] = field(default_factory=dict)
    ambient: Ambient | None = None
