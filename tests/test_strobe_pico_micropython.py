"""The Pico's program is one file that MicroPython understands, and does the same under it."""

import ast
import importlib.util
import random
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from pico import ARM, LOADED, MAIN, upload
from rp2040 import BOARD_MODULES

CLIENTS = Path(__file__).resolve().parent / "clients"
FORBIDDEN = (
    ast.Match,
    ast.NamedExpr,
    ast.AnnAssign,
    ast.AsyncFunctionDef,
    ast.TypeIgnore,
    ast.Nonlocal,
)
KNOWN = {"array", "machine", "micropython", "rp2", "select", "struct", "sys", "time", "uctypes"}
MISSING = {"isalnum", "removesuffix", "removeprefix", "bit_length", "bit_count", "isascii", "title", "zfill"}


def test_the_one_file_is_what_its_parts_make() -> None:
    spec = importlib.util.spec_from_file_location("make_main", MAIN.with_name("make_main.py"))
    assert spec is not None
    assert spec.loader is not None
    make_main = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(make_main)
    assert MAIN.read_text(encoding="utf-8") == make_main.joined()


def test_it_uses_only_what_micropython_has() -> None:
    tree = ast.parse(MAIN.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        assert not isinstance(node, FORBIDDEN), ast.dump(node)
        if isinstance(node, ast.List | ast.Tuple) and isinstance(node.ctx, ast.Load):
            assert not any(isinstance(item, ast.Starred) for item in node.elts)
        if isinstance(node, ast.Import):
            assert {name.name for name in node.names} <= KNOWN
        if isinstance(node, ast.ImportFrom):
            assert node.module in KNOWN
        if isinstance(node, ast.Attribute):
            assert node.attr not in MISSING
        if isinstance(node, ast.FormattedValue):
            assert node.conversion == -1
        if isinstance(node, ast.FunctionDef | ast.Lambda):
            assert not node.args.posonlyargs
            assert not (isinstance(node, ast.FunctionDef) and (node.returns or node.decorator_list))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in ("zip", "super") or not node.keywords


@pytest.mark.parametrize("seed", range(8))
def test_it_answers_and_lays_out_the_same_under_micropython(seed: int, tmp_path: Path) -> None:
    lines = [*LOADED.decode().splitlines(), ARM.decode().strip(), "RUN 2", "TRIM sooner 3001", "CLK a", "STOP", "CAPS"]
    lines += ["ID*A21C", "KEEP 1", "STEPS 0 x", "SLOT 0 1000 16000 250 0:124", "ARM 1", "WHAT", "STAT", "NEW"]
    lines += [*upload(random.Random(seed), darker=12_500), "RUN 0", "TRIM later 20000"]
    script = tmp_path / "asked.py"
    script.write_text(_under_micropython(lines), encoding="utf-8")
    said = subprocess.run([*micropython(), script], capture_output=True, text=True, check=True).stdout.splitlines()
    here: dict[str, Any] = {"printed": []}
    exec(script.read_text(encoding="utf-8").replace("print(", "printed.append("), here)
    assert said == [str(line) for line in here["printed"]]
    assert [line.split()[0] for line in said if "way=" in line] == ["OK", "OK"], "and trimmed"
    assert sum(line.startswith("OK check=") for line in said) == 2, "both cycles are armed"


def micropython() -> list[str]:
    """Return what runs a file under MicroPython; its build for JavaScript has a Pico's word length and memory."""
    node = shutil.which("node")
    if node is None or not (CLIENTS / "node_modules" / "@micropython").is_dir():
        pytest.skip("needs node and MicroPython: tests/install.sh installs MicroPython where npm is there")
    return [node, str(CLIENTS / "run_micropython.mjs")]


def _under_micropython(lines: list[str]) -> str:
    text = MAIN.read_text(encoding="utf-8")
    for name in BOARD_MODULES:
        text = text.replace(f"import {name}\n", "")
    text = text.split('if __name__ == "__main__":')[0]
    return f"""{text}
class Still:
    def __init__(self):
        memory = lambda words: (array("I", bytes(4 * words)), 0, 0x20000000)
        self.links = [Link(group, [1, 2, 3, 4], memory(TABLE_WORDS), memory(TURNS)) for group in range(GROUPS)]
        self.pace = memory(RING)
    def ticks(self):
        return 0
    def interlock_open(self):
        return False
    def starved(self):
        return False
    def read_places(self):
        return [0, 0]
    def darken(self):
        pass
    def start(self, leads):
        return START_DELAY
controller = Controller(Still(), "emulated", "power")
for line in {lines!r}:
    print(controller.feed((line + chr(10)).encode()).decode().strip())
for table in controller.tables:
    print(crc16(bytes(table.link.memory[0])))
print([crc16(bytes(controller.pace.words)), controller.pace.written, controller.pace.carried])
"""
