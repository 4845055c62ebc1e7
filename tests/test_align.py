"""Plates of one round, brought to one instant, show the surface of that instant; what is unknown is not valid."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from angles import angles_deg
from filmed_rounds import (
    PITCH_S,
    ROWS,
    WALL_M,
    Filmed,
    Plates,
    at_once,
    brought,
    brought_as_filmed,
    filmed,
    noiseless,
    seen,
)
from motion_of_pixels import pixels_per_s

from psvideo.model.surface import Surface
from psvideo.plates.align import between
from psvideo.plates.align.comb import Comb, Schedule
from psvideo.plates.align.doubt.unsure import UNKNOWN
from psvideo.plates.align.open_shutter import with_open_shutter
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.align.velocity import all_lights
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.align.velocity.moving_kernel import AT_REST, BOTH
from psvideo.plates.beauty import beauty_of, mix_of
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.solve.normals.least_squares.woodham1980 import solve
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.solving import Solving
from psvideo.synth.truth import true_normals

WIDER = 4 / 3
"""Pictures so much wider and higher, at the same scale, show more of the wall behind the subject."""


@pytest.mark.parametrize(
    ("lights", "motion", "before_deg"),
    [
        pytest.param(3, "1 px", 1.2, marks=pytest.mark.campaign),
        (3, "4 px", 4.6),
        (3, "spin", 4.6),
        (3, "turn", 2.0),
        pytest.param(8, "1 px", 2.5, marks=pytest.mark.campaign),
        pytest.param(8, "4 px", 8.8, marks=pytest.mark.campaign),
    ],
)
def test_flow_takes_the_error_of_motion_away(lights: int, motion: str, before_deg: float) -> None:
    clip = noiseless(lights, motion)
    middle = clip.rounds[1]
    error_deg, said = clip.error_deg(clip.solved(middle), middle.time_s)
    assert error_deg > before_deg
    error_deg, told_after = clip.error_deg(clip.solved(brought_as_filmed(lights, motion)[1]), middle.time_s)
    assert error_deg < 1.0
    assert told_after > 0.9 * said


def test_what_moves_by_half_its_width_in_a_round_is_followed() -> None:
    clip = noiseless(3, "16 px")
    middle = clip.rounds[1]
    error_deg, said = clip.error_deg(clip.solved(middle), middle.time_s)
    assert error_deg > 25
    error_deg, told_after = clip.error_deg(clip.solved(brought_as_filmed(3, "16 px")[1]), middle.time_s)
    assert error_deg < 3
    assert told_after > 0.9 * said


@pytest.mark.parametrize("lights", [3, pytest.param(8, marks=pytest.mark.campaign)])
def test_through_noise_motion_costs_hardly_more_than_noise_alone(lights: int) -> None:
    at_rest, clip = filmed(lights, "at rest", 0.01), filmed(lights, "4 px", 0.01)
    alone_deg, _ = at_rest.error_deg(at_rest.solved(at_rest.rounds[1]), 0.0)
    one = brought(clip)[1]
    assert clip.error_deg(clip.solved(one), one.time_s)[0] < alone_deg + 0.2


def test_vectors_of_what_moves_by_less_than_a_pixel_a_round_are_those_of_the_whole_subject() -> None:
    clip = filmed(3, "0.2 px", 0.002)
    one = brought(clip)[1]
    true = np.array([0.2, 0.05], np.float32) / PITCH_S
    subject = clip.subject(one.time_s)
    off = np.hypot(*np.moveaxis(pixels_per_s(one.motion, subject.shape) - true, -1, 0)) / np.hypot(*true)
    assert np.median(off[subject]) < 0.1
    assert (off[subject] < 0.5).mean() > 0.9
    away = np.s_[:, -20:]  # where its shadow does not fall
    assert not pixels_per_s(one.motion, subject.shape)[away].any()


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("lights", [3, 8])
def test_a_scene_at_rest_stays_as_it_is(lights: int, noise: float) -> None:
    clip = filmed(lights, "at rest", noise)
    middle = clip.rounds[1]
    for given, shown in zip(middle.plates, brought(clip)[1].plates, strict=True):
        assert shown.image is given.image
    error_deg, said = clip.error_deg(clip.solved(middle), middle.time_s)
    forced_deg, told_forced = clip.error_deg(clip.solved(brought(clip, Aligning(align="flow"))[1]), middle.time_s)
    assert forced_deg < error_deg + 0.05
    assert told_forced > 0.99 * said


@pytest.mark.campaign
def test_what_the_subject_hides_of_the_wall_is_right_or_not_valid() -> None:
    clip = noiseless(8, "4 px", WIDER)
    one = brought(clip)[1]
    hits = clip.stage.view(one.time_s).hits
    wall = hits.image((hits.point_m[:, 2] <= WALL_M + 0.01).astype(np.float32)) > 0.5

    still = clip.solved(at_once(clip, one.time_s))
    shadows = still.valid & (angles_deg(still.normals, true_normals(hits)) > 2)

    def wrong(surface: Surface) -> float:
        off = angles_deg(surface.normals, true_normals(hits)) > 10
        return float((off & surface.valid & wall & ~shadows).sum() / wall.sum())

    def judged(shown: Round) -> Surface:
        return Solving().solve([plate.image for plate in shown.plates], clip.lit, seen=seen(shown), unsure=shown.unsure)

    assert one.unsure is not None
    explained = LitPlates([plate.image for plate in one.plates], clip.lit, seen=seen(one) & (one.unsure < UNKNOWN))
    assert wrong(solve(explained)) < 0.4 * wrong(clip.solved(clip.rounds[1]))
    trusted = judged(one)
    assert (trusted.valid & wall).sum() > (judged(clip.rounds[1]).valid & wall).sum()
    assert wrong(trusted) < 0.01


def test_where_no_motion_explains_what_changed_normals_are_as_good_as_without_alignment() -> None:
    clip = noiseless(5, "tumbling, 8 px")

    def off_deg(shown: Round) -> float:
        images = [plate.image for plate in shown.plates]
        surface = Solving().solve(images, clip.lit, seen=seen(shown), unsure=shown.unsure)
        off = angles_deg(surface.normals, clip.truth(shown.time_s)[0])
        return float(np.where(surface.shown, off, 90)[clip.subject(shown.time_s)].mean())

    assert off_deg(brought(clip)[1]) < off_deg(brought(clip, Aligning(align="none"))[1])


def test_a_beauty_plate_has_no_hole_where_motion_leaves_plates_in_doubt() -> None:
    clip = noiseless(5, "4 px")
    one = brought(clip)[1]
    beauty, inner = beauty_of(one, mix_of({}, with_ambient=False)), np.s_[8:-8, 8:-8]
    there = beauty_of(at_once(clip, one.time_s), mix_of({}, with_ambient=False)).image
    unsure = ~beauty.pixels_seen[inner]
    assert unsure.mean() > 0.1
    assert (beauty.image > 0.5 * there)[inner][unsure].all()
    assert np.abs(beauty.image - there)[inner][unsure].mean() < 0.05 * there.mean()


def test_what_no_motion_explains_is_solved_but_not_trusted() -> None:
    """The third round shows another subject: what the second one looked like at one instant cannot be known."""
    clip = filmed(3, "4 px", 0.002)

    def turned(plate: LightPlate) -> LightPlate:
        return replace(plate, picture=mixture_of(np.ascontiguousarray(np.rot90(plate.image[:, 30:-30], 2).copy())))

    def cut(plate: LightPlate) -> LightPlate:
        return replace(plate, picture=mixture_of(np.ascontiguousarray(plate.image[:, 30:-30])))

    shares = []
    for change in (cut, turned):
        rounds = [replace(one, plates=tuple(map(cut, one.plates))) for one in clip.rounds[:2]]
        last = replace(clip.rounds[2], plates=tuple(map(change, clip.rounds[2].plates)))
        one = brought(clip, rounds=(*rounds, last))[1]
        surface = Solving().solve([plate.image for plate in one.plates], clip.lit, unsure=one.unsure)
        subject = clip.subject(one.time_s)[:, 30:-30]
        shares.append([float((part & subject).sum() / subject.sum()) for part in (surface.measured, surface.valid)])
    (measured, trusted), (still_measured, hardly_trusted) = shares
    assert trusted > 0.97 * measured
    assert still_measured > 0.9 * measured
    assert hardly_trusted < 0.25 * measured


def changed(clip: Filmed, change: Callable[[LightPlate], LightPlate], index: int = 1) -> Plates:
    rounds = list(clip.rounds)
    rounds[index] = replace(rounds[index], plates=tuple(map(change, rounds[index].plates)))
    return tuple(rounds)


def test_velocities_of_large_pictures_on_a_coarser_grid_follow_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    clip = noiseless(3, "4 px")
    before, fine = clip.rounds[1], brought_as_filmed(3, "4 px")[1]
    monkeypatch.setattr(all_lights, "FINE_PIXELS", 1000)
    coarse = brought(clip)[1]
    assert any(
        one.image.tobytes() != other.image.tobytes() for one, other in zip(coarse.plates, fine.plates, strict=True)
    )
    none, usual, coarser = (clip.error_deg(clip.solved(one), fine.time_s) for one in (before, fine, coarse))
    assert coarser[0] < 1.25 * usual[0] < none[0] / 3
    assert coarser[1] > usual[1] - 0.02


def test_rows_that_no_frame_saw_stay_unseen_and_do_not_look_like_motion() -> None:
    clip = filmed(3, "at rest")
    rows = np.arange(ROWS)
    seen = (rows < 70) | (rows >= 110)

    def cut(plate: LightPlate) -> LightPlate:
        return replace(plate, seen=seen, picture=mixture_of(plate.image * seen[:, None].astype(np.float32)))

    rounds = changed(clip, cut)
    for shown, given in zip(brought(clip, rounds=rounds)[1].plates, rounds[1].plates, strict=True):
        assert shown.image is given.image
        assert (shown.rows_seen == seen).all()
    moving = filmed(3, "4 px")
    for shown in brought(moving, rounds=changed(moving, cut))[1].plates[::2]:
        assert not shown.pixels_seen[73:107].any()
        assert not shown.image[73:107].any()
        assert shown.pixels_seen[:60].mean() > 0.8


def psnr_db(image: np.ndarray, truth: np.ndarray, inner: tuple[slice, slice]) -> float:
    return float(10 * np.log10(truth[inner].max() ** 2 / np.mean((image - truth)[inner] ** 2)))


@pytest.mark.parametrize(
    ("lights", "motion"),
    [(3, "4 px"), *(pytest.param(*case, marks=pytest.mark.campaign) for case in ((5, "4 px"), (3, "spin")))],
)
def test_an_open_shutter_shows_what_a_true_one_does_and_better_than_the_mean_of_frames(
    lights: int, motion: str
) -> None:
    clip = noiseless(lights, motion)
    comb = Comb(fps=Fraction(24), first_s=0.0, open_s=0.5 / 24)
    due = Schedule(by_round={1002: tuple((1001, time_s) for time_s in comb.samples_s(0))}, left_out=(0, 0, 0), rounds=1)
    plates = (plate for one in clip.rounds for plate in one.plates)
    how = Aligning(rate=comb)
    (one,) = with_open_shutter(aligned(plates, clip.lights, how, first=1001, schedule=due))
    truth = np.zeros(one.plates[0].shape, np.float32)
    many = 15  # their mean is that of 90 to 55 dB
    for j in range(many):
        time_s = comb.open_s * ((j + 0.5) / many - 0.5)
        truth += np.sum([plate.image for plate in at_once(clip, time_s).plates], axis=0) / many
    inner = np.s_[8:-8, 8:-8]
    blurred = psnr_db(beauty_of(one, mix_of({}, with_ambient=False)).image, truth, inner)
    sharp = psnr_db(beauty_of(replace(one, open_plates=()), mix_of({}, with_ambient=False)).image, truth, inner)
    each = [np.sum([plate.image for plate in r.plates], axis=0) for r in clip.rounds]
    frames = psnr_db(np.mean(each, axis=0), truth, inner)
    assert blurred > 35
    assert blurred > max(sharp, frames) + 3


def test_what_changes_as_no_motion_explains_is_blended_by_time_while_a_shutter_is_open() -> None:
    rng = np.random.default_rng(5)
    snow = np.s_[20:60, 30:90]
    wall = rng.uniform(0.2, 0.6, (80, 120)).astype(np.float32)
    plates = []
    for number, light in np.ndindex(3, 3):
        image = wall.copy()
        image[snow] = rng.choice([0.1, 0.7], (40, 60))
        at_s = PITCH_S * (3 * number + light)
        seen = np.ones(len(image), np.bool_)
        plates.append(LightPlate(light=f"l{light}", number=number, time_s=at_s, picture=mixture_of(image), seen=seen))
    times_s = 3.5 * PITCH_S + PITCH_S / 3 * (np.arange(15) - 7) / 15
    due = Schedule(by_round={1: tuple((1001, float(time_s)) for time_s in times_s)}, left_out=(0, 0, 0), rounds=1)
    how = Aligning(rate=Comb(fps=Fraction(24), first_s=float(times_s[7]), open_s=1.0))
    (one,) = with_open_shutter(aligned(plates, ("l0", "l1", "l2"), how, first=1001, schedule=due))
    for light, plate in enumerate(one.open_plates):
        (early, late) = (plates[3 * n + light] for n in ((1, 2) if light == 0 else (0, 1)))
        share = (times_s.mean() - early.time_s) / (late.time_s - early.time_s)
        between_them = (1 - share) * early.image + share * late.image
        assert np.abs(plate.image - between_them)[snow].mean() < 0.02
        np.testing.assert_allclose(plate.image[:, :20], wall[:, :20], atol=1e-5)


@pytest.mark.parametrize("step", [1, 2])
@pytest.mark.parametrize("gone", [False, True], ids=["both plates", "one plate gone"])
def test_what_moves_over_many_rows_is_whole_and_what_rests_beside_it_stays(step: int, gone: bool) -> None:
    rows, cols, moving_cols, px = 200, 96, slice(31, 78), 70
    y, x = np.mgrid[0:rows, 0:cols]
    still = (0.4 + 0.2 * np.sin(2 * np.pi * 3 * y / rows) * np.cos(x / 9)).astype(np.float32)
    frames = [still.copy(), still.copy(), still.copy()]
    for image, shift in zip(frames, (0, px // 2, px), strict=True):
        image[:, moving_cols] = np.roll(still[:, moving_cols], shift, axis=0)
    before, after = (
        LightPlate(
            light="a", number=n, time_s=float(n), picture=mixture_of(frames[2 * n]), seen=np.ones(rows, np.bool_)
        )
        for n in (0, 1)
    )
    moves = np.zeros((rows // step, cols // step), np.bool_)
    moves[:, moving_cols.start // step : -(-moving_cols.stop // step)] = True
    velocity = np.stack([np.zeros(moves.shape), px / step * moves]).astype(np.float32)
    motion = Followed(time_s=0.5, velocity=velocity, moves=moves, rests=~moves, step=step)
    source = np.where(moves, np.uint8(BOTH), np.uint8(AT_REST))
    ends = between.Ends(before=None if gone else before, after=after, share=0.5)
    plate = between.plate_at(ends, source, motion, number=0)
    inner = slice(px // 2 + 4, rows - px // 2 - 4), slice(moving_cols.start + 4, moving_cols.stop - 4)
    assert np.abs(plate.image - frames[1])[inner].max() < 2e-3
    assert plate.pixels_seen.all()
    kept = np.r_[0 : moving_cols.start - 3, moving_cols.stop + 3 : cols]
    np.testing.assert_allclose(plate.image[:, kept], still[:, kept], rtol=0, atol=1e-5)  # held in 16 bits
