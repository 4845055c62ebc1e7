"""Compiled code is kept for the next run where that is possible, and runs where it is not."""

import importlib
from typing import Any

import numba.core.caching
import numpy as np
import pytest

from psvideo.compute import inlined as compiled
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.woodham1980 import solve


def twice(value: float) -> float:
    return 2 * value


def test_without_a_folder_to_keep_it_in_code_is_compiled_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.core.caching.CacheImpl, "_locator_classes", [])
    with pytest.raises(RuntimeError, match="no locator"):
        numba.njit(cache=True)(twice)
    assert compiled.compiled(twice)(21.0) == 42.0


def full(*_: Any) -> None:
    raise OSError(28, "No space left on device")


def test_a_full_disk_under_the_cache_leaves_compiled_code_usable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.core.caching.IndexDataCacheFile, "save", full)
    fresh = compiled.compiled(lambda value: 3 * value)
    with pytest.raises(OSError, match="No space"):
        fresh(14)
    assert fresh(14) == 42


def test_a_full_disk_under_the_cache_does_not_stop_a_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = importlib.import_module("psvideo.solve.normals.kernel")
    solve_rows, calls = kernel.solve_rows, []

    def full_at_first(*arguments: Any) -> None:
        calls.append(arguments)
        if len(calls) == 1:
            full()
        solve_rows(*arguments)

    monkeypatch.setattr(kernel, "solve_rows", full_at_first)
    directions = np.array([[0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], [0.0, 0.6, 0.8]])
    lit = Illumination(directions=directions, intensities=np.ones((3, 1)))
    surface = solve([np.full((2, 2), 0.5, np.float32)] * 3, lit)
    assert surface.valid.all()
    assert len(calls) == 2
