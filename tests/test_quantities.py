"""One table of quantities: every room that writes, shows or asks for them reads it."""

from pathlib import Path

import numpy as np
import pytest
from ball_delivery import deliver

from psvideo.export.sequences.planes import PICTURES, InstantPictures, planes_of
from psvideo.export.sequences.result_files import Delivery
from psvideo.export.space import Space
from psvideo.model.quantities import ALWAYS, AOVS, QUANTITIES, SOURCES
from psvideo.model.surface import Surface
from psvideo.page.folders import show_of
from psvideo.page.show import index_of
from psvideo.solve.depth import Depth, View
from psvideo.solve.passes.asked_passes import Passes

ROWS, COLS = 3, 4
OF_AN_INSTANT = (*ALWAYS, *AOVS)


def made() -> InstantPictures:
    normals = np.zeros((ROWS, COLS, 3), np.float32)
    normals[..., 2] = 1
    plane = np.full((ROWS, COLS), 0.5, np.float32)
    none = np.zeros((ROWS, COLS), bool)
    source = np.ones((ROWS, COLS), np.uint8)
    surface = Surface(normals=normals, albedo=plane, valid=~none, residual=plane, error_deg=plane, source=source)
    depth = Depth(depth=plane, cut_east=none, cut_south=none, parts=1, metric=True, view=View())
    passes = Passes(reach=source.astype(np.uint16), specular=plane, alpha=plane)
    age_s = np.linspace(0, 0.1, ROWS)
    return InstantPictures(
        surface=surface,
        space=Space(),
        beauty=plane,
        depth=depth,
        age_s=age_s,
        passes=passes,
        motion=lambda: np.ones((ROWS, COLS, 4)),
    )


def test_what_may_be_asked_for_is_what_the_table_says() -> None:
    assert tuple(name for name, row in QUANTITIES.items() if row.written == "asked") == AOVS
    assert all(name == row.name for name, row in QUANTITIES.items())


def test_each_quantity_of_an_instant_has_its_function_and_no_other_has_one() -> None:
    assert set(PICTURES) == set(OF_AN_INSTANT)


@pytest.mark.parametrize("name", OF_AN_INSTANT)
def test_planes_are_the_channels_that_the_table_says(name: str) -> None:
    planes = planes_of(name, made())
    assert tuple(planes) == QUANTITIES[name].channels
    assert {plane.shape for plane in planes.values()} == {(ROWS, COLS)}


@pytest.mark.parametrize(
    "name",
    ["residual", "error", "source", "beauty", "depth", "position", "age", "reach", "specular", "alpha", "motion"],
)
def test_what_was_not_made_is_not_written(name: str) -> None:
    whole = made().surface
    bare = InstantPictures(
        surface=Surface(normals=whole.normals, albedo=whole.albedo, valid=whole.valid), space=Space()
    )
    with pytest.raises(ValueError, match=f"^{name} is to be written and was not made$"):
        planes_of(name, bare)


def test_depth_is_integrated_where_a_quantity_is_computed_from_it() -> None:
    assert [name for name in AOVS if Delivery(space=Space(), aovs=(name,)).needs_depth] == ["depth", "position"]


def test_files_are_written_as_they_are_made_in_any_order_asked() -> None:
    written = Delivery(space=Space(), aovs=AOVS[::-1]).quantities
    assert written == (
        "normals",
        "albedo",
        "valid",
        "residual",
        "error",
        "source",
        "beauty",
        "age",
        "reach",
        "specular",
        "alpha",
        "motion",
        "depth",
        "position",
    )
    assert [QUANTITIES[name].of for name in written] == sorted(
        (QUANTITIES[name].of for name in written), key=SOURCES.index
    )


def test_view_shows_every_quantity_that_lies_in_a_folder_and_what_the_table_says_of_it(tmp_path: Path) -> None:
    folder = deliver(tmp_path, Space())
    sequences = index_of(show_of(folder))["sequences"]
    assert isinstance(sequences, list)
    assert [one["id"] for one in sequences] == [name for name in QUANTITIES if (folder / name).is_dir()]
    assert "beauty" in {one["id"] for one in sequences}
    for one in sequences:
        row = QUANTITIES[one["id"]]
        assert (one["label"], one["kind"], one["unit"], one["from_zero"], one["hatched"]) == (
            row.label,
            row.shown,
            row.unit,
            row.from_zero,
            row.hatched,
        )
