"""Half floats come out the same on processors that have instructions for them and on those that have none."""

import os
import subprocess
import sys
from pathlib import Path

import psvideo

SOURCE = Path(psvideo.__file__).parent
COMPARED = """
import numpy as np
from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded, encoded

@FUSED.kept
def to_halves(values, stored):
    for k in range(len(values)):
        stored[k] = encoded(values[k], stored)

@FUSED.kept
def to_floats(stored, values):
    for k in range(len(values)):
        values[k] = decoded(stored[k])

every = np.arange(1 << 16, dtype=np.uint32).astype(np.uint16)
floats = np.zeros(len(every), np.float32)
to_floats(every, floats)
with np.errstate(invalid="ignore"):
    wanted = every.view(np.float16).astype(np.float32)
assert (np.isnan(floats) == np.isnan(wanted)).all()
assert (floats.view(np.uint32) == wanted.view(np.uint32))[~np.isnan(wanted)].all()

rng = np.random.default_rng(0)
finite = np.sort(wanted[np.isfinite(wanted)])
middles = (finite[1:] + finite[:-1]) / 2  # ties: to even
beside = [np.nextafter(middles, np.float32(way)) for way in (-np.inf, np.inf)]
anything = rng.integers(0, 1 << 32, 2_000_000, dtype=np.uint32).view(np.float32)
values = np.concatenate([finite, middles, *beside, anything[np.isfinite(anything)]]).astype(np.float32)
stored = np.zeros(len(values), np.uint16)
to_halves(values, stored)
with np.errstate(over="ignore"):
    wanted = np.minimum(values, np.float32(65504)).astype(np.float16)
assert (stored == wanted.view(np.uint16)).all()
print("the same")
"""


def test_half_floats_are_numpys_with_a_processor_s_instructions_and_without(tmp_path: Path) -> None:
    """Without F16C the compiled code called a function that was not there, and the process ended by signal 11."""
    script = tmp_path / "compared.py"
    script.write_text(COMPARED)
    for which, processor in (("own", {}), ("plain", {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""})):
        kept = {"PYTHONPATH": str(SOURCE.parent), "NUMBA_CACHE_DIR": str(tmp_path / which)}
        done = subprocess.run(
            [sys.executable, "-B", script],
            env=os.environ | kept | processor,
            capture_output=True,
            text=True,
            check=False,
        )
        assert (done.returncode, done.stdout) == (0, "the same\n"), (which, done.stderr)
