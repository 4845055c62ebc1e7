"""A take's rig: of a folder of rigs, as a calibration of each of several takes leaves it, the one of its name; left
out, the one beside the footage."""

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from synced_plan import SYNCED_PLAN

from psvideo.cli.app import main
from psvideo.clip.decode.decoders import decode
from psvideo.errors import UsageError
from psvideo.formats.rig_folder import check_rigs, rig_of_take
from psvideo.formats.rig_toml import format_rig
from psvideo.model.rig import Light, Rig
from psvideo.runs.farm import farm

STRAIGHT = {"a": (0.6, 0.0, 0.8), "b": (-0.6, 0.0, 0.8), "c": (0.0, 0.6, 0.8)}
TURNED = {"a": (0.8, 0.0, 0.6), "b": (-0.28, 0.0, 0.96), "c": (0.0, 0.8, 0.6)}
"""Where the lights stood in the one take, and where in the other."""


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """takes/shot1 and takes/shot2: a plane that faces the camera, under each take's lights; rigs/, a rig for each."""
    (tmp_path / "rigs").mkdir()
    (tmp_path / "rigs" / "report.json").write_text("{}", encoding="utf-8")
    for name, directions in (("shot1", STRAIGHT), ("shot2", TURNED)):
        clip = tmp_path / "takes" / name
        clip.mkdir(parents=True)
        (clip / "plan.toml").write_text(SYNCED_PLAN, encoding="utf-8")
        rig = Rig(lights=tuple(Light(name=light, direction=at) for light, at in directions.items()))
        (tmp_path / "rigs" / f"{name}.toml").write_text(format_rig(rig), encoding="utf-8")
        facing = [at[2] for at in directions.values()] * 2
        for number, shade in enumerate(facing, 1):
            cv2.imwrite(str(clip / f"clip.{number:04d}.png"), np.full((16, 24), round(40_000 * shade), np.uint16))
    return tmp_path


@pytest.mark.parametrize("how", [[], pytest.param(["--workers", "2"], marks=pytest.mark.campaign)])
def test_each_take_is_solved_by_its_own_rig(place: Path, how: list[str]) -> None:
    takes = [str(place / "takes" / name) for name in ("shot1", "shot2")]
    words = ["normals", *takes, "--rig", str(place / "rigs"), "-o", str(place / "out"), "--no-preview", "-q"]
    assert main([*words, *how]) == 0
    for name in ("shot1", "shot2"):
        found = decode("exr", next((place / "out" / name / "normals").glob("*.exr"))).codes.astype(np.float64)
        assert np.abs(found - (0, 0, 1)).max() < 2e-3, "under the other take's lights the plane would lean"


def test_takes_without_a_rig_are_named_before_any_work(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("shot3", "shot4"):
        shutil.copytree(place / "takes" / "shot1", place / "takes" / name)
    takes = [str(path) for path in sorted((place / "takes").iterdir())]
    for words in (["normals", *takes, "-o", str(place / "out")], ["check", *takes], ["split", *takes, "-o", "out"]):
        assert main([*words, "--rig", str(place / "rigs")]) == 2
        said = capsys.readouterr().err
        assert "for 2 of 4 takes: shot3, shot4. A take's rig is named after it: shot3.toml" in said
    assert not (place / "out").exists()
    with pytest.raises(UsageError, match=r"expected shot3\.toml\. Did you mean 'shot"):
        check_rigs(place / "rigs", takes[:3])


def test_two_rigs_of_one_name_and_a_folder_of_none_are_refused(place: Path) -> None:
    (place / "rigs" / "shot1.lp").write_text("1\n0 0 1\n", encoding="utf-8")
    with pytest.raises(UsageError, match=r"holds shot1\.toml, shot1\.lp"):
        rig_of_take(place / "rigs", place / "takes" / "shot1")
    with pytest.raises(UsageError, match="holds none at all"):
        rig_of_take(place / "takes", place / "takes" / "shot1")


def test_a_movies_rig_lacks_its_ending_and_a_file_is_for_every_take(place: Path) -> None:
    movie, rigs = place / "shot2.mov", place / "rigs"
    movie.write_bytes(b"")
    assert rig_of_take(rigs, movie) == rigs / "shot2.toml"
    assert rig_of_take(rigs / "shot1.toml", movie) == rigs / "shot1.toml"


def test_a_farms_job_names_the_takes_own_rig(place: Path) -> None:
    farm(place / "takes" / "shot2", rig=place / "rigs", out=place / "job")
    values = json.loads((place / "job" / "values.json").read_text(encoding="utf-8"))
    assert values["Rig"] == str((place / "rigs" / "shot2.toml").resolve())


def test_a_rig_beside_the_footage_need_not_be_named(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    clip = place / "takes" / "shot1"
    words = ["normals", str(clip), "--no-preview", "-o"]
    assert main([*words, str(place / "none")]) == 2
    said = " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert "there is no rig.toml here" in said
    assert "psvideo calibrate mirror-sphere" in said
    assert not (place / "none").exists()
    shutil.copy(place / "rigs" / "shot1.toml", clip / "rig.toml")
    assert main([*words, str(place / "left_out")]) == 0
    assert "rig.toml says" in " ".join(capsys.readouterr().out.split())
    assert main([*words, str(place / "named"), "--rig", str(clip / "rig.toml")]) == 0
    assert "rig.toml says" not in capsys.readouterr().out
    assert _first_normals(place / "left_out") == _first_normals(place / "named")


def _first_normals(out: Path) -> bytes:
    """Return the picture of the first map."""
    return decode("exr", sorted((out / "normals").iterdir())[0]).codes.tobytes()


def test_a_movie_has_its_rig_beside_it_and_takes_have_each_their_own(place: Path) -> None:
    movie = place / "takes" / "take.mov"
    movie.touch()
    with pytest.raises(UsageError, match=r"there is no rig\.toml beside it"):
        rig_of_take(None, movie)
    (place / "takes" / "rig.toml").touch()
    assert rig_of_take(None, movie) == place / "takes" / "rig.toml"
    takes = [place / "takes" / name for name in ("shot1", "shot2")]
    for take in takes:
        shutil.copy(place / "rigs" / f"{take.name}.toml", take / "rig.toml")
    assert [rig_of_take(None, take) for take in takes] == [take / "rig.toml" for take in takes]
    assert f"--rig {takes[1] / 'rig.toml'}" in farm(takes[1], results=place / "results", pieces=1)[0]
