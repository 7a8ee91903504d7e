"""``safenav studio``: draw a scenario, run it, change its world while it runs."""

from __future__ import annotations

from pathlib import Path

import click

from safenav.errors import ExitCode

EPILOG = """\b
Examples:
  safenav studio
  safenav new lab.yaml && safenav studio lab.yaml
  safenav studio lab.yaml --folder . --no-browser
\b
The page is served to this machine only, at an address with a token. Ctrl-C ends the studio; it
also ends a minute after its last page was closed.
\b
Exit codes:
  0  ended   2  bad usage, or the extra 'studio' is not installed
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path), required=False)
@click.option(
    "--folder",
    type=click.Path(path_type=Path, file_okay=False, exists=True),
    help="Folder for scenarios and the maps and catalogues that they read; else that of FILE, "
    "or the current one.",
)
@click.option("--port", type=click.IntRange(1, 65535), help="Listen on this port.")
@click.option("--browser/--no-browser", default=True, help="Open the page in a browser.")
@click.option("--keep", is_flag=True, help="Continue when no page is open.")
def command(
    file: Path | None, folder: Path | None, port: int | None, browser: bool, keep: bool
) -> int:
    """Draw a scenario in a browser, run it, and change its world during the run: close a door,
    assign an objective. FILE is opened, or created on the first save; a folder lists its
    scenarios.
    """
    from safenav.studio.starting import start_studio

    start_studio(file, folder=folder, port=port, browser=browser, keep=keep)
    return ExitCode.OK
