"""Messages into lines and lines into messages, on both sides of the strobe link. Opens no port.

``lines`` makes whole lines out of bytes, ``requests`` and ``replies`` hold the records; what is right stands in
lights/protocol.md.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, TypeVar, get_args

from psvideo.strobe.link.lines import Error, LineError, seal, unseal
from psvideo.strobe.link.replies import Refusal, Reply
from psvideo.strobe.link.requests import REQUESTS, Lit, Request, Slot
from psvideo.strobe.link.words import WAYS, WIRINGS, Nonce, Way, WiringName

LARGEST_NUMBER = 4_294_967_295
LONGEST_NONCE = 8

NUMBER = re.compile(r"[0-9]+\Z")
NONCE = re.compile(rf"[A-Za-z0-9]{{1,{LONGEST_NONCE}}}\Z")
VALUE = re.compile(r"[!-)+-<>-~]+\Z")
REFUSAL = re.compile(r"E ([0-9]{1,3})(?: (.*))?\Z")


def format_request(request: Request, *, sealed: bool = True) -> bytes:
    """Return a request as the bytes of its line, with a checksum where it is ``sealed``.

    >>> from psvideo.strobe.link.requests import Lit, Slot
    >>> format_request(Slot(slot=0, duration=1600, dark=16685, period=80, lit=(Lit(line=2, on=40),)), sealed=False)
    b'SLOT 0 1600 16685 80 2:40\\n'
    """
    text = " ".join((request.name, *_words(request)))
    return f"{seal(text) if sealed else text}\n".encode("ascii")


def _words(request: Request) -> list[str]:
    values = (getattr(request, field.name) for field in fields(request))
    parts = (part for value in values for part in (value if isinstance(value, tuple) else (value,)))
    return [f"{part.line}:{part.on}" if isinstance(part, Lit) else str(part) for part in parts]


def find_command(text: str) -> tuple[type[Request], list[str]]:
    """Return the kind of request that a line (without checksum) is, and its words; raises LineError."""
    name, *words = text.split(" ")
    if name not in REQUESTS:
        raise LineError(Error.COMMAND, f"command {name[:20]}")
    return REQUESTS[name], words


def parse_words(kind: type[Request], words: list[str]) -> Request:
    """Return the request that a command's words make; raises LineError where they are too few, too many or no words."""
    wanted = fields(kind)
    last = wanted[-1].type if wanted else None
    most = None if last in MANY else len(wanted)
    fewest = len(wanted) - (kind is Slot)
    if "" in words or len(words) < fewest or (most is not None and len(words) > most):
        raise LineError(Error.WORDS, f"words: {len(words)}, {kind.name} takes {fewest if most is None else most}")
    values: dict[str, Any] = {}
    for place, field in enumerate(wanted):
        if field.type in MANY:
            values[field.name] = tuple(map(MANY[field.type], words[place:]))
        else:
            values[field.name] = ONE[field.type](words[place])
    return kind(**values)


def _number(word: str) -> int:
    if not NUMBER.match(word) or int(word.lstrip("0")[:11] or "0") > LARGEST_NUMBER:
        raise LineError(Error.NUMBER, f"number {word[:20]}")
    return int(word)


def _lit(word: str) -> Lit:
    line, _, on = word.partition(":")
    return Lit(line=_number(line), on=_number(on))


def _nonce(word: str) -> Nonce:
    if not NONCE.match(word):
        raise LineError(Error.NUMBER, f"nonce {word[:20]}")
    return Nonce(word)


def _wiring(word: str) -> WiringName:
    for wiring in WIRINGS:
        if word == wiring:
            return wiring
    raise LineError(Error.NUMBER, f"wiring {word[:20]}")


def _way(word: str) -> Way:
    for way in WAYS:
        if word == way:
            return way
    raise LineError(Error.NUMBER, f"way {word[:20]}")


ONE: Mapping[Any, Callable[[str], Any]] = {int: _number, Nonce: _nonce, WiringName: _wiring, Way: _way}
MANY: Mapping[Any, Callable[[str], Any]] = {tuple[int, ...]: _number, tuple[Lit, ...]: _lit}


def format_reply(reply: Reply | Refusal, *, sealed: bool) -> bytes:
    """Return a reply as the bytes of its line; it has a checksum where the request had one."""
    if isinstance(reply, Refusal):
        text = f"E {reply.code} {reply.text}"
    else:
        text = " ".join(("OK", *(f"{field.name}={getattr(reply, field.name)}" for field in fields(reply))))
    return f"{seal(text) if sealed else text}\n".encode("ascii")


Answer = TypeVar("Answer", bound=Reply)


def parse_reply(text: str, kind: type[Answer]) -> tuple[Answer | Refusal, bool]:
    """Return what a controller answered to a request whose reply is ``kind``, and whether it had a checksum.

    Raises LineError where the line is no such reply.
    """
    body, sealed = unseal(text)
    refused = REFUSAL.match(body)
    if refused:
        return Refusal(code=int(refused[1]), text=refused[2] or ""), sealed
    word, *pairs = body.split(" ")
    wanted = fields(kind)
    keys = [pair.partition("=")[0] for pair in pairs]
    if word != "OK" or keys != [field.name for field in wanted]:
        raise LineError(Error.WORDS, f"reply {body[:60]!r}")
    values = {field.name: _value(pair.partition("=")[2], field.type) for field, pair in zip(wanted, pairs, strict=True)}
    return kind(**values), sealed


def _value(word: str, kind: Any) -> str | int:
    if kind is int:
        if not NUMBER.match(word) or len(word) > 20:
            raise LineError(Error.NUMBER, f"number {word[:20]}")
        return int(word)
    allowed = get_args(kind)
    if not VALUE.match(word) or (allowed and word not in allowed):
        raise LineError(Error.NUMBER, f"value {word[:20]}")
    return word
