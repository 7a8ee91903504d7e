"""Contradictory reports: robots repeatedly report that they are lost in regions of other robots,
and sensors report unknown obstacles as absent. No robot is sent to a region in which another may
be.

``SAFENAV_FUZZ=500`` plays as many missions.
"""

import os
from collections.abc import Callable, Sequence
from random import Random
from typing import Any

import pytest

from drawn import loads
from safenav import Arrived, Lost, Mission, Pose, Robot, Scenario, Sensed, WorldEvent
from safenav.outcome import Outcome
from safenav.runtime.worlds.simulation import LiveSimulation
from support.missions import mission

COUNT = int(os.environ.get("SAFENAV_FUZZ", "4"))


def crowd(seed: int) -> dict[str, Any]:
    return mission("crowd_hidden", seed) | {"clock": "live"}


class Contradicting(LiveSimulation):
    """A simulation with impossible reports. ``may``: possible regions of each robot by the reports
    so far; ``wrong``: steps into a region in which another robot may be."""

    def __init__(self, scenario: Scenario, random: Random) -> None:
        super().__init__(scenario)
        self.scenario, self.random, self.wrong = scenario, random, list[str]()
        self.may = {robot.name: {robot.start.region} for robot in scenario.robots}

    def start(self, robot: Robot, pose: Pose, command: int) -> None:
        for other in self.scenario.robots:
            if robot.conflicts(other) and pose.region in self.may[other.name]:
                self.wrong.append(f"{robot.name} to {pose.region}, where {other.name} may be")
        self.may[robot.name].add(pose.region)
        super().start(robot, pose, command)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        return [told for event in super().wait(timeout) for told in self._told(event)]

    def _told(self, event: WorldEvent) -> Sequence[WorldEvent]:
        if not isinstance(event, Arrived):
            return [event]
        name, regions = event.robot, {self._poses[event.robot].region}
        if self.random.random() < 0.1:
            others = set().union(*self.may.values())
            near = {n for region in others for n in self.scenario.map.neighbours(region)}
            regions = {*self.random.sample(sorted(others | near), 2)}
            event = Lost(event.at, name, frozenset(regions), command=event.command)
        self.may[name] = regions
        listed = self.random.sample(self.scenario.obstacles, 1) if self.scenario.obstacles else []
        gone = (o for o in listed if o.region not in self.truth.standing())
        return [event, *(Sensed(event.at, each, there=False) for each in gone)]


@pytest.mark.parametrize("seed", range(COUNT))
def test_no_robot_is_sent_to_a_region_where_another_may_be(
    seed: int, played: Callable[[], None]
) -> None:
    _, scenario = loads(crowd, seed)
    world = Contradicting(scenario, Random(f"contradictions {seed}"))
    result = Mission(scenario, world=world).run()
    assert result.outcome in (Outcome.COMPLETED, Outcome.OPERATOR_NEEDED, Outcome.TIME_LIMIT)
    assert world.wrong == []
    played()
