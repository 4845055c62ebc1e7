"""What fewer than three lights reach: estimated from two, one or none of them, marked as such, and never invented."""

import cv2
import numpy as np
import pytest
from angles import angles_deg
from ring_and_ball import ring

import psvideo as ps
from psvideo.model.coded import Coded, Tone
from psvideo.model.surface import MEASURED, NO_LIGHT, ONE_LIGHT, TWO_LIGHTS, Surface
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.filling.filled import filled
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.task import Usable

SIZE = 120
LIGHTS = np.array([[0.6, 0.1, 0.79], [-0.5, 0.5, 0.71], [-0.1, -0.7, 0.71]])
LIGHTS = LIGHTS / np.linalg.norm(LIGHTS, axis=1, keepdims=True)


def ball(radius: float = 50.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the normals of a ball (row, col, 3), and where it is."""
    rows, cols = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    x, y = cols / radius, -rows / radius
    inside = x * x + y * y < 0.98
    z = np.sqrt(np.where(inside, 1 - x * x - y * y, 0))
    return np.where(inside[..., None], np.stack([x, y, z], axis=-1), 0), inside


def plates_of(
    normals: np.ndarray, colour: np.ndarray, *, noise: float = 0.001, lights: np.ndarray = LIGHTS
) -> list[np.ndarray]:
    """Return a plate per light of a matte surface, with a camera's noise."""
    rng = np.random.default_rng(3)
    shade = np.maximum(np.einsum("rcx,lx->lrc", normals, lights), 0)
    return [(one[..., None] * colour + rng.normal(0, noise, (*one.shape, 3))).astype(np.float32) for one in shade]


def lit_by(lights: np.ndarray = LIGHTS) -> Illumination:
    return Illumination(directions=lights, intensities=np.ones((len(lights), 3)))


@pytest.fixture(scope="module")
def solved() -> tuple[Surface, np.ndarray, np.ndarray]:
    normals, inside = ball()
    surface = Solving(error=True).solve(plates_of(normals, np.array([0.5, 0.4, 0.3])), lit_by())
    return surface, normals, inside


def test_every_pixel_of_the_subject_has_a_unit_normal_and_an_albedo(
    solved: tuple[Surface, np.ndarray, np.ndarray],
) -> None:
    surface, normals, inside = solved
    reached = (np.einsum("rcx,lx->lrc", normals, LIGHTS) > 0.01).any(axis=0)
    assert surface.shown[reached].all()
    lengths = np.linalg.norm(surface.normals[surface.shown], axis=-1)
    np.testing.assert_allclose(lengths, 1, atol=1e-3)
    assert (surface.albedo[surface.shown] > 0).all()
    assert not surface.shown[~inside].any(), "nothing is invented where nothing was seen"
    assert not surface.normals[~surface.shown].any()
    assert not surface.albedo[~surface.shown].any()


def test_the_source_is_how_many_lights_reach_a_pixel_and_only_measured_ones_are_valid(
    solved: tuple[Surface, np.ndarray, np.ndarray],
) -> None:
    surface, normals, _ = solved
    shade = np.einsum("rcx,lx->lrc", normals, LIGHTS)
    clear = (np.abs(shade) > 0.02).all(axis=0)  # what grazes may count or not
    assert surface.source is not None
    for count, source in ((3, MEASURED), (2, TWO_LIGHTS), (1, ONE_LIGHT)):
        where = clear & ((shade > 0).sum(axis=0) == count)
        assert where.sum() > 100
        assert (surface.source[where] == source).all()
        assert surface.valid[where].all() == (count == 3)
    assert not surface.valid[surface.source != MEASURED].any()


def test_two_lights_and_the_albedo_around_give_the_normal_and_one_light_nearly(
    solved: tuple[Surface, np.ndarray, np.ndarray],
) -> None:
    surface, normals, _ = solved
    apart = angles_deg(surface.normals, normals)
    two, one = surface.source == TWO_LIGHTS, surface.source == ONE_LIGHT
    assert apart[two].mean() < 10
    assert np.median(apart[two]) < 5
    assert apart[one].mean() < 25
    assert surface.error_deg is not None
    for where in (two, one):
        assert (apart[where] <= 2 * surface.error_deg[where]).mean() > 0.75


def test_a_surface_that_turns_from_one_side_of_two_lights_to_the_other_is_followed() -> None:
    """Where both normals that they leave are one, neighbours that turn on tell which of the two comes next."""
    normals, _ = ball()
    lights = ring(3, 55)
    surface = Solving(error=True).solve(plates_of(normals, np.array([0.5, 0.4, 0.3]), lights=lights), lit_by(lights))
    assert surface.source is not None
    two = surface.source == TWO_LIGHTS
    assert two.sum() > 3000
    off_deg = angles_deg(surface.normals, normals)[two]
    assert off_deg.mean() < 6
    assert surface.error_deg is not None
    assert (off_deg <= 2 * surface.error_deg[two]).mean() > 0.95


def test_a_picture_higher_than_wide_is_filled_as_a_square_one() -> None:
    normals, _ = ball()
    plates = plates_of(normals, np.array([0.5, 0.4, 0.3]), noise=0.0)
    square, high = (Solving().solve([plate[:, void:].copy() for plate in plates], lit_by()) for void in (0, 8))
    assert square.source is not None
    assert high.source is not None
    assert (high.source == TWO_LIGHTS).sum() > 300
    np.testing.assert_array_equal(high.source, square.source[:, 8:])
    np.testing.assert_allclose(high.normals, square.normals[:, 8:], atol=1e-3)


def test_colours_that_meet_keep_their_own_albedo() -> None:
    normals, _ = ball()
    left = np.arange(SIZE)[None, :] < SIZE // 2
    colour = np.where(left[..., None], [0.6, 0.2, 0.1], [0.1, 0.2, 0.35])
    surface = Solving().solve(plates_of(normals, colour), lit_by())
    two = surface.source == TWO_LIGHTS
    off = np.abs(surface.albedo[two] / np.broadcast_to(colour, normals.shape)[two] - 1)
    assert np.median(off) < 0.05
    assert (off < 0.2).mean() > 0.9


def test_what_stands_before_a_wall_of_its_colour_does_not_lend_it_its_normal() -> None:
    cols = np.broadcast_to(np.arange(SIZE), (SIZE, SIZE))
    leaning = np.array([0.7, 0.1, 0.7]) / np.linalg.norm([0.7, 0.1, 0.7])
    box = cols < SIZE // 2
    normals = np.where(box[..., None], leaning, [0.0, 0.0, 1.0])
    plates = plates_of(normals, np.where(box, 0.8, 0.35)[..., None] * np.array([0.9, 0.8, 1.0]))
    shadow = ~box & (cols < SIZE // 2 + 20)
    plates[1][shadow] = 0
    surface = Solving().solve(plates, lit_by())
    assert surface.source is not None
    assert (surface.source[shadow] == TWO_LIGHTS).all()
    assert angles_deg(surface.normals, normals)[shadow].mean() < 5


def test_the_edge_of_a_shadow_within_a_pixel_is_no_normal_to_go_on_from() -> None:
    rows, cols = np.mgrid[:SIZE, :SIZE]
    normals = np.broadcast_to([0.0, 0.0, 1.0], (SIZE, SIZE, 3))
    plates = plates_of(normals, np.array([0.45, 0.4, 0.5]))
    shadow = (np.abs(cols - SIZE // 2) < 25) & (np.abs(rows - SIZE // 2) < 40)
    edge = (cv2.dilate(shadow.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0) & ~shadow
    plates[0][shadow] = 0
    plates[0][edge] *= 0.5
    surface = Solving().solve(plates, lit_by())
    assert surface.source is not None
    assert (surface.source[shadow] == TWO_LIGHTS).all()
    assert angles_deg(surface.normals, normals)[shadow].mean() < 6


def test_how_strong_the_lights_are_said_to_be_changes_the_albedo_only() -> None:
    normals, _ = ball()
    plates = plates_of(normals, np.array([0.5, 0.4, 0.3]))
    plain = Solving().solve(plates, lit_by())
    weak = Solving().solve(plates, Illumination(directions=LIGHTS, intensities=np.full((3, 1), 0.05).repeat(3, axis=1)))
    np.testing.assert_array_equal(weak.source, plain.source)
    np.testing.assert_allclose(weak.normals, plain.normals, atol=2e-3)
    np.testing.assert_allclose(weak.albedo, 20 * plain.albedo, rtol=5e-3, atol=1e-3)


def test_what_is_not_filled_is_zero() -> None:
    normals, _ = ball()
    surface = Solving(fill=False, error=True).solve(plates_of(normals, np.array([0.5, 0.4, 0.3])), lit_by())
    assert surface.error_deg is not None
    for plane in (surface.normals, surface.albedo, surface.error_deg):
        assert not plane[~surface.valid].any()
    np.testing.assert_array_equal(surface.shown, surface.valid)


def test_measured_pixels_are_the_same_to_the_bit_filled_or_not() -> None:
    normals, _ = ball()
    plates = plates_of(normals, np.array([0.5, 0.4, 0.3]))
    whole, plain = (Solving(fill=fill).solve(plates, lit_by()) for fill in (True, False))
    np.testing.assert_array_equal(whole.valid, plain.valid)
    np.testing.assert_array_equal(whole.normals[whole.valid], plain.normals[plain.valid])


@pytest.mark.parametrize("channels", [1, 3])
def test_what_every_light_clips_is_shown_and_filled(channels: int) -> None:
    normals, inside = ball()
    plates = plates_of(normals, np.array([0.5, 0.4, 0.3]))
    clipped = np.zeros_like(inside)
    clipped[40:80, 30:60] = True
    unseen = np.zeros((len(plates), SIZE, SIZE), bool)
    unseen[:, 4:8, 4:8] = True
    for plate in plates:
        plate[clipped | unseen[0]] = 1.0
    if channels == 1:
        plates = [plate[..., 0].copy() for plate in plates]
    lit = Illumination(directions=LIGHTS, intensities=np.ones((len(LIGHTS), channels)))
    surface = Solving(error=True).solve(plates, lit, seen=~unseen)
    assert surface.source is not None
    assert not surface.valid[clipped].any()
    assert (surface.source[clipped] == NO_LIGHT).all()
    np.testing.assert_allclose(np.linalg.norm(surface.normals[clipped], axis=-1), 1, atol=1e-3)
    assert not surface.shown[unseen[0]].any(), "a code that no row saw is none"


def test_a_small_hole_that_no_light_reaches_is_filled_and_the_void_is_not() -> None:
    normals, inside = ball()
    plates = plates_of(normals, np.array([0.5, 0.4, 0.3]))
    hole = np.zeros_like(inside)
    hole[58:64, 58:64] = True
    for plate in plates:
        plate[hole] = np.random.default_rng(1).normal(0, 0.001, (36, 3))
    surface = Solving().solve(plates, lit_by())
    assert surface.source is not None
    assert (surface.source[hole] == NO_LIGHT).all()
    assert angles_deg(surface.normals, normals)[hole].max() < 10
    assert not surface.shown[~inside].any()


def test_a_mask_says_what_the_subject_is_even_where_no_light_reaches() -> None:
    normals, inside = ball()
    mask = inside | (np.arange(SIZE)[:, None] < 20)
    surface = Solving().solve(plates_of(normals, np.array([0.5, 0.4, 0.3])), lit_by(), mask=mask)
    assert surface.shown[mask].all()
    assert not surface.shown[~mask].any()


def test_plates_of_noise_alone_give_nothing() -> None:
    plates = plates_of(np.zeros((SIZE, SIZE, 3)), np.ones(3), noise=0.002)
    assert not Solving().solve(plates, lit_by()).shown.any()


def test_arrays_from_python_are_filled_or_not() -> None:
    normals, _ = ball()
    images = np.stack(plates_of(normals, np.array([0.5, 0.4, 0.3])))
    for fill in (True, False):
        source = ps.solve_images(images, LIGHTS, fill=fill).source
        assert source is not None
        assert bool((source == TWO_LIGHTS).any()) == fill


class ReadRows:
    """Codes that note which of their rows were read."""

    def __init__(self, codes: np.ndarray) -> None:
        self.codes, self.shape, self.dtype = codes, codes.shape, codes.dtype
        self.read: set[int] = set()

    def __len__(self) -> int:
        return len(self.codes)

    def __array__(self, dtype: object = None, copy: bool | None = None) -> np.ndarray:
        return self[:]

    def __getitem__(self, rows: slice) -> np.ndarray:
        self.read.update(range(len(self))[rows])
        return np.asarray(self.codes[rows])

    def opened(self) -> None:
        """In no file."""

    def some(self, rows: np.ndarray) -> np.ndarray:
        self.read.update(rows.tolist())
        return np.asarray(self.codes[rows[0] : rows[-1] + 1])


def test_where_little_is_missing_little_is_read_again() -> None:
    """A hole in ten rows: only these are made of the frames once more, and what comes out is the same."""
    normals, _ = ball(200.0)  # fills the picture
    codes = [(plate.clip(0, 1) * 65535).astype(np.uint16) for plate in plates_of(normals, np.array([0.5, 0.4, 0.3]))]
    watched = [ReadRows(one) for one in codes]
    tone = Tone(gain=np.full((1, 1), 1 / 65535))
    unmade = [Mixture(frames=(Coded(codes=one, tone=tone),), coefficients=np.ones((1, SIZE))) for one in watched]
    missing = np.zeros((SIZE, SIZE), np.bool_)
    missing[50:60, 30:90] = True
    found = []
    for plates in (unmade, [one.image() for one in unmade]):
        surface = woodham1980.solve(LitPlates(plates, lit_by()), usable=Usable())
        for one in watched:
            one.read.clear()
        evidence = Evidence(plates=plates, lit=lit_by(), usable=Usable())
        found.append(filled(surface, evidence, solved=surface.valid & ~missing, noise=0.001))
        assert all(one.read <= set(range(50, 60)) for one in watched)
    np.testing.assert_array_equal(found[0].normals, found[1].normals)
    np.testing.assert_array_equal(np.asarray(found[0].source), np.asarray(found[1].source))


def test_filled_normals_are_unit_vectors_where_two_lights_shine_from_almost_one_direction() -> None:
    y, x = np.mgrid[-1:1:48j, -1:1:48j]
    z = np.sqrt(np.clip(1 - x * x - y * y, 0, None))
    turned = np.deg2rad(1)
    lights = np.array(
        [(0.7, 0, 0.7), (0.7 * np.cos(turned), 0.7 * np.sin(turned), 0.7), (-0.8, 0.1, 0.5), (-0.7, -0.4, 0.5)]
    )
    lights /= np.linalg.norm(lights, axis=1, keepdims=True)
    images = 0.6 * np.clip(np.stack([x, -y, z], axis=-1) @ lights.T, 0, None)
    surface = ps.solve_images(np.moveaxis(images, -1, 0), lights, mask=z > 0.1)
    length = np.linalg.norm(surface.normals[z > 0.1], axis=-1)
    assert (surface.valid[z > 0.1]).mean() < 0.8
    np.testing.assert_allclose(length, 1, atol=1e-3)


def test_what_is_estimated_is_as_far_off_as_what_was_measured_around_it() -> None:
    normals, _ = ball(400.0)
    lights = ring(6, 40)
    plates = plates_of(normals, np.array([0.5, 0.4, 0.3]), lights=lights)
    half, (high, wide) = normals.shape[1] // 2, normals.shape[:2]
    hole = np.zeros((high, wide), bool)
    for middle in (half // 2, half + half // 2):
        hole[high // 2 - 4 : high // 2 + 4, middle - 4 : middle + 4] = True
    for number, plate in enumerate(plates):
        plate[:, half:] *= 1.25 if number % 2 else 0.8  # as if that half had other lamps
        plate[hole] *= number < 2  # all others are in shadow
    surface = Solving(error=True).solve(plates, lit_by(lights))
    assert surface.source is not None
    assert surface.error_deg is not None
    assert (surface.source[hole] == TWO_LIGHTS).all()
    clean, spoilt = hole.copy(), hole.copy()
    clean[:, half:], spoilt[:, :half] = False, False
    assert np.median(surface.error_deg[spoilt]) > 1.5 * np.median(surface.error_deg[clean])
