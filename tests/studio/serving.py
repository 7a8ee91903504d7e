"""A studio as a process, and pages that talk to it without a browser."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import Queue
from select import select
from threading import Thread
from typing import Any
from urllib.request import Request, urlopen

import warm
from safenav import check_trace

MINUTES = 60.0
"""What guards against a hang; no test waits so long."""


class Served:
    """``safenav ARGUMENTS`` until the block is left; ``address`` is what it printed."""

    def __init__(self, *arguments: str | Path, cwd: Path | None = None) -> None:
        output, end = os.pipe()
        environment = {**os.environ, "BROWSER": "/bin/true"}
        self.process = warm.started(*arguments, out=end, cwd=cwd, env=environment)
        os.close(end)
        self._output = os.fdopen(output)
        said = self._output.readline()
        found = re.search(r"http://\S+:(\d+)/(\S+)/", said)
        if found is None:
            with self._output:
                raise AssertionError(said + self._output.read())
        self.address, self.port, self.token = found[0], int(found[1]), found[2]

    def __enter__(self) -> Served:
        return self

    def __exit__(self, *_: object) -> None:
        os.kill(self.process, signal.SIGINT)
        with self._output:
            assert select([self._output], [], [], MINUTES)[0], "it does not end"
            said = self._output.read()
        assert "Traceback" not in said and "Error" not in said, said

    def request(self, head: str) -> socket.socket:
        """Return a connection that has sent a request; ``head`` may lack the end of the head."""
        connection = socket.create_connection(("127.0.0.1", self.port), MINUTES)
        connection.sendall(head.encode("latin-1"))
        return connection

    @contextmanager
    def opened(self) -> Iterator[Page]:
        """A page of the studio."""
        head = f"GET /{self.token}/events HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n\r\n"
        with self.request(head) as stream:
            stream.settimeout(None)
            page = Page(self.address)
            listening = Thread(target=page.listen, args=[stream])
            listening.start()
            try:
                yield page
            finally:
                stream.shutdown(socket.SHUT_RDWR)
                listening.join()


class Page:
    """What a page knows: the messages that it heard, in order."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.heard: list[dict[str, Any]] = []
        self._arrived: Queue[dict[str, Any]] = Queue()

    def listen(self, stream: socket.socket) -> None:
        """Take the messages of the stream, to its end."""
        with stream.makefile("rb") as lines, suppress(ConnectionError):
            for line in lines:
                if line.startswith(b"data: "):
                    self._arrived.put(json.loads(line[6:]))

    def say(self, does: str, **data: object) -> str | None:
        return self.post(json.dumps({"do": does, **data}).encode())

    def post(self, text: bytes) -> str | None:
        """Send a request and return the words that refuse it, if it is; that message is heard after
        those before it."""
        refused = json.loads(self.get("say", text))
        if refused is not None:
            self._arrived.put(refused)
        return refused and str(refused["message"])

    def hear(self, wanted: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """The next message that is wanted; all before it are kept in ``heard``."""
        while True:
            self.heard.append(self._arrived.get(timeout=MINUTES))
            if wanted(self.heard[-1]):
                return self.heard[-1]

    def refusal(self) -> str:
        """Return the words of the next refusal."""
        return str(self.hear(lambda m: m["is"] == "refused")["message"])

    def document(self, words: str) -> dict[str, Any]:
        """Wait for a text with these words."""
        return self.hear(lambda m: m["is"] == "document" and words in m["text"])

    def state(self, **wanted: object) -> dict[str, Any]:
        """Wait until the run has this state."""
        return self.hear(lambda m: m.get("state") and wanted.items() <= m["state"].items())

    def tick(self, number: int) -> None:
        """Wait for the lines of a tick."""
        self.hear(lambda m: m["is"] == "news" and m["news"]["last"] >= number)

    def begin(self) -> None:
        """Start another run, paused after its first tick."""
        self.say("speed", value=64)
        self.say("restart")
        self.state(phase="starting")
        self.say("step")
        self.tick(1)

    def sound(self) -> list[dict[str, Any]]:
        """The lines of the trace that the page saves, which the judge accepts."""
        lines = self.get("save/trace").decode().splitlines()
        assert check_trace(lines).findings == ()
        return [json.loads(line) for line in lines]

    def get(self, path: str, body: bytes | None = None) -> bytes:
        with urlopen(Request(self.address + path, body), timeout=MINUTES) as response:
            return bytes(response.read())
