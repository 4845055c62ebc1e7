"""Which serial port a strobe controller is at, judged by what USB says of it; nothing is opened to find out."""

from collections.abc import Sequence
from dataclasses import dataclass

from psvideo.errors import PsvideoError, UsageError

AUTO = "auto"
"""The name that stands for whichever port a board is found at."""
EMULATED = "emulated"
"""The name that stands for a board in plain Python, in this program."""
BOARD_MAKERS = {0x2341: "Arduino", 0x2A03: "Arduino", 0x2E8A: "Raspberry Pi Pico"}
"""USB vendors whose serial ports are microcontroller boards."""
BRIDGES = {
    (0x1A86, 0x7523): "CH340",
    (0x1A86, 0x5523): "CH341",
    (0x1A86, 0x55D4): "CH9102",
    (0x0403, 0x6001): "FTDI FT232R",
    (0x0403, 0x6015): "FTDI FT230X",
    (0x10C4, 0xEA60): "CP210x",
}
"""USB to serial chips (vendor, product) of copies and older boards; many other devices have them too."""


@dataclass(frozen=True, kw_only=True)
class SerialPort:
    """A serial port of this machine as the system describes it; numbers are None where it is not on USB."""

    device: str
    description: str = ""
    vendor: int | None = None
    product: int | None = None
    serial: str | None = None

    @property
    def board(self) -> str | None:
        """What board it is by its maker's number, or None."""
        return BOARD_MAKERS.get(self.vendor) if self.vendor is not None else None

    @property
    def bridge(self) -> str | None:
        """The USB to serial chip that a board may be behind, or None."""
        if self.vendor is None or self.product is None:
            return None
        return BRIDGES.get((self.vendor, self.product))

    @property
    def is_candidate(self) -> bool:
        """Whether a strobe controller may be."""
        return self.board is not None or self.bridge is not None

    @property
    def label(self) -> str:
        """What people call it."""
        kind = self.board or (f"{self.bridge} (a board, or something else)" if self.bridge else self.description)
        usb = f", USB {self.vendor:04x}:{self.product:04x}" if self.vendor is not None and self.product else ""
        unit = f", serial number {self.serial}" if self.serial else ""
        return f"{self.device}: {kind or 'unknown'}{usb}{unit}"


def choose_port(ports: Sequence[SerialPort]) -> SerialPort:
    """Return the one port that a controller is at by its identity. Raises where there is none, or more than one."""
    boards = [port for port in ports if port.board]
    candidates = boards if len(boards) == 1 else [port for port in ports if port.is_candidate]
    if len(candidates) == 1:
        return candidates[0]
    if candidates:
        listed = "; ".join(port.label for port in candidates)
        raise UsageError(f'`port="auto"`: several boards are here ({listed}). Name one with `port`.')
    others = "; ".join(port.label for port in ports)
    found = f"none that is known to belong to one (there are: {others})" if others else "no serial port at all"
    raise PsvideoError(
        f'`port="auto"`: found {found}. Plug the controller in (a cable with data wires), check the permission to use '
        'serial ports (on Linux the group dialout), or name the port with `port`. Without a board: `port="emulated"`.'
    )
