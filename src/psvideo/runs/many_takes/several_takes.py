"""What commands over several takes share: a folder for each, one process or a cluster, one report over all."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any, get_args

from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import AllDoneError, PsvideoError, UsageError
from psvideo.formats.free_folders import refuse_folder
from psvideo.formats.paths import path_of, take_name
from psvideo.formats.rig_folder import check_rigs
from psvideo.formats.whole_files import write_text
from psvideo.formats.whole_folders import forget_begun
from psvideo.report.takes_report import TakeResult, takes_page, takes_record, worst_first
from psvideo.runs.many_takes.cluster import Cluster, connected
from psvideo.runs.many_takes.handed_out import Shared, done_apart
from psvideo.runs.steps.caller import Caller
from psvideo.runs.steps.output import MARK


@dataclass(frozen=True, kw_only=True)
class Takes:
    """Takes, each with its folder of results, ``of``, in the folder of all."""

    of: tuple[tuple[Path, Path], ...]
    folder: Path

    def reported(self, found: Sequence[TakeResult]) -> tuple[TakeResult, ...]:
        """Return what became of the takes, the worst first; of several, write one report over all."""
        results = worst_first(found)
        if len(self.of) > 1:
            write_text(self.folder / "report.json", json.dumps(takes_record(results), indent=1) + "\n")
            write_text(self.folder / "report.html", takes_page(results))
        return results


def several_takes(clips: Sequence[Path | str], *, out: Path | str, force: bool, resume: bool) -> Takes:
    """Return every clip with its folder of results: ``out`` of one, folders of it, named after the clips, of several.

    Raises UsageError where no clip is named, two are named alike, or one of the folders exists and is neither to be
    replaced (``force``) nor gone on with (``resume``).
    """
    paths, folder = [path_of("clips", clip) for clip in clips], path_of("out", out)
    names = names_of("clips", paths)
    places = [folder] if len(paths) == 1 else [folder / name for name in names]
    if not resume:
        for place in places:
            refuse_folder(place, mark=MARK, force=force)
    return Takes(of=tuple(zip(paths, places, strict=True)), folder=folder)


def names_of(parameter: str, clips: Sequence[Path]) -> list[str]:
    """Return what results of each clip are called. Raises UsageError, which names the parameter, where there is no
    clip, or two are named alike."""
    if not clips:
        raise UsageError(f"`{parameter}`: names no clip. Expected one or several folders of frames, or movie files.")
    names = [take_name(clip) for clip in clips]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        alike = ", ".join(str(clip) for clip in clips if take_name(clip) == twice[0])
        raise UsageError(
            f"{alike}: several are named {twice[0]!r}, and their results would lie in one place. Name each clip once, "
            "or rename its folder."
        )
    return names


def one_by_one(takes: Takes, do: Callable[[Path, Path], object], *, caller: Caller) -> Iterator[TakeResult]:
    """Do takes in this process, one after the other; one that cannot be used does not keep the others.

    ``do`` is called with a clip and its folder. UsageError goes on: it would be the same for every take.
    """
    for clip, place in takes.of:
        try:
            do(clip, place)
        except AllDoneError as done:
            caller.say(str(done))
        except UsageError:
            raise
        except (PsvideoError, OSError) as fault:
            yield TakeResult(clip=clip, out=place, fault=caller.spell(str(fault)))
            continue
        yield result_of(clip, place)


@dataclass(frozen=True, kw_only=True)
class Given:
    """How takes are to be done: by whom, over what lies there, and with which other ``options`` of the run, as
    ``whole_options`` gives them."""

    cluster: Cluster
    force: bool
    resume: bool
    options: Mapping[str, Any]
    watch: Watch = unwatched
    caller: Caller

    @property
    def of_one(self) -> dict[str, Any]:
        """The options for one take, with ``force``."""
        return {**self.options, "force": self.force}


def whole_options(run: Callable[..., object], options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options of a run in which all paths are whole, also those that are text: workers may run elsewhere."""
    takes_path = {name for name, one in signature(run).parameters.items() if Path in get_args(one.annotation)}
    return {
        name: Path(value).resolve() if name in takes_path and value is not None else value
        for name, value in options.items()
    }


def all_done(
    run: Callable[..., object],
    clips: Sequence[Path | str],
    *,
    out: Path | str,
    given: Given,
    share: Callable[[Takes, int], Sequence[Shared]],
    ended: Callable[[Path, Path], object],
) -> tuple[TakeResult, ...]:
    """Do every take, one after the other here or shared out among a cluster's workers, and return what became of each.

    ``run`` does one take here. ``share`` is called with the takes and the number of workers, and returns what each
    take is shared out as; ``ended`` with a clip and its folder once its workers are done. Raises as ``several_takes``
    and ``apart`` do.
    """
    check_rigs(given.options.get("rig"), clips)
    takes = several_takes(clips, out=out, force=given.force, resume=given.resume)
    if not given.cluster.named:

        def here(clip: Path, place: Path) -> None:
            run(clip, out=place, resume=given.resume, watch=given.watch, caller=given.caller, **given.of_one)

        return takes.reported([*one_by_one(takes, here, caller=given.caller)])
    found: list[TakeResult] = []
    shared = partial(share, takes)
    for clip, place, fault in apart(takes, shared, cluster=given.cluster, resume=given.resume, watch=given.watch):
        if fault:
            found.append(TakeResult(clip=clip, out=place, fault=given.caller.spell(fault)))
        else:
            found += one_by_one(Takes(of=((clip, place),), folder=place), ended, caller=given.caller)
    return takes.reported(found)


def apart(
    takes: Takes,
    share: Callable[[int], Sequence[Shared]],
    *,
    cluster: Cluster,
    resume: bool,
    watch: Watch = unwatched,
) -> Iterator[tuple[Path, Path, str]]:
    """Have takes done by a cluster, and give each with its folder and what is wrong, or nothing, as it is done.

    ``share`` is called with the number of workers and returns what each take is shared out as. Without ``resume`` what
    earlier runs had begun is forgotten first. Raises UsageError where the cluster cannot be used, PsvideoError where no
    scheduler answers, or where it is gone.
    """
    cluster.check()
    if not resume:
        for _, place in takes.of:
            forget_begun(place)
    with connected(cluster) as client:
        workers = len(client.scheduler_info()["workers"]) or 1
        for number, fault in done_apart(client, share(workers), watch=watch):
            yield *takes.of[number], fault


def result_of(clip: Path, out: Path) -> TakeResult:
    """Return what the report of a take's folder says, or that it cannot be read."""
    try:
        return TakeResult.of(clip, out, json.loads((out / "report.json").read_text(encoding="utf-8")))
    except (OSError, ValueError) as fault:
        return TakeResult(clip=clip, out=out, fault=f"{out / 'report.json'}: cannot be read ({fault}). Run it again.")
