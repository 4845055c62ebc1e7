"""DNG: levels, linearization, crop and filter phase as the tags say, whatever the layout; and a camera's own file."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rawpy
import tifffile
from numpy.typing import NDArray

from psvideo.clip.decode.decoders import decode, read_header
from psvideo.clip.linear import linear_light
from psvideo.errors import PsvideoError
from psvideo.model.camera import Encoding
from psvideo.model.turn import EXIF

LOSSLESS_JPEG: dict[str, Any] = {"compression": 7, "compressionargs": {"lossless": True, "bitspersample": 16}}
Tag = tuple[int, str, int, object, bool]
RGGB = bytes([0, 1, 1, 2])


def write_dng(path: Path, codes: NDArray[Any], tags: Sequence[Tag] = (), cfa: bytes = RGGB, **layout: Any) -> None:
    mosaic = [(33421, "H", 2, (2, 2), True), (33422, "B", 4, tuple(cfa), True)]
    always = [(50706, "B", 4, (1, 4, 0, 0), True), (50708, "s", 0, "Test Camera", True)]
    photometric = 32803 if codes.ndim == 2 else 34892
    extra = [*always, *(mosaic if codes.ndim == 2 else ()), *tags]
    tifffile.imwrite(path, codes, photometric=photometric, extratags=extra, **layout)


def mosaic(rows: int = 64, cols: int = 96) -> NDArray[np.uint16]:
    return np.random.default_rng(3).integers(200, 16000, (rows, cols)).astype(np.uint16)


@pytest.mark.parametrize(
    "layout",
    [
        {},
        {"rowsperstrip": 8},
        {"tile": (32, 32)},
        LOSSLESS_JPEG | {"rowsperstrip": 64},
        LOSSLESS_JPEG | {"rowsperstrip": 16},
        LOSSLESS_JPEG | {"tile": (32, 32)},
        {"compression": "zlib", "tile": (32, 32)},
    ],
    ids=["plain", "strips", "tiles", "jpeg-one-strip", "jpeg-strips", "jpeg-tiles", "deflate"],
)
def test_every_layout_gives_the_same_pixels(tmp_path: Path, layout: dict[str, Any]) -> None:
    codes = mosaic()
    write_dng(tmp_path / "x.dng", codes, **layout)
    picture = decode("dng", tmp_path / "x.dng")
    assert np.array_equal(picture.codes, codes)
    assert picture.header == read_header("dng", tmp_path / "x.dng")
    assert (picture.header.cfa, picture.header.bits) == ("RGGB", 16)


def test_libraw_alone_would_lose_strips_of_lossless_jpeg(tmp_path: Path) -> None:
    """If this fails, LibRaw has been mended, and decoding by tifffile first is a matter of taste.

    LibRaw leaves the lost strips as the memory was: it runs in a process of its own, which never held the codes.
    """
    codes = mosaic()
    write_dng(tmp_path / "x.dng", codes, rowsperstrip=16, **LOSSLESS_JPEG)
    reading = "import rawpy, sys; sys.stdout.buffer.write(rawpy.imread(sys.argv[1]).raw_image.tobytes())"
    found = subprocess.run([sys.executable, "-c", reading, tmp_path / "x.dng"], capture_output=True, check=True).stdout
    pixels = np.frombuffer(found, np.uint16).reshape(codes.shape)
    assert np.array_equal(pixels[:16], codes[:16])
    assert not np.array_equal(pixels[16:], codes[16:])


@pytest.mark.parametrize(("row", "col"), [(0, 0), (0, 1), (1, 0), (1, 1)])
def test_crop_keeps_the_phase_of_filters_and_black_levels(tmp_path: Path, row: int, col: int) -> None:
    """Light is 0.5 under red, 0.25 under green and 0.125 under blue filters, over four different black levels."""
    rows, cols, top, left = 20, 30, 3, 5
    place = np.indices((rows, cols)) - np.array([top, left])[:, None, None]
    black = np.array([[100, 200], [300, 400]])[place[0] % 2, place[1] % 2]
    light = np.array([[0.5, 0.25], [0.25, 0.125]])[place[0] % 2, place[1] % 2]
    codes = np.rint(black + light * (4100 - black)).astype(np.uint16)
    tags = [
        (50829, "I", 4, (top, left, rows, cols), True),
        (50713, "H", 2, (2, 2), True),
        (50714, "I", 4, (100, 200, 300, 400), True),
        (50717, "I", 1, 4100, True),
        (50719, "I", 2, (col, row), True),
        (50720, "I", 2, (20, 12), True),
    ]
    write_dng(tmp_path / "x.dng", codes, tags)
    picture = decode("dng", tmp_path / "x.dng")
    head = picture.header
    assert (head.width_px, head.height_px) == (20, 12)
    assert np.array_equal(picture.codes, codes[top + row : top + row + 12, left + col : left + col + 20])
    measured = linear_light(picture, Encoding())
    expected = {"R": 0.5, "G": 0.25, "B": 0.125}
    for position, colour in enumerate(head.cfa or ""):
        assert np.allclose(measured[position // 2 :: 2, position % 2 :: 2], expected[colour], atol=2e-4)


def test_linearization_table_is_applied(tmp_path: Path) -> None:
    """A file of 8 bits holds 16 behind its table; codes beyond the table's end stand for its last value."""
    table = (np.arange(200) ** 2).astype(np.uint16)
    codes = (mosaic() % 256).astype(np.uint8)
    tags = [(50712, "H", 200, tuple(int(value) for value in table), True), (50717, "I", 1, 199**2, True)]
    write_dng(tmp_path / "x.dng", codes, tags)
    picture = decode("dng", tmp_path / "x.dng")
    assert np.array_equal(picture.codes, table[np.minimum(codes, 199)])
    assert picture.header == read_header("dng", tmp_path / "x.dng")
    assert linear_light(picture, Encoding()).max() == pytest.approx(1.0)


def test_the_plans_levels_override_the_files(tmp_path: Path) -> None:
    write_dng(tmp_path / "x.dng", np.full((8, 8), 1000, np.uint16), [(50714, "I", 1, 200, True)])
    picture = decode("dng", tmp_path / "x.dng")
    assert linear_light(picture, Encoding())[0, 0] == pytest.approx(800 / 65335)
    assert linear_light(picture, Encoding(black_level=500, white_level=1500))[0, 0] == pytest.approx(0.5)


def test_demosaiced_dng_has_three_channels(tmp_path: Path) -> None:
    codes = np.random.default_rng(0).integers(0, 65535, (9, 12, 3)).astype(np.uint16)
    write_dng(tmp_path / "x.dng", codes)
    picture = decode("dng", tmp_path / "x.dng")
    assert np.array_equal(picture.codes, codes)
    assert (picture.header.channels, picture.header.cfa) == (3, None)


def test_raw_picture_is_found_behind_a_thumbnail(tmp_path: Path) -> None:
    codes = mosaic()
    with tifffile.TiffWriter(tmp_path / "x.dng") as file:
        file.write(np.zeros((16, 24, 3), np.uint8), photometric="rgb", subifds=1, subfiletype=1)
        tags = [(33421, "H", 2, (2, 2), True), (33422, "B", 4, (2, 1, 1, 0), True)]
        file.write(codes, photometric=32803, extratags=tags)
    picture = decode("dng", tmp_path / "x.dng")
    assert np.array_equal(picture.codes, codes)
    assert picture.header.cfa == "BGGR"


@pytest.mark.parametrize("black", [np.array([[100, 300], [200, 400]]), np.full((2, 2), 100)], ids=["own", "alike"])
@pytest.mark.parametrize("kind", [np.uint16, np.float16, np.float32])
def test_every_place_of_a_mosaic_has_its_own_black(tmp_path: Path, kind: type, black: NDArray[np.int64]) -> None:
    codes: NDArray[Any] = np.random.default_rng(1).integers(500, 2000, (16, 24)).astype(kind)
    tags: list[Tag] = [(50713, "H", 2, (2, 2), True), (50714, "H", 4, tuple(map(int, black.ravel())), True)]
    write_dng(tmp_path / "x.dng", codes, [*tags, (50717, "H", 1, 4000, True)])
    zero = np.tile(black, (8, 12))
    light = linear_light(decode("dng", tmp_path / "x.dng"), Encoding())
    assert light == pytest.approx((codes.astype(np.float64) - zero) / (4000 - zero), abs=1e-6)


def test_a_colour_picture_whose_black_differs_from_place_to_place_is_refused(tmp_path: Path) -> None:
    tags: list[Tag] = [(50713, "H", 2, (1, 2), True), (50714, "H", 6, (100, 100, 100, 300, 300, 300), True)]
    write_dng(tmp_path / "x.dng", np.full((8, 12, 3), 500, np.uint16), tags)
    with pytest.raises(PsvideoError, match=r"x\.dng: is a colour picture whose black levels differ"):
        read_header("dng", tmp_path / "x.dng")


@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
def test_a_dng_that_asks_to_be_turned_is_turned(tmp_path: Path, orientation: int) -> None:
    with tifffile.TiffWriter(tmp_path / "x.dng") as file:
        turned = [(274, "H", 1, orientation, True)]
        file.write(np.zeros((16, 24, 3), np.uint8), photometric="rgb", subifds=1, subfiletype=1, extratags=turned)
        tags = [(33421, "H", 2, (2, 2), True), (33422, "B", 4, tuple(RGGB), True)]
        file.write(mosaic(), photometric=32803, extratags=tags)
    assert read_header("dng", tmp_path / "x.dng").turn == EXIF[orientation]


def test_cinema_dng_shows_its_time_code(tmp_path: Path) -> None:
    code = (0x23 | 0x40, 0x59, 0x34, 0x12, 0, 0, 0, 0)  # frames first, drop-frame flag set
    write_dng(tmp_path / "x.dng", mosaic(), [(51043, "B", 8, code, True)])
    assert read_header("dng", tmp_path / "x.dng").time_code == "12:34:59;23"


@pytest.mark.parametrize("layout", [{}, {"tile": (32, 32)}, LOSSLESS_JPEG | {"rowsperstrip": 16}])
@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.98])
def test_truncated_dng_is_refused_by_name(tmp_path: Path, layout: dict[str, Any], share: float) -> None:
    write_dng(tmp_path / "A001_0042.dng", mosaic(), **layout)
    data = (tmp_path / "A001_0042.dng").read_bytes()
    (tmp_path / "A001_0042.dng").write_bytes(data[: int(len(data) * share)])
    with pytest.raises(PsvideoError, match=r"A001_0042\.dng: .*(empty|truncated|raw picture)"):
        decode("dng", tmp_path / "A001_0042.dng")


def test_filters_other_than_bayers_are_refused(tmp_path: Path) -> None:
    write_dng(tmp_path / "x.dng", mosaic(), cfa=bytes([0, 0, 1, 2]))
    with pytest.raises(PsvideoError, match="not a Bayer pattern"):
        read_header("dng", tmp_path / "x.dng")


def test_a_cameras_file_agrees_with_libraw(shared_data: Path) -> None:
    file = shared_data / "raw" / "colorchart.dng"
    picture = decode("dng", file)
    with rawpy.imread(str(file)) as raw:
        assert np.array_equal(picture.codes, raw.raw_image_visible)
    head = picture.header
    assert (head.width_px, head.height_px, head.bits, head.cfa) == (1734, 1156, 14, "RGGB")
    assert (head.black, head.white) == (((2056.0,),), 15000.0)
    light = linear_light(picture, Encoding())
    assert -0.03 < light.min() < 0 < light.max() < 0.8
