"""Motion vectors: what is plain, or goes by less than a pixel, moves with what is around it; what stands does not."""

import weakref
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from motion_of_pixels import pixels_per_s

from psvideo.compute import spilled
from psvideo.compute.spilled import lie_in_files
from psvideo.export.sequences.planes import InstantPictures, planes_of
from psvideo.export.space import Space
from psvideo.model.surface import Surface
from psvideo.plates.align.velocity.correlation import displacements
from psvideo.plates.align.velocity.followed import Followed
from psvideo.runs.delivery.delivering import motion_of

ROWS, COLS = 120, 160
GOES = np.array([30.0, -12.0], np.float32)


def ring(wide: int, high: int, *, inner: int, row: int = ROWS // 2, col: int = COLS // 2) -> np.ndarray:
    """An oval's outline, from the share of a tenth ``inner`` of its radius outwards."""
    y, x = np.mgrid[:ROWS, :COLS]
    radius = np.hypot((x - col) / wide, (y - row) / high)
    return np.asarray((radius <= 1) & (radius > inner / 10))


def followed(moves: np.ndarray, rests: np.ndarray, step: int = 1) -> Followed:
    velocity = (GOES[:, None, None] * moves).astype(np.float32)
    return Followed(time_s=0.0, velocity=velocity, moves=moves, rests=rests & ~moves, step=step)


@pytest.mark.parametrize("step", [1, 2])
def test_the_plain_inside_of_what_moves_goes_with_its_outline_and_the_plain_wall_around_stands(step: int) -> None:
    outline = ring(50, 40, inner=8)
    ways = pixels_per_s(followed(outline, np.zeros_like(outline), step), (step * ROWS, step * COLS))
    inside = np.kron(ring(50, 40, inner=-1), np.ones((step, step))) > 0
    # velocities are per pixel of their own grid
    assert ways[inside].mean(axis=0) == pytest.approx(step * GOES, rel=0.02)
    assert np.abs(ways[inside] - step * GOES).max() < 0.5 * step * np.abs(GOES).max()
    away = np.kron(ring(53, 43, inner=-1), np.ones((step, step))) == 0
    assert not ways[away].any()


def test_what_clearly_rests_within_what_moves_stands() -> None:
    outline, middle = ring(50, 40, inner=8), ring(20, 15, inner=-1)
    ways = pixels_per_s(followed(outline, middle), (ROWS, COLS))
    assert not ways[middle].any()
    assert (np.abs(ways[ring(35, 28, inner=7)] - GOES) < 1).all()


def test_a_hole_that_shows_more_of_what_rests_than_of_what_moves_stands() -> None:
    outline, wall = ring(50, 40, inner=8), ring(38, 30, inner=9)
    ways = pixels_per_s(followed(outline, wall), (ROWS, COLS))
    assert not ways[ring(30, 24, inner=-1)].any()


def test_where_something_passes_from_edge_to_edge_nothing_beside_it_moves() -> None:
    moves = np.zeros((ROWS, COLS), np.bool_)
    moves[50:70] = True
    ways = pixels_per_s(followed(moves, np.zeros_like(moves)), (ROWS, COLS))
    assert not ways[:50].any()
    assert not ways[70:].any()
    np.testing.assert_array_equal(ways[50:70], np.broadcast_to(GOES, (20, COLS, 2)))


def test_where_nothing_moves_vectors_are_zero() -> None:
    none = np.zeros((ROWS, COLS), np.bool_)
    assert not pixels_per_s(followed(none, ~none), (ROWS, COLS)).any()
    assert not pixels_per_s(None, (ROWS, COLS, 3)).any()


@pytest.mark.parametrize("lies", [False, True])
def test_vectors_of_a_file_lie_in_planes_and_large_ones_out_of_memory(
    lies: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(spilled, "WORKED_ON_PIXELS", 1 if lies else 1 << 20)
    outline = np.zeros((ROWS, COLS), np.bool_)
    outline[10:20, 12:30] = True
    motion = followed(outline, np.zeros_like(outline), 2)
    shape, fps = (2 * ROWS, 2 * COLS, 3), Fraction(24000, 1001)
    ways = motion_of(motion, shape, fps, tmp_path)
    ahead = pixels_per_s(motion, shape) * np.array([1 / fps, -1 / fps], np.float32)
    assert np.array_equal(ways, np.concatenate([ahead, -ahead], axis=-1))
    assert ways.any()
    assert all(ways[..., place].flags.c_contiguous for place in range(4))
    assert lie_in_files(ways) == lies


def test_vectors_are_made_for_their_own_file_only() -> None:
    def never() -> np.ndarray:
        raise AssertionError("made")

    surface = Surface(
        normals=np.zeros((ROWS, COLS, 3), np.float16),
        albedo=np.zeros((ROWS, COLS), np.float16),
        valid=np.ones((ROWS, COLS), np.bool_),
    )
    made = InstantPictures(surface=surface, space=Space(), motion=never)
    assert len(planes_of("normals", made)) == 3
    with pytest.raises(AssertionError, match=r"^made$"):
        planes_of("motion", made)


def test_no_pictures_are_held_for_those_that_correlation_looks_at_next() -> None:
    rng = np.random.default_rng(0)
    held: list[int] = []
    alive: list[weakref.ref[np.ndarray]] = []

    def pairs() -> Iterator[tuple[np.ndarray, ...]]:
        for _ in range(4):
            held.append(sum(one() is not None for one in alive))
            pair = tuple(rng.random((ROWS, COLS), np.float32) for _ in range(2))
            alive.extend(weakref.ref(one) for one in pair)
            yield pair
            del pair

    assert len(displacements(pairs(), (ROWS, COLS), 2)) == 2
    assert held == [0] * 4
