"""Elements that a loop changes or leaves as they are: what comes out, and that no processor stores them in parts."""

from typing import Any

import numba
import numpy as np
import pytest

from psvideo.compute.whole_stores import unmasked

SHORT = np.float32(0.5)
LENGTH = 480


def lowest(low: Any, values: Any) -> None:
    for i in range(len(low)):
        low[i] = min(unmasked(low[i]), values[i])


def without_little(low: Any, values: Any) -> None:
    for i in range(len(low)):
        old = unmasked(low[i])
        low[i] = old if values[i] > SHORT else SHORT


def plain_lowest(low: Any, values: Any) -> None:
    for i in range(len(low)):
        low[i] = min(low[i], values[i])


def plain_without_little(low: Any, values: Any) -> None:
    for i in range(len(low)):
        low[i] = low[i] if values[i] > SHORT else SHORT


@pytest.mark.parametrize(("loop", "plain"), [(lowest, plain_lowest), (without_little, plain_without_little)])
def test_an_element_comes_out_as_it_does_without_and_is_stored_whole(loop: Any, plain: Any) -> None:
    rng = np.random.default_rng(1)
    low, values = rng.random((2, LENGTH), np.float32)
    low[3], values[5] = np.nan, np.nan
    wanted = low.copy()
    numba.njit(plain)(wanted, values)
    compiled = numba.njit(loop)
    compiled(low, values)
    assert low.tobytes() == wanted.tobytes()
    (assembly,) = compiled.inspect_asm().values()
    stored = [line for line in assembly.splitlines() if "maskmov" in line and line.rstrip().endswith(")")]
    assert not stored
