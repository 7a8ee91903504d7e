"""The web server of the studio. It serves the page's files, a stream of events for each page,
requests of pages (POST) and downloads. Each connection serves one request.

It listens on the loopback interface, which every program and every web page in a browser of this
machine can reach. So each request must contain the token of the address and use an address of this
server (otherwise a foreign name that resolves to 127.0.0.1 would suffice: DNS rebinding). If a
browser reports the page of origin, this must be a page of this server. The ``Studio`` handles the
messages of all pages.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import re
import secrets
import signal
import socket
import threading
import time
import webbrowser
from collections.abc import Mapping
from contextlib import suppress
from http import HTTPStatus
from http.client import HTTPException, parse_headers
from io import BytesIO
from typing import Any
from urllib.parse import unquote, urlsplit

import click
from msgspec import Struct

from safenav.errors import SafenavError, UsageError, file_words
from safenav.report.page.html import asset, framed
from safenav.scenario.language import ScenarioKeys
from safenav.scenario.model import Scenario
from safenav.scenario.yaml.keys import schema_text
from safenav.studio.live import WatchedRun
from safenav.studio.process import RunOrder
from safenav.studio.session import ReplaceError, Studio
from safenav.trace.records import Record

LARGEST = 8_000_000
"""Maximum bytes of a request; the largest ones send an edited text."""
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'"
    ),
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}

APART = (
    "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:; frame-ancestors 'none'"
)
"""The policy of self-contained pages, which must not send requests to the studio."""


class Guard(Struct, frozen=True):
    """The check of requests by the address's ``token`` and the server's ``port``."""

    token: str
    port: int

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}/{self.token}/"

    def refusal(self, path: str, headers: Mapping[str, str]) -> tuple[int, str] | None:
        """Return status and sentence of the refusal of a request; None if it is accepted."""
        hosts = {f"127.0.0.1:{self.port}", f"localhost:{self.port}"}
        host = headers.get("Host", "")
        if host not in hosts:
            return 421, "this address is not the studio's"
        origin = headers.get("Origin")
        if origin is not None and origin != f"http://{host}":
            return 403, "requests from other origins are refused"
        if headers.get("Sec-Fetch-Site", "none") in ("cross-site", "same-site"):
            return 403, "requests from other origins are refused"
        token = path.split("/", 2)[1] if path.startswith("/") else ""
        if not hmac.compare_digest(token.encode(), self.token.encode()):
            return 404, "open the address that 'safenav studio' printed: it holds a token"
        length = (
            "unknown" if headers.get("Transfer-Encoding") else headers.get("Content-Length", "0")
        )
        if not re.fullmatch("[0-9]{1,18}", length) or int(length) > LARGEST:
            return 413, f"the request has no length or is larger than {LARGEST // 1_000_000} MB"
        return None


PORT = 7246
PORTS = 20
"""Number of ports to try, from ``PORT`` on."""
PATIENCE = 30.0
"""Seconds within which a connection must send the head of its request."""


class Answer(Struct, frozen=True):
    """The response to a request. ``headers`` take precedence over those of ``HEADERS``."""

    status: int
    content: bytes = b""
    kind: str = "text/plain"
    headers: Mapping[str, str] = {}

    @property
    def head(self) -> bytes:
        kind = f"{self.kind}; charset=utf-8" if self.kind.startswith("text/") else self.kind
        own = {"Content-Type": kind, "Connection": "close"}
        if self.kind != EVENTS:
            own["Content-Length"] = str(len(self.content))
        lines = (f"{name}: {value}" for name, value in {**HEADERS, **own, **self.headers}.items())
        status = HTTPStatus(self.status)
        return "\r\n".join((f"HTTP/1.1 {status} {status.phrase}", *lines, "", "")).encode("latin-1")


EVENTS = "text/event-stream"
MOST_UNSENT = 64_000_000  # maximum bytes kept for a page that does not read


class Server:
    """The server of a studio."""

    def __init__(self, studio: Studio, *, port: int | None) -> None:
        self.studio = studio
        self._socket = listening(port)
        self.guard = Guard(secrets.token_urlsafe(24), self._socket.getsockname()[1])
        self._over = asyncio.Event()
        self._connections: set[asyncio.Task[None]] = set()

    async def serve(self, *, browser: bool) -> None:
        """Serve until ``stop``."""
        serving = await asyncio.start_server(self._connected, sock=self._socket)
        if browser:
            with suppress(Exception):
                await asyncio.to_thread(webbrowser.open, self.guard.address)
        try:
            await self._over.wait()
        finally:
            await self.studio.close()
            serving.close()
            for connection in self._connections:
                connection.cancel()
            await asyncio.gather(*self._connections, return_exceptions=True)

    def stop(self) -> None:
        """End the server."""
        self._over.set()

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer a connection's only request."""
        task = asyncio.current_task()
        assert task is not None
        self._connections.add(task)
        try:
            # A server that ends cancels its connections.
            with suppress(
                *(ConnectionError, asyncio.IncompleteReadError),
                *(TimeoutError, asyncio.CancelledError),
            ):
                answer = await self._request(reader)
                writer.write(answer.head + answer.content)
                await writer.drain()
                if answer.kind == EVENTS:
                    await self._stream(reader, writer)
        finally:
            self._connections.discard(task)
            writer.close()

    async def _request(self, reader: asyncio.StreamReader) -> Answer:
        """Read a request. Return the response."""
        try:
            async with asyncio.timeout(PATIENCE):
                head = await reader.readuntil(b"\r\n\r\n")
            first, _, rest = head.partition(b"\r\n")
            method, target, _ = first.decode("ascii").split(" ")
            headers: Mapping[str, str] = parse_headers(BytesIO(rest))  # type: ignore[assignment]
        except (asyncio.LimitOverrunError, HTTPException, ValueError):
            return Answer(400, b"that is no request\n")
        address = urlsplit(target)
        refusal = self.guard.refusal(address.path, headers)
        if refusal is not None:
            return Answer(refusal[0], (refusal[1] + "\n").encode())
        body = await reader.readexactly(int(headers.get("Content-Length", "0")))
        path = address.path.removeprefix(f"/{self.guard.token}").removeprefix("/")
        try:
            if method == "POST" and path == "say":
                refused = json.dumps(await self._take(body))
                return Answer(200, refused.encode(), "application/json")
            return await self._got(unquote(path))
        except SafenavError as error:
            return Answer(400, str(error).encode())

    async def _got(self, path: str) -> Answer:
        if path == "":
            return Answer(200, page(self.studio.title).encode(), "text/html")
        if path in FILES:
            text = schema_text(ScenarioKeys) if path == "schema.json" else asset(path)
            return Answer(200, text.encode(), FILES[path])
        if path == "events":
            return Answer(200, kind=EVENTS)
        if not path.startswith("save/"):
            return Answer(404, b"there is no such file\n")
        made = await self.studio.made(path.removeprefix("save/"))
        if made is None:
            return Answer(404, b"nothing to save yet\n")
        file, content, kind = made
        if path == "save/3d":  # shown as a separate page
            return Answer(200, content, kind, {"Content-Security-Policy": APART})
        name = re.sub(r"[^ !#-~]", "_", file)
        headers = {"Content-Disposition": f'attachment; filename="{name}"'}
        return Answer(200, content, kind, headers)

    async def _stream(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Send the messages of the studio to a page until it closes."""

        def send(text: str) -> None:
            if writer.transport.get_write_buffer_size() > MOST_UNSENT:
                writer.transport.abort()  # the page no longer reads; a live one reconnects
            writer.write(f"data: {text}\n\n".encode())

        self.studio.join(send)
        try:
            await reader.read()
        finally:
            self.studio.leave(send)

    async def _take(self, text: bytes) -> dict[str, Any] | None:
        """Execute the request of a page. Return a message if it is refused, else None."""
        data: Any = None
        try:
            data = json.loads(text)
            if not isinstance(data, dict):
                raise UsageError("expected a JSON object")
            await self.studio.take(data)
        except ReplaceError as error:
            return {"is": "exists", "name": data.get("name"), "message": str(error)}
        except (SafenavError, ValueError, RecursionError) as error:
            return {"is": "refused", "message": str(error)}
        except OSError as error:  # for example, a name that is too long
            return {"is": "refused", "message": file_words(error)}
        return None


def listening(port: int | None) -> socket.socket:
    """Return a socket on a port of the loopback interface (None: the first free port from ``PORT``
    on, else any). Raises UsageError if none is free."""
    failure: OSError | None = None
    for number in [port] if port is not None else [*range(PORT, PORT + PORTS), 0]:
        try:  # before the socket listens, another process can bind this port
            return socket.create_server(("127.0.0.1", number))
        except OSError as error:
            failure = error
    assert failure is not None
    raise UsageError(
        f"cannot listen on port {port}: {failure.strerror}\n    leave --port out to get another"
    )


FILES = {
    "page.js": "text/javascript",
    "studio.js": "text/javascript",
    "page.css": "text/css",
    "schema.json": "application/json",
}


def page(title: str) -> str:
    """Return the document that loads the page's program and style."""
    style = '<link rel="stylesheet" href="page.css">'
    programs = ("page.js", "studio.js")
    return framed(title, style, *(f'<script src="{name}"></script>' for name in programs))


def serve(studio: Studio, port: int | None = None, *, browser: bool = True) -> None:
    """Serve a studio until Ctrl-C. Raises UsageError if the port is unavailable."""

    async def served() -> None:
        server = Server(studio, port=port)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            asyncio.get_running_loop().add_signal_handler(number, server.stop)
        click.echo(f"studio: {server.guard.address}\n    Ctrl-C ends it")
        await server.serve(browser=browser)

    asyncio.run(served())


_PAUSE = 0.2
_GONE = 2.0
"""Seconds without an open page after which ``wait`` ends; a reload takes less."""


class LiveView(Studio):
    """A listener that shows a running mission in a browser.

    ::

        with LiveView(scenario) as view:
            Mission(scenario, world=fleet, listeners=[view]).run()
            view.wait()

    Pages follow the run and can step back in it, but change nothing. ``browser``: whether to open
    one; ``address``: the page's address, once the view has been entered. Entering raises UsageError
    if the port is unavailable.
    """

    def __init__(
        self, scenario: Scenario, *, port: int | None = None, browser: bool = True
    ) -> None:
        order = RunOrder("", scenario.source or f"{scenario.name}.yaml", seed=scenario.seed)
        super().__init__(order, scenario.catalogue)
        self.address = ""
        self.run = self._watched = WatchedRun(order, self.tell, trace=None)
        self._port = port
        self._browser = browser

    def __enter__(self) -> LiveView:
        self._server = Server(self, port=self._port)
        self._loop = asyncio.new_event_loop()
        self.address = self._server.guard.address
        serving = self._server.serve(browser=self._browser)
        self._thread = threading.Thread(
            target=self._loop.run_until_complete, args=[serving], name="safenav live", daemon=True
        )
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._server.stop)
        self._thread.join()
        self._loop.close()

    def __call__(self, record: Record) -> None:
        """Take the next line of the trace, in the thread of the mission."""
        with suppress(RuntimeError):  # the view has been left, so the loop is closed
            self._loop.call_soon_threadsafe(self._watched.hear, record)

    def wait(self) -> None:
        """Serve until the last page has been closed or Ctrl-C."""
        last = time.monotonic()
        with suppress(KeyboardInterrupt):
            while self._thread.is_alive() and time.monotonic() - last < _GONE:
                time.sleep(_PAUSE)
                if self.pages:
                    last = time.monotonic()

    async def take(self, _: Mapping[str, Any]) -> None:
        raise UsageError("this page only shows the run; the program with the mission controls it")

    def _hello(self) -> dict[str, Any]:
        return {**super()._hello(), "watches": True}
