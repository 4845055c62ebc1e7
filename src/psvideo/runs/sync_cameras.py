"""The whole of ``psvideo sync`` for several cameras: clips of one strobe in, their clocks against each other out."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import UsageError
from psvideo.formats.clocks_json import SCHEMA, format_clocks
from psvideo.formats.paths import path_if_given, path_of
from psvideo.formats.whole_files import check_ending, refuse_existing, write_text
from psvideo.model.camera_clocks import CameraClocks
from psvideo.model.units import counted
from psvideo.runs.steps.caller import PYTHON, Caller, say_of_clip
from psvideo.sync.open_take import open_take
from psvideo.sync.shared_flashes import CameraTake, camera_clocks
from psvideo.sync.take_timing import find_timing


def sync_cameras(
    clips: Sequence[Path | str],
    *,
    out: Path | str | None = None,
    starts_s: Sequence[float] | None = None,
    force: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> CameraClocks:
    """Find how the clocks of several cameras stand to each other, from the flashes of the one strobe that they saw.

    Parameters
    ----------
    clips
        Two clips or more, each with the plan of its own camera beside it; the first one's clock is the reference.
    out
        A clocks.json to write; ``force`` replaces it where it exists.
    starts_s
        Roughly when each clip began, in seconds on any one clock: needed where the marker leaves it open which flashes
        are the same. A coded marker does not.
    watch, caller
        Are handed every long loop, and the sentences that come on the way.

    Returns
    -------
    CameraClocks
        Of every camera ``offset_s``, ``rate_ppm``, ``drift_ppm_per_s`` and ``error_s`` against the first one.

    Raises
    ------
    UsageError
        Where ``out`` exists, ``starts_s`` are not as many as ``clips``, or a clip is named twice and they are left out.
    PsvideoError
        Where cameras saw different strobes, share no flashes, or it is not certain which they share.

    Examples
    --------
    A clip against itself:

    >>> import psvideo as ps
    >>> clocks = ps.sync_cameras(["take3/", "take3/"], starts_s=[0, 0], out="clocks.json")
    >>> round(clocks.cameras[1].rate_ppm, 3)
    0.0
    """
    out = path_if_given("out", out)
    if out is not None:
        refuse_existing(out, force=force, mark=SCHEMA)
        check_ending(out, ".json", "", name="out")
    if len(clips) < 2:
        raise UsageError("`clips`: expected two or more, of cameras that saw one strobe.")
    if starts_s is not None and len(starts_s) != len(clips):
        raise UsageError(f"`starts_s`: found {len(starts_s)} for {len(clips)} clips; expected one for each.")
    if starts_s is None:
        _refuse_one_clip_twice([path_of("clips", clip) for clip in clips])
    takes = []
    for clip in clips:
        take = open_take(path_of("clips", clip))
        say_of_clip(take.clip, caller)
        timing = find_timing(take, watch=watch)
        for note in timing.notes:
            caller.warn(f"{take.clip.name}: {note}")
        takes.append(CameraTake(plan=take.plan, timing=timing, numbers=tuple(take.clip.numbers)))
    clocks = camera_clocks(takes, starts_s=starts_s)
    for note in (*clocks.notes, *_named_alike([path_of("clips", clip) for clip in clips], clocks)):
        caller.warn(note)
    if out is not None:
        write_text(out, format_clocks(clocks))
    return clocks


def _refuse_one_clip_twice(paths: Sequence[Path]) -> None:
    """Raise UsageError where a clip is named twice: it agrees with itself at every turn of the cycle."""
    seen = set[Path]()
    for path in paths:
        if path.resolve() in seen:
            raise UsageError(f"{path}: named twice; expected the clips of different cameras.")
        seen.add(path.resolve())


def _named_alike(paths: Sequence[Path], clocks: CameraClocks) -> Iterator[str]:
    """Yield what to say of different clips of one name: clocks are known by clips' names afterwards."""
    by_name: dict[str, set[Path]] = {}
    for path, camera in zip(paths, clocks.cameras, strict=True):
        by_name.setdefault(camera.clip, set()).add(path.resolve())
    for name, places in by_name.items():
        if len(places) > 1:
            yield (
                f"{counted(len(places), 'clip')} are called {name}: which of these clocks is whose cannot be told "
                "afterwards, and `resync` refuses them. Give each folder or file a name of its own, and compare again."
            )
