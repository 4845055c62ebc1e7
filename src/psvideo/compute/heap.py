"""Settings of the allocator and of libraries, made before they load: one heap, small pages, no threads of their own."""

import contextlib
import ctypes
import gc
import os
from collections.abc import Iterator

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
"""glibc's numbers of the settings (malloc.h)."""
MOST_IN_HEAP_BYTES, MOST_SPARE_BYTES = 32 << 20, 1 << 30
"""Pictures up to this many bytes, the most that glibc allows, lie in the heap, and this much of it may be free: a run's
pictures come and go in the same memory, which the system would clear each time that it is given back."""
OBJECTS_BETWEEN_LOOKS = 10_000
"""Python looks for reference cycles once this many objects are new; by default, 700."""
ELSEWHERE = (OSError, AttributeError, TypeError)
"""Another C library, or none to be called by name."""


def set_as_commands_do() -> None:
    """Make all of these settings, for a process that is psvideo's alone; before numpy is imported."""
    share_one_heap()
    keep_pages_small()
    keep_algebra_single()
    collect_cycles_seldom()


def share_one_heap() -> None:
    """Let all threads allocate from one heap, where the C library is glibc.

    By default each thread has a heap of its own, which keeps what was freed in it: pictures that one thread makes and
    another drops would cost memory several times.
    """
    with contextlib.suppress(*ELSEWHERE):
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(M_ARENA_MAX, 1)
        mallopt(M_MMAP_THRESHOLD, MOST_IN_HEAP_BYTES)
        mallopt(M_TRIM_THRESHOLD, MOST_SPARE_BYTES)


def keep_pages_small() -> None:
    """Let numpy, which reads this when it is first imported, not ask for huge pages, unless the user did.

    In a heap that is used again and again, every huge page that a picture once touched stays as a whole: eight lights
    at 1080p held 595 MB where they hold 428, and frames cost up to a tenth more processor time.
    """
    os.environ.setdefault("NUMPY_MADVISE_HUGEPAGE", "0")


def keep_algebra_single() -> None:
    """Let numpy's and scipy's linear algebra compute in the thread that asks for it, unless the user said otherwise.

    Its matrices are small here and runs share their work out themselves; its own threads spin while they wait for more:
    a run of 60 frames with eight lights took 6.5 + 0.8 seconds of processor time instead of 7.4 to 8.1 + 1.0.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def collect_cycles_seldom() -> None:
    """Let Python look for reference cycles less often; none that runs leave behind holds a picture.

    Loading and compiling make hundreds of thousands of objects that stay: compiling a run's loops took 36 s instead of
    40 of processor time, and looks that find nothing 0.1 s instead of 0.18 of every later run.
    """
    gc.set_threshold(OBJECTS_BETWEEN_LOOKS)


@contextlib.contextmanager
def no_looks_at_what_is_loaded() -> Iterator[None]:
    """Let Python, while the block runs, look for reference cycles only among objects that are made in it.

    A look at all that is loaded takes 0.1 s, in which no other thread goes on: half of what a live picture may take.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def give_back() -> None:
    """Give what is free back to the system: what comes next is of another kind and would lie beside it."""
    with contextlib.suppress(*ELSEWHERE):
        ctypes.CDLL(None).malloc_trim(0)
