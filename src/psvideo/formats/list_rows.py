"""The rows of a list of lights: held against their count, and against what beginners write in them."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError

ANGLES_SPAN = 7.0
"""Columns that span more, beside a third one that is the same throughout, are degrees: more than radians do."""
AXES = "x right, y up, z towards the camera"


def counted(path: Path, rows: list[list[float]]) -> list[list[float]]:
    """Take the count off the top of a list and hold the list against it. Raises PsvideoError where it does not fit."""
    count, vectors = rows[0][0], rows[1:]
    if len(rows[0]) != 1 or count != len(vectors):
        raise PsvideoError(
            f"{path}: the first line says {rows[0]}, and {len(vectors)} lines follow; expected their count."
        )
    vectors = [row[-3:] for row in vectors]
    short = next((row for row in vectors if len(row) != 3), None)
    if short is not None:
        shown = " ".join(f"{one:g}" for one in short)
        raise PsvideoError(
            f"{path}: a line has {len(short)} numbers ({shown}); expected three numbers x y z of a direction in every "
            f"line after the first ({AXES}). Angles are to be made directions first."
        )
    return vectors


def refuse_angles(path: Path, vectors: NDArray[np.float64]) -> None:
    """Raise PsvideoError where columns are angles and a distance: two turn far, and the third is always the same."""
    span = np.ptp(vectors, axis=0)
    if len(vectors) > 2 and span[:2].max() > ANGLES_SPAN and span[2] == 0 and abs(vectors[0, 2]) <= 1:
        shown = " ".join(f"{one:g}" for one in vectors[0])
        raise PsvideoError(
            f"{path}: its lines, such as {shown}, look like angles in degrees and a distance; expected x y z of the "
            f"direction to the light ({AXES}). With azimuth a and elevation e: x = cos(e) cos(a), y = cos(e) sin(a), "
            "z = sin(e)."
        )
