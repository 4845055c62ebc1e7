"""What a shell is offered when the user presses the tabulator: asked for as bash, zsh and fish ask."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PLAN = """
schema = "psvideo-plan/1"
[camera]
width_px = 64
height_px = 48
fps = 100
[strobe]
mode = "synced"
[[strobe.flash]]
lights = { key = 1.0 }
[[strobe.flash]]
lights = { kicker = 1.0, left = 0.5 }
"""
ENTRY = "import sys; from psvideo.cli.app import main; sys.exit(main())"


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with a clip's plan and a psvideo to call."""
    (tmp_path / "clip").mkdir()
    for plan in (tmp_path / "plan.toml", tmp_path / "clip" / "plan.toml"):
        plan.write_text(PLAN)
    program = tmp_path / "bin" / "psvideo"
    program.parent.mkdir()
    program.write_text(f"#!{sys.executable}\n{ENTRY}\n")
    program.chmod(0o755)
    return tmp_path


def asked(place: Path, shell: str, line: str) -> list[str]:
    """Return what is offered after a line that has been typed so far, as ``shell`` asks for it."""
    words = line.split(" ")
    asks = {
        "bash": {"COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)},
        "zsh": {"_TYPER_COMPLETE_ARGS": line},
        "fish": {"_TYPER_COMPLETE_ARGS": line, "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
    }[shell]
    environment = os.environ | asks | {"_PSVIDEO_COMPLETE": f"complete_{shell}"}
    command = [sys.executable, "-X", "importtime", "-c", ENTRY]
    done = subprocess.run(command, capture_output=True, text=True, cwd=place, env=environment, check=True)
    assert "numba" not in done.stderr, "a key press loads no solver"
    lines = filter(None, done.stdout.splitlines())
    return [word.split("\t")[0].strip('"') for word in lines]


@pytest.mark.parametrize("shell", ["bash", "fish"])
@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("psvideo cap", ["capture-plan"]),
        ("psvideo strobe st", ["stop"]),
        ("psvideo normals clip --sol", ["--solver"]),
        ("psvideo normals clip --solver ro", ["robust"]),
        ("psvideo sync clip --first-light k", ["key", "kicker"]),
        ("psvideo strobe check plan.toml --line l", ["left="]),
        ("psvideo strobe check plan.toml --board rp", ["rp2040"]),
        ("psvideo sync nowhere --first-light k", []),
    ],
)
def test_a_shell_is_offered_what_can_follow(place: Path, shell: str, line: str, offered: list[str]) -> None:
    assert asked(place, shell, line) == offered


def test_zsh_is_offered_the_same_with_a_word_on_each(place: Path) -> None:
    said = "\n".join(asked(place, "zsh", "psvideo strobe "))
    assert all(f'"{name}"' in said or name in said for name in ("check", "run", "stop", "emulate"))
    assert "Switch off all lights" in said


def test_cameras_of_the_table_are_offered(place: Path) -> None:
    assert "Sony F65" in asked(place, "bash", "psvideo capture-plan --camera Sony")


def test_a_spoilt_plan_offers_nothing_and_says_nothing(place: Path) -> None:
    (place / "clip" / "plan.toml").write_text("[[strobe.flash]\nlights = ")
    assert asked(place, "bash", "psvideo sync clip --first-light k") == []


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_itself_completes_with_the_script_that_psvideo_prints(place: Path) -> None:
    path = f"{place / 'bin'}:{os.environ['PATH']}"
    script = (
        'eval "$(_PSVIDEO_COMPLETE=source_bash psvideo)"\n'
        "COMP_WORDS=(psvideo sync clip --first-light k); COMP_CWORD=4; COMP_LINE='psvideo sync clip --first-light k'\n"
        "$(complete -p psvideo | sed 's/.*-F \\([^ ]*\\).*/\\1/') psvideo\n"
        'echo "${COMPREPLY[@]}"\n'
    )
    done = subprocess.run(
        ["bash", "--norc", "-c", script], capture_output=True, text=True, cwd=place, env=os.environ | {"PATH": path}
    )
    assert done.stdout.strip() == "key kicker", done.stderr


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_gets_a_script_of_its_own(place: Path, shell: str) -> None:
    environment = os.environ | {"_PSVIDEO_COMPLETE": f"source_{shell}"}
    done = subprocess.run(
        [sys.executable, "-c", ENTRY], capture_output=True, text=True, cwd=place, env=environment, check=True
    )
    assert "psvideo" in done.stdout
    assert {"bash": "complete -o", "zsh": "compdef", "fish": "complete --command"}[shell] in done.stdout
