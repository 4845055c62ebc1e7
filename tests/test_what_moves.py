"""What moves is judged by itself: a wall that stands still hides how little of a subject came out."""

import numpy as np
import pytest

from psvideo.model.surface import Surface
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.report.judge.of_what_moves import what_moves
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.observed import Observed

SIZE, SQUARE = 192, 64
STEP = 48
"""How far the square goes from round to round, in pixels: where it was, the wall has come out."""


def _left(number: int) -> int:
    return 16 + STEP * number


def _plate(number: int) -> LightPlate:
    image = np.full((SIZE, SIZE), 0.3, np.float32)
    paint = np.random.default_rng(1).uniform(0.1, 0.9, (SQUARE // 8, SQUARE // 8)).repeat(8, 0).repeat(8, 1)
    image[64 : 64 + SQUARE, _left(number) : _left(number) + SQUARE] = paint
    return LightPlate(
        light="a", number=number, time_s=float(number), picture=mixture_of(image), seen=np.ones(SIZE, np.bool_)
    )


def _surface(number: int, trusted: float) -> Surface:
    """Everything is trusted but a part of the square."""
    valid = np.ones((SIZE, SIZE), np.bool_)
    lost = round(SQUARE * (1 - trusted))
    valid[64 : 64 + lost, _left(number) : _left(number) + SQUARE] = False
    normals = np.zeros((SIZE, SIZE, 3), np.float32)
    normals[..., 2] = 1
    return Surface(
        normals=normals,
        albedo=np.full((SIZE, SIZE), 0.5, np.float32),
        valid=valid,
        source=np.ones((SIZE, SIZE), np.uint8),
    )


def _shares(trusted: float, *, ahead: bool) -> list[float | None]:
    """Return what is trusted of what moves in three rounds, each noted when the plate after it was seen as well, as
    alignment does, or before that."""
    one = Observed(lights=("a",))
    if ahead:
        one.look(_plate(0))
    for number in range(3):
        if not ahead:
            one.look(_plate(number))
        elif number < 2:
            one.look(_plate(number + 1))
        plate = _plate(number)
        one.add(Round(number=number, plates=(plate,)), _surface(number, trusted))
    return [facts.moving_valid_share for facts in one.facts]


def test_what_is_trusted_of_what_moves_is_counted_there_and_not_over_the_wall() -> None:
    """Borders are blurred by a few pixels; before the next plate was seen, what came out from behind counts too."""
    middle = _shares(0.25, ahead=True)[1]
    assert middle == pytest.approx(0.25, abs=0.15)
    assert _shares(1.0, ahead=True)[1] == 1.0
    first, *others = _shares(0.25, ahead=False)
    assert first is None
    assert all(share is not None and 0.25 < share < 0.75 for share in others)


def _facts(moving: float | None, valid: float = 0.9) -> InstantFacts:
    return InstantFacts(
        number=1001, time_s=0.0, valid_share=valid, clipped_share=0.0, unseen_share=0.0, moving_valid_share=moving
    )


def _grade(moving: float | None, *, aligned: bool = True) -> str:
    lines = list(what_moves([_facts(moving)] * 4, aligned=aligned))
    return lines[0].grade if lines else "nothing"


def test_a_subject_that_is_lost_before_a_wall_that_is_trusted_is_said() -> None:
    assert [_grade(share) for share in (0.62, 0.58, 0.22, 0.18)] == ["good", "doubtful", "doubtful", "bad"]
    assert _grade(0.18, aligned=False) == "bad"
    assert [_grade(None), _grade(0.9, aligned=False)] == ["nothing", "nothing"]


def test_what_only_passes_by_is_not_judged() -> None:
    assert not list(what_moves([_facts(0.0), *[_facts(None)] * 3], aligned=True))
