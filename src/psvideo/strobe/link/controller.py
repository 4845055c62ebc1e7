"""Serial ports: what there are, and one opened for a strobe controller. The only module that knows pyserial.

A port is opened for us alone where the system can do that, so two hosts never talk to one controller. Names of
pseudo-terminals and pyserial's URLs (``socket://host:port``) are as good as serial ports.
"""

import contextlib

import serial
from serial.tools.list_ports import comports  # type: ignore[attr-defined]

from psvideo.errors import PsvideoError
from psvideo.strobe.link.ports import AUTO, SerialPort, choose_port

BAUD = 115_200
WAIT_S = 0.02
WRITE_WITHIN_S = 2.0


def serial_ports() -> tuple[SerialPort, ...]:
    """Return this machine's serial ports, as the system describes them; none is opened."""
    return tuple(
        SerialPort(
            device=port.device,
            description="" if port.description in (None, "n/a") else port.description,
            vendor=port.vid,
            product=port.pid,
            serial=port.serial_number,
        )
        for port in sorted(comports())  # type: ignore[no-untyped-call]
    )


class OpenPort:
    """A serial port that is open. Raises PsvideoError, in one paragraph, where it goes away."""

    def __init__(self, name: str) -> None:
        device = choose_port(serial_ports()).device if name == AUTO else name
        self._name = device
        try:
            self._serial = serial.serial_for_url(  # type: ignore[no-untyped-call]
                device, baudrate=BAUD, timeout=WAIT_S, write_timeout=WRITE_WITHIN_S, exclusive=True
            )
        except (serial.SerialException, OSError, ValueError) as fault:
            raise PsvideoError(_cannot_open(device, fault)) from None

    @property
    def name(self) -> str:
        """The port's name."""
        return self._name

    def write(self, data: bytes) -> None:
        """Send bytes."""
        try:
            self._serial.write(data)
            self._serial.flush()
        except (serial.SerialException, OSError) as fault:
            raise self._gone(fault) from None

    def read(self) -> bytes:
        """Return what has come, after a short wait where nothing has."""
        try:
            first: bytes = self._serial.read(1)
            rest: bytes = self._serial.read(self._serial.in_waiting) if first else b""
        except (serial.SerialException, OSError, TypeError) as fault:
            raise self._gone(fault) from None
        return first + rest

    def close(self) -> None:
        """Let go of the port."""
        with contextlib.suppress(serial.SerialException, OSError):
            self._serial.close()

    def _gone(self, fault: Exception) -> PsvideoError:
        return PsvideoError(
            f"{self.name}: the connection to the controller broke ({fault}). The board makes itself dark when it hears "
            "nothing, within two seconds at most; check that it is. Check cable and plug, then run the command again."
        )


_LISTED = "psvideo strobe list shows what there is"


def _cannot_open(device: str, fault: Exception) -> str:
    reason = str(fault)
    if "exclusively lock" in reason or "Resource busy" in reason or "in use" in reason:
        return f"{device}: is in use by another program. End that one first (another psvideo, a serial monitor)."
    if "Permission" in reason or "Access is denied" in reason:
        why = "may not be opened by this user; on Linux join the group that owns it (dialout), then log in again"
    elif "No such file" in reason or "FileNotFound" in reason or "could not open port" in reason:
        why = f"there is no such port, or it cannot be opened; {_LISTED}"
    else:
        why = f"cannot be opened: it is no serial port, or one that does not answer; {_LISTED}"
    return f"{device}: {why} ({reason})."
