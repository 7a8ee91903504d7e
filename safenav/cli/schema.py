"""``safenav schema``: the JSON Schema of scenarios, traces and fleet files."""

from __future__ import annotations

from pathlib import Path

import click

from safenav.cli.output import FILE
from safenav.errors import ExitCode

EPILOG = """\b
Examples:
  safenav schema
  safenav schema -o safenav.schema.json
  safenav schema --trace
\b
Editors that use yaml-language-server complete and check a scenario whose first
line names the schema (docs/editors.md):
  # yaml-language-server: $schema=safenav.schema.json
\b
Exit codes:
  0  done   2  the file cannot be written
"""


@click.command(epilog=EPILOG)
@click.option("-o", "--output", type=FILE, help="Write it to this file.")
@click.option("--trace", "of_trace", is_flag=True, help="The schema of a line of a trace.")
@click.option("--fleet", "of_fleet", is_flag=True, help="The schema of a fleet file.")
def command(output: Path | None, of_trace: bool, of_fleet: bool) -> int:
    """Print the JSON Schema (draft 2020-12) of scenario files, or of a trace's lines."""
    if of_trace:
        from safenav.trace.schema import schema_text
    elif of_fleet:
        from safenav.fleet.fleet_file import schema_text
    else:
        from safenav.scenario.reading.loader import schema_text

    if output is None or str(output) == "-":
        click.echo(schema_text(), nl=False)
    else:
        from safenav.outfile import write_bytes

        write_bytes(output, schema_text().encode())
    return ExitCode.OK
