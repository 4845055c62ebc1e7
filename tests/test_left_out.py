"""A normal without the lights of which nothing is sure is better only where the others lie well."""

import numpy as np
import pytest

from psvideo.model.arrays import Flags
from psvideo.model.rig import Light
from psvideo.plates.align.as_they_are import MATTE
from psvideo.plates.align.doubt.lone_edges import InstantSketch
from psvideo.plates.align.left_out import AtInstant, better_without
from psvideo.plates.align.plate_lamps import Lamps

COUNT, CODE, WHITE, SHARE = 8, 150, 0.8, 0.25
LIT = WHITE * ((CODE / 255 * (np.sqrt(1.02) - np.sqrt(0.02)) + np.sqrt(0.02)) ** 2 - 0.02)
"""What a code stands for: the square root of light, a toe of 0.02 beneath."""
BESIDE, AROUND = (0, 1, 2), (0, 3, 6)


def lamps() -> Lamps:
    around = 2 * np.pi * np.arange(COUNT) / COUNT
    ways = np.stack([0.5 * np.cos(around), 0.5 * np.sin(around), np.full(COUNT, np.sqrt(0.75))], axis=1)
    names = tuple(f"l{n}" for n in range(COUNT))
    lights = [
        Light(name=name, direction=(float(x), float(y), float(z)), intensity=(0.9,))
        for name, (x, y, z) in zip(names, ways, strict=True)
    ]
    known = Lamps.of(lights, names)
    assert known is not None
    return known


def used_of(chosen: tuple[int, ...]) -> Flags:
    used = np.zeros((COUNT, 1, 2), np.bool_)
    used[list(chosen)] = True
    used[:, 0, 1] = True
    return used


def asked(chosen: tuple[int, ...], unsure: float) -> Flags:
    """Ask of two pixels: in the first the chosen lights are sure, in the second nothing is left out."""
    lights = []
    for n in range(COUNT):
        shows = InstantSketch(codes=np.full((1, 2), CODE, np.uint8), white=WHITE, noise=1.0)
        off = np.full((1, 2), 0 if n in chosen else unsure, np.float32)
        lights.append(AtInstant(shows=shows, unsure=off, share=SHARE))
    return better_without(lamps(), lights, used_of(chosen))


def off_by(chosen: tuple[int, ...], unsure: float) -> tuple[float, float]:
    """Return by how much normals times albedo of the chosen lights and of all are off, tried out 20,000 times."""
    rng, known = np.random.default_rng(1), lamps()
    errors = rng.normal(0, MATTE * LIT, (COUNT, 20_000))
    passed = rng.random(errors.shape) < SHARE  # an edge passed before the instant: all of what changed is wrong
    errors += np.where(np.isin(np.arange(COUNT), chosen)[:, None], 0, passed * unsure / SHARE)
    few = np.linalg.lstsq(known.matrix[list(chosen)], errors[list(chosen)])[0]
    every = np.linalg.lstsq(known.matrix, errors)[0]
    return float((few**2).sum(axis=0).mean()), float((every**2).sum(axis=0).mean())


@pytest.mark.parametrize("chosen", [BESIDE, AROUND])
@pytest.mark.parametrize("unsure", [0.002, 0.004, 0.02, 0.08])
def test_lights_are_left_out_where_trials_say_that_the_others_are_better(
    chosen: tuple[int, ...], unsure: float
) -> None:
    few, every = off_by(chosen, unsure)
    assert max(few, every) > 1.3 * min(few, every), "the trials tell"
    assert asked(chosen, unsure).tolist() == [[few < every, False]]


def test_lights_in_a_plane_make_no_normal() -> None:
    assert not asked((0, 4), 0.1).any()


def test_where_nothing_is_left_out_nothing_is_better() -> None:
    assert not asked(tuple(range(COUNT)), 0.1).any()


@pytest.mark.parametrize(("by_chance", "left"), [(False, True), (True, False)])
def test_lights_that_seem_sure_by_chance_make_normals_of_no_surface_and_leave_none_out(
    by_chance: bool, left: bool
) -> None:
    shape, rng = (24, 32), np.random.default_rng(4)
    turn = rng.permuted(np.tile(np.arange(COUNT)[:, None, None], (1, *shape)), axis=0) if by_chance else None
    places = np.arange(COUNT)[:, None, None] if turn is None else turn
    used = np.broadcast_to(np.isin(places, AROUND), (COUNT, *shape))
    codes = np.rint(np.where(used & by_chance, CODE + rng.normal(0, 12, used.shape), CODE)).astype(np.uint8)
    off = np.where(used, 0, 0.08).astype(np.float32)
    lights = [
        AtInstant(shows=InstantSketch(codes=shown, white=WHITE, noise=1.0), unsure=one, share=SHARE)
        for shown, one in zip(codes, off, strict=True)
    ]
    better = better_without(lamps(), lights, used)
    assert (better == left).mean() > 0.95
