"""Albedo that goes with the slope shows what three lights, or four that check each other badly, leave unseen."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from bench.accuracy_measure import Case, angles_deg
from bench.predicted import SIZE, shapes
from ring_and_ball import ring

from psvideo.model.surface import MEASURED
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust.added_light import added_unseen
from psvideo.solve.normals.trust.by_slope_kernel import SUMMED, fill_averaged, fill_in_light, fill_summed
from psvideo.solve.normals.trust.judging import looked_at
from psvideo.solve.normals.trust.slope_pairs import pairs_of

Shade = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""What cosines to the light and to half way send back of an albedo of 1, (row, col)."""
_, WAVES, INSIDE = shapes()[1]
UP = np.array([0.0, 0.0, 1.0])


def patches(seed: int) -> np.ndarray:
    """Return paint of two colours with hard edges, (row, col)."""
    soft = cv2.GaussianBlur(np.random.default_rng(seed).normal(size=(SIZE, SIZE)), (0, 0), 6)
    return np.where(soft > 0, 0.5, 0.3)


def shot(
    ways: np.ndarray, shade: Shade, *, albedo: np.ndarray | float = 0.5, lens: np.ndarray | float = 1.0,
    strengths: tuple[float, ...] = (), said: tuple[float, ...] = (), steady: float = 0.0, noise: float = 0.002,
) -> Case:  # fmt: skip
    """Return waves as they are lit; ``strengths`` are what lamps truly send where the rig says 1, or as ``said``, and
    ``steady`` is in every plate alike."""
    rng, half = np.random.default_rng(1), ways + UP
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    plates = []
    for way, between, sent in zip(ways, half, strengths or np.ones(len(ways)), strict=True):
        light = albedo * lens * sent * shade(np.maximum(WAVES @ way, 0), np.maximum(WAVES @ between, 0))
        plates.append((light + steady + rng.normal(0, noise, light.shape)).astype(np.float32))
    lit = Illumination(directions=ways, intensities=np.array(said or np.ones(len(ways)))[:, None])
    return Case("waves", plates, lit, WAVES, INSIDE)


def matte(c: np.ndarray, _: np.ndarray) -> np.ndarray:
    return c


def sheen(c: np.ndarray, h: np.ndarray) -> np.ndarray:
    return np.asarray(c + 0.6 * h**12)


def everywhere(c: np.ndarray, _: np.ndarray) -> np.ndarray:
    """The same light by every lamp, as one that nobody switched off adds."""
    return c + 0.2


def shown_and_true_deg(case: Case) -> tuple[float, float]:
    """Return by how many degrees typical normals are turned, as albedo shows it, and as they are."""
    solving = Solving(error=True)
    solved, one, noise = solving.measured(LitPlates(case.plates, case.lit, mask=case.mask))
    points, found = looked_at(solved, one, noise)
    shown = np.broadcast_to(found.by_slope_deg, points.known.shape)[points.known]
    known = solved.valid
    return float(np.median(shown)), float(np.median(angles_deg(solved.normals[known], case.truth[known])))


@pytest.mark.parametrize("noise", [0.0, 0.002, 0.01])
@pytest.mark.parametrize("seed", [1, 2])
def test_paint_on_a_matte_surface_does_not_go_with_its_slope(seed: int, noise: float) -> None:
    for albedo in (0.5, patches(seed)):
        shown, _ = shown_and_true_deg(shot(ring(3, 35), matte, albedo=albedo, noise=noise))
        assert shown < 1


def ball_in_stripes(shine: float, *, round_the_lens: bool) -> Case:
    """Return a ball in stripes of two colours, 9 or 7 points wide, with a share of both in points that hold an edge."""
    _, normals, inside = shapes()[0]
    fine = np.mgrid[: 2 * SIZE, : 2 * SIZE] / 2 - (SIZE - 1) / 2
    along = np.hypot(*fine) / 9 if round_the_lens else fine[0] / 7
    paint = cv2.resize(np.where(along.astype(int) % 2, 0.6, 0.3), (SIZE, SIZE), interpolation=cv2.INTER_AREA)
    ways, rng = ring(3, 45), np.random.default_rng(1)
    half = (ways + UP) / np.linalg.norm(ways + UP, axis=1, keepdims=True)
    plates = []
    for way, between in zip(ways, half, strict=True):
        light = paint * np.maximum(normals @ way, 0) + shine * np.maximum(normals @ between, 0) ** 12
        plates.append((light * inside + rng.normal(0, 0.002, light.shape)).astype(np.float32))
    return Case("ball", plates, Illumination(directions=ways, intensities=np.ones((3, 1))), normals, inside)


@pytest.mark.parametrize("round_the_lens", [True, False])
def test_stripes_round_a_ball_are_paint_though_they_go_as_its_slope_does(*, round_the_lens: bool) -> None:
    """Slopes tell of every stripe, here and on the other side; but paint ends from one point to the next."""
    case = ball_in_stripes(0, round_the_lens=round_the_lens)
    assert shown_and_true_deg(case)[0] < 0.3
    surface = Solving(error=True).solve(case.plates, case.lit, mask=case.mask)
    assert np.array_equal(surface.valid, surface.source == MEASURED)
    shown, true = shown_and_true_deg(ball_in_stripes(0.1, round_the_lens=round_the_lens))
    assert true > 2
    assert 0.6 < shown / true < 2


def ball_that_fades(shine: float, *, seed: int, noise: float = 0.002) -> Case:
    """Return a ball whose paint fades softly from one colour to another, in blobs."""
    _, truth, inside = shapes()[0]
    rng, ways = np.random.default_rng(seed), ring(3, 35)
    soft = cv2.GaussianBlur(rng.normal(size=inside.shape), (0, 0), 4)
    share = np.clip(0.5 + 0.3 * soft / soft[inside].std(), 0, 1)[..., None]
    albedo, plates = (1 - share) * np.array([0.7, 0.25, 0.2]) + share * np.array([0.85, 0.8, 0.7]), []
    for way in ways:
        half = (way + UP) / np.linalg.norm(way + UP)
        light = albedo * np.maximum(truth @ way, 0)[..., None] + shine * np.maximum(truth @ half, 0)[..., None] ** 10
        light += rng.normal(0, noise, light.shape)
        plates.append((light * inside[..., None]).astype(np.float32))
    return Case("ball", plates, Illumination(directions=ways, intensities=np.ones((3, 3))), truth, inside)


@pytest.mark.parametrize("seed", [1, 2])
def test_paint_that_fades_softly_is_no_sheen_where_its_colour_fades_as_well(seed: int) -> None:
    for noise in (0.002, 0.01):
        shown, _ = shown_and_true_deg(ball_that_fades(0.0, seed=seed, noise=noise))
        assert shown < 1.5, "6 and more where only its brightness is looked at"
    shown, true = shown_and_true_deg(ball_that_fades(0.15, seed=seed))
    assert true > 2
    assert 0.8 * true < shown < 2.2 * true


def test_a_lens_that_darkens_its_corners_by_a_fifth_turns_nothing() -> None:
    row, col = (np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2) / (SIZE / 2)
    lens = 1 - 0.1 * (row**2 + col**2)
    assert shown_and_true_deg(shot(ring(3, 35), matte, lens=lens))[0] < 1


@pytest.mark.parametrize(
    ("shade", "strengths", "least"),
    [(sheen, (), 0.4), (everywhere, (), 0.2), (matte, (0.8, 1.1, 1.1), 0.4)],
    ids=["sheen", "light", "lamps"],
)
@pytest.mark.parametrize("painted", [False, True])
def test_what_turns_normals_under_three_lights_shows_in_albedo(
    shade: Shade, strengths: tuple[float, ...], least: float, painted: bool
) -> None:
    """Light that all lamps add stretches normals less than it turns them."""
    albedo = patches(3) if painted and shade is not sheen else 0.5
    shown, true = shown_and_true_deg(shot(ring(3, 35), shade, albedo=albedo, strengths=strengths))
    assert true > 3
    assert least < shown / true < 2.5


def test_under_lights_that_check_each_other_residuals_say_it() -> None:
    and_one_between = np.concatenate([ring(4, 35), UP[None]])
    for shade in (sheen, everywhere):
        assert shown_and_true_deg(shot(and_one_between, shade))[0] == 0
    together = np.array([[0, 0.4, 1], [0.1, 0.4, 1], [0.5, 0, 1], [-0.1, -0.4, 1]])
    together /= np.linalg.norm(together, axis=1, keepdims=True)
    shown, true = shown_and_true_deg(shot(together, sheen))
    assert 0.4 < shown / true < 2.5


def test_two_neighbouring_lamps_that_disagree_do_not_say_that_normals_are_off() -> None:
    """The one number that four lights leave over is what the two differ by, which hardly turns normals."""
    around, slant = np.radians([0, 15, 140, 250]), np.radians(40)
    ways = np.stack([np.cos(around) * np.sin(slant), np.sin(around) * np.sin(slant), np.full(4, np.cos(slant))], axis=1)
    for shade, strengths in ((matte, (1.05, 0.95, 1, 1)), (sheen, (1, 1, 1, 1)), (sheen, (1.05, 0.95, 1, 1))):
        case = shot(ways, shade, strengths=strengths, said=(1, 1, 1, 1))
        found = Solving(error=True).solve(case.plates, case.lit, mask=case.mask)
        assert found.error_deg is not None
        measured = found.source == MEASURED
        off, said = angles_deg(found.normals[measured], case.truth[measured]), found.error_deg[measured]
        if shade is matte:
            assert np.median(off) < 1
            assert np.median(said) < 4, "6 where only that number counts"
            assert found.valid[measured].mean() > 0.9
        else:
            assert np.median(off) > 8
            assert np.mean(off <= 2 * said) > 0.85
            assert found.valid[measured].mean() < 0.05, "albedo shows a sheen, whatever is left over"


@pytest.mark.parametrize("lights", [4, 5, 6, 8])
def test_light_that_all_lamps_of_a_ring_add_shows_in_albedo_however_many_they_are(lights: int) -> None:
    """To the last one they take it for normals that face the lens more, and leave nothing over."""
    ways = ring(lights, 38)
    assert [each.unseen for each in added_unseen(shot(ways, matte).lit)] == [1]
    for albedo in (0.5, patches(3)):
        case = shot(ways, everywhere, albedo=albedo)
        shown, true = shown_and_true_deg(case)
        assert true > 3
        assert 0.6 < shown / true < 1.7
        surface = Solving(error=True).solve(case.plates, case.lit, mask=case.mask)
        assert surface.error_deg is not None
        off_deg = angles_deg(surface.normals, case.truth)[case.mask]
        assert (off_deg <= 2 * surface.error_deg[case.mask]).mean() > 0.9
        assert surface.slope_deg == pytest.approx(shown, rel=0.3)
        assert shown_and_true_deg(shot(ways, matte, albedo=albedo))[0] < 1


@pytest.mark.parametrize("lights", [4, 6, 8])
@pytest.mark.parametrize("albedo", [0.5, patches(3)], ids=["plain", "painted"])
def test_light_that_is_missing_under_all_lamps_of_a_ring_shows_in_albedo(lights: int, albedo: np.ndarray) -> None:
    """As where the black level is 4 % too high: normals were 3 degrees off at a claim of half a degree."""
    case = shot(ring(lights, 38), matte, albedo=albedo, steady=-0.04)
    shown, true = shown_and_true_deg(case)
    assert true > 2.5
    assert 0.5 < shown / true < 1.7


@pytest.mark.parametrize("steady", [0.06, -0.04])
def test_light_in_every_plate_shows_where_lamps_of_a_ring_are_of_unlike_strength(steady: float) -> None:
    """Two neighbours send less: such light looks like a normal that leans to these, 10 degrees off at a claim of 1."""
    sent = (1.0, 1.0, 0.4, 0.4)
    case = shot(ring(4, 38), matte, strengths=sent, said=sent, steady=steady)
    shown, true = shown_and_true_deg(case)
    assert true > 8
    assert 0.6 < shown / true < 1.7
    surface = Solving(error=True).solve(case.plates, case.lit, mask=case.mask)
    assert surface.valid[case.mask].mean() < 0.1
    assert shown_and_true_deg(shot(ring(4, 38), matte, strengths=sent, said=sent))[0] < 1


def of_clay(ways: np.ndarray, normals: np.ndarray, inside: np.ndarray, rough: float) -> Case:
    """Return a surface that sends light back to where it came from (Oren and Nayar), without noise."""
    square, facing, plates = rough**2, normals[..., 2], []
    straight, back = 1 - 0.5 * square / (square + 0.33), 0.45 * square / (square + 0.09)
    for way in ways:
        cosine = np.clip(normals @ way, 0, 1)
        both = (way[2] - cosine * facing) / np.maximum(np.maximum(cosine, facing), 1e-3)
        plates.append((0.5 * cosine * (straight + back * np.maximum(both, 0))).astype(np.float32))
    return shot(ways, matte)._replace(plates=plates, truth=normals, mask=inside)


def off_and_claimed_deg(case: Case) -> tuple[np.ndarray, np.ndarray]:
    surface = Solving(error=True).solve(case.plates, case.lit, mask=case.mask)
    assert surface.error_deg is not None
    known = case.mask & surface.normals.any(axis=-1)
    return angles_deg(surface.normals[known], case.truth[known]), surface.error_deg[known]


@pytest.mark.parametrize("lights", [4, 8])
@pytest.mark.parametrize("rough", [0.2, 0.5])
def test_clay_under_a_ring_is_off_by_no_more_than_it_is_said_to_be(lights: int, rough: float) -> None:
    """What albedo shows of it beside the place alone would claim 10 and 14 degrees where a ball is 2 and 5 off."""
    row, col = (np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2) / (SIZE / 2)
    normals = np.stack([col, -row, np.sqrt(np.maximum(1 - row**2 - col**2, 0.01))], axis=-1)
    off_deg, claim_deg = off_and_claimed_deg(of_clay(ring(lights, 38), normals, row**2 + col**2 < 0.85, rough))
    assert (off_deg <= 2 * claim_deg).mean() > 0.85
    assert np.median(claim_deg) < max(2.5 * np.median(off_deg), 1.5)


@pytest.mark.parametrize("lights", [6, 8])
def test_clay_whose_model_is_found_and_not_followed_shows_in_albedo_all_the_same(lights: int) -> None:
    """Waves of it were 7 degrees off at a claim of 1.7, and all of them trusted."""
    off_deg, claim_deg = off_and_claimed_deg(of_clay(ring(lights, 25), WAVES, INSIDE, 0.5))
    assert np.median(off_deg) > 6
    assert (off_deg <= 2 * claim_deg).mean() > 0.8


@pytest.mark.parametrize("lights", [4, 6])
@pytest.mark.parametrize("ball", [False, True])
def test_paint_in_soft_blobs_is_no_light_that_all_lamps_of_a_ring_add(lights: int, *, ball: bool) -> None:
    """Of a ball little stretches normals that its place does not as well: a good take was 9 degrees off."""
    row, col = (np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2) / (SIZE / 2)
    shown = []
    for seed in range(12):
        soft = cv2.GaussianBlur(np.random.default_rng(seed).normal(size=(SIZE, SIZE)), (0, 0), SIZE / (6 + seed))
        albedo, ways = 0.5 + 0.2 * soft / np.abs(soft).max(), ring(lights, 38)
        case = shot(ways, matte, albedo=albedo, noise=0.001)
        if ball:
            normals = np.stack([col, -row, np.sqrt(np.maximum(1 - row**2 - col**2, 0.01))], axis=-1)
            plates = [(albedo * np.maximum(normals @ way, 0)).astype(np.float32) for way in ways]
            case = case._replace(plates=plates, truth=normals, mask=row**2 + col**2 < 0.8)
        shown.append(shown_and_true_deg(case)[0])
    assert np.quantile(shown, 0.8) < 0.5
    assert max(shown) < 3


def test_normals_that_a_sheen_turns_are_no_longer_trusted_under_three_lights() -> None:
    case = shot(ring(3, 35), sheen)
    surface = Solving(error=True).solve(case.plates, case.lit, mask=case.mask)
    off_deg = angles_deg(surface.normals, case.truth)
    assert surface.source is not None
    measured = surface.source == MEASURED
    assert (off_deg > 10)[measured].mean() > 0.05
    assert (surface.valid & (off_deg > 10)).sum() <= 0.03 * max(surface.valid.sum(), 0.2 * measured.sum())


def faces(ways: np.ndarray, albedo: np.ndarray, shape: tuple[int, int] = (160, 200)) -> tuple[np.ndarray, np.ndarray]:
    """Normals (row, col, 3) and albedo (row, col) of three flat faces that meet in a corner, as of a box."""
    row, col = np.mgrid[: shape[0], : shape[1]]
    third = np.where(col < 0.4 * shape[1], 0, np.where(row > 0.5 * shape[0], 1, 2))
    return (ways / np.linalg.norm(ways, axis=1, keepdims=True))[third], albedo[third]


BOX_WAYS = np.array([(0.5, 0.3, 0.8), (-0.5, 0.2, 0.8), (0.0, -0.6, 0.8)])
FLAT = np.broadcast_to((0.3, -0.1, 0.95), (3, 3))


def coded(light: np.ndarray, quality: int) -> np.ndarray:
    """Light (row, col, channel) as a JPEG of this quality holds it."""
    codes = np.rint(255 * np.clip(light, 0, 1) ** (1 / 2.2)).astype(np.uint8)
    held = cv2.imdecode(cv2.imencode(".jpg", codes, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_COLOR)
    assert held is not None
    return np.asarray((held / 255) ** 2.2)


@pytest.mark.parametrize("lights", [3, 5, 8])
@pytest.mark.parametrize("subject", ["a box in one colour", "a box in three colours", "a print", "a print, in JPEG"])
def test_flat_faces_have_no_slope_for_paint_to_go_with_and_what_noise_makes_of_them_is_none(
    subject: str, lights: int
) -> None:
    rng, directions = np.random.default_rng(11), ring(lights, 35.0)
    paint = np.array([0.62, 0.6, 0.5]) if "three" in subject else np.full(3, 0.6)
    normals, albedo = faces(BOX_WAYS if "box" in subject else FLAT, paint)
    if "print" in subject:
        albedo = np.where(cv2.GaussianBlur(rng.normal(size=albedo.shape), (0, 0), 5) > 0, 0.7, 0.3)
    plates = []
    for direction in directions:
        light = np.maximum(normals @ direction, 0)[..., None] * albedo[..., None] * (0.9, 0.75, 0.6)
        light = light + rng.normal(0, 0.004, light.shape)
        plates.append(np.asarray(coded(light, 92) if "JPEG" in subject else light, np.float32))
    lit = Illumination(directions=directions, intensities=np.ones((lights, 3)))
    surface = Solving(error=True).solve(plates, lit)
    assert angles_deg(surface.normals, normals).mean() < 2
    assert surface.valid.mean() > 0.8


@pytest.mark.parametrize(("shine", "power"), [(0.1, 30), (0.2, 30), (0.1, 8), (0.2, 8)])
def test_paint_that_turns_normals_of_a_flat_face_that_shines_is_no_light_that_lamps_add(
    shine: float, power: float
) -> None:
    rng, ways = np.random.default_rng(12), ring(4, 36)
    normals, albedo = faces(BOX_WAYS, np.full(3, 0.5))
    soft = cv2.GaussianBlur(rng.normal(size=albedo.shape), (0, 0), 12)
    albedo = albedo * np.exp(0.4 * soft / soft.std())
    half = (ways + UP) / np.linalg.norm(ways + UP, axis=1, keepdims=True)
    plates = []
    for way, between in zip(ways, half, strict=True):
        light = np.maximum(normals @ way, 0) * albedo + shine * np.maximum(normals @ between, 0) ** power
        plates.append((light + rng.normal(0, 0.001, light.shape)).astype(np.float32))
    lit = Illumination(directions=ways, intensities=np.ones((4, 1)))
    shown_deg, true_deg = shown_and_true_deg(Case("box", plates, lit, normals, np.ones(albedo.shape, np.bool_)))
    assert 0.6 * true_deg < shown_deg < 2 * true_deg


def test_neighbours_on_either_side_of_a_crease_do_not_speak() -> None:
    _, col = np.mgrid[:60, :160].astype(np.float32)
    lean = np.where(col < 80, -0.7, 0.3) + 0.006 * (col % 80)
    roof = np.stack([np.sin(lean), 0 * lean, np.cos(lean)]).astype(np.float32)
    paint = np.zeros(col.shape, np.float32)
    pairs = pairs_of(roof, np.zeros((2, *col.shape), np.float32), paint, np.ones(col.shape, np.bool_))
    assert pairs is not None
    turned = np.linalg.norm(pairs.there - pairs.here, axis=1)
    np.testing.assert_allclose(turned, 0.03, atol=0.001)


def test_too_few_points_in_the_light_of_all_lamps_say_nothing() -> None:
    case = shot(ring(3, 35), sheen)
    few = np.zeros_like(INSIDE)
    few[10:22, 10:22] = True
    surface, one, noise = Solving(error=True).measured(LitPlates(case.plates, case.lit, mask=few))
    assert not np.any(looked_at(surface, one, noise)[1].by_slope_deg)


def test_what_is_averaged_and_what_all_lamps_light_is_what_plain_numpy_gives() -> None:
    rng, rows, cols = np.random.default_rng(5), 33, 47
    known, albedo = rng.random((rows, cols)) < 0.9, rng.random((rows, cols)).astype(np.float32)
    normals = rng.normal(size=(3, rows, cols)) + np.array([0, 0, 3])[:, None, None]
    normals = (normals / np.linalg.norm(normals, axis=0)).astype(np.float32)
    flags, (varies, whole) = known.view(np.uint8).reshape(-1), (np.empty(rows * cols, kind) for kind in "fB")
    summed = np.empty((SUMMED, rows * cols), np.float32)
    fill_summed(normals.reshape(3, -1), albedo.reshape(-1), flags, summed)
    light = albedo * known
    plain = np.stack([*(normals * light), light, light * light, known])
    np.testing.assert_allclose(summed.reshape(plain.shape), plain, rtol=1e-6)
    means = np.stack([cv2.blur(each, (5, 5), borderType=cv2.BORDER_CONSTANT) for each in plain])
    sums = means[:3].copy()
    fill_averaged(means.reshape(SUMMED, -1), flags, varies, whole)
    np.testing.assert_allclose(means[:3], sums / np.linalg.norm(sums, axis=0), atol=1e-6)
    spread = np.sqrt(np.maximum(means[4] - means[3] ** 2, 0)) / means[3]
    np.testing.assert_allclose(varies, spread.ravel(), atol=1e-3)
    bent = np.linalg.norm(sums, axis=0) < 0.98 * means[3]
    np.testing.assert_array_equal(whole.reshape(rows, cols) > 0, known & (means[5] > 0.999) & ~bent)
    ways, lit = ring(5, 40.0).astype(np.float32), np.empty(rows * cols, np.uint8)
    fill_in_light(normals.reshape(3, -1), ways, 0.2, flags, lit)
    cosines = np.tensordot(ways, normals, axes=1)
    expected = known & (cosines.min(axis=0) > 0.2 * np.maximum(cosines, 0).mean(axis=0))
    assert np.count_nonzero(lit.reshape(rows, cols).astype(bool) != expected) <= 1  # on the border by a rounding
    assert 0.1 < expected.mean() < 0.89
