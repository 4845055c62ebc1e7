"""A part of a take's frames that is gathered by itself, to the same plates as the whole take would give.

Plates depend on frames elsewhere in two ways only: the ambient light before the part's first flash, known from earlier
dark slots, and the white by which a light's sketches are coded, set by its first plate. Both are handed in.
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
