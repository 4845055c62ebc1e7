"""Workers that share takes and pieces give the bytes of one process, also where some of them die or hang."""

import contextlib
import json
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import psutil
import pytest
from bytes_of_files import digest_of_results
from clips_in_pieces import HEIGHT, WIDTH, filmed, judged

import psvideo as ps
from psvideo.cli.app import main
from psvideo.errors import PsvideoError, UsageError
from psvideo.runs.many_takes import handed_out
from psvideo.runs.many_takes.cluster import Cluster, connected


def test_two_workers_give_the_bytes_of_one_process_and_takes_one_report(tmp_path: Path) -> None:
    clip = filmed(tmp_path, frames=60)
    given: dict[str, Any] = {"rig": clip / "rig.toml", "preview": ()}
    ps.normals(clip, out=tmp_path / "one" / "clip", **given)
    (tmp_path / "dark").mkdir()
    shutil.copy(clip / "plan.toml", tmp_path / "dark")
    cv2.imwrite(str(tmp_path / "dark" / "dark.0001.png"), np.zeros((HEIGHT, WIDTH), np.uint16))
    results = ps.normals_of_takes([clip, tmp_path / "dark"], out=tmp_path / "all", workers=2, pieces=2, **given)
    assert [one.clip.name for one in results] == ["dark", "clip"], "the worst first"
    assert "dark" in results[0].fault
    assert results[1].instants == len(judged(tmp_path / "one" / "clip")["instants"])
    assert digest_of_results(tmp_path / "all" / "clip") == digest_of_results(tmp_path / "one" / "clip")
    assert judged(tmp_path / "all" / "clip") == judged(tmp_path / "one" / "clip")
    assert "dark: failed." in (tmp_path / "all" / "report.html").read_text(encoding="utf-8")


@pytest.mark.campaign
def test_what_is_done_is_no_fault_of_workers_that_are_to_do_it_again(tmp_path: Path) -> None:
    clip = filmed(tmp_path, frames=60)
    given: dict[str, Any] = {
        "rig": clip / "rig.toml",
        "preview": (),
        "out": tmp_path / "out",
        "workers": 2,
        "pieces": 2,
    }
    ps.normals_of_takes([clip], **given)
    again = ps.normals_of_takes([clip], **given, resume=True)
    assert [one.fault for one in again] == [""]


@pytest.mark.parametrize("how", [[], pytest.param(["--workers", "2"], marks=pytest.mark.campaign)])
def test_split_of_several_takes_gives_the_bytes_of_one_at_a_time(
    how: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = filmed(tmp_path, frames=40)
    shutil.copytree(clip, tmp_path / "again")
    (tmp_path / "dark").mkdir()
    shutil.copy(clip / "plan.toml", tmp_path / "dark")
    cv2.imwrite(str(tmp_path / "dark" / "dark.0001.png"), np.zeros((HEIGHT, WIDTH), np.uint16))
    for name in ("clip", "again"):
        ps.split(tmp_path / name, out=tmp_path / "one" / name, beauty=True)
    takes = [str(tmp_path / name) for name in ("clip", "again", "dark")]
    for again in ([], ["--resume"]):
        assert main(["split", *takes, "-o", str(tmp_path / "all"), "--beauty", *how, *again]) == 1
        said = capsys.readouterr()
        named = [Path(line.split(":")[0]).name for line in said.out.splitlines()[-3:]]
        assert named == ["dark", "again", "clip"], said.out
        assert ("all done" in said.out) == (not how and bool(again)), "workers say nothing"
    for name in ("clip", "again"):
        assert digest_of_results(tmp_path / "all" / name) == digest_of_results(tmp_path / "one" / name)
    assert "dark: failed." in (tmp_path / "all" / "report.html").read_text(encoding="utf-8")
    with pytest.raises(UsageError, match="exists already"):
        ps.split_of_takes(takes, out=tmp_path / "all", workers=2)


@pytest.mark.campaign
def test_a_worker_that_is_killed_is_replaced_and_its_piece_done_again(tmp_path: Path) -> None:
    clip = filmed(tmp_path, frames=160)
    command = [sys.executable, "-m", "psvideo.cli.app", "normals", str(clip), "--no-preview", "-q"]
    command += ["--rig", str(clip / "rig.toml"), "-o"]
    subprocess.run([*command, str(tmp_path / "one" / "clip")], check=True)
    running = subprocess.Popen([*command, str(tmp_path / "two" / "clip"), "--workers", "2"])
    busy = _when_solving(tmp_path / "two" / ".clip.partial", psutil.Process(running.pid))
    assert len(busy) >= 2
    busy[0].kill()
    assert running.wait(timeout=300) == 0
    assert digest_of_results(tmp_path / "two" / "clip") == digest_of_results(tmp_path / "one" / "clip")
    assert judged(tmp_path / "two" / "clip") == judged(tmp_path / "one" / "clip")


def test_a_piece_hangs_that_takes_far_longer_than_the_others_did() -> None:
    looks = handed_out.Hanging(ours={"a", "b"})
    assert looks.workers({"one": ["a", "theirs"], "two": ["b"]}, 0.0) == []
    assert looks.workers({"one": ["a", "theirs"], "two": []}, 100.0) == []
    assert looks.workers({"one": ["a", "theirs"]}, handed_out.HANGS_TIMES * 100.0) == []
    assert looks.workers({"one": ["a", "theirs"]}, handed_out.HANGS_TIMES * 100.0 + 1) == ["one"]
    assert looks.workers({"one": ["theirs"], "two": ["a"]}, handed_out.HANGS_TIMES * 100.0 + 2) == []
    assert looks.longest_s == 100.0, "a piece that hung is none that was done"


@pytest.mark.campaign
def test_a_worker_that_hangs_is_replaced_and_its_piece_done_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip = filmed(tmp_path, frames=160)
    given: dict[str, Any] = {"rig": clip / "rig.toml", "preview": ()}
    ps.normals(clip, out=tmp_path / "one" / "clip", **given)
    for name, value in {"HANGS_S": 15.0, "HANGS_TIMES": 3.0, "LOOKS_EVERY_S": 1.0}.items():
        monkeypatch.setattr(handed_out, name, value)
    stopped: list[psutil.Process] = []

    def stop_one() -> None:
        busy = _when_solving(tmp_path / "two" / ".clip.partial", psutil.Process())
        busy[0].suspend()
        stopped.append(busy[0])

    stopping = threading.Thread(target=stop_one)
    stopping.start()
    ps.normals_of_takes([clip], out=tmp_path / "two" / "clip", workers=2, pieces=4, **given)
    stopping.join()
    assert stopped
    assert not stopped[0].is_running()
    assert digest_of_results(tmp_path / "two" / "clip") == digest_of_results(tmp_path / "one" / "clip")


@pytest.mark.campaign
def test_a_scheduler_that_is_killed_leaves_a_run_that_resume_ends(tmp_path: Path) -> None:
    clip = filmed(tmp_path, frames=160)
    given = [str(clip), "--rig", str(clip / "rig.toml"), "--no-preview", "-q", "-o"]
    normals = [sys.executable, "-m", "psvideo.cli.app", "normals", *given]
    subprocess.run([*normals, str(tmp_path / "one" / "clip")], check=True)
    where = tmp_path / "scheduler.json"
    dask = str(Path(sys.executable).with_name("dask"))
    here = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(where)]
    scheduler = subprocess.Popen([dask, "scheduler", *here], stderr=subprocess.DEVNULL)
    address = _address_in(where)
    worker = subprocess.Popen([dask, "worker", address, "--nthreads", "1"], stderr=subprocess.DEVNULL)
    try:
        out = tmp_path / "two" / "clip"
        running = subprocess.Popen([*normals, str(out), "--scheduler", address], stderr=subprocess.PIPE, text=True)
        _when_solving(tmp_path / "two" / ".clip.partial", psutil.Process(worker.pid))
        scheduler.kill()
        _, said = running.communicate(timeout=120)
    finally:
        for one in (*psutil.Process(worker.pid).children(recursive=True), worker, scheduler):
            with contextlib.suppress(psutil.NoSuchProcess):
                one.kill()
            one.wait()
    assert running.returncode == 1
    assert "The cluster's scheduler is gone." in said
    assert "Traceback" not in said
    subprocess.run([*normals, str(out), "--resume"], check=True)
    assert digest_of_results(out) == digest_of_results(tmp_path / "one" / "clip")
    assert not [*out.parent.glob(".*")]


def _address_in(where: Path) -> str:
    """Return a scheduler's address once its file is whole: dask opens the file first and writes into it later."""
    until_s = time.monotonic() + 300
    while time.monotonic() < until_s:
        with contextlib.suppress(FileNotFoundError, json.JSONDecodeError):
            return str(json.loads(where.read_text(encoding="utf-8"))["address"])
        time.sleep(0.05)
    raise TimeoutError(f"{where} was not written")


def _when_solving(beside: Path, parent: psutil.Process) -> list[psutil.Process]:
    """Return the processes of workers below another, once the first piece of a run was noted."""
    until_s = time.monotonic() + 300
    while not (beside / ".pieces" / "timing.json").is_file() and time.monotonic() < until_s:
        time.sleep(0.05)
    return [one for one in parent.children(recursive=True) if any("spawn_main" in word for word in one.cmdline())]


@pytest.mark.parametrize(("deaths", "starts"), [(1, 2), (9, 2)])
def test_workers_that_die_while_they_start_are_started_once_more(
    deaths: int, starts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that is killed before it has answered ends dask's cluster with RuntimeError."""
    begun: list[int] = []

    def local(**given: Any) -> Any:
        begun.append(given["n_workers"])
        if len(begun) <= deaths:
            raise RuntimeError("Nanny failed to start.")
        return contextlib.nullcontext("a cluster")

    monkeypatch.setattr("distributed.LocalCluster", local)
    monkeypatch.setattr("distributed.Client", lambda cluster, **_: contextlib.nullcontext(cluster))
    expected = pytest.raises(PsvideoError, match="`workers` 3: the processes end") if deaths > 1 else None
    with expected or contextlib.nullcontext(), connected(Cluster(workers=3)) as client:
        assert client == "a cluster"
    assert begun == [3] * starts


def test_what_cannot_be_shared_is_refused_in_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {"out": tmp_path / "out", "rig": tmp_path / "rig.toml"}
    with pytest.raises(UsageError, match="`workers` 0: expected"):
        ps.normals_of_takes(["clip"], workers=0, **given)
    with pytest.raises(UsageError, match="expected one of the two"):
        ps.normals_of_takes(["clip"], workers=2, scheduler="tcp://127.0.0.1:9", **given)
    with pytest.raises(UsageError, match="`scheduler` nonsense: expected its address"):
        ps.normals_of_takes(["clip"], scheduler="nonsense", **given)
    with pytest.raises(UsageError, match="several are named 'clip'"):
        ps.normals_of_takes(["a/clip", "b/clip"], **given)
    with pytest.raises(UsageError, match="names no clip"):
        ps.normals_of_takes([], **given)
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"python -m pip install 'psvideo\[dask\]'"):
        ps.normals_of_takes(["clip"], workers=2, **given)
