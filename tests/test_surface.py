"""A surface's arrays belong together."""

import numpy as np
import pytest

from psvideo.errors import UsageError
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
