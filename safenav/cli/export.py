"""``safenav export``: a run as waypoints in metres."""

from __future__ import annotations

from pathlib import Path

import click

from safenav.errors import ExitCode

EPILOG = """\b
Examples:
  safenav export run.jsonl --waypoints run.csv
  safenav export run.jsonl --waypoints - --format json
  safenav export run.jsonl --waypoints run.csv --resolution 0.5 --origin -2.5 -1.5
\b
Exit codes:
  0  done   2  no trace, bad usage, or nobody says how large a region is
"""


@click.command(epilog=EPILOG)
@click.argument("trace", type=click.Path(path_type=Path))
@click.option(
    "--waypoints",
    type=click.Path(path_type=Path),
    required=True,
    help="File to write; - is standard output.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["csv", "json"]),
    help="Default: json if the file ends in .json, else csv.",
)
@click.option(
    "--resolution",
    type=click.FloatRange(min=0, min_open=True, max=1e6),
    metavar="M",
    help="Metres that a region measures, if not as the trace says.",
)
@click.option(
    "--origin",
    type=click.FloatRange(-1e9, 1e9),
    nargs=2,
    metavar="X Y",
    help="The south-western corner of the map in metres, if not as the trace says.",
)
def command(
    trace: Path,
    waypoints: Path,
    form: str | None,
    resolution: float | None,
    origin: tuple[float, float] | None,
) -> int:
    """Write where each robot of TRACE is at the end of each tick: x (east) and y (north) in
    metres in the frame of the map, as in ROS, and which way it faces."""
    from safenav.motion.waypoints import as_csv, as_json, frame_of
    from safenav.motion.waypoints import waypoints as waypoints_of
    from safenav.outfile import write_bytes
    from safenav.trace.reading import read_trace

    run = read_trace(trace)
    frame = frame_of(run, resolution, origin)
    found = waypoints_of(run, frame)
    if form is None:
        form = "json" if waypoints.suffix.lower() == ".json" else "csv"
    text = as_json(found, frame) if form == "json" else as_csv(found)
    write_bytes(waypoints, text.encode())
    return ExitCode.OK
