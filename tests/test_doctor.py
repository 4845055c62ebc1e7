"""psvideo doctor: says what is here and what is not, with the next step, and ends as scripts need it."""

import importlib.metadata
import json
import os
import tomllib
from collections.abc import Callable
from pathlib import Path

import numba
import pytest
from numba.core import caching
from packaging.requirements import Requirement

from psvideo.cli.app import main
from psvideo.clip.decode import decoders
from psvideo.compute.compiled import folder_kept_in
from psvideo.inspect import speed
from psvideo.inspect.findings import Finding, is_well

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measure for a moment only."""
    monkeypatch.setattr(speed, "MEASURED_S", 0.0)
    monkeypatch.setattr(speed, "DISK_MB", 2)


def asked(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, dict[str, dict[str, object]], bool]:
    status = main(["doctor", "--json", *words])
    said = json.loads(capsys.readouterr().out)
    return status, {finding["name"]: finding for finding in said["findings"]}, said["well"]


def test_a_whole_machine_is_well_and_every_part_is_told(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, found, well = asked(capsys, "--folder", str(tmp_path))
    assert (status, well) == (0, True)
    assert found["numpy"]["text"] == importlib.metadata.version("numpy")
    assert str(os.cpu_count()) in str(found["processor"]["text"])
    assert {f"movies: {name}" for name in decoders.MOVIE_CODECS} <= set(found)
    assert {"memory", "C library", "GPU", "strobe board", "least squares", "disk", "usd-core"} <= set(found)
    assert list(tmp_path.iterdir()) == [], "measuring leaves nothing behind"


def test_what_lacks_is_missing_with_the_next_step_and_exit_status_1(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(decoders.MOVIE_CODECS, "ProRes", "no_such_decoder")
    monkeypatch.setattr("psvideo.inspect.software.version", _without("scipy", "usd-core"))
    status, found, well = asked(capsys)
    assert (status, well) == (1, False)
    lacking = {name for name, finding in found.items() if finding["level"] == "missing"}
    assert lacking == {"movies: ProRes", "scipy"}
    assert found["usd-core"]["level"] == "note", "an extra is no fault"
    assert all(finding["next_step"] for finding in found.values() if finding["level"] != "ok")


def test_where_compiled_loops_cannot_be_kept_it_says_what_to_set(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(caching.CacheImpl, "_locator_classes", [])
    _, found, well = asked(capsys)
    assert well, "slow, and no fault"
    assert found["numba's compiler"]["level"] == "note"
    assert "NUMBA_CACHE_DIR" in str(found["numba's compiler"]["next_step"])
    monkeypatch.undo()
    monkeypatch.setattr(numba.core.config, "CACHE_DIR", str(tmp_path / "kept"))
    assert folder_kept_in() == next((tmp_path / "kept").iterdir())


def test_every_extra_that_users_may_install_is_reported_with_the_line_to_type(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    wanted = {extra: Requirement(lines[0]).name for extra, lines in extras.items() if extra not in ("docs", "test")}
    monkeypatch.setattr("psvideo.inspect.software.version", _without(*wanted.values()))
    _, found, well = asked(capsys)
    assert well, "an extra is no fault"
    assert {name: found[name]["next_step"] for name in wanted.values()} == {
        name: f"pip install 'psvideo[{extra}]'." for extra, name in wanted.items()
    }


def _without(*names: str) -> Callable[[str], str]:
    def version(name: str) -> str:
        if name in names:
            raise importlib.metadata.PackageNotFoundError(name)
        return importlib.metadata.version(name)

    return version


def test_a_folder_that_cannot_be_written_is_told(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, found, _ = asked(capsys, "--folder", str(tmp_path / "none"))
    assert status == 1
    assert "--folder" in str(found["disk"]["next_step"])


def test_the_verdict_closes_what_people_read(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    assert "All that psvideo needs is here." in said
    assert "\x1b" not in said


def test_compiling_ahead_comes_first_where_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []
    monkeypatch.setattr("psvideo.runs.steps.compiling.compile_ahead", lambda *, watch: calls.append("compiled"))
    assert main(["doctor", "-q"]) == 0
    assert calls == []
    assert main(["doctor", "--compile", "-q"]) == 0
    assert calls == ["compiled"]


def test_nothing_missing_is_well_beside_any_notes() -> None:
    fine = Finding(name="a", level="note", text="slow")
    assert is_well([fine])
    assert not is_well([fine, Finding(name="b", level="missing", text="gone")])
