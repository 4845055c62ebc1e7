"""Several takes in one go, or one by several processes: ``psvideo normals takes/* -o results/``."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import AllDoneError, PsvideoError, UsageError
from psvideo.formats.paths import path_if_given
from psvideo.report.takes_report import TakeResult
from psvideo.runs.many_takes.cluster import Cluster
from psvideo.runs.many_takes.several_takes import Given, Takes, all_done, whole_options
from psvideo.runs.normals import normals
from psvideo.runs.steps.caller import PYTHON, Caller
from psvideo.runs.steps.output import rounds_of
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
    - ``workers``: this many processes on this computer; ``scheduler``: the workers of a dask cluster, by its address,
      such as ``"tcp://HOST:8786"``, which see the same files under the same paths. Both need the extra
      ``psvideo[dask]``. With neither, one take is solved after the other here. ``pieces``: into how many a take is cut
      (left out: by its length). ``piece`` is refused: it belongs to ``normals``.
    - ``rig`` among the ``options``: one for all takes, or a folder of rigs, one for each and named after it.
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
    cluster = Cluster(workers=workers, scheduler=scheduler)
    given = Given(
        cluster=cluster, force=force, resume=resume, options=whole_options(normals, options), watch=watch, caller=caller
    )

    def share(takes: Takes, there: int) -> list[TakeInPieces]:
        counts = [pieces] * len(takes.of) if pieces else _counts(takes, there, options)
        return [
            TakeInPieces(clip=clip.resolve(), out=place.resolve(), pieces=count, options=given.of_one)
            for (clip, place), count in zip(takes.of, counts, strict=True)
        ]

    def put_together(clip: Path, place: Path) -> None:
        normals(clip, out=place, resume=True, caller=caller, **given.of_one)

    return all_done(normals, clips, out=out, given=given, share=share, ended=put_together)


@dataclass(frozen=True, kw_only=True)
class TakeInPieces:
    """A take to be solved in this many pieces, into ``out``, with the other ``options`` of ``normals``."""

    clip: Path
    out: Path
    pieces: int
    options: Mapping[str, Any]

    def do(self, number: int) -> None:
        """Find the take's timing and what is global (number 0), or solve one piece. What is done already stays."""
        with suppress(AllDoneError):
            normals(self.clip, out=self.out, piece=f"{number}/{self.pieces}", **self.options)


def _counts(takes: Takes, workers: int, options: Mapping[str, Any]) -> Iterator[int]:
    """Give into how many pieces each take is cut: enough for all workers, and none too short. One that cannot be opened
    is one piece, whose worker says why, and does not keep the others."""
    for clip, _ in takes.of:
        try:
            take = open_take(clip, plan=path_if_given("plan", options.get("plan")), frames=options.get("frames"))
        except UsageError:
            raise
        except PsvideoError:
            yield 1
            continue
        wanted = -(-4 * workers // len(takes.of))
        yield max(min(wanted, rounds_of(take) // LEAST_ROUNDS), 1)
