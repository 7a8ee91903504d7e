"""All rules of a motion, and its findings by time; contradictions between a motion file and its
trace, which rules, pages and tables exclude first."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from safenav.errors import UsageError
from safenav.motion import file
from safenav.motion.check.examination import (
    Examination,
    Finding,
    check_distances,
    check_room,
    check_tracks,
    holdings,
)
from safenav.motion.check.execution import GOALS, check_execution
from safenav.motion.check.order import check_order
from safenav.motion.check.pieces import check_joins, check_path, check_segment
from safenav.trace.file import Trace

AT_LEAST = ("aside", "least_double")
"""The limits of a walker that are lower bounds; the others are upper ones."""
WALKER = ("omega", "height", "size", "clearance", *file.BUILD)
"""The fields that the header must hold for a walker."""

GAPS = {"setpoints": 1.0, "goals": 2.0}
"""The longest time without a measurement, in seconds, by how a robot is driven."""

LONGEST = 2_000_000
"""Seconds of a motion, 23 days: it is sampled from its beginning to its end."""


def read_motion_of(path: Path, trace: Trace, name: Path) -> file.Motion:
    """The motion of this trace in a file; ``name``: the file of the trace.

    Raises InputError as ``read_motion``, and UsageError for the motion of another trace.
    """
    motion = file.read_motion(path)
    found = mismatch(motion, trace)
    if found:
        hint = f"recompute it: safenav export {name} --motion {path}"
        raise UsageError(f"{path}: {found}\n    {hint}")
    return motion


def mismatch(motion: file.Motion, trace: Trace) -> str:
    """The first contradiction between the parts of a motion, or with its trace; empty if there is
    none."""
    header, world = motion.header, trace.header.scenario.map
    if header.trace != trace.digest:
        return "the motion is of another trace: the sha256 of its header is not this one's"
    if (header.rows, header.cols) != (world.rows, world.cols):
        return f"a map of {header.rows} x {header.cols} regions"
    if set(header.robots) != set(trace.robots):
        return f"the robots {', '.join(sorted(header.robots))[:80]} are not those of the trace"
    if header.side <= 0:
        return f"regions of {header.side:g} m"
    if not 0 <= motion.outcome.makespan <= LONGEST:
        return f"a makespan of {motion.outcome.makespan:g} s, not of 0 to {LONGEST:,} s"
    if header.origin != world.placement:
        return "the origin of its map is not that of the trace"
    for name, limits in header.robots.items():
        if not isinstance(limits.get("kind"), str):
            return f"{name}: 'kind' is missing, or no text"
        for key in WALKER if limits["kind"] == "walker" else ("size",):
            value = limits.get(key)
            if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0:
                return f"{name}: '{key}' is missing, or not a positive number"
        if found := _limits(trace, name, limits):
            return f"{name}: {found}"
    stranger = next((line.robot for line in motion.lines if line.robot not in header.robots), None)
    if stranger is not None:
        return f"{stranger[:40]} is not a robot of the header"
    kinds = {name: limits["kind"] for name, limits in header.robots.items()}
    for segment in motion.of(file.Segment):
        if kinds[segment.robot] != "walker":
            return f"{segment.robot} at {segment.t0:.3f} s: it walks but is not a walker"
    for track in motion.of(file.FlownTrack):
        if kinds[track.robot] != "flyer":
            return f"{track.robot}: a simulated flight, but it is not a flyer"
    return ""


def _limits(trace: Trace, name: str, limits: Mapping[str, object]) -> str:
    """The first parameter of a robot that is not that of the trace, or a limit that no robot has;
    empty if there is none."""
    for key, value in (trace.robots[name].model.figures or {}).items():
        if limits.get(key) != value:
            return f"'{key}' is {limits.get(key)!r}, in the trace {value!r}"
    for key, bound in file.BUILD.items() if limits["kind"] == "walker" else ():
        value = limits[key]
        assert isinstance(value, int | float)
        if not (value >= bound if key in AT_LEAST else value <= bound):
            return f"'{key}' is {value:g}; the limit of a walker is {bound:g}"
    if "driven" in limits:
        if trace.header.world != "external":
            return "it is driven, but the trace is of a simulated world"
        most, gap = GAPS.get(str(limits["driven"]), 0.0), limits.get("gap")
        if not (isinstance(gap, int | float) and gap <= most):
            return f"'gap' is {gap!r}, not at most {most:g} s"
    return ""


def check_motion(motion: file.Motion, trace: Trace) -> list[Finding]:
    """Return every broken rule, by time; none if the motion carries out the trace as docs/motion.md
    demands."""
    if found := mismatch(motion, trace):
        return [Finding(0.0, "", "header", found)]
    case = Examination(motion, trace)
    for piece in motion.of(file.Moving):
        _dynamics(case, piece)
    if not case.findings:  # a motion that cannot be solved has no path to check
        _paths(case)
    return sorted(case.findings, key=lambda finding: finding.t)


def _paths(case: Examination) -> None:
    """The rules for motions whose pieces are sound."""
    for name, robot in case.trace.robots.items():
        pieces = case.pieces[name]
        if case.motion.header.robots[name].get("driven") != GOALS:
            check_joins(case, name)
        if pieces and pieces[0].origin != robot.start.region:
            what = f"it starts in region {pieces[0].origin}, not in {robot.start.region}"
            case.wrong(0.0, name, "order", what)
    case.held = holdings(case)
    check_room(case)
    check_tracks(case)
    check_order(case)
    check_distances(case, {n: partial(case.places, n) for n, own in case.pieces.items() if own})
    check_execution(case)


def _dynamics(case: Examination, piece: file.Moving) -> None:
    if isinstance(piece, file.Segment):
        spans = [phase.seconds for phase in piece.phases]
        if min([*spans, *(swing.t1 - swing.t0 for swing in piece.swings)]) <= 0:
            case.wrong(piece.t0, piece.robot, "time", "a phase or a swing that takes no time")
            return
        check_segment(
            piece,
            case.numbers[piece.robot],
            case.walked(piece),
            lambda t, *found: case.wrong(piece.t0 + t, piece.robot, *found),
            cut=(piece.robot, piece.t1) in case.resets,
        )
    elif isinstance(piece, file.Flight):
        check_path(case, piece)
