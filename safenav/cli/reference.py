"""``safenav schema``, ``safenav catalogue``, ``safenav doctor``: what files may contain, and what
is installed."""

from __future__ import annotations

import json
from pathlib import Path

import click

from safenav.cli import options
from safenav.errors import ExitCode, UsageError
from safenav.extras import install_command
from safenav.installation import Installation, examine
from safenav.outfile import write_out

SCHEMA_EPILOG = """\b
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

CATALOGUE_EPILOG = """\b
Examples:
  safenav catalogue
  safenav catalogue --json
  safenav new team.yaml --template team && safenav catalogue team.yaml
\b
Exit codes:
  0  done   2  FILE is neither a scenario nor a catalogue
"""

DOCTOR_EPILOG = """\b
Examples:
  safenav doctor
  safenav doctor --json
  SAFENAV_CACHE=off safenav doctor
\b
Exit codes:
  0  scenarios can be run
  4  they cannot: the synthesizer or a package is missing, or gives wrong results
"""


@click.command(epilog=SCHEMA_EPILOG)
@click.option("-o", "--output", type=options.JSON, help="Write it to this file.")
@click.option("--trace", "of_trace", is_flag=True, help="The schema of a line of a trace.")
@click.option("--fleet", "of_fleet", is_flag=True, help="The schema of a fleet file.")
def schema(output: Path | None, of_trace: bool, of_fleet: bool) -> int:
    """Print the JSON Schema (draft 2020-12) of scenario files, trace lines or fleet files."""
    if of_trace and of_fleet:
        raise UsageError("--trace and --fleet are two schemas: give one of them")
    if of_trace:
        from safenav.trace.schema import schema_text
    elif of_fleet:
        from safenav.fleet.fleet_file import schema_text
    else:
        from safenav.scenario.reading.loader import schema_text

    write_out(output or Path("-"), schema_text())
    return ExitCode.OK


@click.command(epilog=CATALOGUE_EPILOG)
@click.argument("file", type=options.INPUT, required=False)
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON.")
def catalogue(file: Path | None, as_json: bool) -> int:
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


@click.command(epilog=DOCTOR_EPILOG)
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON.")
def doctor(as_json: bool) -> int:
    """List versions, extras and cache, and test the synthesizer."""
    found = examine()
    if as_json:
        click.echo(json.dumps(found.data(), indent=2))
    else:
        _tell(found)
    return ExitCode.OK if found.usable else ExitCode.INTERNAL


def _tell(found: Installation) -> None:
    _line(True, "safenav", f"{found.safenav} in {found.location}")
    _line(True, "Python", f"{found.python} on {found.platform}")
    for package in found.packages:
        if package.version is not None:
            _line(True, package.name, package.version)
        elif package.extra is None:
            _line(False, package.name, f"missing: {install_command()}")
        else:
            advice = f"for {package.purpose}: {install_command(package.extra)}"
            _line(None, package.name, f"not installed; {advice}")
    slugs, cache = found.slugs, found.cache
    if slugs.path is not None:
        version = slugs.version or "not safenav's own"
        _line(True, "slugs", f"{version}, {slugs.path} ({slugs.chosen_by})")
    if slugs.problem is not None:
        _line(False, "slugs", slugs.problem)
    else:
        _line(True, "slugs", f"synthesizes; its strategy passes the check ({slugs.seconds:.2f} s)")
    if cache.directory is None:
        _line(None, "cache", f"off ({cache.chosen_by})")
    else:
        used = f"{cache.entries} results, {cache.bytes / 2**20:.1f} MiB"
        state = cache.problem or f"writable, {used}"
        _line(cache.problem is None or None, "cache", f"{cache.directory} ({state})")


def _line(good: bool | None, what: str, text: str) -> None:
    """Print one line of the report. ``good``: None for a note about something optional."""
    mark, colour = {True: ("ok", "green"), False: ("wrong", "red"), None: ("note", "yellow")}[good]
    click.echo(f"{click.style(mark.ljust(6), fg=colour)} {what:<12} {text}")
