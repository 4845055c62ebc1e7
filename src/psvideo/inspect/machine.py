"""Processor, memory, C library, graphics processor, and the boards at serial ports, of which none is opened."""

import os
import platform
import sys
from collections.abc import Iterator
from pathlib import Path

from psvideo.compute.threads import usable_cores
from psvideo.inspect.findings import Finding
from psvideo.model.units import counted
from psvideo.strobe.link.controller import serial_ports

ENOUGH_MEMORY_GB = 2.0
DRIVERS = {"nvidia": Path("/proc/driver/nvidia/version"), "amd": Path("/sys/module/amdgpu/version")}


def machine() -> Iterator[Finding]:
    """Give a finding for each part of the machine that matters."""
    yield _cores()
    yield _memory()
    yield _c_library()
    yield _graphics()


def _cores() -> Finding:
    there = os.cpu_count() or 1
    ours = usable_cores()
    text = f"{ours} of {there} cores may be used" if ours < there else f"{there} cores"
    return Finding(name="processor", level="ok", text=f"{text}; solving uses them all", value=ours, unit="cores")


def _memory() -> Finding:
    if sys.platform == "win32" or "SC_PHYS_PAGES" not in os.sysconf_names:
        return Finding(name="memory", level="note", text="not known here", next_step="2 GB free are enough at 1080p.")
    page = os.sysconf("SC_PAGE_SIZE")
    whole_gb = page * os.sysconf("SC_PHYS_PAGES") / 1e9
    free_gb = _available_gb() or whole_gb
    enough = free_gb >= ENOUGH_MEMORY_GB
    step = "" if enough else f"Close other programs: at 1080p {ENOUGH_MEMORY_GB:g} GB free are comfortable."
    text = f"{free_gb:.1f} of {whole_gb:.1f} GB free"
    return Finding(name="memory", level="ok" if enough else "note", text=text, next_step=step, value=free_gb, unit="GB")


def _available_gb() -> float | None:
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    found = next((line.split()[1] for line in lines if line.startswith("MemAvailable:")), None)
    return None if found is None else int(found) * 1024 / 1e9


def _c_library() -> Finding:
    name, number = platform.libc_ver()
    if name == "glibc":
        return Finding(name="C library", level="ok", text=f"glibc {number}; all threads share one heap")
    text = f"{platform.system()}{f', {name} {number}' if name else ''}: threads may keep freed memory for themselves"
    return Finding(name="C library", level="ok", text=text)


def _graphics() -> Finding:
    """Say what graphics processor there is. Nothing in psvideo runs on one, so none is never a fault."""
    found = [name for name, sign in DRIVERS.items() if sign.exists()]
    nodes = sorted(Path("/dev/dri").glob("renderD*")) if Path("/dev/dri").is_dir() else []
    what = (
        f"{' and '.join(found)} driver" if found else f"{counted(len(nodes), 'render node')}" if nodes else "none found"
    )
    text = f"{what}; psvideo computes on none, and a page in the browser uses what the browser has"
    return Finding(name="GPU", level="ok", text=text)


def strobes() -> Iterator[Finding]:
    """Give a finding for each board that is plugged in, or one that says that there is none."""
    boards = [port for port in serial_ports() if port.is_candidate]
    for port in boards:
        step = f"psvideo strobe stop `port` {port.device} asks it how it is."
        yield Finding(name="strobe board", level="ok", text=port.label, next_step=step)
    if not boards:
        yield Finding(
            name="strobe board",
            level="note",
            text="none at a USB port",
            next_step="Only flashing lights needs one: plug it in and look again, or try `port='emulated'`.",
        )
