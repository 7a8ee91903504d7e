"""``safenav replay`` and ``draw``: runs, and scenarios before their runs, as pages or pictures."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import click

from safenav.cli import options, warn
from safenav.errors import ExitCode, UsageError
from safenav.files import tell, write_out, write_whole
from safenav.report.picture.scene import Options, svg_of
from safenav.run.reading import run_of
from safenav.run.run import Run
from safenav.trace.file import Trace, read_trace

REPLAY_EPILOG = """\b
TICK is a number (of seconds in a live run), 'last', or the kind of an
event (violation, request, push, resolved, blocked, pop, goal): its first tick.
\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl
  safenav replay lab.jsonl                      # writes lab.html
  safenav replay lab.jsonl --svg request -o figure.svg
\b
With the extras 'motion' and 'pictures':
  safenav replay lab.jsonl --3d                 # writes lab.3d.html
  safenav replay lab.jsonl --png last --width 1600
  safenav replay lab.jsonl --gif --ticks 2-8
\b
Exit codes:
  0  done   2  invalid trace or usage
"""

_READ_BY = {
    "motion": ("--3d",),
    "width": ("--png", "--gif"),
    "ticks": ("--gif",),
    "speed": ("--gif",),
}
"""The forms of a replay that read an option."""


@click.command(epilog=REPLAY_EPILOG)
@click.argument("trace", type=options.INPUT)
@options.output(help="File to write; - is standard output.")
@click.option("--svg", metavar="TICK", help="Draw one moment as SVG.")
@click.option("--png", metavar="TICK", help="Draw one moment as PNG.")
@click.option("--gif", is_flag=True, help="Draw the run as an animated GIF.")
@click.option("--3d", "solid", is_flag=True, help="One HTML file that shows the run in 3D.")
@click.option("--motion", type=options.INPUT, help="The motion to show in 3D; else computed.")
@click.option("--width", type=options.PIXELS, help="Width of PNG or GIF in pixels.")
@click.option("--ticks", metavar="A-B", help="Only these ticks, or seconds (GIF).")
@click.option(
    "--speed",
    type=options.FiniteRange(0.1, 100),
    help="Ticks per second; for a run in seconds, the speed-up (GIF).  [4 or 12]",
)
def replay(
    trace: Path,
    output: Path | None,
    svg: str | None,
    png: str | None,
    gif: bool,
    solid: bool,
    motion: Path | None,
    width: int | None,
    ticks: str | None,
    speed: float | None,
) -> int:
    """Replay TRACE, which `safenav run --trace` wrote: as one HTML file that needs no network
    (the default), as a picture of one moment, or as an animated GIF."""
    given = {"--svg": svg is not None, "--png": png is not None, "--gif": gif, "--3d": solid}
    chosen = [form for form, wanted in given.items() if wanted]
    if len(chosen) > 1:
        raise UsageError("choose one of --svg, --png, --gif and --3d")
    form = chosen[0] if chosen else ""
    unread = {name: readers for name, readers in _READ_BY.items() if form not in readers}
    options.refuse({name: " or ".join(readers) for name, readers in unread.items()})
    ending = {"": "html", "--3d": "html"}.get(form, form.removeprefix("--"))
    _refuse_ending(output, ending)
    lines = read_trace(trace)
    if solid:
        write_out(output or trace.with_suffix(".3d.html"), _page3d(lines, trace, motion))
        return ExitCode.OK
    if not form:
        from safenav.report.page.html import page_of_trace

        write_out(output or trace.with_suffix(".html"), page_of_trace(lines, trace.name))
        return ExitCode.OK
    run = run_of(lines)
    if gif:
        speed = speed or run.clock.speed
        path, during = output or trace.with_suffix(".gif"), _ticks(run, ticks)
        _film(run, path, during, speed, width or 720)
        return ExitCode.OK
    tick, part = _moment(run, svg if svg is not None else png or "")
    picture = svg_of(run.at(tick, part))
    name = f"{trace.stem}-{run.when(tick).removeprefix('tick ')}.{ending}"
    _write_picture(output or trace.with_name(name), picture, ending, width)
    return ExitCode.OK


def _refuse_ending(output: Path | None, form: str) -> None:
    """Raises UsageError if the file's ending is that of another form of a replay."""
    ending = "" if output is None else output.suffix.lower().removeprefix(".")
    if output is not None and f".{ending}" in options.KINDS and ending != form:
        name = output.with_suffix(f".{form}").name
        wanted = {"gif": "--gif", "svg": "--svg last", "png": "--png last"}.get(ending)
        added = f", or add {wanted}" if form == "html" and wanted else ""
        problem = f"{output}: the replay is {form.upper()}; choose a name such as {name}{added}"
        raise UsageError(problem)


def _write_picture(path: Path, picture: str, form: str, width: int | None) -> None:
    """Write a vector picture, in pixels if ``form`` is ``png``. Raises UsageError without the extra
    ``pictures``."""
    content = picture.encode()
    if form == "png":
        from safenav.report.picture.svg import png_of

        content = png_of(picture, width)
    write_out(path, content)


def _page3d(lines: Trace, trace: Path, file: Path | None) -> str:
    """Return the 3D page, with the motion from a file or computed from the trace. Raises UsageError
    for a trace that breaks a rule."""
    from safenav.motion.check.verdict import read_motion_of
    from safenav.motion.making import motion_of, refuse_broken
    from safenav.report.page.motion import page3d_of

    refuse_broken(lines)
    motion = motion_of(lines) if file is None else read_motion_of(file, lines, trace)
    return page3d_of(lines, trace.name, motion)


def _moment(run: Run, written: str) -> tuple[int, float]:
    """Return the tick that a user has given, and the fraction of the time to the next one."""
    end = run.time(run.last)
    if written == "last":
        return run.last, 0.0
    if re.fullmatch(r"\d+(\.\d+)?", written):
        if float(written) > end:
            raise UsageError(f"the run has {run.clock.unit}s 0 to {int(end)}, not {written}")
        return run.moment(float(written))
    for event in run.told:
        if event.kind.value == written:
            return event.tick, 0.0
    kinds = sorted({event.kind.value for event in run.told})
    unit = run.clock.unit
    raise UsageError(
        f"no {unit} {written!r}: give a number from 0 to {int(end)}, 'last', or the kind of "
        f"an event of this run ({', '.join(kinds)})"
    )


def _ticks(run: Run, written: str | None) -> range:
    if written is None:
        return range(run.last + 1)
    found = re.fullmatch(r"(\d+)-(\d+)", written)
    end, unit = run.time(run.last), run.clock.unit
    if found is None or not int(found[1]) <= int(found[2]) <= end:
        raise UsageError(f"--ticks {written}: give two {unit}s such as 0-{int(end)}, in order")
    return range(run.tick_at(int(found[1])), run.tick_at(int(found[2])) + 1)


def _film(run: Run, path: Path, ticks: range, speed: float, width: int) -> None:
    from safenav.report.picture.film import Film, write_gif

    film = Film(ticks.start, ticks.stop - 1, speed, width)
    count = len(film.moments(run))
    with click.progressbar(length=count, label="drawing", file=sys.stderr) as bar:
        write_whole(path, lambda part: write_gif(run, part, film, lambda: bar.update(1)))
    tell(path)


DRAW_EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav draw lab.yaml
  safenav draw lab.yaml -o lab.svg
\b
With the extra 'pictures', or with your own map (image, ROS, MovingAI):
  safenav draw lab.yaml -o lab.png --width 1600
  safenav draw floor.png --rows 20 --cols 30
  safenav draw office.yaml --side 0.5
\b
Exit codes:
  0  done   2  bad input or usage
"""


@click.command(epilog=DRAW_EPILOG)
@click.argument("scenario", type=options.INPUT)
@options.output(".svg", ".png", help="Picture: .svg or .png.")
@click.option("--width", type=options.PIXELS, help="Width of the PNG in pixels.")
@options.division
def draw(
    scenario: Path,
    output: Path | None,
    width: int | None,
    rows: int | None,
    cols: int | None,
    side: float | None,
    share: float | None,
) -> int:
    """Draw SCENARIO before its run: region numbers, starts, objectives, hidden obstacles.
    Without -o it is drawn as text. SCENARIO may be a map file alone."""
    from safenav.report.picture.scene import scene_of
    from safenav.report.terminal.story import scenario_text
    from safenav.scenario.model import Scenario
    from safenav.scenario.reading.loader import load_scenario
    from safenav.scenario.reading.map import Division, form_of, load_map

    if form_of(scenario) is None:
        options.refuse(dict.fromkeys(("rows", "cols", "side", "share"), "map files, not scenarios"))
        plan = load_scenario(scenario)
    else:
        plan = Scenario(scenario.name, load_map(scenario, Division(rows, cols, side, share)), ())
    for note in plan.map.notes:
        warn(note)
    if output is None:
        for line in scenario_text(plan, shutil.get_terminal_size((120, 40)).columns):
            click.echo(line)
        return ExitCode.OK
    form = output.suffix.lower().removeprefix(".")
    if form not in ("svg", "png"):
        raise UsageError(f"{output}: the name of a picture ends in .svg or .png")
    _write_picture(output, svg_of(scene_of(plan), Options(axes=True)), form, width)
    return ExitCode.OK
