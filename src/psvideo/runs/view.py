"""The whole of ``psvideo view``: results, plates or a clip, served to a browser or written into one file."""

from collections.abc import Sequence
from pathlib import Path

from psvideo.compute.progress import Watch, unwatched
from psvideo.page import Show, page_server, show_of, side_by_side, write_single_page
from psvideo.page.serving import PageServer
from psvideo.page.single_file import PageContents
from psvideo.runs.steps.caller import PYTHON, Caller


def view(
    path: Path | str | Sequence[Path | str],
    *,
    clip: Path | str | None = None,
    plan: Path | str | None = None,
    port: int | None = None,
    caller: Caller = PYTHON,
) -> PageServer:
    """Return a server of the page that shows a result: it listens, and answers from ``serve_forever()`` on.

    ``path`` is a folder of results or plates, or a clip; or several folders of results, to be seen side by side.
    ``clip`` is what results or plates came from, left out:
    looked for beside them; ``plan`` the clip's plan where it does not lie beside it. ``port`` is left out for a free
    one. Used in a ``with`` block, the server closes its port and releases its pictures at the end.

    Raises UsageError where the port is taken or not allowed, and PsvideoError where there is nothing to show.
    """
    return page_server(_show(path, clip, plan, caller), port=port)


def export_view(
    path: Path | str | Sequence[Path | str],
    *,
    out: Path | str,
    clip: Path | str | None = None,
    plan: Path | str | None = None,
    width_px: int = 480,
    count: int = 24,
    force: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> PageContents:
    """Write the page, with up to ``count`` pictures of each sequence, at most ``width_px`` wide, into the file ``out``.

    ``path``, ``clip`` and ``plan`` are those of ``view``; ``force`` replaces a page that exists. Raises UsageError
    where ``out`` exists, and PsvideoError where there is nothing to show.
    """
    show = _show(path, clip, plan, caller)
    return write_single_page(show, Path(out), width_px=width_px, count=count, force=force, watch=watch)


def _show(
    path: Path | str | Sequence[Path | str], clip: Path | str | None, plan: Path | str | None, caller: Caller
) -> Show:
    paths = [Path(path)] if isinstance(path, Path | str) else [Path(one) for one in path]
    of_clip, of_plan = None if clip is None else Path(clip), None if plan is None else Path(plan)
    shows = [show_of(one, clip=None if place else of_clip, plan=of_plan) for place, one in enumerate(paths)]
    show = side_by_side(shows, paths)
    for note in show.notes:
        caller.detail(note)
    return show
