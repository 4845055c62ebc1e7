"""What lights show around an instant, as sketches: for tests of what moves between them."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Floats
from psvideo.plates.align.velocity.flow import Sketch, sketch_of
from psvideo.plates.align.velocity.followed import Pair
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of


def sketched(image: Floats, light: int, time_s: float) -> Sketch:
    """The sketch of a light's plate, of which everything was seen."""
    picture, rows = mixture_of(np.asarray(image, np.float32)), np.ones(len(image), np.bool_)
    plate = LightPlate(light=f"l{light}", number=0, time_s=time_s, picture=picture, seen=rows)
    return sketch_of(plate, white=0.9)


def pairs_around(seen: Callable[[int, float], Sketch], flashes_s: NDArray[np.floating]) -> dict[str, Pair]:
    """Every light's sketches before and after the instant 0, by when it flashes in a round of one second."""
    found = {}
    for light, at_s in enumerate(flashes_s):
        first_s = float(at_s) - (at_s > 0)
        found[f"l{light}"] = Pair(before=seen(light, first_s), after=seen(light, first_s + 1.0))
    return found
