"""The compiler's own code: it is in memory while loops are compiled or loaded, and needed by none that runs."""

import contextlib
import ctypes
import functools
import mmap
from collections.abc import Iterator
from pathlib import Path

MAPPED = Path("/proc/self/maps")
"""What lies where in the process's memory, by Linux."""
LIBRARY = "libllvmlite"
CODE = "r-xp"
"""Nobody writes there: what is let go is the file's."""


@functools.cache
def let_compiler_go() -> None:
    """Hand the pages of LLVM's code back to the system, once; it has them in its cache when they run again.

    Starting the library and loading one loop brings 52 MB of it into memory, which stayed there to the end; loading all
    others of a run needs 4 MB. Where the system does not say what lies where, nothing happens.
    """
    for begin, size in _mapped(LIBRARY):
        ctypes.CDLL(None).madvise(ctypes.c_void_p(begin), ctypes.c_size_t(size), mmap.MADV_DONTNEED)


def _mapped(library: str) -> Iterator[tuple[int, int]]:
    """Yield where a library's code lies, and how many bytes it has."""
    with contextlib.suppress(OSError):
        for line in MAPPED.read_text().splitlines():
            place, kind, *_, file = line.split(maxsplit=5)
            if kind == CODE and Path(file).name.startswith(library):
                begin, end = (int(word, 16) for word in place.split("-"))
                yield begin, end - begin
