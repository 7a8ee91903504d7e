"""Only pages that the studio served itself may talk to it."""

import pytest

from safenav.studio.server import UPLOAD, Guard

GUARD = Guard("secret", 7246)
OURS = {"Host": "127.0.0.1:7246"}


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        ("/secret/", OURS, None),
        ("/secret/", {"Host": "localhost:7246"}, None),
        ("/secret/socket", {**OURS, "Origin": "http://127.0.0.1:7246"}, None),
        ("/secret/", {**OURS, "Sec-Fetch-Site": "same-origin"}, None),
        ("/", OURS, 404),
        ("/secre/", OURS, 404),
        ("/secrets/", OURS, 404),
        ("//secret/", OURS, 404),
        ("/secret/", {"Host": "127.0.0.1:80"}, 421),
        ("/secret/", {"Host": "evil.example:7246"}, 421),
        ("/secret/", {}, 421),
        ("/secret/socket", {**OURS, "Origin": "http://evil.example"}, 403),
        ("/secret/socket", {**OURS, "Origin": "null"}, 403),
        ("/secret/socket", {**OURS, "Origin": "http://localhost:7246"}, 403),
        ("/secret/", {**OURS, "Sec-Fetch-Site": "cross-site"}, 403),
        ("/secret/upload", {**OURS, "Content-Length": str(UPLOAD + 1)}, 413),
        ("/secret/upload", {**OURS, "Content-Length": "many"}, 413),
        ("/secret/upload", {**OURS, "Content-Length": "\xb2"}, 413),
        ("/secret/upload", {**OURS, "Content-Length": "9" * 5000}, 413),
    ],
)
def test_a_request_passes_or_is_refused(
    path: str, headers: dict[str, str], status: int | None
) -> None:
    refusal = GUARD.refusal(path, headers)
    assert (None if refusal is None else refusal[0]) == status
