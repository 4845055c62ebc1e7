"""A process that reads the files whose names come line by line, and answers each with what became of it, as JSON.

What a reader refuses with one paragraph is fine, and so is what it reads; anything else is a fault. A process of its
own, so that a crash, a hang or a flood of memory is seen from outside.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from itertools import islice
from pathlib import Path

from psvideo.clip.decode.decoders import decode, read_header
from psvideo.clip.decode.movies.movie import index_movie
from psvideo.clip.decode.movies.movie_frames import read_movie
from psvideo.clip.folder import KINDS, MOVIES
from psvideo.clip.stated import stated_by
from psvideo.errors import PsvideoError
from psvideo.formats.plan_toml import read_plan
from psvideo.formats.rig_toml import read_rig
from psvideo.formats.timing_json import read_timing
from psvideo.formats.trace_csv import read_trace
from psvideo.inspect.describe import describe
from psvideo.strobe.runlog import read_log

MOST_FRAMES = 8
TEXTS: dict[str, Callable[[Path], object]] = {
    "plan": read_plan,
    "rig": read_rig,
    "timing": read_timing,
    "strobe": read_log,
    "trace": read_trace,
}
"""Readers of text files, by how their names begin; lists of lights are read as rigs."""


def read(path: Path) -> str:
    """Read a file as the program would, and return what it is; what ``info`` says of it is made on the way."""
    describe(path)
    suffix = path.suffix.lower()
    if suffix in MOVIES:
        movie = index_movie(path)
        frames = sum(1 for _ in islice(read_movie(path, movie.timestamps), MOST_FRAMES))
        return f"movie of {len(movie.timestamps)} frames, {frames} decoded"
    if suffix in KINDS:
        stated_by(path)
        head = read_header(KINDS[suffix], path)
        codes = decode(KINDS[suffix], path).codes
        if codes.shape[:2] != (head.height_px, head.width_px):
            raise ValueError(f"header says {head.height_px} x {head.width_px}, the picture is {codes.shape}")
        return f"picture {codes.shape}"
    known = next((reader for name, reader in TEXTS.items() if path.name.startswith(name)), read_rig)
    return type(known(path)).__name__


def answer(path: Path) -> dict[str, object]:
    """Return what became of a file: ``said`` is what was read or refused, ``fault`` what should not have been."""
    began_s = time.process_time()
    said, fault = "", ""
    try:
        said = read(path)
    except PsvideoError as refused:
        said = f"refused: {refused}"
        if str(path) not in said:
            fault = f"does not name the file: {refused}"
    except Exception as other:  # whatever it is, it is what is looked for here
        fault = repr(other)
    return {"said": said, "fault": fault, "cpu_s": time.process_time() - began_s, "peak_mb": _peak_mb()}


def _peak_mb() -> float:
    """Return the largest memory since the last call, and begin again."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    peak_kb = next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return peak_kb / 1024


if __name__ == "__main__":
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", buffering=1)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # libraries write to the terminal by themselves
    for line in sys.stdin:
        print(json.dumps(answer(Path(line.rstrip("\n")))), file=answers)
