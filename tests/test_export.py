"""What is delivered: files that read back as they were meant, whole or not at all."""

import contextlib
import errno
import io
import resource
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, get_args

import numpy as np
import OpenEXR
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from psvideo import __version__
from psvideo.compute.halves import halves_of
from psvideo.compute.threads import writing
from psvideo.errors import AllDoneError, PsvideoError, UsageError
from psvideo.export.sequences.planes import ones_of
from psvideo.export.sequences.plate_files import write_flash, write_plate
from psvideo.export.sequences.png_maps import decode_normals, encode_normals, write_png16
from psvideo.export.sequences.result_files import Delivery, is_written, write_surface
from psvideo.export.sequences.tags import Tags, advanced
from psvideo.export.space import Space, choose_space, placed
from psvideo.export.usd.pose import read_pose
from psvideo.formats.exr_files import Crop, write_exr
from psvideo.formats.whole_files import whole_file
from psvideo.formats.whole_folders import whole_folder
from psvideo.model.choices import Compression
from psvideo.model.surface import Surface
from psvideo.model.timing import Flash
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.split import Plate

TAGS = Tags(fps=Fraction(30000, 1001), colour="lin_rec709_scene", plan_sha256="ab" * 32, rig_sha256="cd" * 32)


def unit_normals(seed: int = 0, shape: tuple[int, int] = (9, 7)) -> np.ndarray:
    vectors = np.random.default_rng(seed).standard_normal((*shape, 3))
    vectors[..., 2] = np.abs(vectors[..., 2])
    normals: np.ndarray = (vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)).astype(np.float32)
    return normals


def surface() -> Surface:
    normals = unit_normals()
    valid = np.ones((9, 7), np.bool_)
    valid[2:4, 1:3] = False
    normals[~valid] = 0
    albedo = np.random.default_rng(1).random((9, 7, 3)).astype(np.float32) * valid[..., None]
    return Surface(normals=normals, albedo=albedo, valid=valid, residual=np.full((9, 7), 0.01, np.float32))


def read(path: Path) -> tuple[dict[str, object], dict[str, np.ndarray]]:
    """Return a file's header and its planes by channel name."""
    file = OpenEXR.File(str(path), separate_channels=True)
    return file.header(), {name: channel.pixels for name, channel in file.channels().items()}


def test_a_surface_is_delivered_as_one_sequence_per_quantity(tmp_path: Path) -> None:
    solved = surface()
    write_surface(tmp_path, "take", 1001, 0.125, solved, delivery=Delivery(space=Space()), tags=TAGS)
    header, normals = read(tmp_path / "normals" / "take_normals.1001.exr")
    assert set(normals) == {"R", "G", "B"}
    assert all(plane.dtype == np.float16 for plane in normals.values())
    np.testing.assert_allclose(np.stack([normals[c] for c in "RGB"], -1), solved.normals, atol=5e-4)
    assert header["framesPerSecond"] == Fraction(30000, 1001)
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION
    assert header["colorInteropID"] == "data"
    assert header["psvideo:time_s"] == 0.125
    assert header["psvideo:space"] == "camera"
    assert header["psvideo:y"] == "up"
    assert header["psvideo:version"] == __version__
    assert header["psvideo:plan_sha256"] == "ab" * 32
    assert header["psvideo:rig_sha256"] == "cd" * 32
    header, albedo = read(tmp_path / "albedo" / "take_albedo.1001.exr")
    assert header["colorInteropID"] == "lin_rec709_scene"
    np.testing.assert_allclose(np.stack([albedo[c] for c in "RGB"], -1), solved.albedo, atol=5e-4)
    header, valid = read(tmp_path / "valid" / "take_valid.1001.exr")
    assert header["colorInteropID"] == "data"
    assert (valid["Y"] == solved.valid).all()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["albedo", "normals", "valid"]


def test_what_is_asked_for_besides_is_written_besides(tmp_path: Path) -> None:
    delivery = Delivery(space=Space(y="down"), half=False, aovs=("residual",), png16=True, multipart=True)
    solved = surface()
    assert not is_written(tmp_path, "take", 1001, delivery)
    write_surface(tmp_path, "take", 1001, 0.0, solved, delivery=delivery, tags=TAGS)
    assert is_written(tmp_path, "take", 1001, delivery)
    _, normals = read(tmp_path / "normals" / "take_normals.1001.exr")
    assert normals["R"].dtype == np.float32
    np.testing.assert_array_equal(normals["G"], -solved.normals[..., 1])
    bundle = OpenEXR.File(str(tmp_path / "take.1001.exr"), separate_channels=True)
    assert {part.name() for part in bundle.parts} == {"normals", "albedo", "valid", "residual"}
    assert (tmp_path / "residual" / "take_residual.1001.exr").is_file()
    assert (tmp_path / "normals_png16" / "take_normals.1001.png").is_file()


def test_grey_albedo_is_delivered_as_three_channels_alike(tmp_path: Path) -> None:
    solved = surface()
    grey = Surface(normals=solved.normals, albedo=solved.albedo[..., 0], valid=solved.valid)
    write_surface(tmp_path, "take", 1, 0.0, grey, delivery=Delivery(space=Space()), tags=TAGS)
    _, albedo = read(tmp_path / "albedo" / "take_albedo.0001.exr")
    assert (albedo["R"] == albedo["B"]).all()


unit = hnp.arrays(np.float64, (5, 3), elements=st.floats(-1, 1)).filter(
    lambda v: bool((np.linalg.norm(v, axis=1) > 0.1).all())
)


@given(unit)
def test_sixteen_bit_normals_decode_to_what_was_encoded(vectors: np.ndarray) -> None:
    normals = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    decoded = decode_normals(encode_normals(normals))
    degrees = np.degrees(np.arccos(np.clip((decoded * normals).sum(axis=1), -1, 1)))
    assert degrees.max() < 0.03
    assert not decode_normals(encode_normals(np.zeros((2, 3)))).any()


def test_a_missing_row_is_zero_in_the_plates_own_channel(tmp_path: Path) -> None:
    seen = np.array([True, True, False, True])
    image = np.full((4, 5, 3), 0.25, np.float32) * seen[:, None, None]
    plate = LightPlate(light="key", number=1001, time_s=0.5, picture=mixture_of(image), seen=seen)
    write_plate(tmp_path, "take", plate, TAGS)
    _, planes = read(tmp_path / "key" / "take_key.1001.exr")
    assert set(planes) == {"R", "G", "B", "valid"}
    assert planes["valid"][:, 0].tolist() == [1, 1, 0, 1]
    whole = LightPlate(
        light="key", number=1002, time_s=0.5, picture=mixture_of(image[..., 0]), seen=np.ones(4, np.bool_)
    )
    write_plate(tmp_path, "take", whole, TAGS)
    _, planes = read(tmp_path / "key" / "take_key.1002.exr")
    assert set(planes) == {"Y"}


def test_a_flash_by_itself_says_which_lights_it_held(tmp_path: Path) -> None:
    flash = Flash(index=7, slot=0, lights={"a": 1.0, "b": 0.5}, start_s=1.0, duration_s=0.5, complete=True)
    rows = np.ones(4, np.bool_)
    write_flash(
        tmp_path,
        "take",
        Plate(
            flash=flash,
            picture=mixture_of(np.zeros((4, 3), np.float32)),
            shares=rows[None].astype(np.float64),
            middles_s=np.zeros((1, 4)),
            seen=rows,
        ),
        TAGS,
    )
    header, _ = read(tmp_path / "flashes" / "take_flash.0007.exr")
    assert header["psvideo:lights"] == "a=1 b=0.5"
    assert header["psvideo:time_s"] == 1.25


def test_a_time_code_is_counted_on_to_the_instant_where_it_can_be(tmp_path: Path) -> None:
    coded = replace(TAGS, camera_fps=Fraction(24000, 1001), first_time_code="10:59:59:22")
    write_surface(tmp_path, "take", 1, 3 * 1001 / 24000, surface(), delivery=Delivery(space=Space()), tags=coded)
    header, _ = read(tmp_path / "normals" / "take_normals.0001.exr")
    code = header["timeCode"]
    assert (code.hours, code.minutes, code.seconds, code.frame) == (11, 0, 0, 1)  # type: ignore[attr-defined]
    assert replace(coded, first_time_code="10:59:59;22").time_code(1.0) is None
    assert TAGS.time_code(1.0) is None


@pytest.mark.parametrize(
    ("camera_fps", "fps", "first", "shown"),
    [
        (Fraction(2997, 125), 5, "10:00:00:20", "10:00:00:20"),  # 23.976, as it is often written
        (Fraction(2997, 100), 5, "10:00:00;20", "10:00:00;20"),
        (Fraction(120), 24, "10:00:00:20", "10:00:00:20"),
        (Fraction(120), 20, "10:00:00:10", None),  # no time code counts 20, nor a multiple of it
    ],
)
def test_a_time_code_counts_the_frames_that_it_was_written_for(
    camera_fps: Fraction, fps: int, first: str, shown: str | None
) -> None:
    assert replace(TAGS, camera_fps=camera_fps, fps=Fraction(fps), first_time_code=first).time_code(0.0) == shown


@pytest.mark.parametrize(
    ("camera_fps", "fps", "shown"),
    [
        (240, 12, "10:00:00:23"),  # on twos, of 24
        (120, 8, "10:00:00:23"),
        (100, Fraction(25, 2), "10:00:00:24"),
        (Fraction(240_000, 1001), Fraction(12_000, 1001), "10:00:00:23"),
        (240, 15, "10:00:00:26"),  # half of 30
        (240, 6, None),  # of 24 or of 30
        (100, 5, "10:00:00:24"),  # no multiple of 24 or 30 is 100
        (240, Fraction(182299, 10_000), None),
    ],
)
def test_a_time_code_counts_the_project_s_frames_where_fewer_are_delivered(
    camera_fps: int | Fraction, fps: int | Fraction, shown: str | None
) -> None:
    coded = replace(TAGS, camera_fps=Fraction(camera_fps), fps=Fraction(fps), first_time_code="10:00:00:11")
    assert coded.time_code(0.52) == shown  # 0.52 s are 12 frames of 24 or 23.976, 13 of 25 and 15 of 30


@pytest.mark.parametrize(
    ("first", "frames", "then"),
    [
        ("01:00:59;29", 1, "01:01:00;02"),  # numbers 0 and 1 are left out at a minute's start
        ("01:09:59;29", 1, "01:10:00;00"),  # but not at every tenth
        ("00:00:00;00", 17982, "00:10:00;00"),  # ten minutes of 29.97 frames a second
        ("00:00:00;00", 30 * 3600 - 108, "01:00:00;00"),
        ("23:59:59;29", 1, "00:00:00;00"),
        ("10:00:00.00", 1800, "10:01:00;02"),
    ],
)
def test_drop_frame_codes_keep_to_the_clock(first: str, frames: int, then: str) -> None:
    rate = Fraction(30000, 1001)
    assert advanced(first, (frames + 0.5) / float(rate), rate) == then


def test_a_crop_keeps_the_display_window(tmp_path: Path) -> None:
    part = Crop(row=2, col=3, full_height_px=20, full_width_px=30)
    write_exr(tmp_path / "a.exr", {"Y": np.ones((4, 5), np.float32)}, crop=part)
    header, _ = read(tmp_path / "a.exr")
    assert [corner.tolist() for corner in header["dataWindow"]] == [[3, 2], [7, 5]]  # type: ignore[attr-defined]
    assert [corner.tolist() for corner in header["displayWindow"]] == [[0, 0], [29, 19]]  # type: ignore[attr-defined]


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_a_number_is_never_written(bad: float, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="NaN or infinity"):
        write_exr(tmp_path / "a.exr", {"Y": np.full((2, 2), bad, np.float32)})
    assert not list(tmp_path.iterdir())


@given(values=hnp.arrays(np.float32, (5, 3), elements=st.floats(width=32)))
def test_halves_are_rounded_as_numpy_rounds_them_and_end_at_the_largest(values: np.ndarray) -> None:
    halves, finite = halves_of(values)
    assert finite == bool(np.isfinite(values).all())
    wanted = np.clip(values, -65504, 65504).astype(np.float16)
    known = ~np.isnan(values)
    assert np.array_equal(halves[known].view(np.uint16), wanted[known].view(np.uint16)), "signs of 0 too"


def test_a_mask_is_written_as_ones_and_zeros() -> None:
    mask = np.random.default_rng(0).random((7, 9))[::2, ::-1] > 0.5
    assert np.array_equal(ones_of(mask), mask.astype(np.float16))


def test_strided_planes_are_stored_as_they_look(tmp_path: Path) -> None:
    image = np.random.default_rng(0).random((6, 8, 3)).astype(np.float32)
    write_exr(tmp_path / "a.exr", {"Y": image[::2, ::-1, 1]}, half=False)
    _, planes = read(tmp_path / "a.exr")
    np.testing.assert_array_equal(planes["Y"], image[::2, ::-1, 1])


def test_world_normals_are_turned_by_the_camera_and_unturned_by_its_inverse(tmp_path: Path) -> None:
    quarter = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] = 2 * quarter
    path = tmp_path / "camera.txt"
    np.savetxt(path, matrix)
    rotation = read_pose(path).rotation
    np.testing.assert_allclose(rotation, quarter, atol=1e-12)
    normals = unit_normals()
    world = placed(normals, Space(name="world", camera_to_world=rotation))
    np.testing.assert_allclose(world[..., 0], normals[..., 2], atol=1e-6)
    back = placed(world, Space(name="world", camera_to_world=rotation.T))
    np.testing.assert_allclose(back, normals, atol=1e-6)


@pytest.mark.parametrize("text", ["1 2 3", "a b c", "1 0 0 0 1 0 0 0 -1", "1 0 0 0 2 0 0 0 1"])
def test_what_is_no_rotation_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "camera.txt"
    path.write_text(text)
    with pytest.raises(PsvideoError, match=r"camera\.txt"):
        read_pose(path)


def test_spaces_that_do_not_fit_their_options_are_refused() -> None:
    with pytest.raises(UsageError, match="needs the camera's rotation"):
        choose_space("world", "up", None)
    with pytest.raises(UsageError, match='belongs to `space="world"`'):
        choose_space("camera", "up", Path("camera.txt"))


def test_a_folder_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with contextlib.suppress(RuntimeError), whole_folder(out, mark="timing.json") as folder:
        (folder / "timing.json").write_text("x")
        raise RuntimeError
    assert not out.exists()
    with whole_folder(out, mark="timing.json", resume=True) as folder:
        assert (folder / "timing.json").is_file()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    with pytest.raises(UsageError, match="exists already"), whole_folder(out, mark="timing.json"):
        pass
    with whole_folder(out, mark="timing.json", force=True) as folder:
        (folder / "new.txt").write_text("y")
    assert sorted(path.name for path in out.iterdir()) == [".written", "new.txt"]
    with whole_folder(tmp_path / "other", mark="timing.json", resume=True) as folder:
        assert not any(folder.iterdir()), "where nothing was begun, it begins"


def test_a_folder_is_resumed_only_with_the_settings_it_was_begun_with(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with contextlib.suppress(RuntimeError), whole_folder(out, mark="a", settings="one") as folder:
        (folder / ".a.7.partial").write_text("half a file")
        raise RuntimeError
    with pytest.raises(UsageError, match="other settings"), whole_folder(out, mark="a", resume=True, settings="two"):
        pass
    with whole_folder(out, mark="a", resume=True, settings="one") as folder:
        (folder / "a").write_text("x")
    assert sorted(path.name for path in out.iterdir()) == [".settings", ".written", "a"]
    with pytest.raises(AllDoneError, match="all done"), whole_folder(out, mark="a", resume=True, settings="one"):
        pass
    with pytest.raises(UsageError, match="exists"), whole_folder(out, mark="a", resume=True, settings="two"):
        pass


def test_a_run_that_was_killed_before_it_noted_its_settings_begins_again(tmp_path: Path) -> None:
    beside = tmp_path / ".out.partial"
    beside.mkdir()
    (beside / ".settings.7.partial").write_text("o")
    with whole_folder(tmp_path / "out", mark="a", resume=True, settings="one") as folder:
        assert [path.name for path in folder.iterdir()] == [".settings"]


def test_what_a_run_that_was_killed_had_moved_out_of_the_way_is_removed_by_the_next(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / ".out.old-7" / "a").mkdir(parents=True)
    with whole_folder(tmp_path / "out", mark="a", force=True) as folder:
        (folder / "a").write_text("new")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_failed_run_leaves_the_output_that_it_was_to_replace(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with whole_folder(out, mark="timing.json") as folder:
        (folder / "timing.json").write_text("keep me")
    with pytest.raises(RuntimeError), whole_folder(out, mark="timing.json", force=True):
        raise RuntimeError
    assert (out / "timing.json").read_text() == "keep me"


def written_before(out: Path) -> None:
    with whole_folder(out, mark="timing.json") as folder:
        (folder / "normals").mkdir()
        (folder / "normals" / "a.1001.exr").write_text("x")
        (folder / "timing.json").write_text("x")


@pytest.mark.parametrize("mine", ["comp_v2.nk", "renders/final.exr", "normals/a.1001.retouched.exr"])
def test_force_removes_no_file_that_a_run_did_not_write(mine: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    written_before(out)
    (out / mine).parent.mkdir(exist_ok=True)
    (out / mine).write_text("a day's work")
    (out / ".DS_Store").write_text("a computer's")
    with pytest.raises(UsageError, match=f"{mine}.*would be gone"), whole_folder(out, mark="timing.json", force=True):
        pass
    assert (out / mine).read_text() == "a day's work"
    (out / mine).unlink()
    with whole_folder(out, mark="timing.json", force=True) as folder:
        (folder / "timing.json").write_text("new")
    assert sorted(path.name for path in out.iterdir()) == [".written", "timing.json"]


def test_a_folder_of_ones_own_that_holds_a_timing_file_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "day1" / "clip").mkdir(parents=True)
    for name in ("timing.json", "notes.txt", "clip/plan.toml"):
        (tmp_path / "day1" / name).write_text("x")
    with (
        pytest.raises(UsageError, match="cannot be told"),
        whole_folder(tmp_path / "day1", mark="timing.json", force=True),
    ):
        pass
    (tmp_path / "day1" / ".written").write_text("{")
    with (
        pytest.raises(UsageError, match="no list of file names"),
        whole_folder(tmp_path / "day1", mark="timing.json", force=True),
    ):
        pass
    assert (tmp_path / "day1" / "clip" / "plan.toml").is_file()


def test_what_was_saved_into_an_output_while_it_was_made_anew_stays_and_the_run_waits_beside_it(tmp_path: Path) -> None:
    out = tmp_path / "out"
    written_before(out)

    def make_anew() -> None:
        with whole_folder(out, mark="timing.json", force=True, settings="one") as folder:
            (folder / "timing.json").write_text("new")
            (out / "comp.nk").write_text("saved meanwhile")

    with pytest.raises(PsvideoError, match=r"comp\.nk.*waits beside it"):
        make_anew()
    (out / "comp.nk").rename(tmp_path / "comp.nk")
    with whole_folder(out, mark="timing.json", force=True, resume=True, settings="one"):
        pass
    assert (out / "timing.json").read_text() == "new"


@pytest.mark.parametrize(("settings", "said"), [("one", "what is finished is kept"), ("", "run the command again.$")])
def test_a_full_disk_s_advice_does_not_cost_what_is_finished(settings: str, said: str, tmp_path: Path) -> None:
    def fill() -> None:
        with whole_folder(tmp_path / "out", mark="a", settings=settings) as folder, whole_file(folder / "a"):
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(PsvideoError, match=said):
        fill()


def test_a_fault_in_a_writing_thread_reaches_the_run() -> None:
    def fail() -> None:
        raise PsvideoError("disk full")

    with pytest.raises(PsvideoError, match="disk full"), writing() as write:
        write(fail)
    done: list[int] = []
    with writing(most_waiting=2) as write:
        for number in range(20):
            write(lambda number=number: done.append(number))  # type: ignore[misc]
    assert sorted(done) == list(range(20))


FULL_DISK = """
import resource, sys, numpy as np
from pathlib import Path
from typing import get_args
from psvideo.errors import PsvideoError
from psvideo.formats.exr_files import write_exr
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
try:
    write_exr(Path(sys.argv[1]), {"Y": np.random.default_rng(0).random((200, 200)).astype(np.float32)})
except PsvideoError as fault:
    print(fault)
"""


def test_a_full_disk_is_reported_and_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "plate.exr"
    said = subprocess.run(
        [sys.executable, "-c", FULL_DISK, str(path)], capture_output=True, text=True, check=True
    ).stdout
    assert str(path) in said
    assert "cannot be written" in said
    assert not list(tmp_path.iterdir())
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] != 4096


class _FullForAMoment(io.BytesIO):
    """A file on a disk that is full when its writer goes back in it, and has room again when it is closed."""

    def seek(self, place: int, whence: int = 0, /) -> int:
        if whence == 0 and place < self.tell():
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().seek(place, whence)


def test_a_disk_that_is_full_while_a_file_s_table_is_written_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """OpenEXR swallows it, and the picture was taken for whole with a table of zeros."""
    opened = Path.open

    def full(path: Path, *how: Any, **options: Any) -> Any:  # what libraries open on the way is theirs
        return _FullForAMoment() if tmp_path in path.parents else opened(path, *how, **options)

    monkeypatch.setattr(Path, "open", full)
    with pytest.raises(PsvideoError, match="No space left on device"):
        write_exr(tmp_path / "a.exr", {"Y": np.ones((20, 20), np.float32)})


@pytest.mark.parametrize("compression", get_args(Compression))
def test_every_compression_is_without_loss(tmp_path: Path, compression: Compression) -> None:
    noisy = np.random.default_rng(4).normal(size=(37, 53)).astype(np.float32)
    write_exr(tmp_path / "noisy.exr", {"Y": noisy}, half=False, compression=compression)
    read = OpenEXR.File(str(tmp_path / "noisy.exr"), separate_channels=True)
    np.testing.assert_array_equal(read.channels()["Y"].pixels, noisy)
    assert str(read.header()["compression"]).lower().startswith(f"compression.{compression.replace('none', 'no')}_")


@pytest.mark.parametrize("text", ["50 mm", "ƒ/1.4", "カメラ"])
def test_texts_of_a_png_hold_any_letter(text: str, tmp_path: Path) -> None:
    path = tmp_path / "map.png"
    write_png16(path, np.zeros((4, 4, 3), np.uint16), texts={"lensModel": text})
    with Image.open(path) as picture:
        picture.load()
        assert picture.text["lensModel"] == text  # type: ignore[attr-defined]
