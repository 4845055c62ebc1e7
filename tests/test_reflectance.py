"""What a whole subject reflects beyond n . l is found from all of it, and used where a pixel is explained better."""

from dataclasses import replace
from fractions import Fraction

import numba
import numpy as np
import pytest
from angles import angles_deg
from numpy.typing import NDArray
from ring_and_ball import ring

from psvideo.model.camera import Camera
from psvideo.model.irradiance.ground import Ground
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Reflectance, Subject, Surface
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.solve.depth import View
from psvideo.solve.images import solve_images
from psvideo.solve.instants import subject_of
from psvideo.solve.normals.illumination import Illumination, illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.robust import huber1981
from psvideo.solve.normals.robust.reflectance import points_of, reflectance_of
from psvideo.solve.normals.robust.reflectance_kernel import fill_roughness_in_the_fit
from psvideo.solve.normals.robust.reflected_gain import _rough as rough_in_loops
from psvideo.solve.normals.robust.subject_points import SubjectPoints
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.task import Usable

Array = NDArray[np.float64]
SIZE = 64


WAYS = np.concatenate([ring(8, 45), ring(4, 20)])
UP = np.array([0.0, 0.0, 1.0])
BESIDE_THE_AXIS = View(focal_px=(1.5 * SIZE, 1.5 * SIZE), principal_px=(1.0 * SIZE, 1.2 * SIZE))
"""What it shows lies 16 to 35 degrees beside the camera's axis."""


def waves() -> Array:
    """Normals of a wavy sheet that faces the camera."""
    v, u = np.mgrid[:SIZE, :SIZE] / SIZE
    down, across = np.gradient(0.05 * np.sin(6 * np.pi * u) * np.cos(5 * np.pi * v), 1 / SIZE)
    normals = np.stack([-across, down, np.ones_like(down)], axis=-1)
    return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def through(lens: View) -> Array:
    """The way to the camera from what every pixel shows."""
    x, y = lens.rays(SIZE, SIZE)
    ways = np.stack([*np.broadcast_arrays(-x, -y), np.ones((SIZE, SIZE))], axis=-1)
    return np.asarray(ways / np.linalg.norm(ways, axis=-1, keepdims=True))


def shot(
    normals: Array, sent: Array, *, gloss: Array | float, to_camera: Array | None = None
) -> list[NDArray[np.float32]]:
    """Plates of a brown surface with highlights as wide as varnish makes them; sent: (light, row, col, 3)."""
    rng, size = np.random.default_rng(1), np.linalg.norm(sent, axis=-1, keepdims=True)
    half = sent / size + (UP if to_camera is None else to_camera)
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    cosine = np.maximum((sent * normals).sum(axis=-1), 0)
    shine = gloss * size[..., 0] * np.maximum((half * normals).sum(axis=-1), 0) ** 25 * (cosine > 0)
    plates = cosine[..., None] * np.array([0.55, 0.45, 0.35]) + shine[..., None]
    return list((plates + rng.normal(0, 0.001, plates.shape)).astype(np.float32))


def distant() -> tuple[Illumination, Array]:
    lit = Illumination(directions=WAYS, intensities=np.full((len(WAYS), 3), 1.2))
    return lit, 1.2 * np.broadcast_to(WAYS[:, None, None], (len(WAYS), SIZE, SIZE, 3))


def without_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(huber1981, "points_of", lambda *_, **__: None)


def test_a_sheen_that_the_whole_subject_has_turns_no_normal(monkeypatch: pytest.MonkeyPatch) -> None:
    lit, sent = distant()
    normals = waves()
    plates = shot(normals, sent, gloss=0.15)
    found = Solving(error=True).solve(plates, lit)
    assert found.valid.mean() > 0.99
    off = angles_deg(found.normals, normals)
    albedo = found.albedo[found.valid].mean(axis=0)
    np.testing.assert_allclose(albedo, [0.55, 0.45, 0.35], atol=0.03)
    without_model(monkeypatch)
    before = angles_deg(Solving().solve(plates, lit).normals, normals)
    assert off.mean() < 0.35 * before.mean()
    assert off.mean() < 0.4


FIVE = np.concatenate([ring(4, 45), ring(1, 10)])


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("wrong_deg", [1, 2])
def test_five_lights_that_stand_elsewhere_than_the_rig_says_pass_for_no_sheen_and_no_clay(
    monkeypatch: pytest.MonkeyPatch, wrong_deg: float, seed: int
) -> None:
    normals, sent = waves(), np.broadcast_to(FIVE[:, None, None], (len(FIVE), SIZE, SIZE, 3))
    plates, across = shot(normals, sent, gloss=0.0), np.random.default_rng(seed).normal(size=FIVE.shape)
    across -= (across * FIVE).sum(axis=1, keepdims=True) * FIVE
    claimed = FIVE + np.tan(np.radians(wrong_deg)) * across / np.linalg.norm(across, axis=1, keepdims=True)
    claimed /= np.linalg.norm(claimed, axis=1, keepdims=True)
    off = angles_deg(Solving().solve(plates, under(claimed)).normals, normals)
    without_model(monkeypatch)
    before = angles_deg(Solving().solve(plates, under(claimed)).normals, normals)
    assert off.mean() <= 1.02 * before.mean()


def test_the_matte_part_of_a_subject_stays_matte(monkeypatch: pytest.MonkeyPatch) -> None:
    lit, sent = distant()
    normals = waves()
    half = np.arange(SIZE) < SIZE // 2
    plates = shot(normals, sent, gloss=np.where(half, 0.15, np.zeros((SIZE, SIZE))))
    off = angles_deg(Solving().solve(plates, lit).normals, normals)
    without_model(monkeypatch)
    before = angles_deg(Solving().solve(plates, lit).normals, normals)
    assert off[:, half].mean() < 0.8 * before[:, half].mean()
    assert off[:, ~half].mean() <= 1.05 * before[:, ~half].mean()


def test_a_matte_subject_is_solved_as_before_to_the_byte(monkeypatch: pytest.MonkeyPatch) -> None:
    lit, sent = distant()
    plates = shot(waves(), sent, gloss=0.0)
    plates[0][20:24, 20:24] += 0.3
    found = Solving().solve(plates, lit)
    without_model(monkeypatch)
    before = Solving().solve(plates, lit)
    assert found.normals.tobytes() == before.normals.tobytes()
    assert found.albedo.tobytes() == before.albedo.tobytes()


def clay(
    normals: Array, ways: Array, *, roughness: Array | float, to_camera: Array | None = None
) -> list[NDArray[np.float32]]:
    """Plates of brown clay by the angles of Oren and Nayar (1994), without the light from facet to facet."""
    rng, up = np.random.default_rng(2), np.broadcast_to(UP, normals.shape) if to_camera is None else to_camera
    square = np.asarray(roughness) ** 2
    flat, back = 1 - 0.5 * square / (square + 0.33), 0.45 * square / (square + 0.09)
    facing = (normals * up).sum(axis=-1)
    seen_at = np.arccos(np.clip(facing, -1, 1))
    plates = []
    for way in ways:
        cosine = normals @ way
        lit_at = np.arccos(np.clip(cosine, -1, 1))
        along, over = way - normals * cosine[..., None], up - normals * facing[..., None]
        sizes = np.linalg.norm(along, axis=-1) * np.linalg.norm(over, axis=-1)
        between = (along * over).sum(axis=-1) / np.maximum(sizes, 1e-12)
        more = np.maximum(between, 0) * np.sin(np.maximum(lit_at, seen_at)) * np.tan(np.minimum(lit_at, seen_at))
        light = np.where(cosine > 0, cosine * (flat + back * more), 0)
        plates.append(light[..., None] * np.array([0.55, 0.45, 0.35]))
    return [(plate + rng.normal(0, 0.001, plate.shape)).astype(np.float32) for plate in plates]


def under(ways: Array) -> Illumination:
    return Illumination(directions=ways, intensities=np.ones((len(ways), 3)))


@pytest.mark.parametrize(
    ("ways", "most_deg"), [(WAYS, 1.2), (np.concatenate([ring(4, 50), ring(1, 5)]), 1.4)], ids=["12 lights", "5 lights"]
)
def test_clay_turns_no_normal(monkeypatch: pytest.MonkeyPatch, ways: Array, most_deg: float) -> None:
    normals = waves()
    plates = clay(normals, ways, roughness=0.6)
    off = angles_deg(Solving().solve(plates, under(ways)).normals, normals)
    without_model(monkeypatch)
    before = angles_deg(Solving().solve(plates, under(ways)).normals, normals)
    assert off.mean() < 0.5 * before.mean()
    assert off.mean() < most_deg


def test_what_is_matte_beside_clay_stays_matte(monkeypatch: pytest.MonkeyPatch) -> None:
    normals, rough = waves(), np.arange(SIZE) < 0.75 * SIZE
    plates = clay(normals, WAYS, roughness=np.where(rough, 0.6, np.zeros((SIZE, SIZE))))
    off = angles_deg(Solving().solve(plates, under(WAYS)).normals, normals)
    without_model(monkeypatch)
    before = angles_deg(Solving().solve(plates, under(WAYS)).normals, normals)
    assert off[:, rough].mean() < 0.8 * before[:, rough].mean()
    assert off[:, ~rough].mean() <= 1.05 * before[:, ~rough].mean()


@pytest.mark.parametrize("material", ["gloss", "clay"])
def test_beside_the_lens_axis_gloss_and_clay_turn_no_normal(material: str) -> None:
    """They depend on the way to the camera, which is another in every pixel once the rig gives the lens."""
    normals, to_camera = waves(), through(BESIDE_THE_AXIS)
    if material == "clay":
        plates = clay(normals, WAYS, roughness=0.6, to_camera=to_camera)
    else:
        sent = np.broadcast_to(WAYS[:, None, None], (len(WAYS), SIZE, SIZE, 3))
        plates = shot(normals, sent, gloss=0.3, to_camera=to_camera)
    lamps = [Light(name=str(k), direction=(float(x), float(y), float(z))) for k, (x, y, z) in enumerate(WAYS)]
    far_away = Rig(lights=tuple(lamps))
    lens = replace(far_away, focal_px=BESIDE_THE_AXIS.focal_px, principal_px=BESIDE_THE_AXIS.principal_px)
    before, found = (solve_images(plates, rig, saturation=np.inf) for rig in (far_away, lens))
    off, off_before = (angles_deg(one.normals, normals).mean() for one in (found, before))
    assert off < 0.5
    assert off < 0.25 * off_before
    assert found.valid.mean() > 0.99


def test_through_a_lens_a_pixel_is_solved_alike_whatever_is_beside_it_and_by_any_number_of_threads() -> None:
    normals, to_camera = waves(), through(BESIDE_THE_AXIS)
    sent = np.broadcast_to(WAYS[:, None, None], (len(WAYS), SIZE, SIZE, 3))
    plates = shot(normals, sent, gloss=0.3, to_camera=to_camera)
    lit = replace(under(WAYS), view=BESIDE_THE_AXIS)
    noise = PlateNoise(read=1e-6, photon=0.0)
    whole = huber1981.solve(LitPlates(plates, lit), plate_noise=noise, threads=1)
    assert whole.misfit is not None
    assert whole.misfit.reflectance is not None
    again = huber1981.solve(LitPlates(plates, lit), plate_noise=noise, threads=4)
    few = np.zeros((SIZE, SIZE), np.bool_)
    few[::3, ::5] = True
    apart = huber1981.solve(LitPlates(plates, lit, mask=few), plate_noise=noise, misfit=whole.misfit)
    np.testing.assert_array_equal(again.normals, whole.normals)
    np.testing.assert_allclose(apart.normals[few], whole.normals[few], atol=2e-5)


def test_what_is_unsure_for_motion_says_nothing_of_the_subject() -> None:
    """Residuals of what moved and was not followed look like roughness; what stands still beside it is matte."""
    moved = np.arange(SIZE) < 0.75 * SIZE
    plates = clay(waves(), WAYS, roughness=np.where(moved, 0.6, np.zeros((SIZE, SIZE))))
    unsure = np.zeros((len(WAYS), SIZE // 2, SIZE // 2), np.float32)
    unsure[3, :, moved[::2]] = 0.2
    for off, found in ((None, True), (0.01 * unsure, True), (unsure, False)):
        surface = Solving().solve(plates, under(WAYS), unsure=off)
        assert surface.misfit is not None
        assert (surface.misfit.reflectance is not None) == found
        look = Solving().look(LitPlates(plates, under(WAYS), unsure=off))
        assert look is not None
        assert (reflectance_of([look]) is not None) == found
    patchy = np.where(np.random.default_rng(3).random(unsure.shape[1:]) < 0.5, np.float32(0.2), np.float32(0))
    unsure[5] = patchy  # what lies between is said to be sure by chance
    assert Solving().look(LitPlates(plates, under(WAYS), unsure=unsure)) is None


def test_a_look_weighs_lights_by_what_stands_as_solving_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where what moves is far brighter, its light would have noise count less than it does for what stands."""
    found = list[Surface]()

    def noted(given: LitPlates, one: Surface, usable: Usable, *, step: int) -> SubjectPoints | None:
        found.append(replace(one, normals=one.normals.copy()))
        return points_of(given, one, usable, step=step)

    monkeypatch.setattr(huber1981, "points_of", noted)
    moves = np.arange(SIZE) < 0.6 * SIZE
    strengths = np.resize([1.0, 0.1], len(WAYS))
    rng, shades = np.random.default_rng(2), np.maximum(np.einsum("lx,rcx->lrc", WAYS, waves()), 0)
    clean = shades * strengths[:, None, None] * np.where(moves, 0.8, 0.04)
    clean += 0.3 * clean * moves * rng.normal(size=shades.shape)
    plates = [*(clean + rng.normal(0, 0.001, clean.shape)).astype(np.float32)]
    lit = Illumination(directions=WAYS, intensities=strengths[:, None])
    noise = PlateNoise(read=1e-6, photon=0.0)
    for known in (moves, np.zeros(SIZE, np.bool_)):
        found.clear()
        given = LitPlates(plates, lit, moves=np.tile(known[None, ::2], (SIZE // 2, 1)))
        huber1981.solve(given, plate_noise=noise)
        assert huber1981.look(given, plate_noise=noise) is not None
        solved, looked = found
        assert np.array_equal(solved.normals, looked.normals)


def test_a_take_looks_at_what_is_sure_in_its_rounds() -> None:
    moved, lamps = np.arange(SIZE) < 0.75 * SIZE, ring(6, 45)
    pictures = clay(waves(), lamps, roughness=np.where(moved, 0.6, np.zeros((SIZE, SIZE))))
    names = tuple(f"lamp{k}" for k in range(len(lamps)))
    camera = Camera(width_px=SIZE, height_px=SIZE, fps=Fraction(60), exposure_s=1 / 60, readout_s=0.01)
    flashes = tuple(PlannedFlash(lights={name: 1.0}, duration_s=5e-4) for name in names)
    plan = Plan(camera=camera, flashes=flashes, dark_s=1e-3)
    rig = Rig(lights=tuple(Light(name=name, direction=at) for name, at in zip(names, lamps, strict=True)))
    plates = tuple(
        LightPlate(light=name, number=1001, time_s=0.0, picture=mixture_of(picture), seen=np.ones(SIZE, np.bool_))
        for name, picture in zip(names, pictures, strict=True)
    )
    unsure = np.zeros((len(names), SIZE, SIZE), np.float32)
    unsure[2, :, moved] = 0.2
    for off, found in ((None, True), (unsure, False)):
        subject = subject_of([Round(number=1001, plates=plates, unsure=off)], plan, rig)
        assert subject is not None
        assert (subject.reflectance is not None) == found


@pytest.mark.parametrize(("roughness", "lean_counts"), [(0.08, False), (0.3, True)])
def test_facets_that_lean_by_little_are_no_clay(roughness: float, lean_counts: bool) -> None:
    """They turn normals by a fraction of a degree, as much as faults that come and go from round to round."""
    normals, ways = waves(), np.concatenate([ring(4, 50), ring(1, 5)])
    found = seen_in(clay(normals, ways, roughness=roughness), under(ways))
    assert (found is not None and found.rough > 0) == lean_counts


def test_what_is_dark_under_grazing_light_is_not_taken_for_clay() -> None:
    """A black level that was not taken off looks like roughness and a curve at once, and is neither."""
    normals = waves()
    plates = [plate - np.float32(0.04) for plate in clay(normals, WAYS, roughness=0.0)]
    found = seen_in(plates, under(WAYS))
    assert found is None or found.rough == 0


def test_lights_that_are_off_are_not_taken_for_clay() -> None:
    normals, rng = waves(), np.random.default_rng(8)
    for _ in range(5):
        wrong = WAYS + np.radians(3) * rng.normal(size=WAYS.shape) / np.sqrt(2)
        wrong /= np.linalg.norm(wrong, axis=1, keepdims=True)
        found = seen_in(clay(normals, WAYS, roughness=0.0), under(wrong))
        assert found is None or found.rough == 0


@numba.njit(error_model="numpy")  # kept nowhere: a test would not see that the loops have changed
def fill_roughness(given: NDArray[np.float32], found: NDArray[np.float32]) -> None:
    """Call the loops' part, which nothing outside of compiled functions can call."""
    for i in range(given.shape[1]):
        found[0, i], found[1, i], found[2, i] = rough_in_loops(given[0, i], given[1, i], given[2, i])


def test_what_roughness_gains_with_a_turn_is_its_slope_in_the_loop_and_in_the_fit() -> None:
    """Of any angles between normal, light and camera, beside the ones at which its formula changes."""
    rng, step = np.random.default_rng(4), 1e-3
    cosine, facing, towards = rng.uniform(0.1, 0.95, (3, 400))
    beside = (np.abs(cosine - facing) > 0.02) & (np.abs(towards - cosine * facing) > 0.02)
    cosine, facing, towards = (each[beside] for each in (cosine, facing, towards))

    def added(cosine: Array, facing: Array) -> Array:
        return np.asarray(cosine * np.maximum(towards - cosine * facing, 0) / np.maximum(cosine, facing), np.float64)

    slopes = (
        added(cosine, facing),
        (added(cosine + step, facing) - added(cosine - step, facing)) / (2 * step),
        (added(cosine, facing + step) - added(cosine, facing - step)) / (2 * step),
    )
    in_loops = np.empty((3, len(cosine)), np.float32)
    fill_roughness(np.stack([cosine, facing, towards]).astype(np.float32), in_loops)
    np.testing.assert_allclose(in_loops, slopes, rtol=1e-3, atol=1e-5)
    in_fit = np.empty((3, len(cosine)))
    fill_roughness_in_the_fit(np.stack([cosine, facing, towards]), in_fit)
    np.testing.assert_allclose(in_fit, slopes, rtol=1e-3, atol=1e-5)


def test_near_lights_show_the_same_sheen() -> None:
    focal, middle, depth = 2.0 * SIZE, (SIZE - 1) / 2, 1.0
    ground = Ground(
        depth_m=np.full((SIZE, SIZE), depth, np.float32),
        middle_m=np.array([0.0, 0.0, -depth]),
        focal_px=(focal, focal),
        principal_px=(middle, middle),
    )
    where = [way * 0.8 - np.array([0.0, 0.0, depth]) for way in WAYS]
    lights = [
        Light(name=str(k), position_m=(float(x), float(y), float(z)), intensity=(0.64, 0.64, 0.64))
        for k, (x, y, z) in enumerate(where)
    ]
    lit = illumination(lights, channels=3, ground=ground)
    rows, cols = np.mgrid[:SIZE, :SIZE] - middle
    points = np.stack([cols / focal * depth, -rows / focal * depth, np.full((SIZE, SIZE), -depth)], axis=-1)
    away = np.stack(where)[:, None, None] - points
    sent = 0.64 * away / np.linalg.norm(away, axis=-1, keepdims=True) ** 3
    near = seen_in(shot(waves(), sent, gloss=0.15, to_camera=through(lit.view)), lit)
    far_lit, far_sent = distant()
    far = seen_in(shot(waves(), far_sent, gloss=0.15), far_lit)
    assert far is not None
    assert near is not None
    assert far.middle > 0.05
    np.testing.assert_allclose(near, far, atol=0.06)


def test_a_subject_that_is_known_is_solved_as_one_that_was_found() -> None:
    lit, sent = distant()
    plates = shot(waves(), sent, gloss=0.15)
    alone, matte = (Solving(subject=known).solve(plates, lit) for known in (None, Subject(reflectance=None)))
    look = Solving().look(LitPlates(plates, lit))
    assert look is not None
    again = Solving(subject=Subject(reflectance=reflectance_of([look]))).solve(plates, lit)
    assert again.normals.tobytes() == alone.normals.tobytes()
    assert again.albedo.tobytes() == alone.albedo.tobytes()
    assert matte.misfit is not None
    assert matte.misfit.reflectance is None
    assert angles_deg(matte.normals, waves()).mean() > 2 * angles_deg(alone.normals, waves()).mean()


def test_a_glossy_subject_is_solved_as_one_that_is_hardly_rough_besides() -> None:
    """What is not rough takes fewer steps to the same end."""
    lit, sent = distant()
    plates = shot(waves(), sent, gloss=0.15)
    glossy = Reflectance(curve=0.1, rough=0.0, soft=0.0, broad=0.05, middle=0.1, narrow=0.05)
    plain, rough, matte = (
        Solving(subject=Subject(reflectance=known)).solve(plates, lit).normals
        for known in (glossy, glossy._replace(rough=1e-12), None)
    )
    assert angles_deg(plain, rough).max() < 0.02
    assert angles_deg(plain, matte).max() > 1


def test_what_one_look_at_a_subject_cannot_show_another_does() -> None:
    """A round in which clay stands flat before the camera says nothing of it, and takes nothing from one that does."""
    flat = np.broadcast_to([0.0, 0.0, 1.0], (SIZE, SIZE, 3))
    clays = [clay(normals, WAYS, roughness=0.5) for normals in (flat, waves())]
    looks = [Solving().look(LitPlates(plates, under(WAYS))) for plates in clays]
    of_flat, of_waves = (look for look in looks if look is not None)
    assert reflectance_of([of_flat]) is None
    alone, together = reflectance_of([of_waves]), reflectance_of([of_flat, of_waves])
    assert alone is not None
    assert together is not None
    np.testing.assert_allclose(together, alone, atol=0.05)
    assert together.rough > 0.3
    assert reflectance_of([]) is None


def seen_in(plates: list[NDArray[np.float32]], lit: Illumination) -> Reflectance | None:
    """Return what is found of a subject whose normals are known."""
    found = Surface(
        normals=waves().astype(np.float32),
        albedo=np.full((SIZE, SIZE, 3), 0.5, np.float32),
        valid=np.ones((SIZE, SIZE), bool),
    )
    points = points_of(LitPlates(plates, lit), found, Usable(dark_level=0.003), step=1)
    return None if points is None else reflectance_of([points])
