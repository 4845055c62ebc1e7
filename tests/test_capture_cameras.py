"""The table of cameras is plausible, sourced and found by the names that people use."""

import csv
from fractions import Fraction
from pathlib import Path

import pytest

from psvideo.capture.cameras import CameraMode, camera_modes, find_mode, find_model, nearest_names
from psvideo.errors import UsageError

MODES = camera_modes()


def test_the_table_has_many_modes_of_many_cameras_and_no_mode_twice() -> None:
    assert len(MODES) >= 40
    assert len({mode.name for mode in MODES}) >= 40
    keys = [(mode.name, mode.width_px, mode.height_px, mode.fps, mode.mode) for mode in MODES]
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: f"{mode.name} {mode.mode}")
def test_every_mode_reads_within_its_frame_and_says_where_the_figure_comes_from(mode: CameraMode) -> None:
    assert abs(mode.readout_s) <= float(1 / mode.fps)
    assert mode.readout_s == 0 or abs(mode.readout_s) > 1e-3
    assert len(mode.source) > 10
    assert mode.sure in {"measured", "consistent", "single", "specification", "assumed"}
    assert mode.width_px >= mode.height_px > 700
    assert mode.make
    assert mode.model
    assert mode.mode


def test_no_figure_is_one_of_the_placeholders_that_users_left_in_their_profiles() -> None:
    placeholders_ms = {4.89, 15.99, 19.99, 32.99, 33.37, 39.99, 16.6833}
    assert not placeholders_ms & {round(mode.readout_s * 1e3, 4) for mode in MODES}


def test_figures_that_several_users_agreed_on_are_in_their_profiles(shared_data: Path) -> None:
    with (shared_data / "readout_times" / "gyroflow_readout.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for mode in MODES:
        if mode.sure != "consistent" or "Gyroflow" not in mode.source or "slashCAM" in mode.source:
            continue
        near = [
            row
            for row in rows
            if mode.make.split()[0].lower() in row["brand"].lower()
            and _number(row["frame_readout_time_ms"]) == pytest.approx(mode.readout_s * 1e3, rel=0.03)
        ]
        assert len(near) >= 2, mode


def _number(text: str | None) -> float:
    try:
        return abs(float(text or "nan"))
    except ValueError:
        return float("nan")


def test_the_paper_s_camera_is_there_and_its_assumed_readout_is_called_assumed() -> None:
    mode = find_mode("Sony F65", fps=Fraction(120), size_px=None)
    assert (mode.width_px, mode.height_px, float(mode.fps)) == (1920, 1080, 120.0)
    assert mode.sure == "assumed"


@pytest.mark.parametrize(
    ("typed", "name"),
    [
        ("sony f65", "Sony F65"),
        ("F-65", "Sony F65"),
        ("α7 IV", "Sony A7 IV"),
        ("a7siii", "Sony A7S III"),
        ("A7S 3", "Sony A7S III"),
        ("Canon R5", "Canon EOS R5"),
        ("r5c", "Canon EOS R5 C"),
        ("EOS R6 mk ii", "Canon EOS R6 Mark II"),
        ("a7rv", "Sony A7R V"),
        ("pocket 6k", "Blackmagic Pocket Cinema Camera 6K"),
        ("v-raptor", "RED V-RAPTOR [X]"),
        ("gh7", "Panasonic Lumix GH7"),
    ],
)
def test_a_camera_is_found_by_what_people_call_it(typed: str, name: str) -> None:
    assert {mode.name for mode in find_model(typed)} == {name}


def test_every_camera_is_found_by_its_own_name() -> None:
    for mode in MODES:
        assert mode in find_model(mode.name)
        assert find_model(mode.name) == find_model(mode.name.upper())


@pytest.mark.parametrize(
    "typed", ["Sony", "iPhone 99", "", "!!", "Phone X", "iPhone X", "iPhone 7", "C300", "Huawei P30"]
)
def test_what_names_no_single_camera_is_not_guessed(typed: str) -> None:
    assert find_model(typed) == ()


def test_an_unknown_camera_gets_the_nearest_names_and_how_to_measure() -> None:
    assert nearest_names("Sony F56")[0] in {"Sony F55", "Sony F65"}
    assert nearest_names("Acme Oculus 9") == (), "of another maker, and unlike"
    with pytest.raises(UsageError) as refusal:
        find_mode("Sonny F66", fps=None, size_px=None)
    message = str(refusal.value)
    assert "'Sony F65'" in message
    assert "calibration/README.md" in message
    assert "`readout_s`" in message


@pytest.mark.parametrize(
    ("typed", "maker"),
    [
        ("Sony FX9", "Sony"),
        ("iPhone 16 Pro", "Apple"),
        ("iphone13", "Apple"),
        ("galaxy s24", "Samsung"),
        ("RED Monstro", "RED"),
        ("Blackmagic Pyxis 6K", "Blackmagic"),
        ("Canon R5 Mark II", "Canon"),
        ("Lumix S9", "Panasonic"),
        ("ARRI Alexa Mini LF", "ARRI"),
    ],
)
def test_an_unknown_model_gets_the_nearest_of_its_maker_and_of_no_other(typed: str, maker: str) -> None:
    near = nearest_names(typed)
    assert near
    assert {name.split()[0] for name in near} == {maker}


@pytest.mark.parametrize("typed", ["Pixel 8", "Vision Research Phantom", "Xiaomi 14", "Nokia 3310"])
def test_a_maker_who_is_not_in_the_table_gets_no_other_makers_cameras(typed: str) -> None:
    assert nearest_names(typed) == ()


def test_a_mode_is_found_by_its_rate_whether_120_or_119_88_is_typed() -> None:
    by_name = find_mode("z9", fps=Fraction(120), size_px=(3840, 2160))
    assert by_name == find_mode("z9", fps=Fraction(120_000, 1001), size_px=(3840, 2160))
    assert by_name.fps == Fraction(120_000, 1001)
    with pytest.raises(UsageError, match="several modes"):
        find_mode("z9", fps=Fraction(120), size_px=None)
    with pytest.raises(UsageError, match="not in this mode"):
        find_mode("z9", fps=Fraction(100), size_px=None)
