"""A fleet's world over a transport of the test's own: each command ends by one true event."""

from collections.abc import Callable

import pytest

from fleet.hall import CORRIDOR, SCENARIO, Case, Robots, cases
from runtime.played import Run
from safenav import Mission
from safenav.errors import Outcome, UsageError
from safenav.fleet.file import Station
from safenav.fleet.transport import GoalEnd, GoalEnded, GoalPoint, Located, Message, Places
from safenav.fleet.world import FleetWorld
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text

pytestmark = pytest.mark.usefixtures("short_limits")


CASES = cases()


@pytest.mark.parametrize("name", CASES)
def test_a_command_ends_by_one_event_that_is_true(name: str) -> None:
    Case(CASES[name])


def test_a_robot_that_is_silent_or_begins_in_another_pose_is_named() -> None:
    scenario = load_scenario_text(SCENARIO.format(resolution=1.0), "hall.yaml")
    stations = {name: Station(f"/{name}") for name in ("digit", "quad")}
    robots = Robots()
    robots.x = {}
    with pytest.raises(UsageError, match=r"no answer in 0\.05 s from /digit/odom, /quad/odom"):
        FleetWorld(scenario, stations, robots).open(patience=0.05)
    robots = Robots()
    robots.x["digit"] = 3.5
    with pytest.raises(
        UsageError,
        match=r"digit is in region 10 \(3.50, 2.50 m\).* begins with it in 8 \(.*\n.*of the map",
    ):
        FleetWorld(scenario, stations, robots).open()
    robots = Robots()
    robots.open = lambda post: [  # type: ignore[method-assign, assignment]
        post(Located(name, 1.0, robots.x[name], robots.y[name], 1.5)) for name in robots.x
    ]
    with pytest.raises(UsageError, match=r"digit faces north; the run .* facing east\n"):
        FleetWorld(scenario, stations, robots).open()


def test_a_map_without_metres_is_refused() -> None:
    text = SCENARIO.format(resolution=1.0).replace("  resolution: 1.0\n", "")
    scenario = load_scenario_text(text, "hall.yaml")
    with pytest.raises(UsageError, match=r"add 'resolution: 1\.0'"):
        FleetWorld(scenario, {}, Robots())


class Obedient:
    """A transport whose robots arrive immediately. A person moves the cart into the
    corridor when digit sets out first, and back when digit has been sent ``patience`` times. Time
    passes during waits, with odometry."""

    def __init__(self, places: Places, scenario: Scenario) -> None:
        self.places, self.stamp, self.time = places, 0.0, 0.0
        self.at = {r.name: places.centre(r.start.region) for r in scenario.robots}
        self.entered: list[int | None] = []

    def open(self, post: Callable[[Message], None]) -> None:
        self.post = post
        self.step()

    def now(self) -> float:
        return self.time

    def step(self) -> None:
        self.time += 0.01
        for name, (x, y) in self.at.items():
            self.locate(name, x, y)

    def locate(self, name: str, x: float, y: float) -> None:
        self.stamp += 1.0
        self.at[name] = x, y
        self.post(Located(name, self.stamp, x, y, 0.0))

    def missing(self) -> list[str]:
        return []

    def navigate(self, robot: str, goal: GoalPoint) -> None:
        if robot == "digit" and not self.entered:
            self.locate("cart", *self.places.centre(10))
        if robot == "digit":
            self.entered.append(self.places.region(goal.x, goal.y))
        self.locate(robot, goal.x, goal.y)
        self.post(GoalEnded(robot, goal.number, GoalEnd.SUCCEEDED))

    def cancel(self, robot: str) -> None: ...

    def close(self) -> None: ...


def test_no_robot_enters_a_region_into_which_a_person_moved_another() -> None:
    scenario = load_scenario_text(CORRIDOR, "corridor.yaml")
    robots = Obedient(Places(scenario.map, scenario.map.frame), scenario)  # type: ignore[arg-type]
    stations = {name: Station(f"/{name}") for name in ("digit", "cart")}
    world = FleetWorld(scenario, stations, robots)  # type: ignore[arg-type]
    world.open()
    run = Run()
    mission = Mission(scenario, world=world, listeners=[run, world.observe], attended=True)
    mission.start()
    for _ in range(500):
        if mission.waiting is not None:
            break
        mission.step()
    assert "lost_cart@10" in mission.waiting.explanation and 10 not in robots.entered
    robots.locate("cart", *robots.places.centre(17))  # a person carries it back
    for _ in range(500):
        if mission.result is not None:
            break
        mission.step()
    assert mission.result.outcome is Outcome.COMPLETED and 10 in robots.entered
    assert not run.findings
