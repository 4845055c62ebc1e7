"""Facts of rounds are kept as plain numbers, and come out as they went in."""

import random
import tracemalloc
from dataclasses import replace

import pytest

from psvideo.model.surface import Misfit, Reflectance
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.steadiness import Change

RECORD_BYTES = 1000
"""A record of these numbers, each an object of its own, takes more: 17 places, 26 numbers, three tuples, two records.
"""
MOST_BYTES = 290
"""25 numbers of 8 bytes, 12 of what they are, 33 of what holds them, and two places in lists that grow by eighths."""


def _facts(number: int, seed: random.Random, lights: int = 4) -> InstantFacts:
    def some() -> float:
        return seed.uniform(-1, 1)

    def perhaps() -> float | None:
        return some() if seed.random() < 0.5 else None

    reflectance = Reflectance(*(some() for _ in range(6))) if seed.random() < 0.5 else None
    misfit = Misfit(share=some(), error_deg=some(), noise_deg=some(), reflectance=reflectance)
    return InstantFacts(
        number=number,
        time_s=some(),
        valid_share=perhaps(),
        clipped_share=some(),
        unseen_share=some(),
        borrowed_share=some(),
        change=Change(normals_deg=some(), albedo_percent=some(), level_percent=some()) if seed.random() < 0.5 else None,
        levels=tuple(some() for _ in range(lights)),
        clipped=tuple(some() for _ in range(lights if seed.random() < 0.5 else 0)),
        white=tuple(some() for _ in range(lights)),
        ambient=perhaps(),
        speed_px_s=perhaps(),
        moving_share=perhaps(),
        misfit=misfit if seed.random() < 0.5 else None,
        measured_share=perhaps(),
        moving_valid_share=perhaps(),
        slope_deg=some(),
        spoilt_share=some(),
        likely_deg=perhaps(),
    )


@pytest.mark.parametrize("lights", [0, 1, 3, 8])
def test_facts_come_out_as_they_went_in_each_by_itself_and_in_turn(lights: int) -> None:
    seed = random.Random(lights)
    given = [_facts(1001 + n, seed, lights) for n in range(200)]
    kept = KeptFacts(given[:150])
    kept.extend(given[150:])
    assert list(kept) == given
    assert (len(kept), kept[3], kept[-1], kept[7:11]) == (200, given[3], given[-1], tuple(given[7:11]))


def test_a_round_takes_no_more_than_its_numbers() -> None:
    """Rounds of one take share the value at which their plates clip, and what their subject reflects."""
    seed, numbers = random.Random(1), range(4000)
    white, reflectance = (1.0, 1.0, 1.0, 1.0), Reflectance(0.1, 0.0, 0.0, 0.0, 0.2, 0.0)

    def filmed(number: int) -> InstantFacts:
        misfit = Misfit(share=seed.random(), error_deg=seed.random(), noise_deg=seed.random(), reflectance=reflectance)
        change = Change(normals_deg=seed.random(), albedo_percent=seed.random(), level_percent=seed.random())
        levels, clipped = (tuple(seed.random() for _ in range(4)) for _ in range(2))
        whole = replace(_facts(number, seed), levels=levels, clipped=clipped, change=change, misfit=misfit)
        return replace(whole, white=tuple(one + 0.0 for one in white), valid_share=seed.random(), ambient=seed.random())

    def taken_by(kept: list[InstantFacts] | KeptFacts) -> float:
        tracemalloc.start()
        for number in numbers:
            kept.append(filmed(number))
        taken = tracemalloc.get_traced_memory()[0] / len(numbers)
        tracemalloc.stop()
        return taken

    # the least of three: what a thread of another test allocates meanwhile counts too
    records, numbers_alone = taken_by([]), min(taken_by(KeptFacts()) for _ in range(3))
    assert records > RECORD_BYTES
    assert numbers_alone < MOST_BYTES
