"""Below 360 degrees: rows that a flash missed come from the nearest flash of the same light that they saw."""

from collections.abc import Iterator, Sequence
from fractions import Fraction

import numpy as np
import pytest

from psvideo.model.camera import Camera
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.nearest_rows import LATER, MOST_LATER, has_blind_time, with_nearest_rows

ROWS = 8


def plate(number: int, missing: Sequence[int], *, light: str = "key") -> LightPlate:
    """A plate whose rows show the number of their round."""
    seen = np.ones(ROWS, np.bool_)
    seen[list(missing)] = False
    image = np.where(seen[:, None], np.float32(number), np.float32(0)) * np.ones((1, 3), np.float32)
    return LightPlate(light=light, number=number, time_s=float(number), picture=mixture_of(image), seen=seen)


def test_whole_plates_pass_as_they_are_and_at_once() -> None:
    given: list[int] = []

    def coming() -> Iterator[LightPlate]:
        for number in range(1, 4):
            given.append(number)
            yield plate(number, ())

    for one in with_nearest_rows(coming()):
        assert given == list(range(1, one.number + 1))
        assert one.shown_s is None


@pytest.mark.parametrize(
    ("missing", "expected"),
    [
        ({2: [0, 1]}, {2: [1, 1, 2, 2, 2, 2, 2, 2]}),
        ({1: [0]}, {1: [2, 1, 1, 1, 1, 1, 1, 1]}),
        ({4: [7]}, {4: [4, 4, 4, 4, 4, 4, 4, 3]}),
        ({1: [3], 2: [3]}, {1: [1, 1, 1, 3, 1, 1, 1, 1], 2: [2, 2, 2, 3, 2, 2, 2, 2]}),
        ({3: [3], 4: [3]}, {3: [3, 3, 3, 2, 3, 3, 3, 3], 4: [4, 4, 4, 2, 4, 4, 4, 4]}),
    ],
    ids=["before and after alike", "at the start", "at the end", "two at the start", "two at the end"],
)
def test_a_missing_row_comes_from_the_nearest_round(
    missing: dict[int, list[int]], expected: dict[int, list[int]]
) -> None:
    plates = [plate(number, missing.get(number, ())) for number in range(1, 5)]
    found = list(with_nearest_rows(plates))
    assert [one.number for one in found] == [1, 2, 3, 4]
    for one in found:
        rows = expected.get(one.number, [one.number] * ROWS)
        assert one.image[:, 0].astype(int).tolist() == rows
        assert one.flashed_s.tolist() == rows
        assert one.seen.all()


def test_what_was_given_is_not_written_to() -> None:
    plates = [plate(1, [0]), plate(2, [1])]
    kept = [one.image.copy() for one in plates]
    list(with_nearest_rows(plates))
    for one, image in zip(plates, kept, strict=True):
        np.testing.assert_array_equal(one.image, image)


def test_lights_do_not_help_each_other() -> None:
    found = list(with_nearest_rows([plate(1, [2]), plate(1, (), light="left"), plate(2, [2])]))
    assert [one.seen[2] for one in found] == [False, True, False]


@pytest.mark.parametrize(("missing_first", "waits"), [([5], MOST_LATER), ([], LATER)])
def test_a_plate_waits_for_a_few_of_its_light_and_longer_at_the_start(missing_first: list[int], waits: int) -> None:
    given: list[int] = []

    def coming() -> Iterator[LightPlate]:
        for number in range(1, 20):
            given.append(number)
            yield plate(number, missing_first if number == 1 else [5])

    found = with_nearest_rows(coming())
    first = next(found) if missing_first else (next(found), next(found))[1]
    assert first.number == (1 if missing_first else 2)
    assert given[-1] == first.number + waits


def test_only_shutters_below_360_degrees_are_blind() -> None:
    def camera(exposure: float) -> Camera:
        return Camera(width_px=1, height_px=1, fps=Fraction(100), exposure_s=exposure * 0.01, readout_s=0.0)

    assert has_blind_time(camera(0.5))
    assert not has_blind_time(camera(1.0))
