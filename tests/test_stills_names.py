"""Which photograph belongs to which light: by names that say the same, by counts, by order."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from still_pictures import LIGHTS, NAMES, SIZE, error_deg, listed, lit, photographs, remarks, save8, save16

import psvideo as ps
from psvideo.calibrate.still_pairs import pair_stills
from psvideo.errors import PsvideoError


def test_pictures_find_their_lights_by_name_whatever_the_order_and_the_holes(tmp_path: Path) -> None:
    folder = photographs(tmp_path / "photos", lit())
    turned = [3, 0, 5, 1, 4, 2]
    lights = listed(tmp_path / "lights.lp", [f"C:\\rti\\{NAMES[n]}.JPG" for n in turned], LIGHTS[turned])
    report = ps.stills(folder, lights=lights, out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1
    assert "belong to lights by name" in remarks(report)
    assert not report.timing.dropped_frames


def test_pictures_without_names_belong_to_lights_by_order_and_the_report_says_so(tmp_path: Path) -> None:
    folder = photographs(tmp_path / "photos", lit())
    report = ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1
    said = remarks(report)
    assert "by order, since lights.lp names none of them: shot 3.png shows 'L0', and so on" in said
    assert "to shot 22.png, which shows 'L5'" in said
    setup = tmp_path / "out" / "setup"
    assert {"plan.toml", "rig.toml", "lights.lp"} == {file.name for file in setup.iterdir()}
    again = ps.stills(folder, lights=setup / "rig.toml", out=tmp_path / "out", force=True)
    assert "by name (rig.toml)" in remarks(again)
    assert error_deg(tmp_path / "out") < 1


@pytest.mark.parametrize(("left_aside", "named"), [("room light", True), ("black", False), ("another light", False)])
def test_a_picture_without_a_light_that_may_show_the_room_is_named(
    left_aside: str, named: bool, tmp_path: Path
) -> None:
    ambient = 0.1 * (1 + np.mgrid[:SIZE, :SIZE][0] / SIZE)
    shown = {"room light": ambient, "black": 0.001 * ambient, "another light": lit()[2] + ambient}[left_aside]
    folder = photographs(tmp_path / "photos", [np.clip(one + ambient, 0, 1) for one in lit()])
    save16(folder / "IMG_0007.png", shown)
    lights = listed(tmp_path / "lights.lp", NAMES)
    report = ps.stills(folder, lights=lights, out=tmp_path / "out", transfer="linear")
    assert "Left aside: IMG_0007.png" in remarks(report)
    said = "IMG_0007.png belongs to no light and is nowhere brighter than the others"
    assert (said in remarks(report)) == named


def named_pictures(folder: Path, names: Sequence[str]) -> Path:
    folder.mkdir()
    for level, name in enumerate(names):
        Image.new("L", (8, 8), 40 + level).save(folder / name)
    return folder


@pytest.mark.parametrize(
    ("listed", "pictures"),
    [
        (
            ("Bu\u0308ste 2.jpg", "Bu\u0308ste 0.jpg", "Bu\u0308ste 1.jpg"),
            ("B\u00fcste 2.jpg", "B\u00fcste 0.jpg", "B\u00fcste 1.jpg"),
        ),
        (("img03.jpg", "img01.jpg", "img02.jpg"), ("img3.jpg", "img1.jpg", "img2.jpg")),
        (("DSC_103.NEF", "DSC_101.NEF", "DSC_102.NEF"), ("DSC_103_edit.jpg", "DSC_101_edit.jpg", "DSC_102_edit.jpg")),
        (("a_3_edit.jpg", "a_1_edit.jpg", "a_2_edit.jpg"), ("a_3.jpg", "a_1.jpg", "a_2.jpg")),
        (("img3.jpg", "img1.jpg", "img2.jpg"), ("IMG3.JPG", "img1.jpg", "img2.jpg")),
        (("1.jpg", "10.jpg", "100.jpg"), ("001.jpg", "010.jpg", "100.jpg")),
    ],
    ids=["accents", "zeros", "a word more", "a word less", "large letters", "all zeros"],
)
def test_pictures_are_found_by_names_that_say_the_same(
    listed: tuple[str, ...], pictures: tuple[str, ...], tmp_path: Path
) -> None:
    """By order, as the files are sorted, each would get another one's light."""
    folder = named_pictures(tmp_path / "photos", pictures)
    found = pair_stills(folder, listed, named=True, whose="lights.lp")
    assert [file.name for file in found.files] == list(pictures)
    assert "by name" in found.how


def test_a_list_that_names_other_pictures_and_counts_otherwise_is_refused(tmp_path: Path) -> None:
    folder = named_pictures(tmp_path / "photos", ("shot1.jpg", "shot2.jpg", "shot3.jpg"))
    with pytest.raises(PsvideoError, match="numbers do not ascend as the pictures' do"):
        pair_stills(folder, ("dome_7.jpg", "dome_2.jpg", "dome_9.jpg"), named=True, whose="lights.lp")
    for names in (("dome_2.jpg", "dome_7.jpg", "dome_9.jpg"), ("key", "left", "top")):
        found = pair_stills(folder, names, named=True, whose="lights.lp")
        assert [file.name for file in found.files] == ["shot1.jpg", "shot2.jpg", "shot3.jpg"]
        assert "by order" in found.how


def test_lights_of_which_there_is_no_picture_are_left_out_and_named(tmp_path: Path) -> None:
    """Six photographs of a dome of 96: nobody takes ninety lines out by hand."""
    kept = [0, 1, 3, 5]
    folder = photographs(tmp_path / "photos", [lit()[n] for n in kept], [NAMES[n] for n in kept])
    turned = [3, 0, 5, 1, 4, 2]
    lights = listed(tmp_path / "lights.lp", [f"{NAMES[n]}.jpg" for n in turned], LIGHTS[turned])
    report = ps.stills(folder, lights=lights, out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1
    assert "2 of the 6 lights are left out, as no picture bears the name: shot 21.jpg, shot 8.jpg of" in remarks(report)
    assert {light.name for light in ps.read_rig(tmp_path / "out" / "setup" / "rig.toml").lights} == {
        NAMES[n] for n in kept
    }


def test_pictures_that_bear_a_rigs_lights_need_not_be_all(tmp_path: Path) -> None:
    folder = named_pictures(tmp_path / "photos", ("vase_key.png", "vase_top.png", "vase_left.png"))
    found = pair_stills(folder, ("key", "left", "rim", "top"), named=True, whose="rig.toml")
    assert (found.names, found.places) == (("key", "left", "top"), (0, 1, 3))
    (folder / "vase_top.png").rename(folder / "vase_top2.png")
    with pytest.raises(PsvideoError, match=r"Pictures without a light: vase_top2.png"):
        pair_stills(folder, ("key", "left", "rim", "top"), named=True, whose="rig.toml")


def test_names_that_end_alike_are_told_apart_and_what_shows_no_light_is_named(tmp_path: Path) -> None:
    names = ("left", "top_left", "top")
    for number, name in enumerate([*(f"take_{name}" for name in names), "a_dark", "dark", "room"]):
        save8(tmp_path / f"{name}.png", np.full((8, 8), 0.1 * number))
    found = pair_stills(tmp_path, names, named=True, whose="lights.lp")
    assert [file.stem for file in found.files] == [f"take_{name}" for name in names]
    assert found.dark == tmp_path / "dark.png"
    assert [file.name for file in found.aside] == ["a_dark.png", "room.png"]


def test_a_name_that_begins_two_pictures_is_asked_about(tmp_path: Path) -> None:
    folder = named_pictures(tmp_path / "photos", ("a_1.jpg", "a_1_b.jpg", "a_2_b.jpg", "a_3_b.jpg"))
    found = pair_stills(folder, ("a_1", "a_2_b", "a_3_b"), named=True, whose="lights.lp")
    assert [file.name for file in found.files] == ["a_1.jpg", "a_2_b.jpg", "a_3_b.jpg"]
