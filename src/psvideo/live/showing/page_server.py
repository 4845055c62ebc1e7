"""The live page's server: its few files, and one WebSocket for each viewer, who asks for the newest and gets no other.

On this machine only, unless another host is named, and then for those alone who know the token. A request must name
this server as its host, and a WebSocket must come from this very page: no foreign site can read the pictures.
"""

import contextlib
import hmac
import json
import os
import secrets
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from importlib.resources import files
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, quote, urlsplit

from psvideo.errors import PsvideoError, UsageError
from psvideo.live.showing.newest_pictures import NewestPictures
from psvideo.page.assembled import assets, joined, scripts
from psvideo.page.serving import ADDRESS, POLICY, TYPES

if TYPE_CHECKING:
    from websockets.sync.server import Server, ServerConnection

SOCKET = "/newest"
BALL = "ball"
"""What a page says for a click on the button that finds lights."""
WAIT_S = 1.0
"""A viewer who has seen the newest hears how things stand after this long."""
LOCAL = (ADDRESS, "localhost")
LIVE_PORT = 8788
LAST_PORT = 65535
Told = Callable[[], Mapping[str, object]]


@dataclass(kw_only=True)
class LivePage:
    """Serves the newest ``pictures``, and what ``told`` gives beside them, until it is closed.

    ``ball`` is called where a viewer wants the lights found on a chrome ball.
    """

    pictures: NewestPictures
    told: Told
    host: str
    token: str
    ball: Callable[[], None] = lambda: None
    viewers: int = 0
    _server: "Server | None" = None
    _files: dict[str, bytes] = field(default_factory=dict)

    @property
    def url(self) -> str:
        """The address to open in a browser, with the token where one is needed."""
        query = f"?token={quote(self.token, safe='')}" if self.token else ""
        return f"http://{self.host}:{self._port}/{query}"

    @property
    def _port(self) -> int:
        assert self._server is not None  # noqa: S101
        return int(self._server.socket.getsockname()[1])

    def close(self) -> None:
        """Close the port and all connections."""
        if self._server is not None:
            self._server.shutdown()

    def _answer(self, connection: "ServerConnection", request: Any) -> Any:
        """Answer a request for a file, and refuse who may not see anything; None lets a WebSocket open."""
        asked = urlsplit(request.path)
        token = parse_qs(asked.query).get("token", [""])[0]
        if (refused := self._refused(request.headers, asked.path, token)) is not None:
            return _response(HTTPStatus.FORBIDDEN, f"{refused}\n".encode(), "text/plain; charset=utf-8")
        if asked.path == SOCKET:
            return None
        name = "live.html" if asked.path == "/" else asked.path.removeprefix("/")
        if name not in self._files:
            return _response(HTTPStatus.NOT_FOUND, b"There is nothing of that name here.\n", "text/plain")
        return _response(HTTPStatus.OK, self._files[name], TYPES[name.rpartition(".")[2]])

    def _refused(self, headers: Mapping[str, str], path: str, token: str) -> str | None:
        host = headers.get("Host", "")
        if not self.token and host.lower() not in {f"{name}:{self._port}" for name in LOCAL}:
            return f"This page answers as {ADDRESS}:{self._port} only."
        if path == SOCKET and urlsplit(headers.get("Origin", f"http://{host}")).netloc != host:
            return "Pictures go to this server's own page only."
        secret = self.token and (path in ("/", SOCKET))
        if secret and not hmac.compare_digest(token.encode(), self.token.encode()):
            return "The address lacks the token, or has another one: open the address that psvideo live printed."
        return None

    def _serve(self, connection: "ServerConnection") -> None:
        """Answer one viewer for as long as there is one: each request with what is newest then."""
        from websockets.exceptions import ConnectionClosed

        self.viewers += 1
        try:
            with contextlib.suppress(ConnectionClosed):  # a browser may go at any moment
                self._answer_requests(connection)
        finally:
            self.viewers -= 1

    def _answer_requests(self, connection: "ServerConnection") -> None:
        before = 0
        for message in connection:
            if message == BALL:
                self.ball()
                continue
            asked = _asked(message)
            if asked[0] != before:
                self.pictures.drawn(asked[0], time.monotonic())
            before = asked[0]
            self.pictures.wait(asked[0], WAIT_S)
            number, blocks = self.pictures.packed(asked[1])
            blocks = [] if number == asked[0] else blocks
            connection.send(json.dumps({"number": number, "pictures": len(blocks)} | dict(self.told())))
            for one in blocks:
                connection.send(one)


def live_page(
    pictures: NewestPictures,
    told: Told,
    *,
    host: str = ADDRESS,
    port: int | None = None,
    token: str | None = None,
    ball: Callable[[], None] = lambda: None,
) -> LivePage:
    """Return the page's server, which answers already; ``ball`` is called for a click that is to find lights.

    On another ``host`` than this machine's own a ``token`` is needed; left out, one is made. Raises UsageError where
    the port is taken or the library for it is missing.
    """
    try:
        from websockets.sync.server import serve
    except ModuleNotFoundError:
        raise UsageError(
            "The live page needs the library websockets, which is not installed. Install psvideo with it (python -m "
            "pip install 'psvideo[live]'), or use `no_page`."
        ) from None
    if port is not None and not 0 <= port <= LAST_PORT:
        raise UsageError(f"`port` {port}: ports run from 0 to {LAST_PORT}. Name another one, or leave `port` out.")
    secret = "" if host in LOCAL and token is None else token or secrets.token_urlsafe(12)
    page = LivePage(pictures=pictures, told=told, host=host, token=secret, ball=ball, _files=_files())
    reason: str | None = None
    for candidate in (LIVE_PORT, 0) if port is None else (port,):
        try:
            page._server = serve(
                page._serve, host, candidate, process_request=page._answer, compression=None, server_header=None
            )
        except OSError as fault:
            reason = os.strerror(fault.errno) if fault.errno else str(fault)
            continue
        threading.Thread(target=page._server.serve_forever, name="psvideo live page", daemon=True).start()
        return page
    if port is None:
        raise PsvideoError(f"{host}: no port can be listened on ({reason}). Check `host` and the network settings.")
    raise UsageError(f"`port` {port}: cannot be used on {host} ({reason}). Name another one, or leave `port` out.")


def _files() -> dict[str, bytes]:
    """Return the page's files by name; its script holds the modules of the other page that it uses."""
    own = {entry.name: entry.read_bytes() for entry in files("psvideo.live").joinpath("assets").iterdir()}
    script = joined(scripts() | {"live.js": own["live.js"].decode()}, "live.js").encode()
    return own | {"live.js": script, "style.css": assets()["style.css"]}


def _asked(message: str | bytes) -> tuple[int, str]:
    """Return the number that a viewer has seen and the light whose plate is wanted; what is odd counts as nothing."""
    try:
        asked = json.loads(message)
        return int(asked["seen"]), str(asked["plate"])
    except (ValueError, KeyError, TypeError, OverflowError):
        return 0, ""


def _response(status: HTTPStatus, body: bytes, kind: str) -> Any:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    headers = {
        "Content-Type": kind,
        "Content-Length": str(len(body)),
        "Connection": "close",
        "Cache-Control": "no-store",
        "Content-Security-Policy": POLICY,
        "Referrer-Policy": "no-referrer",
        "X-Content-Type-Options": "nosniff",
    }
    return Response(status.value, status.phrase, Headers(headers), body)
