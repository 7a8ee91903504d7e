"""``safenav new``: write an example scenario."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

from safenav.cli.division import division_options
from safenav.errors import ExitCode, UsageError
from safenav.outfile import write_whole
from safenav.scenario.template import DEFAULT, TEMPLATES, template_text

if TYPE_CHECKING:
    from safenav.scenario.reading.maps.bare_map import Division

EPILOG = "\n".join(
    [
        "\b",
        "Templates:",
        *(f"  {name:8} {text}" for name, text in TEMPLATES.items()),
        "\b",
        "Examples:",
        "  safenav new lab.yaml && safenav run lab.yaml",
        "  safenav new team.yaml --template team",
        "  safenav new - --template minimal",
        "\b",
        "With a map of yours (image, ROS, MovingAI; extra 'maps'):",
        "  safenav new office.yaml --map office_map.yaml --side 0.5",
        "  safenav new floor.yaml --map floor.png --rows 20 --cols 30",
        "\b",
        "For robots of yours (docs/drive.md):",
        "  safenav new fleet.yaml --fleet lab.yaml",
        "\b",
        "Exit codes:",
        "  0  written   2  bad usage, or the file exists already",
    ]
)


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path), required=False)
@click.option(
    "--template",
    type=click.Choice(list(TEMPLATES)),
    default=DEFAULT,
    show_default=True,
    help="The template to write.",
)
@click.option(
    "--map",
    "map_file",
    type=click.Path(path_type=Path),
    help="Use this map (image, ROS, MovingAI) instead.",
)
@division_options
@click.option(
    "--fleet",
    type=click.Path(path_type=Path),
    metavar="SCENARIO",
    help="Write a fleet file for the robots of this scenario instead.",
)
@click.option("--force", is_flag=True, help="Replace FILE if it exists.")
def command(
    file: Path | None,
    template: str,
    map_file: Path | None,
    rows: int | None,
    cols: int | None,
    side: float | None,
    share: float | None,
    fleet: Path | None,
    force: bool,
) -> int:
    """Write a commented scenario to FILE (default: scenario.yaml, or fleet.yaml; -: standard
    output). It loads and runs as it is; change it from there."""
    if fleet is not None:
        return _new_fleet(file or Path("fleet.yaml"), fleet, force)
    file = file or Path("scenario.yaml")
    if map_file is not None:
        from safenav.scenario.reading.maps.bare_map import Division

        text = _on_map(map_file, file, Division(rows, cols, side, share))
        about = f"two robots on {map_file}"
    elif (rows, cols, side, share) != (None, None, None, None):
        raise UsageError("--rows, --cols, --side and --share go with --map")
    else:
        text, about = template_text(template), TEMPLATES[template]
    if not _written(text, file, force):
        return ExitCode.OK
    click.echo(f"{file}: {about}", err=True)
    click.echo(f"    draw it:    safenav draw {quote(str(file))}", err=True)
    click.echo(f"    run it:     safenav run {quote(str(file))}", err=True)
    schema = file.with_name("safenav.schema.json")
    if not schema.exists():
        click.echo(f"    in editors: safenav schema -o {quote(str(schema))}", err=True)
    return ExitCode.OK


def _written(text: str, file: Path, force: bool) -> bool:
    """Write a text; whether it is in a file now, not on standard output."""
    if str(file) == "-":
        click.echo(text, nl=False)
        return False
    write_whole(file, lambda part: part.write_text(text, encoding="utf-8"), replace=force)
    return True


def _new_fleet(file: Path, scenario: Path, force: bool) -> int:
    from safenav.fleet.fleet_file import template_text as fleet_text
    from safenav.scenario.reading.loader import load_scenario

    text = fleet_text(load_scenario(scenario))
    if not _written(text, file, force):
        return ExitCode.OK
    click.echo(f"{file}: how to reach the robots of {scenario}", err=True)
    names = f"{quote(str(scenario))} --fleet {quote(str(file))}"
    click.echo(f"    rehearse:   safenav drive {names} --rehearse", err=True)
    click.echo(f"    drive:      safenav drive {names}", err=True)
    return ExitCode.OK


def _on_map(map_file: Path, file: Path, division: Division) -> str:
    from safenav.scenario.beginning import scenario_on
    from safenav.scenario.reading.maps.bare_map import load_map, map_lines

    world = load_map(map_file, division)
    for note in world.notes:
        click.echo(f"warning: {note}", err=True)
    folder = Path() if str(file) == "-" else file.parent
    text = scenario_on(world, map_lines(map_file, division, folder), map_file.stem)
    if text is None:
        raise UsageError(
            f"{map_file}: fewer than four free regions are connected\n"
            "    try more regions, or --share 0.3: less of a region may then be blocked"
        )
    return text
