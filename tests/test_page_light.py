"""Light in the page, in a real browser: right to a thousandth, against closed forms and sums over directions."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import page_folder as small
import pytest
from watched_page import KEY, Watched, albedo, lambert, light, relit_in, serving

from psvideo.page.serving import PageServer

if TYPE_CHECKING:
    from playwright.sync_api import Page

ASSETS = Path(__file__).resolve().parents[1] / "src" / "psvideo" / "page" / "assets"
RIM = (-0.9, -0.2, 0.1)
ORANGE = np.array([1.0, ((0x80 / 255 + 0.055) / 1.055) ** 2.4, 0.0])
"""#ff8000 in linear light (IEC 61966-2-1)."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small.results(tmp_path_factory.mktemp("page") / "out")


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[PageServer]:
    with serving(folder) as one:
        yield one


@pytest.mark.parametrize(("y", "world"), [("up", False), ("down", False), ("up", True), ("down", True)])
def test_relit_light_is_albedo_times_n_dot_l_in_every_space_and_whichever_way_y_points(
    y: str, world: bool, tmp_path: Path, watched: Watched
) -> None:
    with serving(small.results(tmp_path / "out", y=y, world=world)) as server:
        page = watched.open(server.url)
        found = relit_in(page, lights=[light(KEY), light(RIM, colour="#ff8000", intensity=0.7)])
    true = albedo() * (lambert(KEY) + 0.7 * ORANGE * lambert(RIM))
    assert np.abs(found - true).max() <= 1e-3
    assert true.max() > 0.5


@pytest.mark.parametrize("world", [False, True])
def test_a_near_light_falls_off_with_the_square_of_its_distance_to_every_point(
    world: bool, tmp_path: Path, watched: Watched
) -> None:
    """Points in widths of the picture from their median, as the page says; the position pass is in metres."""
    with serving(small.results(tmp_path / "out", world=world, position=True)) as server:
        page = watched.open(server.url)
        found = relit_in(page, lights=[light(KEY, near=True, distance=0.6)])
    normals, inside = small.ball()
    points = small.points() / small.SCALE_M
    points -= np.median(points[inside], axis=0)
    lamp = 0.6 * np.array(KEY) / np.linalg.norm(KEY)
    away = lamp - points
    reach = np.linalg.norm(away, axis=-1)
    facing = np.maximum((normals * away).sum(axis=-1) / reach, 0)
    true = albedo() * (facing * (0.6 / reach) ** 2)[..., None]
    assert np.abs(found - true)[inside].max() < 1e-3
    flat = albedo() * lambert(KEY)
    assert np.abs(flat - true)[inside].mean() > 0.2 * true[inside].mean()


def test_a_highlight_is_blinns(server: PageServer, watched: Watched) -> None:
    found = relit_in(watched.open(server.url), lights=[light(KEY)], specular=0.4, exponent=20)
    unit = np.array(KEY) / np.linalg.norm(KEY)
    half = unit + np.array([0, 0, 1])
    half /= np.linalg.norm(half)
    normals = small.ball()[0].astype(np.float64)
    shine = 0.4 * np.maximum(normals @ half, 0) ** 20 * (normals @ unit > 0)
    true = albedo() * lambert(KEY) + shine[..., None]
    near = np.abs(normals @ unit) > 0.01  # at the edge of its own shadow the highlight ends at once
    assert np.abs(found - true)[near].max() <= 4e-3  # the 20th power of a half float


def around_in(page: Page, name: str, directions: np.ndarray) -> np.ndarray:
    """Return the light (n, 3) that comes from directions (n, 3), as the page's own file defines it."""
    source = base64.b64encode((ASSETS / "around.js").read_bytes()).decode()
    script = "async ([source, name, all]) => { const made = await import(`data:text/javascript;base64,${source}`);"
    found = page.evaluate(
        f"{script} return all.map((one) => made.radianceOf(name, one)); }}", [source, name, directions.tolist()]
    )
    return np.array(found)


@pytest.mark.parametrize(("name", "turn_deg"), [("studio", 0), ("window", 50)])
def test_light_from_all_around_is_what_a_matte_surface_gathers(
    name: str, turn_deg: float, server: PageServer, watched: Watched
) -> None:
    """Gathered direction by direction, from surroundings that are turned about the upright axis."""
    polar, across = np.meshgrid((np.arange(40) + 0.5) * np.pi / 40, (np.arange(80) + 0.5) * np.pi / 40, indexing="ij")
    level = np.sin(polar)
    there = np.stack([level * np.sin(across), np.cos(polar), level * np.cos(across)], axis=-1).reshape(-1, 3)
    watched.page.goto("about:blank")
    radiance = around_in(watched.page, name, there) * (level.ravel() * (np.pi / 40) ** 2)[:, None]
    cos, sin = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    turned = there @ np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]])
    normals, inside = small.ball()
    gathered = np.maximum(normals.astype(np.float64) @ turned.T, 0) @ radiance / np.pi
    page = watched.open(server.url)
    found = relit_in(page, lights=[], around=name, aroundTurn=turn_deg, aroundStrength=1)
    true = albedo() * gathered
    error = np.abs(found - true)[inside]
    assert error.mean() < 0.03 * true[inside].max(), "two degrees of the harmonics leave 1 % on average"
    assert error.max() < 0.1 * true[inside].max(), "and 9 % at most (Ramamoorthi and Hanrahan 2001)"
