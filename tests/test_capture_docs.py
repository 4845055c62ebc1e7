"""The shoot's page: its commands run, and its pictures are what they draw."""

import re
import shlex
from pathlib import Path

import pytest
from typer import Typer
from typer.testing import CliRunner

from psvideo.cli.commands.capture_plan import capture_plan

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "docs" / "shoot.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^psvideo capture-plan (.*)$", TEXT, re.MULTILINE)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_commands_of_the_page_run_and_draw_its_pictures(command: str, tmp_path: Path) -> None:
    words = shlex.split(command)
    pictures = [word for word in words if word.endswith(".svg")]
    inside = [str(tmp_path / Path(word).name) if word.endswith((".svg", ".toml")) else word for word in words]
    app = Typer()
    app.command()(capture_plan)
    assert CliRunner().invoke(app, inside).exit_code == 0
    for name in pictures:
        shown = ROOT / "docs" / "pictures" / name
        assert shown.read_text(encoding="utf-8") == (tmp_path / name).read_text(encoding="utf-8")


def test_the_page_shows_pictures_that_are_there() -> None:
    shown = re.findall(r"!\[[^]]*\]\(([^)]+)\)", TEXT)
    assert len(shown) == 3
    assert all((ROOT / "docs" / name).is_file() for name in shown)
    assert len(COMMANDS) == 3
