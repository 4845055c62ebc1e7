"""How hot loops are compiled: by numba, without the interpreter's lock, and kept on disk for the next run.

Loops are never shared between numba's own threads (docs/decisions/threads.md). What is kept is used again only while
the source of everything that was compiled into it is the same: numba itself looks at the called function's file alone.
What lies beside the modules, from installing the package, is found whatever folder is set for keeping
(docs/decisions/first-run.md).
"""

import contextlib
import functools
import hashlib
import logging
import numbers
import pickle
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import numba
from numba.core.caching import (
    CacheImpl,
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    InTreeCacheLocator,
    NullCache,
)
from numba.core.dispatcher import Dispatcher
from numba.core.extending import _Intrinsic
from numba.core.runtime.nrt import rtsys

from psvideo.compute.loaded import loaded
from psvideo.compute.parts import PART

Function = TypeVar("Function", bound=Callable[..., Any])
_Written: Any = _Intrinsic
_Cache: Any = FunctionCache
_Files: Any = IndexDataCacheFile
_NoCache: Any = NullCache
_Beside: Any = InTreeCacheLocator
_Places: Any = CompileResultCacheImpl
LOG = logging.getLogger("psvideo.compiling")
"""Says, as information, when a loop was kept nowhere and is being compiled; a record's ``lost`` says that it cannot be
kept either."""
_UNREADABLE = (OSError, EOFError, pickle.UnpicklingError, AttributeError, ImportError)
"""What a kept file raises that is cut off, or that names what an earlier version of the package had."""


class _ReadOnly(_Beside):  # type: ignore[misc]
    """Beside the module, where nobody can write: what installing the package kept there is found, nothing is added."""

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> "_ReadOnly | None":
        return cls(py_func, py_file) if Path(py_file).exists() else None

    def ensure_cache_path(self) -> None:
        raise PermissionError(f"{self.get_cache_path()} cannot be written")


class _AnyPlace(_Places):  # type: ignore[misc]
    """Numba's places, the first of which is taken where a file can be written, and then one that is only read: an
    account without a home, as farms and containers have, runs what somebody else installed."""

    @property
    def _locator_classes(self) -> list[Any]:
        return [*CacheImpl._locator_classes, _ReadOnly]


class _Kept(_Cache):  # type: ignore[misc]
    """Compiled code on disk, which is stale once a module changes whose code or numbers are in it.

    A disk that is full, or a folder that is gone, never stops what was compiled: it is compiled again next time.
    """

    _impl_class = _AnyPlace

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        super().__init__(function)
        module = sys.modules[function.__module__]
        stamp = (
            self._impl.locator.get_source_stamp(),
            sources_digest(module),
            repr(sorted(options.get("fastmath", ()))),
        )
        installed = Path(module.__file__ or "").parent / "__pycache__"
        self._cache_file, self._installed = (
            _Files(cache_path=str(folder), filename_base=self._impl.filename_base, source_stamp=stamp)
            for folder in (self._cache_path, installed)
        )

    def load_overload(self, signature: Any, target: Any) -> Any:
        for place in (self._cache_file, self._installed):
            with contextlib.suppress(*_UNREADABLE):
                rtsys.initialize(target)  # all that kept code needs of numba; to compile, numba loads the rest itself
                data = place.load(self._index_key(signature, target.codegen()))
                if data is not None:
                    return loaded(target, data)
        LOG.info("compiling %s", self._name, extra={"lost": self._read_only})
        return None

    def save_overload(self, signature: Any, data: Any) -> None:
        if self._read_only:
            return
        try:
            super().save_overload(signature, data)
        except _UNREADABLE:
            with contextlib.suppress(OSError):  # what an earlier version kept there would stand in the way for ever
                Path(self._cache_file._index_path).unlink()

    @property
    def _read_only(self) -> bool:
        return isinstance(self._impl.locator, _ReadOnly)


class _NotKept(_NoCache):  # type: ignore[misc]
    """Code that has no file, beside which anything could be kept: every run compiles, and says so."""

    def load_overload(self, signature: Any, target: Any) -> Any:
        LOG.info("compiling %s", signature, extra={"lost": True})
        return super().load_overload(signature, target)


@dataclass(frozen=True)
class Arithmetic:
    """What the compiler may do with floating-point numbers, and functions compiled so.

    ``fastmath`` are LLVM's flags; empty: every operation as it is written. NaN and infinity keep their meaning.
    """

    fastmath: frozenset[str] = frozenset()

    def kept(self, function: Function) -> Function:
        """Compile a function that Python calls, and keep it on disk where there is a folder to keep it in."""
        compiled: Any = numba.njit(nogil=True, **self._options)(function)
        try:
            compiled._cache = _Kept(function, self._options)
        except RuntimeError:  # numba's "no locator": the function was made of a text
            compiled._cache = _NotKept()
        result: Function = compiled
        return result

    def called(self, function: Function) -> Function:
        """Compile a function that only compiled ones call, once for all of them."""
        part: Function = numba.njit(**PART, **self._options)(function)
        return part

    def inlined(self, function: Function) -> Function:
        """Compile a function into the compiled functions that call it."""
        part: Function = numba.njit(**PART, forceinline=True, **self._options)(function)
        return part

    @property
    def _options(self) -> dict[str, Any]:
        return {"fastmath": set(self.fastmath), "error_model": "numpy"} if self.fastmath else {}


EXACT = Arithmetic()
"""Every operation rounds as it does in Python; division by zero raises."""
FUSED = Arithmetic(frozenset({"contract", "nsz", "arcp"}))
"""Products may be fused and divisions shared; sums keep their order."""
REORDERED = Arithmetic(FUSED.fastmath | {"reassoc"})
"""Sums may change their order too, always to the same one."""


def folder_kept_in() -> Path | None:
    """Return a folder in which code that is compiled now is kept, that of this module; None where none can be written
    and every run compiles again what installing did not keep."""
    place = _AnyPlace(sources_digest).locator
    return None if isinstance(place, _ReadOnly) else Path(place.get_cache_path())


def sources_digest(module: ModuleType) -> str:
    """Return a digest of a module's source and of the modules of its package that compiled code in it is made of.

    Those are the modules that it names, and that define what it names; where these have compiled functions, or code of
    LLVM's written by hand, so go on. Numbers that such a module imports count by their value.
    """
    parts: dict[str, bytes] = {}
    waiting = [module]
    while waiting:
        one = waiting.pop()
        path = getattr(one, "__file__", None)
        if path is None or path in parts:
            continue
        parts[path] = _source(path)
        if one is module or any(isinstance(value, (Dispatcher, _Written)) for value in vars(one).values()):
            parts[path] += repr(_numbers(one)).encode()
            waiting += _named(one)
    return hashlib.sha256(b"".join(parts[path] for path in sorted(parts))).hexdigest()


def _numbers(module: ModuleType) -> list[tuple[str, Any]]:
    return sorted((name, value) for name, value in vars(module).items() if isinstance(value, (numbers.Number, tuple)))


def _named(module: ModuleType) -> list[ModuleType]:
    """Return the modules of the same package that a module names, or from which it has functions and classes."""
    package = module.__name__.partition(".")[0]
    names = {
        value.__name__ if isinstance(value, ModuleType) else getattr(getattr(value, "_defn", value), "__module__", None)
        for value in vars(module).values()  # numba's intrinsics keep what defines them as _defn
    }
    ours = (name for name in names if isinstance(name, str) and name.partition(".")[0] == package)
    return [sys.modules[name] for name in ours if name in sys.modules]


@functools.cache
def _source(path: str) -> bytes:
    with contextlib.suppress(OSError):  # in an archive, of which numba looks at the whole
        return Path(path).read_bytes()
    return b""
