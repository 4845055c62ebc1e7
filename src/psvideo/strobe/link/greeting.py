"""The first words with what is at a port: wait for a board that restarts, and distinguish it from other things."""

import time
from itertools import chain, repeat

from psvideo.errors import PsvideoError
from psvideo.strobe.link.exchange import Link
from psvideo.strobe.link.protocol import format_request
from psvideo.strobe.link.replies import Identity
from psvideo.strobe.link.requests import Id
from psvideo.strobe.link.words import PROTOCOL

START_WITHIN_S = 7.0
"""A board that restarts when its port is opened is in its boot loader for one to two seconds."""
PAUSES_S = (0.3, 0.3, 2.2)
"""How long to wait for an answer the first times, and then: some boot loaders stay as long as anybody talks to them."""


def greet(link: Link, *, within_s: float = START_WITHIN_S) -> Identity:
    """Return who is at the port. Raises PsvideoError where it is no strobe controller, or speaks another protocol."""
    link.heard = b""
    until_s = time.monotonic() + within_s
    identity = None
    for pause_s in chain(PAUSES_S, repeat(PAUSES_S[-1])):
        link.port.write(b"\n" + format_request(Id()))
        identity = link.listen(Identity, within_s=min(pause_s, max(until_s - time.monotonic(), 0.0)))
        if identity is not None or time.monotonic() >= until_s:
            break
    if identity is None or not link.resynchronise():
        raise PsvideoError(_other(link.port.name, link.heard))
    if identity.proto != PROTOCOL:
        raise PsvideoError(
            f"{link.port.name}: the controller speaks protocol {identity.proto}, and this psvideo {PROTOCOL}. Put the "
            "firmware of this psvideo onto the board (lights/), or use the psvideo that came with the board's."
        )
    return identity


def _other(name: str, heard: bytes) -> str:
    """Say what is at a port that is no controller, by what came from it."""
    said = "".join(chr(byte) if 0x20 <= byte <= 0x7E else " " for byte in heard[:60]).strip()
    if not heard:
        found = "nothing answers there: no board, a board without the strobe firmware, or one that is not powered"
    elif format_request(Id()).strip() in heard:
        found = "what is there sends back what it receives (a modem, or a plug that connects its two data wires)"
    elif b"$GP" in heard or b"$GN" in heard:
        found = f"a satellite receiver is there (it says {said!r})"
    elif not said:
        found = "what is there sends bytes that are not text: another device, or another speed than 115,200 baud"
    else:
        found = f"what is there is not a strobe controller (it says {said!r})"
    return (
        f"{name}: {found}. Name the controller's port with `port` (psvideo strobe list shows those that are likely), "
        "or put the firmware onto the board (lights/)."
    )
