"""How long the robots of a scenario take for their steps and actions."""

from __future__ import annotations

from safenav.pace.robot import SIDE, Pace, pace_of
from safenav.scenario.model import Scenario
from safenav.scenario.motion import resolved


def paces(scenario: Scenario) -> dict[str, Pace]:
    """A pace for each robot, at its start at time 0."""
    frame, found = scenario.map.frame, {}
    side = SIDE if frame is None else max(frame.resolution)
    for robot in scenario.robots:
        model, heading = robot.model, robot.start.heading
        motion = resolved(model.motion, model.size, model.speed, model.layer)
        facing = None if heading is None else heading.label
        least = model.timing.least
        found[robot.name] = pace_of(motion, scenario.map.cols, side, facing, least)
    return found
