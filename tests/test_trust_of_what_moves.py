"""What plates show without alignment is trusted with it as well, where that is right: nothing is lost to caution."""

import functools

import numpy as np
import pytest
from bench.accuracy_measure import angles_deg
from bench.accuracy_motion import ASLANT, BOX, BUST, UNALIGNED, Filmed, filmed, turn

from psvideo.model.surface import Surface
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving

BARE_BALL = {"mesh": "sphere", "height_m": 0.4, "albedo": 0.6}
RIGHT_DEG, FAR_OFF_DEG = 5.0, 10.0
NOISE = 0.002


def judged(clip: Filmed, how: Aligning) -> tuple[Surface, np.ndarray]:
    """Return the surface of the second round, and by how much its normals are off."""
    one = clip.shown(how)[1]
    seen = np.stack([plate.pixels_seen for plate in one.plates])
    moves = None if one.motion is None else one.motion.moves
    images = [plate.image for plate in one.plates]
    surface = Solving(error=True).solve(images, clip.lit, seen=seen, unsure=one.unsure, moves=moves)
    return surface, angles_deg(surface.normals, clip.truth(one.time_s)[0])


@pytest.mark.parametrize(
    ("subject", "px", "most_lost"),
    [
        pytest.param(BARE_BALL, 4, 0.01, id="a bare ball that spins in its place"),
        pytest.param(BOX, 4, 0.06, id="a bare box that tumbles by 4 px", marks=pytest.mark.campaign),
        pytest.param(BOX | {"albedo": 0.3}, 2, 0.07, id="a dark box that tumbles by 2 px", marks=pytest.mark.campaign),
    ],
)
def test_five_lights_whose_plates_one_normal_explains_are_trusted(
    subject: dict[str, object], px: float, most_lost: float
) -> None:
    clip = filmed(5, turn(px, ASLANT), noise=NOISE, subject=subject)
    (plain, plain_deg), (aligned, off_deg) = judged(clip, UNALIGNED), judged(clip, Aligning())
    subject_seen = clip.truth(clip.shown(UNALIGNED)[1].time_s)[1]
    lost = subject_seen & plain.valid & (plain_deg < RIGHT_DEG) & ~aligned.valid
    assert lost.sum() < most_lost * subject_seen.sum()
    trusted = subject_seen & aligned.valid
    assert aligned.error_deg is not None
    assert (trusted & (off_deg > FAR_OFF_DEG)).sum() < 0.03 * trusted.sum()
    assert (off_deg[trusted] <= 2 * np.maximum(aligned.error_deg[trusted].astype(np.float32), 1e-3)).mean() > 0.9


@pytest.mark.campaign
@pytest.mark.parametrize(("subject", "px"), [(BOX, 8), (BUST, 16)], ids=["a bare box by 8 px", "a bust by 16 px"])
def test_what_tumbles_faster_than_can_be_followed_is_not_taken_for_clay(subject: dict[str, object], px: float) -> None:
    clip = filmed(5, turn(px, ASLANT), noise=NOISE, subject=subject)
    (plain, plain_deg), (aligned, off_deg) = judged(clip, UNALIGNED), judged(clip, Aligning())
    shown = clip.truth(clip.shown(UNALIGNED)[1].time_s)[1] & plain.shown & aligned.shown
    assert aligned.misfit is not None
    assert aligned.misfit.reflectance is None
    assert off_deg[shown].mean() < plain_deg[shown].mean() + 0.5


def test_what_moves_is_trusted_up_to_seven_degrees_and_what_stands_up_to_five() -> None:
    clip = filmed(5, turn(4, ASLANT), noise=NOISE, subject=BUST)
    surface, off_deg = judged(clip, Aligning())
    motion = clip.shown(Aligning())[1].motion
    assert motion is not None
    assert motion.step == 1
    assert surface.error_deg is not None
    error = surface.error_deg.astype(np.float32)
    trusted = (error > 0) & (error <= np.where(motion.moves, np.float32(7), np.float32(5)))
    assert np.array_equal(surface.valid, trusted)
    more = surface.valid & (error > 5)
    assert more.sum() > 200
    assert off_deg[more].mean() < 7.0
    assert (off_deg[surface.valid & motion.moves] > FAR_OFF_DEG).mean() < 0.03


PITCH_S, WAVE_PX, WAVE_PER_S, HEIGHT_PX = 0.01, 60.0, 9.0, 8.0
DIRECTIONS = np.array([[0.61, 0.19, 0.766], [-0.47, 0.43, 0.766], [-0.14, -0.63, 0.766]])


@functools.cache
def spots(shape: tuple[int, int]) -> np.ndarray:
    """An albedo that varies as skin does, by a tenth."""
    rng, (rows, cols) = np.random.default_rng(8), np.mgrid[: shape[0], : shape[1]]
    waves = (np.cos(x * cols + y * rows + turn) for x, y, turn in rng.normal(0, (0.2, 0.2, 3), (12, 3)))
    return np.asarray(0.6 + 0.02 * sum(waves), np.float64)


def waving(time_s: float, shape: tuple[int, int] = (128, 160)) -> np.ndarray:
    """The normals of a sheet that fills the picture, at a time: waves run along it."""
    rows, cols = np.mgrid[: shape[0], : shape[1]]
    per_px = 2 * np.pi / WAVE_PX
    along = HEIGHT_PX * per_px * np.cos(per_px * (cols - 0.35 * rows) - WAVE_PER_S * time_s)
    across = 0.5 * HEIGHT_PX * per_px * np.cos(per_px * rows * 1.3 + 0.7 * WAVE_PER_S * time_s)
    normals = np.stack([-along, -0.35 * along + across, np.ones(shape)], axis=-1)
    return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True), np.float64)


def test_a_sheet_in_waves_is_trusted_as_without_alignment_and_its_normals_are_better() -> None:
    """Waves fall off otherwise under every light, which is no edge that only one of them shows."""
    names, rng, plates = ("key", "left", "right"), np.random.default_rng(2), []
    for number in (1, 2, 3):
        for n, (name, direction) in enumerate(zip(names, DIRECTIONS, strict=True)):
            time_s = (4 * (number - 2) + n - 1) * PITCH_S
            light = 0.9 * spots((128, 160)) * np.maximum(waving(time_s) @ direction, 0)
            picture = mixture_of(np.asarray(light + rng.normal(0, 0.003, light.shape), np.float32))
            seen = np.ones(len(light), np.bool_)
            plates.append(LightPlate(light=name, number=number, time_s=time_s, picture=picture, seen=seen))
    lit = Illumination(directions=DIRECTIONS, intensities=np.full((3, 1), 0.9), names=names)

    def shown(how: Aligning) -> tuple[float, float]:
        one = list(aligned(plates, names, how, first=1))[1]
        moves = None if one.motion is None else one.motion.moves
        surface = Solving(error=True).solve([p.image for p in one.plates], lit, unsure=one.unsure, moves=moves)
        off_deg = angles_deg(surface.normals, waving(0.0))
        return float((surface.valid & (off_deg < FAR_OFF_DEG)).mean()), float(off_deg[surface.shown].mean())

    (right, off_deg), (plain_right, plain_deg) = shown(Aligning()), shown(UNALIGNED)
    assert right > 0.95 * plain_right
    assert off_deg < 0.5 * plain_deg


TURNING_RAD_S, BOARD = 5.7, (slice(30, 98), slice(40, 120))
FIVE = np.array([[0, 0.6, 0.8], [-0.5706, 0.1854, 0.8], [-0.3527, -0.4854, 0.8], [0.3527, -0.4854, 0.8], [0, 0, 1.0]])


def turning(time_s: float, shape: tuple[int, int] = (128, 160)) -> np.ndarray:
    """The normals of a wall, and of a board before it that turns to the left about its own vertical."""
    angle = np.deg2rad(60) - TURNING_RAD_S * time_s
    normals = np.broadcast_to([0.0, 0.0, 1.0], (*shape, 3)).copy()
    normals[BOARD] = [-np.sin(angle), -0.3, np.cos(angle)]
    return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True), np.float64)


def of_board(how: Aligning) -> tuple[np.ndarray, np.ndarray]:
    """The fourth lamp's plate, before which it does not reach the board, and by how much normals are off."""
    names, rng, plates = tuple("abcde"), np.random.default_rng(5), []
    albedo = np.full((128, 160), 0.6)
    albedo *= 1 + 0.3 * np.sin(np.arange(160) / 2) * np.sin(np.arange(128) / 3)[:, None]
    albedo[BOARD] = 0.6
    for number in (1, 2, 3):
        for n, (name, direction) in enumerate(zip(names, FIVE, strict=True)):
            time_s = (6 * (number - 2) + n - 2) * PITCH_S
            light = 0.9 * albedo * np.maximum(turning(time_s) @ direction, 0)
            picture = mixture_of(np.asarray(light + rng.normal(0, NOISE, light.shape), np.float32))
            seen = np.ones(len(light), np.bool_)
            plates.append(LightPlate(light=name, number=number, time_s=time_s, picture=picture, seen=seen))
    lit = Illumination(directions=FIVE, intensities=np.full((5, 1), 0.9), names=names)
    one = list(aligned(plates, names, how, first=1))[1]
    moves = None if one.motion is None else one.motion.moves
    surface = Solving(error=True).solve([p.image for p in one.plates], lit, unsure=one.unsure, moves=moves)
    return one.plates[3].image, angles_deg(surface.normals, turning(0.0))


def test_a_bare_board_that_turns_out_of_a_lamps_shadow_is_as_bright_under_it_as_a_blend() -> None:
    """Before the instant the fourth lamp does not reach it, and the later plate is too bright by a fifth."""
    true = 0.54 * float(turning(0.0)[BOARD][0, 0] @ FIVE[3])
    (plate, off_deg), (plain, plain_deg) = of_board(Aligning()), of_board(UNALIGNED)
    light, nearest = float(plate[BOARD].mean()), float(plain[BOARD].mean())
    assert nearest > 1.2 * true
    assert true < light < true + 0.5 * (nearest - true)
    assert off_deg[BOARD].mean() < 0.4 * plain_deg[BOARD].mean()


def test_what_turns_is_blended_up_to_the_edge_of_its_face() -> None:
    """Beside its edge a wide window holds the wall as well, which did not change."""
    inner, beside = np.zeros((2, 128, 160), np.bool_)
    inner[40:88, 50:110] = True
    beside[33:95, 43:117] = True
    beside &= ~inner
    (_, off_deg), (_, plain_deg) = of_board(Aligning()), of_board(UNALIGNED)
    assert plain_deg[beside].mean() > 0.9 * plain_deg[inner].mean()
    assert off_deg[beside].mean() < 1.3 * off_deg[inner].mean()
