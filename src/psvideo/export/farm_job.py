"""A run as a job for render farms: an Open Job Description template, and the same as lines for a shell.

The template (``jobtemplate-2023-09``, github.com/OpenJobDescription/openjd-specifications) has three steps: what all
pieces share, the pieces, and what is made of them. Everything that a farm may want to change is a parameter of it.
"""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from psvideo.compute.threads import THREADS

VERSION = "jobtemplate-2023-09"
TEMPLATE_FILE = "template.json"
VALUES_FILE = "values.json"
"""The paths, as the program openjd reads them."""
SUBMITTED_FILE = "parameter_values.json"
"""The paths, as Deadline Cloud reads them."""


@dataclass(frozen=True, kw_only=True)
class FarmJob:
    """A clip to be solved in this many pieces: where it lies, with which rig, and where its results go. ``words`` are
    the other options of the command ``normals``, as one types them."""

    clip: Path
    rig: Path
    results: Path
    pieces: int
    words: tuple[str, ...] = ()

    def arguments(self, clip: str, rig: str, results: str, *last: str) -> list[str]:
        """Return the arguments of one command of the job."""
        return ["normals", clip, "--rig", rig, "-o", results, *self.words, *last]


def job_lines(job: FarmJob) -> list[str]:
    """Return one shell command a line: the first one before the others, the last one after them."""
    paths = (str(job.clip), str(job.rig), str(job.results))
    pieces = [job.arguments(*paths, "--piece", f"{n}/{job.pieces}") for n in range(job.pieces + 1)]
    return [shlex.join(["psvideo", *one]) for one in (*pieces, job.arguments(*paths, "--resume"))]


def job_values(job: FarmJob) -> dict[str, str]:
    """Return the values of the template's paths, which the standard does not allow as defaults: they lie anywhere."""
    return {"Clip": str(job.clip), "Rig": str(job.rig), "Results": str(job.results)}


def job_template(job: FarmJob) -> dict[str, object]:
    """Return the job as an OpenJD template."""
    return {
        "specificationVersion": VERSION,
        "name": f"psvideo {job.clip.stem if job.clip.is_file() else job.clip.name}"[:64],
        "description": "Normals and albedo from strobed footage, solved in pieces. All computers see the same files.",
        "parameterDefinitions": [
            _path("Clip", job.clip, "IN", "The footage."),
            _path("Rig", job.rig, "IN", "Where the lights are."),
            _path("Results", job.results, "OUT", "The folder of results, which must not be there yet."),
            {
                "name": "Threads",
                "type": "STRING",
                "default": "",
                "description": "How many threads a piece computes with; empty: as many as the computer has cores.",
            },
        ],
        "jobEnvironments": [{"name": "Threads", "variables": {THREADS: "{{Param.Threads}}"}}],
        "steps": [
            {"name": "Timing", "script": _script(job, "--piece", f"0/{job.pieces}")},
            {
                "name": "Solve",
                "dependencies": [{"dependsOn": "Timing"}],
                "parameterSpace": {
                    "taskParameterDefinitions": [{"name": "Piece", "type": "INT", "range": f"1-{job.pieces}"}]
                },
                "script": _script(job, "--piece", f"{{{{Task.Param.Piece}}}}/{job.pieces}"),
            },
            {"name": "Report", "dependencies": [{"dependsOn": "Solve"}], "script": _script(job, "--resume")},
        ],
    }


def _path(name: str, path: Path, flow: str, description: str) -> dict[str, object]:
    folder = flow == "OUT" or path.is_dir()
    return {
        "name": name,
        "type": "PATH",
        "objectType": "DIRECTORY" if folder else "FILE",
        "dataFlow": flow,
        "description": description,
    }


def _script(job: FarmJob, *last: str) -> dict[str, object]:
    words = job.arguments("{{Param.Clip}}", "{{Param.Rig}}", "{{Param.Results}}", *last)
    return {"actions": {"onRun": {"command": "psvideo", "args": words}}}


def farm_note(job: FarmJob, lines: Sequence[str]) -> str:
    """Return what is written beside the template for people."""
    return (
        f"{job.clip} in {job.pieces} pieces.\n\nOn a farm that takes Open Job Descriptions, submit this folder; here,\n"
        f"openjd run {TEMPLATE_FILE} -p file://{VALUES_FILE} runs it. By hand, in this order, the middle ones side by "
        "side:\n\n" + "\n".join(lines) + "\n"
    )
