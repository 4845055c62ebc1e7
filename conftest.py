"""What the examples in docstrings and on the page "psvideo from Python" run in: a folder with a take and stills."""

import os
import shutil
from pathlib import Path

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
"""Before numpy is loaded: tests share the cores as processes, and threads that wait for each other spin for nothing."""


@pytest.fixture(scope="session")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with take3/, a virtual take of a sphere, and stills/, what its lights show, one picture each."""
    import psvideo as ps
    from psvideo.formats.exr_files import write_exr

    folder = tmp_path_factory.mktemp("shelf")
    ps.shoot("sphere", folder / "take3")
    take = ps.open_take(folder / "take3")
    (folder / "stills").mkdir()
    whole = next(one for one in ps.gather(take, ps.find_timing(take)) if one.lights == take.plan.lights)
    for plate in whole.plates:
        channels = {name: plate.image[..., place] for place, name in enumerate("RGB")}
        write_exr(folder / "stills" / f"{plate.light}.exr", channels, half=False)
    return folder


@pytest.fixture(autouse=True)
def _examples_have_a_take(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run an example that names a folder in one of its own, with a take and stills."""
    test = getattr(request.node, "dtest", None)
    if test is None or not any("ps." in one.source for one in test.examples):
        return
    shelf, place = request.getfixturevalue("shelf"), request.getfixturevalue("tmp_path")
    shutil.copytree(shelf, place, dirs_exist_ok=True)
    monkeypatch.chdir(place)
