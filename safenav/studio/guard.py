"""Access to the studio: for pages that it served itself alone.

The server listens on the loopback interface, which every program and every web page in a browser
of this machine can reach. So each request must contain the token of the address, use an address of
this server (else a foreign name that resolves to 127.0.0.1 would suffice: DNS rebinding), and, if a
browser reports the page that it comes from, come from a page of this server.
"""

from __future__ import annotations

import hmac
from collections.abc import Mapping

from msgspec import Struct

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
    """Judges requests. ``token``: of the address; ``port``: that is listened on."""

    token: str
    port: int

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}/{self.token}/"

    def refusal(self, path: str, headers: Mapping[str, str]) -> tuple[int, str] | None:
        """Return why a request is refused, as a status and a sentence; None if it may pass."""
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
