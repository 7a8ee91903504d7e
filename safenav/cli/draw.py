"""``safenav draw``: a scenario before any run."""

from __future__ import annotations

import shutil
from pathlib import Path

import click

from safenav.errors import ExitCode, UsageError

EPILOG = """\b
Examples:
  safenav draw scenarios/case_study_1.yaml
  safenav draw scenarios/case_study_1.yaml -o map.svg
  safenav draw scenarios/case_study_1.yaml -o map.png --width 1600
  safenav draw scenarios/case_study_3_beliefs.yaml --sight digit -o sight.svg
\b
Exit codes:
  0  done   2  bad input or usage
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Picture: .svg or .png.")
@click.option("--width", type=click.IntRange(100, 8000), help="Width of the PNG in pixels.")
@click.option("--sight", metavar="ROBOT", help="Shade what this robot sees from its start.")
@click.option("--legend/--no-legend", default=True, help="Explain the marks (pictures).")
def command(
    scenario: Path, output: Path | None, width: int | None, sight: str | None, legend: bool
) -> int:
    """Draw SCENARIO as it is before the run: region numbers, starts, objectives, hidden
    obstacles. Without -o as text on the terminal."""
    from safenav.report.picture.scenario import scenario_text, scene_of, sight_of
    from safenav.report.replay.perception import shading_lines
    from safenav.scenario.reading.loader import load_scenario

    plan = load_scenario(scenario)
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
    picture = svg_of(scene_of(plan), Options(legend=legend, numbers=True, shading=shading))
    content = picture.encode()
    if form == ".png":
        from safenav.report.picture.raster import png_of

        content = png_of(picture, width)
    write_bytes(output, content)
    return ExitCode.OK
