"""The live run that is measured, in a process of its own: what ``psvideo live genicam`` does, of a camera that is not
there; one line of JSON for the page's address, one a second, and one at the end."""

import json
import sys
import threading
from dataclasses import dataclass, field
from pathlib import Path
from unittest.mock import patch

from psvideo.compute.heap import set_as_commands_do

TICK_S = 0.01
"""The clock ticks of /proc, on Linux."""


@dataclass(kw_only=True)
class Threads:
    """Processor seconds of this process's threads, by what they are called; those that ended keep their last."""

    spent_s: dict[int, float] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)

    def look(self) -> None:
        """Take down what every thread has spent until now."""
        self.names |= {one.native_id: one.name for one in threading.enumerate() if one.native_id is not None}
        for task in Path("/proc/self/task").iterdir():
            try:
                words = (task / "stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
            except OSError:  # it ended meanwhile
                continue
            self.spent_s[int(task.name)] = TICK_S * (int(words[11]) + int(words[12]))

    @property
    def by_name_s(self) -> dict[str, float]:
        """Processor seconds by kind of thread."""
        found: dict[str, float] = {}
        for task, seconds in self.spent_s.items():
            name = self.names.get(task, "others").rstrip("0123456789-_ ")
            found[name] = round(found.get(name, 0.0) + seconds, 2)
        return found


def main() -> None:
    """Watch the camera whose command is given, after a plan, a rig and how many seconds of footage."""
    set_as_commands_do()
    from psvideo.clip.streams import genicam  # numpy comes with it
    from psvideo.runs.live import live

    plan, rig, seconds, camera = sys.argv[1], sys.argv[2], float(sys.argv[3]), sys.argv[4:]
    threads = Threads()

    def said(record: dict[str, object]) -> None:
        threads.look()
        print(json.dumps(record | {"threads_s": threads.by_name_s}), flush=True)

    with patch.object(genicam, "find_spec", bool), patch.object(genicam, "_command", lambda *words: camera):
        summary = live(
            "genicam",
            plan=plan,
            rig=rig,
            seconds=seconds,
            page=True,
            port=0,
            opened=lambda url: print(json.dumps({"url": url}), flush=True),
            said=lambda status: said(status.record),
        )
    high = Path("/proc/self/status").read_text(encoding="ascii").partition("VmHWM:")[2].split()[0]
    said(summary.record | {"peak_mb": int(high) / 1e3})


if __name__ == "__main__":
    main()
