"""All rules of a motion, in the order of time."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from itertools import pairwise

from safenav.motion.check.actions import check_actions
from safenav.motion.check.bodies import check_distances
from safenav.motion.check.charge import check_charge
from safenav.motion.check.execution import GOALS, check_execution, driven_robots
from safenav.motion.check.finding import NEAR, Finding
from safenav.motion.check.gliding import check_drive, check_flight
from safenav.motion.check.joins import by_robot, check_joins, inner_joins
from safenav.motion.check.order import check_clock, check_order, conflicts_of, passages
from safenav.motion.check.room import Grid, Holding, check_overlaps, check_room, holdings
from safenav.motion.check.tracking import check_flown, check_track
from safenav.motion.check.walking import check_segment
from safenav.motion.file.records import (
    Action,
    BodyPush,
    Drive,
    Flight,
    FlownTrack,
    GoalLine,
    Link,
    Motion,
    Moving,
    Reset,
    Segment,
)
from safenav.trace.trace import Trace

WALKER = ("omega", "height", "step", "aside", "friction", "swing", "size")
"""The fields that the header must hold for a walker."""


def check_motion(motion: Motion, trace: Trace, digest: str) -> list[Finding]:
    """Every broken rule, by time; none if the motion carries out the trace (``digest``: sha256
    of its file) as docs/motion.md demands."""
    found = _header(motion, trace, digest)
    if found:
        return found
    report = found.append
    lines = motion.lines
    moving = [line for line in lines if isinstance(line, Moving)]
    actions = [line for line in lines if isinstance(line, Action)]
    pieces = by_robot(moving)
    limits = motion.header.robots
    unknown = next((name for name in pieces if name not in limits), None)
    if unknown is not None:
        return [Finding(0.0, unknown, "header", "is not a robot of the header")]
    for piece in moving:
        _dynamics(piece, limits, found)
    if found:
        return _by_time(found)  # what cannot be solved has no path to look at
    grid = Grid(motion.header.rows, motion.header.cols, motion.header.side)
    conflicts = conflicts_of(trace.header.scenario)
    makespan = motion.outcome.makespan
    resets = {(line.robot, line.t) for line in lines if isinstance(line, Reset)}
    goals = by_robot([line for line in lines if isinstance(line, GoalLine)])
    for name in trace.header.scenario.robots:
        pushes = [line for line in lines if isinstance(line, BodyPush) and line.robot == name]
        if limits[name].get("driven") != GOALS:
            check_joins(name, pieces.get(name, []), pushes, resets, makespan, report)
        _start(name, trace, pieces.get(name, []), found)
    held = holdings(lines, report)
    for holding in held:
        if not _free(trace, holding.region):
            what = f"it reserves region {holding.region}, a wall"
            report(Finding(holding.begin, holding.robot, "wall", what))
    check_overlaps(held, conflicts, report)
    check_room(moving, held, motion.header, limits, report)
    _wind(motion, held, grid, found)
    driven = bool(driven_robots(motion))
    steps = passages(trace, {**goals, **pieces}, report, driven=driven)
    check_clock(trace, steps, lines, report, driven=driven)
    check_order(trace, steps, actions, report)
    check_actions(trace, actions, pieces, grid, limits, report)
    check_charge(trace, steps, actions, pieces, limits, makespan, report)
    check_distances(pieces, limits, conflicts, makespan, report)
    check_execution(motion, trace, pieces, held, conflicts, report)
    _outcome(motion, found)
    return _by_time(found)


def _by_time(found: list[Finding]) -> list[Finding]:
    return sorted(found, key=lambda finding: finding.t)


def _header(motion: Motion, trace: Trace, digest: str) -> list[Finding]:
    header, world = motion.header, trace.header.scenario.map

    def wrong(what: str) -> list[Finding]:
        return [Finding(0.0, "", "header", what)]

    if header.trace != digest:
        return wrong("the motion is of another trace: the sha256 of its header is not this one's")
    if (header.rows, header.cols) != (world.rows, world.cols):
        return wrong(f"a map of {header.rows} x {header.cols} regions")
    if set(header.robots) != set(trace.header.scenario.robots):
        return wrong(f"the robots {', '.join(sorted(header.robots))} are not those of the trace")
    if header.side <= 0:
        return wrong(f"regions of {header.side:g} m")
    for name, limits in header.robots.items():
        wanted = WALKER if limits.get("kind") == "walker" else ("size",)
        for key in wanted:
            value = limits.get(key)
            if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0:
                return wrong(f"{name}: '{key}' is missing, or no positive number")
    return []


def _dynamics(
    piece: Moving, limits: Mapping[str, Mapping[str, object]], found: list[Finding]
) -> None:
    numbers = {
        key: float(value)
        for key, value in limits[piece.robot].items()
        if isinstance(value, int | float)
    }
    if isinstance(piece, Segment):
        if limits[piece.robot].get("kind") != "walker" and "omega" not in numbers:
            found.append(Finding(piece.t0, piece.robot, "header", "it walks but is not a walker"))
        else:
            check_segment(piece, numbers, found.append)
    elif isinstance(piece, Flight):
        check_flight(piece, numbers, found.append)
    elif isinstance(piece, Drive):
        check_drive(piece, numbers, found.append)
    inner_joins(piece, found.append)


def _wind(motion: Motion, held: list[Holding], grid: Grid, found: list[Finding]) -> None:
    """The flights that were simulated: every flyer's, to the end, if there is wind."""
    for name, limits in motion.header.robots.items():
        tracks = [
            line for line in motion.lines if isinstance(line, FlownTrack) and line.robot == name
        ]
        flights = [line for line in motion.lines if isinstance(line, Flight) and line.robot == name]
        if not tracks:
            if motion.header.gust > 0 and limits.get("kind") == "flyer" and flights:
                found.append(Finding(0.0, name, "track", "no flight in the wind is recorded"))
            continue
        numbers = {key: float(v) for key, v in limits.items() if isinstance(v, int | float)}
        before = len(found)
        begin = 0.0
        for track in tracks:
            if abs(track.t0 - begin) > NEAR:
                what = f"no flight in the wind is recorded from {begin:.3f} s on"
                found.append(Finding(begin, name, "track", what))
                return
            begin = track.t0 + track.step * len(track.rows)
            check_track(track, numbers, found.append)
        if begin < motion.outcome.makespan - tracks[-1].step:
            what = f"no flight in the wind is recorded from {begin:.3f} s on"
            found.append(Finding(begin, name, "track", what))
        if len(found) == before:
            check_flown(tracks, held, grid, flights, numbers, found.append)


def _start(name: str, trace: Trace, pieces: list[Moving], found: list[Finding]) -> None:
    start = trace.header.scenario.robots[name].start
    if pieces and pieces[0].origin != start:
        what = f"it starts in region {pieces[0].origin}, not in {start}"
        found.append(Finding(0.0, name, "order", what))


def _free(trace: Trace, region: int) -> bool:
    row, col = divmod(region, trace.header.scenario.map.cols)
    if not 0 <= row < trace.header.scenario.map.rows:
        return False
    return trace.header.scenario.map.grid[row][col] != "#"


def _outcome(motion: Motion, found: list[Finding]) -> None:
    """The makespan is when the last piece ends, and the length of the chain that is named."""
    makespan, chain = motion.outcome.makespan, motion.outcome.chain
    spans: dict[str, list[tuple[float, float]]] = {}
    for line in motion.lines:
        if isinstance(line, Moving):
            spans.setdefault(line.robot, []).append((line.t0, line.t1))
    last = max((end for own in spans.values() for _, end in own), default=0.0)

    def wrong(what: str) -> None:
        found.append(Finding(makespan, "", "makespan", what))

    resets = {(line.robot, line.t) for line in motion.lines if isinstance(line, Reset)}
    given_up = any((name, own[-1][1]) in resets for name, own in spans.items())
    if spans and abs(last - makespan) > NEAR and not (given_up and last < makespan):
        wrong(f"the last piece of motion ends at {last:.3f} s, not at {makespan:.3f} s")
    length = sum(link.t1 - link.t0 for link in chain)
    if chain and abs(length - makespan) > 1e-6 * max(1, len(chain)):
        wrong(f"the longest chain takes {length:.3f} s, the motion {makespan:.3f} s")
    for before, after in pairwise(chain):
        if abs(after.t0 - before.t1) > NEAR:
            wrong(f"the chain waits for {after.t0 - before.t1:.3f} s at {before.t1:.3f} s")
    for link in chain:
        if not _done(link, spans.get(link.robot, [])):
            wrong(f"{link.robot} does not do '{link.what}' at {link.t0:.3f} s")


def _done(link: Link, spans: list[tuple[float, float]]) -> bool:
    """Whether pieces of the robot, in order, fill the link."""
    filled = 0.0
    for begin, end in spans[max(0, bisect_left(spans, (link.t0, 0.0)) - 1) :]:
        if begin >= link.t1:
            break
        filled += max(0.0, min(end, link.t1) - max(begin, link.t0))
    return abs(filled - (link.t1 - link.t0)) < NEAR * 10
