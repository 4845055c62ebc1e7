"""The picture of the page "psvideo from Python", made by the page's own code."""

import contextlib
import io
import re
from pathlib import Path
from typing import Any

import numpy as np
from docs.figures.staging import Figure, figure, row

from psvideo.pictures.on_screen import srgb

PAGE = Path(__file__).resolve().parents[1] / "python.md"
RELIT = 3
"""So many blocks lead to the relit picture; those after it need files."""


def blocks() -> list[str]:
    """Return the page's blocks of code, in order."""
    return re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)


def run_blocks(folder: Path, count: int | None = None) -> tuple[dict[str, Any], str]:
    """Run the first so many blocks, or all, in a folder; return the names that they made and what they printed."""
    names: dict[str, Any] = {}
    heard = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(heard):
        for code in blocks()[:count]:
            exec(compile(code, str(PAGE), "exec"), names)
    return names, heard.getvalue()


def python_relit(folder: Path) -> Figure:
    """One of the page's pictures, its normals and its relit picture."""
    folder.mkdir(parents=True, exist_ok=True)
    made, said = run_blocks(folder, RELIT)
    ps = made["ps"]
    shown = [
        ("one of eight pictures", srgb(made["images"][1].astype(np.float32), exposure=1.2)),
        ("normals", ps.picture_of("normals", made["surface"].normals)),
        ("relit", ps.picture_of("beauty", made["warm"] + made["cool"])),
    ]
    return figure([row("From photographs to new light", *shown)], said)


PYTHON = {"python_relit": python_relit}
