"""Runs with a clock: the shipped runs, with steps and actions that take as long as robots take."""

from __future__ import annotations

import json
from functools import cache

from motion.runs import trace_of
from safenav.motion.file.records import Action, Flight, Line, Motion, MotionHeader, MotionOutcome
from safenav.motion.in_time import in_time
from safenav.motion.making import floor_of
from safenav.motion.timing.order import Deed, StepNode, order_of
from safenav.pace.robot import acted_by, pace_of
from safenav.trace.writing import as_data


@cache
def live_trace(name: str, slower: float = 1.0) -> bytes:
    """The trace of a shipped run, as it would be with a clock; ``slower``: of every other step."""
    trace = trace_of(name)
    floor = floor_of(trace)
    robots = trace.header.scenario.robots
    paces = {
        name: pace_of(robot.motion, floor.cols, floor.side, robot.heading)
        for name, robot in robots.items()
    }
    at = {name: robot.start for name, robot in robots.items()}
    free = dict.fromkeys(robots, 0.0)
    ends: list[float] = []
    lines: list[Line] = []
    for node in order_of(trace, floor):
        now = max([0.0, *(ends[edge.node] for edge in node.after)])
        if isinstance(node, StepNode):
            now = max(now, free[node.robot])
            factor = slower if node.index % 2 else 1.0
            end = now + paces[node.robot].step(now, node.origin, node.to, slower=factor)
            paces[node.robot].arrived(end)
            at[node.robot] = node.to
            free[node.robot] = end
            where = (node.robot, node.tick, "step", node.origin, node.to, now, end)
            lines.append(Flight(*where, ()))
        elif isinstance(node, Deed):
            team = (node.robot, *node.others)
            now = max([now, *(free[name] for name in team)])
            end = now + acted_by([(paces[n], at[n]) for n in team], now, node.region)
            for name in team:
                free[name] = end
                what = (node.action, node.obstacle, node.region, now, end)
                lines.append(Action(name, node.tick, *what))
        else:
            end = now
        ends.append(end)
    header = MotionHeader("", "", floor.side, floor.rows, floor.cols, (0, 0, 0), {}, 0, 0, 0)
    outcome = MotionOutcome(max(ends, default=0.0), {}, {}, ())
    told = in_time(trace, Motion(header, tuple(lines), outcome))
    data = [as_data(told.header), *(as_data(record) for record in told.records)]
    return "".join(json.dumps(line) + "\n" for line in data).encode()
