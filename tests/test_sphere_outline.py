"""A mirror's outline in rooms that it mirrors: windows along the rim, stands, blur, noise; the truth is known."""

from collections.abc import Sequence

import numpy as np
import pytest
from bench.mirror_rooms import Panel, Room, film, random_room
from bench.mirror_scene import Ball, Lamp, Lens

from psvideo.calibrate.light_pictures import light_pictures
from psvideo.calibrate.sphere.outline import SAME, Outline, find_outlines
from psvideo.calibrate.sphere.rim_fit import Rim, fit_rim
from psvideo.calibrate.sphere.rim_model import Surface
from psvideo.calibrate.sphere.sphere_view import SphereView
from psvideo.model.arrays import Doubles, Floats

LENS = Lens(width=190, height=190, focal=800.0)
BALL = Ball(centre=(0.01, -0.006, -0.6), radius_m=0.045)
LAMPS = [Lamp(direction=way) for way in ((0.3, 0.4, 0.87), (-0.5, 0.2, 0.84), (0.1, -0.4, 0.9))]
WASHES = ((1.0, 0.5, 0.0), (0.5, -0.6, 0.3), (0.8, 0.0, -0.5))
FLOOR = Panel(towards=(0.0, -1.0, -0.02), half_deg=(80.0, 80.0), brightness=0.03)
WINDOW = Panel(towards=(1.0, 0.3, -0.6), half_deg=(6.0, 20.0), brightness=0.3)
ROOMS = {
    "chrome before a bright wall": Room(wall=0.4, washes=WASHES, blur_px=1.2),
    "black glass before a bright wall, its rim fading": Room(wall=0.3, washes=WASHES, facing=0.05, blur_px=1.8),
    "a window along the rim, a stand that hides the foot": Room(
        wall=0.15, washes=WASHES, panels=(WINDOW,), stand=0.3, blur_px=1.0
    ),
    "a floor, whose horizon is mirrored just inside the rim": Room(
        wall=0.15, washes=WASHES, panels=(FLOOR,), blur_px=0.8
    ),
    "an edge in the wall": Room(wall=0.1, washes=WASHES, step=(30.0, 1.0, 4.0), blur_px=0.8, noise=0.004),
}


def truth() -> np.ndarray:
    x, y, z = BALL.centre
    middle = LENS.middle + LENS.focal * np.array([x, -y]) / -z
    return np.array([*middle, LENS.focal * np.tan(np.arcsin(BALL.radius_m / np.linalg.norm(BALL.centre)))])


def outline_in(room: Room, *, seed: int = 0) -> Outline:
    pictures = light_pictures("abc", film(LENS, BALL, LAMPS, room, seed=seed))
    found = find_outlines(pictures, SphereView(focal_px=LENS.focal, principal_px=(94.5, 94.5)))
    assert len(found) == 1
    return found[0]


@pytest.mark.parametrize("name", ROOMS)
def test_an_outline_is_found_where_the_ball_ends_and_its_error_is_owned(name: str) -> None:
    found = outline_in(ROOMS[name])
    away = found.place[:3] - truth()
    own = np.sqrt(np.diag(found.covariance)[:3])
    assert np.abs(away).max() < 0.6
    assert (np.abs(away) < 2.5 * own).all()
    assert own.max() < 2.0


def test_the_rooms_edges_that_a_ball_mirrors_within_its_rim_do_not_pass_for_the_rim() -> None:
    """A room in which five of 55 pixels were lost: three edges lie within the rim, and stand out more than it does."""
    rng = np.random.default_rng(123)
    lens = Lens(width=480, height=380, focal=float(rng.uniform(700, 2500)))
    radius_px, x, y = float(rng.uniform(50, 150)), *(lens.middle + [rng.uniform(-40, 40), rng.uniform(-30, 30)] + 0.5)
    count = int(rng.choice([3, 4, 6, 8]))
    turn, height = np.arange(count) * 2 * np.pi / count + rng.uniform(0, 6), np.radians(rng.uniform(25, 70, count))
    ways = np.stack([np.cos(height) * np.cos(turn), np.cos(height) * np.sin(turn), np.sin(height)], axis=1)
    towards = np.array([(x - lens.middle[0]) / lens.focal, -(y - lens.middle[1]) / lens.focal, -1.0])
    across, up, back = towards / np.linalg.norm(towards) / np.sin(np.arctan2(radius_px, lens.focal))
    lamps = [Lamp(direction=(float(way[0]), float(way[1]), float(way[2]))) for way in ways]
    images = film(lens, Ball(centre=(across, up, back), radius_m=1.0), lamps, random_room(rng, lights=count), seed=123)
    view = SphereView(focal_px=lens.focal, principal_px=(float(lens.middle[0]), float(lens.middle[1])))
    found = find_outlines(light_pictures([str(n) for n in range(count)], images), view)[0]
    away = np.abs(found.place[:3] - [x, y, radius_px])
    assert away.max() < 0.7
    assert (away < 2 * np.sqrt(np.diag(found.covariance)[:3])).all()


def test_an_outline_that_was_refused_is_not_fitted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a ball that the picture's edge cuts in half, every picture's round things lead to the same outline."""
    places: list[np.ndarray] = []

    def noted(pictures: Sequence[Floats], view: SphereView, around: Doubles, *, surface: Surface) -> Rim | None:
        places.append(around)
        return fit_rim(pictures, view, around, surface=surface)

    monkeypatch.setattr("psvideo.calibrate.sphere.outline.fit_rim", noted)
    cut = Ball(centre=(0.066, 0.0, -0.6), radius_m=0.045)
    pictures = light_pictures("abc", film(LENS, cut, LAMPS, ROOMS["chrome before a bright wall"], seed=0))
    assert find_outlines(pictures, SphereView(focal_px=LENS.focal, principal_px=(94.5, 94.5))) == []
    apart = [np.abs(one - other)[:3].max() for n, one in enumerate(places) for other in places[:n]]
    assert len(places) > 0
    assert min(apart, default=np.inf) > SAME * 50
