"""What lies beside the maps of a delivery: plates, their sum, movies, the timeline, presets and their notes."""

import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import get_args

import av
import numpy as np
import OpenEXR
import pytest
from bytes_of_files import digest_of_results

from psvideo.cli.app import main
from psvideo.cli.options.per_light import parse_weights
from psvideo.errors import PsvideoError, UsageError
from psvideo.export.asked import Asked, delivery_of
from psvideo.export.preview_movie import even, write_movie
from psvideo.export.programs.delivered import Delivered, SeenLight
from psvideo.export.programs.loading_notes import loading_note
from psvideo.export.programs.nuke_script import nuke_script
from psvideo.export.programs.otio import Footage, Images, timeline_text
from psvideo.export.usd.usd_stage import StageView, stage_text
from psvideo.model.choices import Program
from psvideo.plates.beauty import Mix, beauty_of, mix_of
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round

otio = pytest.importorskip("opentimelineio")
SCENES = Path(__file__).resolve().parents[1] / "data_synth"


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clip of a sphere, as the virtual shoot leaves it."""
    folder = tmp_path_factory.mktemp("shoot") / "clip"
    assert main(["synth", str(SCENES / "sphere.toml"), "-o", str(folder), "-q"]) == 0
    return folder


EVERYTHING: tuple[str, ...] = (
    "--plates",
    "--aov",
    "beauty",
    "--with-ambient",
    "--weight",
    "key=0.5",
    "--encode",
    "png16",
)
EVERYTHING += ("--multipart", *(word for name in ("relit", "normals", "plates") for word in ("--preview", name)))


@pytest.fixture(scope="module")
def whole(clip: Path) -> Path:
    """Everything that a run can deliver but depth."""
    out = clip.parent / "whole"
    assert normals(clip, out, *EVERYTHING) == 0
    return out


def normals(clip: Path, out: Path, *more: str) -> int:
    return main(["normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(out), "-q", *more])


def picture(path: Path) -> np.ndarray:
    """Return an EXR's channels in the order R, G, B, or Y."""
    planes = OpenEXR.File(str(path), separate_channels=True).channels()
    return np.stack([planes[name].pixels.astype(np.float32) for name in "RGBY" if name in planes], axis=-1)


def at_or_before(folder: Path, number: int) -> Path:
    """Return a light's plate of a round, or the one before: a dark slot may be cut off at the clip's end."""
    return max(path for path in folder.iterdir() if int(path.name.split(".")[1]) <= number)


def decoded(path: Path) -> tuple[av.video.stream.VideoStream, list[np.ndarray]]:
    with av.open(str(path)) as container:
        return container.streams.video[0], [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def test_the_beauty_plate_is_the_sum_of_the_plates_with_each_light_as_strong_as_asked(whole: Path) -> None:
    for path in (whole / "beauty").iterdir():
        number = path.name.split(".")[1]
        plates = {p.name: picture(at_or_before(p, int(number))) for p in (whole / "plates").iterdir()}
        assert set(plates) > {"key", "ambient"}
        total = sum(image * (0.5 if name == "key" else 1.0) for name, image in plates.items())
        assert np.abs(picture(path) - total).max() < 2e-3
        parts = {part.name(): part for part in OpenEXR.File(str(whole / f"clip.{number}.exr")).parts}
        assert next(iter(parts)) == "beauty", "what viewers show first"
        assert set(parts["beauty"].channels) >= {"RGBA"}, "with a matte"
        assert parts["beauty"].header["colorInteropID"] == OpenEXR.File(str(path)).header()["colorInteropID"] != "data"


def test_split_sums_its_plates_without_ambient_light_unless_asked(clip: Path, tmp_path: Path) -> None:
    plates = tmp_path / "plates"
    assert main(["split", str(clip), "-o", str(plates), "--beauty", "--preview", "plates", "-q"]) == 0
    for path in (plates / "beauty").iterdir():
        number = path.name.split(".")[1]
        lights = [p.name for p in plates.iterdir() if p.is_dir() and p.name not in ("ambient", "beauty", "preview")]
        total = sum(picture(plates / name / f"clip_{name}.{number}.exr") for name in lights)
        assert np.abs(picture(path) - total).max() < 2e-3
    assert (plates / "preview" / "clip_plates.mp4").is_file()
    assert main(["info", str(plates)]) == 0


def test_a_row_that_one_light_lacks_is_missing_in_the_sum() -> None:
    def plate(name: str, seen: list[bool]) -> LightPlate:
        rows = np.array(seen)
        image = np.ones((3, 2), np.float32) * rows[:, None]
        return LightPlate(light=name, number=1, time_s=0.0, picture=mixture_of(image), seen=rows)

    one = Round(number=1, plates=(plate("a", [True, True, False]), plate("b", [True, True, True])))
    total = beauty_of(one, Mix())
    assert total.image[:, 0].tolist() == [2, 2, 0]
    assert total.seen.tolist() == [True, True, False]
    assert beauty_of(one, Mix(weights=(("a", 0.0),))).seen.all(), "a light that does not count need not be seen"
    held = beauty_of(one, mix_of({}, with_ambient=True), plate("ambient", [True, False, True]))
    assert held.image[:, 0].tolist() == [3, 0, 0]


def test_several_weights_are_given_in_one_word_and_never_two_to_one_light() -> None:
    assert parse_weights(["key=0.5,left=2", "rim=0"]) == {"key": 0.5, "left": 2.0, "rim": 0.0}
    with pytest.raises(UsageError, match=r"key is 0\.5 already"):
        parse_weights(["key=0.5", "key=1"])


@pytest.mark.parametrize("text", ["key", "key=", "key=-1", "key=nan", "=x", "key=1,left"])
def test_a_weight_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match=r"such as key=0\.5"):
        parse_weights([text])


def test_weights_without_a_beauty_plate_and_of_unknown_lights_are_refused(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert normals(clip, tmp_path / "out", "--with-ambient") == 2
    assert "Add --aov beauty" in capsys.readouterr().err
    assert normals(clip, tmp_path / "out", "--aov", "beauty", "--weight", "kay=1") == 2
    assert "'key'" in capsys.readouterr().err
    assert main(["split", str(clip), "-o", str(tmp_path / "out"), "--weight", "key=1"]) == 2
    assert "Add --beauty" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_previews_play_with_the_sequences_rate_and_say_which_colours_they_hold(whole: Path) -> None:
    header = OpenEXR.File(str(min((whole / "normals").iterdir()))).header()
    count = len(list((whole / "normals").iterdir()))
    for name in ("relit", "normals", "plates"):
        stream, frames = decoded(whole / "preview" / f"clip_{name}.mp4")
        assert len(frames) == count
        assert stream.average_rate == pytest.approx(header["framesPerSecond"], rel=1e-6)
        assert (stream.width % 2, stream.height % 2) == (0, 0)
        context = stream.codec_context
        assert context.pix_fmt == "yuv420p"
        assert (context.color_primaries, context.colorspace) == (1, 1)  # BT.709 (ITU-T H.273)
        assert (context.color_trc, context.color_range) == (13, 1)  # sRGB; video range
    path = min((whole / "normals").iterdir())
    coded = np.rint(127.5 * (picture(path) + 1))
    middle = tuple(n // 2 for n in coded.shape[:2])
    shown = decoded(whole / "preview" / "clip_normals.mp4")[1][0]
    assert np.abs(shown[middle].astype(float) - coded[middle]).max() <= 4


def test_a_clips_results_come_with_movies_for_browsers_and_editors_unless_none_is_wanted(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert normals(clip, tmp_path / "usual") == 0
    movies = sorted((tmp_path / "usual" / "preview").iterdir())
    assert [movie.name for movie in movies] == ["clip_relit.mov", "clip_relit.mp4"]
    for movie, codec, pixels in zip(movies, ("prores", "vp9"), ("yuv422p10le", "yuv420p"), strict=True):
        stream, frames = decoded(movie)
        assert (stream.codec_context.codec.canonical_name, stream.codec_context.pix_fmt) == (codec, pixels)
        assert len(frames) == len(list((tmp_path / "usual" / "normals").iterdir()))
        held = movie.read_bytes()
        assert held.index(b"moov") < held.index(b"mdat"), "the description comes first"
        assert b"elst" not in held, "the first picture is at 0, and no program has to read that"
    assert normals(clip, tmp_path / "none", "--no-preview") == 0
    assert not (tmp_path / "none" / "preview").exists()
    assert normals(clip, tmp_path / "both", "--no-preview", "--preview", "relit") == 2
    assert "--no-preview" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("codec", "suffix", "pixels"),
    [("vp9", "mp4", "yuv420p"), ("prores", "mov", "yuv422p10le")],
)
def test_a_movie_shows_the_colours_that_it_was_given(codec: str, suffix: str, pixels: str, tmp_path: Path) -> None:
    colours = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [128, 128, 255], [0, 0, 0], [200, 90, 30]], np.uint8)
    given = even(np.repeat(np.repeat(colours[None], 31, axis=0), 21, axis=1)[:, :125])
    assert given.shape == (32, 126, 3)
    path = tmp_path / f"a.{suffix}"
    write_movie(path, [given] * 3, fps=Fraction(24000, 1001), codec=codec)  # type: ignore[arg-type]
    stream, frames = decoded(path)
    assert (stream.average_rate, stream.codec_context.pix_fmt) == (Fraction(24000, 1001), pixels)
    for place, colour in enumerate(colours):
        assert np.abs(frames[2][16, 21 * place + 10].astype(int) - colour).max() <= 4
    with pytest.raises(PsvideoError, match="no picture"):
        write_movie(path, [], fps=Fraction(24))
    assert [p.name for p in tmp_path.iterdir()] == [path.name], "a movie that fails leaves the one before"


def test_a_movie_of_an_odd_width_has_the_same_bytes_whatever_else_runs(tmp_path: Path) -> None:
    """FFmpeg's threads write over each other where rows end between their steps of pixels."""
    picture = np.random.default_rng(1).integers(0, 255, (384, 400, 3), dtype=np.uint8)
    written = set()
    for _ in range(6):
        write_movie(tmp_path / "a.mov", [picture] * 12, fps=Fraction(24), codec="prores")
        written.add((tmp_path / "a.mov").read_bytes())
    assert len(written) == 1


def test_the_timeline_ties_every_sequence_to_the_clip(whole: Path, clip: Path) -> None:
    timeline = otio.adapters.read_from_file(str(whole / "clip.otio"))
    tracks = {track.name: track for track in timeline.tracks}
    assert {"clip", "normals", "albedo", "valid", "beauty", "plates/key", "normals_png16"} < set(tracks)
    fps = float(OpenEXR.File(str(min((whole / "normals").iterdir()))).header()["framesPerSecond"])
    for name, track in tracks.items():
        (held,) = track
        media = held.media_reference
        assert media.available_range == held.source_range or name == "clip"
        for index in range(media.number_of_images_in_sequence()):
            assert (whole / media.target_url_for_image_number(index)).is_file()
        assert media.rate == pytest.approx(100 if name == "clip" else fps)
    footage = tracks["clip"][0]
    files = sorted(path.name for path in (clip / "frames").iterdir())
    first = int(footage.source_range.start_time.value - footage.media_reference.start_frame)
    time_s = float(OpenEXR.File(str(min((whole / "normals").iterdir()))).header()["psvideo:time_s"])
    assert first == int(time_s * 100), "the clip begins with the frame that was open at the first instant"
    assert Path(footage.media_reference.target_url_for_image_number(first)).name == files[first]
    assert footage.duration().to_seconds() == pytest.approx(tracks["normals"].duration().to_seconds(), abs=0.02)


def test_a_sequence_that_begins_later_lies_later_and_a_movie_is_named(tmp_path: Path) -> None:
    def images(name: str, first: int) -> Images:
        return Images(name=name, folder=f"{name}/", prefix="a.", suffix=".exr", first=first, count=4, fps=Fraction(24))

    footage = Footage(name="m", media="../m.mov", frames=100, fps=Fraction(120), start=5)
    path = tmp_path / "a.otio"
    path.write_text(timeline_text("a", [images("x", 1001), images("y", 1003)], footage))
    movie, x, y = otio.adapters.read_from_file(str(path)).tracks
    assert movie[0].media_reference.target_url == "../m.mov"
    assert movie[0].source_range == otio.opentime.TimeRange(
        otio.opentime.RationalTime(5, 120), otio.opentime.RationalTime(30, 120)
    )
    assert y.range_of_child(y[1]).start_time.to_seconds() - x.range_of_child(x[0]).start_time.to_seconds() == 2 / 24


def test_a_stopped_run_goes_on_to_the_same_delivery(clip: Path, whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = clip.parent / "again"

    def stop(*_: object, **__: object) -> None:
        raise PsvideoError("stopped")

    with monkeypatch.context() as patched:
        patched.setattr("psvideo.runs.delivery.handover.write_preview", stop)
        assert normals(clip, out, *EVERYTHING) == 1
    assert not out.exists()
    partial = clip.parent / ".again.partial"
    min((partial / "plates" / "key").iterdir()).unlink()
    min((partial / "beauty").iterdir()).unlink()
    min((partial / "preview" / ".relit").iterdir()).unlink()
    assert normals(clip, out, *EVERYTHING, "--resume") == 0
    assert digest_of_results(out) == digest_of_results(whole)


def test_a_preset_sets_what_its_program_wants_and_says_how_to_load_it(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert normals(clip, out, "--for", "unreal", "--frames", "1-20") == 0
    header = OpenEXR.File(str(min((out / "normals").iterdir()))).header()
    assert (header["psvideo:space"], header["psvideo:y"]) == ("tangent", "down")
    assert list((out / "normals_png16").iterdir())
    said = (out / "README-unreal.txt").read_text(encoding="utf-8")
    assert "Flip Green Channel off" in said
    assert "green channel is flipped" in said
    number = min((out / "normals").iterdir()).name.split(".")[1]
    assert f"clip_normals.{number}.png" in said
    command = ["normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(tmp_path / "up"), "--frames", "1-20"]
    assert main([*command, "--for", "unreal", "--y", "up"]) == 0
    assert "--y up goes against --for unreal" in capsys.readouterr().err
    header = OpenEXR.File(str(min((tmp_path / "up" / "normals").iterdir()))).header()
    assert header["psvideo:y"] == "up"
    assert "Flip Green Channel on" in (tmp_path / "up" / "README-unreal.txt").read_text(encoding="utf-8")


def moving_camera(path: Path, codes: range) -> Path:
    """A USD camera that is at x = its time code, turned by a degree a code."""
    usd, geom, gf = (pytest.importorskip(f"pxr.{name}") for name in ("Usd", "UsdGeom", "Gf"))
    stage = usd.Stage.CreateNew(str(path))
    geom.SetStageUpAxis(stage, "Z")
    geom.SetStageMetersPerUnit(stage, 0.01)
    camera = geom.Camera.Define(stage, "/shot")
    place, turn = camera.AddTranslateOp(), camera.AddRotateYOp()
    for code in codes:
        place.Set(gf.Vec3d(code, 0, 0), code)
        turn.Set(float(code), code)
    stage.Save()
    return path


def test_normals_in_the_world_of_a_moving_camera_are_turned_by_where_it_was(clip: Path, tmp_path: Path) -> None:
    frames = len(list((clip / "frames").iterdir()))
    world = ("--space", "world", "--camera-to-world", str(moving_camera(tmp_path / "shot.usda", range(1, frames + 1))))
    assert normals(clip, tmp_path / "out", *world, "--encode", "png16") == 0
    assert normals(clip, tmp_path / "camera") == 0
    for path in (tmp_path / "out" / "normals").iterdir():
        header = OpenEXR.File(str(path)).header()
        code = 1 + 100 * header["psvideo:time_s"]  # the clip has 100 frames a second
        matrix = np.reshape([float(word) for word in header["psvideo:camera_to_world"].split()], (4, 4))
        assert matrix[0, 3] == pytest.approx(code, abs=1e-4)
        turn = np.radians(code)
        rotation = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
        local = picture(tmp_path / "camera" / "normals" / path.name)
        assert np.abs(picture(path) - local @ rotation.T).max() < 2e-3
        assert (header["psvideo:up"], header["psvideo:meters_per_unit"]) == ("z", pytest.approx(0.01))
    valid = picture(next((tmp_path / "out" / "valid").iterdir()))
    assert valid.any()


def test_a_camera_that_is_known_for_a_part_of_the_clip_is_refused_before_any_work(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    short = moving_camera(tmp_path / "short.usda", range(1, 5))
    assert normals(clip, tmp_path / "out", "--space", "world", "--camera-to-world", str(short)) == 1
    said = capsys.readouterr().err
    assert "moves from time code 1 to 4" in said
    assert "--camera-time" in said
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / ".out.partial").exists()


NOTHING = Asked()


@pytest.mark.parametrize("name", get_args(Program))
def test_every_program_has_a_note_with_numbers_rate_colour_and_wrong_ways(name: Program) -> None:
    delivery, at_odds = delivery_of(replace(NOTHING, preset=name))
    assert at_odds == ()
    made = Delivered(
        clip="take7",
        numbers=tuple(range(1001, 1101)),
        fps=Fraction(24000, 1001),
        width_px=64,
        height_px=48,
        metric=True,
        delivery=delivery,
    )
    said = loading_note(name, made)
    for words in ("1001", "1100", "23.976", "Known wrong ways", "take7", "sRGB" if delivery.png16 else "Raw"):
        assert words in said
    assert ("position" in delivery.aovs) == ("Positions are" in said)
    assert "where it is 0, a normal is a best estimate" in said, "what was filled has a normal too"
    assert "relative" not in said, "these positions are in metres"


def test_a_camera_beside_a_preset_puts_the_delivery_into_its_world(tmp_path: Path) -> None:
    matrix = tmp_path / "camera.txt"
    matrix.write_text("1 0 0 4  0 1 0 5  0 0 1 6  0 0 0 1")
    delivery, at_odds = delivery_of(replace(NOTHING, preset="nuke", camera_to_world=matrix))
    assert (delivery.space.name, at_odds) == ("world", ())
    assert delivery.multipart
    with pytest.raises(UsageError, match='belongs to `space="world"`'):
        delivery_of(replace(NOTHING, preset="unreal", camera_to_world=matrix))
    with pytest.raises(UsageError, match='belongs to `space="world"`'):
        delivery_of(replace(NOTHING, camera_to_world=matrix))


def test_options_that_go_against_a_preset_win_and_are_reported() -> None:
    asked = replace(NOTHING, preset="nuke", y="down", space="tangent", multipart=False)
    delivery, at_odds = delivery_of(asked)
    assert (delivery.space.y, delivery.space.name, delivery.multipart) == ("down", "tangent", False)
    assert [sentence.split()[0] for sentence in at_odds] == ["`y='down'`", "`space='tangent'`", "`multipart=False`"]


def test_positions_without_metres_are_left_out_of_a_programs_delivery_and_refused_where_they_are_asked_for(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(tmp_path / "out"), "--for", "houdini"]
    assert main([*words, "--aov", "position"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--for houdini has no positions: without [camera] focal_px in the rig depth is relative" in said
    assert not (tmp_path / "out").exists()
    assert main([*words, "--frames", "0-9"]) == 0
    assert "has no positions" in " ".join(capsys.readouterr().out.split())
    assert not {"position", "depth"} & {path.name for path in (tmp_path / "out").iterdir()}
    assert "position" not in (tmp_path / "out" / "README-houdini.txt").read_text(encoding="utf-8").lower()


@pytest.mark.parametrize("program", ["houdini", "nuke"])
def test_depth_alone_is_no_position_in_a_programs_note(program: Program) -> None:
    delivery, _ = delivery_of(replace(NOTHING, preset=program, aov=("depth",)))
    delivery = replace(delivery, aovs=tuple(one for one in delivery.aovs if one != "position"))
    made = Delivered(
        clip="take7", numbers=(1, 2, 9), fps=Fraction(24), width_px=64, height_px=48, metric=False, delivery=delivery
    )
    said = loading_note(program, made)
    assert "Numbers 1 to 9 (3 results; 6 numbers between them missing)" in said
    assert "Depth is in a relative unit." in said
    assert "Positions are" not in said
    assert "positions = position" not in said
    unsized = [line.lower() for line in said.splitlines() if "relative" in line]
    assert not any("position" in line for line in unsized), "what has no size here is depth"


def test_nuke_s_note_promises_the_lights_that_its_script_holds() -> None:
    made = Delivered(
        clip="take7",
        numbers=(1, 2),
        fps=Fraction(24),
        width_px=64,
        height_px=48,
        metric=False,
        delivery=delivery_of(replace(NOTHING, preset="nuke"))[0],
        lights=(SeenLight(name="rim", direction=(0.0, 0.6, 0.8)),),
    )
    without = replace(made, lights=())
    assert "rim" in nuke_script(made)
    assert "a relighting group for every light of the shoot" in loading_note("nuke", made)
    assert "rim" not in nuke_script(without)
    assert "for one light of its own" in loading_note("nuke", without)


@pytest.mark.parametrize("name", ["take [3]", '5$ "a"', "back\\slash", "plain_01"])
def test_tcl_leaves_a_clip_s_name_in_nuke_s_script_as_nuke_is_to_read_it(name: str) -> None:
    tcl = pytest.importorskip("tkinter").Tcl()
    delivery, _ = delivery_of(replace(NOTHING, preset="nuke"))
    made = Delivered(
        clip=name, numbers=(1, 2), fps=Fraction(24), width_px=64, height_px=48, metric=False, delivery=delivery
    )
    said = re.search(r'^ file (".*")$', nuke_script(made), re.MULTILINE)
    assert said is not None
    knob = tcl.eval(f"set knob {said.group(1)}")
    in_brackets = re.sub(r"([\[\]\\])", r"\\\1", name)
    assert knob == f"[file dirname [value root.name]]/normals/{in_brackets}_normals.%04d.exr"


@pytest.mark.parametrize("lights", [("key-1", "key_1"), ("左", "右"), ("3", "_3")])
def test_lights_that_usd_cannot_tell_apart_get_names_of_their_own(lights: tuple[str, ...], tmp_path: Path) -> None:
    usd = pytest.importorskip("pxr.Usd")
    delivery, _ = delivery_of(replace(NOTHING, preset="houdini"))
    made = Delivered(
        clip="a@b", numbers=(1, 2), fps=Fraction(24), width_px=64, height_px=48, metric=False, delivery=delivery
    )
    seen = (SeenLight(name=lights[0], direction=(0.6, 0.0, 0.8)), SeenLight(name=lights[1], direction=(0.0, 0.6, 0.8)))
    view = StageView(focal=1.0, middle=(0.0, 0.0), away_m=None, poses={}, lights=seen)
    (tmp_path / "x.usda").write_text(stage_text(made, (1, 2), view), encoding="utf-8")
    stage = usd.Stage.Open(str(tmp_path / "x.usda"))
    suns = [prim for prim in stage.Traverse() if prim.GetTypeName() == "DistantLight"]
    assert len({sun.GetName() for sun in suns}) == 2
    ways = [np.array(sun.GetAttribute("xformOp:transform").Get())[2, :3] for sun in suns]
    np.testing.assert_allclose(ways, [one.direction for one in seen], atol=1e-6)
