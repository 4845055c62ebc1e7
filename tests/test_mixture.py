"""Pictures that are made of rows of frames in their codes, against plain numpy."""

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from memory_frame import MemoryFrame

from psvideo.clip import in_file
from psvideo.clip.in_file import RowsInFile
from psvideo.errors import PsvideoError
from psvideo.model.camera import Camera
from psvideo.model.coded import Coded, Tone
from psvideo.model.plan import Plan
from psvideo.model.rows.clipping import SATURATED
from psvideo.model.rows.row_profiles import row_light
from psvideo.model.timing import Flash, Timing
from psvideo.plates.align.packed import packed
from psvideo.plates.ambient.ambient_level import AmbientLevel
from psvideo.plates.mixing import ready_mixture
from psvideo.plates.mixing.mixture import Mixture, mixture_of
from psvideo.plates.mixing.several_pictures import combined
from psvideo.plates.split import split

ROWS, COLS = 46, 38
CURVE = (np.linspace(0, 1, 65536) ** 2.2).astype(np.float32)
HALVES = np.arange(65536, dtype=np.uint16).view(np.float16).astype(np.float32)
TONES: dict[str, tuple[Any, Tone]] = {
    "8 bits": (np.uint8, Tone(gain=np.full((1, 1), 1 / 255))),
    "12 bits of 16": (np.uint16, Tone(zero=np.full((1, 1), 64.0), gain=np.full((1, 1), 1 / 4031), most=4095.0)),
    "curve": (np.uint16, Tone(table=CURVE)),
    "half floats": (np.uint16, Tone(table=HALVES)),
    "half floats as they are": (np.uint16, Tone(table=HALVES, halves=True)),
    "mosaic": (np.uint16, Tone(zero=np.array([[500.0, 510.0], [490.0, 505.0]]), gain=np.full((2, 2), 1 / 60000))),
    "mosaic under a curve": (np.uint16, Tone(table=CURVE, zero=np.array([[0.01, 0.02]]), gain=np.array([[1.1, 1.2]]))),
    "light": (np.float32, Tone()),
}


MOST = {"half floats": 0x3C40, "half floats as they are": 0x3C40, "12 bits of 16": 4200, "8 bits": 255}


def codes_of(name: str, rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    if name == "light":
        return rng.uniform(-0.05, 1.1, shape).astype(np.float32)
    return rng.integers(0, MOST.get(name, 65535), shape, endpoint=True).astype(TONES[name][0])


def shot(name: str, *, frames: int = 3, seed: int = 0) -> Mixture:
    rng = np.random.default_rng(seed)
    shape = (ROWS, COLS) if "mosaic" in name else (ROWS, COLS, 3)
    pictures = [Coded(codes=codes_of(name, rng, shape), tone=TONES[name][1]) for _ in range(frames)]
    coefficients = rng.uniform(0.03, 1.2, (frames, ROWS)) * (rng.random((frames, ROWS)) > 0.4)
    coefficients[:, 7] = 0.0
    light = tuple(AmbientLevel.of(rng.uniform(-0.01, 0.1, shape).astype(np.float32)) for _ in range(2))
    taken = rng.uniform(0, 2, (2, ROWS))
    return Mixture(frames=tuple(pictures), coefficients=coefficients, levels=light, taken=taken)


def in_numpy(picture: Mixture) -> tuple[np.ndarray, np.ndarray]:
    """The picture by its definition in 64 bits, and where a sample that counts is clipped."""
    by_row = (slice(None), *[None] * (len(picture.shape) - 1))
    lights = [frame.light().astype(np.float64) for frame in picture.frames]
    total = sum(takes[by_row] * light for takes, light in zip(picture.coefficients, lights, strict=True))
    clipped = np.any(
        [
            (light >= np.float32(SATURATED)) & (takes > 0.02 * picture.coefficients.max(axis=0))[by_row]
            for takes, light in zip(picture.coefficients, lights, strict=True)
        ],
        axis=0,
    )
    assert picture.taken is not None
    for takes, level in zip(picture.taken, picture.levels, strict=True):
        total = total - takes[by_row] * level.coded.light()
    total[~picture.coefficients.any(axis=0)] = 0
    return np.where(clipped, 1.0, total), clipped


@pytest.mark.parametrize("name", TONES)
def test_the_kernel_does_what_numpy_does_to_rounding(name: str) -> None:
    picture = shot(name)
    expected, clipped = in_numpy(picture)
    image = picture.image()
    assert np.abs(image - expected).max() < 3e-6
    assert clipped.any()
    assert (image[clipped] == 1.0).all()
    assert (picture.clipped() == clipped).all()
    assert not image[7].any(), "no frame saw this row"


@pytest.mark.parametrize("name", ["8 bits", "12 bits of 16", "curve", "mosaic"])
def test_a_clipped_sample_counts_as_much_in_a_plate_out_of_a_hundred_flashes(name: str) -> None:
    one = shot(name)
    small = replace(one, coefficients=0.01 * one.coefficients)
    assert (small.clipped() == one.clipped()).all()
    assert (small.image()[one.clipped()] == 1.0).all()


@pytest.mark.parametrize("name", TONES)
def test_parts_of_a_picture_are_those_of_the_whole(name: str) -> None:
    picture = shot(name, seed=1)
    image = picture.image()
    assert np.array_equal(picture.rows(range(3, 40, 5)), image[3:40:5])
    assert np.array_equal(picture.rows(np.array([9, 2, 30])), image[[9, 2, 30]])
    assert np.array_equal(picture.thinned(4), image[::4, ::4])
    assert np.array_equal(picture.channel(1, range(0, 38, 5)), image[:38:5] if image.ndim == 2 else image[:38:5, :, 1])
    assert np.array_equal(picture.reader()(5, 12), image[5:12])
    grey = image.reshape(ROWS // 2, 2, COLS // 2, 2, -1).mean(axis=(1, 3, 4))
    assert np.abs(picture.halved() - grey).max() < 1e-6


@pytest.mark.parametrize("name", TONES)
def test_small_pictures_of_what_is_not_clipped_are_means_too(name: str) -> None:
    picture = shot(name, seed=3)
    dim = tuple(replace(frame, codes=np.asarray(frame.codes) // 2) for frame in picture.frames)
    picture = replace(picture, frames=dim)
    image = picture.image()
    assert not picture.clipped().any()
    grey = image.reshape(ROWS // 2, 2, COLS // 2, 2, -1).mean(axis=(1, 3, 4))
    assert np.abs(picture.halved() - grey).max() < 2e-6


def left_in_files(picture: Mixture, folder: Path, *, stays_open: bool = True) -> Mixture:
    """The same picture of frames that lie in files, behind some bytes of something else."""
    frames = []
    for place, frame in enumerate(picture.frames):
        codes = np.asarray(frame.codes)
        path = folder / f"{place}.codes"
        path.write_bytes(b"before" + codes.tobytes())
        found = RowsInFile.at(path, 6, codes.dtype, codes.shape, stays_open=stays_open)
        frames.append(replace(frame, codes=found))
    return replace(picture, frames=tuple(frames))


@pytest.mark.parametrize("how", ["by the loop", "before it", "opened for each"])
@pytest.mark.parametrize("name", TONES)
def test_frames_in_files_give_the_same_picture(
    name: str, how: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if how == "before it":
        monkeypatch.setattr(ready_mixture, "READER", 0)
    held = shot(name, seed=2)
    there = left_in_files(held, tmp_path, stays_open=how != "opened for each")
    assert np.array_equal(there.image(), held.image())
    assert np.array_equal(there.rows(np.array([9, 2, 30])), held.rows(np.array([9, 2, 30])))
    assert np.array_equal(there.thinned(4), held.thinned(4))
    assert np.array_equal(there.channel(1, range(0, 38, 5)), held.channel(1, range(0, 38, 5)))
    assert np.array_equal(there.halved(), held.halved())


def test_a_file_that_is_cut_short_while_a_loop_reads_it_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(in_file, "LOOKED_AT_EACH_S", 60.0)
    picture = left_in_files(shot("12 bits of 16"), tmp_path)
    picture.image()
    os.truncate(tmp_path / "1.codes", 5000)
    with pytest.raises(PsvideoError, match=r"1\.codes: was changed while it was worked on"):
        picture.image()


def test_ambient_light_in_16_bits_is_good_to_half_a_step_of_its_row() -> None:
    light = np.random.default_rng(4).uniform(-0.002, 0.03, (ROWS, COLS, 3)).astype(np.float32)
    light[3] = 0.25
    level = AmbientLevel.of(light)
    off = np.abs(level.coded.light() - light).reshape(ROWS, -1).max(axis=1)
    assert (off <= 0.51 * np.ptp(light.reshape(ROWS, -1), axis=1) / 65535 + 3e-8).all()
    narrow = light.reshape(ROWS, COLS // 2, -1).mean(axis=-1)
    assert np.abs(level.narrow - narrow).max() < 1e-7


@pytest.mark.parametrize("name", TONES)
def test_light_of_codes_is_what_their_tone_says(name: str) -> None:
    kind, tone = TONES[name]
    codes = np.asarray(shot(name, seed=2).frames[0].codes)
    signal = tone.table[codes] if tone.table.size else np.minimum(codes.astype(np.float64), tone.most)
    row, col = np.mgrid[0:ROWS, 0:COLS] if codes.ndim == 2 else (np.zeros((1, 1, 1), int), np.zeros((1, 1, 1), int))
    rows, cols = tone.zero.shape
    light = (signal - tone.zero[row % rows, col % cols]) * tone.gain[row % rows, col % cols]
    picture = Coded(codes=codes, tone=tone)
    assert picture.codes.dtype == kind
    assert np.abs(picture.light() - light).max() < 1e-6
    assert np.array_equal(picture.light(slice(3, 9)), picture.light()[3:9])
    mean, clipped = row_light(picture)
    assert np.abs(mean - light.reshape(ROWS, -1).mean(axis=1)).max() < 1e-6
    assert clipped == pytest.approx((picture.light() >= np.float32(SATURATED)).reshape(ROWS, -1).mean(axis=1))


@given(black=st.integers(0, 400), seed=st.integers(0, 99))
@settings(max_examples=20, deadline=None)
def test_a_black_level_cancels(black: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    codes, takes = rng.integers(0, 60_000, (2, 12, 20)), rng.uniform(0, 1, (2, 12))

    def picture(level: int) -> np.ndarray:
        tone = Tone(zero=np.full((1, 1), float(level)), gain=np.full((1, 1), 1 / 65_000))
        frames = tuple(Coded(codes=(one + level).astype(np.uint16), tone=tone) for one in codes)
        return Mixture(frames=frames, coefficients=takes).image()

    assert np.array_equal(picture(black), picture(0))


def test_what_is_combined_is_the_sum_of_its_parts_and_the_frames_are_shared() -> None:
    one, other = shot("curve"), shot("curve", seed=3)
    other = Mixture(frames=one.frames[1:], coefficients=other.coefficients[1:], levels=other.levels, taken=other.taken)
    both = combined([one, other], [0.5, -2.0], ceiling=2.5)
    assert len(both.frames) == 3
    clipped = one.clipped() | other.clipped()
    assert np.abs((both.image() - (0.5 * one.image() - 2 * other.image()))[~clipped]).max() < 5e-6
    assert (both.image()[clipped] == 2.5).mean() > 0.99, "but where the shares of a clipped sample cancel"


def test_a_picture_in_memory_is_handed_out_as_it_is() -> None:
    image = np.random.default_rng(0).random((6, 8, 3), np.float32) * 3
    picture = mixture_of(image)
    assert picture.image() is image
    assert packed(shot("8 bits"), 1.0).frames[0].codes.dtype == np.uint8, "what its frames hold is not packed"
    doubled = combined([picture], [2.0], ceiling=4.0)
    assert np.array_equal(doubled.image(), np.where(image >= 1, np.float32(4), 2 * image))


def test_plates_of_codes_are_those_of_their_light(make_plan: Callable[..., Plan]) -> None:
    """Split takes codes as they were read: the same plates as from frames in light, to rounding."""
    plan = make_plan(width_px=40, height_px=32)
    rng = np.random.default_rng(4)
    tone = Tone(zero=np.full((1, 1), 200.0), gain=np.full((1, 1), 1 / 4000))
    codes = [rng.integers(150, 4100, (32, 40)).astype(np.uint16) for _ in range(6)]
    coded = [MemoryFrame(n, one, tone) for n, one in enumerate(codes)]
    light = [MemoryFrame(n, Coded(codes=one, tone=tone).light()) for n, one in enumerate(codes)]
    timing = flashes_of(plan.camera)
    for of_codes, of_light in zip(split(coded, plan.camera, timing), split(light, plan.camera, timing), strict=True):
        assert np.abs(of_codes.image - of_light.image).max() < 1e-6
        assert np.array_equal(of_codes.seen, of_light.seen)


def flashes_of(camera: Camera) -> Timing:
    gap_s = 1.1 * camera.frame_period_s
    return Timing(
        clip="clip",
        frame_period_s=camera.frame_period_s,
        exposure_s=camera.exposure_s,
        row_time_s=camera.row_time_s,
        clock_offset_ppm=0.0,
        phase_error_rows=0.0,
        order="marker",
        flashes=tuple(
            Flash(index=n, slot=0, lights={"key": 1.0}, start_s=0.004 + n * gap_s, duration_s=8e-4, complete=True)
            for n in range(3)
        ),
    )
