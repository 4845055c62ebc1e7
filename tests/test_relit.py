"""Pictures of the relit movie, against plain numpy."""

import numpy as np

from psvideo.pictures.relit_kernel import relit, shown_by


def test_a_relit_picture_is_albedo_times_n_dot_l_averaged() -> None:
    rng = np.random.default_rng(0)
    normals = rng.uniform(-1, 1, (3, 9, 14)).astype(np.float16)
    albedo = rng.uniform(0, 1, (3, 9, 14)).astype(np.float16)
    light = np.array([0.3, -0.4, 0.8], np.float32)
    facing = np.maximum(np.einsum("x,xrc->rc", light.astype(np.float64), normals.astype(np.float64)), 0)
    whole = np.moveaxis(albedo * facing, 0, -1)[:8]
    expected = whole.reshape(4, 2, 7, 2, 3).mean(axis=(1, 3))
    made = relit(tuple(normals), tuple(albedo), light, 2)
    np.testing.assert_allclose(made.astype(np.float64), expected, rtol=2e-3, atol=1e-6)


def test_every_half_float_is_shown_by_its_own_bits() -> None:
    table = np.random.default_rng(1).integers(0, 256, 1 << 16).astype(np.uint8)
    every = np.arange(1 << 16, dtype=np.uint16).view(np.float16).reshape(128, 512)
    np.testing.assert_array_equal(shown_by(table, every), table.reshape(128, 512))
    np.testing.assert_array_equal(shown_by(table, every.T), table.reshape(128, 512).T)
