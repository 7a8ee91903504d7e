"""``safenav studio``: draw a scenario, run it, change its world while it runs."""

from __future__ import annotations

from pathlib import Path

import click

from safenav.errors import ExitCode

EPILOG = """\b
Examples:
  safenav studio
  safenav studio scenarios/case_study_1.yaml
  safenav studio lab.yaml --folder maps --no-browser
\b
The page is served to this machine only, at an address with a token. Ctrl-C ends the studio; it
ends by itself a minute after its last page was closed.
\b
Exit codes:
  0  ended   2  bad usage, or the extra 'studio' is not installed
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path), required=False)
@click.option(
    "--folder",
    type=click.Path(path_type=Path, file_okay=False, exists=True),
    help="Where scenarios may be saved, and read maps and catalogues from.",
)
@click.option("--port", type=click.IntRange(1, 65535), help="Listen on this port.")
@click.option("--browser/--no-browser", default=True, help="Open the page in a browser.")
@click.option("--keep", is_flag=True, help="Go on when no page is open.")
def command(
    file: Path | None, folder: Path | None, port: int | None, browser: bool, keep: bool
) -> int:
    """Draw a scenario in a browser, run it, and close a door in front of a robot: the run goes on
    as it would in the world. FILE is opened, or created when it is saved."""
    from safenav.studio.starting import start_studio

    start_studio(file, folder=folder, port=port, browser=browser, keep=keep)
    return ExitCode.OK
