"""Ambient light without a dark slot: told from rows that saw a part of a flash, against the virtual shoot's truth."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from memory_frame import MemoryFrame

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.model.timing import Flash, Timing
from psvideo.plates.ambient.ambient_regression import Separated, design_of, separated
from psvideo.plates.split import split
from psvideo.synth import Exposure, Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]
FRAMES, ROWS, COLS = 100, 120, 96
NOISE = Noise(full_well_e=20_000, read_e=6)


def texture(grain_px: int) -> np.ndarray:
    blocks = np.random.default_rng(5).uniform(0.2, 1, (ROWS // grain_px, COLS // grain_px))
    return np.kron(blocks, np.ones((grain_px, grain_px))).astype(np.float32)


def timing_of(plan: Plan, shot: Exposure) -> Timing:
    flashes = tuple(
        Flash(
            index=n, slot=flash.slot, lights=plan.flashes[flash.slot].lights, start_s=flash.start_s,
            duration_s=flash.duration_s, complete=0 < flash.start_s < (FRAMES - 2) * plan.camera.frame_period_s,
        )
        for n, flash in enumerate(shot.flashes)
    )  # fmt: skip
    return Timing(
        clip="", frame_period_s=plan.camera.frame_period_s, exposure_s=plan.camera.exposure_s,
        row_time_s=plan.camera.row_time_s, clock_offset_ppm=0, phase_error_rows=0, order="given", flashes=flashes,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Take:
    plan: Plan
    timing: Timing
    frames: Doubles
    plates: dict[int, np.ndarray]
    ambient: np.ndarray

    def told(self) -> Separated:
        return separated(design_of(self.plan, self.plan.camera, self.timing, range(FRAMES)), self.frames)

    def error(self, ambient: np.ndarray | float) -> float:
        """The plates' RMS error with so much ambient light taken off."""
        squares = [
            np.mean((plate.image - plate.exposures[:, None] * ambient - self.plates[plate.flash.slot])[plate.seen] ** 2)
            for plate in split(map(MemoryFrame, range(FRAMES), self.frames), self.plan.camera, self.timing)
        ]
        return float(np.sqrt(np.mean(squares)))


@pytest.fixture(scope="module")
def film(make_plan: PlanMaker) -> Callable[..., Take]:
    def filmed(*, level: float = 0.02, grain_px: int = 8, lights: int = 4) -> Take:
        names = tuple(f"light{n}" for n in range(lights))
        plan = make_plan(lights=names, dark=False, width_px=COLS, height_px=ROWS, readout=0.97)
        shades = texture(grain_px)
        plates = [np.asarray(shades * strength, np.float32) for strength in np.linspace(0.2, 0.5, lights)]
        ambient = np.asarray(level * shades, np.float32)
        clock = TrueClock(phase_s=0.0123, offset_ppm=20.0)
        shot = expose(plates, plan, frames=FRAMES, ambient=ambient, clock=clock, noise=NOISE, seed=3)
        return Take(
            plan=plan, timing=timing_of(plan, shot), frames=np.array(shot.frames), plates=dict(enumerate(plates)),
            ambient=ambient,
        )  # fmt: skip

    return filmed


@pytest.mark.parametrize(
    "how",
    [{}, {"grain_px": 1}, {"grain_px": 2}, {"lights": 3, "level": 0.1}, {"lights": 8}, {"level": 0.0}],
    ids=["2 %", "finest detail", "fine detail", "10 %", "eight lights", "none"],
)
def test_plates_are_as_good_as_with_the_ambient_light_known(how: dict[str, float], film: Callable[..., Take]) -> None:
    take = film(**how)
    found = take.told()
    assert found.known.all()
    assert found.stood.all()
    assert take.error(found.image) < 1.05 * take.error(take.ambient)


def test_left_in_it_costs_far_more(film: Callable[..., Take]) -> None:
    take = film()
    assert take.error(0.0) > 3 * take.error(take.ambient)


def test_weights_take_the_constant_alone(film: Callable[..., Take]) -> None:
    take = film()
    design = design_of(take.plan, take.plan.camera, take.timing, range(FRAMES))
    np.testing.assert_allclose(design.takes.sum(axis=0), 1.0, atol=1e-6)
    np.testing.assert_allclose(np.einsum("nr,snr->sr", design.takes, design.shares), 0.0, atol=1e-6)


def test_what_moves_is_said_to_and_takes_the_light_around_it(film: Callable[..., Take]) -> None:
    take = film(grain_px=24)
    frames = take.frames.copy()
    for n in range(FRAMES):
        frames[n, 40:72, 20 + n // 4 : 44 + n // 4] *= 0.3
    found = replace(take, frames=frames).told()
    assert 0.05 < (~found.stood).mean() < 0.5
    moved = found.image[40:72, 24:60]
    assert moved.min() >= 0
    assert moved.max() < 3 * take.ambient.max()


def test_a_later_window_keeps_what_an_earlier_one_saw_standing(film: Callable[..., Take]) -> None:
    take = film(grain_px=24)
    design = design_of(take.plan, take.plan.camera, take.timing, range(FRAMES))
    first = separated(design, take.frames)
    frames = take.frames.copy()
    frames[::2, 40:72, 20:44] *= 0.3
    later = separated(design, frames, before=first)
    np.testing.assert_allclose(later.image[48:64, 28:40], first.image[48:64, 28:40])


def test_a_window_too_short_to_tell_says_so(film: Callable[..., Take]) -> None:
    take = film()
    design = design_of(take.plan, take.plan.camera, take.timing, range(7))
    assert not design.known.all()
    assert not design.takes[:, ~design.known].any()


@pytest.mark.parametrize("frames", [5, 7, 9, 14])
def test_of_few_frames_a_row_that_saw_whole_flashes_only_is_not_taken_for_known(
    frames: int, film: Callable[..., Take]
) -> None:
    take = film()
    design = design_of(take.plan, take.plan.camera, take.timing, range(10, 10 + frames))
    kept = np.einsum("nr,snr->sr", design.takes, design.shares)[:, design.known]
    assert np.abs(kept).max(initial=0.0) < 0.011
    np.testing.assert_allclose(design.takes.sum(axis=0)[design.known], 1.0, atol=0.011)
