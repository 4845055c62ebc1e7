"""Options and photographs that cannot be meant, and what the command and ``info`` say of a folder."""

import errno
from pathlib import Path

import numpy as np
import pytest
from still_pictures import LIGHTS, NAMES, SIZE, chunk, facing, listed, lit, photographs, save8, save16, with_exposures

import psvideo as ps
from psvideo.cli.app import main
from psvideo.errors import PsvideoError
from psvideo.formats.whole_files import whole_file
from psvideo.inspect.describe import describe
from psvideo.runs.instants.shot_and_settings import sentences


def test_pictures_of_no_size_are_refused(tmp_path: Path) -> None:
    folder = photographs(tmp_path / "photos", [facing(light, (3, 2000)) for light in LIGHTS])
    with pytest.raises(PsvideoError, match="is a picture of 2000 x 3 pixels"):
        ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")


def test_pictures_a_folder_deeper_are_pointed_to(tmp_path: Path) -> None:
    photographs(tmp_path / "photos", lit())
    with pytest.raises(PsvideoError, match="The folder photos in it holds pictures: name that one"):
        ps.stills(tmp_path, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")


def test_of_several_folders_with_pictures_each_is_named_before_a_ball_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in archives that hold a subject's folder beside those of two balls."""
    for name in ("ball_left", "ball_right", "subject"):
        photographs(tmp_path / name, lit())
    monkeypatch.setattr("psvideo.runs.stills.sphere_lights", lambda *_, **__: pytest.fail("minutes were lost"))
    with pytest.raises(PsvideoError, match=r"pictures: ball_left, ball_right, subject\. Name one of these\."):
        ps.stills(tmp_path, sphere=[tmp_path / "ball_left"], out=tmp_path / "out")


BAD: dict[str, tuple[str, ...]] = {
    "unknown light": ("names 9.png, and no picture is called so", "Pictures without a light: shot 22.png"),
    "too few lights": ("holds 6 pictures of lights", "lists 5 lights"),
    "another size": ("shot 8.png: is 32 x 64 pixels", "Expected pictures of one camera"),
    "another kind": ("shot 3.png is PNG and shot 8.tif is TIFF", "of one kind"),
    "another curve": ("shot 8.png: says that its curve is linear", "Pictures with different curves cannot be compared"),
    "no lights": ("`lights` and `sphere`: expected one of the two",),
    "no folder": ("is no folder",),
}


@pytest.mark.parametrize(
    ("words", "status", "says"),
    [
        (["--dark", "photos"], 1, "photos: is a folder, and one picture is expected"),
        (["--dark", "no.png"], 1, "no.png: there is no such file"),
        (["--dark", "lights.lp"], 1, "lights.lp: is no picture that psvideo reads"),
        (["--mask", "photos"], 1, "photos: is a folder, and one picture is expected"),
        (["--transfer", "slog4"], 2, "--transfer is 'slog4', not a curve that this psvideo knows; did you mean"),
        (["--radius-mm", "20"], 2, "--radius-mm describes mirror spheres, and --lights"),
        (["--circle", "80,60,40"], 2, "--circle describes mirror spheres"),
        (["--spheres", "2"], 2, "--spheres describes mirror spheres"),
        (["--aov", "motion"], 2, "--aov motion: photographs of a still scene show no motion"),
    ],
)
def test_options_that_cannot_be_meant_are_one_paragraph(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    status: int,
    says: str,
) -> None:
    photographs(tmp_path / "photos", lit())
    listed(tmp_path / "lights.lp")
    monkeypatch.chdir(tmp_path)
    assert main(["stills", "photos", "--lights", "lights.lp", "-o", "out", *words]) == status
    said = capsys.readouterr()
    assert says in said.err
    assert said.err.count("\n") == 1
    assert not said.out
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_go_together_is_said_in_one_paragraph_and_nothing_is_written(tmp_path: Path, case: str) -> None:
    save = save8 if case == "another curve" else save16
    folder = photographs(tmp_path / "photos", lit(), save=save)
    lights: Path | None = listed(tmp_path / "lights.lp", None)
    if case == "unknown light":
        lights = listed(tmp_path / "lights.lp", [*NAMES[:5], "9.png"])
    if case == "too few lights":
        lights = listed(tmp_path / "lights.lp", None, LIGHTS[:5])
    if case == "another size":
        save16(folder / "shot 8.png", np.full((64, 32), 0.2))
    if case == "another kind":
        (folder / "shot 8.png").rename(folder / "shot 8.tif")
    if case == "another curve":
        save8(folder / "shot 8.png", lit()[2], pnginfo=chunk(b"gAMA", (100000).to_bytes(4, "big")))
    if case == "no lights":
        lights = None
    if case == "no folder":
        folder = tmp_path / "elsewhere"
    with pytest.raises(ps.PsvideoError) as fault:
        ps.stills(folder, lights=lights, out=tmp_path / "out")
    for part in BAD[case]:
        assert part in str(fault.value)
    assert "\n" not in str(fault.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("stopped", [False, True])
def test_what_ends_a_run_of_photographs_leaves_nothing_and_names_no_option_that_it_does_not_have(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], stopped: bool
) -> None:
    """At the end normals, albedo and validity are whole, but nothing goes on from them."""
    folder, lights = photographs(tmp_path / "photos", lit()), listed(tmp_path / "lights.lp")

    def end(*_: object) -> None:
        if stopped:
            raise KeyboardInterrupt
        with whole_file(next(tmp_path.glob(".out.partial")) / "rti"):
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("psvideo.runs.stills.write_setup", lambda *_, **__: end())
    assert main(["stills", str(folder), "--lights", str(lights), "-o", str(tmp_path / "out")])
    said = capsys.readouterr().err
    assert "No space left on device" in said or stopped
    assert "--resume" not in said
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lights.lp", "photos"]


def test_the_command_says_what_it_assumed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = photographs(tmp_path / "photos", lit(), save=save8)
    listed(tmp_path / "lights.lp")
    words = ["stills", str(folder), "--lights", str(tmp_path / "lights.lp"), "-o", str(tmp_path / "out")]
    assert main(words) == 0
    said = capsys.readouterr()
    assert "read as 'srgb'" in said.out + said.err
    assert "say --transfer linear" in said.err
    assert main(words) == 2
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<h2>Over time</h2>" not in page, "one picture has no course"
    assert "The only result</summary>" in page
    assert ".;" not in page[page.index("Remarks") :], "sentences are joined once"
    assert not any(words in page for words in ("a second", "shutter", "Lasts", "<h2>Timing</h2>", "Strobe"))


def test_remarks_are_joined_as_sentences() -> None:
    assert sentences([]) == ""
    assert sentences(["One stands alone"]) == "One stands alone."
    assert sentences(["Each ends once.", "A capital begins one", "x.png follows."]) == (
        "Each ends once. A capital begins one; x.png follows."
    )


def test_info_says_what_a_folder_of_photographs_is_read_as_and_what_differs(tmp_path: Path) -> None:
    folder = with_exposures(tmp_path / "photos", lit(), [0.02, 0.01, 0.02, 0.02, 0.02, 0.02])
    save8(folder / "ambient.jpg", np.zeros((SIZE, SIZE)))
    said = [finding.text for finding in describe(folder).findings]
    assert said[0] == "as photographs, 6 lights: shot 3.jpg to shot 22.jpg, jpeg, 64 x 64 pixels, 1 channel, 8 bits"
    assert said[1].startswith("read as 'srgb', the usual curve")
    assert "exposures differ by up to a factor 2, as EXIF says" in said
    assert "ambient.jpg shows ambient light" in said
    assert "need none: psvideo stills" in said[-1]
