"""Damaged and hostile files are read or refused with one paragraph that names them: no crash, no hang, no flood."""

import json
import os
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from fractions import Fraction
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import tifffile
from bench.hostile import Outcome, changed, outcomes
from bench.hostile_files import SCENE, good_files
from bench.hostile_runs import tried
from PIL import ExifTags, Image

from psvideo.clip.decode import exr
from psvideo.clip.decode.decoders import decode, read_header
from psvideo.clip.stated import Stated, stated_by
from psvideo.errors import PsvideoError, UsageError
from psvideo.export.sequences.tags import sha256_of
from psvideo.formats.exr_files import write_exr
from psvideo.formats.paths import path_of
from psvideo.formats.plan_toml import read_plan
from psvideo.formats.rig_toml import read_rig
from psvideo.formats.timing_json import read_timing
from psvideo.sync.open_take import open_take
from psvideo.synth.shoot import shoot

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


@pytest.mark.parametrize(
    ("kind", "name", "said"), [("tiff", "loop.tif", "holds .* pictures"), ("dng", "loop.dng", "holds no raw")]
)
def test_a_tiff_page_that_names_itself_as_the_next_is_refused(kind: str, name: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / name
    tifffile.imwrite(path, np.zeros((8, 8, 3), np.uint16), photometric="rgb")
    data = bytearray(path.read_bytes())
    first = struct.unpack_from("<I", data, 4)[0]
    after = first + 2 + 12 * struct.unpack_from("<H", data, first)[0]
    struct.pack_into("<I", data, after, first)
    path.write_bytes(data)
    with pytest.raises(PsvideoError, match=f"{name}: {said}"):
        decode(kind, path)


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


def test_a_profile_that_divides_by_zero_and_tags_without_words_say_nothing(tmp_path: Path) -> None:
    path = tmp_path / "photograph.jpg"
    curve = b"para" + bytes(4) + struct.pack(">HH", 1, 0) + struct.pack(">3i", 1 << 16, 0, 1 << 16)
    profile = bytes(128) + struct.pack(">I4sII", 1, b"rTRC", 144, len(curve)) + curve
    tags = Image.Exif()
    tags[ExifTags.Base.Make], tags[ExifTags.Base.Model] = "\t", "model"
    Image.new("RGB", (8, 8)).save(path, icc_profile=profile, exif=tags)
    assert stated_by(path) == Stated(longer_px=8)


def test_a_rate_that_divides_by_zero_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rate.exr"
    write_exr(path, {"Y": np.zeros((4, 4), np.float32)}, fps=Fraction(24, 1))
    data = path.read_bytes()
    place = data.index(struct.pack("<iI", 24, 1))
    path.write_bytes(data[:place] + bytes(8) + data[place + 8 :])
    with pytest.raises(PsvideoError, match=r"rate\.exr: cannot be read as OpenEXR"):
        exr.contents(path)


def test_an_exr_whose_pixels_are_damaged_is_refused_for_them(tmp_path: Path) -> None:
    path = tmp_path / "noise.exr"
    write_exr(path, {"Y": np.random.default_rng(1).random((64, 64)).astype(np.float32)})
    data = bytearray(path.read_bytes())
    data[-3000:-2000] = bytes(1000)
    path.write_bytes(data)
    with pytest.raises(PsvideoError, match=r"noise\.exr: .*its pixels cannot be decoded"):
        decode("exr", path)


@pytest.mark.parametrize("read", [read_plan, read_rig, exr.contents, sha256_of, lambda path: decode("png", path)])
def test_a_pipe_is_refused_where_a_file_is_expected(read: Callable[[Path], object], tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with pytest.raises(PsvideoError, match="pipe: is a pipe, and a file is expected"):
        read(path)


def test_a_name_that_is_no_text_is_refused(tmp_path: Path) -> None:
    for name in (os.fsdecode(b"\xff"), "a\0b"):
        with pytest.raises(UsageError, match="this name is not UTF-8 text"):
            path_of("clip", tmp_path / name)


def test_frames_that_are_a_thousand_years_apart_are_not_one_take(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.format(kind="png16", camera=""), encoding="utf-8")
    clip = shoot(scene, tmp_path / "clip").path
    last = max((clip / "frames").iterdir())
    last.rename(last.with_name("hostile.3000000000000.png"))
    with pytest.raises(PsvideoError, match=r"after number 2 there are 2999999999997 missing, and 3 frames are there"):
        open_take(clip)
    assert len(open_take(clip, frames="1-2").numbers) == 2


@pytest.mark.campaign
def test_whole_commands_do_no_harm_on_hostile_folders(tmp_path: Path) -> None:
    found = [one for _, one in islice(tried(tmp_path, seed=5), 60)]
    assert not [f"{' '.join(one.words)}: {one.why}: {one.fault}: {one.said}" for one in found if one.fault]
    assert {one.status for one in found} >= {0, 1}


def test_json_stays_json_where_a_library_prints_of_damage(tmp_path: Path) -> None:
    """OpenEXR's binding prints a warning of damaged pixels on Python's standard output."""
    for number in range(3):
        path = tmp_path / f"shot_{number}.exr"
        write_exr(path, {"Y": np.random.default_rng(number).random((64, 64)).astype(np.float32)})
    data = bytearray(path.read_bytes())
    data[-3000:-2000] = bytes(1000)
    path.write_bytes(data)
    command = [sys.executable, "-m", "psvideo", "info", "--json", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 1
    texts = [finding["text"] for finding in json.loads(done.stdout)["findings"]]
    assert any("shot_2.exr: cannot be read as OpenEXR" in text for text in texts)
    assert "Traceback" not in done.stderr
