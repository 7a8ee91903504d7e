"""Actions of a fleet's robots: each has one result."""

import math

import pytest

from fleet.hall import (
    EAST,
    rays,
    seen,
    started,
    told,
)
from safenav.fleet.file import ScanUse
from safenav.fleet.transport import (
    Performed,
    Reported,
    Scanned,
)
from safenav.runtime.worlds.protocol import Acted
from safenav.trace.vocabulary import ActResult

pytestmark = pytest.mark.usefixtures("short_limits")


def test_an_action_ends_when_its_robot_is_back() -> None:
    """Who opens a door enters its region; odometry of that is later than the result."""
    world, robots, scenario = started()
    door = seen(world, robots, scenario)
    robots.x["digit"] = 2.4
    robots.locate("digit")
    robots.results = [(ActResult.FAILED, "")]
    world.act(scenario.robots[0], [door], 1)
    assert world.wait(0.02) == [] and not world.idle
    robots.x["digit"] = 1.5
    robots.locate("digit")
    assert [told(event)[0] for event in world.wait(0.0)] == ["Acted"]
    robots.now += 2.5
    robots.post(Reported("quad", "-door@9"))  # its action is over: others may see it gone
    assert [told(event) for event in world.wait(0.02)] == [("Sensed", "quad", False)]


@pytest.mark.parametrize("result", list(ActResult), ids=str)
def test_an_action_is_always_answered(result: ActResult) -> None:
    world, robots, scenario = started()
    door = seen(world, robots, scenario)
    robots.results = [(result, "so it is")]
    world.act(scenario.robots[0], [door], 9)
    (event,) = world.wait(5.0)
    assert isinstance(event, Acted)
    assert event.reason == ("so it is" if result is ActResult.FAILED else "")
    assert told(event) == ("Acted", [(door, result)]) and event.command == 9
    assert (world.sense(scenario.robots[0], 9) is None) == (result is not ActResult.FAILED)


@pytest.mark.parametrize(
    ("result", "why", "reason"),
    [
        (ActResult.DONE, "so it is", ""),
        (ActResult.FAILED, "so it is", "so it is"),
        (ActResult.FAILED, "", ""),
    ],
)
def test_a_robot_acts_on_what_only_the_fleet_knows(
    result: ActResult, why: str, reason: str
) -> None:
    """It entered the door that it had found: the team has not heard of that."""
    world, robots, scenario = started()
    door = seen(world, robots, scenario)
    robots.x["digit"] = 2.5
    robots.locate("digit")
    world.placed(scenario.robots[0], EAST)
    robots.results = [(result, why)]
    assert world.act(scenario.robots[0], [], 9) is None
    (event,) = world.wait(5.0)
    assert isinstance(event, Acted) and event.reason == reason
    done = result is ActResult.DONE
    assert told(event) == ("Acted", [(door, result)]) and robots.results == []
    world.act(scenario.robots[1], [], 10)  # it cannot push there
    assert (world.sense(scenario.robots[0], 9) is None) == done


def test_a_scan_taken_before_a_resolution_is_ignored_after_it() -> None:
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    door = seen(world, robots, scenario)
    stamp = robots.stamp + 0.5
    robots.stamp += 1.0
    robots.locate("digit")
    robots.results = [(ActResult.DONE, "")]
    world.act(scenario.robots[0], [door], 1)
    world.wait(5.0)
    robots.post(Scanned("digit", stamp, 0.0, math.pi / 2, rays(0.6, 0)))
    assert world.wait(0.05) == [] and world.sense(scenario.robots[0], 9) is None


def test_an_obstacle_gone_during_an_action_is_in_its_result() -> None:
    """A robot beside it sees the door open before the one that pushes it has answered."""
    world, robots, scenario = started(report="obstacles")
    door = seen(world, robots, scenario)
    robots.perform = lambda *_: None  # type: ignore[method-assign]
    world.act(scenario.robots[0], [door], 1)
    robots.post(Reported("quad", "-door@9"))
    assert world.wait(0.05) == []
    robots.post(Performed("digit", 1, ActResult.DONE))
    (event,) = world.wait(5.0)
    assert told(event) == ("Acted", [(door, ActResult.DONE)])
    assert world.sense(scenario.robots[0], 9) is None
