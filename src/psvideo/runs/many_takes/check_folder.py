"""Many takes checked: those that are named, or every new one below a folder as it comes while a set shoots."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.rig_folder import check_rigs
from psvideo.runs.check import judged_take, refuse_inside
from psvideo.runs.many_takes.arriving import whole_takes
from psvideo.runs.many_takes.cluster import Cluster, connected
from psvideo.runs.many_takes.handed_out import called_apart
from psvideo.runs.steps.caller import PYTHON, Caller
from psvideo.runs.steps.checked import Check, write_checks_page

AS_IT_IS = Caller(spell=str)
"""In a worker, sentences keep their parameters' own names: the caller's words for them are put in here."""


@dataclass(frozen=True, kw_only=True)
class Unread:
    """A take that could not be checked, and why, in a sentence."""

    path: Path
    fault: str


def check_takes(
    clips: Sequence[Path | str],
    *,
    plan: Path | str | None = None,
    rig: Path | str | None = None,
    first_light: str | None = None,
    report: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> Iterator[Check | Unread]:
    """Check takes one after the other, or several at a time; one that cannot be read does not keep the others.

    ``report`` is a page (HTML) of all checks, outside of the takes. ``workers`` checks with this many processes on this
    computer, ``scheduler`` with the workers of a dask cluster, by its address, which see the same files under the same
    paths: takes come as they are done, and both need the extra ``psvideo[dask]``. ``watch`` is handed the loop over
    takes that are shared out; the other parameters are those of ``check``. Raises UsageError where the report would
    lie in a take, and where the cluster cannot be used; PsvideoError where no scheduler answers, or it is gone.
    """
    paths, page = [Path(clip) for clip in clips], None if report is None else Path(report)
    check_rigs(rig, paths)
    for path in paths:
        refuse_inside(page, path)
    plan_path, rig_path = (None if path is None else Path(path).resolve() for path in (plan, rig))
    one = partial(_one, plan=plan_path, rig=rig_path, first_light=first_light, caller=caller)
    checks: Iterator[tuple[Path, Check | Unread]] = ((path, one(path)) for path in paths)
    cluster = Cluster(workers=workers, scheduler=scheduler)
    if cluster.named:
        cluster.check()
        checks = _shared_out(cluster, paths, partial(one, caller=AS_IT_IS), caller=caller, watch=watch)
    found: dict[Path, Check | Unread] = {}
    for path, found[path] in checks:
        _keep(page, found, worst_first=True)
        yield found[path]


def _shared_out(
    cluster: Cluster, paths: Sequence[Path], one: Callable[[Path], Check | Unread], *, caller: Caller, watch: Watch
) -> Iterator[tuple[Path, Check | Unread]]:
    """Give each take with what a worker found of it. Workers may run elsewhere: they get whole paths."""
    given = {path.resolve(): path for path in paths}
    with connected(cluster) as client:
        for whole, check in called_apart(client, one, [*given], watch=watch):
            path = given[whole]
            if isinstance(check, Check):
                yield path, replace(check, path=path)
            else:
                fault = check.fault if isinstance(check, Unread) else check
                yield path, Unread(path=path, fault=caller.spell(fault))


def check_folder(
    folder: Path | str,
    *,
    interval_s: float = 2.0,
    existing: bool = False,
    plan: Path | str | None = None,
    rig: Path | str | None = None,
    first_light: str | None = None,
    report: Path | str | None = None,
    caller: Caller = PYTHON,
) -> Iterator[Check | Unread]:
    """Check every new take that appears below a folder, once it has stopped growing; never ends by itself.

    ``interval_s`` are the seconds between two looks at the folder; with ``existing``, takes that are there already are
    checked, too. A take that changes later is checked again. ``report`` is a page (HTML) of all checks, outside of the
    folder; the other parameters are those of ``check``. ``caller.say`` hears when the folder cannot be reached. Raises
    UsageError where the folder is none, or where the report would lie in it.
    """
    folder, page = Path(folder), None if report is None else Path(report)
    if not folder.is_dir():
        raise UsageError(f"{folder}: is not a folder. Name the folder into which takes are copied.")
    refuse_inside(page, folder)
    plan_path, rig_path = (None if path is None else Path(path) for path in (plan, rig))
    return _checks(folder, interval_s, existing, page, plan_path, rig_path, first_light, caller)


def _checks(
    folder: Path,
    interval_s: float,
    existing: bool,
    page: Path | None,
    plan: Path | None,
    rig: Path | None,
    first_light: str | None,
    caller: Caller,
) -> Iterator[Check | Unread]:
    found: dict[Path, Check | Unread] = {}
    there = True
    for path in whole_takes(folder, interval_s=interval_s, existing=existing):
        if path is None:
            if there != folder.is_dir():
                there = not there
                caller.say(f"{folder}: {'is there again.' if there else 'cannot be reached; waiting for it.'}")
            continue
        found.pop(path, None)  # the newest comes last
        found[path] = _one(path, plan, rig, first_light, caller)
        _keep(page, found)
        yield found[path]


def _one(path: Path, plan: Path | None, rig: Path | None, first_light: str | None, caller: Caller) -> Check | Unread:
    was_there = path.exists()
    try:
        return judged_take(path, plan=plan, rig=rig, first_light=first_light, caller=caller)
    except (PsvideoError, OSError) as fault:
        gone = f"{path}: was removed before it could be checked."
        return Unread(path=path, fault=caller.spell(str(fault)) if path.exists() or not was_there else gone)


def _keep(page: Path | None, found: Mapping[Path, Check | Unread], *, worst_first: bool = False) -> None:
    """Write the page of all checks so far, if there is one."""
    if page is not None:
        checks = [one for one in found.values() if isinstance(one, Check)]
        unread = {one.path: one.fault for one in found.values() if isinstance(one, Unread)}
        write_checks_page(page, checks, unread, worst_first=worst_first)
