"""Results are begun when their round is whole: simulated cameras, rounds and machines."""

from dataclasses import dataclass
from math import ceil

import numpy as np
import pytest

from psvideo.live.rhythm import WANTED_RATE, Rhythm
from psvideo.live.showing.quality import LEAST_RATE, MOST_RATE

LASTS_S = 60.0
READ_S = 0.002
"""A frame is there so much later than it ends, at most."""
LOOK_S = 0.0004
"""It takes as long to see that there is no new round."""


@dataclass(frozen=True, kw_only=True)
class Shown:
    """When results were begun, and how old the round of each was then, from the coming of its last frame."""

    began_s: np.ndarray
    age_s: np.ndarray

    @property
    def rate(self) -> float:
        """Results a second."""
        return len(self.began_s) / LASTS_S


def shown(*, round_s: float, frame_s: float, takes_s: float, keeps: bool = True) -> Shown:
    """Begin results for a minute on a machine that takes so long for each, more or less; without a rhythm, at the most
    that anybody sees, whatever rounds do."""
    rng = np.random.default_rng(7)
    came_s = np.arange(int(LASTS_S / frame_s)) * frame_s + rng.uniform(0, READ_S, int(LASTS_S / frame_s))
    ends = [ceil(number * round_s / frame_s) for number in range(1, int(LASTS_S / round_s))]
    whole_s = came_s[[end for end in ends if end < len(came_s)]]
    rhythm, now_s, due_s, last = Rhythm(round_s=round_s, frame_s=frame_s), 0.0, 0.0, -1
    began, ages = [], []
    while (frame := int(np.searchsorted(came_s, now_s))) < len(came_s):
        now_s = max(now_s, came_s[frame])
        now_s = max(now_s, rhythm.next_begins_s(now_s) if keeps else due_s)
        newest = int(np.searchsorted(whole_s, now_s, side="right")) - 1
        if newest == last:
            now_s += LOOK_S
            continue
        last, due_s = newest, now_s + 1 / MOST_RATE
        began.append(now_s)
        ages.append(now_s - whole_s[newest])
        rhythm = rhythm.after_result(began_s=now_s, came_s=float(whole_s[newest]))
        now_s += takes_s * rng.uniform(0.9, 1.3)
    return Shown(began_s=np.array(began), age_s=np.array(ages))


@pytest.mark.parametrize("frame_s", [1 / 120, 1 / 240])
@pytest.mark.parametrize("round_s", [0.02, 0.03, 0.0455, 0.057])
def test_a_machine_with_time_begins_with_a_round_that_is_just_whole(round_s: float, frame_s: float) -> None:
    """Two frames old at most; without a rhythm it is anything up to a round."""
    now, before = (shown(round_s=round_s, frame_s=frame_s, takes_s=0.025, keeps=keeps) for keeps in (True, False))
    assert np.percentile(now.age_s, 95) < 2.2 * frame_s + READ_S
    assert np.mean(now.age_s) < 0.8 * np.mean(before.age_s)
    assert now.rate >= WANTED_RATE
    assert now.rate <= MOST_RATE + 0.1


@pytest.mark.parametrize("takes_s", [0.02, 0.04, 0.05, 0.055, 0.08])
@pytest.mark.parametrize("round_s", [0.02, 0.0455, 0.057, 0.062, 0.1])
def test_waiting_for_rounds_costs_no_result_that_is_needed(round_s: float, takes_s: float) -> None:
    now, before = (shown(round_s=round_s, frame_s=1 / 120, takes_s=takes_s, keeps=keeps) for keeps in (True, False))
    assert now.rate >= min(LEAST_RATE, before.rate - 0.1)
    assert np.percentile(now.age_s, 95) <= np.percentile(before.age_s, 95) + 1 / 120


def test_where_every_round_is_wanted_none_waits_and_there_is_time_until_the_next_is_whole() -> None:
    rhythm = Rhythm(round_s=0.1, frame_s=0.01).after_result(began_s=5.0, came_s=4.99)
    assert rhythm.next_begins_s(5.03) == 5.03
    assert rhythm.idle_until_s(5.03) == pytest.approx(5.09)
    assert rhythm.idle_until_s(5.12) == pytest.approx(5.19)


def test_rounds_that_are_left_out_leave_time_until_the_one_after() -> None:
    rhythm = Rhythm(round_s=0.04, frame_s=0.01)
    for began_s in (0.0, 0.04, 0.08):
        rhythm = rhythm.after_result(began_s=began_s, came_s=began_s)
    assert rhythm.next_begins_s(0.11) == pytest.approx(0.17), (
        "three in 0.12 s are more than anybody sees: the next is left out"
    )
    assert rhythm.idle_until_s(0.11) == pytest.approx(0.17)
