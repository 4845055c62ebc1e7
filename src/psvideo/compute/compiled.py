"""How hot loops are compiled: by numba, without the interpreter's lock, and kept on disk for the next run."""

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function, **options: Any) -> Function:
    """Compile a function when it is first called; where no folder can be written, without keeping it for next time.

    ``options`` are numba's. Loops are never shared between numba's own threads (see docs/decisions/threads.md).
    """
    try:
        kept: Function = numba.njit(cache=True, nogil=True, **options)(function)
    except RuntimeError:  # numba found neither a folder beside the module nor one of the user's to write to
        kept = numba.njit(nogil=True, **options)(function)
    return kept
