"""Boards at serial ports; none is opened."""

from collections.abc import Iterator

from psvideo.inspect.doctor_finding import Finding
from psvideo.strobe.link.controller import serial_ports


def strobes() -> Iterator[Finding]:
    """Give a finding for each board that is plugged in, or one that says that there is none."""
    boards = [port for port in serial_ports() if port.is_candidate]
    for port in boards:
        step = f"psvideo strobe stop --port {port.device} asks it how it is."
        yield Finding(name="strobe board", level="ok", text=port.label, next_step=step)
    if not boards:
        yield Finding(
            name="strobe board",
            level="note",
            text="none at a USB port",
            next_step="Only flashing lights needs one: plug it in and look again, or try --port emulated.",
        )
