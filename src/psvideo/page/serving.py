"""A small server on this machine only: the page, what there is to show, and pictures by id and number.

Nothing that a browser asks for becomes a path: assets are read once and looked up by name, sequences by id. A request
must name this very server as its host, so that no foreign site that resolves to 127.0.0.1 can read the pictures.
"""

import json
import re
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from psvideo.errors import PsvideoError, UsageError
from psvideo.page.assembled import assets
from psvideo.page.picture import Look
from psvideo.page.show import Show, ShownSequence, index_of
from psvideo.page.store import BlockStore

ADDRESS = "127.0.0.1"
USUAL_PORT = 8787
WIDTHS_PX = range(16, 8193)
TYPES = {"html": "text/html; charset=utf-8", "css": "text/css; charset=utf-8", "js": "text/javascript; charset=utf-8"}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data: blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""A report is one file: its style and pictures are in it, and it runs nothing."""
PICTURE = re.compile(r"/picture/([A-Za-z0-9_.:+-]+)/(\d{1,21})")
"""Numbers may be times in nanoseconds; a browser writes whole ones without an exponent up to 21 digits."""
MOST_PORT = 65535
"""Ports are numbers of 16 bits (RFC 9293)."""
STALE_S = 20.0
"""A connection on which nothing is asked for this long is closed."""


class PageServer(ThreadingHTTPServer):
    """Serves one show until it is shut down."""

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, show: Show, port: int) -> None:
        self.show, self.store, self.assets = show, BlockStore(), assets()
        super().__init__((ADDRESS, port), Handler)

    @property
    def url(self) -> str:
        """The address to open in a browser."""
        return f"http://{ADDRESS}:{self.server_port}/"

    @property
    def hosts(self) -> tuple[str, ...]:
        """What a request may name as its host."""
        return tuple(f"{name}:{self.server_port}" for name in (ADDRESS, "localhost"))

    def server_close(self) -> None:
        """Close the port and release all pictures."""
        super().server_close()
        self.store.close()


def page_server(show: Show, *, port: int | None = None) -> PageServer:
    """Return a server of a show, listening but not yet answering; without ``port`` it takes a free one.

    Raises UsageError where the port that was asked for is taken or not allowed.
    """
    if port is not None:
        if not 0 <= port <= MOST_PORT:
            raise UsageError(f"`port` {port}: expected a number from 1 to {MOST_PORT}, or leave it out for a free one.")
        try:
            return PageServer(show, port)
        except OSError as fault:
            reason = fault.strerror
            raise UsageError(
                f"`port` {port}: cannot be used ({reason}). Another program listens there, or it is not allowed: "
                "name another port, or leave `port` out and a free one is taken."
            ) from None
    for candidate in (USUAL_PORT, 0):
        try:
            return PageServer(show, candidate)
        except OSError as fault:
            reason = fault.strerror
    raise PsvideoError(f"{ADDRESS}: no port can be listened on ({reason}). Check the machine's network settings.")


class Handler(BaseHTTPRequestHandler):
    """Answers one browser's requests."""

    server: PageServer
    server_version = "psvideo"
    sys_version = ""
    protocol_version = "HTTP/1.1"
    timeout = STALE_S
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """Answer with an asset, the index, the timing or a picture."""
        if self.headers.get("Host", "").lower() not in self.server.hosts:
            self._refuse(HTTPStatus.FORBIDDEN, f"This page answers as {self.server.hosts[0]} only.")
            return
        asked = urlsplit(self.path)
        name = "index.html" if asked.path == "/" else asked.path.removeprefix("/")
        if name in self.server.assets:
            self._answer(self.server.assets[name], TYPES[name.rpartition(".")[2]])
        elif asked.path == "/index.json":
            self._answer_json(index_of(self.server.show))
        elif asked.path == "/report.html" and self.server.show.report is not None:
            self._report(self.server.show.report)
        elif asked.path == "/timing.json" and self.server.show.timing is not None:
            self._answer_json(_or_fault(self.server.show))
        elif picture := PICTURE.fullmatch(asked.path):
            self._picture(picture[1], picture[2], asked.query)
        else:
            self._refuse(HTTPStatus.NOT_FOUND, "There is nothing of that name here.")

    do_HEAD = do_GET  # noqa: N815  # the base class looks for this name

    def _report(self, file: Path) -> None:
        try:
            self._answer(file.read_bytes(), TYPES["html"], policy=REPORT_POLICY)
        except OSError:
            self._refuse(HTTPStatus.NOT_FOUND, "The report is not there any more.")

    def _picture(self, name: str, digits: str, query: str) -> None:
        show = self.server.show
        sequence = show.sequence(name)
        asked = parse_qs(query)
        width = asked.get("width", [str(show.width_px)])[0]
        number = None if sequence is None else _number_asked_for(sequence, digits)
        if sequence is None or number is None:
            self._refuse(HTTPStatus.NOT_FOUND, "There is no such picture.")
        elif not width.isascii() or not width.isdigit() or len(width) > 5 or int(width) not in WIDTHS_PX:
            self._refuse(HTTPStatus.BAD_REQUEST, f"width is {WIDTHS_PX.start} to {WIDTHS_PX.stop - 1} pixels.")
        else:
            look = Look(width_px=min(int(width), show.width_px), quick="quick" in asked)
            block = self.server.store.get(sequence, number, look)
            self._answer(block, "application/octet-stream")

    def _answer_json(self, record: object) -> None:
        self._answer(json.dumps(record).encode(), "application/json")

    def _refuse(self, status: HTTPStatus, sentence: str) -> None:
        self._answer(f"{sentence}\n".encode(), "text/plain; charset=utf-8", status)

    def _answer(self, body: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK, *, policy: str = POLICY) -> None:
        self.send_response(status)
        for header, value in (
            ("Content-Type", kind),
            ("Content-Length", str(len(body))),
            ("Cache-Control", "no-store"),
            ("Content-Security-Policy", policy),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("Cross-Origin-Opener-Policy", "same-origin"),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
        ):
            self.send_header(header, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002  # the base class's name
        """Say nothing: the command prints what people need."""


def _number_asked_for(sequence: ShownSequence, digits: str) -> int | None:
    """Return the number that a browser means, whose numbers are floats; None where there is none."""
    return next((number for number in sequence.numbers if float(number) == float(digits)), None)


def _or_fault(show: Show) -> object:
    """Return the timing, or what is wrong with it in a form that the page shows."""
    try:
        return {} if show.timing is None else show.timing()
    except PsvideoError as fault:
        return {"missing": str(fault)}
