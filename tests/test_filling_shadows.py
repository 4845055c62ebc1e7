"""Shadows on a wall, and paint in a shadow: filled as what lies around them, not as what stands before them."""

import cv2
import numpy as np
from angles import angles_deg

from psvideo.model.surface import MEASURED, ONE_LIGHT, TWO_LIGHTS, Surface
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving

SIZE, FINER = 160, 4
LIGHTS = np.array([[0.6, 0.1, 0.79], [-0.5, 0.5, 0.71], [-0.1, -0.7, 0.71]])
LIGHTS = LIGHTS / np.linalg.norm(LIGHTS, axis=1, keepdims=True)
WALL, BALL = np.array([0.3, 0.3, 0.3]), np.array([0.6, 0.56, 0.5])
RADIUS, BEFORE = 36.0, 30.0  # of the ball, and how far its middle is before the wall, in pixels


def grid() -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of every part of a pixel, from the middle of the picture, in pixels."""
    y, x = np.mgrid[: SIZE * FINER, : SIZE * FINER] / FINER - SIZE / 2
    return x, -y


def sharp_ball() -> tuple[np.ndarray, np.ndarray]:
    """Return the normals (row, col, 3) of a ball and the wall behind it, and where the ball is."""
    x, y = grid()
    inside = x * x + y * y < RADIUS**2
    z = np.sqrt(np.where(inside, RADIUS**2 - x * x - y * y, 0)) / RADIUS
    towards_us = np.stack([np.zeros_like(x), np.zeros_like(x), np.ones_like(x)], axis=-1)
    return np.where(inside[..., None], np.stack([x / RADIUS, y / RADIUS, z], axis=-1), towards_us), inside


def shown(shade: np.ndarray, colour: np.ndarray) -> np.ndarray:
    """Return a plate whose pixels are means, with a camera's noise."""
    plate = cv2.resize(shade[..., None] * colour, (SIZE, SIZE), interpolation=cv2.INTER_AREA)
    return np.asarray(plate + np.random.default_rng(4).normal(0, 0.0015, plate.shape), np.float32)


def solved(plates: list[np.ndarray]) -> Surface:
    return Solving(error=True).solve(plates, Illumination(directions=LIGHTS, intensities=np.ones((3, 3))))


def before_a_wall() -> tuple[Surface, np.ndarray]:
    """Return what comes of a ball that casts shadows on a wall of another paint, and where nothing but wall is."""
    normals, inside = sharp_ball()
    x, y = grid()
    plates = []
    for light in LIGHTS:
        along = (x * light[0] + y * light[1] - BEFORE * light[2], x * x + y * y + BEFORE**2 - RADIUS**2)
        cast = ~inside & (along[0] < 0) & (along[0] ** 2 > along[1])
        shade = np.where(cast, 0, np.maximum(normals @ light, 0))
        plates.append(shown(shade, np.where(inside[..., None], BALL, WALL)))
    near = cv2.dilate(inside.astype(np.uint8), np.ones((3 * FINER, 3 * FINER), np.uint8))
    return solved(plates), cv2.resize(near, (SIZE, SIZE), interpolation=cv2.INTER_NEAREST) == 0


def test_shadows_on_a_wall_have_the_normal_of_the_wall_around_them() -> None:
    """On the ball's outline mixed pixels have three lights, and colours between both: nothing starts at them."""
    surface, wall = before_a_wall()
    assert surface.source is not None
    apart = angles_deg(surface.normals, np.broadcast_to([0.0, 0.0, 1.0], surface.normals.shape))
    two, one = wall & (surface.source == TWO_LIGHTS), wall & (surface.source == ONE_LIGHT)
    assert two.sum() > 6000
    assert apart[two].mean() < 3
    assert np.median(apart[two]) < 2.5
    assert one.sum() > 40
    assert apart[one].mean() < 6


def test_a_shadow_s_rim_does_not_turn_what_is_filled_from_it() -> None:
    """A light shows a part of what it would where its shadow ends; a wall has no such normals."""
    x, y = grid()
    dark = x * x + y * y < 50.0**2
    plates = [shown(light[2] * ~(dark & (n == 0)), WALL) for n, light in enumerate(LIGHTS)]
    surface = solved(plates)
    assert surface.source is not None
    two = surface.source == TWO_LIGHTS
    apart = angles_deg(surface.normals, np.broadcast_to([0.0, 0.0, 1.0], surface.normals.shape))
    assert two.sum() > 6000
    assert apart[two].mean() < 2.5


def test_paint_that_three_lights_show_nowhere_does_not_bend_what_two_light() -> None:
    """Its albedo is not the one around it, so that the normal around it goes on."""
    normals, inside = sharp_ball()
    x, y = grid()
    spot = (x - 5) ** 2 + (y - 4) ** 2 < 10.0**2
    colour = np.where(spot[..., None], [0.12, 0.12, 0.13], BALL) * inside[..., None]
    cast = (x - 5) ** 2 + (y - 4) ** 2 < 18.0**2
    plates = [shown(np.maximum(normals @ light, 0) * ~(cast & (n == 0)), colour) for n, light in enumerate(LIGHTS)]
    surface = solved(plates)
    assert surface.source is not None
    small = np.asarray(cv2.resize(normals, (SIZE, SIZE), interpolation=cv2.INTER_AREA), np.float64)
    small = small / np.maximum(np.linalg.norm(small, axis=-1, keepdims=True), 1e-6)
    painted = cv2.resize(spot.astype(np.uint8), (SIZE, SIZE), interpolation=cv2.INTER_NEAREST) > 0
    assert not (painted & (surface.source == MEASURED)).any()
    apart = angles_deg(surface.normals, small)[painted & (surface.source == TWO_LIGHTS)]
    assert len(apart) > 250
    assert apart.mean() < 20
