"""The pages: links that lead somewhere, pictures that their scripts still make, commands as they are, one site."""

import ast
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from angles import angles_deg
from docs.figures.__main__ import FIGURES
from docs.figures.commands import PAGE, TASKS, commands_page
from docs.figures.faults import FAULTS
from docs.figures.python_page import run_blocks
from docs.figures.staging import PICTURES
from picture_file import read_picture

import psvideo as ps
from psvideo.cli.examples import EXAMPLES
from psvideo.clip.decode.decoders import decode

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted(
    path
    for pattern in ("*.md", "docs/**/*.md", "lights/**/*.md", "calibration/**/*.md", "bench/*.md")
    for path in ROOT.glob(pattern)
)
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
LARGEST_PICTURE = 300_000


def outside_code(page: Path) -> str:
    """Return a page's text without its blocks of code."""
    return re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)


def anchors(page: Path) -> set[str]:
    """Return what links can point at: the headings, as every viewer of Markdown names them."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    found: set[str] = set()
    for heading in re.findall(r"^#+ +(.*)$", text, flags=re.MULTILINE):
        name = re.sub(r"[^\w\- ]", "", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()).replace(" ", "-")
        count = sum(other == name or re.fullmatch(re.escape(name) + r"-\d+", other) is not None for other in found)
        found.add(f"{name}-{count}" if count else name)
    return found


def links() -> Iterator[tuple[Path, str]]:
    for page in PAGES:
        for target in LINK.findall(outside_code(page)):
            if not re.match(r"[a-z]+:", target):
                yield page, target


def test_every_link_between_pages_leads_to_a_file_and_to_a_heading_in_it() -> None:
    dead = []
    for page, target in links():
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        if not file.exists() or (anchor and file.suffix == ".md" and anchor not in anchors(file)):
            dead.append(f"{page.relative_to(ROOT)}: {target}")
    assert not dead
    assert sum(1 for _ in links()) > 100


FILE = re.compile(
    r"(?<![\w/.])((?:src|tests|bench|lights|docs|data_synth|calibration)/[\w./-]+\.(?:py|md|toml|h|c|csv|svg|sh))\b"
)


def test_every_file_of_the_project_that_a_page_names_is_there() -> None:
    named = [
        (page, name) for page in PAGES for name in FILE.findall(page.read_text(encoding="utf-8")) if "<" not in name
    ]
    missing = [f"{page.relative_to(ROOT)}: {name}" for page, name in named if not (ROOT / name).is_file()]
    assert not missing
    assert sum(name.startswith("src/psvideo/") for _, name in named) >= 10


DECISIONS = sorted(set((ROOT / "docs" / "decisions").glob("*.md")) - {ROOT / "docs" / "decisions" / "README.md"})
PARTS = ("Context", "Decision", "Consequences", "Look again")


@pytest.mark.parametrize("page", DECISIONS, ids=lambda path: path.stem)
def test_a_decision_says_why_what_with_which_consequences_and_when_to_look_again(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    found = re.findall(r"\*\*([^*]+)\*\*|^## (.+)$", text, flags=re.MULTILINE)
    said = {(bold or heading).rstrip(".") for bold, heading in found}
    assert set(PARTS) - said == set()
    index = (page.parent / "README.md").read_text(encoding="utf-8")
    assert f"]({page.name})" in index, "add it to the list of decisions"


def test_contributing_has_a_line_for_every_room() -> None:
    rooms = {path.parent.name for path in (ROOT / "src" / "psvideo").glob("*/__init__.py")}
    lines = re.findall(r"^\| `(\w+)` \|", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert set(lines) == rooms
    assert len(lines) == len(rooms)


STEP = re.compile(r"^\d\. `(src/\S+\.py)`(.*)$", flags=re.MULTILINE)


def test_a_step_of_contributing_names_what_is_in_its_file() -> None:
    steps = STEP.findall((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"))
    named = [(file, name) for file, rest in steps for name in re.findall(r"(?:in|its|a) `([A-Z]\w+)", rest)]
    assert not [(file, name) for file, name in named if name not in (ROOT / file).read_text(encoding="utf-8")]
    assert len(named) >= 5


def test_contributing_says_to_which_room_every_file_of_tests_belongs() -> None:
    table = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").partition("| room | tests |")[2].partition("\n\n")[0]
    names = [name for line in table.splitlines()[2:] for name in re.findall(r"`([\w*]+)`", line.split("|")[2])]
    files = {name: {file.stem for file in (ROOT / "tests").glob(f"test_{name}.py")} for name in names}
    assert not [name for name, found in files.items() if not found], "no such tests"
    known = set().union(*files.values())
    assert {file.stem for file in (ROOT / "tests").glob("test_*.py")} - known == set(), "add them to the table of rooms"


PACKAGE = ROOT / "src" / "psvideo"
PLAIN = {"cli/commands", "cli/commands/calibrate", "runs/calibrate"}
"""Rooms whose modules have the names of commands, which say all."""


def first_page(room: Path) -> str:
    return ast.get_docstring(ast.parse((room / "__init__.py").read_text(encoding="utf-8"))) or ""


def names_on(page: str) -> set[str]:
    """Return what a room's first page writes as code, one word each: modules, rooms, functions."""
    return set(re.findall(r"``([a-z][a-z0-9_.]*)``", page))


def modules_in(room: Path) -> set[str]:
    inner = {path.name for path in room.iterdir() if (path / "__init__.py").is_file()}
    return {path.stem for path in room.glob("*.py")} - {"__init__"} | inner


ROOMS = sorted(path.parent for path in PACKAGE.rglob("__init__.py") if path.parent != PACKAGE)


LARGE_ROOMS = [
    room for room in ROOMS if len(modules_in(room)) > 4 and room.relative_to(PACKAGE).as_posix() not in PLAIN
]


@pytest.mark.parametrize("room", LARGE_ROOMS, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_the_first_page_of_a_room_of_more_than_four_modules_names_each(room: Path) -> None:
    pages = f"{first_page(room)} {first_page(room.parent)}"  # a room's page may describe small rooms within
    assert modules_in(room) <= {part for name in names_on(pages) for part in name.split(".")}


@pytest.mark.parametrize("room", ROOMS, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_what_the_first_page_of_a_room_names_is_there(room: Path) -> None:
    inner = {name for folder in room.rglob("__init__.py") for name in modules_in(folder.parent)}
    nodes = ast.parse((room / "__init__.py").read_text(encoding="utf-8")).body
    offered = {alias.name for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names}
    there = inner | offered | modules_in(PACKAGE) | {path.name for path in room.iterdir() if path.is_dir()}
    unknown = {name for name in names_on(first_page(room)) if name.split(".")[-1] not in there}
    assert not {name for name in unknown if not (PACKAGE / f"{name.replace('.', '/')}.py").is_file()}


def test_contributing_names_the_rooms_in_the_order_of_their_imports() -> None:
    tree = ast.parse((ROOT / "tests" / "test_layers.py").read_text(encoding="utf-8"))
    assigned = next(
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and node.targets[0].id == "FLOORS"
    )
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    order = text.partition("from bottom to top: ")[2].partition(".")[0]
    assert [set(re.findall(r"`(\w+)`", floor)) for floor in order.split(";")] == ast.literal_eval(assigned)


def test_the_newest_version_of_the_changelog_is_the_package_s() -> None:
    newest = re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    package = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert newest is not None
    assert newest[1] == package["version"]


def test_the_page_of_commands_is_what_the_commands_say() -> None:
    assert PAGE.read_text(encoding="utf-8") == commands_page(), "stale: python -m docs.figures.commands"
    assert set(TASKS) == {path for path in EXAMPLES if path and not any(one.startswith(f"{path} ") for one in EXAMPLES)}


def test_every_picture_of_a_script_is_shown_small_and_has_words_for_those_who_cannot_see_it() -> None:
    reported = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    for name in FIGURES:
        assert re.search(r"!\[[^\]]{10,}\]\(pictures/" + name + r"\.png\)", reported), name
        assert (PICTURES / f"{name}.png").stat().st_size < LARGEST_PICTURE, name


QUOTE = re.compile(r"\"([^\"]{20,})\"")


def quotes(name: str) -> list[str]:
    """Return what the page of faults says that psvideo says: the quotations in the section of a fault's picture."""
    sections = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8").split("\n## ")
    section = next(" ".join(one.split()) for one in sections if f"pictures/{name}.png" in one)
    reported = section.partition("**What psvideo reports.**")[2].partition("**What to do.**")[0]
    return QUOTE.findall(reported)


@pytest.fixture(scope="module")
def films(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("films")


SLOW = {"how_frames", "how_plates", "how_normals", "gallery_depth", "depth_bust", "rolling_fan"}
SLOW |= {
    "fault_clipped",
    "fault_half_shutter",
    "fault_misnamed_rate",
    "fault_short_dark_time",
    "fault_swapped_lights",
    "fault_banding",
    "fault_colour_shift",
    "fault_dropped_frame",
    "fault_flicker",
    "fault_led_tails",
    "fault_wrong_curve",
}
"""The campaign's: other figures are made in the same way."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.campaign) if name in SLOW else name for name in sorted(FIGURES)]
)
def test_a_picture_is_what_its_script_makes_and_psvideo_says_what_the_page_quotes(name: str, films: Path) -> None:
    made = FIGURES[name](films / name)
    shown = read_picture(PICTURES / f"{name}.png")[..., ::-1]
    assert shown.shape == made.picture.shape
    assert np.abs(shown.astype(int) - made.picture.astype(int)).mean() < 1.0, "stale: python -m docs.figures"
    if name in FAULTS:
        for quote in quotes(name):
            assert quote in made.said, made.said


def test_the_code_of_the_page_on_python_runs_as_it_stands(shelf: Path, tmp_path: Path) -> None:
    shutil.copytree(shelf, tmp_path, dirs_exist_ok=True)
    names, said = run_blocks(tmp_path)
    assert names["surface"].valid.any()
    assert np.median(names["error_deg"]) < 1.5
    assert (tmp_path / "relit.png").is_file()
    assert "order by marker" in said
    assert len(list((tmp_path / "out" / "depth").iterdir())) == len(names["report"].instants)


def test_the_code_in_the_readme_runs_as_it_stands(shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(shelf / "stills", tmp_path / "stills")
    shutil.copy(shelf / "take3" / "rig.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for code in re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL):
        exec(code, names)
    surface = names["surface"]
    true = decode("exr", shelf / "take3" / "truth" / "normals.exr").codes
    off = angles_deg(surface.normals, true)[surface.valid]
    assert off.mean() < 0.1


def test_the_api_page_describes_every_name_of_the_front_door() -> None:
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    described = re.findall(r"^\.\. auto\w+:: (\w+)$", page, flags=re.MULTILINE)
    assert sorted(described) == sorted(ps.__all__)


@pytest.mark.campaign
def test_the_site_builds_without_a_warning_and_needs_nothing_from_the_net(tmp_path: Path) -> None:
    pytest.importorskip("sphinx")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "sphinx",
            "-q",
            "-W",
            "--keep-going",
            "-c",
            "docs",
            "-d",
            tmp_path / "trees",
            ".",
            tmp_path / "site",
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "site" / "docs" / "index.html").read_text(encoding="utf-8")
    assert not re.findall(r"(?:src|href)=\"https?://[^\"]*\.(?:js|css|woff2?)\"", page)
