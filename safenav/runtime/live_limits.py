"""Scenarios whose strategies rely on the others' speed, which a live run does not keep."""

from __future__ import annotations

from safenav.errors import UsageError
from safenav.scenario.model import Scenario, Tracking
from safenav.scenario.reading.promises import in_seconds


def refuse_if_unsafe(scenario: Scenario) -> None:
    """Raises UsageError, with the robot and the reason, if a strategy of the scenario assumes how
    far other robots move between two of its looks."""
    if scenario.promises:
        raise UsageError(
            "a live run cannot keep promises in ticks: a tick has no length there; use "
            f"'clock: lockstep', or {in_seconds(scenario)}"
        )
    for robot in scenario.robots:
        others = [o.name for o in scenario.robots if o is not robot and scenario.conflict(robot, o)]
        if robot.tracking is Tracking.NEARBY or not others:
            continue
        moves = f"{others[0]} moves" if len(others) == 1 else f"{' and '.join(others)} move"
        raise UsageError(
            f"{robot.name} has 'tracking: {robot.tracking.value}': its strategy assumes that "
            f"{moves} at most one region between two of its looks, which a "
            "live run does not keep; use 'clock: lockstep' or 'tracking: nearby'"
        )
