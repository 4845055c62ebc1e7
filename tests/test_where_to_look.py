"""A check looks where there is something to see: the start of a take may be dark, or its subject not there yet."""

import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from coarse_ball import COARSE_BALL
from filmed import filmed
from picture_file import read_picture
from written_movies import write_rgb16

from psvideo.runs.check import check
from psvideo.runs.steps.checked import Check, check_record

SPHERE = (Path(__file__).resolve().parents[1] / "data_synth" / "sphere.toml").read_text()
FRAMES, LATE = 130, 80
"""A check looks at the first 30 frames, and at 60 where these show nothing; LATE of them come before the subject."""
SCENES = {
    "stands": SPHERE.replace("frames = 12", f"frames = {FRAMES}"),
    "enters": SPHERE.replace("frames = 12", f"frames = {FRAMES}")
    .replace('mesh = "sphere"', f'mesh = "{COARSE_BALL}"')
    .replace(
        "albedo = 0.8",
        "albedo = 0.8\nposition_m = [-2.6, 0.0, 0.0]\n[object.motion]\nvelocity_m_per_s = [2.2, 0.0, 0.0]",
    ),
}
BLACK = 4096
"""The code of no light in these 16-bit files of 12-bit frames."""


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Film one of the scenes, once."""
    return filmed(tmp_path_factory.mktemp("shoots"), SCENES)


def dimmed(clip: Path, to: Path, share: float, frames: range) -> Path:
    """Copy a clip with some of its frames, counted from 0, dimmed to a share of their light, with noise of its own."""
    shutil.copytree(clip, to)
    rng = np.random.default_rng(5)
    for n, file in enumerate(sorted((to / "frames").iterdir())):
        if n in frames:
            codes = read_picture(file, cv2.IMREAD_UNCHANGED).astype(np.float64)
            light = BLACK + share * (codes - BLACK) + rng.normal(0, 16, codes.shape)
            cv2.imwrite(str(file), np.clip(light.round(), 0, 65535).astype(np.uint16))
    return to


def found(check: Check, subject: str) -> str:
    return next(f"{one.grade}: {one.sentence}" for one in check.judgements if one.subject == subject)


def test_a_take_that_is_dark_at_first_is_judged_where_its_lamps_flash(
    shot: Callable[[str], Path], tmp_path: Path
) -> None:
    one = check(dimmed(shot("stands"), tmp_path / "clip", 0.0, range(LATE)))
    assert one.usable
    assert LATE < one.judged[0] < one.judged[1] <= FRAMES
    assert found(one, "strobe").startswith("good")
    assert any(f"frames {one.judged[0]} to {one.judged[1]}" in note and "no strobe" in note for note in one.notes)
    assert check_record(one)["judged"] == [*one.judged]
    assert one.looked_at < FRAMES


def test_a_subject_that_comes_in_late_is_what_is_judged(shot: Callable[[str], Path]) -> None:
    """It is in the picture from 0.82 s on, whole from 1 s on: the first 60 of 130 frames, 0.6 s, show nothing."""
    one = check(shot("enters"))
    assert found(one, "strobe").startswith("good")
    assert one.judged[1] > 100
    assert "moves" in found(one, "motion")


def test_of_a_movie_as_well(shot: Callable[[str], Path], tmp_path: Path) -> None:
    dark = dimmed(shot("stands"), tmp_path / "dark", 0.0, range(LATE))
    files = sorted((dark / "frames").iterdir())
    write_rgb16(tmp_path / "take.mkv", [read_picture(file, cv2.IMREAD_UNCHANGED) for file in files], rate=100)
    one = check(tmp_path / "take.mkv", plan=dark / "plan.toml")
    assert found(one, "strobe").startswith("good")
    assert one.judged[0] >= LATE


@pytest.mark.parametrize(("share", "moved"), [(0.7, False), (0.25, True)])
def test_far_less_light_at_the_start_is_no_measure_of_the_take(
    shot: Callable[[str], Path], tmp_path: Path, share: float, moved: bool
) -> None:
    """Its strobe is found at the start as well, two stops under what comes; half a stop is none the less judged."""
    one = check(dimmed(shot("stands"), tmp_path / "clip", share, range(LATE)))
    assert (one.judged[0] > LATE) == moved
    stops = float(found(one, "exposure").split(" stops below")[0].split()[-1])
    whole = check(shot("stands"))
    shown = float(found(whole, "exposure").split(" stops below")[0].split()[-1])
    assert stops == pytest.approx(shown - (0 if moved else np.log2(share)), abs=0.15)
    assert any("far less light" in note for note in one.notes) == moved


def test_where_no_lamp_ever_flashes_it_says_where_it_looked(shot: Callable[[str], Path], tmp_path: Path) -> None:
    one = check(dimmed(shot("stands"), tmp_path / "clip", 0.0, range(FRAMES)))
    assert not one.usable
    assert "frames 1 to 60" in found(one, "strobe")
    assert "rest" in found(one, "strobe")
    assert one.looked_at < FRAMES


def test_light_that_changes_without_flashes_is_looked_at_in_vain_and_not_for_long(
    shot: Callable[[str], Path], tmp_path: Path
) -> None:
    """A lamp that somebody carries through the picture, after a dark start, is no strobe."""
    clip = dimmed(shot("stands"), tmp_path / "clip", 0.0, range(FRAMES))
    for n, file in enumerate(sorted((clip / "frames").iterdir())):
        if n >= LATE:
            codes = read_picture(file, cv2.IMREAD_UNCHANGED)
            at = (n * 7) % (codes.shape[1] - 30)
            codes[20:90, at : at + 30] = 40000
            cv2.imwrite(str(file), codes)
    one = check(clip)
    assert not one.usable
    assert "Nor is it found in frames" in found(one, "strobe")
    assert one.looked_at <= FRAMES
