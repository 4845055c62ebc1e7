"""A run as a job for render farms: the program of the Open Job Description runs it as it is."""

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from openjd.model import decode_job_template
from synced_plan import SYNCED_PLAN

from psvideo.cli.app import main
from psvideo.errors import UsageError
from psvideo.runs.farm import farm

RIG = """
schema = "psvideo-rig/1"
light = [
  { name = "a", direction = [0.6, 0.0, 0.8], intensity = 1.0 },
  { name = "b", direction = [-0.6, 0.0, 0.8], intensity = 1.0 },
  { name = "c", direction = [0.0, 0.6, 0.8], intensity = 1.0 },
]
"""


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    """A triggered clip of four rounds, with its rig."""
    import cv2

    folder = tmp_path / "a clip"
    folder.mkdir()
    (folder / "plan.toml").write_text(SYNCED_PLAN, encoding="utf-8")
    (folder / "rig.toml").write_text(RIG, encoding="utf-8")
    rng = np.random.default_rng(2)
    for number in range(1, 13):
        codes = rng.integers(20000, 40000, (16, 24)).astype(np.uint16)
        cv2.imwrite(str(folder / f"clip.{number:04d}.png"), codes)
    return folder


@pytest.mark.campaign
def test_openjd_runs_the_job_as_it_is(clip: Path, tmp_path: Path) -> None:
    job, given = tmp_path / "job", ["--rig", str(clip / "rig.toml")]
    assert main(["farm", str(clip), *given, "--pieces", "2", "-o", str(job), "-q", "--", "--no-preview"]) == 0
    openjd = Path(sys.executable).with_name("openjd")
    path = os.pathsep.join([str(openjd.parent), os.environ["PATH"]])
    environment = os.environ | {"PATH": path, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [str(openjd), "run", str(job / "template.json"), "-p", f"file://{job / 'values.json'}"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert main(["normals", str(clip), *given, "-o", str(tmp_path / "out"), "--no-preview", "-q"]) == 0
    for file in (tmp_path / "out").rglob("*.exr"):
        assert (job / "results" / file.relative_to(tmp_path / "out")).read_bytes() == file.read_bytes()
    assert json.loads((job / "results" / "report.json").read_text(encoding="utf-8"))["kind"] == "normals"


def test_the_template_keeps_to_the_standard_and_its_parameters_are_the_paths(clip: Path, tmp_path: Path) -> None:
    lines = farm(clip, rig=clip / "rig.toml", out=tmp_path / "job", pieces=3, words=["--aov", "depth"])
    template = json.loads((tmp_path / "job" / "template.json").read_text(encoding="utf-8"))
    read = decode_job_template(template=template)
    assert [step.name for step in read.steps] == ["Timing", "Solve", "Report"]
    values = json.loads((tmp_path / "job" / "values.json").read_text(encoding="utf-8"))
    assert (values["Clip"], values["Results"]) == (str(clip), str(tmp_path / "job" / "results"))
    assert {one["name"] for one in template["parameterDefinitions"]} == {*values, "Threads"}
    assert (tmp_path / "job" / "commands.txt").read_text(encoding="utf-8").splitlines() == lines
    words = [shlex.split(line) for line in lines]
    assert [one[-1] for one in words] == ["0/3", "1/3", "2/3", "3/3", "--resume"]
    assert all(one[:3] == ["psvideo", "normals", str(clip)] and "--aov" in one for one in words)


def test_a_job_that_cannot_be_is_refused_before_it_reaches_a_farm(clip: Path, tmp_path: Path) -> None:
    rig = clip / "rig.toml"
    with pytest.raises(UsageError, match="expected at least one"):
        farm(clip, rig=rig)
    with pytest.raises(UsageError, match="`pieces` 0: expected"):
        farm(clip, rig=rig, out=tmp_path / "job", pieces=0)
    (tmp_path / "job" / "results").mkdir(parents=True)
    (tmp_path / "job" / "results" / "mine").touch()
    with pytest.raises(UsageError, match="exists already"):
        farm(clip, rig=rig, results=tmp_path / "job" / "results")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--", "--aov", "dept"], "did you mean 'depth'"),
        (["--", "--nosuch"], "No such option: --nosuch"),
        (["--", "--start-number", "x"], "expected a whole number"),
        (["--", "-o", "elsewhere"], "-o after --: farm has it itself"),
        (["--", "-oelsewhere"], "-oelsewhere after --: farm has it itself"),
        (["--", "--workers=2"], "--workers=2 after --: the farm shares the work"),
        (["--", "--resume"], "--resume after --: farm gives it to every piece"),
        (["another"], "another: farm takes one clip"),
    ],
)
def test_options_that_would_fail_on_the_farm_are_refused_here(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], says: str
) -> None:
    typed = ["farm", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(tmp_path / "job"), *words]
    assert main(typed) == 2
    assert says in " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert not (tmp_path / "job").exists()


def test_paths_after_the_dashes_are_whole_in_the_job(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Machines of a farm work in folders of their own."""
    monkeypatch.chdir(tmp_path)
    more = ["--", "--mask", "masks/m.####.png", "--timing=t.json", "--first-light", "key", "--solver", "robust"]
    assert main(["farm", str(clip), "--rig", str(clip / "rig.toml"), "-o", "job", "-q", *more]) == 0
    for line in (tmp_path / "job" / "commands.txt").read_text(encoding="utf-8").splitlines():
        words = shlex.split(line)
        assert words[words.index("--mask") + 1] == str(tmp_path / "masks" / "m.####.png")
        assert f"--timing={tmp_path / 't.json'}" in words
        assert words[words.index("--first-light") + 1] == "key"
