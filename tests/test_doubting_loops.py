"""The compiled loops of doubting give what their formulas give in plain numpy, to rounding."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from ring_and_ball import ring

from psvideo.model.surface import Surface
from psvideo.solve.depth import View
from psvideo.solve.normals.evidence import Evidence, Indirect, Left
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.loops.blocks import working_memory
from psvideo.solve.normals.task import Usable, task
from psvideo.solve.normals.trust import signs as of_signs
from psvideo.solve.normals.trust import surroundings as of_around
from psvideo.solve.normals.trust import thin_surface as thin
from psvideo.solve.normals.trust import torn as of_torn
from psvideo.solve.normals.trust.doubting import Doubting, doubt_deg
from psvideo.solve.normals.trust.hidden_share import hidden_of
from psvideo.solve.normals.trust.indirect_kernel import FACING, MOST_INDIRECT, SHADOWED, indirect_rows
from psvideo.solve.normals.trust.judging_kernel import add_rows
from psvideo.solve.normals.trust.signs import Signs, signs_of
from psvideo.solve.normals.trust.thin_surface import ThinSurface

SHAPE = (67, 90)


def a_surface(lights: int, *, robust: bool, seed: int) -> tuple[ThinSurface, Evidence]:
    """Return a wavy surface with noise, holes, black cloth and a part that hardly any model explains."""
    rng = np.random.default_rng(seed)
    row, col = np.mgrid[: SHAPE[0], : SHAPE[1]]
    slopes = np.stack([np.sin(col / 9), np.cos(row / 7), np.full(SHAPE, 1.5)], axis=-1)
    normals = slopes + rng.normal(0, 0.05, (*SHAPE, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    valid = (rng.random(SHAPE) > 0.03) & (col > 8) & ~((row > 40) & (col > 70))
    albedo = np.where(row > 50, 0.01, 0.3 + 0.2 * np.sin(row / 5)).astype(np.float32)
    noise = (0.2 + 0.3 * rng.random(SHAPE)).astype(np.float32)
    fit = (noise * rng.chisquare(1, SHAPE) + 3 * (col > 60) + 40 * (rng.random(SHAPE) > 0.99)).astype(np.float32)
    counts = rng.integers(0, lights, SHAPE).astype(np.float32)
    planes = np.ascontiguousarray(np.moveaxis(normals.astype(np.float16), -1, 0))
    surface = Surface(
        normals=np.moveaxis(planes, 0, -1),
        albedo=albedo,
        valid=valid,
        residual=None,
        error_deg=noise if robust else None,
    )
    lit = Illumination(directions=ring(lights, 35), intensities=1 + 0.2 * rng.random((lights, 1)))
    one = Evidence(
        plates=[np.zeros(SHAPE, np.float32)] * lights,
        lit=lit,
        usable=Usable(dark_level=0.003, shadow_ratio=0.0),
        indirect=Indirect(
            (counts * rng.normal(0.02, 0.03, SHAPE)).astype(np.float32),
            counts,
            (1 + counts * rng.random(SHAPE)).astype(np.float32),
        ),
    )
    points = ThinSurface(
        step=1, surface=surface, noise_deg=noise, fit_deg=fit, fit_of_noise_deg=noise * np.float32(0.9)
    )
    return points, one


def mean(plane: np.ndarray, width: int) -> np.ndarray:
    return np.asarray(cv2.blur(plane, (width, width), borderType=cv2.BORDER_CONSTANT) + 1e-9)


def in_numpy(points: ThinSurface, one: Evidence, turned_deg: np.ndarray | None) -> Signs:
    """Return the signs by their formulas, in double precision, one operation after the other."""
    assert one.indirect is not None
    sums, counts, wider = (plane.astype(float) for plane in one.indirect)
    known, lights, plain = points.known, len(one.plates), points.surface.error_deg is None
    albedo, noise_deg = (plane.astype(float) for plane in (points.brightness * known, points.noise_deg))
    fit = np.minimum(points.fit_deg, of_signs.MOST_FIT_DEG).astype(float)
    noise = points.fit_of_noise_deg.astype(float) ** 2 * (1 if plain else wider)
    squares = np.where(known, fit**2 - of_around.UNSURE_OF_NOISE * noise, 0)
    if turned_deg is not None:
        squares *= cv2.blur(turned_deg, (of_signs.OF_MOTION, of_signs.OF_MOTION)) < of_signs.MOVING_DEG
    widths = [thin.width_of(known, share) for share in (thin.AROUND, thin.FAR_AROUND)]
    shown = np.minimum(albedo, albedo.sum() / known.sum())
    common = (noise * albedo**2).sum() / (albedo**2).sum()
    unsure = np.minimum(noise, common) * (plain | (lights - counts > 3))
    outlying = of_around.OUTLYING_OF_ONE if lights == 4 else of_around.OUTLYING_OF_MORE

    def roots(of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        surely, likely = [], []
        for width in widths:
            weight, count = mean(shown, width), mean((shown > 0).astype(float), width) * width**2
            chance = of_around.CERTAIN * np.sqrt(2 / np.maximum(count, 1)) * mean(noise * shown, width) / weight
            typical = mean(of * shown, width) / weight
            for _ in range(of_around.TURNS):
                most = of_around.OUTLYING**2 * np.maximum(typical, of_around.LEAST_LEVEL_DEG**2) + outlying * noise
                typical = mean(np.minimum(of, most) * shown, width) / weight
            margin = (of_around.UNSURE_OF_NOISE - 1) * mean(unsure * shown, width) / weight
            surely.append(np.sqrt(np.maximum(typical - chance, 0)))
            likely.append(np.sqrt(np.maximum(typical + margin, 0)))
        return np.maximum(*surely), np.maximum(*likely)

    misfit_deg, likely_deg = roots(squares)
    uneven = np.zeros(SHAPE)
    if plain and lights > 3:
        share = (roots(changes_in_numpy(fit, known, noise, lights - 3))[0] / np.maximum(misfit_deg, 1e-6)) ** 2
        uneven = np.clip((share - of_signs.SURFACES_UNEVEN) / (1 - of_signs.SURFACES_UNEVEN), 0, 1)
    torn = torn_in_numpy(points)
    sure = torn - of_torn.SURELY_TORN**2 * (noise_deg**2 + uneven * misfit_deg**2)
    likely = torn - of_torn.SURELY_TORN**2 * uneven * misfit_deg**2 - of_torn.TORN_OF_NOISE**2 * noise_deg**2
    around, far_around = widths
    far = mean(sums, far_around) / np.maximum(mean(counts, far_around), of_signs.LEAST_UNREACHED)
    near = (mean(sums, around) + of_signs.LEAST_UNREACHED * far) / (mean(counts, around) + of_signs.LEAST_UNREACHED)
    own = np.maximum(sums / np.maximum(counts, 1) - 2 * np.radians(noise_deg), 0)
    added = np.linalg.pinv(one.lit.directions) @ np.ones(lights)
    along = np.tensordot(added, points.planes.astype(float), 1)
    turned = np.sqrt(np.maximum(added @ added - along**2, 0))
    return Signs(
        misfit_deg=misfit_deg,
        likely_misfit_deg=likely_deg,
        uneven=uneven.astype(np.float32),
        indirect_deg=np.degrees(np.maximum(near, 0) + own) * turned,
        torn_deg=np.sqrt(np.maximum(sure, 0)),
        likely_torn_deg=np.sqrt(np.maximum(likely, 0)),
        noise_deg=noise_deg,
        lost_deg=noise_deg * np.sqrt(wider - 1),
        hidden=hidden_of(one.lit, plain=plain),
        plain=plain,
    )


def changes_in_numpy(fit: np.ndarray, known: np.ndarray, noise: np.ndarray, free: int) -> np.ndarray:
    apart, total, count = of_signs.UNEVEN_PX, np.zeros(SHAPE), np.full(SHAPE, 1e-9)
    for axis in (0, 1):
        ends = slice(None), slice(None, -apart)
        here, there = (ends[::-1], (slice(apart, None), slice(None))) if axis == 0 else (ends, np.s_[:, apart:])
        both = known[here] & known[there]
        total[here] += np.where(both, (fit[here] - fit[there]) ** 2 / 2, 0)
        count[here] += both
    typical = {1: np.sqrt(2 / np.pi), 5: np.sqrt(2 / 5) * 2 / (0.75 * np.sqrt(np.pi))}[free]  # of chi, over its size
    return np.asarray(total / count / (1 - typical**2) - of_around.UNSURE_OF_NOISE * noise)


def torn_in_numpy(points: ThinSurface) -> np.ndarray:
    across, up, towards = points.planes.astype(float)
    facing, known = np.maximum(towards, of_torn.LEAST_FACING), points.known
    right, down = -across / facing, up / facing
    within, whole = np.zeros(SHAPE), np.zeros(SHAPE)
    within[:-1, :-1] = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    along, over = right[:, :-1] + right[:, 1:], down[:-1] + down[1:]
    seen = (facing[:-1, :-1] + facing[1:, :-1] + facing[:-1, 1:] + facing[1:, 1:]) / 4
    whole[:-1, :-1] = (along[:-1] - along[1:] + over[:, 1:] - over[:, :-1]) / 2 * seen**1.5
    whole = np.clip(whole, -of_torn.MOST_TORN, of_torn.MOST_TORN) * within
    each = np.degrees(mean(whole, of_torn.TORN) / mean(within, of_torn.TORN)) * of_torn.TORN / 2
    return np.asarray(mean(each**2 * within, of_torn.NEAR) / mean(within, of_torn.NEAR))


def doubt_in_numpy(signs: Signs, how: Doubting) -> np.ndarray:
    beside = alone_in_numpy(signs, how)
    if not signs.unsaid:
        return beside
    alone, known = alone_in_numpy(replace(signs, by_slope_deg=0.0), how), signs.noise_deg > 0
    shown = np.median(np.broadcast_to(signs.by_slope_deg, SHAPE)[known]) / signs.unsaid
    share = np.clip((how.albedo_times * shown / np.median(alone[known])) ** signs.unsaid, how.albedo_least, 1)
    return np.asarray(beside + signs.in_light * (np.maximum(share * alone, signs.by_slope_deg) - beside))


def alone_in_numpy(signs: Signs, how: Doubting) -> np.ndarray:
    def of(misfit_deg: np.ndarray, torn_deg: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        counts = how.misfit_deg * (how.plain if signs.plain else 1.0) * signs.hidden**how.few_power
        misfit = counts * misfit_deg ** (1 + how.misfit_power)
        misfit /= misfit_deg + how.little_deg
        misfit -= signs.uneven * np.maximum(misfit - misfit_deg, 0)
        by_cause = how.by_cause * np.asarray(signs.by_cause_deg)
        known = np.sqrt((1 - signs.explained) * misfit**2 + signs.explained * by_cause**2)
        most = 1e4 if not signs.plain else how.by_rig_of_four
        misfit = np.minimum(known, (most if signs.by_rig else 1.0) * misfit)
        both = np.hypot(np.hypot(misfit, how.indirect * signs.indirect_deg), signs.unchecked_deg)
        most_torn = how.torn_beside * both + how.torn_alone_deg + signs.unchecked_deg
        torn_deg = (1 - signs.explained) * torn_deg
        limited = np.minimum(torn_deg, most_torn)
        more = np.maximum(signs.by_slope_deg**2 - misfit**2, 0)
        return np.asarray(both + how.torn * np.maximum(limited, signs.torn_share * torn_deg)), more

    sure, more = of(signs.misfit_deg, signs.torn_deg)
    likely, likely_more = of(signs.likely_misfit_deg, signs.likely_torn_deg)
    least = np.maximum(likely**2 + likely_more, (how.by_model * signs.by_model_deg) ** 2)
    beside = np.maximum(sure**2 + more + signs.lost_deg**2, least - signs.noise_deg**2)
    most = how.length_beside * np.maximum(np.sqrt(beside) - how.length_from_deg, 0)
    own = np.minimum(how.length * signs.by_length_deg, most)
    return np.asarray(np.sqrt(beside + own**2))


@pytest.mark.parametrize(("lights", "robust", "moving"), [(4, False, False), (8, False, True), (6, True, False)])
def test_signs_and_doubt_are_those_of_plain_numpy(lights: int, robust: bool, moving: bool) -> None:
    points, one = a_surface(lights, robust=robust, seed=lights)
    turned = np.where(np.arange(SHAPE[1]) < 30, np.float32(2), np.float32(0)) * np.ones(SHAPE, np.float32)
    found = signs_of(points, one, turned if moving else None)
    true = in_numpy(points, one, turned if moving else None)
    names = ("misfit_deg", "likely_misfit_deg", "uneven", "indirect_deg", "torn_deg", "likely_torn_deg", "lost_deg")
    for name in names:
        seen = getattr(found, name)
        assert seen == pytest.approx(getattr(true, name), rel=1e-3, abs=2e-3), name
        assert name == "uneven" or seen[points.known].max() > 0.05, name
    for how in (Doubting(), Doubting(misfit_power=0.3, torn=1.0)):
        rising = np.linspace(0, 6, SHAPE[1], dtype=np.float32) * np.ones(SHAPE, np.float32)
        for unchecked, unsaid in ((0.0, 0.0), (0.0, 0.4), (rising, 0.0), (rising, 0.4), (rising, 1.0)):
            counted, share = 3 * unchecked, np.asarray(unchecked, np.float32) / np.float32(9)
            signs, of_numpy = (
                replace(
                    each,
                    unchecked_deg=unchecked,
                    by_model_deg=counted,
                    by_cause_deg=np.asarray(unchecked, np.float32) * np.float32(0.7),
                    explained=0.6 * unsaid,
                    by_rig=unsaid > 0.5,
                    torn_share=share,
                    by_slope_deg=unchecked,
                    unsaid=unsaid,
                    in_light=np.linspace(0, 1, SHAPE[0], dtype=np.float32)[:, None] * np.ones(SHAPE, np.float32),
                    by_length_deg=unchecked,
                )
                for each in (found, true)
            )
            claimed, expected = doubt_deg(signs, how=how), doubt_in_numpy(of_numpy, how)
            assert claimed == pytest.approx(expected, rel=2e-3, abs=5e-3)


def test_where_nothing_is_known_nothing_is_doubted_and_nothing_is_no_number() -> None:
    points, one = a_surface(4, robust=False, seed=1)
    empty = replace(points, surface=replace(points.surface, valid=np.zeros(SHAPE, np.bool_)))
    signs = signs_of(empty, one)
    assert not signs.misfit_deg.any()
    assert np.isfinite(doubt_deg(signs)).all()


@pytest.mark.parametrize(("shape", "step"), [((41, 63), 4), ((9, 16), 5), ((6, 7), 1)])
def test_what_is_known_at_points_changes_steadily_between_them(shape: tuple[int, int], step: int) -> None:
    rng = np.random.default_rng(7)
    more = rng.uniform(1, 9, [-(-size // step) for size in shape]).astype(np.float32)
    errors = rng.uniform(0.5, 3, shape).astype(np.float32)
    errors[2, 3] = 0
    found = errors.copy()
    for first in range(0, shape[0], 5):
        add_rows(found, more, step, first, min(first + 5, shape[0]))
    points = [np.arange(count) * step for count in more.shape]
    down = np.stack([np.interp(np.arange(shape[0]), points[0], line) for line in more.T], axis=1)
    between = np.stack([np.interp(np.arange(shape[1]), points[1], line) for line in down])
    assert np.allclose(found, np.hypot(errors, between) * (errors > 0), rtol=1e-5)


@pytest.mark.parametrize(
    ("channels", "step", "seen", "soft"), [(1, 3, False, 0.0), (3, 4, True, 0.0), (3, 1, False, 0.0), (3, 2, True, 0.2)]
)
def test_light_in_shadow_is_summed_up_as_plain_numpy_does(channels: int, step: int, seen: bool, soft: float) -> None:
    rng, directions, shape = np.random.default_rng(7), ring(5, 40), (23, 1003)
    normals = rng.normal((0, 0, 1), 0.5, (*shape, 3))
    normals = (normals / np.linalg.norm(normals, axis=-1, keepdims=True)).astype(np.float32)
    albedo = (rng.random((*shape, channels)) * (rng.random((*shape, 1)) > 0.1)).astype(np.float32)
    cosines = np.einsum("ijk,lk->lij", normals, directions).astype(np.float32)
    lit = np.maximum(cosines, 0) * (rng.random(cosines.shape) > 0.1)
    plates = (lit[..., None] * albedo + rng.normal(0, 0.01, (5, *shape, channels))).astype(np.float32)
    shown = np.array(rng.random(cosines.shape) > 0.1) if seen else None
    given = task(
        list(plates if channels > 1 else plates[..., 0]),
        Illumination(directions=directions, intensities=np.ones((5, channels)), view=View()),
        shown, None, Usable(saturation=0.8, dark_level=0.02), 0.0, 1.0,
    )  # fmt: skip
    n, a = (np.ascontiguousarray(np.moveaxis(each, -1, 0)) for each in (normals, albedo))
    sums, counts, wider, left, showing = (np.zeros((-(-23 // step), -(-1003 // step)), np.float32) for _ in range(5))
    light, rest = Indirect(sums, counts, wider), Left(left, showing)
    indirect_rows(given, working_memory(given), n, a, light, rest, np.float32(soft), 0, 23, step)

    here = (plates < 0.8).all(axis=-1) & (True if shown is None else shown)
    size, level = albedo.mean(axis=-1), plates.mean(axis=-1)
    shade = np.maximum(cosines + soft * (1 - cosines), 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        hindered = (cosines > FACING) & (level < SHADOWED * size * shade)
        unreached = here & (hindered | (cosines <= FACING) | (level < 0.02))
        share = level / size - np.where(hindered, 0, shade)
        beyond = level / size - shade
    known = (size > 0)[::step, ::step]
    expected = (
        np.where(unreached, np.clip(share, -MOST_INDIRECT, MOST_INDIRECT), 0).sum(axis=0),
        unreached.sum(axis=0),
        np.square(np.where(here, beyond, 0)).sum(axis=0),
        (here & (np.maximum(level, size * cosines) > 0.02)).sum(axis=0),
    )
    for found, wanted in zip((sums, counts, left, showing), expected, strict=True):
        np.testing.assert_allclose(found[known], wanted[::step, ::step][known], rtol=2e-3, atol=2e-4)
        assert not found[~known].any()
    reached = (here & ~unreached).sum(axis=0)[::step, ::step]
    np.testing.assert_allclose(wider[known & (reached == 5)], 1, atol=1e-4)
    assert np.median(wider[known & (reached == 4)]) > 1.1
