"""Sessions of the studio: a scenario, a run, and the pages that show them.

Pages have no state of their own. They show the state of this module, so two pages agree and a
reload loses no data. All messages of pages enter by ``take``; all messages to pages leave by
``tell``. This module also makes the downloads of a run: a replay, a 3D replay, a bundle.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from safenav.certify.bundle import bundle_of_trace
from safenav.errors import UsageError, needing
from safenav.report.page.html import page_of
from safenav.scenario.model import Catalogue
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.yaml.findings import STDIN
from safenav.studio.drawing import palette
from safenav.studio.live import StudioRun
from safenav.studio.process import RunOrder
from safenav.trace.file import read_bytes


def replay_page(trace: bytes, name: str) -> bytes:
    return page_of(read_bytes(trace, name), name).encode()


def page_3d(trace: bytes, name: str) -> bytes:
    """Return a run in 3D as an HTML page. Raises UsageError without the extra ``motion``."""
    with needing("the 3D page", "motion"):
        from safenav.motion.making import motion_of
    from safenav.report.page.motion import page3d_of

    read = read_bytes(trace, name)
    return page3d_of(read, name, motion_of(read)).encode()


def bundle(trace: bytes, name: str) -> bytes:
    """Return a zipped bundle: a run, its proofs and a checker. Raises SafenavError if refused."""
    with TemporaryDirectory() as folder:
        out = Path(folder) / "bundle.zip"
        bundle_of_trace(trace, name, out)
        return out.read_bytes()


Saver = Callable[[bytes, str], bytes]

SAVERS: Mapping[str, tuple[Saver, str, str]] = {
    "trace": (lambda trace, _: trace, ".jsonl", "application/jsonl"),
    "replay": (replay_page, ".html", "text/html"),
    "3d": (page_3d, ".3d.html", "text/html"),
    "bundle": (bundle, ".zip", "application/zip"),
}
"""Functions that make files, with suffixes and media types, by names in addresses."""


Message = Mapping[str, Any]
Page = Callable[[str], None]
"""A function that sends a message to an open page."""
Made = tuple[str, bytes, str]
"""A download: file name, content and media type."""


class ReplaceError(UsageError):
    """A file that a save would replace, so the user must decide."""


class Studio:
    """A studio session that shows a run; ``Editor`` adds the editor."""

    def __init__(self, order: RunOrder, catalogue: Catalogue, *, trace: Path | None = None) -> None:
        self.pages: set[Page] = set()
        self.run: StudioRun | None = None
        self._order = order
        self._catalogue = catalogue
        self._trace = trace
        self._speed = 4.0
        self._starting = asyncio.Lock()
        self._does: dict[str, Callable[[Message], Awaitable[None]]] = {
            **dict.fromkeys(("play", "pause", "step"), self._direct),
            "speed": self._set_speed,
            "restart": self._restart,
            "end": self._end,
            "change": self._change,
        }

    @classmethod
    def of_run(
        cls, scenario: Path, seed: int | None, trace: Path | None, clock: str | None = None
    ) -> Studio:
        """Return a session for a scenario's run, without an editor. Raises InputError for an
        invalid scenario, UsageError for standard input, which a restart could not read again."""
        if str(scenario) == STDIN:
            raise UsageError("a live run needs a file: standard input can be read only once")
        catalogue = load_scenario(scenario).catalogue
        text = scenario.read_text(encoding="utf-8-sig")
        order = RunOrder(text, str(scenario), seed=seed, clock=clock)
        return cls(order, catalogue, trace=trace)

    @property
    def title(self) -> str:
        """The page's title until it receives a run."""
        return f"{Path(self._order.file).stem}: safenav studio"

    def join(self, page: Page) -> None:
        """Add an opened page and send it the whole state."""
        self.pages.add(page)
        for data in self._everything():
            page(json.dumps(data))

    def leave(self, page: Page) -> None:
        """Remove a closed page."""
        self.pages.discard(page)

    def tell(self, data: Message) -> None:
        """Send a message to all pages."""
        text = json.dumps(data, separators=(",", ":"))
        for page in self.pages:
            page(text)

    async def take(self, data: Message) -> None:
        """Execute the request of a page. Raises SafenavError for an impossible one."""
        wanted = self._does.get(str(data.get("do")))
        if wanted is None:
            raise UsageError(f"unknown request '{str(data.get('do'))[:40]}'")
        await wanted(data)

    async def made(self, name: str) -> Made | None:
        """Return the file ``name``, made from the run for the user, or None."""
        if self.run is None or not self.run.lines or name not in SAVERS:
            return None
        make, ending, kind = SAVERS[name]
        stem = Path(self.run.order.file).stem
        content = await asyncio.to_thread(make, self.run.trace, f"{stem}.jsonl")
        return f"{stem}{ending}", content, kind

    async def close(self) -> None:
        """End the run."""
        if self.run is not None:
            await self.run.end()

    def _everything(self) -> list[dict[str, Any]]:
        """Return messages that contain the whole state, for a newly opened page."""
        messages = [self._hello()]
        if self.run is not None:
            messages.append({"is": "run", "run": self.run.whole, "state": self.run.state})
        return messages

    def _hello(self) -> dict[str, Any]:
        """Return the message that describes this studio."""
        return {"is": "hello", "editor": False, "palette": palette(self._catalogue)}

    def _ordered(self) -> RunOrder:
        """Return the scenario and settings of the next run. Raises InputError if it cannot run."""
        return self._order

    async def _begin(self) -> StudioRun:
        """Start a run that replaces the previous one."""
        async with self._starting:
            order = self._ordered()
            if self.run is not None:
                await self.run.end()
            run = StudioRun(order, self.tell, speed=self._speed, trace=self._trace)
            await run.start()  # if this raises, pages keep the previous run
            self.run = run
            return run

    async def _direct(self, data: Message) -> None:
        """Let the run play, pause or step. The first request to play or step starts a run."""
        if self.run is None and data["do"] == "pause":
            return
        run = self.run or await self._begin()
        {"play": run.play, "pause": run.pause, "step": run.step}[data["do"]]()

    async def _set_speed(self, data: Message) -> None:
        value = data.get("value")
        if not isinstance(value, int | float) or not 0 < value <= 1000:
            raise UsageError("expected a speed in ticks per second, at most 1000")
        self._speed = float(value)
        if self.run is not None:
            self.run.set_speed(self._speed)

    async def _restart(self, data: Message) -> None:
        run = await self._begin()
        if data.get("play"):
            run.play()

    async def _end(self, _: Message) -> None:
        if self.run is not None:
            await self.run.end()

    async def _change(self, data: Message) -> None:
        if self.run is None:
            raise UsageError("no run has started, so there is no world to change")
        self.run.change({key: value for key, value in data.items() if key != "do"})
