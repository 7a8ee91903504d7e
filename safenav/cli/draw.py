"""``safenav draw``: draw a scenario before its run."""

from __future__ import annotations

import shutil
from pathlib import Path

import click

from safenav.cli import options, warn
from safenav.cli.pixels import pixels_of
from safenav.errors import ExitCode, UsageError
from safenav.outfile import write_out
from safenav.report.picture.scenario import scenario_text, scene_of, sight_of
from safenav.report.picture.scene import Options, svg_of
from safenav.run.sight import shading_lines
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.reading.maps.bare_map import Division, form_of, load_map

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav draw lab.yaml
  safenav draw lab.yaml -o lab.svg
  safenav draw lab.yaml --sight walker -o sight.svg
\b
With the extra 'pictures', or with your own map (image, ROS, MovingAI):
  safenav draw lab.yaml -o lab.png --width 1600
  safenav draw floor.png --rows 20 --cols 30
  safenav draw office.yaml --side 0.5
\b
Exit codes:
  0  done   2  bad input or usage
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=options.INPUT)
@options.output(".svg", ".png", help="Picture: .svg or .png.")
@click.option("--width", type=options.PIXELS, help="Width of the PNG in pixels.")
@click.option("--sight", metavar="ROBOT", help="Shade what this robot sees from its start.")
@options.division
@click.option("--legend/--no-legend", default=True, help="Draw a legend (pictures).")
def command(
    scenario: Path,
    output: Path | None,
    width: int | None,
    sight: str | None,
    rows: int | None,
    cols: int | None,
    side: float | None,
    share: float | None,
    legend: bool,
) -> int:
    """Draw SCENARIO before its run: region numbers, starts, objectives, hidden obstacles.
    Without -o it is drawn as text. SCENARIO may be a map file alone."""
    plan = _plan(scenario, Division(rows, cols, side, share))
    for note in plan.map.notes:
        warn(note)
    options.check_robot(sight, plan, scenario)
    shading = None if sight is None else sight_of(plan, sight)
    if output is None:
        for line in scenario_text(plan, shutil.get_terminal_size((120, 40)).columns):
            click.echo(line)
        for line in shading_lines(shading) if shading is not None else ():
            click.echo(f"\n  {line}")
        return ExitCode.OK
    form = output.suffix.lower()
    if form not in (".svg", ".png"):
        raise UsageError(f"{output}: the name of a picture ends in .svg or .png")
    shown = Options(legend=legend, shading=shading, axes=True)
    picture = svg_of(scene_of(plan), shown)
    write_out(output, picture.encode() if form == ".svg" else pixels_of(picture, width))
    return ExitCode.OK


def _plan(path: Path, division: Division) -> Scenario:
    """Return the scenario of a file; for a map file, a scenario without robots."""
    if form_of(path) is not None:
        return Scenario(path.name, load_map(path, division), ())
    if division != Division():
        raise UsageError("--rows, --cols, --side and --share are for map files, not for scenarios")
    return load_scenario(path)
