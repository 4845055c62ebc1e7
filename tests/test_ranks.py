"""Medians and quantiles, against numpy's own."""

import numpy as np
import pytest

from psvideo.compute.ranks import median, quantile, rising_parts


def _numbers(size: int, kind: type[np.floating]) -> np.ndarray:
    """Numbers of which many are alike, in no order."""
    rng = np.random.default_rng(size)
    return np.where(rng.random(size) < 0.3, 0.5, rng.standard_normal(size)).astype(kind)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("size", [1, 2, 3, 4, 511, 512, 5461])
def test_ranks_are_those_of_numpy(size: int, kind: type[np.floating]) -> None:
    values = _numbers(size, kind)
    given = values.copy()
    assert median(values) == pytest.approx(float(np.median(values.astype(np.float64))), abs=1e-15)
    for share in (0.0, 0.001, 0.05, 0.25, 0.5, 0.9, 0.995, 1.0):
        expected = float(np.quantile(values.astype(np.float64), share))
        assert quantile(values, share) == pytest.approx(expected, abs=1e-12)
    np.testing.assert_array_equal(values, given)  # which are as they were


def test_ranks_are_of_all_values_of_any_shape() -> None:
    values = _numbers(600, np.float32).reshape(10, 20, 3)
    some = values[::2, ::3]
    assert median(some) == pytest.approx(float(np.median(some.astype(np.float64))), abs=1e-15)
    assert quantile(some, 0.3) == pytest.approx(float(np.quantile(some.astype(np.float64), 0.3)), abs=1e-12)


def test_ranks_among_infinite_values_are_infinite() -> None:
    values = np.array([0.0, np.inf, np.inf, np.inf])
    assert median(values) == np.inf
    assert quantile(values, 0.0) == 0


def test_parts_hold_rising_values_and_each_place_once() -> None:
    values = _numbers(1001, np.float32)
    values[3], values[5] = -0.0, 0.0
    parts = rising_parts(values, 12)
    together = np.concatenate(parts)
    np.testing.assert_array_equal(np.sort(together), np.arange(1001))
    np.testing.assert_array_equal(values[together], np.sort(values))
    assert max(map(len, parts)) - min(map(len, parts)) <= 1
    same = together[values[together] == 0.5]
    assert len(same) > 100
    np.testing.assert_array_equal(same, np.sort(same))  # those alike in their order
