"""Whole runs: a clip in, a folder of files out, with decoding, computing and writing side by side."""

from psvideo.runs.lighting import Lighting, read_lighting
from psvideo.runs.look import look
from psvideo.runs.output import Output, sequence_fps
from psvideo.runs.plates import Besides, split_run
from psvideo.runs.results import NormalsResult, OverTime, normals_run
from psvideo.runs.timed import timing_of

__all__ = [
    "Besides",
    "Lighting",
    "NormalsResult",
    "Output",
    "OverTime",
    "look",
    "normals_run",
    "read_lighting",
    "sequence_fps",
    "split_run",
    "timing_of",
]
