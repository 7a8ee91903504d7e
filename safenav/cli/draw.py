"""``safenav draw``: a scenario before its run."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import click

from safenav.cli.division import division_options
from safenav.cli.output import FILE
from safenav.errors import ExitCode, UsageError

if TYPE_CHECKING:
    from safenav.scenario.model import Scenario
    from safenav.scenario.reading.maps.bare_map import Division

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav draw lab.yaml
  safenav draw lab.yaml -o lab.svg
  safenav draw lab.yaml --sight walker -o sight.svg
\b
With the extra 'pictures', or with a map of yours (image, ROS, MovingAI):
  safenav draw lab.yaml -o lab.png --width 1600
  safenav draw floor.png --rows 20 --cols 30
  safenav draw office.yaml --side 0.5
\b
Exit codes:
  0  done   2  bad input or usage
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=FILE, help="Picture: .svg or .png.")
@click.option("--width", type=click.IntRange(100, 8000), help="Width of the PNG in pixels.")
@click.option("--sight", metavar="ROBOT", help="Shade what this robot sees from its start.")
@division_options
@click.option("--legend/--no-legend", default=True, help="Explain the marks (pictures).")
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
    """Draw SCENARIO as it is before the run: region numbers, starts, objectives, hidden
    obstacles. Without -o as text on the terminal. SCENARIO may be a map file alone."""
    from safenav.report.picture.scenario import scenario_text, scene_of, sight_of
    from safenav.report.replay.perception import shading_lines
    from safenav.scenario.reading.maps.bare_map import Division

    plan = _plan(scenario, Division(rows, cols, side, share))
    for note in plan.map.notes:
        click.echo(f"warning: {note}", err=True)
    names = [robot.name for robot in plan.robots]
    if sight is not None and sight not in names:
        raise UsageError(f"{scenario}: there is no robot '{sight}'; it has {', '.join(names)}")
    shading = None if sight is None else sight_of(plan, sight)
    if output is None:
        for line in scenario_text(plan, shutil.get_terminal_size((120, 40)).columns):
            click.echo(line)
        for line in shading_lines(shading) if shading is not None else ():
            click.echo(f"\n  {line}")
        return ExitCode.OK
    from safenav.outfile import write_bytes
    from safenav.report.picture.scene import Options, svg_of

    form = output.suffix.lower()
    if form not in (".svg", ".png"):
        raise UsageError(f"{output}: a picture ends in .svg or .png")
    picture = svg_of(
        scene_of(plan), Options(legend=legend, numbers=True, shading=shading, axes=True)
    )
    content = picture.encode()
    if form == ".png":
        from safenav.report.picture.raster import png_of

        content = png_of(picture, width)
    write_bytes(output, content)
    return ExitCode.OK


def _plan(path: Path, division: Division) -> Scenario:
    """The scenario, or one without robots around a map file."""
    from safenav.scenario.model import Scenario
    from safenav.scenario.reading.loader import load_scenario
    from safenav.scenario.reading.maps.bare_map import Division, form_of, load_map

    if form_of(path) is not None:
        return Scenario(path.name, load_map(path, division), ())
    if division != Division():
        raise UsageError("--rows, --cols, --side and --share are for map files, not for scenarios")
    return load_scenario(path)
