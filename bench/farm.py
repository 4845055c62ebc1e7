"""Many machines: what the scheduler costs where workers only sleep, and by how much two workers beat one.

``python -m bench.farm`` prints both. Sleeping workers are threads of this process, and their pieces take no time to
speak of, so that what is left is dask's own work for every piece. The speed-up is of takes in compressed frames.
"""

import os
import resource
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from psvideo.compute.threads import THREADS
from psvideo.runs.many_takes.handed_out import done_apart
from psvideo.runs.many_takes.normals_of_takes import normals_of_takes
from psvideo.synth.shoot import shoot

TAKES, PIECES, WORKERS = 1000, 5, (20, 200)
SLEEPS_S = 0.001
WATCHING_OFF = {
    "distributed.admin.system-monitor.interval": "1h",
    "distributed.worker.memory.monitor-interval": "1h",
    "distributed.worker.profile.enabled": False,
}
"""What workers watch of themselves, each on its own computer: hundreds in one process would do nothing else."""
WHOSE = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
SCENE = """
schema = "psvideo-scene/1"
name = "farm"
frames = 96
camera = { width_px = 1280, height_px = 720, fps = 100, shutter_deg = 360, readout_s = 0.0097, width_m = 1.0 }
ambient = { level = 0.02 }
object = [{ mesh = "sphere" }]
light = [
  { name = "a", direction = [0.5, 0.0, 0.8] },
  { name = "b", direction = [-0.5, 0.1, 0.8] },
  { name = "c", direction = [0.1, 0.5, 0.8] },
]
"""


class Overhead(NamedTuple):
    """What so many pieces of so many takes cost the scheduler with so many workers, if they only sleep."""

    takes: int
    pieces: int
    workers: int
    seconds: float
    ms_per_piece: float


class SpeedUp(NamedTuple):
    """How long takes last with one worker and with two, each with one thread, and with one that is held to one core,
    as farms do: else it reads and writes on another, beside solving. The processor time that all of it took says on a
    busy machine how much more two workers do for the same."""

    takes: int
    one_s: float
    one_core_s: float
    two_s: float
    times: float
    times_one_core: float
    one_cpu_s: float
    one_core_cpu_s: float
    two_cpu_s: float


@dataclass(frozen=True, kw_only=True)
class Asleep:
    """Stands for a take that is solved in so many pieces."""

    pieces: int

    def do(self, number: int) -> None:
        """Stand for a piece that is solved."""
        time.sleep(SLEEPS_S)


def overhead(takes: int = TAKES, pieces: int = PIECES, workers: int = WORKERS[0]) -> Overhead:
    """Measure what dask does for pieces that take no time."""
    import dask
    from distributed import Client, LocalCluster

    with (
        dask.config.set(WATCHING_OFF),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=False,
            memory_limit=0,
            dashboard_address="127.0.0.1:0",
        ) as local,
        Client(local, set_as_default=False) as client,
    ):
        began_s = time.process_time()
        faults = [fault for _, fault in done_apart(client, [Asleep(pieces=pieces)] * takes) if fault]
        lasted_s = time.process_time() - began_s
    if faults:
        raise RuntimeError(faults[0])
    count = takes * (pieces + 1)
    return Overhead(takes, pieces, workers, lasted_s, 1e3 * lasted_s / count)


def speed_up(takes: int = 4) -> SpeedUp:
    """Solve takes with one worker and with two, each of one thread."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "farm.toml").write_text(SCENE, encoding="utf-8")
        clips = [folder / f"take{n}" for n in range(takes)]
        shoot(folder / "farm.toml", clips[0])
        for clip in clips[1:]:
            shutil.copytree(clips[0], clip)
        cores = sorted(os.sched_getaffinity(0))
        lasted_s, cpu_s = [], []
        for workers, used in ((1, cores), (1, cores), (1, cores[:1]), (2, cores)):  # the first one compiles
            os.sched_setaffinity(0, used)
            began_s, began_cpu_s = time.monotonic(), _cpu_s()
            results = normals_of_takes(
                clips, rig=clips[0] / "rig.toml", out=folder / "out", workers=workers, force=True, preview=()
            )
            if any(one.fault for one in results):
                raise RuntimeError(results[0].fault)
            lasted_s.append(time.monotonic() - began_s)
            cpu_s.append(_cpu_s() - began_cpu_s)
        os.sched_setaffinity(0, cores)
    _, one_s, core_s, two_s = lasted_s
    return SpeedUp(takes, one_s, core_s, two_s, one_s / two_s, core_s / two_s, *cpu_s[1:])


def _cpu_s() -> float:
    """Return the processor time of this process and of the workers that have ended."""
    return sum(used.ru_utime + used.ru_stime for used in map(resource.getrusage, WHOSE))


def rows() -> Iterator[Overhead]:
    """Measure the scheduler with a few workers, and with hundreds."""
    for workers in WORKERS:
        yield overhead(workers=workers)


def main() -> int:
    """Print both."""
    os.environ[THREADS] = "1"  # a worker by itself would take both cores
    for row in rows():
        print(row, flush=True)
    print(speed_up(), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
