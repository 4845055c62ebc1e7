"""What a live run leaves: its frames as a clip, its timing, and what is said of it where it ends early."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from psvideo.errors import NoStrobeError
from psvideo.formats.rig_folder import RIG_FILE
from psvideo.formats.rig_toml import format_rig
from psvideo.live.followed_timing import followed_timing
from psvideo.live.incoming.recording import FIRST_NUMBER, recorded_words, recording
from psvideo.live.running import Running
from psvideo.model.rig import Rig
from psvideo.model.timing import Timing
from psvideo.model.units import counted
from psvideo.runs.steps.caller import Caller
from psvideo.strobe.runlog import LOG_NAME, RunLog, format_log


@contextmanager
def recorded(running: Running, path: Path | None, rig: Rig | None, *, force: bool) -> Iterator[None]:
    """Record a run's frames while the block runs, where a path is named, with the rig in use beside them."""
    if path is None:
        yield
        return
    with recording(path, running.source, force=force) as record:
        running.recording = record
        if rig is not None:
            record.beside[RIG_FILE] = format_rig(rig)
        yield


def log_beside(running: Running, log: RunLog) -> None:
    """Put a strobe's log beside the frames that are recorded, if any are."""
    if running.recording is not None:
        running.recording.beside[LOG_NAME] = format_log(log)


@contextmanager
def said_what_is_recorded(running: Running, path: Path | None, caller: Caller) -> Iterator[None]:
    """Say what a recording holds where somebody stops the block that makes it."""
    try:
        yield
    except KeyboardInterrupt:
        record = running.recording
        if path is not None and record is not None and record.written:
            caller.warn(f"{recorded_words(path, record)} {record.ended}".rstrip())
        raise


def check_found(running: Running, record_path: Path | None) -> None:
    """Raise NoStrobeError where no strobe was found, with what was recorded all the same."""
    if running.chain.follower is not None:
        return
    frames, record = running.chain.count.seen, running.recording
    so_few = f"{counted(frames, 'frame')} {'is' if frames == 1 else 'are'}"
    few = f"{running.source.name}: {so_few} too few to find the strobe in. Let it run for longer."
    whole = "" if record is None or record_path is None else recorded_words(record_path, record)
    raise NoStrobeError(f"{running.chain.why or few} {whole}".rstrip())


def timing_of(running: Running, record_path: Path | None) -> Timing:
    """Return the timing of all that was followed, by the recording's name and numbers where one was made."""
    source, named = running.source, running.chain.count.first_file
    name, first = source.name, source.first_number if named is None else named
    if record_path is not None:
        name, first = record_path.resolve().name, FIRST_NUMBER
    return followed_timing(running.chain, clip=name, first_number=first)
