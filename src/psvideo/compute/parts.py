"""How numba compiles what only compiled functions call: to LLVM's code and no further.

Numba optimises every function by itself and makes machine code of it, which nobody ever runs where it is part of
another, and optimises it again there. Here a part is optimised once, as what it is part of is: that takes a third off
the wait, and runs as fast (docs/decisions/first-run.md). The two classes follow ``JITCodeLibrary`` in numba's
``core/codegen.py``, which is no public name: other versions than those that were tried compile parts in the usual way.
"""

from typing import Any

import numba
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

TRIED = ((0, 68),)
"""Versions of numba of which all that is compiled here was compared with what it is in pure Python."""
_Library: Any = JITCodeLibrary
_Compiler: Any = Compiler


class _Part(_Library):  # type: ignore[misc]
    """A function's code that is there to be linked into others, and nowhere else."""

    def _optimize_final_module(self) -> None: ...

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0: there is no machine code."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> "_Nowhere":
        return _Nowhere(super().codegen)


class _Nowhere:
    """Numba's code generator, for a function that is nowhere in memory."""

    def __init__(self, there: Any) -> None:
        self._there = there

    def __getattr__(self, name: str) -> Any:
        return getattr(self._there, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing: only what Python calls has an environment."""


class _PartCompiler(_Compiler):  # type: ignore[misc]
    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        super().__init__(typing, target, library or _Part(target.codegen(), "part"), *rest)


_COMPILER: dict[str, Any] = {"pipeline_class": _PartCompiler} if numba.version_info.short in TRIED else {}
PART: dict[str, Any] = {"nogil": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, **_COMPILER}
"""Numba's options for a part."""
INLINED: Any = {"forceinline": True, **_COMPILER}
"""Numba's options for an ``overload`` that becomes part of what calls it."""
