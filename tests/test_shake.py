"""A camera that shakes shifts the whole picture, by another amount at every flash; plates are brought together."""

import math
from collections.abc import Callable, Sequence

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.model.rig import Light
from psvideo.model.surface import Surface
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.align.shake.camera_path import CameraPath, camera_path
from psvideo.plates.align.shake.registered import registered
from psvideo.plates.align.velocity.flow import sketch_of
from psvideo.plates.align.velocity.followed import Pair
from psvideo.plates.align.velocity.vectors import fill_per_s
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.report.observe.observed import Observed

ROWS, COLS, ROUND_S = 128, 176, 1.0
AROUND_PX = 40
"""So much more of the scene lies around the picture, for it to shift."""
NOISE = 0.003
PER_S = 13.2 * math.cos(4.9), -12.2 * math.sin(6.1)
"""How fast the picture that trembles goes in the middle of round 1."""
Way = Callable[[float], tuple[float, float]]


def trembles(time_s: float) -> tuple[float, float]:
    """Where the picture is, right and down: up to 3 px off, forth and back in 1.4 rounds."""
    return 3 * math.sin(4.4 * time_s + 0.5), 2 * math.cos(6.1 * time_s)


def sways(time_s: float) -> tuple[float, float]:
    """As a calm hand does: by a seventh of a pixel more or less from light to light."""
    return 4 * math.sin(0.45 * time_s + 0.4), 3 * math.cos(0.4 * time_s)


def goes(time_s: float) -> tuple[float, float]:
    return 14 * time_s, 5 * time_s


def lights_of(count: int) -> tuple[Light, ...]:
    """So many lights around the camera, each other one a little higher."""
    lights = []
    for n in range(count):
        azimuth, height = 2 * math.pi * n / count + 0.3, math.radians(50 + 8 * (-1) ** n)
        x, y, z = math.cos(azimuth) * math.cos(height), math.sin(azimuth) * math.cos(height), math.sin(height)
        lights.append(Light(name=f"l{n}", direction=(x, y, z)))
    return tuple(lights)


def relief(light: Light, painted: bool) -> NDArray[np.float32]:
    """A relief of hills under a light, as wide and high as the picture and what lies around; painted or bare."""
    rng, size = np.random.default_rng(3), (ROWS + 2 * AROUND_PX, COLS + 2 * AROUND_PX)
    hills, paint = (cv2.GaussianBlur(rng.normal(size=size), (0, 0), spread) for spread in (9, 2))
    slopes = [0.35 * slope / slope.std() for slope in np.gradient(hills)]
    normals = np.stack([-slopes[1], slopes[0], np.ones(size)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    albedo = 0.5 + 0.12 * np.clip(paint / paint.std(), -2, 2) if painted else np.full(size, 0.6)
    assert light.direction is not None
    return np.asarray(albedo * np.maximum(normals @ np.array(light.direction), 0), np.float32)


def seen_at(light: Light, px: Sequence[float], painted: bool) -> NDArray[np.float32]:
    """What the camera sees of it where the picture is so far to the right and down."""
    shift = np.array([[1, 0, px[0] - AROUND_PX], [0, 1, px[1] - AROUND_PX]], np.float64)
    return np.asarray(cv2.warpAffine(relief(light, painted), shift, (COLS, ROWS), flags=cv2.INTER_CUBIC), np.float32)


def flash_s(light: int, count: int) -> float:
    """When a light flashes after a round's middle; behind the last one is a dark slot."""
    return ROUND_S / (count + 1) * (light - (count - 1) / 2)


def plates_of(count: int, way: Way, *, rounds: int = 3, painted: bool = True, moves: bool = False) -> list[LightPlate]:
    """Plates of rounds 0 and later, whose middles lie one second apart; ``moves``: a disc goes by before the relief,
    which the camera's ``way`` does not shift."""
    plates, rng = [], np.random.default_rng(8)
    for number in range(rounds):
        for n, light in enumerate(lights_of(count)):
            time_s = number * ROUND_S + flash_s(n, count)
            image = seen_at(light, (0, 0) if moves else way(time_s), painted)
            if moves:
                y, x = np.mgrid[:ROWS, :COLS]
                right, down = way(time_s)
                inside = np.hypot(x - right - COLS / 2, y - down - ROWS / 2) < 26
                image = np.where(inside, 0.8 * seen_at(light, (right + 11, down), painted), image)
            image = np.asarray(image + NOISE * rng.normal(size=image.shape), np.float32)
            plates.append(
                LightPlate(
                    light=light.name, number=number, time_s=time_s, picture=mixture_of(image), seen=np.ones(ROWS, bool)
                )
            )
    return plates


def path_of(
    count: int, way: Way, *, painted: bool = True, known: bool = True, moves: bool = False, turned: int = 0
) -> CameraPath | None:
    """The path about the middle of round 1; each light is said to stand where the one ``turned`` places on does."""
    plates = plates_of(count, way, painted=painted, moves=moves)
    sketches = {(one.light, one.number): sketch_of(one, white=0.8) for one in plates}
    pairs = []
    for n, light in enumerate(lights_of(count)):
        first = 0 if flash_s(n, count) > 0 else 1
        pairs.append(Pair(before=sketches[light.name, first], after=sketches[light.name, first + 1]))
    names = [light.name for light in lights_of(count)]
    lamps = Lamps.of(lights_of(count), names)
    if lamps is not None and turned:
        lamps = Lamps(names=lamps.names, matrix=np.roll(lamps.matrix, turned, axis=0))
    return camera_path(pairs, lamps if known else None)


def worst_px(path: CameraPath, way: Way) -> float:
    """How far any two flashes' places are off each other."""
    off = np.array([np.array(way(time_s)) for time_s in path.times_s]) - path.places_px
    return float(np.abs(off - off.mean(axis=0)).max())


@pytest.mark.parametrize("painted", [True, False], ids=["painted", "bare"])
@pytest.mark.parametrize("count", [4, 6])
def test_known_lights_show_where_the_picture_was_at_every_flash(count: int, painted: bool) -> None:
    path = path_of(count, trembles, painted=painted)
    assert path is not None
    assert len(path.times_s) == 2 * count
    assert worst_px(path, trembles) < 0.25


def test_a_calm_hand_is_found_too_though_one_velocity_explains_most_of_it() -> None:
    path = path_of(5, sways)
    assert path is not None
    assert worst_px(path, sways) < 0.25


@pytest.mark.parametrize("count", [3, 5])
def test_paint_shows_it_where_lights_are_not_known(count: int) -> None:
    path = path_of(count, trembles, known=False)
    assert path is not None
    assert worst_px(path, trembles) < 0.4


def test_lights_that_are_not_where_they_are_said_to_be_do_not_show_it_but_paint_does() -> None:
    path = path_of(5, trembles, turned=2)
    assert path is not None
    assert worst_px(path, trembles) < 0.4


def test_shading_that_seems_shifted_under_every_light_is_not_taken_for_a_shake() -> None:
    """Bare relief under lights that are not known: pictures of two lights fit each other best some pixels off."""
    assert path_of(5, trembles, painted=False, known=False) is None


@pytest.mark.parametrize("way", [goes, lambda _: (0.0, 0.0)], ids=["one velocity", "rest"])
def test_a_camera_that_stands_or_goes_on_evenly_does_not_shake(way: Way) -> None:
    assert path_of(5, way) is None


def test_what_trembles_before_a_wall_that_stands_is_no_shake_of_the_camera() -> None:
    assert path_of(5, trembles, moves=True) is None


def test_two_pictures_are_registered_and_left_as_they_are() -> None:
    """Also those whose sides OpenCV need not pad before it transforms them."""
    wide = cv2.GaussianBlur(np.random.default_rng(4).normal(0, 200, (144, 180)), (0, 0), 2).astype(np.float32)
    one, other = wide[8:136, 8:168].copy(), wide[5:133, 12:172].copy()
    before = one.copy(), other.copy()
    np.testing.assert_allclose(registered(one, other).px, (-4, 3), atol=0.01)
    np.testing.assert_array_equal(one, before[0])
    np.testing.assert_array_equal(other, before[1])


def brought(count: int, align: str, *, known: bool = True, way: Way = trembles) -> Round:
    how = Aligning(align="auto" if align == "auto" else "none", lights=lights_of(count) if known else ())
    names = tuple(light.name for light in lights_of(count))
    return next(one for one in aligned(plates_of(count, way), names, how, first=0) if one.number == 1)


def off_by(one: Round, count: int, way: Way) -> float:
    """By how much plates are off those of the round's middle, well within the picture: root of the mean of squares."""
    inner, true = np.s_[8:-8, 8:-8], [seen_at(light, way(ROUND_S), True) for light in lights_of(count)]
    both = [np.square(plate.image - image)[inner] for plate, image in zip(one.plates, true, strict=True)]
    return float(np.sqrt(np.mean(both)))


@pytest.mark.parametrize(("count", "known"), [(4, True), (6, True), (3, False)])
def test_plates_of_a_camera_that_shakes_show_the_picture_of_one_instant(count: int, known: bool) -> None:
    one = brought(count, "auto", known=known)
    assert off_by(one, count, trembles) < off_by(brought(count, "none"), count, trembles) / 3
    assert all(plate.pixels_seen[8:-8, 8:-8].all() for plate in one.plates)


@pytest.mark.parametrize("light", [0, 4], ids=["early", "late"])
def test_a_light_whose_two_plates_lie_on_each_other_by_chance_is_moved_all_the_same(light: int) -> None:
    """As where a hand turns back: it lies elsewhere than the instant, and the others still say where that is."""
    first_s = flash_s(light, 5) + (ROUND_S if light == 0 else 0)

    def comes_back(time_s: float) -> tuple[float, float]:
        return trembles(first_s if abs(time_s - first_s - ROUND_S) < 1e-6 else time_s)

    one = brought(5, "auto", way=comes_back)
    assert one.motion is not None
    assert one.motion.steadied
    assert off_by(one, 5, comes_back) < off_by(brought(5, "none", way=comes_back), 5, comes_back) / 3
    assert one.unsure is not None
    assert np.median(one.unsure[light]) < 0.02


def test_all_of_a_picture_that_shakes_moves_and_nothing_of_it_is_held_to_be_at_rest() -> None:
    """Fine detail that shifts everywhere would pass for noise between plates of one light."""
    shakes, count = brought(5, "auto"), 5
    observed = Observed(lights=tuple(light.name for light in lights_of(count)))
    normals = np.zeros((ROWS, COLS, 3), np.float32) + np.array([0, 0, 1], np.float32)
    surface = Surface(normals=normals, albedo=np.ones((ROWS, COLS), np.float32), valid=np.ones((ROWS, COLS), np.bool_))
    for _ in range(2):
        observed.add(shakes, surface)
    for facts in observed.facts:
        assert facts.moving_share == 1
        assert facts.change is None
        assert facts.speed_px_s == pytest.approx(math.hypot(*PER_S), abs=1)


def test_what_left_the_picture_of_both_plates_is_not_known() -> None:
    for plate, light in zip(brought(4, "auto").plates, lights_of(4), strict=True):
        wrong = np.abs(plate.image - seen_at(light, trembles(ROUND_S), True)) > 0.1
        assert not (wrong & plate.pixels_seen)[:, :4].any()


def test_motion_vectors_of_a_camera_that_shakes_are_how_its_picture_goes() -> None:
    one, planes = brought(5, "auto"), np.empty((2, ROWS, COLS), np.float32)
    fill_per_s(one.motion, planes)
    later, sooner = (np.array(trembles(ROUND_S + by)) for by in (1 / 12, -1 / 12))
    np.testing.assert_allclose(np.median(planes, axis=(1, 2)), (later - sooner) * 6, atol=3)
