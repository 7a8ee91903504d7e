"""Start of a studio."""

from __future__ import annotations

import asyncio
import signal
from contextlib import suppress
from pathlib import Path

import click


def start_studio(
    file: Path | None,
    *,
    folder: Path | None = None,
    port: int | None = None,
    browser: bool = True,
    keep: bool = False,
) -> None:
    """Serve the editor until Ctrl-C. Raises UsageError if ``file`` or the port is not
    available."""
    from safenav.studio.editor import Editor

    _serve(lambda: Editor.of_file(file, folder), port, browser, keep)


def start_live(
    scenario: Path,
    *,
    seed: int | None = None,
    trace: Path | None = None,
    clock: str | None = None,
) -> None:
    """Serve the run of a scenario, without the editor, until Ctrl-C. Raises UsageError."""
    from safenav.studio.session import Studio

    _serve(lambda: Studio.of_run(scenario, seed, trace, clock), None, True, False)


def _serve(make: object, port: int | None, browser: bool, keep: bool) -> None:
    from safenav.studio.server import Server

    async def main() -> None:
        assert callable(make)
        server = Server(make(), port=port, keep=keep)
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with suppress(NotImplementedError):
                loop.add_signal_handler(number, server.stop)
        await server.serve(browser=browser, ready=_ready)

    asyncio.run(main())


def _ready(address: str) -> None:
    click.echo(f"studio: {address}")
    click.echo("    Ctrl-C ends it", err=True)
