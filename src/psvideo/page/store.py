"""A cache of picture blocks: each is made once, by a few threads, and kept for a while."""

import threading
from collections import OrderedDict
from collections.abc import Hashable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial

from psvideo.errors import PsvideoError
from psvideo.page.picture import Look, missing_block, picture_block
from psvideo.page.show import ShownSequence

MOST_BYTES = 384_000_000
THREADS = 2


class BlockStore:
    """Gives blocks, each made once and kept until others need the room. May be asked by several threads at a time."""

    def __init__(self, *, most_bytes: int = MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self._kept: OrderedDict[Hashable, Future[bytes]] = OrderedDict()
        self._held = 0
        self._lock = threading.Lock()
        self._pool = ThreadPoolExecutor(max_workers=THREADS, thread_name_prefix="page")

    def get(self, sequence: ShownSequence, number: int, look: Look) -> bytes:
        """Return the block of one picture. What will be wanted next, the page knows best, and asks for it early."""
        return self._begun(sequence, number, look).result()

    def close(self) -> None:
        """Let go of everything; what was not begun is never made."""
        self._pool.shutdown(wait=True, cancel_futures=True)

    def _begun(self, sequence: ShownSequence, number: int, look: Look) -> Future[bytes]:
        key = (sequence.id, number, look)
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
            future = self._pool.submit(_made, sequence, number, look)
            self._kept[key] = future
        future.add_done_callback(partial(self._weigh, key))
        return future

    def _weigh(self, key: Hashable, future: Future[bytes]) -> None:
        """Count a block that is done, and let the oldest go until all fit."""
        with self._lock:
            if future.cancelled() or future.exception() is not None:
                self._kept.pop(key, None)
                return
            self._held += len(future.result())
            for old, kept in list(self._kept.items()):
                if self._held <= self._most_bytes:
                    return
                if old != key and kept.done():
                    del self._kept[old]
                    self._held -= len(kept.result())


def _made(sequence: ShownSequence, number: int, look: Look) -> bytes:
    """Read a picture; what cannot be read becomes a block that says so."""
    try:
        return picture_block(sequence.read(number, look))
    except PsvideoError as fault:
        return missing_block(str(fault))
