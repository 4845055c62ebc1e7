"""Plates of one round, brought to one instant, show the surface of that instant; what is unknown is not valid."""

import functools
import weakref
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from psvideo.model.surface import Surface
from psvideo.plates.align import between
from psvideo.plates.align import packed as packed_pictures
from psvideo.plates.align.comb import Comb, Schedule
from psvideo.plates.align.doubt.unsure import UNKNOWN
from psvideo.plates.align.open_shutter import with_open_shutter
from psvideo.plates.align.packed import Packing, PutBy, packed
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.align.velocity import all_lights, flow
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.align.velocity.moving_kernel import AT_REST, BOTH
from psvideo.plates.align.velocity.vectors import pixels_per_s
from psvideo.plates.beauty import beauty_of, mix_of
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import Mixture, mixture_of
from psvideo.plates.sequence import Round
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.least_squares.woodham1980 import solve
from psvideo.solve.normals.solving import Solving
from psvideo.synth.lamps.true_flashes import TrueFlash
from psvideo.synth.scene import Scene
from psvideo.synth.stage import Stage, set_stage
from psvideo.synth.truth import true_normals

COLS, ROWS, WIDTH_M = 240, 180, 0.6
WIDER = 4 / 3
"""Pictures so much wider and higher, at the same scale, show more of the wall behind the subject."""
PITCH_S = 0.009
WALL_M = -0.9
ROUNDS = 3

Plates = tuple[Round, ...]


def metres_per_s(px_per_flash: float) -> float:
    return px_per_flash / PITCH_S * WIDTH_M / COLS


MOTIONS: dict[str, dict[str, Any] | None] = {
    "at rest": None,
    "0.2 px": {"velocity_m_per_s": [metres_per_s(0.2), metres_per_s(-0.05), 0]},
    "1 px": {"velocity_m_per_s": [metres_per_s(1.1), metres_per_s(0.3), 0]},
    "4 px": {"velocity_m_per_s": [metres_per_s(4.2), metres_per_s(-0.7), 0]},
    "16 px": {"velocity_m_per_s": [metres_per_s(15.8), metres_per_s(2.7), 0]},
    "spin": {"axis": [0, 0, 1], "spin_deg_per_s": float(np.rad2deg(3.0 / 80) / PITCH_S)},
    "tumbling, 8 px": {"axis": [1, 2, 1], "spin_deg_per_s": float(np.rad2deg(8.0 / 80) / PITCH_S)},
    "turn": {"axis": [0, 1, 0], "spin_deg_per_s": float(np.rad2deg(1.0 / 80) / PITCH_S)},
}


@dataclass(frozen=True)
class Filmed:
    """Rounds of plates, the lights, and what is true at any instant."""

    rounds: Plates
    lit: Illumination
    stage: Stage

    @property
    def lights(self) -> tuple[str, ...]:
        return self.lit.names

    def error_deg(self, surface: Surface, time_s: float) -> tuple[float, float]:
        """Return the mean error over the subject, and which share of it is valid."""
        subject = self.subject(time_s)
        said = surface.valid & subject
        off_deg = angle_deg(surface.normals, true_normals(self.stage.view(time_s).hits))
        return float(off_deg[said].mean()), float(said.sum() / subject.sum())

    def subject(self, time_s: float) -> np.ndarray:
        """Return where the subject is."""
        hits = self.stage.view(time_s).hits
        return hits.image((hits.point_m[:, 2] > WALL_M + 0.01).astype(np.float32)) > 0.5

    def solved(self, one: Round) -> Surface:
        return solve([plate.image for plate in one.plates], self.lit, seen=seen(one))


def seen(one: Round) -> np.ndarray:
    return np.stack([plate.pixels_seen for plate in one.plates])


def angle_deg(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    across = np.linalg.norm(np.cross(one, other), axis=-1)
    return np.asarray(np.rad2deg(np.arctan2(across, (one * other).sum(axis=-1))))


def filmed(lights: int, motion: str, noise: float = 0.0) -> Filmed:
    """Film, and let the sensor add noise."""
    clip = noiseless(lights, motion)
    rng = np.random.default_rng(5)

    def noisy(plate: LightPlate) -> LightPlate:
        return replace(
            plate, picture=mixture_of(np.asarray(plate.image + rng.normal(0, noise, plate.image.shape), np.float32))
        )

    return replace(clip, rounds=tuple(replace(one, plates=tuple(map(noisy, one.plates))) for one in clip.rounds))


@functools.cache
def noiseless(lights: int, motion: str, wider: float = 1.0) -> Filmed:
    """Film a mottled subject before a wall: three rounds of the lights and a dark slot, middle at 0 s."""
    turns = 2 * np.pi * np.arange(lights) / lights + 0.3
    directions = np.stack([0.45 * np.cos(turns), 0.45 * np.sin(turns), np.full(lights, 0.893)], axis=1)
    table = [{"name": f"l{n}", "direction": [float(x) for x in d], "intensity": 0.9} for n, d in enumerate(directions)]
    skin = {"pattern": "noise", "colour": 0.8, "second": 0.3, "size_m": 0.05}
    wall = {"pattern": "noise", "colour": 0.4, "second": 0.2, "size_m": 0.1}
    stage = set_stage(
        Scene.model_validate(
            {
                "schema": "psvideo-scene/1",
                "camera": {"width_px": round(wider * COLS), "height_px": round(wider * ROWS), "fps": 120,
                           "shutter_deg": 360.0, "readout_s": 0.008, "width_m": wider * WIDTH_M, "colour": "grey"},
                "light": table,
                "object": [
                    {"mesh": "sphere", "height_m": 0.4, "albedo": skin, "motion": MOTIONS[motion]},
                    {"mesh": "plane", "scale": 4.0, "position_m": [0, 0, WALL_M], "albedo": wall},
                ],
            }
        ),
        Path(),
    )  # fmt: skip
    still: dict[int, np.ndarray] = {}
    middle = (ROUNDS - 1) / 2 * (lights + 1) + (lights - 1) / 2
    rounds = []
    for index in range(ROUNDS):
        plates = []
        for n in range(lights):
            time_s = (index * (lights + 1) + n - middle) * PITCH_S
            flash = TrueFlash(
                index=0, slot=n, lights={f"l{n}": 1.0}, start_s=time_s - 4e-4, duration_s=8e-4, complete=True
            )
            image = still.get(n)
            if image is None:
                image = stage.plate(flash, stage.view(time_s))
            if MOTIONS[motion] is None:
                still[n] = image
            plates.append(
                LightPlate(
                    light=f"l{n}",
                    number=1001 + index,
                    time_s=time_s,
                    picture=mixture_of(image),
                    seen=np.ones(len(image), np.bool_),
                )
            )
        rounds.append(Round(number=1001 + index, plates=tuple(plates)))
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    names = tuple(f"l{n}" for n in range(lights))
    lit = Illumination(directions=unit, intensities=np.full((lights, 1), 0.9), names=names)
    return Filmed(rounds=tuple(rounds), lit=lit, stage=stage)


@functools.cache
def brought_as_filmed(lights: int, motion: str, how: Aligning = Aligning()) -> list[Round]:
    return brought(noiseless(lights, motion), how)


def brought(clip: Filmed, how: Aligning = Aligning(), rounds: Plates | None = None) -> list[Round]:
    plates = (plate for one in rounds or clip.rounds for plate in one.plates)
    return list(aligned(plates, clip.lights, how, first=1001))


@pytest.mark.parametrize(
    ("lights", "motion", "before_deg"),
    [
        (3, "1 px", 1.2),
        (3, "4 px", 4.6),
        (3, "spin", 4.6),
        (3, "turn", 2.0),
        pytest.param(8, "1 px", 2.5, marks=pytest.mark.campaign),
        (8, "4 px", 8.8),
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


@pytest.mark.parametrize("lights", [3, 8])
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


@pytest.mark.parametrize("rate", ["round", "flash"])
def test_what_is_delivered_is_the_surface_at_the_time_that_it_names(rate: Any) -> None:
    clip = noiseless(3, "4 px")
    results = brought_as_filmed(3, "4 px", Aligning(rate=rate))
    for one in results[1:2] if rate == "round" else results[3:6]:
        assert {plate.time_s for plate in one.plates} == {one.plates[0].time_s}
        surface = clip.solved(one)
        off_deg = [clip.error_deg(surface, one.time_s + late * PITCH_S)[0] for late in (-0.25, 0.0, 0.25)]
        assert off_deg[1] < 1.0 < min(off_deg[0], off_deg[2])


@pytest.mark.parametrize("which", [0, -1])
def test_the_first_and_the_last_round_have_one_side_only(which: int) -> None:
    clip = noiseless(3, "4 px")
    one = brought_as_filmed(3, "4 px")[which]
    assert clip.error_deg(clip.solved(one), one.time_s)[0] < 1.5


@pytest.mark.parametrize(
    ("motion", "how", "per_light", "later"),
    [
        ("at rest", Aligning(align="none"), 1.0, 1.0),
        ("at rest", Aligning(), 1.5, 1.0),  # the early half of the first round waits for that of the next
        ("4 px", Aligning(), 1.5, 1.25),  # the plates of an instant are packed, and those they are made from
        ("4 px", Aligning(align="none", rate="flash"), 2.0, 2.0),  # two rounds
        ("4 px", Aligning(rate="flash"), 2.0, 1.25),  # two rounds packed, and an instant
    ],
)
def test_no_more_plates_are_held_than_instants_need(
    motion: str, how: Aligning, per_light: float, later: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``later`` is once the first instant is out."""
    clip = filmed(8, motion)
    sizes: dict[int, float] = {}
    most = most_later = 0.0
    instants = 0

    def count(image: np.ndarray) -> None:
        if id(image) not in sizes:
            sizes[id(image)] = image.nbytes / clip.rounds[0].plates[0].image.nbytes
            weakref.finalize(image, sizes.pop, id(image))

    def plates() -> Iterator[LightPlate]:
        nonlocal most, most_later
        for one in clip.rounds:
            for plate in one.plates:
                own = replace(plate, picture=mixture_of(plate.image.copy()))
                count(own.image)
                most = max(most, sum(sizes.values()))
                most_later = max(most_later, sum(sizes.values()) if instants else 0.0)
                yield own
                del own

    class Watched(Packing):
        def picture(self, saturation: float, put_by: PutBy | None = None) -> Mixture:
            count(self.codes)
            return super().picture(saturation, put_by)

    monkeypatch.setattr(packed_pictures, "Packing", Watched)
    monkeypatch.setattr(between, "Packing", Watched)
    for shown in aligned(plates(), clip.lights, how, first=1001):
        instants += 1
        for plate in shown.plates:
            if plate.picture.is_made:
                count(plate.image)
        most = max(most, sum(sizes.values()))
        del shown, plate
    assert most <= per_light * len(clip.lights) + 1  # the plate that comes
    assert most_later <= later * len(clip.lights) + 1
    assert not sizes


@pytest.mark.parametrize("rate", ["round", "flash"])
@pytest.mark.parametrize("align", ["none", "auto", "flow"])
def test_a_dark_slot_goes_with_its_own_round_wherever_it_lies_and_a_round_without_has_none(
    align: Any, rate: Any
) -> None:
    clip = filmed(3, "at rest")

    def plates(dark_at: int) -> Iterator[LightPlate]:
        for one in clip.rounds:
            given = list(one.plates)
            if one.number != 1002:
                given.insert(dark_at, replace(given[0], light="ambient"))
            yield from given

    for dark_at in (0, 2, 3):
        how = Aligning(align=align, rate=rate)
        results = list(aligned(plates(dark_at), clip.lights, how, first=1001, with_ambient=True))
        numbers = [None if one.ambient is None else one.ambient.number for one in results]
        each = 3 if rate == "flash" else 1
        assert numbers == [number for number in (1001, None, 1003) for _ in range(each)]
        assert [one.lights for one in results] == [clip.lights] * len(results)


def test_a_packed_plate_is_good_to_its_16_bits_and_what_is_clipped_stays_so() -> None:
    rng = np.random.default_rng(8)
    image = rng.uniform(-0.02, 1.7, (60, 80, 3)).astype(np.float32)
    for saturation in (1.0, 1.37, 3.0):
        clipped = np.minimum(image, saturation).astype(np.float32)
        plate = LightPlate(
            light="a",
            number=1,
            time_s=0.0,
            picture=mixture_of(clipped),
            seen=np.ones(60, np.bool_),
            saturation=saturation,
        )
        small = packed(plate.picture, saturation)
        assert np.asarray(small.frames[0].codes).nbytes == image.nbytes / 2
        again = small.image()
        assert np.abs(again - clipped).max() < 2e-5
        assert ((again >= saturation) == (clipped >= saturation - 2e-5)).all()


def test_one_result_per_flash_takes_numbers_of_its_own() -> None:
    clip = noiseless(3, "4 px")
    results = brought_as_filmed(3, "4 px", Aligning(rate="flash"))
    assert [one.number for one in results] == list(range(1001, 1001 + 3 * ROUNDS))
    flashes_s = [plate.time_s for one in clip.rounds for plate in one.plates]
    assert [one.time_s for one in results] == pytest.approx(flashes_s, abs=1e-12)
    one_missing = [one.number for one in brought(clip, Aligning(rate="flash"), rounds=clip.rounds[1:])]
    assert one_missing == list(range(1004, 1010))


def test_without_flow_a_result_per_flash_takes_the_plates_nearest_in_time() -> None:
    clip = filmed(3, "4 px")
    first = brought(clip, Aligning(align="none", rate="flash"))[3]
    want = [clip.rounds[1].plates[0], clip.rounds[1].plates[1], clip.rounds[0].plates[2]]
    assert all(shown.image is given.image for shown, given in zip(first.plates, want, strict=True))


def test_what_the_subject_hides_of_the_wall_is_right_or_not_valid() -> None:
    clip = noiseless(8, "4 px", WIDER)
    one = brought(clip)[1]
    hits = clip.stage.view(one.time_s).hits
    wall = hits.image((hits.point_m[:, 2] <= WALL_M + 0.01).astype(np.float32)) > 0.5

    shadows = angle_deg(clip.solved(at_once(clip, one.time_s)).normals, true_normals(hits)) > 2

    def wrong(surface: Surface) -> float:
        off = angle_deg(surface.normals, true_normals(hits)) > 10
        return float((off & surface.valid & wall & ~shadows).sum() / wall.sum())

    def judged(shown: Round) -> Surface:
        return Solving().solve([plate.image for plate in shown.plates], clip.lit, seen=seen(shown), unsure=shown.unsure)

    assert one.unsure is not None
    explained = [plate.image for plate in one.plates], clip.lit
    assert wrong(solve(*explained, seen=seen(one) & (one.unsure < UNKNOWN))) < 0.4 * wrong(clip.solved(clip.rounds[1]))
    trusted = judged(one)
    assert (trusted.valid & wall).sum() > (judged(clip.rounds[1]).valid & wall).sum()
    assert wrong(trusted) < 0.01


def test_where_no_motion_explains_what_changed_normals_are_as_good_as_without_alignment() -> None:
    clip = noiseless(5, "tumbling, 8 px")

    def off_deg(shown: Round) -> float:
        images = [plate.image for plate in shown.plates]
        surface = Solving().solve(images, clip.lit, seen=seen(shown), unsure=shown.unsure)
        off = angle_deg(surface.normals, true_normals(clip.stage.view(shown.time_s).hits))
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


def at_once(clip: Filmed, time_s: float) -> Round:
    """The plates as they would be if all lights had flashed at one instant."""
    view = clip.stage.view(time_s)
    plates = []
    for n, plate in enumerate(clip.rounds[1].plates):
        flash = TrueFlash(index=0, slot=n, lights={plate.light: 1.0}, start_s=time_s, duration_s=1e-9, complete=True)
        plates.append(replace(plate, picture=mixture_of(clip.stage.plate(flash, view)), time_s=time_s))
    return Round(number=1, plates=tuple(plates))


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


@pytest.mark.parametrize(("motion", "gain", "least"), [("4 px", 1.6, 0.93), ("4 px", 2.2, 0.95), ("spin", 1.6, 0.88)])
def test_where_light_moves_as_much_is_clipped_as_clips_and_at_the_same_places(
    motion: str, gain: float, least: float
) -> None:
    clip = filmed(3, motion)

    def brighter(one: Round) -> Round:
        bright = tuple(
            replace(p, picture=mixture_of(np.minimum(gain * p.image, 1).astype(np.float32))) for p in one.plates
        )
        return replace(one, plates=bright)

    shown = brought(clip, rounds=tuple(map(brighter, clip.rounds)))[1]
    truth = brighter(at_once(clip, shown.time_s))
    for plate, true in zip(shown.plates, truth.plates, strict=True):
        assert plate.image.max() == 1.0
        clips, clipped = true.image >= 1.0, plate.image >= 1.0
        assert clips.sum() > 200
        assert clipped[clips & plate.pixels_seen].mean() > least
        assert clipped.sum() == pytest.approx(clips.sum(), rel=0.1)


def test_nothing_is_clipped_by_being_moved() -> None:
    """Interpolation goes beyond what is bright beside what is dark."""
    clip = filmed(3, "4 px")

    def brighter(one: Round) -> Round:
        return replace(one, plates=tuple(replace(p, picture=mixture_of(_two_tones(p.image))) for p in one.plates))

    for plate in brought(clip, rounds=tuple(map(brighter, clip.rounds)))[1].plates:
        assert 0.97 < plate.image.max() < 1.0


def _two_tones(image: np.ndarray) -> np.ndarray:
    return np.where(image > np.percentile(image, 90), 0.98, 0.1).astype(np.float32)


@pytest.mark.parametrize(("motion", "moves"), [("at rest", False), ("1 px", True)])
def test_noise_that_blocks_share_as_compression_makes_it_is_no_motion(motion: str, moves: bool) -> None:
    """Blocks of 8 x 8 pixels are off by about a code of 255 each, and their pixels by hardly more."""
    rng = np.random.default_rng(4)
    before, after = (one.plates[0] for one in noiseless(3, motion).rounds[:2])

    def compressed(plate: LightPlate) -> LightPlate:
        root = np.sqrt(np.maximum(plate.image, 0)) + 0.02
        steps = np.kron(rng.normal(0, 0.6 / 255, (ROWS // 8 + 1, COLS // 8 + 1)), np.ones((8, 8)))[:ROWS, :COLS]
        shown = root + (steps + rng.normal(0, 0.05 / 255, steps.shape)).reshape(*steps.shape, *[1] * (root.ndim - 2))
        return replace(plate, picture=mixture_of(np.square(np.maximum(shown - 0.02, 0)).astype(np.float32)))

    white = flow.white_of(before)
    sketches = [flow.sketch_of(compressed(plate), white=white) for plate in (before, after)]
    assert flow.changed(sketches[0], sketches[1]).any() == moves


def test_a_round_that_lacks_a_light_is_not_shown_but_helps_its_neighbours() -> None:
    clip = filmed(3, "4 px")
    rounds = list(clip.rounds)
    rounds[2] = replace(rounds[2], plates=rounds[2].plates[:1])
    results = brought(clip, rounds=tuple(rounds))
    assert [one.number for one in results] == [1001, 1002]
    assert clip.error_deg(clip.solved(results[1]), results[1].time_s)[0] < 1.5


def brightened(one: Round, gain: float) -> Round:
    """The round as another exposure shows it."""
    plates = (replace(plate, picture=mixture_of(plate.image * np.float32(gain))) for plate in one.plates)
    return replace(one, plates=tuple(plates))


@pytest.mark.parametrize("gain", [0.7, 1.02, 1.4])
def test_an_exposure_that_changes_from_round_to_round_is_no_motion(gain: float) -> None:
    clip = filmed(3, "at rest", 0.004)
    breathing = tuple(
        replace(
            one,
            plates=tuple(replace(plate, picture=mixture_of(plate.image * np.float32(gain**n))) for plate in one.plates),
        )
        for n, one in enumerate(clip.rounds)
    )
    for given, shown in zip(breathing[1].plates, brought(clip, rounds=breathing)[1].plates, strict=True):
        assert shown.image is given.image


@pytest.mark.parametrize("gain", [0.85, 1.2])
def test_what_moves_while_the_exposure_changes_is_still_followed(gain: float) -> None:
    clip = filmed(3, "4 px", 0.004)
    breathing = tuple(
        replace(
            one,
            plates=tuple(replace(plate, picture=mixture_of(plate.image * np.float32(gain**n))) for plate in one.plates),
        )
        for n, one in enumerate(clip.rounds)
    )
    time_s = clip.rounds[1].plates[1].time_s
    said = [clip.error_deg(clip.solved(brought(clip, rounds=rounds)[1]), time_s) for rounds in (None, breathing)]
    (_, share), (error_deg, share_breathing) = said
    assert share_breathing > 0.9 * share
    assert error_deg < 4.6


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
    many = 30  # their mean is that of 90 to 62 dB
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


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1), (4, 4), (7, 200), (8, 8), (8, 12), (11, 11), (12, 12)])
@pytest.mark.parametrize("how", ["auto", "flow"])
def test_pictures_of_a_few_pixels_are_brought_together_without_flow(shape: tuple[int, int], how: Any) -> None:
    rng = np.random.default_rng(0)
    plates = [
        LightPlate(
            light=light,
            number=1000 + number,
            time_s=float(4 * number + place),
            picture=mixture_of((0.5 * rng.random(shape)).astype(np.float32)),
            seen=np.ones(shape[0], np.bool_),
        )
        for number in range(1, 4)
        for place, light in enumerate("abcd")
    ]
    found = list(aligned(plates, tuple("abcd"), Aligning(align=how), first=1001))
    assert [one.number for one in found] == [1001, 1002, 1003]
    assert all(plate.shape == shape and np.isfinite(plate.image).all() for one in found for plate in one.plates)


@pytest.mark.parametrize("codes", [1.0, 1.9, 3.1, 5.0])
def test_noise_of_a_few_codes_is_known_between_whole_ones(codes: float) -> None:
    """White noise on a wall of code 120, by which two sketches differ; rounding adds a sixth of a squared code."""
    rng = np.random.default_rng(2)
    rounded = [np.rint(120 + rng.normal(0, codes / np.sqrt(2), (240, 320))).astype(np.uint8) for _ in range(2)]
    before, after = (
        flow.Sketch(
            number=number,
            time_s=float(number),
            codes=each,
            seen=np.ones((240, 1), np.bool_),
            blocks=each[::4, ::4].astype(np.float32),
            white=1.0,
        )
        for number, each in enumerate(rounded)
    )
    assert flow.noise_between(before, after) == pytest.approx(np.hypot(codes, np.sqrt(1 / 6)), rel=0.06)
