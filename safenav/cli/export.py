"""``safenav export``: a run as waypoints, a motion, a ROS 2 bag, tables or samples."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click

from safenav.cli import options
from safenav.errors import ExitCode, UsageError
from safenav.motion.file.records import Motion
from safenav.motion.waypoints import as_csv as csv_of
from safenav.motion.waypoints import as_json as json_of
from safenav.motion.waypoints import frame_of
from safenav.motion.waypoints import waypoints as waypoints_of
from safenav.outfile import tell, write_all, write_out, write_whole
from safenav.report.bag.messages import Poses, messages
from safenav.report.tables import tables
from safenav.run.reading import run_of
from safenav.trace.reading import Trace, read_trace
from safenav.world.map import Frame

BAG_RATE = 20.0
"""Positions of each robot per second in a bag with a motion."""

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl
  safenav export lab.jsonl -o lab.csv --side 0.5
  safenav export lab.jsonl --csv lab    # lab-moves.csv, lab-events.csv, lab-syntheses.csv
With the extras 'motion' and 'mcap':
  safenav export lab.jsonl --motion lab.motion.jsonl --report
  safenav export lab.jsonl --motion windy.jsonl --gust 1 --seed 7
  safenav export lab.jsonl lab.motion.jsonl -o lab.npz --rate 1000
  safenav export lab.jsonl -o lab.mcap --side 0.5
\b
Exit codes:
  0  done   2  bad input or usage, infeasible motion, or region size unknown
"""

READ_BY = {
    "form": "waypoints",
    "rate": "columns",
    "robot": "columns",
    "gust": "motion",
    "seed": "motion",
    "track": "motion",
}
"""The output that reads an option, by parameter."""

OUTPUTS = {
    ".csv": "waypoints",
    ".json": "waypoints",
    ".jsonl": "motion",
    ".mcap": "mcap",
    ".npz": "columns",
}


@click.command(epilog=EPILOG)
@click.argument("trace", type=options.INPUT)
@click.argument("motion", type=options.INPUT, required=False)
@options.output(help="By its ending: .csv .json .jsonl .mcap .npz")
@click.option("--waypoints", type=options.Output(".csv", ".json"), help="Waypoints in metres.")
@click.option("--format", "form", type=click.Choice(["csv", "json"]), help="Format of waypoints.")
@click.option("--motion", "written", type=options.LINES, help="Compute and write the motion.")
@click.option("--report", is_flag=True, help="Print times, waits, distances, errors, margins.")
@click.option("--track", is_flag=True, help="Simulate flyers that track their references.")
@click.option(
    "--gust",
    type=options.FiniteRange(min=0),
    default=0.0,
    metavar="M/S",
    help="The same, in wind (root mean square).",
)
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, metavar="N", help="Seed of the wind."
)
@click.option("--mcap", type=options.Output(".mcap"), help="A ROS 2 bag, for Foxglove.")
@click.option("--csv", "stem", type=options.FILE, metavar="STEM", help="Tables: STEM-*.csv.")
@click.option(
    "--columns",
    type=options.Output(".npz", ".csv"),
    help="Samples of the motion (.npz; .csv: one robot).",
)
@click.option(
    "--rate",
    type=options.FiniteRange(min=0.1, max=1e4),
    default=100.0,
    metavar="HZ",
    help="Samples per second.  [100]",
)
@click.option("--robot", help="The robot whose columns to write.")
@click.option("--side", type=options.METRES, metavar="M", help="Side of a region in metres.")
@click.option(
    "--origin",
    type=options.FiniteRange(-1e9, 1e9),
    nargs=2,
    metavar="X Y",
    help="South-western corner in metres.",
)
def command(
    trace: Path,
    motion: Path | None,
    output: Path | None,
    waypoints: Path | None,
    form: str | None,
    written: Path | None,
    report: bool,
    track: bool,
    gust: float,
    seed: int,
    mcap: Path | None,
    stem: Path | None,
    columns: Path | None,
    rate: float,
    robot: str | None,
    side: float | None,
    origin: tuple[float, float] | None,
) -> int:
    """Write TRACE for other programs: waypoints (where each robot is at the end of each tick, in
    metres as in ROS), a ROS 2 bag, tables, or its motion in metres and seconds, which keeps every
    guarantee of the run at every instant. With a motion (MOTION, or the one computed by --motion),
    the others have its times and speeds."""
    files = {"waypoints": waypoints, "motion": written, "mcap": mcap, "columns": columns}
    if output is not None:
        _add_by_its_ending(files, output)
    if not report and stem is None and not any(files.values()):
        raise UsageError(
            "no output: give -o FILE (.csv, .json, .jsonl, .mcap or .npz), --waypoints FILE, "
            "--motion FILE, --report, --mcap FILE, --csv STEM or --columns FILE"
        )
    _refuse_unread(click.get_current_context(), files, computed=report and motion is None)
    if motion is not None and files["motion"] is not None:
        raise UsageError(f"--motion computes one, and {motion} is one: give one of them")
    run = read_trace(trace)
    moved = None
    if motion is not None:
        from safenav.motion.check.mismatch import read_motion_of

        moved = read_motion_of(motion, run, trace)
        if side is not None and abs(moved.header.side - side) > 1e-6 * side:
            own = f"the regions of the motion measure {moved.header.side:g} m, not {side:g} m"
            raise UsageError(f"{own}\n    leave out --side, or compute another motion with it")
    elif files["motion"] or report:
        moved = _computed(run, side, gust, seed, track=track)
    if (path := files["motion"]) is not None and moved is not None:
        from safenav.motion.file.reading import parsed, text_of

        write_out(path, text := text_of(moved))
        moved = parsed(text.encode(), str(path))  # as every reader of the file sees it
    if report and moved is not None:
        from safenav.motion.report import report_of

        click.echo(report_of(moved), err=Path("-") in files.values())
    if stem is not None:
        named = {f"{stem.name}-{k}.csv": text for k, text in tables(run_of(run)).items()}
        write_all(stem.parent, named.items())
        for name in named:
            tell(stem.with_name(name))
    if (path := files["mcap"]) is not None:
        _bag(run, frame_of(run, moved.header.side if moved else side, origin), path, moved)
    if (path := files["columns"]) is not None:
        _columns(run, moved, path, rate, robot)
    if (path := files["waypoints"]) is not None:
        as_json = form == "json" if form else path.suffix.lower() == ".json"
        write_out(path, _waypoints(run, moved, side, origin, as_json))
    return ExitCode.OK


def _add_by_its_ending(files: dict[str, Path | None], output: Path) -> None:
    """Add ``--output`` to the files. Raises UsageError for an unknown ending, or if another option
    gives the same output."""
    kind = OUTPUTS.get(output.suffix.lower())
    if kind is None:
        raise UsageError(f"--output {output}: its ending must be one of {', '.join(OUTPUTS)}")
    if files[kind] is not None:
        raise UsageError(f"--output {output} repeats another output option; give one")
    files[kind] = output


def _refuse_unread(
    context: click.Context, files: Mapping[str, Path | None], computed: bool
) -> None:
    """Raises UsageError for an option that no output reads. ``computed``: a motion is computed for
    the report."""
    there = options.given(context)
    for param in context.command.params:
        output = READ_BY.get(param.name or "") if param.name in there else None
        if output and files[output] is None and not (output == "motion" and computed):
            raise UsageError(f"{param.opts[0]} goes with --{output}")


def _computed(run: Trace, side: float | None, gust: float, seed: int, *, track: bool) -> Motion:
    """Return the motion of a trace. Raises UsageError if it breaks a rule."""
    from safenav.motion.making import SIDE, Disturbances, motion_of, refuse_broken

    if side is None and run.header.scenario.map.resolution is None:
        note = f"no region size given; using {SIDE:g} m (change with --side M)"
        click.echo(f"{run.source}: {note}", err=True)
    refuse_broken(run)
    return motion_of(run, side, Disturbances(seed, gust, track))


def _waypoints(
    run: Trace,
    moved: Motion | None,
    side: float | None,
    origin: tuple[float, float] | None,
    as_json: bool,
) -> str:
    if moved is not None:
        from safenav.motion import timed

        passed = timed.timed_waypoints(moved)
        return timed.as_json(passed) if as_json else timed.as_csv(passed)
    frame = frame_of(run, side, origin)
    found = waypoints_of(run, frame)
    return json_of(found, frame) if as_json else csv_of(found)


def _columns(run: Trace, motion: Motion | None, path: Path, rate: float, robot: str | None) -> None:
    from safenav.motion.columns import as_csv, columns_of, npz_bytes

    if motion is None:
        raise UsageError("columns are samples of a motion: add MOTION, or --motion FILE")
    if path.suffix.lower() == ".npz":
        write_out(path, npz_bytes(motion, rate))
        return
    names = list(run.header.scenario.robots)
    if robot is None and len(names) > 1:
        raise UsageError(
            f"a CSV has one robot: add --robot {names[0]}, or write {path.stem}.npz for all\n"
            f"    robots: {', '.join(names)}"
        )
    write_out(path, as_csv(columns_of(motion, robot or names[0], rate)))


def _bag(run: Trace, frame: Frame, path: Path, motion: Motion | None) -> None:
    from safenav.report.bag.mcap_file import write_mcap

    poses = None
    if motion is not None:
        from safenav.motion.in_time import in_time

        run, poses = in_time(run, motion), _poses(motion, frame)
    try:
        stamped = messages(run_of(run), frame, poses)
        write_whole(path, lambda part: write_mcap(part, stamped))
    except ValueError as error:
        raise UsageError(f"{run.source}: {error}") from error
    tell(path)


def _poses(motion: Motion, frame: Frame) -> Poses:
    """Return times, positions and yaws of each robot of a motion (s, m, rad), in the frame of the
    map."""
    from safenav.motion.columns import Columns, columns_of, placed

    side = motion.header.side
    if abs(side - frame.resolution[0]) > 1e-6 * side:
        raise UsageError(
            f"the regions of the motion measure {side:g} m, not {frame.resolution[0]:g} m\n"
            "    compute another motion with this --side"
        )
    found = {}
    for name in motion.header.robots:
        planned = columns_of(motion, name, BAG_RATE, in_world=False)
        there = Columns(planned.times, placed(planned.columns, (*frame.origin, frame.yaw)))
        columns = (there.times, *there.place, there.columns["yaw"])
        found[name] = [*zip(*(column.tolist() for column in columns), strict=True)]
    return found
