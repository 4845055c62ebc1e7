"""Several takes in one go, or one by several processes: ``psvideo normals takes/* -o results/``."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import AllDoneError, PsvideoError, UsageError
from psvideo.formats.paths import path_if_given, path_of
from psvideo.formats.whole_files import write_text
from psvideo.formats.whole_folders import forget_begun, refuse_folder
from psvideo.report.of_takes import TakeResult, takes_page, takes_record, worst_first
from psvideo.runs.caller import PYTHON, Caller
from psvideo.runs.cluster import Cluster, Shared, connected, solved_apart
from psvideo.runs.normals import normals
from psvideo.runs.output import MARK, rounds_of
from psvideo.sync.open_take import open_take

LEAST_ROUNDS = 128
"""Rounds of the smallest piece: each costs some 34 rounds beside its own."""


def normals_of_takes(
    clips: Sequence[Path | str],
    *,
    out: Path | str,
    workers: int | None = None,
    scheduler: str | None = None,
    pieces: int | None = None,
    piece: str | None = None,
    force: bool = False,
    resume: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
    **options: Any,
) -> tuple[TakeResult, ...]:
    """Write what ``normals`` writes of several takes, or of one by several processes, to the same bytes.

    - ``clips``: one, whose results go into ``out``; or several, whose results go into folders of ``out`` that are
      named after them, with one report over all, ``report.html``.
    - ``workers``: so many processes on this computer; ``scheduler``: the workers of a dask cluster, by its address,
      such as ``"tcp://HOST:8786"``, which see the same files under the same paths. Both need the extra
      ``psvideo[dask]``. With neither, one take is solved after the other here. ``pieces``: into how many a take is cut
      (left out: by its length). ``piece`` is refused: it belongs to ``normals``.
    - ``force``, ``resume`` and all other ``options`` are those of ``normals``. Takes that are done already are left as
      they are with ``resume``.

    ``watch`` is handed the loop over pieces, or those of every take, and ``caller`` the sentences that come on the way.

    Returns
    -------
    tuple of TakeResult
        Of each take ``verdict``, ``usable``, ``findings`` and how many ``instants`` it has, or ``fault``, a sentence,
        where it could not be solved; the worst first.

    Raises
    ------
    UsageError
        Where parameters do not fit together, or an output exists, before any work is done.
    PsvideoError
        Where no scheduler answers, or it is gone; what was solved is kept for ``resume``.

    Examples
    --------
    >>> import psvideo as ps
    >>> results = ps.normals_of_takes(["take3/"], rig="take3/rig.toml", out="results/")
    >>> [(one.clip.name, one.fault, one.instants) for one in results]
    [('take3', '', 2)]
    """
    if piece is not None:
        raise UsageError("`piece` is solved by one process, of one clip. Leave it out here.")
    folder = path_of("out", out)
    takes = _outputs([path_of("clips", clip) for clip in clips], folder)
    for _, place in takes:
        if not resume:
            refuse_folder(place, mark=MARK, force=force)
    whole = {name: value.resolve() if isinstance(value, Path) else value for name, value in options.items()}
    given = {**whole, "force": force}
    if workers is None and scheduler is None:
        found = [_solved(clip, place, given, resume=resume, watch=watch, caller=caller) for clip, place in takes]
    else:
        cluster = Cluster(workers=workers, scheduler=scheduler)
        cluster.check()
        if not resume:
            for _, place in takes:
                forget_begun(place)
        with connected(cluster) as client:
            there = len(client.scheduler_info()["workers"]) or 1
            shared = [
                Shared(clip=clip.resolve(), out=place.resolve(), pieces=pieces or count, options=given)
                for (clip, place), count in zip(takes, _counts(takes, there, options), strict=True)
            ]
            found = []
            for number, fault in solved_apart(client, shared, watch=watch):
                clip, place = takes[number]
                if fault:
                    found.append(TakeResult(clip=clip, out=place, fault=fault))
                else:
                    found.append(_solved(clip, place, given, resume=True, watch=unwatched, caller=caller))
    results = worst_first(found)
    if len(takes) > 1:
        write_text(folder / "report.json", json.dumps(takes_record(results), indent=1) + "\n")
        write_text(folder / "report.html", takes_page(results))
    return results


def _outputs(clips: Sequence[Path], out: Path) -> list[tuple[Path, Path]]:
    """Return every clip with its folder of results."""
    if not clips:
        raise UsageError("`clips`: names no clip. Expected one or several folders of frames, or movie files.")
    if len(clips) == 1:
        return [(clips[0], out)]
    names = [clip.stem if clip.is_file() else clip.resolve().name for clip in clips]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise UsageError(f"`clips`: several are named {twice[0]!r}, and their results would lie in one folder.")
    return [(clip, out / name) for clip, name in zip(clips, names, strict=True)]


def _solved(
    clip: Path, out: Path, options: Mapping[str, Any], *, resume: bool, watch: Watch, caller: Caller
) -> TakeResult:
    try:
        normals(clip, out=out, resume=resume, watch=watch, caller=caller, **options)
    except AllDoneError as done:
        caller.say(str(done))
    except UsageError:
        raise
    except PsvideoError as fault:
        return TakeResult(clip=clip, out=out, fault=caller.spell(str(fault)))
    return TakeResult.of(clip, out, json.loads((out / "report.json").read_text(encoding="utf-8")))


def _counts(takes: Sequence[tuple[Path, Path]], workers: int, options: Mapping[str, Any]) -> Iterator[int]:
    """Give into how many pieces each take is cut: enough for all workers, and none too short."""
    for clip, _ in takes:
        take = open_take(clip, plan=path_if_given("plan", options.get("plan")), frames=options.get("frames"))
        wanted = -(-4 * workers // len(takes))
        yield max(min(wanted, rounds_of(take) // LEAST_ROUNDS), 1)
