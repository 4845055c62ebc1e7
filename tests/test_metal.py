"""Bare metal is told from what is matte, soft or varnished, and its normals are found under its own highlights.

The pictures are made here, of microfacets (B. Walter et al., EGSR 2007, G. Ward's lobe of 1992, R. Cook and
K. Torrance's of 1982), which the lobes that are fitted are not.
"""

from typing import Any, Literal

import numpy as np
import pytest
from angles import angles_deg
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from ring_and_ball import ring

from psvideo.model.surface import Metal, RivalLobes, Subject, Surface
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.metal.lobe_fit import directions
from psvideo.solve.normals.metal.lobe_kernel import fill_sums, fill_unlike
from psvideo.solve.normals.metal.matte_kernel import fill_matte
from psvideo.solve.normals.metal.matte_plates import matte_plates, metal_doubt_deg
from psvideo.solve.normals.metal.metal_fit import metal_of
from psvideo.solve.normals.metal.metal_normals import find_normals
from psvideo.solve.normals.solving import Solving

Array = NDArray[np.float64]
Kind = Literal["microfacets", "ward", "beckmann"]
SIZE = 72
EIGHT = np.concatenate([ring(5, 45), ring(3, 22)])
TWELVE = np.concatenate([ring(8, 48), ring(4, 22)])
UP = np.array([0.0, 0.0, 1.0])
BRONZE, STEEL, MATTE, VARNISH = (0.05, 0.6, 0.35), (0.02, 0.7, 0.25), (0.6, 0.0, 0.3), (0.5, 0.04, 0.2)
"""Diffuse share, strength and roughness of the highlight."""


def bumps() -> Array:
    """Normals of a dented dome, which face every way up to 55 degrees from the camera."""
    y, x = np.mgrid[-1 : 1 : SIZE * 1j, -1 : 1 : SIZE * 1j]
    down, across = -0.75 * y + 0.4 * np.cos(5 * y) * np.cos(4 * x), -0.75 * x - 0.4 * np.sin(5 * y) * np.sin(4 * x)
    normals = np.stack([-across, down, np.ones_like(down)], axis=-1)
    return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def lobe(normals: Array, light: Array, roughness: float, kind: Kind) -> Array:
    """What a rough metal mirrors of a light, over the light that falls on it."""
    half = (light + UP) / np.linalg.norm(light + UP)
    h, c, facing = (np.maximum(normals @ way, 1e-3) for way in (half, light, UP))
    square = roughness**2
    if kind == "ward":
        tangent_square = (1 - h * h) / (h * h)
        return np.asarray(np.exp(-tangent_square / square) / (4 * np.pi * square * np.sqrt(c * facing)))
    if kind == "beckmann":
        along = float((light + UP)[2] / np.linalg.norm(light + UP))
        open_to_both = np.minimum(1, 2 * h * np.minimum(facing, c) / along)
        facets = np.exp(-(1 - h * h) / (h * h) / square) / (np.pi * square * h**4)
        return np.asarray(facets * open_to_both / (4 * c * facing))
    share = square / np.pi / (h * h * (square - 1) + 1) ** 2
    seen = [2 * each / (each + np.sqrt(square + (1 - square) * each * each)) for each in (c, facing)]
    return np.asarray(share * seen[0] * seen[1] / (4 * c * facing))


def shot(
    normals: Array, lights: Array, material: tuple[float, float, float], kind: Kind = "microfacets", *, seed: int = 0
) -> Array:
    """Plates (light, row, col) of a surface, at most a little clipped, with a camera's noise."""
    diffuse, strength, roughness = material
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:SIZE, :SIZE] / SIZE
    paint = 1 + 0.3 * np.sin(9 * x) * np.sin(7 * y)
    shown = np.stack([
        np.maximum(normals @ light, 0) * paint * (diffuse / np.pi + strength * lobe(normals, light, roughness, kind))
        for light in lights
    ])  # fmt: skip
    shown *= 0.7 / np.quantile(shown.max(axis=0), 0.9)
    shown = np.minimum(shown, 1.0)
    return np.asarray(np.maximum(shown + rng.normal(0, 1, shown.shape) * 0.004 * np.sqrt(shown + 0.02), 0))


def under(lights: Array) -> Illumination:
    """Distant lights of the same strength."""
    return Illumination(directions=lights, intensities=np.ones((len(lights), 1)))


def solved(plates: NDArray[np.floating], lights: Array, *, metal: bool = True) -> Surface:
    """What runs make of plates."""
    return Solving(error=True, metal=metal).solve([*plates.astype(np.float32)], under(lights))


def found_in(plates: Array, lights: Array) -> Metal | None:
    """What a subject shows as metal."""
    look = Solving().look(LitPlates([*plates.astype(np.float32)], under(lights)))
    return None if look is None else metal_of([look])


METALS: list[Any] = [
    (BRONZE, "microfacets", EIGHT, 3.5),
    pytest.param(BRONZE, "microfacets", TWELVE, 3.5, marks=pytest.mark.campaign),
    pytest.param(BRONZE, "ward", TWELVE, 3.5, marks=pytest.mark.campaign),
    pytest.param(BRONZE, "beckmann", TWELVE, 3.5, marks=pytest.mark.campaign),
    (STEEL, "ward", TWELVE, 3.5),
]


@pytest.mark.parametrize(("material", "kind", "lights", "most_deg"), METALS)
def test_metal_is_solved_by_its_highlights(
    material: tuple[float, float, float], kind: Kind, lights: Array, most_deg: float
) -> None:
    truth = bumps()
    plates = shot(truth, lights, material, kind)
    as_metal, as_matte = (solved(plates, lights, metal=metal) for metal in (True, False))
    off = angles_deg(as_metal.normals, truth)
    assert off.mean() < most_deg
    assert angles_deg(as_matte.normals, truth).mean() > 2.5 * off.mean()
    assert as_metal.error_deg is not None
    assert (off <= as_metal.error_deg).mean() > 0.6
    assert (off <= 2 * as_metal.error_deg).mean() > 0.9
    assert (off[as_metal.valid] > 10).mean() < 0.03


@pytest.mark.parametrize("kind", ["microfacets", pytest.param("ward", marks=pytest.mark.campaign)])
def test_albedo_of_metal_is_that_of_what_faces_the_camera(kind: Kind) -> None:
    """What leans is dark under lamps that it does not mirror, and no darker metal for that."""
    truth = bumps()
    albedo = solved(shot(truth, TWELVE, BRONZE, kind), TWELVE).albedo.reshape(SIZE, SIZE)
    lean, straight = (np.median(albedo[some]) for some in (truth[..., 2] < 0.65, truth[..., 2] > 0.9))
    assert 1 / 1.6 < lean / straight < 1.6


@pytest.mark.parametrize("material", [MATTE, VARNISH, (0.5, 0.05, 0.45)])
@pytest.mark.parametrize("lights", [EIGHT, TWELVE])
def test_what_is_matte_or_varnished_is_no_metal(material: tuple[float, float, float], lights: Array) -> None:
    plates = shot(bumps(), lights, material)
    assert found_in(plates, lights) is None
    some, others = (solved(plates, lights, metal=metal) for metal in (True, False))
    assert some.normals.tobytes() == others.normals.tobytes()
    assert some.error_deg is not None
    assert others.error_deg is not None
    assert some.error_deg.tobytes() == others.error_deg.tobytes()


def test_lights_that_are_off_make_nothing_metal() -> None:
    rng = np.random.default_rng(2)
    for degrees in (3.0, 10.0):
        off = TWELVE + rng.normal(0, np.radians(degrees) / np.sqrt(2), TWELVE.shape)
        off /= np.linalg.norm(off, axis=1, keepdims=True)
        for material in (MATTE, VARNISH):
            assert found_in(shot(bumps(), TWELVE, material), off) is None


WIDE = np.concatenate([ring(6, 65), ring(4, 35)])


@pytest.mark.parametrize("lights", [TWELVE, WIDE])
def test_what_is_soft_or_lit_from_around_is_no_metal(lights: Array) -> None:
    truth, rng = bumps(), np.random.default_rng(3)
    cosines = np.stack([truth @ light for light in lights])
    wax = 0.5 * np.maximum((cosines + 0.35) / 1.35, 0)
    room = 0.5 * np.maximum(cosines, 0) + 0.03
    for shown in (wax, room):
        assert found_in(np.maximum(shown + rng.normal(0, 0.003, shown.shape), 0), lights) is None


def test_lights_on_a_ring_are_not_asked() -> None:
    """They mirror in as many places on either side of one circle: a ball lit from around came out 47 degrees off."""
    assert found_in(shot(bumps(), ring(8, 50), BRONZE), ring(8, 50)) is None


def test_fewer_lights_are_not_asked() -> None:
    lights = EIGHT[:6]
    plates = shot(bumps(), lights, BRONZE)
    assert found_in(plates, lights) is None
    assert solved(plates, lights).normals.tobytes() == solved(plates, lights, metal=False).normals.tobytes()


def test_of_a_machine_only_the_metal_is_solved_as_metal() -> None:
    truth = bumps()
    metal, paint = shot(truth, TWELVE, BRONZE, "ward"), shot(truth, TWELVE, MATTE)
    left = np.arange(SIZE) < SIZE // 2
    plates = np.where(left, paint, metal)
    found, without = (angles_deg(solved(plates, TWELVE, metal=on).normals, truth) for on in (True, False))
    assert found[:, ~left].mean() < 0.5 * without[:, ~left].mean()
    assert found[:, left].mean() < 1


def test_a_take_shares_what_was_found_of_its_metal() -> None:
    plates = shot(bumps(), TWELVE, BRONZE).astype(np.float32)
    lit, alone = under(TWELVE), solved(plates, TWELVE)
    look = Solving().look(LitPlates([*plates], lit))
    assert look is not None
    known = Subject(reflectance=None, metal=metal_of([look]))
    assert known.metal is not None
    again = Solving(error=True, subject=known).solve([*plates], lit)
    assert angles_deg(again.normals, alone.normals).mean() < 0.1
    matte = Solving(subject=Subject(reflectance=None)).solve([*plates], lit)
    assert angles_deg(matte.normals, bumps()).mean() > 2 * angles_deg(again.normals, bumps()).mean()


@given(st.floats(0, 50), st.floats(0, 360), st.integers(2, 6), st.floats(0.05, 0.5), st.floats(0.01, 100))
def test_a_normal_is_found_under_known_lobes_whatever_its_scale(
    slant_deg: float, turn_deg: float, first: int, matte: float, scale: float
) -> None:
    slant, turn = np.radians([slant_deg, turn_deg])
    normal = np.array([[np.sin(slant) * np.cos(turn), np.sin(slant) * np.sin(turn), np.cos(slant)]])
    towards, half = ways(TWELVE, 1)
    numbers = np.zeros(17)
    numbers[[0, first]] = matte, 1 - matte
    shown, found = np.empty((12, 1)), np.empty((1, 3))
    fill_sums(normal, towards, half, numbers, shown)
    find_normals(scale * shown, np.ones((12, 1)), towards, half, directions(7, 85), numbers, found)
    again = np.empty((12, 1))
    fill_sums(found, towards, half, numbers, again)
    left = np.empty(1)
    fill_unlike(scale * shown, np.ones((12, 1)), again, left)
    assert left[0] < 1e-4
    assert angles_deg(found, normal)[0] < 1.5


def ways(lights: Array, points: int) -> tuple[Array, Array]:
    """Directions to the lights and half way to the camera (light, point, 3)."""
    half = (lights + UP) / np.linalg.norm(lights + UP, axis=1, keepdims=True)
    return tuple(np.ascontiguousarray(np.repeat(each[:, None], points, axis=1)) for each in (lights, half))  # type: ignore[return-value]


def test_least_squares_finds_the_normals_of_matte_plates_again() -> None:
    rng = np.random.default_rng(5)
    normals = np.array([0.5, 0.5, 0.0]) * rng.normal(size=(40, 3)) + UP
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    towards, half = ways(TWELVE, 40)
    numbers = np.zeros(17)
    numbers[[0, 4, 5]] = 0.2, 0.4, 0.4
    shown, matte = np.empty((12, 40)), np.empty((12, 40))
    fill_sums(normals, towards, half, numbers, shown)
    shown *= np.exp(0.02 * rng.normal(size=shown.shape))
    lit = (TWELVE @ normals.T > 0).astype(float)
    fill_matte(shown, lit, towards, half, normals, numbers, matte)
    for point in range(40):
        known = lit[:, point] > 0
        g, *_ = np.linalg.lstsq(TWELVE[known], matte[known, point], rcond=None)
        left = matte[known, point] - TWELVE[known] @ g
        assert angles_deg(g / np.linalg.norm(g), normals[point]) < 1.5
        assert np.abs(left).max() > 0


def test_clipped_and_dark_samples_stay_as_they_are() -> None:
    truth = bumps()
    plates = np.minimum(3 * shot(truth, TWELVE, BRONZE), 1.0).astype(np.float32)
    lit, how = under(TWELVE), Solving()
    look = how.look(LitPlates([*plates], lit))
    assert look is not None
    metal = metal_of([look])
    assert metal is not None
    surface, one, _ = how.measured(LitPlates([*plates], lit))
    made = np.stack(matte_plates([*plates], lit, metal, surface, one.usable, seen=None, mask=None))
    kept = (plates >= 1.0) | (plates <= one.usable.dark_level)
    assert kept.mean() > 0.02
    assert np.array_equal(made[kept], plates[kept])
    assert not np.array_equal(made, plates)
    assert np.isfinite(made).all()


def test_under_broad_lobes_a_flatter_or_steeper_surface_is_likelier() -> None:
    likely = {
        roughness: max(rival.likely for rival in found.rivals)
        for roughness in (0.25, 0.35, 0.6)
        if (found := found_in(shot(bumps(), TWELVE, (0.02, 0.7, roughness), "ward"), TWELVE)) is not None
    }
    assert likely[0.25] < 0.4
    assert likely[0.35] < 0.4
    assert 0.6 < likely[0.6] <= 1.0


def test_where_likely_lobes_disagree_normals_are_doubted() -> None:
    plates = shot(bumps(), TWELVE, BRONZE).astype(np.float32)
    lit, how = under(TWELVE), Solving()
    surface, one, _ = how.measured(LitPlates([*plates], lit))
    look = how.look(LitPlates([*plates], lit))
    assert look is not None
    metal = metal_of([look])
    assert metal is not None
    matte_rival = RivalLobes((1.0, *(0.0,) * 16), 1.0)
    doubts = [
        metal_doubt_deg([*plates], lit, each, surface, one.usable, seen=None, step=4)
        for each in (metal._replace(rivals=()), metal._replace(rivals=(matte_rival,)))
    ]
    assert doubts[0].shape == (SIZE // 4, SIZE // 4)
    assert np.median(doubts[1]) > 2 * np.median(doubts[0]) > 0
