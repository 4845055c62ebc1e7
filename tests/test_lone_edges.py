"""What goes through its own period between flashes looks alike in each light's plates: edges give it away."""

import cv2
import numpy as np
import pytest

from psvideo.plates.align.doubt.lone_edges import FOLLOWED, InstantSketch, unsure_by_lone_edges
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.align.velocity.flow import TOE, Sketch
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust.moving_doubt import moving_doubt_deg

ROWS, COLS, SIDE = 96, 128, 20
LIGHTS = ("key", "left", "right")


def sketches(codes: list[np.ndarray], noise: float = 1.0) -> list[InstantSketch]:
    return [InstantSketch(codes=np.rint(each).astype(np.uint8), white=0.8, noise=noise) for each in codes]


def doubts(shown: list[InstantSketch]) -> list[np.ndarray]:
    return list(unsure_by_lone_edges(shown, np.zeros((ROWS, COLS), np.bool_)))


def square(code: float, left: int, ground: float = 120.0) -> np.ndarray:
    picture = np.full((ROWS, COLS), ground)
    picture[30 : 30 + SIDE, left : left + SIDE] = code
    return picture


def test_paint_has_the_same_edges_under_every_light() -> None:
    paint = square(60, 50) / 120
    assert not np.any(doubts(sketches([120 * paint, 200 * paint, 90 * paint])))


def test_where_every_light_shows_its_own_square_all_their_light_is_unsure() -> None:
    moved = [square(190, 27), square(200, 50), square(180, 67)]
    for unsure in doubts(sketches(moved)):
        assert unsure[40, 40:80].min() > 0.01
        assert unsure[:5, :5].max() == 0


def test_the_edge_of_a_shadow_counts_a_tenth_of_that_of_a_square() -> None:
    shadow, lit = (np.max(doubts(sketches([square(code, 50), square(120, 50), square(120, 50)]))) for code in (8, 200))
    assert shadow < 0.1 * lit


@pytest.mark.parametrize("soft_px", [0.6, 1.0])
def test_beside_a_shadow_that_only_one_light_throws_nothing_is_unsure(soft_px: float) -> None:
    shadow = cv2.GaussianBlur(square(4, 50), (0, 0), soft_px)
    assert not np.any(doubts(sketches([shadow, square(120, 50), square(120, 50)])))


def wave(toward: float, height_px: float, length_px: float = 60.0) -> np.ndarray:
    """The codes of a bare wavy wall under a light that comes from the left or the right, so far aside."""
    slope = height_px * 2 * np.pi / length_px * np.cos(2 * np.pi * np.arange(COLS) / length_px)
    light = np.maximum(0.8 - toward * slope, 0) / np.sqrt(1 + slope**2)
    return np.broadcast_to(255 * (np.sqrt(0.8 * light + TOE) - TOE**0.5), (ROWS, COLS))


@pytest.mark.parametrize("height_px", [4.0, 7.0])
def test_waves_that_every_light_shades_otherwise_have_no_edges(height_px: float) -> None:
    assert np.max(doubts(sketches([wave(toward, height_px) for toward in (-0.6, 0.0, 0.6)]))) < 0.001


def test_less_of_it_counts_where_all_lights_agree_with_a_motion() -> None:
    shown, moves = sketches([square(190, 27), square(200, 50), square(180, 67)]), np.ones((ROWS, COLS), np.bool_)
    for still, followed in zip(doubts(shown), unsure_by_lone_edges(shown, moves), strict=True):
        assert np.any(still)
        assert np.allclose(followed, FOLLOWED * still)


def test_two_lights_say_nothing_of_each_other() -> None:
    assert not np.any(doubts(sketches([square(190, 30), square(190, 70)])))


def test_noise_is_no_edge() -> None:
    rng = np.random.default_rng(3)
    noisy = [np.clip(rng.normal(60, 3, (ROWS, COLS)), 0, 255) for _ in LIGHTS]
    assert np.max(doubts(sketches(noisy, noise=4.2))) < 0.002


def test_a_light_under_which_nothing_moves_speaks_on_the_grid_of_the_others() -> None:
    codes = square(190, 40).astype(np.uint8)
    sketch = Sketch(
        number=1,
        time_s=0.0,
        codes=codes,
        seen=np.ones((ROWS, 1), np.bool_),
        blocks=np.zeros((ROWS // 4, COLS // 4), np.float32),
        white=0.7,
    )
    coarse = InstantSketch.standing(sketch, (ROWS // 2, COLS // 2))
    assert coarse.codes.shape == (ROWS // 2, COLS // 2)
    assert coarse.codes[20, 25] == 190
    assert coarse.white == 0.7


def filmed(lefts: tuple[int, int, int], changed: float) -> tuple[np.ndarray, float]:
    """Return where normals are trusted, and how much of the squares: three lights that show one each, at their own
    places, round after round, but for the first round, which shows their upper rows ``changed``."""
    turns = np.array([0.3, 2.4, 4.5])
    directions = np.stack([0.5 * np.cos(turns), 0.5 * np.sin(turns), np.full(3, 0.866)], axis=1)
    rng = np.random.default_rng(7)
    plates = []
    for number in (1, 2, 3):
        for n, (name, left) in enumerate(zip(LIGHTS, lefts, strict=True)):
            image = 0.35 * square(2.2, left, 1.0)
            if number == 1:
                image[30:35, left : left + SIDE] *= changed
            noisy = np.asarray(image + rng.normal(0, 0.002, image.shape), np.float32)
            time_s = (4 * (number - 2) + n - 1) * 0.009
            seen = np.ones(ROWS, np.bool_)
            plates.append(LightPlate(light=name, number=number, time_s=time_s, picture=mixture_of(noisy), seen=seen))
    one = list(aligned(plates, LIGHTS, Aligning(), first=1))[1]
    lit = Illumination(directions=directions, intensities=np.ones((3, 1)), names=LIGHTS)
    surface = Solving().solve([plate.image for plate in one.plates], lit, unsure=one.unsure)
    squares = surface.valid[36 : 30 + SIDE, min(lefts) : max(lefts) + SIDE]
    return surface.valid, float(squares.mean())


@pytest.mark.parametrize(("lefts", "trusted"), [((54, 54, 54), True), ((34, 47, 68), False)])
def test_what_stands_in_every_lights_plates_but_elsewhere_in_each_is_not_trusted(
    lefts: tuple[int, int, int], trusted: bool
) -> None:
    valid, share = filmed(lefts, 0.7)
    assert share > 0.95 if trusted else share < 0.03
    assert valid[:, :12].mean() > 0.95


def test_normals_that_belong_to_no_surface_are_in_doubt_where_something_stirs() -> None:
    shape = (100, 100)
    known, torn, turned = np.ones(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    torn[20:60, 20:60] = 8.0
    assert not moving_doubt_deg(turned, torn, known).any()
    turned[50:60, 50:60] = 1.0
    doubt = moving_doubt_deg(turned, torn, known)
    assert doubt[42:50, 42:50].min() > 5
    assert not doubt[:10].any(), "a third of the subject away"
    alone = moving_doubt_deg(turned, np.zeros(shape, np.float32), known)
    np.testing.assert_array_equal(moving_doubt_deg(turned, torn, known, steadied=True), alone)
    turned[:] = 0
    moves = np.zeros(shape, np.bool_)
    moves[50:60, 50:60] = True
    for steadied in (False, True):
        assert moving_doubt_deg(turned, torn, known, moves, steadied=steadied)[42:50, 42:50].min() > 5


def test_creases_and_outlines_of_what_is_followed_rightly_are_hardly_in_doubt() -> None:
    shape = (100, 100)
    known, turned = np.ones(shape, np.float32), np.full(shape, 0.6, np.float32)
    torn = np.zeros(shape, np.float32)
    torn[:, 48:52] = 4.0
    plain = moving_doubt_deg(turned, np.zeros(shape, np.float32), known)
    assert (moving_doubt_deg(turned, torn, known) - plain).max() < 1.5
