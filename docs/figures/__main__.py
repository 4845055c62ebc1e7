"""Make the pages' pictures: ``python -m docs.figures`` makes all, ``python -m docs.figures fault_banding`` one."""

import sys
import tempfile
from pathlib import Path

import cv2
from docs.figures.depth_views import DEPTH
from docs.figures.explained import EXPLAINED
from docs.figures.faults import FAULTS
from docs.figures.python_page import PYTHON
from docs.figures.staging import PICTURES
from docs.figures.turning import TURNING

FIGURES = DEPTH | EXPLAINED | FAULTS | PYTHON | TURNING


def main(names: list[str]) -> None:
    """Write the pictures that are named, or all, and print what psvideo said."""
    with tempfile.TemporaryDirectory() as folder:
        figures = {name: FIGURES[name](Path(folder) / name) for name in names or FIGURES}
    for name, made in figures.items():
        cv2.imwrite(str(PICTURES / f"{name}.png"), made.picture[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])
        print(f"{name}: {made.said}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
