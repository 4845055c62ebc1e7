"""Many takes checked: those that are named, or every new one below a folder as it comes while a set shoots."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from psvideo.errors import PsvideoError, UsageError
from psvideo.runs.caller import PYTHON, Caller
from psvideo.runs.check import judged, refuse_inside
from psvideo.runs.checked import Check, write_page
from psvideo.runs.takes import whole_takes


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
    caller: Caller = PYTHON,
) -> Iterator[Check | Unread]:
    """Check takes one after the other; one that cannot be read does not keep the others.

    ``report`` is a page (HTML) of all checks, outside of the takes; the other parameters are those of ``check``. Raises
    UsageError where the report would lie in a take.
    """
    paths, page = [Path(clip) for clip in clips], None if report is None else Path(report)
    for path in paths:
        refuse_inside(page, path)
    plan_path, rig_path = (None if path is None else Path(path) for path in (plan, rig))
    found: dict[Path, Check | Unread] = {}
    for path in paths:
        found[path] = _one(path, plan_path, rig_path, first_light, caller)
        _keep(page, found)
        yield found[path]


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
        raise UsageError(f"{folder}: is no folder. Name the folder into which takes are copied.")
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
    try:
        return judged(path, plan=plan, rig=rig, first_light=first_light, caller=caller)
    except (PsvideoError, OSError) as fault:
        gone = f"{path}: was removed before it could be checked."
        return Unread(path=path, fault=caller.spell(str(fault)) if path.exists() else gone)


def _keep(page: Path | None, found: Mapping[Path, Check | Unread]) -> None:
    """Write the page of all checks so far, if there is one."""
    if page is not None:
        checks = [one for one in found.values() if isinstance(one, Check)]
        write_page(page, checks, {one.path: one.fault for one in found.values() if isinstance(one, Unread)})
