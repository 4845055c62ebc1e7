"""Damaged and hostile files are read or refused with one paragraph that names them: no crash, no hang, no flood."""

import struct
import zlib
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import tifffile
from bench.hostile import Outcome, changed, outcomes
from bench.hostile_files import good_files

from psvideo.clip.decode.decoders import decode, read_header
from psvideo.errors import PsvideoError
from psvideo.formats.plan_toml import read_plan
from psvideo.formats.rig_toml import read_rig
from psvideo.formats.timing_json import read_timing

SUFFIXES = {"exr": ".exr", "tiff": ".tif", "png": ".png", "mp4": ".mp4", "raw": ".dng", "oiio": ".tif"}
"""By the beginning of a folder's name: the name of files there that have none of their own."""
READ = (".exr", ".tif", ".tiff", ".png", ".jpg", ".dng", ".dpx", ".mp4", ".mov", ".mkv", ".mxf")


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """A good file of every kind."""
    return good_files(tmp_path_factory.mktemp("good"))


def faults(found: list[Outcome]) -> list[str]:
    return [f"{one.path}: {one.fault}" for one in found if one.fault]


def test_good_files_are_read(good: list[Path]) -> None:
    found = list(outcomes(good))
    assert not faults(found)
    assert not [one.said for one in found if one.said.startswith("refused")]


def test_files_that_were_changed_at_random_do_no_harm(good: list[Path], tmp_path: Path) -> None:
    found = list(outcomes(islice(changed(good, tmp_path, seed=3), 12 * len(good))))
    assert not faults(found)
    assert sum(one.said.startswith("refused") for one in found) > len(found) // 3, "most changes are found"


def test_damaged_files_from_other_projects_do_no_harm(shared_data: Path, tmp_path: Path) -> None:
    files = sorted(path for path in (shared_data / "corrupt").rglob("*") if path.is_file() and path.suffix != ".md")
    named = []
    for number, path in enumerate(files):
        suffix = path.suffix.lower()
        if suffix not in READ:
            folder = path.relative_to(shared_data / "corrupt").parts[0]
            suffix = SUFFIXES[folder.partition("_")[0].partition("-")[0]]
        link = tmp_path / f"{number:04d}{suffix}"
        link.symlink_to(path)
        named.append(link)
    assert len(named) > 500
    assert not faults(list(outcomes(named)))


def test_the_png_suite_is_read_but_for_its_broken_files(shared_data: Path) -> None:
    files = sorted((shared_data / "corrupt" / "png_pngsuite").glob("*.png"))
    read = {one.path.name for one in outcomes(files) if not one.said.startswith("refused") and not one.fault}
    assert read == {path.name for path in files if not path.name.startswith("x")}


def png_that_says(width_px: int, height_px: int) -> bytes:
    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = struct.pack(">IIBBBBB", width_px, height_px, 16, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(bytes(64))) + chunk(b"IEND", b"")


@pytest.mark.parametrize("size", [(60000, 60000), (0, 15)])
def test_a_picture_of_an_impossible_size_is_refused_before_it_is_decoded(size: tuple[int, int], tmp_path: Path) -> None:
    path = tmp_path / "bomb.png"
    path.write_bytes(png_that_says(*size))
    for read in (read_header, decode):
        with pytest.raises(PsvideoError, match=rf"bomb\.png: .*{size[0]} x {size[1]} pixels"):
            read("png", path)


def test_a_tiff_page_that_names_itself_as_the_next_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "loop.tif"
    tifffile.imwrite(path, np.zeros((8, 8, 3), np.uint16), photometric="rgb")
    data = bytearray(path.read_bytes())
    first = struct.unpack_from("<I", data, 4)[0]
    after = first + 2 + 12 * struct.unpack_from("<H", data, first)[0]
    struct.pack_into("<I", data, after, first)
    path.write_bytes(data)
    with pytest.raises(PsvideoError, match=r"loop\.tif: holds .* pictures"):
        decode("tiff", path)


@pytest.mark.parametrize("text", ["[" * 100_000, "9" * 10_000, '"text"', "{"])
def test_text_without_end_is_no_timing(text: str, tmp_path: Path) -> None:
    path = tmp_path / "timing.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(PsvideoError, match=r"timing\.json: not a JSON object"):
        read_timing(path)


@pytest.mark.parametrize("text", ["a = " + "[" * 100_000, "a = " + "9" * 10_000])
def test_text_without_end_is_no_plan(text: str, tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(PsvideoError, match=r"plan\.toml: not a TOML file"):
        read_plan(path)


def test_a_list_of_no_lights_is_no_rig(tmp_path: Path) -> None:
    path = tmp_path / "lights.lp"
    path.write_text("0\n", encoding="utf-8")
    with pytest.raises(PsvideoError, match=r"lights\.lp: .* 0 lights"):
        read_rig(path)
