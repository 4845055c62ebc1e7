"""The solver's smallest parts on paper: 3 x 3 inverses beside numpy's, and the sorting network for any number."""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.symmetric import adjugate
from psvideo.solve.normals.loops.blocks import BLOCK, COUNT, PLANES
from psvideo.solve.normals.robust import equations, few_lights
from psvideo.solve.normals.task import FEW


@FUSED.kept
def inverse_of(a: float, b: float, c: float, d: float, e: float, f: float) -> tuple[float, ...]:
    return adjugate(a, b, c, d, e, f)  # type: ignore[arg-type, return-value]  # in doubles


def test_the_adjugate_over_the_determinant_is_the_inverse() -> None:
    rng = np.random.default_rng(4)
    upper = np.triu_indices(3)
    for _ in range(50):
        half = rng.normal(size=(3, 3))
        matrix = half @ half.T + 0.1 * np.eye(3)
        *numbers, determinant = inverse_of(*matrix[upper])
        assert determinant == pytest.approx(np.linalg.det(matrix), rel=1e-9)
        assert np.array(numbers) / determinant == pytest.approx(np.linalg.inv(matrix)[upper], rel=1e-9, abs=1e-12)
    assert inverse_of(1.0, 2.0, 3.0, 4.0, 6.0, 9.0)[-1] == 0.0, "two rows alike"


@pytest.mark.parametrize("count", range(1, 11))
def test_the_network_sorts_any_numbers(count: int) -> None:
    """What sorts every row of zeros and ones sorts everything (Knuth, TAOCP 3, 5.3.4, theorem Z)."""
    for bits in itertools.product((0, 1), repeat=count):
        values = list(bits)
        for low, high in few_lights.exchanges(count):
            if values[low] > values[high]:
                values[low], values[high] = values[high], values[low]
        assert values == sorted(bits)


def test_few_lights_sort_and_choose_in_registers() -> None:
    in_order, ranked = few_lights._sorted, few_lights._ranked

    @FUSED.kept
    def chosen(values: tuple[np.float32, ...], rank: np.float32) -> np.float32:
        one: np.float32 = ranked(in_order(values), rank)
        return one

    values = np.random.default_rng(2).permutation(FEW).astype(np.float32)
    assert [chosen(tuple(values), np.float32(rank + 1)) for rank in range(len(values))] == sorted(values.tolist())


@FUSED.kept
def medians(e: NDArray[np.float32], w: NDArray[np.float32], v: NDArray[np.float32], n: int) -> None:
    few_lights.median_few(e, w, v, n)


def test_the_median_of_few_residuals_is_that_of_those_that_no_fit_makes_small() -> None:
    random = np.random.default_rng(4)
    e = np.full((FEW, BLOCK), equations.OUT, np.float32)
    w, v = np.zeros(PLANES * BLOCK, np.float32), np.zeros(9 * BLOCK, np.float32)
    counts = np.arange(BLOCK) % (FEW + 1)
    for pixel, count in enumerate(counts.tolist()):
        e[random.permutation(FEW)[:count], pixel] = random.random(count)
        w[COUNT + pixel] = count
    medians(e, w, v, BLOCK)
    wanted = [np.sort(e[:, pixel])[(max(count, 3) + 3) // 2 - 1] for pixel, count in enumerate(counts.tolist())]
    for plane in (equations.FROM, equations.TO):
        np.testing.assert_array_equal(v[plane : plane + BLOCK][counts > 2], np.array(wanted, np.float32)[counts > 2])
        assert (v[plane : plane + BLOCK] < equations.OUT).all()
