"""A surface's arrays belong together."""

import numpy as np
import pytest

from psvideo.errors import UsageError
from psvideo.model.channels import brightest_channel, mean_of_channels
from psvideo.model.surface import Surface


def surface(**changed: np.ndarray) -> Surface:
    arrays = {
        "normals": np.zeros((2, 3, 3), np.float32),
        "albedo": np.zeros((2, 3), np.float32),
        "valid": np.zeros((2, 3), np.bool_),
    }
    return Surface(**(arrays | changed))


def test_grey_and_coloured_surfaces_are_made_of_planes_of_one_size() -> None:
    assert surface().residual is None
    assert surface(albedo=np.zeros((2, 3, 3), np.float32)).albedo.shape == (2, 3, 3)


@pytest.mark.parametrize(
    "changed",
    [
        {"normals": np.zeros((3, 2, 3), np.float32)},
        {"normals": np.zeros((2, 3), np.float32)},
        {"albedo": np.zeros((3, 2), np.float32)},
        {"residual": np.zeros((2, 2), np.float32)},
        {"valid": np.zeros((2, 3, 1), np.bool_)},
    ],
    ids=str,
)
def test_planes_of_different_sizes_are_a_mistake_of_the_program(changed: dict[str, np.ndarray]) -> None:
    with pytest.raises(UsageError, match="do not match"):
        surface(**changed)


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_the_mean_and_the_brightest_of_channels_are_numpys_to_the_bit(channels: int) -> None:
    image = np.random.default_rng(channels).random((37, 53, channels)).astype(np.float32)
    for laid in (image, np.moveaxis(np.ascontiguousarray(np.moveaxis(image, -1, 0)), 0, -1), image[::2, ::3]):
        assert np.array_equal(mean_of_channels(laid), laid.mean(axis=-1))
        assert np.array_equal(brightest_channel(laid), laid.max(axis=-1))
