"""The whole of ``psvideo live``: a source in, the newest result shown, what it came to and its timing out."""

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path

from psvideo.errors import said_of
from psvideo.formats.paths import path_if_given, path_of
from psvideo.formats.rig_folder import rig_beside
from psvideo.formats.rig_toml import read_rig
from psvideo.formats.timing_json import SCHEMA as TIMING
from psvideo.formats.timing_json import format_timing
from psvideo.formats.whole_files import refuse_existing, write_text
from psvideo.live.chain import Chain
from psvideo.live.following.lock import check_followed
from psvideo.live.incoming.source import LiveSource
from psvideo.live.incoming.sources import opened_source
from psvideo.live.running import Running
from psvideo.live.showing.newest_result import NewestRound
from psvideo.live.showing.quality import first_quality
from psvideo.live.status import LiveStatus, LiveSummary
from psvideo.model.choices import Pace
from psvideo.model.first_light import check_first_light
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.page.serving import ADDRESS
from psvideo.plates.sequence import check_separable
from psvideo.runs.on_set.live_recorded import check_found, log_beside, recorded, said_what_is_recorded, timing_of
from psvideo.runs.on_set.live_rehearsal import rehearse
from psvideo.runs.on_set.live_strobe import AskedLock, held_strobe
from psvideo.runs.on_set.live_viewed import PageAddress, check_gives_normals, rig_keeper, viewed
from psvideo.runs.steps.caller import PYTHON, Caller
from psvideo.strobe.link.ports import AUTO


def live(
    source: Path | str,
    *,
    plan: Path | str | None = None,
    rig: Path | str | None = None,
    first_light: str | None = None,
    rig_out: Path | str | None = None,
    timing_out: Path | str | None = None,
    growing: bool = False,
    raw: str | None = None,
    record: Path | str | None = None,
    lock: str | None = None,
    strobe: str = AUTO,
    yes: bool = False,
    pace: Pace = "own",
    seconds: float | None = None,
    force: bool = False,
    page: bool = False,
    host: str = ADDRESS,
    port: int | None = None,
    token: str | None = None,
    opened: Callable[[str], None] = lambda url: None,
    said: Callable[[LiveStatus], None] = lambda status: None,
    shown: Callable[[NewestRound], None] = lambda newest: None,
    caller: Caller = PYTHON,
) -> LiveSummary:
    """Follow a source's strobe while its frames come, and show the newest result.

    - ``source``: a finished clip, which is played; a URL (udp, rtsp, srt, …), a video device, or "-" for standard
      input. ``plan`` names the plan where it does not lie beside it.
    - ``growing``: the source is a folder that a recorder is writing. ``raw``: FFmpeg's name of the pixels that bare
      bytes hold, such as gray or gray16le.
    - ``rig``: where the lights are. Left out, the rig.toml beside the source's footage; where there is none, there are
      plates and no normals.
    - ``rig_out``: a rig.toml to write when lights are found on a chrome ball, by a click on the page.
    - ``timing_out``: a timing.json to write at the end, of all that was followed, by the recording's name and numbers
      where one was made; ``force`` replaces one.
    - ``record``: a clip folder to record the frames into, whole or not at all: of a run that is stopped (Ctrl-C) or
      ends in a fault, the frames until then.
    - ``lock``: play the plan on the board at the port ``strobe`` ("auto": by USB identity), and trim its period so that
      the dark row stands still: at the frame's "edge", at a row ("300"), or far from some rows ("200-500").
      ``yes``: everybody in the room has been warned of the flashing.
    - ``pace``: a clip's "own", or "fastest". ``seconds`` ends the run after so much footage.
    - ``page``: serve the live page, on this machine alone unless another ``host`` is named, then to those alone who
      know the ``token`` (left out, one is made); ``port`` left out: a free one. ``opened`` gets its address.

    ``said`` gets how things stand once a second, ``shown`` every result.

    Raises
    ------
    UsageError
        Where a file to write exists, or the plan's strobe cannot be followed.
    PsvideoError
        Where the source cannot be read or does not fit the plan, the rig's lights give no normals, or no strobe was
        found in it.
    """
    played = opened_source(str(source), plan=path_if_given("plan", plan), pace=pace, growing=growing, raw=raw)
    for warning in played.warnings:
        caller.warn(warning)
    _check_can_be_followed(played.plan, first_light)
    known = _rig(rig, source, played, caller)
    timing_path = _free(path_if_given("timing_out", timing_out), force=force)
    running = _running(played, known, first_light, seconds, said, shown)
    running.prepare = lambda: rehearse(played, known, step=running.chain.step, page=page)
    kept = rig_keeper(path_if_given("rig_out", rig_out), force=force)
    address = PageAddress(host=host, port=port, token=token)
    record_path = path_if_given("record", record)
    held = partial(
        held_strobe,
        running.chain,
        path_if_given("plan", plan) or played.plan_path,
        noted=running.notes.append,
        caller=caller,
        logged=partial(log_beside, running),
    )
    with (
        said_what_is_recorded(running, record_path, caller),
        viewed(running, known, address, kept=kept, opened=opened, caller=caller) if page else nullcontext(),
        recorded(running, record_path, known, force=force),
        nullcontext() if lock is None else held(AskedLock(where=lock, port=strobe, warned=yes)) as running.holding,
    ):
        summary = running.run()
    if running.recording is not None:
        summary = replace(summary, recorded=running.recording.written, notes=running.all_notes)
    check_found(running, record_path)
    if timing_path is not None:
        write_text(timing_path, format_timing(timing_of(running, record_path)))
    return summary


def _check_can_be_followed(plan: Plan, first_light: str | None) -> None:
    """Raise PsvideoError where a plan's flashes cannot be followed, or told from each other."""
    check_followed(plan)
    check_separable(plan)
    check_first_light(plan, first_light)


def _free(path: Path | None, *, force: bool) -> Path | None:
    """Return the path of the timing to write at the end. Raises UsageError where it cannot be, before the run."""
    if path is not None:
        refuse_existing(path, force=force, mark=TIMING)
    return path


def _rig(named: Path | str | None, source: Path | str, played: LiveSource, caller: Caller) -> Rig | None:
    """Return the rig that was named, or the one beside the footage, which is said; None where there is none.

    Raises PsvideoError where it gives no normals.
    """
    footage = Path(source)
    beside = rig_beside(footage) if footage.exists() else None
    path = beside if named is None else path_of("rig", named)
    if path is None:
        return None
    if named is None:
        caller.say(f"The lights stand where {path} says.")
    known = read_rig(path, plan_lights=played.plan.lights)
    with said_of(path):
        check_gives_normals(known, played)
    return known


def _running(
    source: LiveSource,
    rig: Rig | None,
    first_light: str | None,
    seconds: float | None,
    said: Callable[[LiveStatus], None],
    shown: Callable[[NewestRound], None],
) -> Running:
    camera = source.plan.camera
    quality = first_quality(camera.width_px, camera.height_px, mosaic=source.cfa is not None)
    chain = Chain(plan=source.plan, cfa=source.cfa, rig=rig, first_light=first_light, step=quality.step)
    return Running(chain=chain, source=source, quality=quality, shown=shown, said=said, seconds=seconds)
