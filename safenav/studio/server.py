"""The web server of the studio: files of the page, one web socket for each page, downloads.

It listens on the loopback interface, which every program and every web page in a browser of this
machine can reach. So each request must contain the token of the address, use an address of this
server (else a foreign name that resolves to 127.0.0.1 would suffice: DNS rebinding), and, if a
browser reports the page that it comes from, come from a page of this server. The ``Studio`` handles
the messages of all pages.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import resource
import secrets
import socket
import webbrowser
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from functools import cache
from importlib.resources import files
from pathlib import PurePath
from typing import Any

from aiohttp import WSMsgType, web
from msgspec import Struct

from safenav.errors import SafenavError, UsageError, file_words
from safenav.report.page.html import framed
from safenav.scenario.reading.loader import schema_text
from safenav.studio.scenario_folder import ReplaceError
from safenav.studio.session import Studio

UPLOAD = 8_000_000
"""Bytes of the largest upload."""

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
"""The policy of a self-contained page that may not send requests to the studio."""


class Guard(Struct, frozen=True):
    """Accepts or refuses requests. ``token``: of the address; ``port``: of the server."""

    token: str
    port: int

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}/{self.token}/"

    def refusal(self, path: str, headers: Mapping[str, str]) -> tuple[int, str] | None:
        """Return why a request is refused, as a status and a sentence; None if it is accepted."""
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
        length = headers.get("Content-Length", "0")
        if not length.isdigit() or int(length) > UPLOAD:
            return 413, f"that is too large: at most {UPLOAD // 1_000_000} MB"
        return None


PORT = 7246
PORTS = 20
"""Number of ports that are tried, starting with ``PORT``."""
BACKLOG = 2048
"""Maximum number of connections that wait to be accepted."""

PAGES = 64
"""Maximum number of open pages."""

ABANDONED = 60.0
"""Seconds after the last page was closed until the studio ends."""

BEHIND = 2000
"""Unsent messages after which a page is disconnected; it then reconnects."""

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Server:
    """Serves one studio. ``keep``: continue without any page."""

    def __init__(
        self, studio: Studio, *, port: int | None, keep: bool, abandoned: float = ABANDONED
    ) -> None:
        self.studio = studio
        self._keep = keep
        self._abandoned = abandoned
        self._socket = listening(port)
        self.guard = Guard(secrets.token_urlsafe(24), self._socket.getsockname()[1])
        self._over = asyncio.Event()
        self._had_pages = False

    async def serve(self, *, browser: bool, ready: Callable[[str], None]) -> None:
        """Serve until ``stop``, or until the last page has been closed for a while."""
        _allow_many_connections()
        app = web.Application(middlewares=[self._guarded], client_max_size=UPLOAD)
        base = f"/{self.guard.token}"
        app.router.add_get(f"{base}/", self._page)
        app.router.add_get(f"{base}/socket", self._socket_of)
        app.router.add_get(f"{base}/save/{{name}}", self._download)
        app.router.add_post(f"{base}/upload", self._upload)
        app.router.add_get(f"{base}/{{name}}", self._file)
        runner = web.AppRunner(app, access_log=None, handle_signals=False, shutdown_timeout=1.0)
        await runner.setup()
        await web.SockSite(runner, self._socket, backlog=BACKLOG).start()
        ready(self.guard.address)
        if browser:
            with suppress(Exception):
                await asyncio.to_thread(webbrowser.open, self.guard.address)
        watch = asyncio.create_task(self._watch())
        try:
            await self._over.wait()
        finally:
            watch.cancel()
            await self.studio.close()
            await runner.cleanup()

    def stop(self) -> None:
        """End the server."""
        self._over.set()

    async def _watch(self) -> None:
        """End when no page has been open for a while."""
        since = None
        loop = asyncio.get_running_loop()
        while not self._keep:
            await asyncio.sleep(min(1.0, self._abandoned / 4))
            if self.studio.pages or not self._had_pages:
                since = None
                continue
            since = since or loop.time()
            if loop.time() - since >= self._abandoned:
                self.stop()
                return

    @web.middleware
    async def _guarded(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        refusal = self.guard.refusal(request.path, request.headers)
        if refusal is not None:
            status, why = refusal
            response = web.Response(status=status, text=why + "\n", headers=HEADERS)
            response.force_close()
            return response
        try:
            response_ = await handler(request)
        except web.HTTPException as error:
            error.headers.update(HEADERS)
            raise
        except SafenavError as error:
            return web.Response(status=400, text=str(error), headers=HEADERS)
        if not response_.prepared:
            for header, value in HEADERS.items():
                response_.headers.setdefault(header, value)
        return response_

    async def _page(self, request: web.Request) -> web.StreamResponse:
        del request
        return web.Response(text=page(self.studio.title), content_type="text/html")

    async def _file(self, request: web.Request) -> web.StreamResponse:
        name = request.match_info["name"]
        if name not in FILES:
            raise web.HTTPNotFound(text="there is no such file\n")
        return web.Response(text=asset(name), content_type=FILES[name])

    async def _download(self, request: web.Request) -> web.StreamResponse:
        name = request.match_info["name"]
        made = await self.studio.made(name)
        if made is None:
            raise web.HTTPNotFound(text="nothing to save yet\n")
        file, content, kind = made
        if name == "3d":  # shown as a page of its own
            headers = {"Content-Security-Policy": APART}
            return web.Response(body=content, content_type=kind, headers=headers)
        disposition = f'attachment; filename="{PurePath(file).name}"'
        headers = {"Content-Disposition": disposition}
        return web.Response(body=content, content_type=kind, headers=headers)

    async def _upload(self, request: web.Request) -> web.StreamResponse:
        name = PurePath(request.query.get("name", "upload")).name
        content = await request.read()
        await self.studio.uploaded(name, content)
        return web.Response()

    async def _socket_of(self, request: web.Request) -> web.StreamResponse:
        if len(self.studio.pages) >= PAGES:
            raise web.HTTPServiceUnavailable(text=f"{PAGES} pages are already open\n")
        page_ = web.WebSocketResponse(max_msg_size=UPLOAD, heartbeat=20.0, compress=False)
        await page_.prepare(request)
        queue: asyncio.Queue[str | None] = asyncio.Queue(BEHIND)
        self._had_pages = True
        self.studio.join(queue)
        writer = asyncio.create_task(_write(page_, queue))
        try:
            async for message in page_:
                if message.type is not WSMsgType.TEXT:
                    break
                await self._take(message.data, queue)
        finally:
            self.studio.leave(queue)
            writer.cancel()
        return page_

    async def _take(self, text: str, queue: asyncio.Queue[str | None]) -> None:
        """Handle a message of a page; errors in it are sent to that page alone."""
        try:
            data = json.loads(text)
            if not isinstance(data, dict):
                raise UsageError("a message is an object")
            await self.studio.take(data)
        except ReplaceError as error:
            _put(queue, {"is": "exists", "name": data.get("name"), "message": str(error)})
        except (SafenavError, ValueError, RecursionError) as error:
            _put(queue, {"is": "refused", "message": str(error)})
        except OSError as error:  # a name that is too long, say
            _put(queue, {"is": "refused", "message": file_words(error)})


async def _write(page_: web.WebSocketResponse, queue: asyncio.Queue[str | None]) -> None:
    """Send queued messages, until the page falls too far behind."""
    with suppress(ConnectionError):
        while (text := await queue.get()) is not None:
            await page_.send_str(text)
        await page_.close()


def _put(queue: asyncio.Queue[str | None], data: dict[str, Any]) -> None:
    with suppress(asyncio.QueueFull):
        queue.put_nowait(json.dumps(data))


def listening(port: int | None) -> socket.socket:
    """Return a socket on a port of the loopback interface; None: the first free one from ``PORT``
    on, else any. Raises UsageError if there is none."""
    wanted = [port] if port is not None else [*range(PORT, PORT + PORTS), 0]
    for number in wanted:
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(("127.0.0.1", number))
            listener.listen(BACKLOG)  # before this, another process can bind the same port
        except OSError as error:
            listener.close()
            failure = error
        else:
            return listener
    raise UsageError(
        f"cannot listen on port {port}: {failure.strerror}\n    leave --port out to get another"
    )


def _allow_many_connections() -> None:
    """Raise the limit of open files to 8192 if the system allows it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = 8192 if hard == resource.RLIM_INFINITY else min(8192, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        with suppress(ValueError, OSError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


FILES = {
    "studio.js": "text/javascript",
    "studio.css": "text/css",
    "schema.json": "application/json",
}


def page(title: str) -> str:
    """Return the document that loads the page's program and style."""
    style = '<link rel="stylesheet" href="studio.css">'
    return framed(title, style, '<script src="studio.js"></script>')


@cache
def asset(name: str) -> str:
    """Return the text of a file of the page, or of the schema of its editor."""
    if name == "schema.json":
        return schema_text()
    return files("safenav.studio").joinpath("assets", name).read_text(encoding="utf-8")
