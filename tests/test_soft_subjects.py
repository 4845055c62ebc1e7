"""Light that shines through a surface (skin, wax, marble) flattens normals; the whole subject shows by how much."""

from collections.abc import Callable

import numpy as np
import pytest
from angles import angles_deg
from numpy.typing import NDArray
from ring_and_ball import ball, ring

from psvideo.model.surface import Surface
from psvideo.solve.images import solve_images
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.robust import reflectance_fit
from psvideo.solve.normals.solving import Solving

Array = NDArray[np.float64]
SIZE, NOISE = 72, 0.002
UNEVEN = np.concatenate([ring(5, 50), ring(3, 25)])
FIVE = np.concatenate([ring(4, 50), ring(1, 5)])
UNEVEN_FIVE = np.concatenate([ring(3, 50), ring(2, 25)])
SIX = np.concatenate([ring(4, 50), ring(2, 20)])
FOUR = np.concatenate([ring(3, 50), ring(1, 5)])


def head() -> tuple[Array, NDArray[np.bool_]]:
    """Normals of something round with folds, and where it is."""
    v, u = (1.05 * (2 * (each + 0.5) / SIZE - 1) for each in np.mgrid[:SIZE, :SIZE])
    inside = u * u + v * v < 0.97
    height = np.sqrt(np.maximum(1 - u * u - v * v, 0.01)) + 0.04 * np.sin(7 * u) * np.sin(9 * v)
    down, across = np.gradient(height, 2.1 / SIZE)
    normals = np.stack([-across, down, np.ones_like(height)], axis=-1)
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True), inside


def lit_through(cosine: Array, share: float) -> Array:
    """Light that comes out again around where it went in: lit beyond the edge of its shadow."""
    return np.asarray(np.maximum(cosine + share, 0) / (1 + share))


def filmed(ways: Array, shade: Callable[[Array], Array]) -> tuple[list[NDArray[np.float32]], Array, NDArray[np.bool_]]:
    rng, (normals, inside) = np.random.default_rng(3), head()
    paint = np.array([0.6, 0.45, 0.35]) * inside[..., None]
    plates = [shade(normals @ way)[..., None] * paint for way in ways]
    return [(each + rng.normal(0, NOISE, each.shape)).astype(np.float32) for each in plates], normals, inside


def under(ways: Array) -> Illumination:
    return Illumination(directions=ways, intensities=np.ones((len(ways), 3)))


def off_deg(found: Surface, truth: Array, where: NDArray[np.bool_]) -> Array:
    return angles_deg(found.normals[where], truth[where])


@pytest.mark.parametrize(("ways", "share"), [(UNEVEN, 0.1), (UNEVEN, 0.3), (FIVE, 0.2)], ids=["eight", "wax", "five"])
def test_what_light_shines_through_is_solved_as_what_it_is(ways: Array, share: float) -> None:
    plates, normals, inside = filmed(ways, lambda cosine: lit_through(cosine, share))
    found = solve_images(plates, ways)
    off = off_deg(found, normals, inside)
    assert off.mean() < 1.5, "7 to 14 degrees where it is taken for matte"
    assert found.misfit is not None
    assert found.misfit.reflectance is not None
    assert found.misfit.reflectance.soft == pytest.approx(share / (1 + share), abs=0.03)
    assert (found.valid & inside).sum() > 0.7 * inside.sum()
    np.testing.assert_allclose(np.median(found.albedo[found.valid], axis=0), [0.6, 0.45, 0.35], rtol=0.06)


def before_a_wall(
    ways: Array, shade: Callable[[Array], Array], leaning: Array = np.array([0.1, 0.2, 1.0])
) -> tuple[list[NDArray[np.float32]], Array, NDArray[np.bool_]]:
    """The head, a third of the picture, before a matte wall of many paints."""
    plates, normals, inside = filmed(ways, shade)
    rng, size = np.random.default_rng(5), int(1.5 * SIZE)
    facing, at = leaning / np.linalg.norm(leaning), np.s_[SIZE // 4 : SIZE // 4 + SIZE, SIZE // 4 : SIZE // 4 + SIZE]
    paint = rng.uniform(0.2, 0.7, (size // 9, size // 9, 3)).repeat(9, axis=0).repeat(9, axis=1)
    pictures = []
    for plate, way in zip(plates, ways, strict=True):
        whole = np.maximum(facing @ way, 0) * paint + rng.normal(0, NOISE, paint.shape)
        whole[at] = np.where(inside[..., None], plate, whole[at])
        pictures.append(whole.astype(np.float32))
    truth, subject = np.broadcast_to(facing, paint.shape).copy(), np.zeros((size, size), np.bool_)
    subject[at] = inside
    truth[at] = np.where(inside[..., None], normals, facing)
    return pictures, truth, subject


@pytest.mark.parametrize("share", [0.15, 0.35])
def test_what_light_shines_through_is_seen_before_a_matte_wall_which_stays_matte(
    monkeypatch: pytest.MonkeyPatch, share: float
) -> None:
    plates, truth, subject = before_a_wall(UNEVEN, lambda cosine: lit_through(cosine, share))
    found = solve_images(plates, UNEVEN)
    assert found.misfit is not None
    assert found.misfit.reflectance is not None
    assert found.misfit.reflectance.soft == pytest.approx(share / (1 + share), abs=0.04)
    monkeypatch.setattr(reflectance_fit, "_worst_fitting", lambda points: points)
    before = solve_images(plates, UNEVEN)
    assert off_deg(found, truth, subject).mean() < 0.3 * off_deg(before, truth, subject).mean()
    assert off_deg(found, truth, ~subject).mean() < off_deg(before, truth, ~subject).mean() + 0.1


@pytest.mark.parametrize("turned_deg", [0, 3])
@pytest.mark.parametrize("power", [1.0, 1.2])
def test_a_matte_or_steep_thing_before_a_wall_is_not_soft(power: float, turned_deg: float) -> None:
    plates, *_ = before_a_wall(UNEVEN, lambda cosine: np.maximum(cosine, 0) ** power)
    wrong = UNEVEN + np.radians(turned_deg) * np.random.default_rng(1).normal(size=UNEVEN.shape) / np.sqrt(2)
    misfit = solve_images(plates, wrong / np.linalg.norm(wrong, axis=1, keepdims=True)).misfit
    assert misfit is None or misfit.reflectance is None or misfit.reflectance.soft == 0


def test_its_light_beyond_the_shadows_edge_is_not_taken_for_other_surfaces(monkeypatch: pytest.MonkeyPatch) -> None:
    plates, normals, inside = filmed(UNEVEN, lambda cosine: lit_through(cosine, 0.2))
    found = solve_images(plates, UNEVEN)
    error_deg = found.error_deg
    assert error_deg is not None
    off = off_deg(found, normals, inside)
    assert 0.6 < (off <= error_deg[inside]).mean() < 0.97
    monkeypatch.setattr(reflectance_fit, "LEAST_SOFT", 1.0)
    matte = solve_images(plates, UNEVEN)
    assert off_deg(matte, normals, inside).mean() > 5 * off.mean()


@pytest.mark.parametrize(
    "shade",
    [
        lambda cosine: np.maximum(cosine, 0),
        lambda cosine: np.maximum(cosine, 0) * (1 - 0.2 * np.maximum(cosine, 0)),
        lambda cosine: np.maximum(cosine, 0) ** 1.2,
    ],
    ids=["matte", "flat", "steep"],
)
def test_what_ends_at_the_shadows_edge_is_not_soft(shade: Callable[[Array], Array]) -> None:
    plates, *_ = filmed(UNEVEN, shade)
    misfit = solve_images(plates, UNEVEN).misfit
    assert misfit is None or misfit.reflectance is None or misfit.reflectance.soft == 0


def sheen(normals: Array, way: Array, power: float, strength: float) -> Array:
    """Light of a lobe around the mirrored direction, in shares of the albedo, that ends where a lamp does not reach."""
    half = way + np.array([0.0, 0.0, 1.0])
    return np.asarray(strength * np.maximum(normals @ (half / np.linalg.norm(half)), 0) ** power * (normals @ way > 0))


@pytest.mark.parametrize(
    ("ways", "power"),
    [(UNEVEN, 2), (UNEVEN, 3), (SIX, 2), (SIX, 3), (UNEVEN_FIVE, 2)],
    ids=["eight, h^2", "eight, h^3", "six, h^2", "six, h^3", "five, h^2"],
)
def test_a_very_broad_sheen_is_not_taken_for_softness(ways: Array, power: int, monkeypatch: pytest.MonkeyPatch) -> None:
    _, normals, inside = filmed(ways, lambda cosine: cosine)
    rng, paint = np.random.default_rng(3), np.array([0.6, 0.45, 0.35]) * inside[..., None]
    plates = [
        (np.maximum(normals @ way, 0) + sheen(normals, way, power, 0.5))[..., None] * paint
        + rng.normal(0, NOISE, paint.shape)
        for way in ways
    ]
    pictures = [each.astype(np.float32) for each in plates]
    found = Solving(error=True).solve(pictures, under(ways), mask=inside)
    off, error_deg = off_deg(found, normals, inside), found.error_deg
    assert found.misfit is not None
    assert found.misfit.reflectance is None or found.misfit.reflectance.soft == 0
    assert error_deg is not None
    assert (off <= 2 * error_deg[inside]).mean() > 0.9
    monkeypatch.setattr(reflectance_fit, "VERY_BROAD", ())
    soft = Solving(error=True).solve(pictures, under(ways), mask=inside)
    assert off_deg(soft, normals, inside).mean() > 1.2 * off.mean()


def varnished(ways: Array, power: int, strength: float, curve: float) -> tuple[list[NDArray[np.float32]], Array]:
    """Plates of a ball's front that fills the picture, of many paints that mirror alike, and its normals."""
    normals, inside = ball(SIZE, reach_deg=70)
    rng, plates = np.random.default_rng(4), []
    paint = np.array([0.6, 0.45, 0.35]) * rng.uniform(0.5, 1.1, (SIZE // 8, SIZE // 8, 1)).repeat(8, 0).repeat(8, 1)
    for way in ways:
        cosine = np.maximum(normals @ way, 0)
        plate = (cosine * (1 + curve * cosine))[..., None] * paint + sheen(normals, way, power, strength)[..., None]
        plates.append(((plate + rng.normal(0, NOISE, paint.shape)) * inside[..., None]).astype(np.float32))
    return plates, normals


def test_lights_on_a_ring_do_not_take_a_very_broad_sheen_for_a_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    ways = ring(6, 40)
    plates, normals = varnished(ways, 2, 0.4, 0.0)
    inside = np.linalg.norm(normals, axis=-1) > 0.5
    found = Solving(error=True).solve(plates, under(ways), mask=inside)
    assert found.misfit is not None
    assert found.misfit.reflectance is None
    assert found.error_deg is not None
    assert (off_deg(found, normals, inside) <= 2 * found.error_deg[inside]).mean() > 0.9
    monkeypatch.setattr(reflectance_fit, "ON_A_RING", 0.0)
    curved = Solving(error=True).solve(plates, under(ways), mask=inside)
    assert curved.error_deg is not None
    assert (off_deg(curved, normals, inside) <= 2 * curved.error_deg[inside]).mean() < 0.8


@pytest.mark.parametrize(("strength", "curve"), [(0.2, 0.0), (0.0, -0.25)], ids=["varnish", "flat"])
def test_lights_on_a_ring_show_varnish_and_what_is_flat(strength: float, curve: float) -> None:
    plates, _ = varnished(ring(6, 40), 8, strength, curve)
    misfit = solve_images(plates, ring(6, 40)).misfit
    assert misfit is not None
    assert misfit.reflectance is not None
    assert misfit.reflectance.curve == pytest.approx(curve, abs=0.1)
    assert misfit.reflectance.broad == pytest.approx(strength, abs=0.03)


def test_lights_at_two_slants_are_off_a_ring() -> None:
    leaning = np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]])
    assert reflectance_fit.off_a_ring(ring(7, 40) @ leaning) < 1e-12
    assert reflectance_fit.off_a_ring(UNEVEN) > 0.1


def test_lights_that_are_off_do_not_make_a_matte_subject_soft() -> None:
    plates, *_ = filmed(UNEVEN, lambda cosine: np.maximum(cosine, 0))
    for seed in range(5):
        wrong = UNEVEN + np.radians(3) * np.random.default_rng(seed).normal(size=UNEVEN.shape) / np.sqrt(2)
        misfit = solve_images(plates, wrong / np.linalg.norm(wrong, axis=1, keepdims=True)).misfit
        assert misfit is None or misfit.reflectance is None or misfit.reflectance.soft == 0


def test_four_lights_cannot_take_it_off_and_claim_what_it_turns() -> None:
    plates, normals, inside = filmed(FOUR, lambda cosine: lit_through(cosine, 0.25))
    found = Solving(error=True).solve(plates, under(FOUR), mask=inside)
    off, error_deg = off_deg(found, normals, inside), found.error_deg
    assert off.mean() > 5
    assert error_deg is not None
    assert (off <= 2 * error_deg[inside]).mean() > 0.9
    assert ((off > 10) & found.valid[inside]).mean() < 0.02
