"""Levels are no motion: what is clipped, coded, packed or differently exposed stays what it is where things move."""

from dataclasses import replace

import numpy as np
import pytest
from filmed_rounds import COLS, ROWS, at_once, brought, filmed, noiseless

from psvideo.plates.align.packed import packed
from psvideo.plates.align.velocity import flow
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round


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


def coded(plate: LightPlate, rng: np.random.Generator, *, moved_px: int = 0) -> LightPlate:
    """A plate as a codec leaves it: squares with texture are off by several codes, others by none, and no pixel differs
    from its neighbours by noise; a part of it moves."""
    root = np.sqrt(np.maximum(plate.image, 0))
    size = ROWS // 8 + 1, COLS // 8 + 1
    steps = rng.normal(0, 2 / 255, size) * (rng.random(size) < 0.6)
    root = root + np.kron(steps, np.ones((8, 8)))[:ROWS, :COLS].reshape(ROWS, COLS, *[1] * (root.ndim - 2))
    if moved_px:
        root[ROWS // 4 : ROWS // 2, : COLS // 4] = np.roll(root[ROWS // 4 : ROWS // 2], moved_px, axis=1)[
            :, : COLS // 4
        ]
    return replace(plate, picture=mixture_of(np.square(np.maximum(root, 0)).astype(np.float32)))


@pytest.mark.parametrize("moved_px", [0, 12])
def test_what_a_codec_leaves_of_a_standing_picture_stirs_nothing_and_what_moves_in_it_does(moved_px: int) -> None:
    """A standing subject in H.264 seemed to move here and there, and the class of every 20th of its pixels changed."""
    rng = np.random.default_rng(5)
    plate = noiseless(3, "at rest").rounds[0].plates[0]
    pair = coded(plate, rng), coded(plate, rng, moved_px=moved_px)
    white = flow.white_of(plate)
    found = flow.changes(*(flow.sketch_of(one, white=white, coded=True) for one in pair))
    assert found.moved.any(), "flow looks closer"
    assert found.stirred.any() == (moved_px > 0)
    plain = flow.changes(*(flow.sketch_of(one, white=white) for one in pair))
    np.testing.assert_array_equal(plain.stirred, plain.moved)


def times(gain: float, one: Round) -> Round:
    plates = (replace(plate, picture=mixture_of(plate.image * np.float32(gain))) for plate in one.plates)
    return replace(one, plates=tuple(plates))


@pytest.mark.parametrize("gain", [0.7, 1.02, 1.4])
def test_an_exposure_that_changes_from_round_to_round_is_no_motion(gain: float) -> None:
    clip = filmed(3, "at rest", 0.004)
    breathing = tuple(times(gain**n, one) for n, one in enumerate(clip.rounds))
    for given, shown in zip(breathing[1].plates, brought(clip, rounds=breathing)[1].plates, strict=True):
        assert shown.image is given.image


@pytest.mark.parametrize("gain", [0.85, 1.2])
def test_what_moves_while_the_exposure_changes_is_still_followed(gain: float) -> None:
    clip = filmed(3, "4 px", 0.004)
    breathing = tuple(times(gain**n, one) for n, one in enumerate(clip.rounds))
    time_s = clip.rounds[1].plates[1].time_s
    said = [clip.error_deg(clip.solved(brought(clip, rounds=rounds)[1]), time_s) for rounds in (None, breathing)]
    (_, share), (error_deg, share_breathing) = said
    assert share_breathing > 0.9 * share
    assert error_deg < 4.6


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
