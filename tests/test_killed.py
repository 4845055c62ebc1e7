"""Runs that are killed or find the disk full leave nothing half-made, and go on to the same bytes."""

from pathlib import Path

import pytest
from bench.killed import COMMANDS, How, filmed, trials


@pytest.mark.campaign
@pytest.mark.parametrize("how", ["killed", "disk full"])
@pytest.mark.parametrize("name", COMMANDS)
def test_a_run_that_was_stopped_at_random_goes_on_to_the_same_bytes(name: str, how: How, tmp_path: Path) -> None:
    filmed(tmp_path)
    found = list(trials(name, tmp_path, how=how, moments=3, seed=3))
    assert not [fault for one in found for fault in one.faults]
    assert any(one.was_stopped for one in found)
