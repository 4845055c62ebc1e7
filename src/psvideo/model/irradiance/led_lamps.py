"""Lights that stand in one place are one lamp: which these are, and what a lamp is called."""

from collections.abc import Sequence
from itertools import takewhile

import numpy as np

from psvideo.model.rig import Light

ONE_PLACE_DEG, ONE_PLACE_M = 2.0, 0.03
"""The LEDs of one lamp are a few millimetres apart, and each is measured to a degree or so."""


def lamp_places(lights: Sequence[Light]) -> list[tuple[int, ...]]:
    """Return the places of every lamp's lights among ``lights``, in the order of the lamps' first."""
    lamps: list[list[int]] = []
    for place, light in enumerate(lights):
        home = next((lamp for lamp in lamps if _in_one_place(lights[lamp[0]], light)), None)
        if home is None:
            lamps.append([place])
        else:
            home.append(place)
    return [tuple(lamp) for lamp in lamps]


def lamps_of(lights: Sequence[Light]) -> tuple[tuple[str, ...], ...]:
    """Return the names of the lights of every lamp: those that stand in one place."""
    return tuple(tuple(lights[place].name for place in lamp) for lamp in lamp_places(lights))


def _in_one_place(one: Light, other: Light) -> bool:
    if one.direction is not None and other.direction is not None:
        return bool(np.dot(one.direction, other.direction) > np.cos(np.deg2rad(ONE_PLACE_DEG)))
    if one.position_m is not None and other.position_m is not None:
        return bool(np.linalg.norm(np.subtract(one.position_m, other.position_m)) < ONE_PLACE_M)
    return False


def lamp_names(lights: Sequence[str], lamps: Sequence[tuple[int, ...]]) -> tuple[str, ...]:
    """Return a name for every lamp: what its lights' names begin with (key of key_red and key_green), else all."""
    names = []
    for lamp in lamps:
        own = [lights[place] for place in lamp]
        stem = own[0] if len(own) == 1 else _common_start(own).rstrip("_-. ")
        names.append(stem or "+".join(own))
    if len(set(names)) < len(names):
        return tuple("+".join(lights[place] for place in lamp) for lamp in lamps)
    return tuple(names)


def _common_start(names: Sequence[str]) -> str:
    return "".join(letters[0] for letters in takewhile(lambda some: len(set(some)) == 1, zip(*names, strict=False)))
