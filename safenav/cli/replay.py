"""``safenav replay`` and ``draw``: runs and scenarios as pages or pictures."""

import re
import sys
from pathlib import Path
from typing import Annotated

import click

from safenav.cli import options, warn_of
from safenav.errors import ExitCode, UsageError
from safenav.files import tell, write_out, write_whole
from safenav.report.picture.scene import svg_of
from safenav.report.terminal.layout import echo_lines
from safenav.run.reading import run_of
from safenav.run.run import Run
from safenav.trace.file import Trace, read_trace

REPLAY_EXAMPLES = """\
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl
  safenav replay lab.jsonl                      # writes lab.html
  safenav replay lab.jsonl -o figure.svg --at request
With the extras 'motion' and 'pictures':
  safenav replay lab.jsonl --3d                 # writes lab.3d.html
  safenav replay lab.jsonl -o end.png --width 1600
  safenav replay lab.jsonl -o lab.gif --speed 2
\b
FILE by its ending: .html (the default), .svg or .png (one moment), .gif.
TICK is a number (of seconds in a live run), 'last', or the kind of an
event (violation, request, push, resolved, blocked, pop, goal): its first tick.
"""

FILE = options.Output(".html", ".svg", ".png", ".gif")
SPEED = options.range_of("x", 0.1, 100)
_READ_BY = {"at": (".svg", ".png"), "width": (".png", ".gif"), "speed": (".gif",)}
"""The file endings for which an option has an effect."""


@options.command(REPLAY_EXAMPLES)
def replay(
    trace: options.InputFile,
    output: Annotated[Path | None, FILE, "-o --output", "File to write; - is standard output."],
    at: Annotated[str | None, "--at TICK", "The moment of an SVG or PNG.  [last]"],
    solid: Annotated[bool, "--3d", "One HTML file that shows the run in 3D."],
    motion: Annotated[options.InputOption, "The motion to show in 3D; else computed."],
    width: Annotated[int | None, options.PIXELS, "Width of PNG or GIF in pixels."],
    speed: Annotated[
        float | None, SPEED, "GIF: ticks per second [4], or times as fast as a live run [12]."
    ],
) -> int:
    """Replay TRACE, which `safenav run --trace` wrote: as one HTML file that needs no network
    (the default), as a picture of one moment, or as an animated GIF."""
    if output is None and (str(trace) == "-" or trace.is_fifo()):
        raise UsageError("a trace from standard input or a pipe has no name: add -o FILE")
    output = output or trace.parent / (trace.stem + (".3d.html" if solid else ".html"))
    form = output.suffix.lower() or (".html" if at is None else ".svg")
    for name, endings in _READ_BY.items():
        if form not in endings:
            options.refuse(f"-o FILE in {' or '.join(endings)}", name)
    if not solid:
        options.refuse("--3d", "motion")
    if solid and form != ".html":
        raise UsageError(f"--3d writes a page: choose a name such as {output.with_suffix('.html')}")
    lines = read_trace(trace)
    if solid:
        write_out(output, _page3d(lines, trace, motion))
    elif form == ".html":
        from safenav.report.page.html import page_of

        write_out(output, page_of(lines, trace.name))
    elif form == ".gif":
        run = run_of(lines)
        _film(run, output, speed or run.speed, width or 720)
    else:
        run = run_of(lines)
        _write_picture(output, svg_of(run, *_moment(run, at or "last")), form, width)
    return ExitCode.OK


def _write_picture(path: Path, picture: str, form: str, width: int | None) -> None:
    """Write a vector picture, in pixels if ``form`` is ``.png``. Raises UsageError without the
    extra ``pictures``."""
    content = picture.encode()
    if form == ".png":
        from safenav.report.picture.svg import png_of

        content = png_of(picture, width)
    write_out(path, content)


def _page3d(lines: Trace, trace: Path, file: Path | None) -> str:
    """Return the 3D page with the motion of a file or computed from the trace. Raises UsageError
    for a trace that breaks a rule."""
    from safenav.motion.check.verdict import read_motion_of
    from safenav.motion.making import motion_of, refuse_broken
    from safenav.report.page.motion import page3d_of

    refuse_broken(lines)
    motion = motion_of(lines) if file is None else read_motion_of(file, lines, trace)
    return page3d_of(lines, trace.name, motion)


def _moment(run: Run, written: str) -> tuple[int, float]:
    """Return a user's tick and the elapsed fraction of the time to the next one."""
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
    unit = run.unit
    raise UsageError(
        f"no {unit} {written!r}: give a number from 0 to {int(end)}, 'last', or the kind of "
        f"an event of this run ({', '.join(kinds)})"
    )


def _film(run: Run, path: Path, speed: float, width: int) -> None:
    from safenav.report.picture.film import Film

    film = Film(run, speed, width)
    with click.progressbar(
        length=len(film.moments), label="drawing", width=0, file=sys.stderr
    ) as bar:
        write_whole(path, lambda part: film.write_gif(part, lambda: bar.update(1)))
    tell(path)


PICTURE = options.Output(".svg", ".png")
DRAW_EXAMPLES = """\
  safenav new lab.yaml && safenav draw lab.yaml
  safenav draw lab.yaml -o lab.svg
With the extra 'pictures', or with your own map (image, ROS, MovingAI):
  safenav draw lab.yaml -o lab.png --width 1600
  safenav draw floor.png --rows 20 --cols 30
  safenav draw office.yaml --side 0.5
"""


@options.command(DRAW_EXAMPLES)
def draw(
    scenario: options.InputFile,
    output: Annotated[Path | None, PICTURE, "-o --output", "Picture: .svg or .png."],
    width: Annotated[int | None, options.PIXELS, "Width of the PNG in pixels."],
    rows: options.Rows,
    cols: options.Cols,
    side: options.Side,
    share: options.Share,
) -> int:
    """Draw SCENARIO before its run: starts, objectives, hidden obstacles, region numbers. Without
    -o it is drawn as text, with rows and columns. SCENARIO may be a map file alone."""
    from safenav.report.picture.scene import svg_of_scenario
    from safenav.report.terminal.story import scenario_text
    from safenav.scenario.model import Scenario
    from safenav.scenario.reading.loader import load_scenario
    from safenav.scenario.reading.map import form_of, load_map

    if (form := form_of(scenario)) is None:
        if scenario.exists():  # reports a missing file
            options.refuse("map files, not scenarios", "rows", "cols", "side", "share")
        plan = load_scenario(scenario)
    else:
        division = {"rows": rows, "cols": cols, "resolution": side, "share": share}
        plan = Scenario(scenario.name, load_map(scenario, form, division), ())
    if output is None or output.suffix.lower() != ".png":
        options.refuse("-o FILE in .png", "width")
    warn_of(plan.map.notes)
    if output is None:
        echo_lines(scenario_text(plan))
        return ExitCode.OK
    _write_picture(output, svg_of_scenario(plan), output.suffix.lower(), width)
    return ExitCode.OK
