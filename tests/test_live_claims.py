"""What the live clock claims to know is what it knows: errors against claims, of many clocks that run as clocks do."""

from collections.abc import Callable

import numpy as np
import pytest
from live_shots import plates_of, profiles_of

from psvideo.live.following.catching_up import caught_up
from psvideo.live.following.follow import Follower
from psvideo.live.following.lock import frames_to_lock, lock
from psvideo.live.following.phase_filter import Measured, started
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import FoundClock
from psvideo.synth import Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]
RUNS = {
    "still": {},
    "off": {"offset_ppm": 30.0},
    "drifts by 1 ppm/s": {"offset_ppm": 30.0, "drift_ppm_per_s": 1.0},
    "drifts by 5 ppm/s": {"offset_ppm": 30.0, "drift_ppm_per_s": 5.0},
    "jitters": {"offset_ppm": 30.0, "jitter_s": 2e-6},
}
ERROR_S = 1e-7
LAST = 25
"""Flashes of a quarter of a second: a rate that wanders lets no older ones count in full."""


def late_s(clock: TrueClock, follower: Follower, at_s: float) -> tuple[float, float]:
    """How late the flash truly comes that the lock's clock has at a time, and how late the follower has it."""
    base, now = follower.lock.beat.clock, follower.clock
    strobe_s = (at_s - base.phase_s) / base.rate
    cycle_s = follower.plan.cycle_s
    true_s = float(clock.camera_time_s(np.array([strobe_s]))[0]) - at_s
    return (true_s + 0.5 * cycle_s) % cycle_s - 0.5 * cycle_s, now.phase_s + strobe_s * now.rate - at_s


def errors_and_claims(plan: Plan, clock: TrueClock) -> Doubles:
    """Errors and claims in rows, (frame, 2), at every eighth frame of four seconds and a half."""
    noise = Noise(full_well_e=20_000, read_e=8)
    shot = expose(plates_of(plan), plan, frames=540, clock=clock, noise=noise, bits=12, seed=clock.seed)
    values, first = profiles_of(shot), frames_to_lock(plan)
    follower = caught_up(plan, lock(plan, np.arange(first), values[:first]), list(values[:first]))
    found = []
    for number in range(first, len(values)):
        follower.add(number, values[number])
        if number % 8 == 0:
            true_s, has_s = late_s(clock, follower, number * plan.camera.frame_period_s)
            found.append(((has_s - true_s) / plan.camera.row_time_s, follower.error_rows))
    assert follower.state == "locked"
    return np.array(found)


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.campaign
def test_the_error_of_the_followed_clock_is_what_it_claims(make_plan: PlanMaker, run: str) -> None:
    plan = make_plan(width_px=8, height_px=96)
    clocks = [TrueClock(phase_s=0.0037 * (seed + 1), seed=seed, **RUNS[run]) for seed in range(3)]
    errors, claims = np.concatenate([errors_and_claims(plan, clock) for clock in clocks]).T
    assert 0.3 < np.sqrt(np.mean((errors / claims) ** 2)) < 2
    jitter_rows = clocks[0].jitter_s / plan.camera.row_time_s
    most_rows = max(0.004, 3 * jitter_rows / np.sqrt(LAST))  # 3 sigma / sqrt(n): a parabola's end from n points
    assert np.sqrt(np.mean(errors**2)) < most_rows
    assert np.mean(claims) < most_rows


@pytest.mark.parametrize("drift_ppm_per_s", [0.0, 1.0, 5.0, -5.0])
def test_the_filter_claims_what_it_knows_of_clocks_that_drift(drift_ppm_per_s: float) -> None:
    """Forty clocks for ten seconds, a window every 1/15 s: the true shift is a parabola."""
    rng = np.random.default_rng(0)
    of_claim = []
    for _ in range(40):
        phase = started(FoundClock(phase_s=0.0, offset_ppm=0.0), 0.0, ERROR_S, 3.0)
        offset_ppm = rng.normal(0, 3.0)
        for at_s in (np.arange(1, 150) / 15).tolist():
            true_s = 1e-6 * (offset_ppm * at_s + 0.5 * drift_ppm_per_s * at_s**2)
            has_s = phase.clock.phase_s + at_s * phase.clock.rate - at_s
            seen_s = true_s + rng.normal(0, ERROR_S)
            phase = phase.corrected(Measured(at_s=at_s, late_s=seen_s - has_s, error_s=ERROR_S))
            now_s = phase.clock.phase_s + at_s * phase.clock.rate - at_s
            of_claim.append((now_s - true_s) / phase.error_at_s(at_s))
    assert 0.5 < np.sqrt(np.mean(np.square(of_claim))) < 1.2
