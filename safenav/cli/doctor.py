"""``safenav doctor``: what is installed, and whether it works."""

from __future__ import annotations

import json

import click

from safenav.errors import ExitCode
from safenav.extras import install_command
from safenav.installation import Installation, examine

EPILOG = """\b
Examples:
  safenav doctor
  safenav doctor --json
  SAFENAV_CACHE=off safenav doctor
\b
Exit codes:
  0  scenarios can be run
  4  they cannot: the synthesizer or a package is missing, or gives wrong results
"""


@click.command(epilog=EPILOG)
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON.")
def command(as_json: bool) -> int:
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
