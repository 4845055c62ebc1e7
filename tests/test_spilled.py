"""Planes of large pictures lie in files while they are worked on, and the results are the same to the byte."""

import errno
import os
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.compute import spilled
from psvideo.errors import PsvideoError
from psvideo.formats import exr_files, exr_stream
from psvideo.model.choices import Compression
from psvideo.model.rig import Light
from psvideo.solve.filling.tiles import (
    LEFT_ALONE,
    SIDE_PX,
    THREE_LIGHTS,
    UNKNOWN,
    bring_back,
    tiles_around,
)
from psvideo.solve.normals.bands import ShownPlates
from psvideo.solve.normals.illumination import illumination
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.task import Usable, task

DIRECTIONS = [(0.6, 0.0, 0.8), (-0.48, 0.36, 0.8), (0.36, 0.48, 0.8), (-0.36, -0.48, 0.8), (0.48, -0.36, 0.8)]


def plates_of(lights: int) -> list[np.ndarray]:
    """A bump in three colours before a black wall, with shadows and noise."""
    y, x = (np.mgrid[0:64, 0:80] - 36).astype(np.float32) / 30
    inside = x * x + y * y < 1
    normals = np.stack([x, -y, np.sqrt(np.maximum(1 - x * x - y * y, 0))], -1) * inside[..., None]
    rng = np.random.default_rng(3)
    shades = [np.maximum(normals @ np.array(one, np.float32), 0) for one in DIRECTIONS[:lights]]
    images = [shade[..., None] * np.array([0.7, 0.5, 0.4], np.float32) for shade in shades]
    return [np.asarray(one + 0.002 * rng.standard_normal(one.shape), np.float32) for one in images]


@pytest.mark.parametrize("lights", [4, 5])
def test_a_picture_that_is_worked_on_in_files_gives_the_same_surface(
    lights: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lit = illumination([Light(name=str(n), direction=one) for n, one in enumerate(DIRECTIONS[:lights])], channels=3)
    solving = Solving(half=True, error=True, residual=True, spare=tmp_path)
    held = solving.solve(plates_of(lights), lit)
    monkeypatch.setattr(spilled, "LARGE_PIXELS", 100)
    found = solving.solve(plates_of(lights), lit)
    assert held.source is not None
    assert (held.source > 1).any(), "something is filled"
    for name in ("normals", "albedo", "valid", "residual", "error_deg", "source"):
        assert getattr(found, name).tobytes() == getattr(held, name).tobytes(), name
    assert not list(tmp_path.iterdir()), "the files have no names"


def test_what_was_let_go_is_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spilled, "LARGE_PIXELS", 100)
    planes = spilled.planes_for((3, 200, 60), np.float16, pixels=200 * 60, folder=tmp_path)
    wanted = np.random.default_rng(0).random(planes.shape).astype(np.float16)
    planes[:] = wanted
    picture = np.moveaxis(planes, 0, -1)
    spilled.let_go(planes[1, 7:31], picture[:90], np.zeros(4))
    assert (picture == np.moveaxis(wanted, 0, -1)).all()


@pytest.mark.parametrize("compression", get_args(Compression))
def test_what_packs_to_next_to_nothing_is_let_go_while_it_is_written(
    compression: Compression, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    planes, let_go, read = spilled.in_file((4, 512, 512), np.float32, tmp_path), spilled.let_go, list[bool]()

    def noted(*parts: NDArray[np.float32]) -> None:
        read.append(len(parts) == len(planes))
        let_go(*parts)

    monkeypatch.setattr("psvideo.formats.exr_stream.let_go", noted)
    monkeypatch.setattr(exr_stream, "LET_GO_EACH_BYTES", planes.nbytes // 9)
    channels = dict(zip("RGBA", planes, strict=True))
    exr_files.write_exr(tmp_path / "still.exr", channels, half=False, compression=compression)
    assert 4 <= sum(read) <= 18  # none is held for longer than it takes to read a quarter of all


def test_a_disk_without_room_is_said_before_anything_is_solved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "posix_fallocate", full)
    monkeypatch.setattr(spilled, "LARGE_PIXELS", 100)
    with pytest.raises(PsvideoError, match=r"one of 0 MB has no room \(No space left on device\)"):
        spilled.planes_for((3, 200), np.float16, pixels=200, folder=tmp_path)


def test_a_thinned_picture_is_the_same_wherever_it_lies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spilled, "LARGE_PIXELS", 100)
    planes = spilled.planes_for((3, 50, 70), np.float32, pixels=50 * 70, folder=tmp_path)
    planes[:] = np.random.default_rng(0).random(planes.shape)
    picture = np.moveaxis(planes, 0, -1)
    assert (spilled.thin(picture, 7) == picture.copy()[::7, ::7]).all()
    assert (spilled.thin(picture[..., 1], 4) == picture.copy()[::4, ::4, 1]).all()


def test_holes_are_filled_in_what_lies_around_them_alone() -> None:
    """A hole of one pixel at a corner of four tiles holds these, one inside a tile that tile alone, and what comes back
    are those pixels."""
    rng = np.random.default_rng(1)
    normals = rng.random((3, 200, 330)).astype(np.float32)
    albedo, wanted = rng.random((1, 200, 330)).astype(np.float32), np.zeros((200, 330), np.bool_)
    wanted[[64, 100, 199], [96, 208, 329]] = True
    solved = ~wanted
    solved[:, 300:] = False
    where = np.ascontiguousarray(np.argwhere(wanted), np.int32)
    tiles = tiles_around(wanted, solved, normals, albedo, reach_px=4, spare=None)
    assert np.argwhere(tiles.table >= 0).tolist() == [[1, 2], [1, 3], [2, 2], [2, 3], [3, 6], [6, 10]]
    for row, col in [(63, 95), (64, 96), (99, 207), (199, 329), (195, 325)]:
        tile, y, x = tiles.table[row // SIDE_PX, col // SIDE_PX], row % SIDE_PX, col % SIDE_PX
        assert (tiles.normals[tile, :, y, x] == normals[:, row, col]).all()
        expected = UNKNOWN if wanted[row, col] else THREE_LIGHTS if solved[row, col] else LEFT_ALONE
        assert tiles.lights[tile, y, x] == expected, (row, col)
        place = np.flatnonzero((where == (row, col)).all(axis=1))
        assert tiles.places[tile, y, x] == (place[0] if len(place) else -1)

    before = normals.copy()
    tiles.normals[:], tiles.lights[:] = 7.0, 2
    assert bring_back(tiles, where, normals, albedo).tolist() == [2, 2, 2]
    assert (normals[:, wanted] == 7.0).all()
    assert (normals[:, ~wanted] == before[:, ~wanted]).all()


def test_where_few_rows_are_wanted_there_is_room_for_few() -> None:
    """A sample of rows lies at the distances of the picture: room for eight of them would be that of 248."""
    lit = illumination([Light(name=str(n), direction=one) for n, one in enumerate(DIRECTIONS[:5])], channels=1)
    shown = ShownPlates.of([np.ones((310, 7000), np.uint16)] * 5).as_floats()
    made: list[tuple[list[int], int]] = []

    def make(rows: NDArray[np.intp], first: int, into: NDArray[np.float32]) -> None:
        made.append((rows.tolist(), into.shape[1]))

    given = task(shown.samples, lit, None, None, Usable(), 0.0, 1.0)
    run = replace(shown, makes=lambda: make)
    for step in (1, 31):
        made.clear()
        run.in_bands(lambda *_: None, given, lambda _: None, threads=1, step=step)
        assert sorted(row for rows, _ in made for row in rows) == list(range(0, 310, step))
        assert {room for _, room in made} == {max(step, 8 // step * step)}
