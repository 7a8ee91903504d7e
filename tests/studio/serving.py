"""A studio as a process, and pages that talk to it without a browser."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from threading import Timer
from types import TracebackType
from typing import Any
from urllib.request import Request, urlopen

from warm import started

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"
MINUTES = 60.0
"""What guards against a hang; no test waits so long."""


class Served:
    """``safenav ARGUMENTS`` until the block is left; ``address`` is what it printed."""

    def __init__(self, *arguments: str | Path, cwd: Path | None = None) -> None:
        reading, writing = os.pipe()
        self._said = os.fdopen(reading, encoding="utf-8")
        environment = {**os.environ, "BROWSER": "/bin/true"}
        self.pid = self._start(writing, arguments, cwd, environment)
        os.close(writing)
        said = []
        for line in self._said:
            said.append(line)
            found = re.search(r"http://\S+/", line)
            if found is not None:
                self.address = found[0]
                return
        raise AssertionError("".join(said))

    def _start(
        self, out: int, arguments: Sequence[str | Path], cwd: Path | None, env: dict[str, str]
    ) -> int:
        return started(*arguments, out=out, cwd=cwd, env=env)

    @property
    def port(self) -> int:
        return int(self.address.split(":")[2].split("/")[0])

    def __enter__(self) -> Served:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        hangs = Timer(MINUTES, os.kill, (self.pid, signal.SIGKILL))
        hangs.start()
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGINT)
        with self._said as rest:
            said = rest.read()
        assert not hangs.finished.is_set(), "it did not end"
        hangs.cancel()
        assert "Traceback" not in said and "Error" not in said, said


class ServedAnew(Served):
    """The same as a program of its own, from its start to its interrupt."""

    def _start(
        self, out: int, arguments: Sequence[str | Path], cwd: Path | None, env: dict[str, str]
    ) -> int:
        program = [str(Path(sys.executable).with_name("safenav")), *map(str, arguments)]
        self._process = subprocess.Popen(
            program, stdout=out, stderr=subprocess.STDOUT, cwd=cwd, env=env
        )
        return self._process.pid

    def __exit__(self, *ended: Any) -> None:
        super().__exit__(*ended)
        self._process.wait(MINUTES)


class Page:
    """What a page knows: the messages that it heard, in order."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.heard: list[dict[str, Any]] = []
        self._arrived: asyncio.Queue[dict[str, Any]] = asyncio.Queue()

    async def listen(self, reader: asyncio.StreamReader) -> None:
        """Take the messages of the stream."""
        while line := await reader.readline():
            if line.startswith(b"data: "):
                self._arrived.put_nowait(json.loads(line[6:]))

    async def say(self, does: str, **data: object) -> None:
        await self.post(json.dumps({"do": does, **data}).encode())

    async def post(self, text: bytes) -> None:
        """Send a request; the message that refuses it is heard after those before it."""
        refused = json.loads(await self._ask("say", text))
        if refused is not None:
            self._arrived.put_nowait(refused)

    async def hear(self, wanted: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """The next message that is wanted; all before it are kept in ``heard``."""
        async with asyncio.timeout(MINUTES):
            while True:
                message = await self._arrived.get()
                self.heard.append(message)
                if wanted(message):
                    return message

    async def state(self, **wanted: object) -> dict[str, Any]:
        """Wait until the run stands so."""

        def stands(message: dict[str, Any]) -> bool:
            state = message.get("state") or {}
            return bool(state) and all(state[key] == value for key, value in wanted.items())

        return await self.hear(stands)

    async def tick(self, number: int) -> None:
        """Wait until a tick was told."""
        await self.hear(lambda m: m["is"] == "news" and m["news"]["last"] >= number)

    async def get(self, path: str) -> bytes:
        return await self._ask(path)

    async def _ask(self, path: str, body: bytes | None = None) -> bytes:
        def answer() -> bytes:
            with urlopen(Request(self.address + path, body), timeout=MINUTES) as response:
                return bytes(response.read())

        return await asyncio.to_thread(answer)


@asynccontextmanager
async def opened(address: str) -> AsyncIterator[Page]:
    """A page of the studio at an address."""
    host, path = address.removeprefix("http://").split("/", 1)
    name, port = host.split(":")
    reader, writer = await asyncio.open_connection(name, int(port), limit=2**26)
    writer.write(f"GET /{path}events HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
    assert b" 200 " in await reader.readline()
    page = Page(address)
    listening = asyncio.create_task(page.listen(reader))
    try:
        yield page
    finally:
        listening.cancel()
        writer.close()


def visit(address: str, story: Callable[[Page], Awaitable[None]]) -> None:
    """Let one page live through a story."""

    async def main() -> None:
        async with opened(address) as page:
            await story(page)

    asyncio.run(main())
