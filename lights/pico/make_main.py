"""Join parts/*.py into main.py, the one file that a Pico takes: python3 lights/pico/make_main.py."""

import ast
from pathlib import Path

HERE = Path(__file__).parent
PARTS = ("link", "lines", "flashes", "table", "pace", "controller", "board")
HEADER = '''"""Strobe controller for a Raspberry Pi Pico (RP2040) in MicroPython: copy this file onto the board.

Made by make_main.py from the files in parts/: change those. README.md beside this file says how it works.
"""
'''
FOOTER = """

if __name__ == "__main__":
    run()
"""


def joined() -> str:
    """Return the text of main.py: all imports once, then the parts, each under the first line of its docstring."""
    imports: set[str] = set()
    bodies = []
    for part in PARTS:
        text = (HERE / "parts" / f"{part}.py").read_text(encoding="utf-8")
        docstring, *rest = ast.parse(text).body
        heads = [node for node in rest if isinstance(node, ast.Import | ast.ImportFrom)]
        imports.update(ast.unparse(node) for node in heads if getattr(node, "module", None) not in PARTS)
        last = heads[-1] if heads else docstring
        comment = "\n".join(f"# {line}".rstrip() for line in (ast.get_docstring(ast.parse(text)) or "").splitlines())
        bodies.append(f"\n\n# {part} {'-' * (117 - len(part))}\n{comment}\n\n\n{_behind(text, last)}")
    whole = sorted(line for line in imports if line.startswith("import"))
    parted = sorted(imports - set(whole))
    return "\n".join([HEADER, *whole, *parted, ""]) + "".join(bodies) + FOOTER


def _behind(text: str, node: ast.stmt) -> str:
    return "\n".join(text.splitlines()[node.end_lineno or 0 :]).strip("\n") + "\n"


if __name__ == "__main__":
    (HERE / "main.py").write_text(joined(), encoding="utf-8")
