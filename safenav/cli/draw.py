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
\b
Exit codes:
  0  done   2  bad input or usage
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Picture: .svg or .png.")
@click.option("--width", type=click.IntRange(100, 8000), help="Width of the PNG in pixels.")
@click.option("--legend/--no-legend", default=True, help="Explain the marks (pictures).")
def command(scenario: Path, output: Path | None, width: int | None, legend: bool) -> int:
    """Draw SCENARIO as it is before the run: region numbers, starts, objectives, hidden
    obstacles. Without -o as text on the terminal."""
    from safenav.report.picture_scenario import scenario_text, scene_of
    from safenav.scenario.loader import load_scenario

    plan = load_scenario(scenario)
    if output is None:
        for line in scenario_text(plan, shutil.get_terminal_size((120, 40)).columns):
            click.echo(line)
        return ExitCode.OK
    from safenav.report.picture import Options, svg_of
    from safenav.report.picture_file import write_bytes

    form = output.suffix.lower()
    if form not in (".svg", ".png"):
        raise UsageError(f"{output}: a picture ends in .svg or .png")
    picture = svg_of(scene_of(plan), Options(legend=legend, numbers=True))
    content = picture.encode()
    if form == ".png":
        from safenav.report.picture_raster import png_of

        content = png_of(picture, width)
    write_bytes(output, content)
    return ExitCode.OK
