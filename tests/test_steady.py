"""Where nothing moves, neither classes nor filled values flicker; where something does, nothing is smeared."""

import functools
import itertools
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import DTypeLike, NDArray

from psvideo.compute.spilled import in_file
from psvideo.model.surface import MEASURED, NO_LIGHT, ONE_LIGHT, TWO_LIGHTS, Surface
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import POOLED_ROUNDS, VOTING_BLOCKS
from psvideo.solve import steady
from psvideo.solve.instants import surfaces
from psvideo.solve.steady import Steady, steadied
from psvideo.synth import read_scene
from psvideo.synth.scene import Scene
from psvideo.synth.shotplan import true_plan
from psvideo.synth.stage import Stage, set_stage
from psvideo.synth.subject.shading import light_collected

SCENES = Path(__file__).resolve().parents[1] / "data_synth"
RESTS = np.ones((1, 1), np.bool_)
SHAPE = (20, 150)
Flags = NDArray[np.bool_]


def noisy(rng: np.random.Generator, *, half: bool = False) -> Surface:
    """A surface that is trusted on the left, hardly reached on the right, and either from round to round between."""
    _rows, cols = SHAPE
    chance = np.linspace(-0.8, 1.2, cols)
    lights = np.clip(np.floor(4 * (chance + rng.normal(0, 0.15, SHAPE))), 0, 4).astype(np.uint8)
    source = np.array([MEASURED, MEASURED, TWO_LIGHTS, ONE_LIGHT, NO_LIGHT], np.uint8)[lights]
    source[0, -1] = 0
    planes = rng.normal(0, 0.05, (3, *SHAPE)) + np.array([0.3, -0.2, 0.8])[:, None, None]
    planes /= np.linalg.norm(planes, axis=0)
    planes[:, source == 0] = 0
    kind = np.float16 if half else np.float32
    return Surface(
        normals=np.moveaxis(planes.astype(kind), 0, -1),
        albedo=np.moveaxis(rng.uniform(0.4, 0.6, (3, *SHAPE)).astype(kind), 0, -1),
        valid=lights == 0,
        error_deg=rng.uniform(1, 20, SHAPE).astype(kind),
        source=source,
    )


def run(surfaces: list[Surface], first: int, stood: Flags = RESTS, *, spare: Path | None = None) -> Iterator[Surface]:
    held: Steady | None = None
    for number, surface in enumerate(surfaces, first):
        held = steadied(held, surface, number, stood, spare=spare)
        yield surface


def some(count: int, *, half: bool = False, seed: int = 3) -> list[Surface]:
    rng = np.random.default_rng(seed)
    return [noisy(rng, half=half) for _ in range(count)]


def source_of(one: Surface) -> NDArray[np.uint8]:
    assert one.source is not None
    return one.source


def turned_deg(one: Surface, other: Surface) -> NDArray[np.floating]:
    apart = np.linalg.norm(one.normals.astype(np.float64) - other.normals.astype(np.float64), axis=-1)
    return np.asarray(np.degrees(2 * np.arcsin(apart / 2)))


@pytest.mark.parametrize("half", [False, True])
def test_classes_and_filled_normals_keep_where_nothing_moves(half: bool) -> None:
    plain, steady = some(20, half=half), list(run(some(20, half=half), 1001))
    flips = [[np.mean(source_of(a) != source_of(b)) for a, b in itertools.pairwise(part)] for part in (plain, steady)]
    turns = [
        np.mean([turned_deg(a, b)[(source_of(a) > 1) & (source_of(b) > 1)].mean() for a, b in itertools.pairwise(part)])
        for part in (plain, steady)
    ]
    assert np.mean(flips[1]) < np.mean(flips[0]) / 6
    assert turns[1] < turns[0] / 10
    for one in steady:
        assert not (one.valid & (source_of(one) != MEASURED)).any()
        shown = source_of(one) > 0
        lengths = np.linalg.norm(one.normals.astype(np.float64), axis=-1)
        np.testing.assert_allclose(lengths[shown], 1, atol=2e-3)
        assert not lengths[~shown].any()


def test_what_is_trusted_stays_as_it_was_measured() -> None:
    plain, steady = some(20), list(run(some(20), 1001))
    for one, other in zip(plain, steady, strict=True):
        both = one.valid & other.valid
        assert both[:, :5].all()
        np.testing.assert_array_equal(one.normals[both], other.normals[both])
        np.testing.assert_array_equal(one.albedo[both], other.albedo[both])


def near_the_limit() -> list[Surface]:
    """Rounds of a surface whose predicted errors lie about 5 degrees, up to which they are trusted."""
    rng, errors_deg = np.random.default_rng(5), np.broadcast_to(np.linspace(2, 8, SHAPE[1]), SHAPE)
    rounds = []
    for one in some(3 * POOLED_ROUNDS):
        error = (errors_deg * np.exp(rng.normal(0, 0.2, SHAPE))).astype(np.float32)
        planes = rng.normal(0, 0.05, (3, *SHAPE)) + np.array([0.3, -0.2, 0.8])[:, None, None]
        normals = np.moveaxis((planes / np.linalg.norm(planes, axis=0)).astype(np.float32), 0, -1)
        everywhere = np.full(SHAPE, MEASURED, np.uint8)
        rounds.append(replace(one, normals=normals, error_deg=error, valid=error <= 5, source=everywhere))
    return rounds


def test_what_most_rounds_trust_claims_no_more_than_what_is_trusted_and_shows_their_mean() -> None:
    """A pixel stays valid in a round that by itself predicts more; which pixels are valid does not go by that."""
    plain, votes, shown = near_the_limit(), near_the_limit(), near_the_limit()
    before: Steady | None = None
    held: Steady | None = None
    true = np.array([0.3, -0.2, 0.8]) / np.linalg.norm([0.3, -0.2, 0.8])
    off: list[list[float]] = []
    flips: list[NDArray[np.bool_]] = []
    for number, (own, vote, one) in enumerate(zip(plain, votes, shown, strict=True)):
        before = steadied(before, vote, number, RESTS)
        held = steadied(held, one, number, RESTS, most_deg=5.0)
        np.testing.assert_array_equal(one.valid, vote.valid)
        assert one.error_deg is not None
        assert one.error_deg[one.valid].max() <= 5
        kept = one.valid & ~own.valid
        flips.append(one.valid != shown[number - 1].valid)
        if number >= POOLED_ROUNDS:
            assert kept.any()
            off.append([float(np.linalg.norm(each.normals[kept] - true, axis=-1).mean()) for each in (own, one)])
    by_itself, of_mean = np.mean(off, axis=0)
    assert of_mean < 0.6 * by_itself
    assert np.mean(flips[1:]) < np.mean([a.valid != b.valid for a, b in itertools.pairwise(plain)]) / 6


def test_a_result_depends_on_its_block_of_rounds_and_those_that_vote_before() -> None:
    before = VOTING_BLOCKS * POOLED_ROUNDS
    whole = list(run(some(before + 3 * POOLED_ROUNDS), 0))
    part = list(run(some(before + 3 * POOLED_ROUNDS)[POOLED_ROUNDS:], POOLED_ROUNDS))
    for one, other in zip(whole[before + POOLED_ROUNDS :], part[before:], strict=True):
        for name in ("normals", "albedo", "error_deg", "valid", "source"):
            assert np.asarray(getattr(one, name)).tobytes() == np.asarray(getattr(other, name)).tobytes(), name


def test_a_pixel_that_most_rounds_trust_stays_so_where_one_light_hardly_reaches_it() -> None:
    """Noise moves it over the limit of shadow in two rounds of five, from three lights to one: that is no majority."""
    rounds = some(2 * POOLED_ROUNDS)
    for number, one in enumerate(rounds):
        one.valid[:], source_of(one)[:] = True, MEASURED
        if number % 5 in (2, 4):
            one.valid[:, :5], source_of(one)[:, :5] = False, ONE_LIGHT
        one.valid[0, 5::64], source_of(one)[0, 5::64] = False, TWO_LIGHTS  # something is doubtful all the time
    shown = list(run(rounds, 1001))
    for one in shown:
        assert one.valid[0, :5].all()
        assert (source_of(one)[0, :5] == MEASURED).all()


def test_what_is_held_in_files_gives_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_memory, shapes = list(run(some(3 * POOLED_ROUNDS), 0)), []

    def watched(shape: tuple[int, ...], kind: DTypeLike, folder: Path) -> NDArray[Any]:
        shapes.append(shape)
        return in_file(shape, kind, folder)

    monkeypatch.setattr(steady, "in_file", watched)
    monkeypatch.setattr(steady, "EACH_SLOT", 5)
    monkeypatch.setattr(steady, "IN_FILES_FROM", 1)
    for one, other in zip(run(some(3 * POOLED_ROUNDS), 0, spare=tmp_path), in_memory, strict=True):
        for name in ("normals", "albedo", "error_deg", "valid", "source"):
            assert np.asarray(getattr(one, name)).tobytes() == np.asarray(getattr(other, name)).tobytes(), name
    assert len(shapes) > 4, "the pool grew, and turned from block to block"
    assert list(tmp_path.iterdir()) == []


def test_what_changed_begins_again_and_the_rest_goes_on() -> None:
    half_stood = np.array([[True], [False]])
    plain = some(20)
    steady = list(run(some(20), 1001, half_stood))
    below = slice(SHAPE[0] // 2, None)
    for one, other in zip(plain, steady, strict=True):
        np.testing.assert_array_equal(source_of(one)[below], source_of(other)[below])
        np.testing.assert_allclose(one.normals[below], other.normals[below], atol=1e-3)
    flips = np.mean([source_of(a)[:10] != source_of(b)[:10] for a, b in itertools.pairwise(steady)])
    assert flips < np.mean([source_of(a)[:10] != source_of(b)[:10] for a, b in itertools.pairwise(plain)]) / 6


def test_a_round_whose_lights_failed_spoils_itself_and_the_one_beside_it_only() -> None:
    """Plates are made of two flashes each: those of the next round still show what was wrong in this one."""
    rounds = some(30)
    for spoilt in rounds[10:12]:
        spoilt.valid[:] = False
        source_of(spoilt)[:] = TWO_LIGHTS
    held: Steady | None = None
    for number, surface in enumerate(rounds):
        held = steadied(held, surface, number, RESTS if number not in (10, 11) else ~RESTS)
    trusted = [float(one.valid.mean()) for one in rounds]
    assert trusted[10] == trusted[11] == 0
    assert min(trusted[12:]) > 0.9 * trusted[9]


def test_a_round_that_nobody_compared_stays_as_it_is() -> None:
    plain, other = some(3), some(3)
    held: Steady | None = None
    for number, surface in enumerate(other):
        held = steadied(held, surface, number, None)
    for one, same in zip(plain, other, strict=True):
        np.testing.assert_array_equal(source_of(one), source_of(same))
        np.testing.assert_allclose(one.normals, same.normals, atol=1e-3)


def test_a_round_in_which_rows_were_missing_has_no_vote_there() -> None:
    first, second = some(2)
    assert first.source is not None
    assert second.source is not None
    own = second.source.copy()
    first.source[:10], first.valid[:10] = 0, False
    held = steadied(None, first, 1, None, np.arange(20)[:, None] >= 10)
    held = steadied(held, second, 2, RESTS)
    assert np.array_equal(second.source[:10], own[:10]), "as it was solved"
    assert held.since[0, 0] == 0
    assert held.since[-1, 0] == 2, "the first round counts: nothing is known to have changed before it"


def test_what_moved_in_a_clip_s_first_round_is_not_held_in_the_next_one() -> None:
    """A shadow that had just passed turned a wall's normals by 40 degrees, and stayed in the mean while all stood."""
    first, second = some(2)
    own = second.normals.copy()
    held = steadied(None, first, 1, None, moved=np.arange(20)[:, None] < 8)
    held = steadied(held, second, 2, RESTS)
    apart = np.abs(second.normals - own).max(axis=-1)
    assert apart[:8].max() < 1e-3, "as it was solved"
    assert apart[8:].max() > 0.05, "pooled with the first"
    assert (held.since[0, 0], held.since[-1, 0]) == (1, 2)


@pytest.mark.parametrize(("trusted", "begins_again"), [(0.5, True), (0.98, False)])
def test_where_a_second_round_trusts_far_more_all_pixels_begin_again(trusted: float, begins_again: bool) -> None:
    """What repeats show of a codec's noise is known from the second round on: a bust kept what the first one said."""
    rounds = some(4)
    for number, one in enumerate(rounds):
        one.valid[:], source_of(one)[:] = True, MEASURED
        one.valid[:, int((trusted if number == 0 else 1.0) * SHAPE[1]) :] = False
    shown = list(run(rounds, 1001))
    assert [bool(one.valid.all()) for one in shown[1:]] == 3 * [begins_again]


def test_bytes_do_not_depend_on_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    given = []
    for threads in ("1", "3"):
        monkeypatch.setenv("PSVIDEO_THREADS", threads)
        wide = [
            replace(
                one,
                normals=np.moveaxis(np.tile(np.moveaxis(one.normals, -1, 0), (1, 40, 6)), 0, -1),
                albedo=np.moveaxis(np.tile(np.moveaxis(one.albedo, -1, 0), (1, 40, 6)), 0, -1),
                valid=np.tile(one.valid, (40, 6)),
                source=np.tile(source_of(one), (40, 6)),
                error_deg=None,
            )
            for one in some(3)
        ]
        given.append(b"".join(one.normals.tobytes() + one.valid.tobytes() for one in run(wide, 15)))
    assert given[0] == given[1]


@functools.cache
def bust() -> tuple[Scene, Stage, list[NDArray[np.floating]]]:
    """A bust, and what each of five lights shows of it."""
    scene = read_scene(SCENES / "bust.toml")
    camera = scene.camera.model_copy(update={"width_px": 144, "height_px": 80})
    scene = scene.model_copy(update={"camera": camera, "object": scene.object[:1]})
    stage = set_stage(scene, SCENES)
    assert stage.still is not None
    shown = [stage.still.hits.image(light_collected(stage.still, light)) for light in stage.rig.lights]
    return scene, stage, shown


def standing_bust(lights: int, align: Aligning, *, level: float = 1.0) -> list[Surface]:
    """A bust that stands still, filmed with a camera's noise in so much light, and solved as the commands do."""
    scene, stage, shown = bust()
    plan = true_plan(scene.model_copy(update={"light": scene.light[:lights]}))
    clean = [level * one for one in shown[:lights]]
    rng = np.random.default_rng(7)

    def film() -> Iterator[LightPlate]:
        for number in range(1001, 1009):
            for n, (light, plate) in enumerate(zip(plan.lights, clean, strict=True)):
                electrons = rng.normal(size=plate.shape) * np.sqrt(20000 * (plate + 0.02) + 2 * 5**2)
                image = np.minimum(plate + electrons / 20000, 1).astype(np.float32)
                time_s = (number + n / (lights + 1)) * 0.006
                seen = np.ones(len(image), np.bool_)
                yield LightPlate(light=light, number=number, time_s=time_s, picture=mixture_of(image), seen=seen)

    rounds = aligned(film(), plan.lights, align, first=1001)
    return [instant.surface for instant in surfaces(rounds, plan, stage.rig)]


@pytest.mark.parametrize(("lights", "level"), [(3, 1.0), (5, 1.0), (3, 0.2)])
def test_a_standing_bust_does_not_flicker(lights: int, level: float) -> None:
    flips: dict[str, float] = {}
    turns: dict[str, float] = {}
    for align in ("none", "auto"):
        shown = standing_bust(lights, Aligning(align=align), level=level)
        assert len(shown) == 8
        pairs = list(itertools.pairwise(shown))
        subject = np.mean([one.shown for one in shown], axis=0) > 0.5
        changed = [(source_of(a) != source_of(b)) | (a.valid != b.valid) for a, b in pairs]
        flips[align] = max(float(100 * one[subject].mean()) for one in changed)
        turns[align] = max(float(turned_deg(a, b)[(source_of(a) > 1) & (source_of(b) > 1)].mean()) for a, b in pairs)
    assert flips["auto"] <= 0.1 < flips["none"]
    assert turns["auto"] <= 0.5 < turns["none"]


def test_what_was_trusted_throughout_a_block_is_let_go_with_the_next() -> None:
    doubted = some(POOLED_ROUNDS)
    sure = replace(doubted[0], valid=np.ones(SHAPE, np.bool_), source=np.full(SHAPE, MEASURED, np.uint8))
    held: Steady | None = None
    for number, surface in enumerate([*doubted, *(3 * POOLED_ROUNDS) * [sure]]):
        held = steadied(held, replace(surface, **copied(surface)), number, RESTS)
        if number == POOLED_ROUNDS - 1:
            assert held.used > 0
    assert held is not None
    assert held.used == 0


def copied(one: Surface) -> dict[str, Any]:
    """What a surface holds, in memory of its own: holding it steady writes into it."""
    arrays = {name: getattr(one, name) for name in ("normals", "albedo", "valid", "error_deg", "source")}
    return {name: None if array is None else array.copy(order="K") for name, array in arrays.items()}
