"""``safenav export``: runs as waypoints, motions, ROS 2 bags or samples."""

from pathlib import Path
from typing import Annotated

import click

from safenav.cli import options
from safenav.errors import ExitCode, UsageError
from safenav.files import tell, write_out, write_whole
from safenav.motion.file import Motion
from safenav.motion.waypoints import as_csv, frame_of, timed_waypoints, waypoints
from safenav.report.bag import messages
from safenav.run.reading import run_of
from safenav.trace.file import Trace, read_trace
from safenav.world.map import Frame

BAG_RATE = 20.0
"""Positions per robot and second in a bag with a motion."""

FILE = options.Output(".csv", ".mcap", ".npz")

EXAMPLES = """\
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl
  safenav export lab.jsonl -o lab.csv --side 0.5
With the extras 'motion' and 'mcap':
  safenav export lab.jsonl --motion lab.motion.jsonl
  safenav export lab.jsonl --motion flown.jsonl --track -o flown.npz
  safenav export lab.jsonl lab.motion.jsonl -o lab.npz --rate 100
  safenav export lab.jsonl -o lab.mcap --side 0.5
\b
FILE by its ending: .csv (waypoints), .npz (samples of the motion, with numpy.load), .mcap (a ROS 2
bag, for Foxglove). -o may be given several times.
"""


@options.command(EXAMPLES)
def export(
    trace: options.InputFile,
    motion: options.InputOption,
    *,
    outputs: Annotated[
        tuple[Path, ...], FILE, "-o --output FILE", "Output; its ending sets the format."
    ],
    written: Annotated[options.Lines, "--motion", "Compute and write the motion."],
    track: Annotated[bool, "Simulate flyers that track their references."],
    rate: Annotated[float, options.HERTZ, "Samples per second."] = 100.0,
    side: options.Side,
) -> int:
    """Write TRACE for other programs: waypoints, a ROS 2 bag, or a motion. Waypoints are positions
    at the end of each tick, in metres as in ROS. A motion, in metres and seconds, keeps every
    guarantee of the run at every instant. With a motion (MOTION, or the one computed by --motion),
    waypoints and samples have its times and speeds."""
    files = {".csv" if str(p) == "-" else p.suffix.lower(): p for p in outputs}
    if len(files) < len(outputs):
        raise UsageError("two outputs are of the same kind; give one of them")
    if written is None and not files:
        raise UsageError("no output: give -o FILE or --motion FILE")
    if written is None:
        options.refuse("--motion", "track")
    if ".npz" not in files:
        options.refuse("-o FILE.npz", "rate")
    if motion is not None and written is not None:
        raise UsageError(f"--motion computes a motion, but {motion} is already one; leave one out")
    if ".npz" in files and motion is None and written is None:
        raise UsageError("samples (.npz) require a motion: add MOTION, or --motion FILE")
    run = read_trace(trace)
    moved = None
    if motion is not None:
        from safenav.motion.check.verdict import read_motion_of

        moved = read_motion_of(motion, run, trace)
        if side is not None and abs(moved.header.side - side) > 1e-6 * side:
            own = f"the regions of the motion measure {moved.header.side:g} m, not {side:g} m"
            raise UsageError(f"{own}\n    leave out --side, or compute another motion with it")
    if written is not None:
        from safenav.motion.file import text_of

        moved = _computed(run, side, track=track)
        write_out(written, text_of(moved))
    if (path := files.get(".mcap")) is not None:
        _bag(run, frame_of(run, moved.header.side if moved else side), path, moved)
    if (path := files.get(".npz")) is not None:
        assert moved is not None, "samples are of a motion"
        from safenav.motion.columns import npz_bytes

        write_out(path, npz_bytes(moved, rate))
    if (path := files.get(".csv")) is not None:
        found = (
            waypoints(run_of(run), frame_of(run, side)) if moved is None else timed_waypoints(moved)
        )
        write_out(path, as_csv(found))
    return ExitCode.OK


def _computed(run: Trace, side: float | None, *, track: bool) -> Motion:
    """Return the motion of a trace. Raises UsageError if the trace breaks a rule."""
    from safenav.motion.making import SIDE, motion_of, refuse_broken

    if side is None and run.header.scenario.map.frame is None:
        note = f"no region size given; using {SIDE:g} m (change with --side M)"
        click.echo(f"{run.source}: {note}", err=True)
    refuse_broken(run)
    return motion_of(run, side, track=track)


def _bag(run: Trace, frame: Frame, path: Path, motion: Motion | None) -> None:
    from safenav.report.bag import write_mcap

    poses = None
    if motion is not None:
        from safenav.motion.columns import poses_at
        from safenav.motion.timing import in_time

        run, poses = in_time(run, motion), poses_at(motion, BAG_RATE, frame)
    stamped = messages(run_of(run), frame, poses)
    write_whole(path, lambda part: write_mcap(part, stamped))
    tell(path)
