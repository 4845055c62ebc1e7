"""Imports go one way through the house, and nothing circular stands in it."""

import ast
import re
from dataclasses import dataclass
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "src" / "psvideo"

FLOORS = [
    {"errors"},
    {"compute"},
    {"model"},
    {"formats"},
    {"clip", "strobe", "capture", "synth"},
    {"sync"},
    {"plates"},
    {"solve"},
    {"calibrate", "export"},
    {"pictures"},
    {"report"},
    {"inspect"},
    {"page"},
    {"live"},
    {"runs"},
    {"cli"},
    {"__main__"},
]
"""Rooms from the bottom up. A room may use those below its floor, and none on its own."""

BESIDE_THE_ROAD = {"strobe", "capture", "synth"}
"""What stands beside clip, and knows no more than model, formats and compute."""

TWO_OF_A_NAME = {
    # The record of a camera, and the virtual camera, which takes one.
    "camera",
    # The solver's loops, and the row model's.
    "kernel",
}
"""Module names that two rooms have, because the room makes the meaning plain."""

IN_TWO_MINDS = [
    {"plates.ambient", "plates.mixing"},
    {"solve.filling", "solve.normals"},
    {"sync.rowfit.coarse", "sync.rowfit.tracking"},
]
"""Rooms within rooms that still know each other both ways. No pair is added."""

SYNTH_NEVER_USES = ("psvideo.model.rows.shutter", "psvideo.model.rows.recipe")
"""The rooms under test are above it, or beside; of the model, it has a shutter of its own."""


@dataclass(frozen=True, kw_only=True)
class Module:
    """What a file's syntax tree shows, read once for all tests: plain imports, modules and full names of those
    by ``from``, public classes, and strings in which something looks like an option."""

    plain: frozenset[str]
    froms: frozenset[str]
    names: frozenset[str]
    classes: tuple[str, ...]
    flags: tuple[str, ...]


@cache
def _read(path: Path) -> Module:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    froms = [node for node in nodes if isinstance(node, ast.ImportFrom) and node.module]
    texts = [node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return Module(
        plain=frozenset(alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names),
        froms=frozenset(node.module for node in froms if node.module),
        names=frozenset(f"{node.module}.{alias.name}" for node in froms for alias in node.names),
        classes=tuple(
            node.name for node in tree.body if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
        ),
        flags=tuple(text for text in texts if re.search(r"(^|[\s`(])--[a-z]", text)),
    )


def _imports(path: Path) -> set[str]:
    """Return the dotted names inside psvideo that a file imports anywhere."""
    seen = _read(path)
    return {name for name in seen.plain | seen.froms | seen.names if name.split(".")[0] == "psvideo"}


def _rooms_used(path: Path) -> set[str]:
    return {name.split(".")[1] for name in _imports(path) if "." in name} - {"__version__"}


def _room(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")


def test_modules_import_only_their_own_room_and_those_on_floors_below() -> None:
    floor = {room: height for height, rooms in enumerate(FLOORS) for room in rooms}
    assert {_room(path) for path in MODULES} <= set(floor), "a new room: give it its place in FLOORS"
    upward = {
        path: {room for room in _rooms_used(path) - {_room(path)} if floor[room] >= floor[_room(path)]}
        for path in MODULES
    }
    assert not {path: rooms for path, rooms in upward.items() if rooms}


def test_no_room_reaches_itself_through_other_rooms() -> None:
    graph: dict[str, set[str]] = {}
    for path in MODULES:
        graph.setdefault(_room(path), set()).update(_rooms_used(path) - {_room(path)})
    assert list(TopologicalSorter(graph).static_order()), "raises CycleError at a circle"


def test_no_room_within_a_room_reaches_itself_through_its_neighbours() -> None:
    """``sphere`` and ``mirror`` in ``calibrate``, say: one of the two knows the other."""
    graph: dict[str, set[str]] = {}
    for path in MODULES:
        own = ".".join(path.relative_to(PACKAGE).parent.parts)
        used = {".".join(name.split(".")[1:]) for name in _imports(path)}
        rooms = {name if (PACKAGE / name.replace(".", "/")).is_dir() else name.rpartition(".")[0] for name in used}
        neighbours = {room for room in rooms if _neighbours(own, room) and {own, room} not in IN_TWO_MINDS}
        graph.setdefault(own, set()).update(neighbours)
    assert list(TopologicalSorter(graph).static_order()), "raises CycleError at a circle"


def _neighbours(own: str, other: str) -> bool:
    """Whether two rooms lie beside each other, and neither in the other."""
    return bool(own and other) and not f"{own}.".startswith(f"{other}.") and not f"{other}.".startswith(f"{own}.")


def test_the_only_loose_modules_are_errors_and_what_python_m_runs() -> None:
    assert {path.name for path in PACKAGE.glob("*.py")} == {"__init__.py", "__main__.py", "errors.py"}


@pytest.mark.parametrize("room", sorted(BESIDE_THE_ROAD))
def test_planning_strobe_and_virtual_shoot_know_model_formats_and_compute_alone(room: str) -> None:
    used = [_rooms_used(path) for path in MODULES if _room(path) == room]
    assert set().union(*used) <= {room, "model", "formats", "compute", "errors"}


def test_no_module_imports_itself_by_a_detour() -> None:
    known = {
        ".".join(("psvideo", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")
        for path in MODULES
    }
    graph = {}
    for path in MODULES:
        name = ".".join(("psvideo", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")
        graph[name] = (_imports(path) & known) - {name, name.rpartition(".")[0]}
    assert list(TopologicalSorter(graph).static_order()), "raises CycleError at a circle"


@pytest.mark.parametrize("path", sorted((PACKAGE / "synth").rglob("*.py")), ids=lambda path: path.name)
def test_the_virtual_shoot_has_a_shutter_of_its_own(path: Path) -> None:
    assert not [name for name in _imports(path) if name.startswith(SYNTH_NEVER_USES)]


def test_only_the_clip_room_knows_decoders_and_only_export_knows_writers() -> None:
    decoders = {"rawpy", "av", "PyOpenColorIO"}
    for path in MODULES:
        seen = _read(path)
        if _room(path) not in {"clip", "export", "synth"} and path != PACKAGE / "formats" / "exr_files.py":
            assert not seen.plain & (decoders | {"OpenEXR", "tifffile"}), path
        assert _room(path) == "export" or "pxr" not in seen.froms, path


NOT_OURS = {"strobe/stand_ins/emulated.py", "report/style.py", "export/farm_job.py", "runs/farm.py"}
"""Arguments of another program or of the commands that a farm runs, and variables of a style sheet."""


def test_only_the_command_line_writes_flags() -> None:
    """Others name the parameter in backticks; the command line spells it as its option."""
    ours = [path for path in MODULES if _room(path) != "cli" and path.relative_to(PACKAGE).as_posix() not in NOT_OURS]
    assert not {path: _read(path).flags for path in ours if _read(path).flags}


FOR_COMMANDS = ("psvideo.runs.", "psvideo.cli.", "psvideo.model.", "psvideo.errors.")
"""What every command may call: one whole run; what parses and prints; records and choices; errors."""

ONE_CALL = {
    "info.py": {"psvideo.inspect.describe.describe"},
    "synth.py": {"psvideo.synth.shoot.shoot", "psvideo.synth.lamps.traced.TraceOptions"},
    "strobe/board.py": {"psvideo.strobe.link.controller.serial_ports"},
    "capture_plan.py": {"psvideo.capture.cameras.camera_modes"},
}
"""Commands that call one function of another room, which does it all (the options of synth are a record of it)."""

PRINTED_WITH = {
    "psvideo.capture.drawing.diagram.TERMINAL",
    "psvideo.capture.drawing.diagram.diagram_text",
    "psvideo.capture.tables.camera_table",
    "psvideo.capture.tables.shoot_report",
    "psvideo.formats.clocks_json.clocks_record",
    "psvideo.formats.timing_json.timing_record",
    "psvideo.report.rigs_report.rigs_record",
    "psvideo.report.run_report.report_record",
    "psvideo.strobe.program_words.describe_program",
    "psvideo.strobe.program_words.program_record",
    "psvideo.strobe.runlog.log_record",
    # Distinguishes the two kinds of record that a readout is printed from.
    "psvideo.calibrate.strobed_readout.StrobedReadout",
    # An option's default.
    "psvideo.strobe.link.ports.AUTO",
}
"""What turns a record into words or JSON."""


def _names_called(path: Path) -> set[str]:
    """Return the dotted names of psvideo that a file imports anywhere, but for annotations alone."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = []
    froms = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    plain = [node for node in ast.walk(tree) if isinstance(node, ast.Import)]
    names = {f"{node.module}.{alias.name}" for node in froms for alias in node.names}
    names |= {alias.name for node in plain for alias in node.names}
    return {name for name in names if name.split(".")[0] == "psvideo"}


COMMANDS = sorted((PACKAGE / "cli" / "commands").rglob("*.py"))


@pytest.mark.parametrize("path", COMMANDS, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_command_parses_calls_one_function_and_prints(path: Path) -> None:
    name = path.relative_to(PACKAGE / "cli" / "commands").as_posix()
    others = {one for one in _names_called(path) if not one.startswith(FOR_COMMANDS)} - PRINTED_WITH
    assert others <= ONE_CALL.get(name, set()), "move the work into a function of runs/"


def test_what_commands_may_call_is_called() -> None:
    called = {path.relative_to(PACKAGE / "cli" / "commands").as_posix(): _names_called(path) for path in COMMANDS}
    assert all(names <= called[name] for name, names in ONE_CALL.items())
    assert set().union(*called.values()) >= PRINTED_WITH


def test_only_one_module_knows_serial_ports() -> None:
    for path in MODULES:
        knows = any(name.split(".")[0] == "serial" for name in _read(path).plain | _read(path).froms)
        assert knows == (path == PACKAGE / "strobe" / "link" / "controller.py"), path


def test_no_two_classes_have_one_name() -> None:
    homes: dict[str, list[str]] = {}
    for path in MODULES:
        for name in _read(path).classes:
            homes.setdefault(name, []).append(str(path.relative_to(PACKAGE)))
    assert not {name: paths for name, paths in homes.items() if len(paths) > 1}


def test_no_two_modules_have_one_name() -> None:
    """Modules of cli and runs are named after their command, which may be a room's name as well."""
    homes: dict[str, list[str]] = {}
    for path in MODULES:
        if _room(path) not in {"cli", "runs"}:
            name = path.parent.name if path.name == "__init__.py" else path.stem
            homes.setdefault(name, []).append(str(path.relative_to(PACKAGE)))
    twice = {name: paths for name, paths in homes.items() if len(paths) > 1}
    assert set(twice) <= TWO_OF_A_NAME, twice
