"""Compiled code is kept for the next run where that is possible, used only while its sources are the same, and runs
where nothing can be kept."""

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numba.core.caching
import numpy as np
import pytest

import psvideo
from psvideo.cli.console import compiling_said
from psvideo.compute import compiled
from psvideo.compute.compiled import EXACT, FUSED, REORDERED, sources_digest
from psvideo.live.showing import smaller
from psvideo.model.coded import Coded
from psvideo.plates.align.velocity import moving_kernel
from psvideo.plates.ambient import ambient_kernel
from psvideo.runs.steps.compiling import USUAL, SmallTake, run_small
from psvideo.solve.filling import looking
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.least_squares import kernel
from psvideo.solve.normals.least_squares.woodham1980 import solve
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.loops import near_kernel
from psvideo.solve.normals.robust import robust_kernel
from psvideo.sync.rowfit.beat import Beat, FoundClock
from psvideo.sync.rowfit.compiled_profiles import compiled_rows
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.synth import read_scene

SOURCE = Path(psvideo.__file__).parent
SCENE = Path(__file__).resolve().parents[1] / "data_synth" / "sphere.toml"


def twice(value: float) -> float:
    return 2 * value


def test_without_a_folder_to_keep_it_in_code_is_compiled_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.core.caching.CacheImpl, "_locator_classes", [])
    with pytest.raises(RuntimeError, match="no locator"):
        numba.njit(cache=True)(twice)
    for arithmetic in (EXACT, FUSED, REORDERED):
        assert arithmetic.kept(twice)(21.0) == 42.0
        assert arithmetic.kept(eval("lambda value: 2 * value"))(21.0) == 42.0, "made of a text, and not of a file"


def full(*_: Any) -> None:
    raise OSError(28, "No space left on device")


def test_a_full_disk_under_the_cache_leaves_compiled_code_usable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.core.caching.IndexDataCacheFile, "save", full)
    assert FUSED.kept(lambda value: 3 * value)(14) == 42


def test_a_cache_that_cannot_be_read_is_no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.core.caching.IndexDataCacheFile, "load", full)
    assert FUSED.kept(lambda value: 4 * value)(10) == 40


def test_the_arithmetic_is_as_it_says() -> None:
    def over(a: float, b: float) -> float:
        return a / b

    with pytest.raises(ZeroDivisionError):
        EXACT.kept(over)(1.0, 0.0)
    assert FUSED.kept(over)(1.0, 0.0) == np.inf
    tiny = np.float64(1e-30)
    assert FUSED.kept(lambda a, b: (a + b) - a)(1.0, tiny) == 0.0, "sums keep their order"


def test_kept_code_depends_on_every_module_that_is_compiled_into_it() -> None:
    digests = {sources_digest(module) for module in (kernel, near_kernel, robust_kernel)}
    assert len(digests) == 3
    for name in ("least_squares.kernel", "loops.near_kernel", "robust.equations", "robust.odd_of_four"):
        assert hasattr(importlib.import_module(f"psvideo.solve.normals.{name}"), "FUSED")


def test_kept_code_depends_on_what_code_of_llvm_s_is_written_with(monkeypatch: pytest.MonkeyPatch) -> None:
    before, source = sources_digest(moving_kernel), compiled._source
    monkeypatch.setattr(compiled, "_source", lambda path: source(path) + b" " * path.endswith("eight_lanes.py"))
    assert sources_digest(moving_kernel) != before


PARTS = {
    "__init__.py": "",
    "numbers_.py": "FACTOR = 2\n",
    "inner.py": (
        "from house.numbers_ import FACTOR\n"
        "from psvideo.compute.compiled import FUSED\n"
        "@FUSED.inlined\n"
        "def part(x):\n    return FACTOR * x + 1\n"
    ),
    "between.py": (
        "from house import inner\n"
        "from psvideo.compute.compiled import FUSED\n"
        "@FUSED.called\n"
        "def passed(x):\n    return inner.part(x)\n"
    ),
    "outer.py": (
        "from house.between import passed\n"
        "from psvideo.compute.compiled import FUSED\n"
        "@FUSED.kept\n"
        "def whole(x):\n    return passed(x)\n"
    ),
    "run.py": "from house.outer import whole\nprint(whole(10), sum(whole.stats.cache_hits.values()))\n",
}


def test_a_change_in_a_module_that_is_compiled_in_makes_kept_code_stale(tmp_path: Path) -> None:
    house = tmp_path / "house"
    house.mkdir()
    for name, text in PARTS.items():
        (house / name).write_text(text)
    paths = os.pathsep.join([str(tmp_path), str(SOURCE.parent)])
    environment = os.environ | {"PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def run() -> tuple[int, int]:
        done = subprocess.run(
            [sys.executable, "-B", "-m", "house.run"], env=environment, capture_output=True, text=True, check=True
        )
        value, hits = done.stdout.split()
        return int(value), int(hits)

    assert run() == (21, 0)
    assert run() == (21, 1), "kept"
    (house / "inner.py").write_text(PARTS["inner.py"].replace("+ 1", "+ 3"))
    assert run() == (23, 0), "another line in a module that is inlined two modules away"
    (house / "numbers_.py").write_text("FACTOR = 5\n")
    assert run() == (53, 0), "another number that it imports"
    assert run() == (53, 1)


CALLER = {
    "caller.py": (
        "from house.outer import whole\n"
        "from psvideo.compute.compiled import FUSED\n"
        "@FUSED.kept\n"
        "def more(x):\n    return whole(x) + whole(x + 1)\n"
    ),
    "run.py": (
        "import sys\n"
        "from house.outer import whole\n"
        "whole(10)\n"
        "library = whole.overloads[whole.signatures[0]].library\n"
        "held = library._shared_module is not None\n"
        "if sys.argv[1] == 'both':\n"
        "    from house.caller import more\n"
        "    print(more(10), held, sum(more.stats.cache_hits.values()))\n"
        "else:\n"
        "    print(whole(10), held, sum(whole.stats.cache_hits.values()))\n"
    ),
}


def test_a_kept_loop_is_loaded_without_what_only_compiling_needs_and_becomes_part_of_others(tmp_path: Path) -> None:
    """LLVM's own form of every loop was 36 MB of a run, in which nothing is compiled."""
    house = tmp_path / "house"
    house.mkdir()
    for name, text in (PARTS | CALLER).items():
        (house / name).write_text(text)
    paths = os.pathsep.join([str(tmp_path), str(SOURCE.parent)])
    environment = os.environ | {"PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def run(which: str) -> list[str]:
        command = [sys.executable, "-B", "-m", "house.run", which]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        return done.stdout.split()

    assert run("one") == ["21", "True", "0"], "compiled, and made fit for others to keep it"
    assert run("one") == ["21", "False", "1"], "loaded"
    assert run("both") == ["44", "False", "0"], "another loop is compiled of the one that was loaded"
    assert run("both") == ["44", "False", "1"]


def test_code_kept_beside_its_module_is_found_whatever_folder_is_set_for_keeping(tmp_path: Path) -> None:
    house = tmp_path / "house"
    house.mkdir()
    for name, text in PARTS.items():
        (house / name).write_text(text)
    paths = os.pathsep.join([str(tmp_path), str(SOURCE.parent)])
    plain = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"} | {"PYTHONPATH": paths}

    def hits(*nowhere: str, **set_: str) -> int:
        command = [sys.executable, "-B", *(nowhere or ("-m", "house.run"))]
        done = subprocess.run(command, env=plain | set_, capture_output=True, text=True, check=True)
        return int(done.stdout.split()[1])

    assert hits() == 0, "compiled as an installation does it"
    assert hits(NUMBA_CACHE_DIR=str(tmp_path / "other")) == 1
    os.utime(house / "outer.py", (1, 1))
    assert hits(NUMBA_CACHE_DIR=str(tmp_path / "other")) == 1, "installing changes the dates of files"
    nowhere = "import numba.core.caching as places; places.CacheImpl._locator_classes = []; import house.run"
    assert hits("-c", nowhere) == 1, "an account that can write nowhere"
    (house / "numbers_.py").write_text("FACTOR = 5\n")
    assert hits(NUMBA_CACHE_DIR=str(tmp_path / "other")) == 0, "stale, wherever it lies"


@pytest.mark.parametrize(("kept", "said"), [(True, "kept for all later runs"), (False, "again in every run")])
def test_compiling_is_said_once_and_not_where_quiet_is_asked_for(
    kept: bool, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if kept:
        monkeypatch.setattr(numba.core.config, "CACHE_DIR", str(tmp_path))  # else a run before this one kept them
    else:
        monkeypatch.setattr(numba.core.caching.CacheImpl, "_locator_classes", [])
    for quiet, lines in ((False, 1), (True, 0)):
        with compiling_said(quiet=quiet):
            FUSED.kept(lambda value: 5 * value)(10)
            FUSED.kept(lambda value: 6 * value)(10)
        told = capsys.readouterr().err
        assert (told.count("psvideo: compiling"), told.count(said)) == (lines, lines)
    FUSED.kept(lambda value: 7 * value)(10)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("take", USUAL, ids=lambda take: f"{take.kind} {take.lights}")
def test_every_small_take_that_is_compiled_with_is_a_scene(take: SmallTake, tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(take.scene)
    scene = read_scene(tmp_path / "small.toml")
    assert (len(scene.light), scene.output.kind, scene.moves) == (take.lights, take.kind, bool(take.motion))


def test_a_small_take_is_run_whole_and_leaves_nothing_but_compiled_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    run_small(USUAL[-1])
    assert not list(tmp_path.iterdir())


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the package beside which nothing can be kept: where numba would make a folder lies a file."""
    package = tmp_path / "there" / "psvideo"
    shutil.copytree(SOURCE, package, ignore=shutil.ignore_patterns("__pycache__"))
    for folder in [package, *(path for path in package.rglob("*") if path.is_dir())]:
        (folder / "__pycache__").write_text("no folder")
    return package


NO_FOLDER = """
import importlib, pkgutil, sys
import numpy as np
import psvideo
for module in pkgutil.walk_packages(psvideo.__path__, "psvideo."):
    if module.name not in ("psvideo.cli.app", "psvideo.__main__"):
        importlib.import_module(module.name)
from psvideo.cli.app import main
from psvideo.sync.rowfit import kernel, row_model
assert type(row_model.width._cache._impl.locator).__name__ == "_ReadOnly", "nothing is kept"
matrix = np.array([[5.0, 2.0], [2.0, 4.0]])
kernel.factor(matrix, 2)
assert np.allclose(np.tril(matrix), [[2.0, 0.0], [1.0, 2.0]]), matrix
if sys.argv[1:]:
    scene, clip, command, *options = sys.argv[1:]
    assert main(["synth", scene, "-o", clip, "-q"]) == 0
    assert main([command, clip, *options, "-q"]) == 0
"""


def where_nothing_can_be_kept(copy: Path, *arguments: object) -> None:
    """Import every module and run a loop in a process that can write compiled code nowhere; then a command."""
    nowhere = dict.fromkeys(("HOME", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA"), "/dev/null/nowhere")
    environment = os.environ | nowhere | {"PYTHONPATH": str(copy.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", NO_FOLDER, *map(str, arguments)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_module_loads_and_loops_run_where_no_folder_can_be_written_for_compiled_code(copy: Path) -> None:
    where_nothing_can_be_kept(copy)


def test_some_of_the_rows_need_no_loops_of_their_own() -> None:
    every = Profiles(
        value=np.ones((3, 8)),
        index=np.arange(3),
        period_s=0.01,
        place=np.arange(8.0),
        window_start=np.zeros(1, np.int64),
        restless=np.zeros(8),
    )
    beat = Beat(clock=FoundClock(phase_s=0.001, offset_ppm=0.0), row_time_s=0.001, exposure_s=0.01)
    for rows in (every, every.only_rows(slice(1, None, 2))):
        parts = [part for part in compiled_rows(rows, beat) if isinstance(part, np.ndarray)]
        assert all(part.flags.c_contiguous for part in parts)


def test_live_pictures_of_colour_need_no_loop_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    orders: list[bool] = []
    monkeypatch.setattr(smaller, "average", lambda _, __, of, *___: orders.append(of.flags.c_contiguous))
    for shape, cfa in (((4, 4), None), ((4, 4), "RGGB"), ((4, 4, 3), None)):
        smaller.Smaller(step=2, cfa=cfa).of(Coded(codes=np.zeros(shape, np.uint8)))
    assert orders == [True, True, True]


@pytest.mark.campaign
@pytest.mark.parametrize("command", ["sync", "normals"])
def test_whole_commands_run_where_no_folder_can_be_written_for_compiled_code(
    command: str, copy: Path, tmp_path: Path
) -> None:
    clip, out = tmp_path / "clip", tmp_path / "out"
    options = ["--rig", clip / "rig.toml"] if command == "normals" else []
    where_nothing_can_be_kept(copy, SCENE, clip, command, "-o", out, *options)
    assert out.is_file() if command == "sync" else list((out / "normals").iterdir())


UNUSUAL = """
import logging, sys
from pathlib import Path
import cv2
import numpy as np
import psvideo as ps
from psvideo.runs.doctor import doctor
from psvideo.runs.steps.compiling import GLOSS, SmallTake, filmed
folder = Path(sys.argv[1])
logging.getLogger("psvideo.compiling").setLevel(logging.INFO)
logging.getLogger("psvideo.compiling").addHandler(logging.StreamHandler(sys.stdout))
moving = ", motion = { velocity_m_per_s = [0.4, 0.0, 0.0] }"
inside = np.zeros((120, 96), np.uint8)
inside[20:100, 20:80] = 255
cv2.imwrite(str(folder / "mask.png"), inside)
doctor(folder)
takes = (
    (SmallTake(lights=4), {"mask": folder / "mask.png"}),
    (SmallTake(lights=8, gloss=GLOSS), {"mask": folder / "mask.png", "float32": True}),
    (SmallTake(lights=5, kind="exr"), {"fill": False}),
    (SmallTake(lights=4, kind="exr", motion=moving, float32=True), {"float32": True}),
    (SmallTake(lights=8), {"solver": "least-squares", "aov": ("residual", "error")}),
    (SmallTake(lights=3), {"solver": "robust"}),
    (SmallTake(lights=3), {"aov": ("error",)}),
    (SmallTake(lights=4, near=True), {}),
    (SmallTake(lights=8, near=True), {"aov": ("depth",)}),
    (SmallTake(lights=6, kind="png8", camera='bits = 8, transfer = "srgb"', motion=moving), {}),
    (SmallTake(lights=8, kind="dng", camera='cfa = "RGGB"', motion=moving), {"aov": ("depth",)}),
)
for number, (take, how) in enumerate(takes):
    (folder / str(number)).mkdir()
    clip = filmed(take, folder / str(number))
    ps.normals(clip, rig=clip / "rig.toml", out=folder / f"out{number}", **how)
ps.split(folder / "0" / "clip", out=folder / "split", method="hudon2015")
for lights in (3, 4, 5, 9, 12):
    around = np.arange(lights) * 2 * np.pi / lights
    ways = np.stack([0.5 * np.cos(around), 0.5 * np.sin(around), np.full(lights, 0.75**0.5)], axis=-1)
    y, x = np.mgrid[-0.6:0.6:48j, -0.6:0.6:48j]
    normals = np.stack([x, -y, np.sqrt(1 - x * x - y * y)], axis=-1)
    grey = np.maximum(np.einsum("rcx,lx->lrc", normals, ways), 0) * 0.6
    for images in (grey, np.stack([grey] * 3, axis=-1)):
        ps.solve_images(images, ways)
        ps.solve_images((images * 65535).astype(np.uint16), ways, white_level=65535, mask=x > -0.5)
        ps.solve_images((images * 255).astype(np.uint8), ways, white_level=255, solver="robust")
"""


@pytest.mark.campaign
def test_after_installing_no_run_compiles_however_unusual(tmp_path: Path) -> None:
    package = tmp_path / "there" / "psvideo"
    shutil.copytree(SOURCE, package, ignore=shutil.ignore_patterns("__pycache__"))
    environment = os.environ | {"PYTHONPATH": str(package.parent), "NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    subprocess.run([sys.executable, "-m", "psvideo.runs.steps.compiling"], env=environment, check=True)
    command = [sys.executable, "-c", UNUSUAL, str(tmp_path)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stdout.splitlines() if line.startswith("compiling")] == []


COMPILE = """
import numpy as np
from psvideo.solve.depth.checkerboard import empty_board, settle
from psvideo.sync.rowfit.kernel import factor
factor(np.eye(3), 3)
boards = [empty_board(8, 8) for _ in range(3)]
settle(np.zeros((2, *boards[0].shape), np.float32), *boards, np.zeros(9, np.float32), 1)
"""


def test_two_processes_compile_into_one_folder_at_a_time(tmp_path: Path) -> None:
    package = tmp_path / "there" / "psvideo"
    shutil.copytree(SOURCE, package, ignore=shutil.ignore_patterns("__pycache__"))
    environment = os.environ | {"PYTHONPATH": str(package.parent), "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", COMPILE]
    at_once = [subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    said = [process.communicate()[1] for process in at_once]
    assert [process.returncode for process in at_once] == [0, 0], said
    assert list(tmp_path.rglob("*.nbc")), "kept"
    subprocess.run(command, env=environment, check=True)


COSTLY = (b"numba.np.arraymath", b"numba.np.linalg", b"numba.cpython.unicode")
"""What comes with a kept loop that calls numba's own functions on arrays: SciPy's linear algebra, a text library."""


@pytest.mark.parametrize(
    "loop",
    [
        kernel.solve_rows,
        robust_kernel.solve_rows,
        looking.look_rows,
        looking.mark_lit_rows,
        ambient_kernel.average_rows,
    ],
    ids=lambda loop: f"{loop.__module__}.{loop.__name__}",
)
def test_a_kept_loop_loads_none_of_numbas_mathematics_of_arrays(loop: Any) -> None:
    kept = loop._cache
    files = list(Path(kept.cache_path).glob(f"{kept._impl.filename_base}.*.nbc"))
    if not files:
        pytest.skip("this loop was not kept yet: psvideo doctor --compile keeps all")
    assert [(file.name, name) for file in files for name in COSTLY if name in file.read_bytes()] == []


def test_a_full_disk_under_the_cache_does_not_stop_a_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.core.caching.IndexDataCacheFile, "save", full)
    directions = np.array([[0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], [0.0, 0.6, 0.8]])
    lit = Illumination(directions=directions, intensities=np.ones((3, 1)))
    surface = solve(LitPlates([np.full((2, 2), 0.5, np.float32)] * 3, lit))
    assert surface.valid.all()
    true = np.linalg.solve(directions, np.full(3, 0.5))
    np.testing.assert_allclose(surface.normals, np.broadcast_to(true / np.linalg.norm(true), (2, 2, 3)), atol=1e-6)
