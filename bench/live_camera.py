"""A camera that is not there: frames from a file, over and over, each when its exposure is over.

``python -m bench.live_camera FRAMES ...`` speaks as the process of a GenICam camera does (``clip.genicam_camera``), or
sends bare bytes. As a camera it waits for nobody: it has room for some frames, and what finds none is dropped.
"""

import argparse
import json
import os
import sys
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from psvideo.clip.streams.genicam_camera import HEAD

BUFFERS = 64
"""Frames that wait to be fetched, as ``genicam_camera`` has its cameras hold."""
KEPT = 30
"""Every so many frames it is written down how it goes."""
WARM_S = 0.5
"""Between the beginning and the first frame."""


@dataclass(kw_only=True)
class Buffers:
    """Numbers of frames that are exposed and not yet fetched; ``dropped`` counts those that found no room."""

    dropped: int = 0
    over: bool = False
    _numbers: deque[int] = field(default_factory=deque)
    _changed: threading.Condition = field(default_factory=threading.Condition)

    def put(self, number: int) -> None:
        """Keep a frame, or drop it."""
        with self._changed:
            if len(self._numbers) < BUFFERS:
                self._numbers.append(number)
                self._changed.notify()
            else:
                self.dropped += 1

    def end(self) -> None:
        """Say that no more frames come."""
        with self._changed:
            self.over = True
            self._changed.notify()

    def next(self) -> int | None:
        """Return the next frame's number, once there is one; None after the last."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._numbers) or self.over)
            return self._numbers.popleft() if self._numbers else None


def main() -> None:
    """Send frames for so many seconds, and write on the way what came of it as JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("frames", type=Path)
    parser.add_argument("--shape", type=int, nargs=2, required=True, metavar=("ROWS", "COLS"))
    parser.add_argument("--fps", type=float, required=True)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--late", type=float, required=True, help="seconds from a frame's begin to its last row's end")
    parser.add_argument("--form", default="BayerRG8", help="the pixel format, by GenICam's name")
    parser.add_argument("--bare", action="store_true", help="bare bytes, without numbers")
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    shape = tuple(asked.shape)
    loop = np.fromfile(asked.frames, np.uint8).reshape(-1, *shape)
    out, count = sys.stdout.fileno(), round(asked.seconds * asked.fps)
    buffers, began_s = Buffers(), time.monotonic() + WARM_S
    if not asked.bare:
        mode = {"format": asked.form, "shape": shape, "type": loop.dtype.str}
        _send(out, json.dumps(mode).encode() + b"\n")

    def expose() -> None:
        for number in range(count):
            due_s = began_s + number / asked.fps + asked.late
            time.sleep(max(due_s - time.monotonic(), 0.0))
            buffers.put(number)
        buffers.end()

    threading.Thread(target=expose, daemon=True).start()
    sent = 0
    while (number := buffers.next()) is not None:
        if sent % KEPT == 0:  # whoever watches may kill this process
            said = {"began_s": began_s, "sent": sent, "dropped": buffers.dropped}
            half = asked.out.with_suffix(".half")
            half.write_text(json.dumps(said), encoding="ascii")
            half.rename(asked.out)
        codes = loop[number % len(loop)]
        if not asked.bare:
            _send(out, HEAD.pack(number, 0, codes.nbytes))
        _send(out, memoryview(codes).cast("B"))
        sent += 1


def _send(out: int, data: "bytes | memoryview") -> None:
    left = memoryview(data)
    while left:
        left = left[os.write(out, left) :]


if __name__ == "__main__":
    main()
