"""Several takes split in one go, by one process or several: ``psvideo split takes/* -o plates/``."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import AllDoneError
from psvideo.report.takes_report import TakeResult
from psvideo.runs.many_takes.cluster import Cluster
from psvideo.runs.many_takes.several_takes import Given, Takes, all_done, whole_options
from psvideo.runs.split import split
from psvideo.runs.steps.caller import PYTHON, Caller


def split_of_takes(
    clips: Sequence[Path | str],
    *,
    out: Path | str,
    workers: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    resume: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
    **options: Any,
) -> tuple[TakeResult, ...]:
    """Write what ``split`` writes of several takes, to the same bytes; each take is done by one process.

    - ``clips``: one, whose plates go into ``out``; or several, whose plates go into folders of ``out`` that are named
      after them, with one report over all, ``report.html``.
    - ``workers``: this many processes on this computer; ``scheduler``: the workers of a dask cluster, by its address,
      such as ``"tcp://HOST:8786"``, which see the same files under the same paths. Both need the extra
      ``psvideo[dask]``. With neither, one take is split after the other here.
    - ``force``, ``resume`` and all other ``options`` are those of ``split``. Takes that are done already are left as
      they are with ``resume``.

    ``watch`` is handed the loop over takes, or those of every take, and ``caller`` the sentences that come on the way.

    Returns
    -------
    tuple of TakeResult
        Of each take ``verdict``, ``usable``, ``findings`` and how many ``instants`` it has, or ``fault``, a sentence,
        where it could not be split; the worst first.

    Raises
    ------
    UsageError
        Where parameters do not fit together, or an output exists, before any work is done.
    PsvideoError
        Where no scheduler answers, or it is gone; what was written is kept for ``resume``.

    Examples
    --------
    >>> import psvideo as ps
    >>> results = ps.split_of_takes(["take3/"], out="plates/")
    >>> [(one.clip.name, one.fault, one.instants) for one in results]
    [('take3', '', 3)]
    """
    cluster = Cluster(workers=workers, scheduler=scheduler)
    given = Given(
        cluster=cluster, force=force, resume=resume, options=whole_options(split, options), watch=watch, caller=caller
    )

    def share(takes: Takes, _: int) -> list[TakeWhole]:
        return [TakeWhole(clip=clip.resolve(), out=place.resolve(), options=given.of_one) for clip, place in takes.of]

    return all_done(split, clips, out=out, given=given, share=share, ended=lambda clip, place: None)


@dataclass(frozen=True, kw_only=True)
class TakeWhole:
    """A take to be split by one worker, into ``out``, with the other ``options`` of ``split``."""

    clip: Path
    out: Path
    options: Mapping[str, Any]
    pieces: int = 0

    def do(self, number: int) -> None:
        """Split the take. What a worker that died had begun is gone on with, or is there already."""
        try:
            split(self.clip, out=self.out, resume=not self.options["force"], **self.options)
        except AllDoneError:
            return
