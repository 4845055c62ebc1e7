"""The passes beside normals and albedo: which lights reach a pixel, what is not diffuse, and where a subject is."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import psvideo as ps
from psvideo.clip.decode.decoders import decode
from psvideo.model.rig import Light
from psvideo.solve.normals.illumination import illumination
from psvideo.solve.normals.solving import Solving
from psvideo.solve.passes.asked_passes import AskedPasses, Passes, passes_of

SIZE, FINE, NOISE = 64, 4, 0.002
DIRECTIONS = np.array([[0, 0, 1], [0.6, 0, 0.8], [-0.6, 0, 0.8], [0, 0.6, 0.8], [0, -0.6, 0.8]])
Floats = NDArray[np.float64]


def ball(directions: Floats = DIRECTIONS, *, gloss: float = 0.0, curtain: float = 0.0) -> tuple[Floats, Floats, Floats]:
    """Return a grey ball's plates (light, row, col), its diffuse part, and how much of each pixel it covers."""
    grid = (np.arange(SIZE * FINE) + 0.5) / FINE - SIZE / 2
    x, y = np.meshgrid(grid / 24, -grid / 24)
    inside = x**2 + y**2 < 1
    normals = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))])
    towards = np.tensordot(directions, normals, axes=1)
    halfway = directions + np.array([0, 0, 1])
    halfway /= np.linalg.norm(halfway, axis=1, keepdims=True)
    lobe = gloss * np.maximum(np.tensordot(halfway, normals, axes=1), 0) ** 200
    diffuse = np.where(inside, 0.5 * np.maximum(towards, 0), 0.0)
    whole = np.where(inside, diffuse + lobe, curtain)
    noise = np.random.default_rng(3).normal(0, NOISE, (len(directions), SIZE, SIZE))
    return coarse(whole) + noise, coarse(diffuse), coarse(inside.astype(float))


def coarse(fine: Floats) -> Floats:
    return np.asarray(fine.reshape(*fine.shape[:-2], SIZE, FINE, SIZE, FINE).mean(axis=(-1, -3)))


def passes(plates: Floats, directions: Floats = DIRECTIONS, *, mask: NDArray[np.bool_] | None = None) -> Passes:
    pictures = list(plates.astype(np.float32))
    lights = [Light(name=str(n), direction=tuple(one)) for n, one in enumerate(directions.tolist())]
    lit = illumination(lights, channels=1)
    surface = Solving(residual=True, error=True).solve(pictures, lit, mask=mask)
    return passes_of(AskedPasses(reach=True, specular=True, alpha=True, each=True), pictures, surface, lit, mask=mask)


def test_reach_counts_the_lights_that_a_pixel_faces() -> None:
    plates, diffuse, cover = ball()
    found = passes(plates).reach
    assert found is not None
    clear = (cover == 1) & ((diffuse == 0) | (diffuse > 10 * NOISE)).all(axis=0)
    assert (found == (diffuse > 0).sum(axis=0))[clear].mean() > 0.99
    assert found[cover == 0].max() <= 1
    assert found[cover == 0].mean() < 0.01


def test_specular_is_what_exceeds_the_diffuse_model_and_its_lights_add_up_to_it() -> None:
    plates, diffuse, cover = ball(gloss=0.3)
    made = passes(plates)
    assert made.specular is not None
    lobe = plates - diffuse
    strong = (lobe > 0.1).any(axis=0) & (cover == 1)
    assert abs(made.specular[strong].sum() / lobe.sum(axis=0)[strong].sum() - 1) < 0.1
    matte = (coarse_max(lobe) < 4 * NOISE) & (cover == 1)
    assert made.specular[matte].mean() < NOISE
    assert np.allclose(np.sum(made.specular_of, axis=0), made.specular, atol=2e-3)


def coarse_max(lobe: Floats) -> Floats:
    return np.asarray(lobe.max(axis=0))


@pytest.mark.parametrize("curtain", [0.0, 0.02])
def test_the_matte_is_soft_at_the_edge_and_a_dim_curtain_is_no_subject(curtain: float) -> None:
    plates, _, cover = ball(curtain=curtain)
    alpha = passes(plates).alpha
    assert alpha is not None
    edge = (cover > 0) & (cover < 1)
    assert np.abs(alpha - cover)[edge].mean() < 0.15
    assert np.abs(alpha - cover)[~edge].mean() < 0.005


def test_a_matte_is_white_where_the_whole_picture_is_lit_dark_hair_included() -> None:
    plates = np.full((3, SIZE, SIZE), 0.4) + np.random.default_rng(1).normal(0, NOISE, (3, SIZE, SIZE))
    plates[:, 20:44, 20:44] = 0.02
    alpha = passes(plates, DIRECTIONS[[1, 2, 3]]).alpha
    assert alpha is not None
    assert alpha.min() == 1


def test_plates_that_are_all_noise_have_no_matte_and_no_light() -> None:
    made = passes(np.random.default_rng(2).normal(0, NOISE, (5, SIZE, SIZE)))
    assert made.alpha is not None
    assert made.reach is not None
    assert made.alpha.mean() < 0.01
    assert made.reach.mean() < 0.01


def test_more_lights_are_counted_than_a_byte_holds() -> None:
    lights = np.tile(DIRECTIONS[[1, 2, 3]], (100, 1))
    plates = np.full((len(lights), SIZE, SIZE), 0.4)
    made = passes(plates, lights)
    assert made.reach is not None
    assert (made.reach == len(lights)).all()


def test_nothing_is_said_outside_the_mask() -> None:
    mask = np.zeros((SIZE, SIZE), np.bool_)
    mask[:, :32] = True
    made = passes(ball(gloss=0.3)[0], mask=mask)
    for image in (made.reach, made.specular, made.alpha):
        assert image is not None
        assert image[:, :32].any()
        assert not image[:, 32:].any()


def test_a_run_writes_the_passes_and_each_light_s_share_beside_its_plates(tmp_path: Path) -> None:
    small = {"frames = 24": "frames = 12", "width_px = 320": "width_px = 80", "height_px = 240": "height_px = 60"}
    text = (Path(__file__).parents[1] / "data_synth" / "gloss.toml").read_text()
    for before, after in small.items():
        text = text.replace(before, after)
    (tmp_path / "gloss.toml").write_text(text)
    ps.shoot(tmp_path / "gloss.toml", out=tmp_path / "gloss")
    report = ps.normals(
        tmp_path / "gloss",
        rig=tmp_path / "gloss" / "rig.toml",
        out=tmp_path / "out",
        aov=["reach", "specular", "alpha", "beauty"],
        plates=True,
    )
    number = report.instants[0].number
    summed = decode("exr", tmp_path / f"out/specular/gloss_specular.{number}.exr").codes.astype(np.float32)
    each = [decode("exr", file).codes for file in sorted(tmp_path.glob(f"out/specular_of_lights/*/*.{number}.exr"))]
    assert len(each) == len(report.lights)
    assert np.allclose(np.sum(each, axis=0, dtype=np.float32), summed, atol=5e-3)
    beauty = decode("exr", tmp_path / f"out/beauty/gloss_beauty.{number}.exr").codes
    assert (summed <= beauty.astype(np.float32) + 5e-3).all()
