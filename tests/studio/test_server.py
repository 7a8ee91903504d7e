"""The studio as other programs and pages of this machine meet it."""

from __future__ import annotations

import http.client
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.request import urlopen

import pytest

from children import ran
from safenav.errors import UsageError
from safenav.studio.server import LARGEST, Guard, listening
from studio.serving import MINUTES, SCENARIOS, Page, Served, ServedAnew, visit

HELLO = SCENARIOS / "hello.yaml"


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with ServedAnew("run", HELLO, "--live") as found:
        yield found


def answer(served: Served, path: str, method: str = "GET", **headers: str) -> tuple[int, str]:
    connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=MINUTES)
    try:
        connection.request(method, path, headers=headers)
        response = connection.getresponse()
        return response.status, response.read().decode()
    finally:
        connection.close()


def test_the_page_comes_with_its_files_and_forbids_everything_else(served: Served) -> None:
    for name in ("", "page.js", "studio.js", "page.css", "schema.json"):
        with urlopen(served.address + name, timeout=MINUTES) as response:
            assert response.headers["Cross-Origin-Resource-Policy"] == "same-origin"
            assert "frame-ancestors 'none'" in response.headers["Content-Security-Policy"]
            assert "Access-Control-Allow-Origin" not in response.headers


def test_a_studio_listens_on_the_loopback_interface_only(served: Served) -> None:
    listening = Path("/proc/net/tcp")
    if not listening.exists():
        pytest.skip("asks Linux who listens where")
    port = f":{served.port:04X}"
    local = [line.split()[1] for line in listening.read_text().splitlines()[1:]]
    assert {entry.split(":")[0] for entry in local if entry.endswith(port)} == {"0100007F"}


def test_a_wrong_token_host_or_origin_is_refused(served: Served) -> None:
    path = served.address[served.address.index("/", 8) :]
    assert answer(served, "/")[0] == 404
    assert answer(served, "/guess/studio.js")[0] == 404
    assert answer(served, path, Host="rebound.example")[0] == 421
    assert answer(served, path, Origin="http://evil.example")[0] == 403
    assert answer(served, path)[0] == 200


@pytest.mark.parametrize("nonsense", [b"\r\n\r\n", b"GET\r\n\r\n", b"\xff / x\r\n\r\n"])
def test_nonsense_is_answered(served: Served, nonsense: bytes) -> None:
    with socket.create_connection(("127.0.0.1", served.port), MINUTES) as connection:
        connection.sendall(nonsense)
        assert b" 400 " in connection.recv(4096)


def test_a_path_outside_is_not_a_file_of_the_page(served: Served) -> None:
    base = served.address[served.address.index("/", 8) :]
    for path in ("../../etc/passwd", "..%2f..%2fpyproject.toml", "save/%2e%2e/page.py"):
        assert answer(served, base + path)[0] in (400, 404)


def test_a_large_request_is_refused_before_it_is_read(served: Served) -> None:
    path = served.address[served.address.index("/", 8) :] + "say"
    with socket.create_connection(("127.0.0.1", served.port), MINUTES) as connection:
        head = f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1:{served.port}\r\n"
        connection.sendall(f"{head}Content-Length: 50000000\r\n\r\n".encode())
        assert b" 413 " in connection.recv(4096)


def test_an_invalid_message_is_refused_and_the_next_one_served(served: Served) -> None:
    async def story(page: Page) -> None:
        for nonsense in ({"do": "fly"}, {"do": "speed", "value": "fast"}, {"do": "change"}):
            await page.say(str(nonsense.pop("do")), **nonsense)
            await page.hear(lambda m: m["is"] == "refused")
        await page.post(b"[" * 100_000)
        await page.hear(lambda m: m["is"] == "refused")
        await page.say("speed", value=64)

    visit(served.address, story)


def test_standard_input_cannot_be_watched() -> None:
    program = Path(sys.executable).with_name("safenav")
    done = ran([program, "run", "-", "--live"], input=HELLO.read_text())
    assert done.returncode == 2
    assert "needs a file" in done.stderr


def test_a_second_studio_takes_another_port(served: Served) -> None:
    with Served("run", HELLO, "--live") as other:
        assert other.port != served.port


def test_a_port_is_taken_before_it_is_served() -> None:
    """Two studios that start at the same moment were bound to one port, and one of them failed."""
    with listening(None) as first, listening(None) as second:
        taken = first.getsockname()[1]
        assert taken != second.getsockname()[1]
        with pytest.raises(UsageError, match="cannot listen on port"):
            listening(taken)


GUARD = Guard("secret", 7246)
OURS = {"Host": "127.0.0.1:7246"}


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        ("/secret/", OURS, None),
        ("/secret/", {"Host": "localhost:7246"}, None),
        ("/secret/events", {**OURS, "Origin": "http://127.0.0.1:7246"}, None),
        ("/secret/", {**OURS, "Sec-Fetch-Site": "same-origin"}, None),
        ("/", OURS, 404),
        ("/secrets/", OURS, 404),
        ("//secret/", OURS, 404),
        ("/secret/", {"Host": "127.0.0.1:80"}, 421),
        ("/secret/", {}, 421),
        ("/secret/events", {**OURS, "Origin": "http://evil.example"}, 403),
        ("/secret/events", {**OURS, "Origin": "null"}, 403),
        ("/secret/events", {**OURS, "Origin": "http://localhost:7246"}, 403),
        ("/secret/", {**OURS, "Sec-Fetch-Site": "cross-site"}, 403),
        ("/secret/say", {**OURS, "Content-Length": str(LARGEST + 1)}, 413),
        ("/secret/say", {**OURS, "Content-Length": "\xb2"}, 413),
        ("/secret/say", {**OURS, "Transfer-Encoding": "chunked"}, 413),
        ("/secret/say", {**OURS, "Content-Length": "9" * 5000}, 413),
    ],
)
def test_a_request_passes_or_is_refused(
    path: str, headers: dict[str, str], status: int | None
) -> None:
    refusal = GUARD.refusal(path, headers)
    assert (None if refusal is None else refusal[0]) == status
