"""``safenav replay``: a run as a page or as pictures."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import click

from safenav.cli import options
from safenav.cli.pixels import pixels_of, warn_of_boxes
from safenav.errors import ExitCode, UsageError
from safenav.extras import missing
from safenav.outfile import tell, write_out, write_whole
from safenav.report.page.html import page_of_trace
from safenav.report.picture.scene import Options, svg_of
from safenav.run.reading import run_of
from safenav.run.run import Run
from safenav.run.sight import shading_of, viewers
from safenav.trace.reading import Trace, read_trace

EPILOG = """\b
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


_STILL = {"svg": "--svg", "png": "--png"}
_FORMS = {
    "motion": {"solid": "--3d"},
    "width": {"png": "--png", "gif": "--gif"},
    "ticks": {"gif": "--gif"},
    "speed": {"gif": "--gif"},
    "sight": {**_STILL, "gif": "--gif"},
    "legend": _STILL,
    "hidden": _STILL,
}
"""Options that only some forms of a replay read, by parameter."""


@click.command(epilog=EPILOG)
@click.argument("trace", type=options.INPUT)
@options.output(help="File to write; - is standard output.")
@click.option("--svg", metavar="TICK", help="Draw one moment as SVG.")
@click.option("--png", metavar="TICK", help="Draw one moment as PNG.")
@click.option("--gif", is_flag=True, help="Draw the run as an animated GIF.")
@click.option("--3d", "solid", is_flag=True, help="One HTML file that shows the run in 3D.")
@click.option(
    "--motion",
    type=options.INPUT,
    help="The motion to show (3D); default: computed from the trace.",
)
@click.option("--width", type=options.PIXELS, help="Width of PNG or GIF in pixels.")
@click.option("--ticks", metavar="A-B", help="Only these ticks, or seconds (GIF).")
@click.option(
    "--speed",
    type=options.FiniteRange(0.1, 100),
    help="Ticks per second; for a run in seconds, the speed-up (GIF).  [4 or 12]",
)
@click.option(
    "--sight", metavar="ROBOT", help="Shade what this robot sees and believes (SVG, PNG, GIF)."
)
@click.option("--legend/--no-legend", default=True, help="Draw a legend (SVG, PNG).")
@click.option("--hidden/--no-hidden", default=True, help="Show undiscovered obstacles (SVG, PNG).")
def command(
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
    sight: str | None,
    legend: bool,
    hidden: bool,
) -> int:
    """Run TRACE, which `safenav run --trace` wrote: as one HTML file that needs no network
    (the default), as a picture of one moment, or as an animated GIF."""
    if sum((svg is not None, png is not None, gif, solid)) > 1:
        raise UsageError("choose one of --svg, --png, --gif and --3d")
    options.refuse_unread(click.get_current_context(), _FORMS)
    form = next((f for f, chosen in (("svg", svg), ("png", png)) if chosen is not None), "html")
    _refuse_ending(output, "gif" if gif else form)
    lines = read_trace(trace)
    if solid:
        write_out(output or trace.with_suffix(".3d.html"), _page3d(lines, trace, motion))
        return ExitCode.OK
    run = run_of(lines)
    if sight is not None:
        _check_viewer(run, sight)
    if gif:
        speed = speed or {"tick": 4.0, "second": 12.0}[run.unit]
        path, during = output or trace.with_suffix(".gif"), _ticks(run, ticks)
        return _film(run, path, during, speed, width or 720, sight)
    if form != "html":
        tick, part = _moment(run, svg if svg is not None else png or "")
        shading = None if sight is None else shading_of(run, sight, tick)
        shown = Options(legend=legend, hidden=hidden, shading=shading)
        picture = svg_of(run.at(tick, part), shown)
        content = picture.encode() if form == "svg" else pixels_of(picture, width)
        name = f"{trace.stem}-{run.when(tick).removeprefix('tick ')}.{form}"
        write_out(output or trace.with_name(name), content)
        return ExitCode.OK
    write_out(output or trace.with_suffix(".html"), page_of_trace(lines, trace.name))
    return ExitCode.OK


def _refuse_ending(output: Path | None, form: str) -> None:
    """Raises UsageError if the file's ending is that of another form of a run."""
    ending = "" if output is None else output.suffix.lower().removeprefix(".")
    if output is not None and f".{ending}" in options.KINDS and ending != form:
        name = output.with_suffix(f".{form}").name
        wanted = {"gif": "--gif", "svg": "--svg last", "png": "--png last"}.get(ending)
        added = f", or add {wanted}" if form == "html" and wanted else ""
        problem = f"{output}: the replay is {form.upper()}; choose a name such as {name}{added}"
        raise UsageError(problem)


def _page3d(lines: Trace, trace: Path, file: Path | None) -> str:
    """Return the 3D page, with the motion from a file or computed from the trace. Raises UsageError
    for a trace that breaks a rule."""
    try:
        from safenav.motion.check.mismatch import read_motion_of
        from safenav.motion.making import motion_of, refuse_broken
        from safenav.report.view3d.html import page3d_of
    except ModuleNotFoundError as error:
        raise missing("the 3D page", str(error.name), "motion") from error
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
            raise UsageError(f"the run has {run.unit}s 0 to {int(end)}, not {written}")
        return run.moment(float(written))
    for event in run.told:
        if event.kind.value == written:
            return event.tick, 0.0
    kinds = sorted({event.kind.value for event in run.told})
    raise UsageError(
        f"no {run.unit} {written!r}: give a number from 0 to {int(end)}, 'last', or the kind of "
        f"an event of this run ({', '.join(kinds)})"
    )


def _check_viewer(run: Run, robot: str) -> None:
    names = [track.name for track in run.robots]
    if robot not in names:
        raise UsageError(f"there is no robot {robot!r}; the run has {', '.join(names)}")
    if robot not in viewers(run):
        raise UsageError(f"nothing to shade: {robot} has no limit of vision, and no beliefs")


def _ticks(run: Run, written: str | None) -> range:
    if written is None:
        return range(run.last + 1)
    found = re.fullmatch(r"(\d+)-(\d+)", written)
    end = run.time(run.last)
    if found is None or not int(found[1]) <= int(found[2]) <= end:
        raise UsageError(f"--ticks {written}: give two {run.unit}s such as 0-{int(end)}, in order")
    return range(run.tick_at(int(found[1])), run.tick_at(int(found[2])) + 1)


def _film(run: Run, path: Path, ticks: range, speed: float, width: int, sight: str | None) -> int:
    from safenav.report.picture.film import Film, write_gif

    steps = max(1, min(3, round(12 / speed)))
    film = Film(ticks.start, ticks.stop - 1, speed, steps, width, sight)
    count = len(film.moments(run))
    with click.progressbar(length=count, label="drawing", file=sys.stderr) as bar:
        write_whole(path, lambda part: write_gif(run, part, film, lambda: bar.update(1)))
    warn_of_boxes(svg_of(run.at(film.first), Options(legend=False)))
    tell(path)
    return ExitCode.OK
