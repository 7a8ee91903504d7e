"""``safenav catalogue``: robot models, capabilities and obstacle types."""

from __future__ import annotations

import json
from pathlib import Path

import click

from safenav.errors import ExitCode

EPILOG = """\b
Examples:
  safenav catalogue
  safenav catalogue --json
  safenav new team.yaml --template team && safenav catalogue team.yaml
\b
Exit codes:
  0  done   2  FILE is neither a scenario nor a catalogue
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path), required=False)
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON.")
def command(file: Path | None, as_json: bool) -> int:
    """List the robot models, capabilities and obstacle types that scenarios can use, and where
    each comes from. With FILE, a scenario or a catalogue file, also those that it adds."""
    from safenav.report.terminal.catalogue_tables import catalogue_data, catalogue_lines
    from safenav.scenario.reading.catalogue import built_in
    from safenav.scenario.reading.loader import load_catalogue

    found = built_in() if file is None else load_catalogue(file)
    if as_json:
        click.echo(json.dumps(catalogue_data(found), indent=2))
    else:
        click.echo("\n".join(catalogue_lines(found)))
    return ExitCode.OK
