"""What there is to watch, and what there is to flash: the whole of the list that ``psvideo live`` gives."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from psvideo.clip.streams.genicam import found_cameras
from psvideo.strobe.link.controller import serial_ports


@dataclass(frozen=True, kw_only=True)
class FoundOnSet:
    """Something that is there: ``name`` is what to call it, ``label`` what it is."""

    kind: Literal["camera", "video device", "board"]
    name: str
    label: str


def on_set() -> tuple[FoundOnSet, ...]:
    """Return GenICam cameras (with the extra ``genicam``), video devices, and the ports at which a board may be."""
    cameras = [FoundOnSet(kind="camera", name=one.source, label=one.label) for one in found_cameras()]
    devices = [
        FoundOnSet(kind="video device", name=str(path), label=_device_label(path))
        for path in sorted(Path("/dev").glob("video[0-9]*"))
    ]
    boards = [
        FoundOnSet(kind="board", name=port.device, label=port.label) for port in serial_ports() if port.is_candidate
    ]
    return (*cameras, *devices, *boards)


def _device_label(path: Path) -> str:
    """Return what the system calls a video device."""
    name = Path("/sys/class/video4linux") / path.name / "name"
    return name.read_text(encoding="utf-8", errors="replace").strip() if name.is_file() else ""
