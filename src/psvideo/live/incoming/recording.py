"""Recording while the camera runs: every frame in its codes, a clip as any other, whole or not at all.

Frames wait in memory for the disk, up to a limit. Where the disk falls behind so far, or fills, recording ends there
and says so: what was recorded until then is a clip without a hole. So it is where the run ends in a fault: nobody can
film a take again as it was.
"""

import shutil
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError, UsageError
from psvideo.export.sequences.code_files import write_codes
from psvideo.formats.clip_layout import FRAMES, PLAN_FILE
from psvideo.formats.free_folders import unfinished_folder_of
from psvideo.formats.whole_folders import forget_begun, whole_folder
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.live.incoming.source import LiveSource
from psvideo.model.units import counted
from psvideo.strobe.runlog import LOG_NAME

MOST_WAITING_BYTES = 256_000_000
"""Codes that may wait for the disk: more than a second of most cameras."""
FIRST_NUMBER = 1
"""What the first recorded frame's file is numbered."""
NO_ROOM = "the disk takes no more"
"""numpy says in its own words, and without the system's, that fewer bytes were written than it had."""


@dataclass(kw_only=True)
class Recording:
    """Takes frames and writes them beside. ``written`` counts them; ``ended`` says why recording ended early.

    ``beside`` holds texts to write beside the frames at the end, by file name: the rig that is in use, and the log of
    a strobe that was played meanwhile, in place of the one that lies beside the plan.
    ``waits``: a frame waits for room, as of a clip that is played as fast as it goes; else recording ends.
    """

    folder: Path
    waits: bool = False
    written: int = 0
    ended: str = ""
    beside: dict[str, str] = field(default_factory=dict)
    most_bytes: int = MOST_WAITING_BYTES
    _queue: deque[tuple[int, NDArray[Any]]] = field(default_factory=deque)
    _bytes: int = 0
    _over: bool = False
    _changed: threading.Condition = field(default_factory=threading.Condition)

    def take(self, frame: LiveFrame) -> None:
        """Take one frame for the disk."""
        codes = np.asarray(frame.coded.codes)
        with self._changed:
            if self.waits:
                self._changed.wait_for(lambda: self._bytes < self.most_bytes or bool(self.ended))
            elif self._bytes + codes.nbytes > self.most_bytes and not self.ended:
                self.ended = (
                    f"The disk of {self.folder.parent} is too slow for this camera: recording ended after "
                    f"{self.written + len(self._queue)} frames, which are whole. Record to a faster disk, or film "
                    "fewer rows or frames a second."
                )
            if not self.ended and not self._over:
                self._queue.append((frame.index, codes))
                self._bytes += codes.nbytes
                self._changed.notify_all()

    def write(self) -> None:
        """Write frames as they come until the recording is over; what runs in a thread."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: bool(self._queue) or self._over)
                if not self._queue:
                    return
                index, codes = self._queue[0]
            try:
                write_codes(self.folder / FRAMES / f"live.{index + FIRST_NUMBER:06d}.tif", codes)
            except Exception as fault:  # whatever it is, nobody may wait for this thread, nor take it for whole
                self._give_up(index, fault)
                return
            with self._changed:
                if self._queue and self._queue[0][1] is codes:  # nobody cut it meanwhile
                    self._queue.popleft()
                    self._bytes -= codes.nbytes
                self.written += 1
                self._changed.notify_all()

    def over(self) -> None:
        """Say that no more frames come."""
        with self._changed:
            self._over = True
            self._changed.notify_all()

    def cut(self) -> None:
        """End at once: what still waits for the disk is left out."""
        with self._changed:
            self._over = True
            if len(self._queue) > 1:  # the first of them is being written
                self.ended = "The run was stopped while more frames waited for the disk, which are not recorded."
            self._queue.clear()
            self._bytes = 0
            self._changed.notify_all()

    def _give_up(self, index: int, fault: Exception) -> None:
        why = (fault.strerror or NO_ROOM) if isinstance(fault, OSError) else str(fault)
        (self.folder / FRAMES / f"live.{index + FIRST_NUMBER:06d}.tif").unlink(missing_ok=True)
        with self._changed:
            whole = f"after {counted(self.written, 'frame')}, which are whole: the next could not be written"
            until = whole if self.written else "at once: not even the first frame could be written"
            self.ended = f"Recording ended {until} ({why}). Make room on the disk, and record again."
            self._queue.clear()
            self._changed.notify_all()


@contextmanager
def recording(path: Path, source: LiveSource, *, force: bool) -> Iterator[Recording]:
    """Give what records a source into a clip folder; when the block ends, the folder appears under its name.

    The plan lies in it as it lay before, the strobe's log (the recording's own, or the one beside the plan), and the
    rig in use. A block that fails raises what it raised once the frames until then are whole, with a sentence that says
    so. Raises UsageError where the folder exists, where a recording that was killed left frames beside it, or the
    source's frames are not plain codes, and PsvideoError where not one frame was recorded.
    """
    if source.plan_path is None:
        raise UsageError(
            f"`record` {path}: {source.name} does not come as codes of 8 or 16 bits that the plan explains. Copy a "
            "clip as it is, and record from a pipe whose bare bytes `raw` names, such as gray or gray16le."
        )
    _refuse_left(path, force=force)
    failed, record = None, None
    try:
        with whole_folder(path, mark=PLAN_FILE, force=force) as folder:
            _lay_out(folder, source.plan_path)
            record = Recording(folder=folder, waits=not source.paced)
            writer = threading.Thread(target=record.write, name="psvideo record", daemon=True)
            writer.start()
            try:
                yield record
            except BaseException as fault:  # raised again below, when the folder is whole
                failed = fault
            failed = _ended(record, writer, failed)
            if not record.written:
                raise failed or PsvideoError(f"{path}: not one frame was recorded. {record.ended}".rstrip())
            _write_beside(folder, record)
    except BaseException:
        if record is not None and not record.written:
            forget_begun(path)
        raise
    if isinstance(failed, PsvideoError):
        raise type(failed)(f"{failed} {recorded_words(path, record)}") from failed
    if failed is not None:
        raise failed


def _lay_out(folder: Path, plan_path: Path) -> None:
    """Put into a clip's folder what lies beside its frames: the plan, and the log beside it."""
    (folder / FRAMES).mkdir(exist_ok=True)
    shutil.copyfile(plan_path, folder / PLAN_FILE)
    log = plan_path.with_name(LOG_NAME)
    if log.is_file():
        shutil.copyfile(log, folder / LOG_NAME)


def _ended(record: Recording, writer: threading.Thread, failed: BaseException | None) -> BaseException | None:
    """Wait until what was taken is written, or cut it short where somebody stops that; return what is to be raised."""
    if isinstance(failed, KeyboardInterrupt):
        record.cut()
    record.over()
    try:
        writer.join()
    except KeyboardInterrupt as stop:
        record.cut()
        writer.join()
        return stop
    return failed


def _write_beside(folder: Path, record: Recording) -> None:
    """Write the texts beside the frames: a disk that is full costs them, and not the recording."""
    for name, text in record.beside.items():
        try:
            (folder / name).write_text(text, encoding="utf-8")
        except OSError as fault:
            (folder / name).unlink(missing_ok=True)
            record.ended = f"{record.ended} {name} could not be written ({fault.strerror}).".strip()


def recorded_words(path: Path, record: Recording) -> str:
    """Say what a recording holds of a run that ended in a fault."""
    verb = "is" if record.written == 1 else "are"
    return f"{counted(record.written, 'frame').capitalize()} {verb} recorded all the same, and whole, in {path}."


def _refuse_left(path: Path, *, force: bool) -> None:
    """Raise UsageError where a recording of this name was killed, and its frames would be removed to begin again."""
    left = unfinished_folder_of(path)
    count = sum(1 for _ in (left / FRAMES).glob("*.tif"))
    if count and not force:
        raise UsageError(
            f"`record` {path}: a recording under this name was killed, and left {counted(count, 'frame')} in {left}. "
            "Rename that folder to keep them (the last file may be cut short), name another one, or discard them with "
            "`force`."
        )
