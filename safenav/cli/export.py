"""``safenav export``: a run as waypoints, a ROS 2 bag, tables or samples."""

from __future__ import annotations

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
from safenav.report.replay.reading import replay_of
from safenav.report.tables import tables
from safenav.trace.reading import Trace, read_trace
from safenav.world.map import Frame

BAG_RATE = 20.0
"""Positions of each robot per second in a bag with a motion."""

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl
  safenav export lab.jsonl -o lab.csv --resolution 0.5
  safenav export lab.jsonl --csv lab          # lab-moves.csv, lab-events.csv, lab-syntheses.csv
  safenav export lab.jsonl --waypoints - --format json --resolution 1
  safenav export lab.jsonl --waypoints lab.csv --resolution 0.5 --origin -2.5 -1.5
\b
With the extras 'motion' and 'mcap':
  safenav motion lab.jsonl -o lab.motion.jsonl
  safenav export lab.jsonl --motion lab.motion.jsonl --columns lab.npz --rate 1000
  safenav export lab.jsonl --mcap lab.mcap --resolution 0.5
\b
Exit codes:
  0  done   2  invalid trace or usage, or region size unknown
"""


@click.command(epilog=EPILOG)
@click.argument("trace", type=options.INPUT)
@click.option(
    "-o",
    "--output",
    type=options.FILE,
    help="Waypoints (.csv, .json), a bag (.mcap) or columns (.npz), by the file extension.",
)
@click.option(
    "--waypoints",
    type=options.WAYPOINTS,
    help="Write the waypoints, in metres; - is standard output.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["csv", "json"]),
    help="Default: json if the file ends in .json, else csv.",
)
@click.option("--mcap", type=options.BAG, help="A ROS 2 bag, for Foxglove (extra 'mcap').")
@click.option(
    "--csv",
    "stem",
    type=options.FILE,
    metavar="STEM",
    help="Tables: STEM-moves.csv, ...",
)
@click.option(
    "--motion",
    type=options.INPUT,
    help="Take times and speeds from this motion file; default: a tick lasts one second.",
)
@click.option(
    "--columns",
    type=options.COLUMNS,
    help="The motion sampled at a rate: FILE.npz, or FILE.csv of one robot.",
)
@click.option(
    "--rate",
    type=options.FiniteRange(min=0.1, max=1e4),
    default=100.0,
    metavar="HZ",
    help="Samples per second of the columns.  [100]",
)
@click.option("--robot", help="The robot whose columns to write.")
@click.option(
    "--resolution",
    type=options.METRES,
    metavar="M",
    help="Side of a region in metres, if the trace does not give it.",
)
@click.option(
    "--origin",
    type=options.FiniteRange(-1e9, 1e9),
    nargs=2,
    metavar="X Y",
    help="South-western corner of the map in metres, if the trace does not give it.",
)
def command(
    trace: Path,
    output: Path | None,
    waypoints: Path | None,
    form: str | None,
    mcap: Path | None,
    stem: Path | None,
    motion: Path | None,
    columns: Path | None,
    rate: float,
    robot: str | None,
    resolution: float | None,
    origin: tuple[float, float] | None,
) -> int:
    """Write TRACE for other programs: waypoints (where each robot is at the end of each tick, in
    metres in the frame of the map, as in ROS; with --motion at the end of each move, with times
    and speeds), a ROS 2 bag, tables, columns of samples."""
    if output is not None:
        waypoints, mcap, columns = _by_its_ending(output, waypoints, mcap, columns)
    if waypoints is None and mcap is None and stem is None and columns is None:
        raise UsageError(
            "no output: give -o FILE (.csv, .json, .mcap or .npz), --waypoints FILE, "
            "--mcap FILE, --csv STEM or --columns FILE"
        )
    run = read_trace(trace)
    moved = None
    if motion is not None:
        from safenav.motion.check.mismatch import read_motion_of

        moved = read_motion_of(motion, run, trace)
    if stem is not None:
        named = {f"{stem.name}-{k}.csv": text for k, text in tables(run, replay_of(run)).items()}
        write_all(stem.parent, named.items())
        for name in named:
            tell(stem.with_name(name))
    if mcap is not None:
        side = moved.header.side if moved is not None and resolution is None else resolution
        _bag(run, frame_of(run, side, origin), mcap, moved)
    if columns is not None:
        _columns(run, moved, columns, rate, robot)
    if waypoints is None:
        return ExitCode.OK
    as_json = form == "json" if form else waypoints.suffix.lower() == ".json"
    if moved is not None:
        from safenav.motion import timed

        passed = timed.timed_waypoints(moved)
        text = timed.as_json(passed) if as_json else timed.as_csv(passed)
    else:
        frame = frame_of(run, resolution, origin)
        found = waypoints_of(run, frame)
        text = json_of(found, frame) if as_json else csv_of(found)
    write_out(waypoints, text)
    return ExitCode.OK


def _by_its_ending(
    output: Path, waypoints: Path | None, mcap: Path | None, columns: Path | None
) -> tuple[Path | None, Path | None, Path | None]:
    """Return the files of waypoints, bag and columns, one of them ``output``, by its ending. Raises
    UsageError for another ending, or if another option gives the same output."""
    match output.suffix:
        case ".csv" | ".json" if waypoints is None:
            return output, mcap, columns
        case ".mcap" if mcap is None:
            return waypoints, output, columns
        case ".npz" if columns is None:
            return waypoints, mcap, output
        case ".csv" | ".json" | ".mcap" | ".npz":
            raise UsageError(f"--output {output} repeats another output option; give one")
    raise UsageError(f"--output {output}: its ending must be .csv, .json, .mcap or .npz")


def _columns(run: Trace, motion: Motion | None, path: Path, rate: float, robot: str | None) -> None:
    from safenav.motion.columns import as_csv, columns_of, npz_bytes

    if motion is None:
        raise UsageError("columns are samples of a motion: add --motion FILE (safenav motion)")
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
        stamped = messages(replay_of(run), frame, poses)
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
            "    leave out --resolution, or make the motion with this --side"
        )
    found = {}
    for name in motion.header.robots:
        planned = columns_of(motion, name, BAG_RATE, in_world=False)
        there = Columns(planned.times, placed(planned.columns, (*frame.origin, frame.yaw)))
        columns = (there.times, *there.place, there.columns["yaw"])
        found[name] = [*zip(*(column.tolist() for column in columns), strict=True)]
    return found
