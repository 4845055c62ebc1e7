"""What no common motion explains, while a shutter is open: shadows that go their own ways under every light, behind
what stands before them; against the mean of many pictures in between."""

import functools
from fractions import Fraction

import cv2
import numpy as np
import pytest

from psvideo.model.arrays import Image
from psvideo.plates.align.comb import Comb, Schedule
from psvideo.plates.align.open_shutter import with_open_shutter
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of

ROWS, COLS, LIGHTS = 96, 128, ("l0", "l1", "l2")
PITCH_S = 1 / 120
WAYS_PX = ((3.0, 0.0), (-1.5, 2.6), (-1.5, -2.6))
"""How far every light's shadows go from round to round, right and down."""
POST_PX, POSTS_PX = 2, 9
"""A fence: posts so wide, and so far from each other."""
ROUND_S = len(LIGHTS) * PITCH_S
OPEN_S = 0.5 / 24
FENCE = np.broadcast_to(np.arange(COLS) % POSTS_PX < POST_PX, (ROWS, COLS))
INNER = np.s_[12:-12, 12:-12]


def shadows(light: int) -> Image:
    """Soft blots of shadow, their pattern larger than the picture."""
    rng = np.random.default_rng(light)
    soft = cv2.GaussianBlur(rng.normal(0, 1, (ROWS + 80, COLS + 80)).astype(np.float32), (0, 0), 2.5)
    return np.asarray(0.35 + 0.25 * np.tanh(3 * soft / soft.std()), np.float32)


def shown(light: int, time_s: float) -> Image:
    """The light's shadows on a wall, seen through the fence."""
    across, down = (way * time_s / ROUND_S for way in WAYS_PX[light])
    moved = cv2.warpAffine(shadows(light), np.array([[1, 0, across - 40], [0, 1, down - 40]]), (COLS, ROWS))
    return np.asarray(np.where(FENCE, np.float32(0.7), moved), np.float32)


def plates() -> list[LightPlate]:
    """Three rounds, the middle one about 0 s."""
    made = []
    for number, light in np.ndindex(3, 3):
        time_s = PITCH_S * (3 * number + light - 4)
        image, seen = shown(light, time_s), np.ones(ROWS, np.bool_)
        made.append(LightPlate(light=LIGHTS[light], number=number, time_s=time_s, picture=mixture_of(image), seen=seen))
    return made


def opened(given: list[LightPlate]) -> tuple[LightPlate, ...]:
    """What a shutter shows that is open about 0 s."""
    comb = Comb(fps=Fraction(24), first_s=0.0, open_s=OPEN_S)
    times_s = comb.samples_s(0)
    by_round = {1: tuple((1001, time_s) for time_s in times_s)}
    how = Aligning(rate=comb)
    due = Schedule(by_round=by_round, left_out=(0, 0, 0), rounds=1)
    (one,) = with_open_shutter(aligned(given, LIGHTS, how, first=1001, schedule=due))
    return one.open_plates


@functools.cache
def opened_whole() -> tuple[LightPlate, ...]:
    """The same of whole plates."""
    return opened(plates())


def faded(given: list[LightPlate], light: int) -> Image:
    """The mean of pictures between flashes, each a fade from one flash to the next."""
    own = [plate for plate in given if plate.light == LIGHTS[light]]
    total = np.zeros((ROWS, COLS), np.float32)
    for time_s in Comb(fps=Fraction(24), first_s=0.0, open_s=OPEN_S).samples_s(0):
        shares = np.maximum(0, 1 - np.abs([plate.time_s - time_s for plate in own]) / ROUND_S)
        total += np.sum([share * plate.image for share, plate in zip(shares, own, strict=True)], axis=0)
    return np.asarray(total / 15, np.float32)


@pytest.mark.parametrize("light", range(3))
def test_shadows_that_go_their_own_ways_behind_a_fence_are_blurred_as_by_a_true_shutter(light: int) -> None:
    truth = np.mean([shown(light, OPEN_S * ((j + 0.5) / 30 - 0.5)) for j in range(30)], axis=0)
    image = opened_whole()[light].image
    off, off_faded = (np.sqrt(np.mean((one - truth)[INNER] ** 2)) for one in (image, faded(plates(), light)))
    assert off < 0.75 * off_faded
    fence = FENCE.copy()
    fence[:12], fence[-12:] = False, False
    assert np.abs(image - truth)[fence].mean() < 0.01


def test_what_one_plate_lacks_is_not_drawn_into_what_is_blurred() -> None:
    """Rows that no frame saw are black in the plate; what lies beside them shows nothing of that."""
    torn = plates()
    seen = np.ones(ROWS, np.bool_)
    seen[40:48] = False
    for place, plate in enumerate(plates()):
        if plate.number == 2:
            image = np.where(seen[:, None], plate.image, np.float32(0))
            torn[place] = LightPlate(
                light=plate.light, number=2, time_s=plate.time_s, picture=mixture_of(image), seen=seen
            )
    for one, other in zip(opened(torn), opened_whole(), strict=True):
        beside = np.r_[28:36, 52:60]
        assert np.abs(one.image - other.image)[beside].max() < 0.2
        assert np.abs(one.image - other.image)[beside].mean() < 0.01
