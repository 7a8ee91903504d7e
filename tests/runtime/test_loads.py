"""Loads in a world that reports more than was commanded; others are ``cases/loads``, and random
ones ``campaigns``."""

from collections.abc import Sequence

from msgspec.structs import replace

from runtime.facts import case
from runtime.played import completed
from runtime.worlds import Clocked
from safenav.runtime.worlds.protocol import Acted, WorldEvent
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.trace.vocabulary import ActResult


class Hasty(Clocked):
    """A world outside that reports each action on a load as done, taking it as well."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        self.asked: dict[str, Sequence[Obstacle]] = {}

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        self.asked[robot.name] = obstacles
        return self.simulation.act(robot, obstacles, command)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        return [
            replace(event, found=[(load, ActResult.DONE) for load in self.asked[event.robot]])
            if isinstance(event, Acted)
            else event
            for event in self.simulation.wait(timeout)
        ]


def test_a_world_that_reports_more_than_was_commanded_delivers_no_load() -> None:
    """The run said that all was done when a robot had taken the load."""
    run = completed(case("loads/one_after_the_other") + "clock: live\n", world=Hasty)
    assert [line["at"] for line in run.all("resolved")] == [11, 11]
    late = [line["reason"] for line in run.all("late")]
    assert {*late} == {f"other needs are still open (pallet@16{n}: done)" for n in ("", "#2")}
