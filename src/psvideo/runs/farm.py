"""The whole of ``psvideo farm``: a clip in, a job for a render farm out."""

import json
from collections.abc import Sequence
from pathlib import Path

from psvideo.errors import UsageError
from psvideo.export.farm_job import (
    SUBMITTED_FILE,
    TEMPLATE_FILE,
    VALUES_FILE,
    FarmJob,
    farm_note,
    job_lines,
    job_template,
    job_values,
)
from psvideo.formats.free_folders import refuse_folder
from psvideo.formats.paths import path_if_given, path_of
from psvideo.formats.rig_folder import rig_of_take
from psvideo.formats.rig_toml import read_rig
from psvideo.formats.whole_files import write_text
from psvideo.formats.whole_folders import whole_folder
from psvideo.runs.steps.output import MARK, rounds_of
from psvideo.sync.open_take import open_take

PIECE_ROUNDS = 300
"""Rounds of a piece, if nobody says how many there are: what it solves beside its own is then a tenth."""


def farm(
    clip: Path | str,
    *,
    rig: Path | str | None = None,
    out: Path | str | None = None,
    results: Path | str | None = None,
    plan: Path | str | None = None,
    pieces: int | None = None,
    words: Sequence[str] = (),
    force: bool = False,
) -> list[str]:
    """Write a clip's run as an Open Job Description bundle into the folder ``out``; return it as shell commands.

    ``rig`` says where the lights are (left out: rig.toml beside the footage), ``results`` where the results will lie
    (left out: ``results`` in ``out``); ``plan`` names the plan where it does not lie beside the footage; ``pieces``:
    into how many the run is cut (left out: by its length); ``words`` are other options of the command ``normals``, as
    one types them. Without ``out`` nothing is written. Raises UsageError where an output exists or no place is named,
    and PsvideoError where clip or rig cannot be used.
    """
    folder = path_if_given("out", out)
    if pieces is not None and pieces < 1:
        raise UsageError(f"`pieces` {pieces}: expected into how many pieces to cut the run, 1 or more.")
    if folder is None and results is None:
        raise UsageError("`out` and `results`: expected at least one, the job's folder or that of its results.")
    target = path_of("results", results) if results is not None else (folder or Path()) / "results"
    if folder is not None:
        refuse_folder(folder, mark=TEMPLATE_FILE, force=force)
    refuse_folder(target, mark=MARK, force=False)
    take = open_take(path_of("clip", clip), plan=path_if_given("plan", plan))
    rig_path = rig_of_take(rig, take.clip.path)
    read_rig(rig_path, plan_lights=take.plan.lights)
    job = FarmJob(
        clip=take.clip.path.resolve(),
        rig=rig_path.resolve(),
        results=target.resolve(),
        pieces=pieces or max(rounds_of(take) // PIECE_ROUNDS, 1),
        words=(*(() if plan is None else ("--plan", str(take.clip.plan_path.resolve()))), *words),
    )
    lines = job_lines(job)
    if folder is not None:
        with whole_folder(folder, mark=TEMPLATE_FILE, force=force, kept=False) as place:
            values = job_values(job)
            listed = {"parameterValues": [{"name": name, "value": value} for name, value in values.items()]}
            files = {TEMPLATE_FILE: job_template(job), VALUES_FILE: values, SUBMITTED_FILE: listed}
            for name, record in files.items():
                write_text(place / name, json.dumps(record, indent=1) + "\n")
            write_text(place / "commands.txt", "\n".join(lines) + "\n")
            write_text(place / "README.txt", farm_note(job, lines))
    return lines
