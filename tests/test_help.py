"""Help that teaches: it comes at once, stands in the order of the work, and its examples are commands that work."""

import json
import re
import runpy
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import typer

import psvideo
from psvideo.cli.app import application, main
from psvideo.cli.examples import EXAMPLES
from psvideo.cli.first_screen import COMMANDS
from psvideo.cli.options.panels import PANELS

ROOT = Path(__file__).resolve().parents[1]
SOLVERS_AND_DECODERS = ("numba", "scipy", "cv2", "av", "OpenEXR", "rawpy", "trimesh", "PyOpenColorIO", "pxr", "serial")
HELP_WITHIN_S = 1.0


def commands(path: tuple[str, ...] = (), command: Any = None) -> Iterator[tuple[str, Any]]:
    """Every command and group of commands by its path, the groups first."""
    if command is None:
        yield "", typer.main.get_command(application([]))
        for entry in COMMANDS:
            group: Any = typer.main.get_command(application([entry.name]))
            yield from commands((entry.name,), group.commands[entry.name])
        return
    yield " ".join(path), command
    for name, below in getattr(command, "commands", {}).items():
        yield from commands((*path, name), below)


EVERY = dict(commands())
RUNNABLE = {path: command for path, command in EVERY.items() if not getattr(command, "commands", None)}
LINES = [(path, line) for path, examples in EXAMPLES.items() for _, line in examples]


def command_of(line: str) -> tuple[str, list[str]]:
    """Return the path of the command that a line calls, and the rest of its words."""
    program, *words = shlex.split(line)
    assert program == "psvideo"
    count = 2 if " ".join(words[:2]) in EVERY else 1
    return " ".join(words[:count]), words[count:]


def test_every_command_ends_its_help_with_two_examples_or_more() -> None:
    missing = {path for path in EVERY if len(EXAMPLES.get(path, ())) < 2}
    assert not missing
    assert set(EXAMPLES) == set(EVERY)


@pytest.mark.parametrize(("path", "line"), LINES)
def test_an_example_is_a_call_that_its_command_understands(path: str, line: str) -> None:
    called, words = command_of(line)
    assert called == path or not path or called.startswith(f"{path} "), "an example shows the command it stands under"
    command = RUNNABLE[called]
    command.make_context(called, words, resilient_parsing=False)


def _panels(path: str) -> dict[str, str | None]:
    """The panel in which the help of a command shows each of its options; None for the common one."""
    command = RUNNABLE[path]
    params = command.get_params(command.make_context(path, [], resilient_parsing=True))
    return {one.name: one.rich_help_panel for one in params if one.param_type_name == "option"}


def test_outside_of_a_panel_stands_only_what_normals_cannot_do_without() -> None:
    assert {name for name, panel in _panels("normals").items() if panel is None} == {"out"}


def test_every_name_in_the_table_of_panels_is_an_option() -> None:
    named = {name for names in PANELS.values() for name in names}
    assert named <= {name for path in RUNNABLE for name in _panels(path)}


def test_every_command_speaks_to_machines() -> None:
    silent = {path for path, command in RUNNABLE.items() if "json" not in {one.name for one in command.params}}
    assert not silent


def test_the_first_screen_says_of_each_command_what_its_own_help_says() -> None:
    for entry in COMMANDS:
        held = getattr(import_module(f"psvideo.cli.commands.{entry.word}"), entry.word)
        said = held.info.help if isinstance(held, typer.Typer) else " ".join(held.__doc__.split())
        assert entry.summary == said, entry.name


def test_the_first_screen_stands_in_the_order_of_the_work(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    reported = capsys.readouterr().out
    steps = ["Plan and light", "Measure cameras", "From footage to plates", "From plates to normals"]
    places = [reported.index(step) for step in steps]
    assert places == sorted(places)
    assert reported.rstrip().endswith("psvideo normals clip/ --rig rig.toml -o out/"), "it ends with lines to copy"


@pytest.mark.parametrize("path", EVERY)
def test_help_shows_every_option_and_its_examples_unwrapped(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*path.split(), "--help"]) == 0
    reported = capsys.readouterr().out
    assert "<bool>" not in reported, "a flag takes no value"
    for _, line in EXAMPLES[path]:
        assert f"   {line}\n" in reported
    for parameter in EVERY[path].params:
        if path and parameter.param_type_name == "option":
            assert parameter.opts[0] in reported
            assert parameter.help, f"{path} {parameter.opts[0]} says nothing"
            assert "[" not in parameter.help, "brackets are swallowed as markup"
    assert "[" not in (EVERY[path].help or "")


def test_an_option_that_is_a_quantity_names_its_unit() -> None:
    words = {"_px": "pixel", "_mm": "mm", "_ppm": "million", "_hz": "second", "_s": "second", "_deg": "degree"}
    silent = [
        (path, parameter.opts[0], parameter.help)
        for path, command in RUNNABLE.items()
        for parameter in command.params
        for unit, word in words.items()
        if (parameter.name or "").endswith(unit)
        and not {unit[1:], word, f"{word}s"} & set(re.findall(r"[a-z]+", parameter.help))
    ]
    assert not silent


def test_help_of_all_commands_loads_no_solver_and_no_decoder() -> None:
    code = (
        "import contextlib, io, sys\nfrom psvideo.cli.app import main\n"
        "with contextlib.redirect_stdout(io.StringIO()):\n"
        f"    for path in {list(EVERY)!r}:\n        assert main([*path.split(), '--help']) == 0, path\n"
        f"print([name for name in {SOLVERS_AND_DECODERS!r} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_help_comes_within_a_second() -> None:
    call = [sys.executable, "-c", "from psvideo.cli.app import main; main()", "normals", "--help"]
    took_s = []
    for _ in range(3):  # processor time of the child, which other work on the machine does not lengthen
        before = _children_s()
        subprocess.run(call, capture_output=True, check=True)
        took_s.append(_children_s() - before)
    assert min(took_s) < HELP_WITHIN_S


def _children_s() -> float:
    if sys.platform == "win32":
        return time.monotonic()
    import resource

    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


@pytest.fixture(scope="module")
def shoot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as the examples take it for granted: plan.toml, rig.toml and clip/ of a virtual sphere."""
    folder = tmp_path_factory.mktemp("examples")
    assert main(["synth", str(ROOT / "data_synth/sphere.toml"), "-o", str(folder / "clip"), "-q"]) == 0
    for name in ("plan.toml", "rig.toml"):
        (folder / name).write_bytes((folder / "clip" / name).read_bytes())
    return folder


CHEAP = ("capture-plan", "strobe list", "strobe check", "info", "sync", "split", "normals", "strobe run", "calibrate")
NOT_HERE = (
    *("--port auto", "--port /dev", "--log clip", "--seconds", "take7.mov", "clip.mov", "sphere/", "paper/", "left/"),
    *(
        "stripes/",
        "plates/ -",
        "--solver robust",
        "1-100",
        "intensities clip/",
        "--first-light",
        "shot.usd",
        "camA",
        "camB",
        "takes/*",
    ),
)
"""What the examples' folder has not: a board, other footage, more lights, a plan without a marker."""


def test_the_examples_that_cost_little_do_what_they_say_and_answer_machines_in_one_object(
    shoot: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(shoot)
    ran = 0
    for path, line in LINES:
        called, words = command_of(line)
        if called.startswith(CHEAP) and path == called and not any(word in line for word in NOT_HERE):
            extra = ["--force"] if "--force" in {o for p in RUNNABLE[called].params for o in p.opts} else []
            capsys.readouterr()
            status = main([*called.split(), *words, *extra, "--json"])
            said = capsys.readouterr()
            assert status == 0, f"{line}\n{said.err}"
            assert isinstance(json.loads(said.out), dict), f"{line}: one object, and nothing else"
            ran += 1
    assert ran >= 18


def test_a_mistyped_command_or_option_is_answered_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    for words, meant in {
        ("normal", "clip/"): "normals",
        ("calibrate", "mirror"): "mirror-sphere",
        ("normals", "clip/", "--sovler", "robust"): "--solver",
        ("normals", "clip/", "--rig", "r", "-o", "o", "--solver", "robst"): "robust",
    }.items():
        assert main(list(words)) == 2
        assert meant in capsys.readouterr().err


def test_help_before_a_command_is_help_for_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["help", "strobe", "check"]) == 0
    asked = capsys.readouterr().out
    assert main(["strobe", "check", "--help"]) == 0
    assert asked == capsys.readouterr().out


def test_python_m_psvideo_is_the_command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["psvideo", "--version"])
    with pytest.raises(SystemExit) as done:
        runpy.run_module("psvideo", run_name="__main__")
    assert not done.value.code
    assert capsys.readouterr().out == f"psvideo {psvideo.__version__}\n"
