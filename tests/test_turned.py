"""Cameras held upright, upside down, or before a mirror: rows of the sensor are columns, results stand upright.

A movie whose container says how to turn it must give what the same pictures give without a word, turned afterwards:
pictures by numpy, directions by the same turn of x and y.
"""

import struct
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

import psvideo as ps
from psvideo.cli.app import main
from psvideo.clip import open_clip, read_frames
from psvideo.clip.decode.movies.movie import index_movie
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.rig_toml import format_rig, read_rig
from psvideo.model.camera import Encoding
from psvideo.model.rig import Rig
from psvideo.model.turn import CLOCKWISE, EXIF, UPRIGHT, Turn, of_matrix
from psvideo.plates.align.as_they_are import seen_by_all
from psvideo.plates.align.comb import SAMPLES
from psvideo.plates.align.open_shutter import with_open_shutter
from psvideo.plates.align.velocity.brightness import evened
from psvideo.plates.align.velocity.flow import Sketch, changed, comparable, noise_between, sketch_of
from psvideo.plates.align.velocity.followed import Followed, Pair
from psvideo.plates.ambient.ambient_regression import Separated
from psvideo.plates.beauty import beauty_of, mix_of
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.plates.upright import upright, upright_window
from psvideo.report.observe.facts import instant_facts
from psvideo.report.observe.motion import Motion, glimpse, motion_between
from psvideo.report.observe.observed import Observed

ONE = 65536
MATRICES = {
    "clockwise": (EXIF[6], (0, 1, -1, 0)),
    "counter-clockwise": (EXIF[8], (0, -1, 1, 0)),
    "upside down": (EXIF[3], (-1, 0, 0, -1)),
    "mirrored": (EXIF[2], (-1, 0, 0, 1)),
    "clockwise and mirrored": (EXIF[5], (0, 1, 1, 0)),
}
"""By what is done to the picture: the turn, and the container's matrix a b c d (x' = a x + c y, y' = b x + d y)."""

SCENE = """
schema = "psvideo-scene/1"
name = "ball"
frames = 14
seed = 5
[camera]
width_px = 64
height_px = 48
fps = 100
shutter_deg = 300.0
readout_s = 0.008
width_m = 1.4
[strobe]
flash_s = 0.001
clock_offset_ppm = 60.0
[[light]]
name = "key"
direction = [0.3, 0.3, 0.9]
[[light]]
name = "left"
direction = [-0.4, 0.1, 0.9]
[[light]]
name = "top"
direction = [0.1, -0.5, 0.85]
[[light]]
name = "right"
direction = [0.6, -0.1, 0.8]
[[object]]
mesh = "sphere"
albedo = [0.8, 0.5, 0.3]
"""


@pytest.mark.parametrize("orientation", EXIF)
def test_turns_are_what_the_standard_says_of_the_first_row_and_column(orientation: int) -> None:
    """TIFF 6.0 names the sides of the scene that row 0 and column 0 show; the upright picture has them there."""
    first = {1: "top left", 2: "top right", 3: "bottom right", 4: "bottom left"} | {
        5: "left top",
        6: "right top",
        7: "right bottom",
        8: "left bottom",
    }
    row_0, col_0 = first[orientation].split()
    picture = np.zeros((4, 6), np.uint8)
    picture[0], picture[1:, 0] = 1, 2
    shown = EXIF[orientation].upright(picture)
    sides = {"top": shown[0], "bottom": shown[-1], "left": shown[:, 0], "right": shown[:, -1]}
    assert (sides[row_0] == 1).all()
    assert np.count_nonzero(sides[col_0] == 2) == 3
    assert EXIF[orientation].size(6, 4) == shown.shape[::-1]


@pytest.mark.parametrize("name", MATRICES)
def test_a_containers_matrix_moves_every_pixel_where_the_turn_puts_it(name: str) -> None:
    turn, (a, b, c, d) = MATRICES[name]
    assert of_matrix((a, b), (c, d)) == turn
    picture = np.arange(12).reshape(3, 4)
    rows, cols = np.mgrid[:3, :4]
    x, y = a * cols + c * rows, b * cols + d * rows
    moved = np.zeros(turn.upright(picture).shape, picture.dtype)
    moved[y - y.min(), x - x.min()] = picture
    assert np.array_equal(turn.upright(picture), moved)


def test_no_turn_is_made_of_an_angle_between() -> None:
    assert of_matrix((0.7, 0.7), (-0.7, 0.7)) is None
    assert of_matrix((0, 0), (0, 0)) is None


def write_movie(path: Path, frames: list[NDArray[np.uint8]], matrix: tuple[int, ...]) -> None:
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("libx264", rate=100, options={"qp": "0", "bf": "0", "threads": "1"})
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv444p"
        stream.codec_context.color_range, stream.codec_context.colorspace = 1, 1
        for number, codes in enumerate(frames):
            frame = av.VideoFrame.from_ndarray(codes, format="rgb24").reformat(format="yuv444p", dst_colorspace=1)
            frame.pts, frame.time_base, frame.colorspace, frame.color_range = number, Fraction(1, 100), 1, 1
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    data = bytearray(path.read_bytes())
    place = data.index(b"tkhd") + 4 + 40  # version 0: the matrix follows 40 bytes of version, times, layer and volume
    a, b, c, d = (ONE * one for one in matrix)
    assert struct.unpack(">9i", data[place : place + 36]) == (ONE, 0, 0, 0, ONE, 0, 0, 0, 1 << 30)
    data[place : place + 36] = struct.pack(">9i", a, b, 0, c, d, 0, 0, 0, 1 << 30)
    path.write_bytes(data)


def turned_rig(rig: Rig, matrix: tuple[int, ...]) -> Rig:
    return replace(
        rig, lights=tuple(replace(one, direction=turned(np.array(one.direction), matrix)) for one in rig.lights)
    )


def turned(vectors: NDArray[Any], matrix: tuple[int, ...]) -> Any:
    """Turn x (right) and y (up) as the picture's columns (right) and rows (down)."""
    a, b, c, d = matrix
    right, down = vectors[..., 0], -vectors[..., 1]
    moved = np.stack([a * right + c * down, -(b * right + d * down), vectors[..., 2]], axis=-1)
    return tuple(float(value) for value in moved) if moved.ndim == 1 else moved


def filmed(folder: Path, scene: str, missing: int | None = None) -> Callable[[str], Path]:
    """Shoot a scene; return what writes it as a movie that its container turns, with plan and rig beside it, and one
    frame ``missing``."""
    (folder / "scene.toml").write_text(scene, encoding="utf-8")
    ps.shoot(folder / "scene.toml", folder / "shot")
    shot = open_clip(folder / "shot")
    codes = [np.rint(255 * np.clip(frame.image, 0, 1)).astype(np.uint8) for frame in read_frames(shot)]
    codes = [frame for number, frame in enumerate(codes) if number != missing]
    plan = replace(shot.plan, camera=replace(shot.plan.camera, encoding=Encoding(transfer="linear")))
    rig = read_rig(folder / "shot" / "rig.toml", plan_lights=plan.lights)

    def write(name: str) -> Path:
        matrix = (1, 0, 0, 1) if name == "upright" else MATRICES[name][1]
        there = folder / name.replace(" ", "_")
        if not there.is_dir():
            there.mkdir()
            write_movie(there / "clip.mp4", codes, matrix)
            (there / "plan.toml").write_text(format_plan(plan), encoding="utf-8")
            (there / "rig.toml").write_text(format_rig(turned_rig(rig, matrix)), encoding="utf-8")
        return there / "clip.mp4"

    return write


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """A ball under four lights, blind for a sixth of the time, as a sensor reads it; the container turns it."""
    return filmed(tmp_path_factory.mktemp("turned"), SCENE)


def solved(movie: Path, out: Path, *extra: str) -> Path:
    rig = movie.with_name("rig.toml")
    assert (
        main(["normals", str(movie), "--rig", str(rig), "-o", str(out), "--float", "--aov", "age", "-q", *extra]) == 0
    )
    return out


def read(out: Path, what: str) -> NDArray[np.float32]:
    channels = OpenEXR.File(str(sorted((out / what).iterdir())[1]), separate_channels=True).channels()
    return np.stack([channels[name].pixels for name in ("RGB" if "R" in channels else "Y")], axis=-1)


@pytest.mark.parametrize("name", ["clockwise", "mirrored"])
def test_a_turned_movie_gives_upright_results_of_the_same_surface(
    film: Callable[[str], Path], tmp_path: Path, name: str
) -> None:
    turn, matrix = MATRICES[name]
    plain, shown = (solved(film(one), tmp_path / one, "--align", "none") for one in ("upright", name))
    albedo, valid, age = (turn.upright(read(plain, what)) for what in ("albedo", "valid", "age"))
    assert read(shown, "normals").shape[:2] == ((64, 48) if turn.transposed else (48, 64))
    same = (read(shown, "valid") == valid)[..., 0]
    assert same.mean() > 0.99
    solid = same & (valid[..., 0] == 1)
    assert solid.sum() > 400
    normals = turned(turn.upright(read(plain, "normals")), matrix)
    away = np.degrees(np.arccos(np.clip((normals * read(shown, "normals")).sum(axis=-1), -1, 1)))
    assert away[solid].max() < 0.5  # turned plates are held in 16-bit codes
    assert np.abs(read(shown, "albedo") - albedo)[solid].max() < 2e-3
    assert np.abs(read(shown, "age") - age).max() < 1e-6
    assert age.max() > 0, "rows were borrowed"


def test_split_writes_upright_plates_and_flashes(film: Callable[[str], Path], tmp_path: Path) -> None:
    for name in ("upright", "clockwise"):
        assert main(["split", str(film(name)), "-o", str(tmp_path / name), "--flashes", "-q"]) == 0
    for what in ("key", "flashes"):
        upright, shown = (read(tmp_path / name, what) for name in ("upright", "clockwise"))
        assert np.abs(MATRICES["clockwise"][0].upright(upright) - shown).max() < 1e-3


def test_a_mask_is_drawn_on_the_upright_picture(film: Callable[[str], Path], tmp_path: Path) -> None:
    mask = np.zeros((64, 48), np.uint8)
    mask[:32] = 255
    cv2.imwrite(str(tmp_path / "mask.png"), mask)
    out = solved(film("clockwise"), tmp_path / "out", "--mask", str(tmp_path / "mask.png"))
    assert read(out, "valid")[:32].any()
    assert not read(out, "valid")[32:].any()


def test_a_plan_of_the_upright_picture_is_refused_with_what_to_write(
    film: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = film("clockwise").with_name("plan.toml").read_text(encoding="utf-8")
    swapped = plan.replace("width_px = 64", "width_px = 0").replace("height_px = 48", "height_px = 64")
    (tmp_path / "plan.toml").write_text(swapped.replace("width_px = 0", "width_px = 48"), encoding="utf-8")
    assert (
        main(["sync", str(film("clockwise")), "--plan", str(tmp_path / "plan.toml"), "-o", str(tmp_path / "t.json")])
        == 1
    )
    assert "write width_px = 64 and height_px = 48" in " ".join(capsys.readouterr().err.split())


def test_info_says_how_a_movie_is_turned(film: Callable[[str], Path], capsys: pytest.CaptureFixture[str]) -> None:
    main(["info", str(film("clockwise"))])
    assert "turned by 90 degrees clockwise" in " ".join(capsys.readouterr().out.split())


ROWS, COLS = 96, 128
TURNS = pytest.mark.parametrize("turn", [UPRIGHT, EXIF[3], EXIF[5], CLOCKWISE], ids=str)


def plate(
    turn: Turn, unseen: slice, *, light: str = "key", image: NDArray[Any] | None = None, at: int = 0
) -> LightPlate:
    """A plate of which no frame saw some rows of the sensor, turned upright; left out, a picture of noise."""
    if image is None:
        image = 0.2 + 0.6 * np.random.default_rng(0).random((ROWS, COLS))
    seen = np.ones(ROWS, np.bool_)
    seen[unseen] = False
    picture = mixture_of((image * seen[:, None]).astype(np.float32))
    return upright(LightPlate(light=light, number=1001, time_s=0.1 * at, picture=picture, seen=seen), turn)


def below(row: int) -> NDArray[np.bool_]:
    """Where the sensor's picture is in this row or a later one."""
    return np.broadcast_to(np.arange(ROWS)[:, None] >= row, (ROWS, COLS))


@TURNS
def test_of_a_turned_plate_as_many_rows_are_missing(turn: Turn) -> None:
    one = plate(turn, slice(0, 32))
    assert instant_facts(Round(number=1001, plates=(one,)), None, None).unseen_share == pytest.approx(1 / 3)
    assert np.array_equal(np.broadcast_to(one.own, one.shape), turn.upright(below(32)))


@TURNS
def test_what_frames_show_of_the_room_is_looked_at_as_it_is_seen(turn: Turn) -> None:
    room = np.random.default_rng(2).random((ROWS, COLS)).astype(np.float32)
    found = Separated(begins=0, image=room, stood=np.ones((8, 12), np.bool_), known=np.arange(ROWS) >= 32)
    shown = upright_window(found, turn)
    assert np.array_equal(shown.image, turn.upright(room))
    known = shown.known if shown.known.ndim == 2 else shown.known[:, None]
    assert np.array_equal(np.broadcast_to(known, shown.image.shape), turn.upright(below(32)))
    observed = Observed(lights=("a",))
    observed.look_at_window(shown)
    assert observed.ambient_measured == {0: 1.0}


@TURNS
def test_rows_that_no_frame_saw_are_no_motion(turn: Turn) -> None:
    found = motion_between(glimpse(plate(turn, slice(0, 32))), glimpse(plate(turn, slice(32, 64), at=1)))
    assert found == Motion(speed_px_s=0.0, share=0.0)
    assert motion_between(glimpse(plate(turn, slice(0, 48))), glimpse(plate(turn, slice(48, 96), at=1))) is None


@TURNS
def test_rows_that_no_frame_saw_under_one_light_are_black_in_the_sum(turn: Turn) -> None:
    even = np.full((ROWS, COLS), 0.3)
    plates = plate(turn, slice(0, 20), image=even), plate(turn, slice(50, 70), light="left", image=even)
    shown = beauty_of(Round(number=1001, plates=plates), mix_of({}, with_ambient=False)).image
    known = np.ones((ROWS, COLS), np.bool_)
    known[0:20] = known[50:70] = False
    assert np.allclose(shown, turn.upright(np.where(known, 0.6, 0)), atol=1e-3)


@TURNS
def test_an_open_shutter_knows_nothing_of_rows_that_no_frame_saw(turn: Turn) -> None:
    plates = [plate(turn, slice(0, 20), image=np.full((ROWS, COLS), 0.3 + 0.01 * n)) for n in range(SAMPLES)]
    (one,) = with_open_shutter(Round(number=1001, plates=(each,)) for each in plates)
    assert np.array_equal(one.open_plates[0].pixels_seen, plates[0].pixels_seen)
    assert one.open_plates[0].pixels_seen.mean() == pytest.approx(76 / 96)


def painted(turn: Turn, unseen: slice, *, right: int, gain: float = 1.0) -> Sketch:
    """The sketch of a textured wall with a square that is so far to the right, with some noise."""
    wall = 0.3 + 0.1 * np.random.default_rng(3).random((ROWS // 8, COLS // 8)).repeat(8, 0).repeat(8, 1)
    wall[40:64, 40 + right : 64 + right] = 0.6
    noise = np.random.default_rng(right).normal(0, 0.02, wall.shape)
    return sketch_of(plate(turn, unseen, image=gain * (wall + noise), at=right), white=1.0)


NOISE_CODES = np.sqrt(2) * 0.02 * 255 / (np.sqrt(1.02) - np.sqrt(0.02)) / (2 * np.sqrt(0.35 + 0.02))
"""What that noise makes of the codes' differences on the wall, which shows about 0.35 of white: codes follow roots."""


@TURNS
def test_a_square_is_seen_to_move_though_rows_are_missing(turn: Turn) -> None:
    before, after = painted(turn, slice(0, 16), right=0), painted(turn, slice(8, 20), right=12)
    moved = changed(before, after)
    left = np.pad(np.ones((4, 3), np.bool_), ((11, 9), (10, 19)))  # blocks of 4 pixels that the square leaves
    assert moved[turn.upright(left)].all()
    assert 0.05 < moved.mean() < 0.2
    one, other = comparable(before, after)
    missing = turn.upright(~below(20))
    assert np.array_equal(one[missing], other[missing])
    assert noise_between(before, after) == pytest.approx(NOISE_CODES, rel=0.25)


@TURNS
def test_a_change_of_exposure_is_evened_though_rows_are_missing(turn: Turn) -> None:
    before, after = painted(turn, slice(0, 16), right=0), painted(turn, slice(8, 20), right=0, gain=0.7)
    one, other = comparable(before, evened(before, after))
    assert np.abs(one.astype(int) - other).max() <= 2
    assert np.abs(before.codes.astype(int) - after.codes)[turn.upright(below(20))].mean() > 10


@TURNS
def test_what_all_lights_show_is_where_no_row_is_missing(turn: Turn) -> None:
    parts = slice(0, 16), slice(15, 21)
    pairs = [Pair(before=painted(turn, part, right=0), after=painted(turn, part, right=12)) for part in parts]
    whole = turn.upright(below(22)[::2, ::2])
    still = np.zeros_like(whole)
    motion = Followed(time_s=0.0, velocity=np.zeros((2, *still.shape), np.float32), moves=still, rests=~still, step=2)
    assert np.array_equal(np.broadcast_to(seen_by_all(pairs, motion), still.shape), whole)


def test_a_turned_take_that_lost_a_frame_is_judged_as_the_upright_one(tmp_path: Path) -> None:
    scene = SCENE.replace("shutter_deg = 300.0", "shutter_deg = 360.0").replace("frames = 14", "frames = 20")
    movie = filmed(tmp_path, scene, missing=9)
    plain, shown = (
        ps.normals(movie(name), rig=movie(name).with_name("rig.toml"), out=tmp_path / f"{name} out")
        for name in ("upright", "clockwise")
    )
    unseen = [one.unseen_share for one in plain.instants]
    assert max(unseen) > 0.03
    assert [one.unseen_share for one in shown.instants] == pytest.approx(unseen)
    assert [(one.subject, one.grade) for one in shown.judgements] == [
        (one.subject, one.grade) for one in plain.judgements
    ]
    for one, other in zip(shown.instants, plain.instants, strict=True):
        assert one.valid_share == pytest.approx(other.valid_share, abs=0.03)


REAL = {
    "video_phone/androidx_dolbyVision-hdr.MOV": ("turned by 90 degrees clockwise", "hlg", "lin_rec2020_scene", True),
    "video_phone/androidx_sample_with_color_info.mp4": (
        "turned by 90 degrees clockwise",
        "hlg",
        "lin_rec2020_scene",
        True,
    ),
    "video_phone/androidx_h265_with_metadata_track.mp4": ("turned by 90 degrees clockwise", "rec709", None, False),
    "video_phone/androidx_pixel7_videoOnly_cleaned.mp4": ("turned by 180 degrees", "rec709", "lin_rec709_scene", False),
    "video_phone/mei_ftyp3gp5.mp4": ("turned by 90 degrees clockwise", None, None, True),
    "video_phone/androidx_sample_with_colr_mdcv_and_clli.mp4": ("upright", "st2084", "lin_rec2020_scene", True),
    "video_pro/hevc10_hdr10tags_rot90.mkv": ("turned by 90 degrees and mirrored", "st2084", "lin_rec2020_scene", True),
}
"""Real movies: how the container turns them, the transfer and the primaries that they are tagged with, video range."""


@pytest.mark.parametrize("name", REAL)
def test_real_movies_are_read_as_their_container_says(shared_data: Path, name: str) -> None:
    if not (shared_data / "movies" / name).is_file():
        pytest.skip("the real movies are not there")
    header = index_movie(shared_data / "movies" / name).header
    assert (str(header.turn), header.transfer, header.colour, header.video_range) == REAL[name]
