"""Normals go on across narrow doubt and edges of paint in what moves, where both sides agree; and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from psvideo.model.arrays import Mask
from psvideo.model.surface import Surface
from psvideo.solve.normals.trust.continued import continued, continued_at_rest
from psvideo.solve.normals.trust.continued_part import BAND_ROWS

SHAPE = 24, 40
STRIP = slice(19, 21)
EVERYWHERE = np.ones(SHAPE, np.bool_)
LIMIT_DEG = 5.0


def facing(deg_right: float | np.ndarray) -> np.ndarray:
    """Return normals (row, col, 3) turned to the right by angles (col,), channels in planes of their own."""
    angle = np.radians(np.broadcast_to(deg_right, (SHAPE[1],)))
    planes = np.stack([np.broadcast_to(part, SHAPE) for part in (np.sin(angle), np.zeros_like(angle), np.cos(angle))])
    return np.moveaxis(np.ascontiguousarray(planes, np.float32), 0, -1)


def with_strip(normals: np.ndarray, strip_deg: float, *, albedo: float = 0.5, claims_deg: float = 8.0) -> Surface:
    """Return a surface that is trusted at 0.5 degrees but for a strip of two columns, turned to the right."""
    given, valid = np.moveaxis(np.moveaxis(normals, -1, 0).copy(), 0, -1), np.ones(SHAPE, np.bool_)
    given[:, STRIP] = facing(strip_deg)[:, STRIP]
    valid[:, STRIP] = False
    error, level = np.full(SHAPE, 0.5, np.float32), np.full(SHAPE, 0.5, np.float32)
    error[:, STRIP], level[:, STRIP] = claims_deg, albedo
    return Surface(normals=given, albedo=level, valid=valid, residual=None, error_deg=error)


def off_deg(surface: Surface, true: np.ndarray) -> np.ndarray:
    """Return how far every normal is from the true one, in degrees."""
    along = (surface.normals.astype(np.float64) * true).sum(axis=-1)
    return np.asarray(np.degrees(np.arccos(np.clip(along, -1, 1))), np.float64)


def strip_of(surface: Surface, moves: Mask = EVERYWHERE) -> tuple[Mask, np.ndarray, np.ndarray]:
    """Return of the strip's middle what is valid, the angle to the right and the error that is claimed."""
    told = continued(surface, moves, limit_deg=LIMIT_DEG)
    assert told.error_deg is not None
    some = slice(4, -4), STRIP
    angle = np.degrees(np.arctan2(told.normals[..., 0].astype(np.float64), told.normals[..., 2]))
    return told.valid[some], angle[some], told.error_deg[some]


def test_a_face_goes_on_across_a_strip_that_is_off_by_six_degrees() -> None:
    valid, angle, claims_deg = strip_of(with_strip(facing(20.0), 26.0))
    assert valid.all()
    assert np.abs(angle - 20).max() < 1
    assert (np.abs(angle - 20) < claims_deg).all()
    assert claims_deg.max() < 3


def test_a_curved_surface_goes_on_along_its_own_course() -> None:
    true = facing(np.linspace(-40, 40, SHAPE[1]))
    told = continued(with_strip(true, 8.0), EVERYWHERE, limit_deg=LIMIT_DEG)
    assert told.valid[4:-4].all()
    assert off_deg(told, true)[4:-4, STRIP].max() < 2  # of 9 and 7 as they were


def test_the_farther_the_strip_was_off_the_more_is_claimed() -> None:
    near, far = (strip_of(with_strip(facing(0.0), deg))[2] for deg in (3.0, 8.0))
    assert (far > near + 1).all()


@pytest.mark.parametrize("claims_deg", [8.0, 23.0])
def test_a_wire_before_a_wall_is_none_of_it(claims_deg: float) -> None:
    valid, angle, _ = strip_of(with_strip(facing(0.0), 30.0, claims_deg=claims_deg))
    assert not valid.any()
    assert np.allclose(angle, 30, atol=1e-3)


def test_a_strip_that_is_brighter_than_both_sides_is_another_thing() -> None:
    assert not strip_of(with_strip(facing(0.0), 4.0, albedo=0.6))[0].any()
    assert strip_of(with_strip(facing(0.0), 4.0, albedo=0.505))[0].all()


def test_a_crease_is_not_rounded() -> None:
    """Between two faces nobody is sure which goes on: what is called valid there is one of them."""
    faces = facing(np.where(np.arange(SHAPE[1]) < 20, -30.0, 30.0))
    valid, angle, _ = strip_of(with_strip(faces, 0.0))
    assert not valid.any()
    assert np.allclose(angle, 0, atol=1e-3)


def test_beside_an_outline_nothing_is_known_of_what_lies_beyond() -> None:
    surface = with_strip(facing(0.0), 4.0)
    surface.valid[:, 19:] = False
    assert surface.error_deg is not None
    surface.error_deg[:, 19:] = 8.0
    told = continued(surface, EVERYWHERE, limit_deg=LIMIT_DEG)
    assert not told.valid[:, 21:].any()


def test_what_stands_still_stays_and_says_nothing_of_what_moves() -> None:
    surface = with_strip(facing(0.0), 4.0)
    still = np.zeros(SHAPE, np.bool_)
    assert continued(surface, still, limit_deg=LIMIT_DEG) is surface
    assert not strip_of(surface, still | (np.arange(SHAPE[1]) // 2 == 19 // 2))[0].any()


def with_edge(normals: np.ndarray, strip_deg: float, *, beside: float = 0.3, claims_deg: float = 3.0) -> Surface:
    """Return a surface that is trusted throughout, of another paint right of its middle, where a strip is turned."""
    surface = with_strip(normals, strip_deg, claims_deg=claims_deg)
    albedo = np.where(np.arange(SHAPE[1]) < 20, np.float32(0.7), np.float32(beside)) * np.ones(SHAPE, np.float32)
    return replace(surface, albedo=albedo, valid=EVERYWHERE.copy())


@pytest.mark.parametrize("strip_deg", [-15.0, 6.0, 18.0])
def test_an_edge_of_paint_turns_no_normal_though_each_was_trusted(strip_deg: float) -> None:
    """Plates that lie a part of a pixel beside each other show another share of either paint each."""
    valid, angle, claims_deg = strip_of(with_edge(facing(0.0), strip_deg))
    assert valid.all()
    assert np.abs(angle).max() < 2
    assert (np.abs(angle) < 2 * claims_deg).all()


@pytest.mark.parametrize(("strip_deg", "beside"), [(15.0, 0.7), (15.0, 0.62), (60.0, 0.3), (2.0, 0.3)])
def test_what_paint_does_not_explain_or_hardly_shows_stays_to_the_bit(strip_deg: float, beside: float) -> None:
    surface = with_edge(facing(0.0), strip_deg, beside=beside)
    before = surface.normals.copy()
    told = continued(surface, EVERYWHERE, limit_deg=LIMIT_DEG)
    assert (told.normals == before).all()
    assert told.valid.all()


def test_a_crease_between_two_paints_is_not_rounded() -> None:
    faces = facing(np.where(np.arange(SHAPE[1]) < 20, -30.0, 30.0))
    surface = with_edge(faces, 0.0)
    surface.normals[:, STRIP] = faces[:, STRIP]
    told = continued(surface, EVERYWHERE, limit_deg=LIMIT_DEG)
    assert off_deg(told, faces).max() < 1


def test_what_was_trusted_stays_to_the_bit() -> None:
    surface = with_strip(facing(10.0), 14.0)
    before, valid = surface.normals.copy(), surface.valid.copy()
    told = continued(surface, EVERYWHERE, limit_deg=LIMIT_DEG)
    assert (told.normals[valid] == before[valid]).all()
    assert told.valid[valid].all()
    assert (surface.valid == valid).all()


def test_a_strip_of_a_large_picture_may_be_twice_as_wide() -> None:
    """Motion is found on a grid a quarter as fine there, and is off by as many of its pixels."""
    surface = with_strip(facing(0.0), 4.0)
    surface.valid[:, 17:22] = False
    assert surface.error_deg is not None
    surface.error_deg[:, 17:22] = 8.0
    coarse = np.ones((SHAPE[0] // 4, SHAPE[1] // 4), np.bool_)
    fine = continued(with_strip(facing(0.0), 4.0), EVERYWHERE, limit_deg=LIMIT_DEG)
    assert fine.valid[8:-8].all()
    assert continued(surface, coarse, limit_deg=LIMIT_DEG).valid[8:-8, 18:21].all()


def test_half_floats_and_threads_change_nothing_that_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = with_strip(facing(20.0), 26.0)
    assert plain.error_deg is not None
    told = continued(with_strip(facing(20.0), 26.0), EVERYWHERE, limit_deg=LIMIT_DEG)
    for threads in ("1", "2", "8"):
        monkeypatch.setenv("PSVIDEO_THREADS", threads)
        again = continued(with_strip(facing(20.0), 26.0), EVERYWHERE, limit_deg=LIMIT_DEG)
        assert (again.normals == told.normals).all()
    halves = np.moveaxis(np.moveaxis(plain.normals, -1, 0).astype(np.float16), 0, -1)
    half = replace(plain, normals=halves, error_deg=plain.error_deg.astype(np.float16))
    again = continued(half, EVERYWHERE, limit_deg=LIMIT_DEG)
    assert (again.valid == told.valid).all()
    assert again.normals.dtype == np.float16
    assert np.abs(again.normals.astype(np.float32) - told.normals).max() < 1e-3


def test_a_surface_without_errors_passes_as_it_is() -> None:
    surface = replace(with_strip(facing(0.0), 4.0), error_deg=None)
    assert continued(surface, EVERYWHERE, limit_deg=LIMIT_DEG) is surface


def test_across_the_edge_of_a_shadow_on_what_stands_a_face_goes_on() -> None:
    true = facing(np.linspace(-20, 20, SHAPE[1]))
    told = continued_at_rest(with_strip(true, 6.0), None, limit_deg=LIMIT_DEG)
    assert told.valid[4:-4].all()
    assert off_deg(told, true)[4:-4].max() < 1


def test_what_stands_and_was_trusted_stays_to_the_bit_at_edges_of_paint_too() -> None:
    given = with_strip(facing(20.0), 26.0)
    albedo = np.where(np.arange(SHAPE[1]) < 10, 0.2, given.albedo).astype(np.float32)
    before = replace(given, albedo=albedo)
    before.normals[:, 9] = facing(25.0)[:, 9]
    kept, trusted = before.normals.copy(), before.valid.copy()
    told = continued_at_rest(before, None, limit_deg=LIMIT_DEG)
    np.testing.assert_array_equal(told.normals[trusted], kept[trusted])


def test_what_moves_is_not_told_by_what_stands_and_bands_leave_no_seam() -> None:
    shape = (BAND_ROWS + 30, 40)
    normals = np.zeros((*shape, 3), np.float32)
    normals[..., 2] = 1
    valid = np.ones(shape, np.bool_)
    valid[:, STRIP] = False
    error = np.where(valid, 0.5, 8).astype(np.float32)
    surface = Surface(normals=normals, albedo=np.full(shape, 0.5, np.float32), valid=valid, error_deg=error)
    moves = np.zeros(shape, np.bool_)
    moves[:20] = True
    told = continued_at_rest(surface, moves, limit_deg=LIMIT_DEG)
    assert told.valid[24:-4].all()
    assert not told.valid[:19, STRIP].any()
