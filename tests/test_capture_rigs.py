"""The rigs in lights/rigs/ fit the plans beside them, and those are what their comments say made them."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from typer import Typer
from typer.testing import CliRunner

from psvideo.cli.commands.capture_plan import capture_plan
from psvideo.formats.plan_toml import read_plan
from psvideo.formats.rig_toml import read_rig

RIGS = Path(__file__).resolve().parents[1] / "lights" / "rigs"
NAMES = ("head_ring", "dome")


@pytest.mark.parametrize("name", NAMES)
def test_a_rig_has_the_lights_of_its_plan_and_solves_well(name: str) -> None:
    rig, plan = read_rig(RIGS / f"{name}.toml"), read_plan(RIGS / f"{name}_plan.toml")
    directions = np.array([light.direction for light in rig.select(plan.lights)])
    assert set(rig.names) == set(plan.lights)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-4)
    said = re.search(r"condition number ([\d.]+)", (RIGS / f"{name}.toml").read_text(), re.IGNORECASE)
    assert said is not None
    assert np.linalg.cond(directions) == pytest.approx(float(said[1].rstrip(".")), abs=0.05)


@pytest.mark.parametrize("name", NAMES)
def test_the_plan_beside_a_rig_is_what_the_command_in_its_comment_makes(name: str, tmp_path: Path) -> None:
    comment = re.sub(r"\\\n#\s*", "", (RIGS / f"{name}.toml").read_text())
    command = re.search(r"psvideo capture-plan (.*) -o (\S+)", comment)
    assert command is not None
    assert command[2] == f"lights/rigs/{name}_plan.toml"
    app = Typer()
    app.command()(capture_plan)
    result = CliRunner().invoke(app, [*shlex.split(command[1]), "-q", "-o", str(tmp_path / "plan.toml")])
    assert result.exit_code == 0
    assert read_plan(tmp_path / "plan.toml") == read_plan(RIGS / f"{name}_plan.toml")
