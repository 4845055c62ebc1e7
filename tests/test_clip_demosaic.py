"""Demosaicing: as the paper says, measured samples kept, linear; and a real mosaic looks like its scene."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from psvideo.clip import demosaic
from psvideo.errors import PsvideoError
from psvideo.model.camera import CFA_PATTERNS


def mosaic_of(colour: NDArray[np.float32], cfa: str) -> NDArray[np.float32]:
    """Keep of every pixel the channel that its filter lets through."""
    rows, cols = np.indices(colour.shape[:2])
    channel = np.array(["RGB".index(name) for name in cfa])[2 * (rows % 2) + cols % 2]
    return np.take_along_axis(colour, channel[..., None], axis=2)[..., 0]


def by_hand(image: NDArray[np.float32], cfa: str, row: int, col: int) -> list[float]:
    """Equations 1 to 4 and 6 of the paper at one pixel: the neighbours' mean plus the weighted Laplacian."""

    def at(down: int, right: int) -> float:
        return float(image[row + down, col + right])

    here = cfa[2 * (row % 2) + col % 2]
    beside = cfa[2 * (row % 2) + (col + 1) % 2]
    centre = at(0, 0)
    cross = [at(-1, 0), at(1, 0), at(0, -1), at(0, 1)]
    diagonal = [at(-1, -1), at(-1, 1), at(1, -1), at(1, 1)]
    far_across, far_down = at(0, -2) + at(0, 2), at(-2, 0) + at(2, 0)
    if here != "G":
        green = sum(cross) / 4 + (centre - (far_across + far_down) / 4) / 2
        other = sum(diagonal) / 4 + 3 / 4 * (centre - (far_across + far_down) / 4)
        found = {here: centre, "G": green, "RB"["BR".index(here)]: other}
    else:
        spread = 5 * centre - sum(diagonal)
        across = (at(0, -1) + at(0, 1)) / 2 + (spread - far_across + far_down / 2) / 8
        down = (at(-1, 0) + at(1, 0)) / 2 + (spread - far_down + far_across / 2) / 8
        found = {"G": centre, beside: across, "RB"["BR".index(beside)]: down}
    return [found[name] for name in "RGB"]


@pytest.mark.parametrize("cfa", CFA_PATTERNS)
def test_every_pixel_agrees_with_the_papers_equations(cfa: str) -> None:
    image = np.random.default_rng(5).uniform(0, 1, (9, 10)).astype(np.float32)
    colour = demosaic(image, cfa)
    for row in range(2, 7):
        for col in range(2, 8):
            assert colour[row, col].tolist() == pytest.approx(by_hand(image, cfa, row, col), abs=1e-5)


@given(seed=st.integers(0, 1000), cfa=st.sampled_from(CFA_PATTERNS), rows=st.integers(4, 13), cols=st.integers(4, 13))
def test_measured_samples_are_kept_exactly(seed: int, cfa: str, rows: int, cols: int) -> None:
    image = np.random.default_rng(seed).uniform(-0.1, 2, (rows, cols)).astype(np.float32)
    assert np.array_equal(mosaic_of(demosaic(image, cfa), cfa), image)


@pytest.mark.parametrize("cfa", CFA_PATTERNS)
def test_even_grey_is_exact_to_the_border(cfa: str) -> None:
    assert np.abs(demosaic(np.full((8, 9), 0.4, np.float32), cfa) - 0.4).max() < 1e-6


@pytest.mark.parametrize("cfa", CFA_PATTERNS)
@pytest.mark.parametrize("shape", [(3, 3), (3, 9), (7, 4), (150, 5)])
def test_the_border_is_as_if_the_picture_were_mirrored_about_its_outermost_pixels(
    cfa: str, shape: tuple[int, int]
) -> None:
    image = np.random.default_rng(7).uniform(0, 1, shape).astype(np.float32)
    wider = demosaic(np.pad(image, 2, mode="reflect"), cfa)[2:-2, 2:-2]
    assert np.array_equal(demosaic(image, cfa), wider)


def test_a_mosaic_of_one_pixel_or_row_is_no_fault() -> None:
    for shape in ((1, 1), (1, 6), (2, 1)):
        colour = demosaic(np.full(shape, 0.5, np.float32), "GBRG")
        assert colour.shape == (*shape, 3)
        assert np.isfinite(colour).all()


@given(seed=st.integers(0, 1000), cfa=st.sampled_from(CFA_PATTERNS))
def test_sums_of_mosaics_demosaic_to_sums(seed: int, cfa: str) -> None:
    """This is why plates may be split in the mosaic."""
    first, second = np.random.default_rng(seed).uniform(0, 1, (2, 8, 8)).astype(np.float32)
    together = demosaic(first + 3 * second, cfa)
    assert np.allclose(together, demosaic(first, cfa) + 3 * demosaic(second, cfa), atol=1e-5)


def test_other_patterns_are_refused() -> None:
    with pytest.raises(PsvideoError, match="'RGBW' cannot be demosaiced; expected one of RGGB"):
        demosaic(np.zeros((4, 4), np.float32), "RGBW")


def test_a_rose_is_red_and_smooth_under_its_own_pattern_only(shared_data: Path) -> None:
    """In another phase, red and blue samples pass for green and leave a checkerboard on the petals."""
    codes = np.fromfile(shared_data / "raw" / "DSC_1339_768x512_rggb.raw", "<u2").reshape(512, 768)
    light = ((codes - 600.0) / 14920).astype(np.float32)

    def petal(cfa: str) -> NDArray[np.float32]:
        return demosaic(light, cfa)[330:480, 160:250]

    def checkerboard(cfa: str) -> float:
        return float(np.abs(np.diff(petal(cfa)[..., 1], axis=1)).mean())

    assert checkerboard("RGGB") < 0.3 * min(checkerboard("GRBG"), checkerboard("GBRG"))
    red, green, blue = petal("RGGB").mean(axis=(0, 1)) * [1.949, 1.0, 1.344]
    assert red > 2 * max(green, blue)
