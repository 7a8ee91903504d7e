"""``safenav new``: write an example scenario."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

import click

from safenav.cli import options, warn
from safenav.errors import ExitCode, UsageError
from safenav.fleet.template import template_text as fleet_text
from safenav.outfile import write_out
from safenav.scenario.beginning import DEFAULT, TEMPLATES, scenario_on, template_text
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.reading.maps.bare_map import Division, load_map, map_lines

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
        "With your own map (image, ROS, MovingAI; extra 'maps'):",
        "  safenav new office.yaml --map office_map.yaml --side 0.5",
        "  safenav new floor.yaml --map floor.png --rows 20 --cols 30",
        "\b",
        "For your own robots (docs/drive.md):",
        "  safenav new fleet.yaml --fleet lab.yaml",
        "\b",
        "Exit codes:",
        "  0  written   2  bad usage, or the file already exists",
    ]
)


@click.command(epilog=EPILOG)
@click.argument("file", type=options.INPUT, required=False)
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
    type=options.INPUT,
    help="Use this map (image, ROS, MovingAI) instead.",
)
@options.division
@click.option(
    "--fleet",
    type=options.INPUT,
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
    output). It runs unchanged; edit it from there."""
    if file is not None and file.suffix.lower() in {*options.KINDS} - {".yaml", ".yml"}:
        raise UsageError(f"{file}: the name of a scenario or fleet file ends in .yaml")
    if fleet is not None:
        return _new_fleet(file or Path("fleet.yaml"), fleet, force)
    file = file or Path("scenario.yaml")
    if map_file is not None:
        text = _on_map(map_file, file, Division(rows, cols, side, share))
        about = f"two robots on {map_file}"
    elif (rows, cols, side, share) != (None, None, None, None):
        raise UsageError("--rows, --cols, --side and --share go with --map")
    else:
        text, about = template_text(template), TEMPLATES[template]
    next_steps = [f"draw it:    safenav draw {quote(str(file))}"]
    next_steps.append(f"run it:     safenav run {quote(str(file))}")
    schema = file.parent / "safenav.schema.json"
    if not schema.exists():
        next_steps.append(f"in editors: safenav schema -o {quote(str(schema))}")
    return _written(text, file, force, about, next_steps)


def _new_fleet(file: Path, scenario: Path, force: bool) -> int:
    text = fleet_text(load_scenario(scenario))
    names = f"{quote(str(scenario))} --fleet {quote(str(file))}"
    next_steps = [f"rehearse:   safenav drive {names} --rehearse"]
    next_steps.append(f"drive:      safenav drive {names}")
    return _written(text, file, force, f"how to reach the robots of {scenario}", next_steps)


def _written(text: str, file: Path, force: bool, about: str, next_steps: list[str]) -> int:
    """Write a text; if it goes to a file, print what the file is (``about``) and the next steps."""
    write_out(file, text, echo=False, replace=force)
    if str(file) != "-":
        click.echo(f"{file}: {about}", err=True)
        for step in next_steps:
            click.echo(f"    {step}", err=True)
    return ExitCode.OK


def _on_map(map_file: Path, file: Path, division: Division) -> str:
    world = load_map(map_file, division)
    for note in world.notes:
        warn(note)
    folder = Path() if str(file) == "-" else file.parent
    text = scenario_on(world, map_lines(map_file, division, folder), map_file.stem)
    if text is None:
        raise UsageError(
            f"{map_file}: fewer than four free regions are connected\n"
            "    try more regions, or --share 0.3: less of a region may then be blocked"
        )
    return text
