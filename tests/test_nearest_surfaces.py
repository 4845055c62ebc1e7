"""A point stands on the surface that is reached across the least edges: held against Dijkstra's shortest ways."""

import heapq

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from psvideo.solve.nearest_surfaces import FAR, STEP, nearest_surfaces

ROWS, COLS = 9, 13
NEAR_M, FAR_M, APART, LEAST = 1.0, 1.5, 0.04, 1e-3
Places = NDArray[np.int32]
Ways = NDArray[np.float32]


def found(light: Ways, depth_m: Ways, known: NDArray[np.bool_]) -> tuple[Places, Ways]:
    """What the loop makes of points of which some are known."""
    places = np.arange(known.size, dtype=np.int32).reshape(known.shape)
    seeds = np.stack([np.where(known, places, -1), np.full(known.shape, -1)]).astype(np.int32)
    ways = np.where(seeds >= 0, np.float32(0), FAR)
    nearest_surfaces(light, depth_m, LEAST, APART, seeds, ways)
    return seeds, ways


def dijkstra(light: Ways, seeds: NDArray[np.bool_], known: NDArray[np.bool_]) -> Ways:
    """The shortest way to every point from any of the seeds, that leads through no other point that is known."""
    ways = np.full(seeds.shape, np.inf)
    ways[seeds] = 0
    open_ends = [(0.0, int(row), int(col)) for row, col in np.argwhere(seeds)]
    while open_ends:
        way, row, col = heapq.heappop(open_ends)
        if way > ways[row, col]:
            continue
        for over, side in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            r, c = row + over, col + side
            if 0 <= r < seeds.shape[0] and 0 <= c < seeds.shape[1] and not known[r, c]:
                here, there = light[row, col].astype(float), light[r, c].astype(float)
                edge = np.sqrt(((here - there) ** 2).sum() / ((np.maximum(here, there) ** 2).sum() + LEAST**2))
                beyond = way + STEP * np.hypot(over, side) + edge
                if beyond < ways[r, c]:
                    ways[r, c] = beyond
                    heapq.heappush(open_ends, (beyond, r, c))
    return ways


@given(seed=st.integers(0, 10_000), wild=st.sampled_from([0.0, 0.05, 0.3]))
def test_ways_are_the_shortest_to_either_surface(seed: int, wild: float) -> None:
    """With light that is wild, ways around many corners may be missed: none is ever too short."""
    rng = np.random.default_rng(seed)
    light = (0.5 + wild * rng.uniform(-1, 1, (ROWS, COLS, 3))).astype(np.float32)
    near = rng.random((ROWS, COLS)) < 0.05
    far = (rng.random((ROWS, COLS)) < 0.05) & ~near
    near[0, 0], far[0, 0], far[-1, -1], near[-1, -1] = True, False, True, False
    known = near | far
    depth_m = np.where(near, NEAR_M, FAR_M).astype(np.float32)
    seeds, ways = found(light, depth_m, known)
    to_near, to_far = dijkstra(light, near, known), dijkstra(light, far, known)
    nearest, other = np.minimum(to_near, to_far)[~known], np.maximum(to_near, to_far)[~known]
    assert np.all(ways[0][~known] > nearest - 1e-4)
    assert np.all(ways[1][~known] > other - 1e-4)
    assert np.mean(np.isclose(ways[0][~known], nearest, atol=1e-4)) > 0.95
    assert np.mean(np.isclose(ways[1][~known], other, atol=1e-4)) > 0.9
    assert known.ravel()[seeds[0][~known]].all()
    assert np.all(depth_m.ravel()[seeds[0][~known]] != depth_m.ravel()[seeds[1][~known]])


@pytest.mark.parametrize("edge", [3, 6, 9])
def test_an_edge_in_the_light_parts_two_surfaces_wherever_it_is(edge: int) -> None:
    light = np.full((ROWS, COLS, 3), 0.2, np.float32)
    light[:, edge:] = (0.5, 0.1, 0.4)
    known = np.zeros((ROWS, COLS), np.bool_)
    known[:, 0] = known[:, -1] = True
    depth_m = np.full((ROWS, COLS), NEAR_M, np.float32)
    depth_m[:, -1] = FAR_M
    seeds, ways = found(light, depth_m, known)
    stands = depth_m.ravel()[seeds[0]]
    assert np.all(stands[:, :edge] == np.float32(NEAR_M))
    assert np.all(stands[:, edge:] == np.float32(FAR_M))
    assert np.all((ways[1] - ways[0])[~known] > 0.3)


def test_where_only_one_surface_is_known_there_is_no_other() -> None:
    known = np.zeros((ROWS, COLS), np.bool_)
    known[4, 4] = True
    seeds, ways = found(np.full((ROWS, COLS, 3), 0.5, np.float32), np.ones((ROWS, COLS), np.float32), known)
    assert np.all(seeds[0] == 4 * COLS + 4)
    assert np.all(seeds[1] == -1)
    assert np.all(ways[1] == FAR)


def test_light_that_is_unknown_is_no_edge() -> None:
    light = np.full((ROWS, COLS, 3), 0.5, np.float32)
    light[:, 5, 1] = -1
    known = np.zeros((ROWS, COLS), np.bool_)
    known[:, 0] = True
    _, ways = found(light, np.ones((ROWS, COLS), np.float32), known)
    np.testing.assert_allclose(ways[0], np.broadcast_to(STEP * np.arange(COLS), (ROWS, COLS)), atol=1e-6)


@given(seed=st.integers(0, 10_000))
def test_the_second_surface_is_always_another_than_the_first(seed: int) -> None:
    """Distances that drift from seed to seed: what was another surface may be that of a nearer seed."""
    rng = np.random.default_rng(seed)
    light = rng.uniform(0.3, 0.7, (ROWS, COLS, 3)).astype(np.float32)
    known = rng.random((ROWS, COLS)) < 0.15
    known[0, 0] = True
    depth_m = np.exp(rng.uniform(0, 0.12, (ROWS, COLS))).astype(np.float32)
    seeds, _ = found(light, depth_m, known)
    two = seeds[1] >= 0
    logs = np.log(depth_m).ravel()
    assert np.all(np.abs(logs[seeds[0][two]] - logs[seeds[1][two]]) >= APART - 1e-6)
