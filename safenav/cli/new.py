"""``safenav new``: a scenario to begin with."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

import click

from safenav.errors import ExitCode
from safenav.scenario.template import DEFAULT, TEMPLATES, template_text, write_template

EPILOG = "\n".join(
    [
        "\b",
        "Templates:",
        *(f"  {name:8} {text}" for name, text in TEMPLATES.items()),
        "\b",
        "Examples:",
        "  safenav new floor.yaml && safenav run floor.yaml",
        "  safenav new team.yaml --template team",
        "  safenav new - --template minimal",
        "\b",
        "Exit codes:",
        "  0  written   2  bad usage, or the file exists already",
    ]
)


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path), default=Path("scenario.yaml"))
@click.option(
    "--template",
    type=click.Choice(list(TEMPLATES)),
    default=DEFAULT,
    show_default=True,
    help="What to begin with.",
)
@click.option("--force", is_flag=True, help="Replace FILE if it exists.")
def command(file: Path, template: str, force: bool) -> int:
    """Write a commented scenario to FILE (default: scenario.yaml; -: standard output). It loads
    and runs as it is; change it from there."""
    if str(file) == "-":
        click.echo(template_text(template), nl=False)
        return ExitCode.OK
    write_template(template, file, force)
    click.echo(f"{file}: {TEMPLATES[template]}", err=True)
    click.echo(f"    try it:     safenav run {quote(str(file))}", err=True)
    schema = file.with_name("safenav.schema.json")
    if not schema.exists():
        click.echo(f"    in editors: safenav schema -o {quote(str(schema))}", err=True)
    return ExitCode.OK
