"""Shading misleads where things turn; that one surface must explain all lights' plates shows the true velocity."""

import math

import cv2
import numpy as np
import pytest
from sketched_pairs import pairs_around, sketched

from psvideo.model.arrays import Flags, Floats
from psvideo.model.rig import Light
from psvideo.plates.align.by_surface import BySurface
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.velocity.flow import Sketch
from psvideo.plates.align.velocity.followed import Followed, Pair
from psvideo.plates.align.velocity.moving import followed_at

SHAPE, COUNT, RADIUS_PX = (160, 192), 4, 62.0
TURN_PER_S = math.radians(20)
"""How fast the ball turns about its upright axis."""
FLASHES_S = 1 / (COUNT + 1) * (np.arange(COUNT) - (COUNT - 1) / 2)
HEIGHT = math.radians(45)


def lights() -> list[Light]:
    around = [2 * math.pi * n / COUNT + 0.3 for n in range(COUNT)]
    flat, up = math.cos(HEIGHT), math.sin(HEIGHT)
    return [Light(name=f"l{n}", direction=(flat * math.cos(a), flat * math.sin(a), up)) for n, a in enumerate(around)]


def ball() -> tuple[Flags, Floats]:
    """Where the ball is, and its normals (row, col, 3): x right, y up, z to the camera."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float32)
    x, y = (x - (SHAPE[1] - 1) / 2) / RADIUS_PX, ((SHAPE[0] - 1) / 2 - y) / RADIUS_PX
    depth = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    return np.asarray(depth > 0), np.stack([x, y, depth], axis=-1).astype(np.float32)


def paint(turned: float) -> Floats:
    """The paint that a ball shows which turned so far."""
    _, normals = ball()
    angle = np.arctan2(normals[..., 0], normals[..., 2]) - turned
    spots = cv2.GaussianBlur(np.random.default_rng(5).normal(size=(400, 800)), (0, 0), 9)
    places = ((angle / math.pi + 1) % 2 * 400).astype(np.float32), ((normals[..., 1] + 1) * 199).astype(np.float32)
    shown = cv2.remap((spots / spots.std()).astype(np.float32), *places, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(np.clip(0.5 + 0.08 * shown, 0.1, 0.9), np.float32)


def seen(light: int, time_s: float, turns: bool) -> Sketch:
    """A light's sketch of the ball before an even wall."""
    inside, normals = ball()
    direction = np.array(lights()[light].direction, np.float32)
    shaded = paint(TURN_PER_S * time_s * turns) * np.maximum(normals @ direction, 0)
    noise = np.random.default_rng([light, int(1e4 * (time_s + 9))]).normal(0, 0.002, SHAPE)
    image = np.asarray(np.where(inside, shaded, 0.3 * direction[2]) + noise, np.float32)
    return sketched(image, light, time_s)


def pairs(turns: bool = True) -> dict[str, Pair]:
    """Every light's plates before and after the instant 0."""
    return pairs_around(lambda light, time_s: seen(light, time_s, turns), FLASHES_S)


def known(turned: int = 0) -> Lamps:
    lamps = Lamps.of(lights(), [light.name for light in lights()])
    assert lamps is not None
    return Lamps(names=lamps.names, matrix=np.roll(lamps.matrix, turned, axis=0))


def followed(shown: dict[str, Pair], lamps: Lamps | None) -> Followed:
    by_surface = BySurface.of(lamps, shown, {})
    return followed_at([*shown.values()], 0.0, choose=None if by_surface is None else by_surface.chosen)


def followed_share(found: Followed) -> float:
    """The share of the ball's middle whose velocity is true to a pixel in a round."""
    _, normals = ball()
    off = np.hypot(found.velocity[0] - TURN_PER_S * RADIUS_PX * normals[..., 2], found.velocity[1])
    return float((off[normals[..., 2] > 0.7] < 1.0).mean())


def test_a_painted_ball_that_turns_is_followed_where_the_lights_are_known() -> None:
    shown = pairs()
    unknown, told = followed_share(followed(shown, None)), followed_share(followed(shown, known()))
    assert told > 0.3
    assert told > 4 * unknown


def test_the_wall_beside_it_is_not_carried_along() -> None:
    inside, _ = ball()
    beside = cv2.erode((~inside).view(np.uint8), np.ones((5, 5), np.uint8)) > 0
    assert followed(pairs(), known()).moves[beside].mean() < 0.01


def test_what_stands_goes_nowhere() -> None:
    shown = pairs(turns=False)
    assert not followed(shown, known()).moves.any()


@pytest.mark.parametrize("lost", ["lamps", "a sketch"])
def test_without_lamps_or_a_sketch_nothing_is_chosen(lost: str) -> None:
    shown = pairs()
    if lost == "lamps":
        assert BySurface.of(None, shown, {}) is None
    else:
        del shown["l2"]
        assert BySurface.of(known(), shown, {"l2": None}) is None


def test_a_light_under_which_nothing_moves_tells_as_well() -> None:
    shown = pairs()
    at_rest = seen(0, 0.0, turns=True)
    del shown["l0"]
    by_surface = BySurface.of(known(), shown, {"l0": at_rest})
    assert by_surface is not None
    found = followed_at([*shown.values()], 0.0, others=1, choose=by_surface.chosen)
    assert followed_share(found) > 4 * followed_share(followed_at([*shown.values()], 0.0, others=1))
