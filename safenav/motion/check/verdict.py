"""All rules of a motion, and its findings by time."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from itertools import pairwise

from safenav.motion.check.examination import NEAR, Examination, Finding
from safenav.motion.check.execution import GOALS, check_execution
from safenav.motion.check.joins import check_joins, check_path
from safenav.motion.check.mismatch import mismatch
from safenav.motion.check.order import (
    Passage,
    check_actions,
    check_charge,
    check_clock,
    check_order,
    passages,
)
from safenav.motion.check.room import (
    check_distances,
    check_never_together,
    check_overlaps,
    check_room,
    holdings,
)
from safenav.motion.check.tracking import check_wind
from safenav.motion.check.walking import check_segment
from safenav.motion.file.records import Flight, Motion, Moving, Segment
from safenav.trace.reading import Trace


def check_motion(motion: Motion, trace: Trace) -> list[Finding]:
    """Return every broken rule, by time; none if the motion carries out the trace as docs/motion.md
    demands."""
    if found := mismatch(motion, trace):
        return [Finding(0.0, "", "header", found)]
    case = Examination(motion, trace)
    for piece in motion.of(Moving):
        _dynamics(case, piece)
    if not case.findings:  # a motion that cannot be solved has no path to check
        _paths(case)
    return sorted(case.findings, key=lambda finding: finding.t)


def _paths(case: Examination) -> None:
    """The rules for motions whose pieces are sound."""
    for name, robot in case.trace.header.scenario.robots.items():
        pieces = case.pieces[name]
        if case.motion.header.robots[name].get("driven") != GOALS:
            check_joins(case, name)
        if pieces and pieces[0].origin != robot.start:
            what = f"it starts in region {pieces[0].origin}, not in {robot.start}"
            case.wrong(0.0, name, "order", what)
    case.held = holdings(case)
    for holding in case.held:
        if not _free(case.trace, holding.region):
            what = f"it reserves region {holding.region}, a wall"
            case.wrong(holding.begin, holding.robot, "wall", what)
    check_overlaps(case)
    check_never_together(case)
    check_room(case)
    check_wind(case)
    steps = passages(case)
    check_clock(case, steps)
    check_order(case, steps)
    check_actions(case)
    check_charge(case, steps)
    check_distances(case, {n: partial(case.places, n) for n, own in case.pieces.items() if own})
    check_execution(case)
    _outcome(case, steps)


def _dynamics(case: Examination, piece: Moving) -> None:
    if isinstance(piece, Segment):
        check_segment(
            piece,
            case.numbers[piece.robot],
            case.walk(piece),
            lambda t, *found: case.wrong(piece.t0 + t, piece.robot, *found),
            cut=(piece.robot, piece.t1) in case.resets,
        )
    elif isinstance(piece, Flight):
        check_path(case, piece)


def _free(trace: Trace, region: int) -> bool:
    row, col = divmod(region, trace.header.scenario.map.cols)
    if not 0 <= row < trace.header.scenario.map.rows:
        return False
    return trace.header.scenario.map.grid[row][col] != "#"


def _outcome(case: Examination, steps: Mapping[int, Passage]) -> None:
    """Check that the makespan is the end of the last piece and the length of the recorded chain,
    whose links are steps and actions of the motion."""
    makespan, chain = case.makespan, case.motion.outcome.chain
    ends = {name: own[-1].t1 for name, own in case.pieces.items() if own}
    last = max(ends.values(), default=0.0)

    def wrong(what: str) -> None:
        case.wrong(makespan, "", "makespan", what)

    given_up = any(end in case.resets for end in ends.items())
    if ends and abs(last - makespan) > NEAR and not (given_up and last < makespan):
        wrong(f"the last piece of motion ends at {last:.3f} s, not at {makespan:.3f} s")
    length = sum(link.t1 - link.t0 for link in chain)
    if chain and abs(length - makespan) > 1e-6 * max(1, len(chain)):
        wrong(f"the longest chain takes {length:.3f} s, the motion {makespan:.3f} s")
    for before, after in pairwise(chain):
        if abs(after.t0 - before.t1) > NEAR:
            wrong(f"the chain waits for {after.t0 - before.t1:.3f} s at {before.t1:.3f} s")
    done = {(step.robot, f"{step.origin} -> {step.to}", step.end) for step in steps.values()}
    done |= {(act.robot, f"{act.action} {act.obstacle}", act.t1) for act in case.actions}
    done |= {(name, "stop", end) for name, end in ends.items()}
    by_robot: dict[tuple[str, str], list[float]] = {}
    for robot, what, end in done:
        by_robot.setdefault((robot, what), []).append(end)
    for link in chain:
        times = by_robot.get((link.robot, link.what), [])
        if not any(abs(end - link.t1) < NEAR for end in times):
            wrong(f"{link.robot} does not do '{link.what}' until {link.t1:.3f} s")
