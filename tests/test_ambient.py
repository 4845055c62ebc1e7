"""Ambient light between dark slots: what static, changing and flickering light costs a plate, against the truth."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from memory_frame import MemoryFrame
from true_timing import true_timing

from psvideo.model.plan import Plan
from psvideo.model.rows.ripple import Exposures, Ripple
from psvideo.model.timing import Flash, Timing
from psvideo.plates.ambient import ambient_followed, ambient_off
from psvideo.plates.ambient.ambient_blocks import block_px, no_blocks, over_bands
from psvideo.plates.ambient.ambient_kernel import AveragedDarks, OneMore, average_rows, measure_rows
from psvideo.plates.ambient.ambient_level import AmbientLevel
from psvideo.plates.ambient.mains import Mains, RowLight, find_ripple
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.split import Plate, split
from psvideo.synth import Noise, TrueClock
from psvideo.synth.camera.noise import NOISELESS, frame_rng
from psvideo.synth.camera.sensor import MainsSwing, expose_frames
from psvideo.synth.lamps.true_flashes import true_flashes

PlanMaker = Callable[..., Plan]
AmbientOf = Callable[[int, np.ndarray], np.ndarray]
LEVEL = 0.1
NOISE = Noise(full_well_e=20_000, read_e=12)


def texture(plan: Plan) -> np.ndarray:
    blocks = np.random.default_rng(5).uniform(0.3, 1, (plan.camera.height_px // 8, plan.camera.width_px // 8))
    return np.kron(blocks, np.ones((8, 8))).astype(np.float32)


@dataclass(frozen=True, kw_only=True)
class Take:
    """Plates with their ambient light still in them, and the plates as they are without it."""

    plates: list[Plate]
    truth: dict[int, np.ndarray]
    ripple: Ripple | None = None

    def without_ambient(self) -> Iterator[Plate]:
        darks = [plate for plate in self.plates if not plate.flash.lights]
        return ambient_off.subtract(self.plates, darks=darks, ripple=self.ripple)

    def errors(self) -> np.ndarray:
        """Return the errors of whole plates between two dark slots once ambient light is off, (plate, row, col)."""
        dark = [plate.flash.index for plate in self.plates if not plate.flash.lights]
        return np.array(
            [
                plate.image - self.truth[plate.flash.slot]
                for plate in self.without_ambient()
                if plate.flash.lights and plate.seen.all() and dark[0] < plate.flash.index < dark[-1]
            ]
        )


def shoot(
    plan: Plan,
    ambient_of: AmbientOf,
    *,
    noise: Noise = NOISELESS,
    mains: MainsSwing | None = None,
    frames: int = 120,
    dropped: tuple[int, ...] = (),
) -> Take:
    scene = texture(plan)
    truth = {slot: (0.15 * scene * (1 + 0.5 * n)).astype(np.float32) for n, slot in enumerate(plan.lit_slots)}
    clock = TrueClock(phase_s=0.0123, offset_ppm=30.0)
    flashes = true_flashes(plan, clock, frames=frames, dropped=frozenset(dropped))
    kept = [n for n in range(frames) if n not in dropped]
    images = expose_frames(
        plan,
        flashes,
        lambda flash: truth.get(flash.slot),
        frames=kept,
        ambient_of=lambda n: ambient_of(n, scene).astype(np.float32),
        mains=mains,
    )

    def read() -> Iterator[MemoryFrame]:
        for n, image in zip(kept, images, strict=True):
            yield MemoryFrame(n, np.minimum(noise.add(image, frame_rng(1, n)), 1.0).astype(np.float32))

    timing = true_timing(plan, flashes, frames=frames)
    return Take(plates=list(split(read(), plan.camera, timing)), truth=truth)


def rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def held(_: int, scene: np.ndarray) -> np.ndarray:
    return LEVEL * scene


def dimmed(n: int, scene: np.ndarray) -> np.ndarray:
    return LEVEL * scene * (1 + 0.4 * n / 120)


def clouded(n: int, scene: np.ndarray) -> np.ndarray:
    light: np.ndarray = LEVEL * scene * (1 + 0.3 * np.sin(2 * np.pi * n / 120) * np.linspace(0, 1, scene.shape[1]))
    return light


def shadow_down_the_rows(n: int, scene: np.ndarray) -> np.ndarray:
    rows = np.arange(scene.shape[0])
    return LEVEL * scene * (1 - 0.5 / (1 + np.exp(-(1.5 * n - rows) / 15)))[:, None]


def lamp_on(n: int, scene: np.ndarray) -> np.ndarray:
    return LEVEL * scene * (1.0 if n > 60 else 0.01)


@pytest.fixture(scope="module")
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(width_px=160, height_px=120)


def test_light_that_does_not_change_costs_hardly_any_noise(plan: Plan) -> None:
    unlit = shoot(plan, lambda n, scene: 0 * scene, noise=NOISE)
    photons = np.mean([LEVEL * texture(plan) / NOISE.full_well_e])  # of the ambient light itself, which nothing removes
    alone = np.sqrt(rms(unlit.errors()[40:]) ** 2 + 1.3 * photons)
    assert rms(shoot(plan, held, noise=NOISE).errors()[40:]) < 1.06 * alone


@pytest.mark.parametrize("change", [dimmed, clouded, shadow_down_the_rows])
def test_light_that_changes_steadily_is_followed(change: AmbientOf, plan: Plan) -> None:
    assert rms(shoot(plan, change).errors()) < 1e-4
    still, moving = shoot(plan, held, noise=NOISE).errors()[20:], shoot(plan, change, noise=NOISE).errors()[20:]
    assert rms(moving) < 1.06 * rms(still)


def test_a_lamp_switched_on_costs_the_plates_around_it_only(plan: Plan) -> None:
    wrong = np.sqrt(np.mean(shoot(plan, lamp_on).errors() ** 2, axis=(1, 2))) > 1e-3
    assert 1 <= wrong.sum() <= 6, "two rounds: the lamp may go on in the middle of a dark slot"


def test_where_someone_moves_the_average_starts_again_and_elsewhere_it_goes_on(plan: Plan) -> None:
    def walking(n: int, scene: np.ndarray) -> np.ndarray:
        light = LEVEL * scene
        light[40:80, 10 + n : 34 + n] = 0.3
        return light

    take = shoot(plan, walking, noise=NOISE, frames=100)
    last = [plate for plate in take.without_ambient() if not plate.flash.lights][-1]
    frame = last.flash.start_s / plan.camera.frame_period_s
    middle = slice(int(10 + frame) + 6, int(34 + frame) - 6)
    assert abs(float(last.image[44:76, middle].mean()) - 0.3) < 0.003
    away = (last.image - LEVEL * texture(plan))[:30]
    assert np.std(away) < 0.35 * np.std((take.plates[-1].image - take.truth.get(take.plates[-1].flash.slot, 0))[:30])


@pytest.mark.parametrize("hz", [100.0, 120.0, 100.2])
@pytest.mark.parametrize("depth", [0.3, 1.0])
def test_mains_light_is_separated_row_by_row(hz: float, depth: float, make_plan: PlanMaker) -> None:
    plan = make_plan(width_px=160, height_px=120, fps=Fraction(110))
    take = shoot(plan, dimmed, mains=MainsSwing(hz=hz, depth=depth))
    assert rms(shoot(plan, held).errors()) < 1e-5
    assert rms(take.errors()[8:]) < 1e-4 + (2e-3 if hz == 100.2 else 0) * depth


def _true_ripple(plan: Plan, hz: float, depth: float) -> Ripple:
    """The swing of exposures whose light is ``1 + depth sin(2 pi hz t)``."""
    return Ripple(hz=hz, amplitude=-1j * depth * float(np.sinc(hz * plan.camera.exposure_s)))


def test_mains_light_that_the_timing_knows_is_off_from_the_first_plate_on(make_plan: PlanMaker) -> None:
    plan = make_plan(width_px=160, height_px=120, fps=Fraction(110))
    take = shoot(plan, held, mains=MainsSwing(hz=100.2, depth=1.0))
    assert rms(take.errors()[:3]) > 2e-3
    assert rms(replace(take, ripple=_true_ripple(plan, 100.2, 1.0)).errors()) < 1e-5


def test_a_rough_ripple_of_the_clip_gives_way_to_what_dark_slots_agree_on(make_plan: PlanMaker) -> None:
    plan = make_plan(width_px=160, height_px=120, fps=Fraction(110))
    take = shoot(plan, held, mains=MainsSwing(hz=100, depth=1.0))
    true = _true_ripple(plan, 100, 1.0)
    rough = replace(true, amplitude=0.9 * true.amplitude, error=0.1 * abs(true.amplitude))
    late = {error: rms(replace(take, ripple=replace(rough, error=error)).errors()[8:]) for error in (0.0, rough.error)}
    assert late[rough.error] < 2e-4
    assert late[0.0] > 5 * late[rough.error]


def test_exposures_of_whole_pulses_show_none(make_plan: PlanMaker) -> None:
    even = make_plan(width_px=160, height_px=120, fps=Fraction(100))
    assert rms(shoot(even, held, mains=MainsSwing(hz=100, depth=1.0)).errors()) < 1e-5


def test_a_change_that_looks_like_a_ripple_once_is_not_believed() -> None:
    rows = np.arange(200, dtype=np.float64)
    light = [
        RowLight(
            mean=0.1 * (1 + 0.1 * n * rows / 200),
            opened=Exposures(shares=np.ones((1, 200)), middles_s=(0.0334 * n + 4e-5 * rows)[None]),
            good=np.ones(200, np.bool_),
        )
        for n in range(8)
    ]
    assert any(find_ripple(one, other) is not None for one, other in pairwise(light))
    mains = Mains(rows=light[0])
    for one in light[1:]:
        mains = mains.next(one)
        assert mains.ripple is None


def test_a_ripple_is_found_with_its_phase() -> None:
    rng = np.random.default_rng(0)
    rows, true = np.arange(300, dtype=np.float64), Ripple(hz=120.0, amplitude=0.2 * np.exp(0.7j))
    surface = rng.uniform(0.05, 0.4, 300)

    def seen(time_s: float) -> RowLight:
        opened = Exposures(shares=np.ones((1, 300)), middles_s=(time_s + 2e-5 * rows)[None])
        return RowLight(mean=surface * true.swing(opened), opened=opened, good=np.ones(300, np.bool_))

    found = find_ripple(seen(0.0), seen(0.0303))
    assert found is not None
    assert found.hz == 120.0
    assert abs(found.amplitude - true.amplitude) < 1e-6
    assert find_ripple(seen(0.0), seen(0.025)) is None, "the same phase shows nothing"


def test_dark_slots_are_read_no_further_ahead_than_the_next(plan: Plan) -> None:
    take = shoot(plan, dimmed, frames=60)
    read: list[int] = []

    def darks() -> Iterator[Plate]:
        for plate in take.plates:
            if not plate.flash.lights:
                read.append(plate.flash.index)
                yield plate

    served = 0
    for plate in ambient_off.subtract(take.plates, darks=darks()):
        served += 1
        assert sum(index >= plate.flash.index for index in read) <= 1
    assert served == len(take.plates)


def test_dark_slots_that_are_torn_or_seen_in_part_do_no_harm(make_plan: PlanMaker) -> None:
    narrow = make_plan(width_px=160, height_px=120, shutter=0.5)
    whole = make_plan(width_px=160, height_px=120)
    for plan, light, dropped in ((whole, dimmed, (13, 14, 37)), (narrow, held, ()), (narrow, held, (21,))):
        take = shoot(plan, light, dropped=dropped)
        compared = 0
        for plate in take.without_ambient():
            if plate.flash.lights and plate.flash.index > 8:
                error = np.abs(plate.image - take.truth[plate.flash.slot])[plate.seen]
                compared += error.size
                assert error.max(initial=0) < 0.003
        assert compared > 100_000


def test_colour_and_mosaics_are_followed_alike(plan: Plan) -> None:
    take = shoot(plan, dimmed)
    tint = np.array([1.0, 0.6, 0.3], np.float32)
    coloured = [replace(plate, picture=mixture_of(plate.image[..., None] * tint)) for plate in take.plates]
    grey = {plate.flash.index: plate.image for plate in take.without_ambient()}
    for plate in replace(take, plates=coloured).without_ambient():
        assert np.abs(plate.image - grey[plate.flash.index][..., None] * tint).max() < 2e-4


def listed(plates: list[Plate]) -> Timing:
    return Timing(
        clip="clip", frame_period_s=1.0, exposure_s=1.0, row_time_s=0.0, clock_offset_ppm=0.0, phase_error_rows=0.0,
        order="marker", flashes=tuple(plate.flash for plate in plates),
    )  # fmt: skip


@pytest.mark.parametrize("dark_first", [False, True])
def test_dark_slots_come_ahead_of_the_plates_around_them_and_none_is_left_out(plan: Plan, dark_first: bool) -> None:
    plates = shoot(plan, clouded, frames=60).plates
    begin = next(n for n, plate in enumerate(plates) if plate.flash.is_dark == dark_first)
    plates = plates[begin:]
    coming, darks = ambient_off.with_darks_ahead(iter(plates), listed(plates))
    found = list(ambient_off.subtract(coming, darks=darks))
    read_before = [plate for plate in plates if plate.flash.is_dark]
    expected = list(ambient_off.subtract(plates, darks=read_before))
    assert [plate.flash.index for plate in found] == [plate.flash.index for plate in expected]
    for one, other in zip(found, expected, strict=True):
        assert np.array_equal(one.image, other.image)
        assert np.array_equal(one.seen, other.seen)


@pytest.mark.parametrize(("light", "wait"), [(held, 0), (dimmed, 3)])
def test_while_light_is_steady_no_plate_waits_and_dark_slots_count_as_they_pass(
    plan: Plan, light: AmbientOf, wait: int
) -> None:
    take = shoot(plan, light)
    read: list[Plate] = []

    def counted() -> Iterator[Plate]:
        for plate in take.plates:
            read.append(plate)
            yield plate

    coming, darks = ambient_off.with_darks_ahead(counted(), listed(take.plates))
    expected = list(take.without_ambient())
    ahead = []
    for place, plate in enumerate(ambient_off.subtract(coming, darks=darks, waits=False)):
        ahead.append(len(read) - 1 - place)
        assert np.abs(plate.image - expected[place].image).max() < 2e-4
    assert plate.flash.index == expected[-1].flash.index
    assert max(ahead[len(ahead) // 2 :]) == wait


def test_steady_light_that_begins_to_change_is_followed_from_the_next_dark_slot_on(plan: Plan) -> None:
    def dimmed_later(n: int, scene: np.ndarray) -> np.ndarray:
        return LEVEL * scene * (1 + 0.4 * max(n - 60, 0) / 60)

    take = shoot(plan, dimmed_later)
    coming, darks = ambient_off.with_darks_ahead(iter(take.plates), listed(take.plates))
    found = list(ambient_off.subtract(coming, darks=darks, waits=False))
    for plate, expected in list(zip(found, take.without_ambient(), strict=True))[-24:]:
        assert np.array_equal(plate.image, expected.image)


def test_ripples_of_an_average_of_hundreds_of_dark_slots_die_out() -> None:
    rng = np.random.default_rng(4)
    size, row = (240, 64), np.ones((1, 240))

    def dark(index: int, light: np.ndarray | float) -> Plate:
        flash = Flash(index=index, slot=0, lights={}, start_s=index / 30, duration_s=1e-3, complete=True)
        image = (light + 2e-3 * rng.standard_normal(size)).astype(np.float32)
        return Plate(
            flash=flash, picture=mixture_of(image), shares=row, middles_s=row * index / 30, seen=np.ones(240, bool)
        )

    waves = 1 + 0.05 * np.sin(np.arange(240)[:, None] * np.linspace(0.1, 0.6, 64))  # every length that a window turns
    averaged = None
    for index in range(200):
        swing = 1 + 0.1 * (index % 2)  # so that there is always a level to follow
        averaged = ambient_followed.update(averaged, dark(index, LEVEL * swing * (waves if index < 3 else 1)))
    assert averaged is not None
    assert rms(averaged.level.coded.light() - LEVEL * swing) < 1.5e-3


@pytest.mark.parametrize("shape", [(70, 90, 3), (131, 257), (613, 701, 3)])
def test_levels_of_blocks_are_means_and_change_steadily_between_their_middles(shape: tuple[int, ...]) -> None:
    rng, block = np.random.default_rng(2), block_px(shape)
    image = rng.uniform(0.01, 0.05, shape).astype(np.float32)
    rows, cols = shape[0] // block, shape[1] // block
    coarse, means, clipped = no_blocks(shape), np.empty(shape[0]), np.empty(shape[0], np.bool_)
    bound = mixture_of(image).bound()
    over_bands(lambda a, b: measure_rows(bound.mix, block, a, b, means, clipped, coarse), shape)
    edges = [np.append(np.arange(count) * block, size) for count, size in ((rows, shape[0]), (cols, shape[1]))]
    true = np.array(
        [[image[a:b, c:d].mean(axis=(0, 1)) for c, d in pairwise(edges[1])] for a, b in pairwise(edges[0])]
    ).reshape(coarse.shape)
    assert np.allclose(coarse, true, rtol=1e-5)
    gain = rng.uniform(0.9, 1.1, coarse.shape).astype(np.float32)
    old, new = AmbientLevel.of(image), AmbientLevel.room(shape)
    slots, spans = np.full((shape[0], cols), 4, np.float32), np.empty((shape[0], cols), np.float32)
    nothing, seen = np.zeros(shape[0], np.float32), np.ones(shape[0], np.bool_)
    restarts = np.zeros(slots.shape, np.bool_)
    one = OneMore(factor=nothing, seen=seen, restarts=restarts, gain=gain.reshape(rows, -1))
    before, after = AveragedDarks(*old.planes, slots), AveragedDarks(*new.planes, spans)
    over_bands(lambda a, b: average_rows(bound.mix, block, 16, one, before, a, b, after, coarse), shape)
    middles = [(np.arange(count) + 0.5) * block - 0.5 for count in (rows, cols)]
    down = [np.interp(np.arange(shape[0]), middles[0], column) for column in gain.reshape(rows, -1).T]
    steady = np.stack(down, axis=1).reshape(shape[0], cols, -1)
    across = [np.interp(np.arange(shape[1]), middles[1], line) for line in np.moveaxis(steady, 1, 2).reshape(-1, cols)]
    level = np.moveaxis(np.array(across).reshape(shape[0], -1, shape[1]), 1, 2).reshape(shape)
    assert np.allclose(new.coded.light(), image * level * 4 / 5, atol=2e-6)
    assert (spans == 5).all()
