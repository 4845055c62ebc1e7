"""Averaging over time takes noise out of what is at rest, leaves alone what moves, and flicker is measured."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import cv2
import numpy as np
import pytest
from angles import angles_deg
from numpy.typing import NDArray

from psvideo.compute.spilled import thin
from psvideo.model.surface import Surface
from psvideo.model.timing import Timing
from psvideo.plates.align.denoise import Average, ResultNoise, averaged
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.report.judge.of_steadiness import steadiness
from psvideo.report.observe.facts import InstantFacts, instant_facts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.steadiness import Change, Sample, change, sample_of
from psvideo.report.run_report import RunReport, report_record, steadiness_of
from psvideo.solve.denoised import denoised
from psvideo.solve.instants import Instant

ROWS, COLS = 96, 128


def surface(
    rng: np.random.Generator, *, sigma: float = 0.01, gain: float = 1.0, bump_at: float | None = None
) -> Surface:
    """A tilted wall with a soft texture, and where ``bump_at`` says a smooth hemisphere of the same albedo."""
    y, x = np.mgrid[0:ROWS, 0:COLS].astype(np.float64)
    normals = np.broadcast_to([0.1, -0.2, 0.97], (ROWS, COLS, 3)) / np.linalg.norm([0.1, -0.2, 0.97])
    if bump_at is not None:
        across, down = (x - bump_at) / 20, (y - 48) / 20
        inside = across**2 + down**2 < 0.9
        dome = np.stack([across, -down, np.sqrt(np.clip(1 - across**2 - down**2, 0.05, 1))], axis=-1)
        normals = np.where(inside[..., None], dome / np.linalg.norm(dome, axis=-1, keepdims=True), normals)
    albedo = gain * (0.5 + 0.1 * np.sin(x / 9) * np.cos(y / 7))
    vectors = albedo[..., None] * normals + rng.normal(0, sigma, normals.shape)
    length = np.linalg.norm(vectors, axis=-1)
    return Surface(
        normals=np.asarray(vectors / length[..., None], np.float32),
        albedo=np.asarray(length, np.float32),
        valid=np.ones((ROWS, COLS), np.bool_),
    )


def run(surfaces: list[Surface], results: int, noise: ResultNoise | None = None) -> list[Surface]:
    average: Average | None = None
    shown = []
    for one in surfaces:
        average, new = averaged(average, one, results, noise=noise)
        shown.append(new)
    return shown


@pytest.mark.parametrize("results", [4, 9])
def test_noise_at_rest_falls_with_the_root_of_the_results_averaged(results: int) -> None:
    rng = np.random.default_rng(1)
    true = surface(rng, sigma=0)
    noisy = [surface(rng) for _ in range(results)]
    shown = run(noisy, results)[-1]
    before, after = (np.sqrt(np.mean(angles_deg(one.normals, true.normals) ** 2)) for one in (noisy[-1], shown))
    assert after < 1.15 * before / np.sqrt(results)
    assert np.mean(shown.albedo / true.albedo) == pytest.approx(1, abs=1e-3)


def assert_no_ghost(alone: Surface, shown: Surface, *, bump_at: float) -> None:
    """Where the hemisphere is and was, what is shown is no farther off than its newest look alone."""
    true = surface(np.random.default_rng(0), sigma=0, bump_at=bump_at)
    y, x = np.mgrid[0:ROWS, 0:COLS]
    reached = (np.abs(y - 48) < 21) & (x > 9) & (x < bump_at + 21)
    before, after = (angles_deg(one.normals, true.normals)[reached] for one in (alone, shown))
    assert after.mean() < before.mean() + 0.02
    assert np.percentile(after, 99) < 1.1 * np.percentile(before, 99)


@pytest.mark.parametrize("step_px", [0.5, 2.0, 15.0])
def test_what_moves_leaves_no_ghost(step_px: float) -> None:
    rng = np.random.default_rng(2)
    places = [30 + step_px * n for n in range(5)]
    noisy = [surface(rng, bump_at=at) for at in places]
    shown = run(noisy, 8)[-1]
    assert_no_ghost(noisy[-1], shown, bump_at=places[-1])


def test_where_all_of_the_picture_moves_nothing_is_mixed() -> None:
    rng = np.random.default_rng(3)
    noisy = [surface(rng) for _ in range(2)]
    noisy[1] = replace(noisy[1], normals=np.roll(noisy[1].normals[..., ::-1], 7, axis=1))
    shown = run(noisy, 8)[-1]
    assert (shown.normals == noisy[1].normals).mean() > 0.99


BLUR = cv2.getGaussianKernel(7, 0.7)[:, 0]
ALIKE = np.correlate(BLUR, BLUR, "full")[6:9] / (BLUR**2).sum()
SPREAD = float((6 - 8 * ALIKE[1] + 2 * ALIKE[2]) / 6) ** -2
"""How many times as large noise is after a blur of 0.7 px as second differences show it, which along each axis leave
that of how far it is alike over one and two pixels: 14."""


def blurred(rng: np.random.Generator, *, bump_at: float | None = None) -> Surface:
    """That wall with noise of 0.01 that a filter made alike in neighbours."""
    true = surface(rng, sigma=0, bump_at=bump_at)
    noise = cv2.GaussianBlur(rng.normal(size=(ROWS, COLS, 3)), (7, 7), 0.7)
    vectors = true.albedo[..., None] * true.normals + 0.01 * noise / noise.std()
    length = np.linalg.norm(vectors, axis=-1)
    normals = np.asarray(vectors / length[..., None], np.float32)
    return replace(true, normals=normals, albedo=np.asarray(length, np.float32))


def evenly_lit(spread: float = SPREAD) -> ResultNoise:
    return ResultNoise(light=np.ones((ROWS // 3, -(-COLS // 3)), np.float32), spread=spread)


def test_noise_that_a_filter_spread_falls_as_well_where_that_is_known() -> None:
    rng = np.random.default_rng(1)
    true, noisy = surface(rng, sigma=0), [blurred(rng) for _ in range(9)]
    error = {}
    for spread in (1.0, SPREAD):
        shown = run(noisy, 9, evenly_lit(spread))[-1]
        error[spread] = np.sqrt(np.mean(angles_deg(shown.normals, true.normals) ** 2))
    before = np.sqrt(np.mean(angles_deg(noisy[-1].normals, true.normals) ** 2))
    assert error[SPREAD] < 1.25 * before / np.sqrt(9)
    assert error[1.0] > 0.9 * before


@pytest.mark.parametrize("step_px", [0.5, 2.0, 15.0])
def test_what_moves_leaves_no_ghost_in_noise_that_a_filter_spread(step_px: float) -> None:
    rng = np.random.default_rng(2)
    places = [30 + step_px * n for n in range(5)]
    noisy = [blurred(rng, bump_at=at) for at in places]
    shown = run(noisy, 8, evenly_lit())[-1]
    assert_no_ghost(noisy[-1], shown, bump_at=places[-1])


@pytest.mark.parametrize("step_px", [1, 2])
@pytest.mark.parametrize("wide_px", [3.0, 8.0])
def test_a_picture_that_moves_as_a_whole_is_no_worse_for_averaging(step_px: int, wide_px: float) -> None:
    """All of it is textured, and fine detail that moves is taken for noise: of that, little may be averaged."""
    rng = np.random.default_rng(5)
    slopes = cv2.GaussianBlur(rng.normal(size=(ROWS, 2 * COLS, 2)), (0, 0), wide_px)
    relief = np.dstack([0.1 * slopes / slopes.std(), np.ones((ROWS, 2 * COLS))])
    relief /= np.linalg.norm(relief, axis=-1, keepdims=True)
    noisy, true = [], relief
    for n in range(6):
        true = relief[:, step_px * n :][:, :COLS]
        noise = cv2.GaussianBlur(rng.normal(size=(ROWS, COLS, 3)), (7, 7), 0.7)
        vectors = 0.5 * true + 0.005 * noise / noise.std()
        length = np.linalg.norm(vectors, axis=-1)
        normals = np.asarray(vectors / length[..., None], np.float32)
        valid = np.ones((ROWS, COLS), np.bool_)
        noisy.append(Surface(normals=normals, albedo=np.asarray(length, np.float32), valid=valid))
    shown = run(noisy, 8, evenly_lit())[-1]
    error = [angles_deg(one.normals, true).mean() for one in (noisy[-1], shown)]
    assert error[1] < 1.05 * error[0]


def test_noise_that_grows_with_light_is_averaged_where_light_is_brightest() -> None:
    """One albedo, lit from 0.1 to 0.9 across: its variance grows nine times."""
    rng = np.random.default_rng(4)
    light = np.broadcast_to(np.linspace(0.1, 0.9, COLS), (ROWS, COLS))
    vectors = [
        0.5 * np.array([0.0, 0.0, 1.0]) + 0.01 * np.sqrt(light)[..., None] * rng.normal(size=(ROWS, COLS, 3))
        for _ in range(8)
    ]
    length = [np.linalg.norm(one, axis=-1) for one in vectors]
    noisy = [
        Surface(
            normals=np.asarray(one / size[..., None], np.float32),
            albedo=np.asarray(size, np.float32),
            valid=np.ones((ROWS, COLS), np.bool_),
        )
        for one, size in zip(vectors, length, strict=True)
    ]
    average: Average | None = None
    noise = ResultNoise(light=np.ascontiguousarray(light[::3, ::3], np.float32))
    for one in noisy:
        average, _ = averaged(average, one, 8, noise=noise)
    assert average is not None
    assert average.count[:, -30:].mean() > 7.5


def instants(numbers: Sequence[int]) -> Iterator[Instant]:
    for number in numbers:
        one = surface(np.random.default_rng(number))
        plates = [
            LightPlate(
                light=light,
                number=number,
                time_s=float(number),
                picture=mixture_of(one.albedo),
                seen=np.ones(ROWS, np.bool_),
            )
            for light in "abc"
        ]
        yield Instant(round=Round(number=number, plates=tuple(plates)), surface=one)


def test_after_a_hole_in_the_numbers_an_average_begins_afresh() -> None:
    with_before = {one.round.number: one.surface for one in denoised(instants([3, 4, 5, 30, 31, 32]), 3)}
    alone = {one.round.number: one.surface for one in denoised(instants([30, 31, 32]), 3)}
    for number, found in alone.items():
        np.testing.assert_array_equal(with_before[number].normals, found.normals)


def test_equal_results_stay_as_they_are_and_what_is_not_valid_stays_so() -> None:
    one = surface(np.random.default_rng(4))
    hole = one.valid.copy()
    hole[10:20, 10:20] = False
    cut = replace(one, valid=hole, normals=one.normals * hole[..., None], albedo=one.albedo * hole)
    shown = run([one, cut, cut, one], 4)
    assert not shown[1].normals[10:20, 10:20].any()
    assert not shown[1].albedo[10:20, 10:20].any()
    for result, given in zip(shown, [one, cut, cut, one], strict=True):
        np.testing.assert_allclose(result.normals, given.normals, atol=1e-6)
        np.testing.assert_allclose(result.albedo, given.albedo, rtol=1e-6)


def test_half_floats_and_colour_keep_their_form() -> None:
    grey = surface(np.random.default_rng(5))
    tint = np.array([1.0, 0.8, 0.5], np.float32)
    half = Surface(
        normals=grey.normals.astype(np.float16),
        albedo=(grey.albedo[..., None] * tint).astype(np.float16),
        valid=grey.valid,
    )
    shown = run([half, half], 2)[1]
    assert shown.normals.dtype == shown.albedo.dtype == np.float16
    np.testing.assert_allclose(shown.albedo, half.albedo, atol=1e-3)


def test_flicker_is_separated_from_noise_and_from_motion() -> None:
    rng = np.random.default_rng(6)
    first = sample_of(surface(rng, bump_at=40))
    steady = change(first, sample_of(surface(rng, bump_at=60)))
    flickers = change(first, sample_of(surface(rng, bump_at=60, gain=1.03)))
    assert steady is not None
    assert flickers is not None
    assert abs(steady.level_percent) < 0.3
    assert flickers.level_percent == pytest.approx(3.0, abs=0.3)
    # noise of 0.01 on 0.5 in two directions across, twice: Rayleigh's median
    assert steady.normals_deg == pytest.approx(np.rad2deg(0.01 / 0.5) * np.sqrt(2) * 1.1774, rel=0.1)
    assert steady.albedo_percent == pytest.approx(100 * 0.01 / 0.5 * np.sqrt(2) * 0.6745, rel=0.1)
    nothing = Surface(
        normals=np.zeros((ROWS, COLS, 3), np.float32),
        albedo=np.zeros((ROWS, COLS), np.float32),
        valid=np.zeros((ROWS, COLS), np.bool_),
    )
    assert change(first, sample_of(nothing)) is None


def test_a_round_is_thinned_once_for_all_that_its_report_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    one, asked = surface(np.random.default_rng(8)), []

    def noted(picture: NDArray[np.floating], step: int) -> NDArray[np.floating]:
        asked.append(picture is one.normals)
        return thin(picture, step)

    monkeypatch.setattr("psvideo.report.observe.thinned.thin", noted)
    observed = Observed(lights=("a",))
    for n in range(2):  # the first two rounds are looked at closely as well
        plate = LightPlate(
            light="a", number=n, time_s=float(n), picture=mixture_of(one.albedo), seen=np.ones(ROWS, np.bool_)
        )
        observed.add(Round(number=1001 + n, plates=(plate,)), one)
    assert sum(asked) == 2


def test_the_report_names_the_worst_instants() -> None:
    rng = np.random.default_rng(7)
    gains = [1.0, 1.0, 1.05, 1.05, 1.05]
    facts: list[InstantFacts] = []
    before: Sample | None = None
    for n, gain in enumerate(gains):
        one = surface(rng, gain=gain)
        plate = LightPlate(
            light="a", number=n, time_s=float(n), picture=mixture_of(one.albedo), seen=np.ones(ROWS, np.bool_)
        )
        now = sample_of(one)
        changed: Change | None = None if before is None else change(before, now)
        facts.append(instant_facts(Round(number=1001 + n, plates=(plate,)), one, None, changed))
        before = now
    timing = Timing(clip="c", frame_period_s=1, exposure_s=1, row_time_s=0, clock_offset_ppm=0, phase_error_rows=0,
                    order="given", flashes=())  # fmt: skip
    report = RunReport(clip="c", version="0", timing=timing, lights=(), shot={}, settings={}, instants=tuple(facts),
                       judgements=tuple(steadiness(facts)))  # fmt: skip
    found = steadiness_of(report.instants)
    assert found is not None
    assert found.worst[0] == 1003
    assert found.level_percent < 0.5
    assert any(re.search(r"[45]\.\d % as a whole \(number 1003\)", sentence) for sentence in report.findings)
    steady = replace(report, judgements=tuple(steadiness(facts[:2])))
    assert not any("flickers" in sentence for sentence in steady.findings)
    assert report_record(replace(report, instants=report.instants[:1]))["flicker"] is None
