"""How kept loops are loaded: their machine code only. What LLVM made it from waits for somebody who needs it.

Numba keeps a loop's LLVM code beside its machine code, for other functions that it becomes part of, and makes LLVM's
own objects of it whenever the loop is loaded. Nothing asks for them where all loops are kept: a run's 25 loops held
36 MB and took 0.2 s of processor time for them (docs/decisions/first-run.md). The classes follow ``JITCodeLibrary`` in
numba's ``core/codegen.py``, which is no public name: other versions than those that were tried load in the usual way.
"""

from collections.abc import Iterable
from typing import Any

import llvmlite.binding
import numba
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompileResult

from psvideo.compute.compilers_code import let_compiler_go
from psvideo.compute.parts import TRIED

_Library: Any = JITCodeLibrary
_Result: Any = CompileResult
_binding: Any = llvmlite.binding


class _Loaded(_Library):  # type: ignore[misc]
    """A kept loop's machine code, and its LLVM code as it lay in the file."""

    _shared_module: Any

    def __init__(self, codegen: Any, kept: Any, names: Iterable[str]) -> None:
        name, _, (machine_code, self._kept_code) = kept
        super().__init__(codegen, name)
        self._there = {one for one in names if one.encode() in machine_code}
        self.enable_object_caching()
        self._set_compiled_object(machine_code)
        self._finalize_final_module()

    def get_pointer_to_function(self, name: str) -> int:
        """Return where a function of the machine code lies, 0 where it has none of that name."""
        if name not in self._there:
            return 0
        address: int = self._codegen._engine.get_function_address(name)
        return address

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            self._shared_module = _binding.parse_bitcode(self._kept_code)
            self._kept_code = b""
        return self._shared_module


class _Through:
    """Numba's target, and its code generator, which makes ``_Loaded`` of what was kept of the functions ``names``."""

    def __init__(self, there: Any, names: Iterable[str]) -> None:
        self._there, self._names = there, names

    def __getattr__(self, name: str) -> Any:
        return getattr(self._there, name)

    def codegen(self) -> "_Through":
        """Return the target's code generator."""
        return _Through(self._there.codegen(), self._names)

    def unserialize_library(self, kept: Any) -> _Loaded:
        """Return the code that was kept."""
        return _Loaded(self._there, kept, self._names)


def loaded(target: Any, kept: Any) -> Any:
    """Return numba's record of a compiled function, of what was kept of it, for numba's ``target``."""
    (_, kind, _), function, *_ = kept
    if numba.version_info.short not in TRIED or kind != "object":
        return _Result._rebuild(target, *kept)
    names = (function.llvm_func_name, function.llvm_cpython_wrapper_name, function.llvm_cfunc_wrapper_name)
    result = _Result._rebuild(_Through(target, names), *kept)._replace(target_context=target)
    let_compiler_go()
    return result
