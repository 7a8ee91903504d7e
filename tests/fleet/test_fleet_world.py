"""A fleet's world over a transport of the test's own: each command ends by one true event."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from runtime.played import Run
from safenav import Mission
from safenav.fleet import steps
from safenav.fleet import world as fleet
from safenav.fleet.fleet_file import ScanUse, Station
from safenav.fleet.place import Places
from safenav.fleet.steps import FleetClock, FleetError
from safenav.fleet.transport import (
    GoalEnd,
    GoalEnded,
    GoalPoint,
    Located,
    Message,
    Performed,
    Reported,
    Scanned,
)
from safenav.fleet.world import FleetWorld
from safenav.outcome import Outcome
from safenav.runtime.worlds.protocol import Acted, WorldEvent
from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.records import Depart
from safenav.trace.vocabulary import ActResult, MovedBy
from safenav.world.map import Heading
from safenav.world.moves import Pose

SCENARIO = """\
safenav: 1
name: hall
map:
  resolution: {resolution}
  grid: |
    #######
    #.....#
    #.....#
    #######
robots:
  {{digit: {{model: digit, start: 8, heading: east, objective: {{visit: [8, 12]}}}},
   quad: {{model: quadcopter, start: 15, objective: {{visit: [15, 19]}}}}}}
"""
ENDS = {end.value: end for end in GoalEnd}


class Robots:
    """A transport whose robots do what a script says, goal by goal: how the goal ends, and where
    the robot is then (in regions east of where it began; None: it says nothing more). Time passes
    while somebody waits."""

    def __init__(self, side: float = 1.0) -> None:
        self.side = side
        self.script: list[tuple[str | None, float | None]] = []
        self.results: list[tuple[ActResult, str]] = []
        self.goals: list[GoalPoint] = []
        self.cancelled: list[str] = []
        self.stamp = self.now = 0.0
        self.clock = FleetClock(lambda: self.now, self.step)
        self.x = {"digit": 1.5, "quad": 1.5}
        self.y = {"digit": 2.5, "quad": 1.5}
        self.post: Callable[[Message], None] = print
        self.closed = False

    def step(self) -> None:
        self.now += 0.01

    def open(self, post: Callable[[Message], None]) -> None:
        self.post = post
        for name in self.x:
            self.locate(name)

    def locate(self, name: str, yaw: float = 0.0) -> None:
        self.stamp += 1.0
        x, y = self.x[name] * self.side, self.y[name] * self.side
        self.post(Located(name, self.stamp, x, y, yaw))

    def missing(self) -> list[str]:
        return [] if "digit" in self.x else ["/digit/move_base"]

    def navigate(self, robot: str, goal: GoalPoint) -> None:
        self.goals.append(goal)
        end, at = self.script.pop(0)
        if at is not None:
            self.x[robot] = at
            self.locate(robot)
        if end is not None:
            self.post(GoalEnded(robot, goal.number, ENDS[end], ""))

    def cancel(self, robot: str) -> None:
        self.cancelled.append(robot)
        if self.script and self.script[0][0] == "canceled":
            self.script.pop(0)
            self.post(GoalEnded(robot, self.goals[-1].number, GoalEnd.CANCELED))

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        assert (action, obstacle) == ("push", "door@9")
        result, text = self.results.pop(0)
        self.post(Performed(robot, number, result, text))

    def close(self) -> None:
        self.closed = True


GIVEN: dict[str, Any] = {"speed": 10.0, "retries": 1, "act": {"push": "push"}}


def started(side: float = 1.0, **station: Any) -> tuple[FleetWorld, Robots, Any]:
    scenario = load_scenario_text(SCENARIO.format(resolution=side), "hall.yaml")
    robots = Robots(side)
    stations = {name: Station(f"/{name}", **GIVEN | station) for name in ("digit", "quad")}
    world = FleetWorld(scenario, stations, robots, robots.clock)
    world.open()
    for name in robots.x if "scan" in station else ():
        scanned(robots, name, 9.0)
    return world, robots, scenario


def told(event: WorldEvent) -> tuple[Any, ...]:
    """An event without its time and command."""
    hidden = ("at", "command", "robot", "obstacle", "reason")
    fields = [getattr(event, name) for name in event.__struct_fields__ if name not in hidden]
    return (type(event).__name__, *fields)


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Time limits of hundredths of seconds."""
    limits = {"SETTLING": 0.05, "STOPPING": 0.05, "FRESH": 0.05, "LATE": 0.05, "STALE": 0.2}
    for name, seconds in limits.items():
        monkeypatch.setattr(steps, name, seconds)
    monkeypatch.setattr(fleet, "FRESH", 0.05)
    yield


EAST = Pose(9, Heading.EAST)
HOME = Pose(8, Heading.EAST)
STEPS = {
    "it arrives": ([("succeeded", 2.5)], ("Arrived",)),
    "it arrives beside the middle, within its tolerance": ([("succeeded", 2.3)], ("Arrived",)),
    "the second try succeeds": ([("aborted", 1.9), ("succeeded", 2.5)], ("Arrived",)),
    "a server that is not there yet": ([("unreachable", None), ("succeeded", 2.5)], ("Arrived",)),
    "a success that is none is tried again": (
        [("succeeded", 1.9), ("succeeded", 2.5)],
        ("Arrived",),
    ),
    "two failures: it is sent back first": (
        [("aborted", 1.9), ("aborted", 1.9), ("succeeded", 1.5)],
        ("Failed", HOME, False),
    ),
    "rejected twice, and home at once": (
        [("rejected", None), ("rejected", None), ("succeeded", 1.5)],
        ("Failed", HOME, False),
    ),
    "it cannot be sent back": (
        [("aborted", 1.9), ("aborted", 1.9), ("aborted", 2.1)],
        ("Lost", frozenset({8, 9})),
    ),
    "it is sent back and stands elsewhere": (
        [("aborted", 1.9), ("aborted", 1.9), ("succeeded", 3.5)],
        ("Elsewhere", Pose(10, Heading.EAST)),
    ),
    "no answer: it is stopped, and sent back": (
        [(None, 1.6), ("canceled", None), ("succeeded", 1.5)],
        ("Failed", HOME, False),
    ),
    "it goes around, through another region: it is stopped, and sent back": (
        [(None, 3.4), ("canceled", None), ("succeeded", 1.5)],
        ("Failed", HOME, False),
    ),
    "it is in the midst of another region": (
        [(None, 4.2), (None, None)],
        ("Lost", frozenset({8, 9, 11})),
    ),
    "no answer to anything": (
        [(None, 1.6), (None, None)],
        ("Lost", frozenset({8, 9})),
    ),
}


@pytest.mark.parametrize("case", STEPS)
@pytest.mark.parametrize("side", [1.0, 2.5])
def test_a_step_ends_by_one_event_that_is_true(case: str, side: float) -> None:
    script, expected = STEPS[case]
    world, robots, scenario = started(side, tolerance=0.25 * side)
    robots.script = list(script)
    assert world.idle and world.start(scenario.robots[0], EAST, 7) is None
    assert not world.idle
    (event,) = world.wait(5.0)
    assert told(event) == expected
    assert event.command == 7 and world.idle
    if case.endswith("it is stopped, and sent back"):
        assert robots.cancelled == ["digit"]
    assert robots.goals[0] == GoalPoint(1, 2.5 * side, 2.5 * side, 0.0)


def test_old_and_doubled_answers_end_nothing() -> None:
    world, robots, scenario = started()
    robots.script = [("succeeded", 2.5), (None, None)]
    world.start(scenario.robots[0], EAST, 1)
    assert [told(event)[0] for event in world.wait(5.0)] == ["Arrived"]
    world.start(scenario.robots[0], Pose(10, Heading.EAST), 2)
    robots.post(GoalEnded("digit", 1, GoalEnd.SUCCEEDED))
    robots.post(GoalEnded("nobody", 2, GoalEnd.SUCCEEDED))
    assert world.wait(0.02) == [] and not world.idle


def seen(world: FleetWorld, robots: Robots, scenario: Scenario) -> Obstacle:
    """A door in region 9, which the quadcopter has reported."""
    robots.post(Reported("quad", "door@9"))
    world.wait(0.05)
    door = world.sense(scenario.robots[0], 9)
    assert door is not None
    return door


def rays(metres: float, ahead: int) -> list[float]:
    """A lidar of four rays, forward, left, back, right: one of them hits something."""
    return [metres if index == ahead else math.inf for index in range(4)]


def scanned(robots: Robots, name: str, metres: float, ahead: int = 0) -> None:
    """A scan where the robot stands, and odometry from after it."""
    robots.stamp += 1.0
    robots.post(Scanned(name, robots.stamp, 0.0, math.pi / 2, rays(metres, ahead)))
    robots.locate(name)


def test_a_lidar_finds_a_door_before_the_arrival_is_told() -> None:
    """A reading from the way there does not count; the one from the new place does."""
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 1)
    assert robots.goals == []
    world.told(Depart(1, 1, "digit", 8, 9, "east", MovedBy.STRATEGY))
    assert len(robots.goals) == 1  # it sets out when the trace has told it
    robots.post(Scanned("digit", robots.stamp - 0.5, 0.0, math.pi / 2, rays(0.6, 1)))
    scanned(robots, "digit", 0.6)
    events = world.wait(5.0)
    assert [told(event)[0] for event in events] == ["Sensed", "Arrived"]
    found = world.sense(scenario.robots[1], 10)
    assert found is not None and found.name == "door@10"
    assert world.sense(scenario.robots[1], 16) is None
    scanned(robots, "digit", 3.0)  # somebody has opened it
    (gone,) = world.wait(5.0)
    assert told(gone) == ("Sensed", "digit", False) and world.sense(scenario.robots[1], 10) is None


@pytest.mark.parametrize("later", ["the other one finds nothing", "it does not look any more"])
def test_a_door_is_not_gone_while_another_lidar_hits_it(later: str) -> None:
    """From beside it a leaf may be too thin for the rays: the two robots would report it gone and
    there again with every scan."""
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 1)
    world.told(Depart(1, 1, "digit", 8, 9, "east", MovedBy.STRATEGY))
    scanned(robots, "digit", 0.6)
    world.wait(5.0)
    robots.x["quad"] = 3.5  # beside region 10, in the south
    world.placed(scenario.robots[1], Pose(17))
    robots.locate("quad")
    scanned(robots, "quad", 3.0)
    assert world.wait(0.05) == [] and world.sense(scenario.robots[1], 10) is not None
    if later == "the other one finds nothing":
        scanned(robots, "digit", 3.0)
    else:
        robots.now += 5.0
        scanned(robots, "quad", 3.0)
    (gone,) = world.wait(5.0)
    assert told(gone)[2] is False and world.sense(scenario.robots[1], 10) is None


def test_a_ray_without_a_reading_says_nothing() -> None:
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    scanned(robots, "digit", 0.6)
    world.wait(0.05)
    robots.now += 5.0
    robots.locate("digit")
    scanned(robots, "digit", math.nan)
    assert world.wait(0.05) == [] and world.sense(scenario.robots[0], 9) is not None
    scanned(robots, "digit", 9.0)
    (gone,) = world.wait(0.05)
    assert told(gone)[2] is False


def test_another_robot_is_no_obstacle() -> None:
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    scanned(robots, "digit", 0.6, ahead=3)  # to the south stands the quadcopter, in 15
    assert world.wait(0.05) == []
    assert world.sense(scenario.robots[0], 15) is None


def passed_by() -> tuple[FleetWorld, Robots, Scenario]:
    """The quadcopter has gone from region 15, south of digit, to 17 a moment ago."""
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    quad = scenario.robots[1]
    for number, at in enumerate((2.5, 3.5), start=1):
        robots.script = [("succeeded", at)]
        world.start(quad, Pose(15 + number), number)
        world.wait(0.02)
        scanned(robots, "quad", 9.0)
        assert [told(event)[0] for event in world.wait(0.05)] == ["Arrived"]
    return world, robots, scenario


def test_a_late_scan_does_not_make_an_obstacle_of_a_robot_that_has_left() -> None:
    """A scan is taken before it is heard. What it still hits later is an obstacle."""
    world, robots, scenario = passed_by()
    scanned(robots, "digit", 0.6, ahead=3)
    assert world.wait(0.05) == [] and world.sense(scenario.robots[0], 15) is None
    robots.now += 2.5
    robots.locate("quad")
    scanned(robots, "digit", 0.6, ahead=3)
    (found,) = world.wait(0.05)
    assert told(found) == ("Sensed", "digit", True)
    assert world.sense(scenario.robots[0], 15) is not None


@pytest.mark.parametrize("there", [False, True])
def test_who_arrives_behind_another_robot_looks_until_it_is_sure(there: bool) -> None:
    """Its first scan hits what was, or is, before it: an arrival is told when that is known."""
    world, robots, scenario = passed_by()
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 3)
    world.wait(0.02)
    scanned(robots, "digit", 0.6, ahead=3)  # to the south, where the quadcopter was
    assert world.wait(1.5) == []
    scanned(robots, "digit", 0.6, ahead=3)
    assert world.wait(0.05) == []
    robots.now += 0.6
    robots.locate("digit")
    scanned(robots, "digit", 0.6 if there else 9.0, ahead=3)
    assert [told(event)[0] for event in world.wait(0.05)] == ["Sensed"] * there + ["Arrived"]
    assert (world.sense(scenario.robots[0], 16) is not None) == there


def test_a_scan_from_the_way_is_not_read_after_the_arrival() -> None:
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 1)
    early = robots.stamp + 0.5
    assert [told(event)[0] for event in world.wait(5.0)] == ["Arrived"]  # no scan in time
    robots.post(Scanned("digit", early, 0.0, math.pi / 2, rays(0.6, 0)))
    assert world.wait(0.05) == [] and world.sense(scenario.robots[0], 10) is None


def test_a_scan_is_read_where_it_was_taken() -> None:
    """The robot turned after the scan: the wall that was on its left is not a door ahead of it."""
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 1)
    assert world.wait(0.0) == []
    stamp = robots.stamp + 0.5
    robots.stamp += 0.4
    robots.locate("digit", math.pi / 2)
    robots.locate("digit")
    robots.post(Scanned("digit", stamp, 0.0, math.pi / 2, rays(0.6, 0)))
    assert [told(event)[0] for event in world.wait(5.0)] == ["Arrived"]
    assert world.sense(scenario.robots[0], 10) is None


def test_a_scan_waits_for_the_odometry_of_its_moment() -> None:
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 1)
    robots.post(Scanned("digit", robots.stamp + 2.5, 0.0, math.pi / 2, rays(0.6, 0)))
    assert world.wait(0.02) == []
    robots.locate("digit")
    assert world.wait(0.0) == []
    robots.locate("digit")
    assert [told(event)[0] for event in world.wait(0.0)] == ["Sensed", "Arrived"]


LATE_ODOMETRY = {
    "it has arrived": ([("succeeded", None)], 1.9, 2.5, ("Arrived",), 1),
    "it is back": (
        [("aborted", 2.1), ("rejected", None), ("succeeded", None)],
        None,
        1.5,
        ("Failed", HOME, False),
        3,
    ),
}


@pytest.mark.parametrize("case", LATE_ODOMETRY)
def test_a_result_waits_for_odometry_that_comes_later(case: str) -> None:
    """It was read at once: a robot that was back stood elsewhere, in a region that it had left."""
    script, on_the_way, there, expected, goals = LATE_ODOMETRY[case]
    world, robots, scenario = started()
    robots.script = list(script)
    world.start(scenario.robots[0], EAST, 1)
    if on_the_way is not None:
        robots.x["digit"] = on_the_way
        robots.locate("digit")
    assert world.wait(0.03) == []
    robots.x["digit"] = there
    robots.locate("digit")
    assert [told(event) for event in world.wait(5.0)] == [expected]
    assert len(robots.goals) == goals


def test_who_comes_back_between_two_regions_is_lost_in_both() -> None:
    """It says that it is back, and still reaches into the region that it was to leave."""
    world, robots, scenario = started(retries=0)
    robots.script = [("aborted", 2.1), ("succeeded", 2.05)]
    world.start(scenario.robots[0], EAST, 1)
    (event,) = world.wait(5.0)
    assert told(event) == ("Lost", frozenset({8, 9}))


def test_lidar_hits_on_a_lost_robot_are_not_an_obstacle() -> None:
    """Its odometry has ended in the region that it has left; its body is in the next one."""
    world, robots, scenario = started(scan=ScanUse("scan", "door"), retries=0)
    robots.script = [(None, 2.4), (None, None)]
    world.start(scenario.robots[1], Pose(16), 1)
    assert [told(event)[0] for event in world.wait(5.0)] == ["Lost"]
    robots.now += 5.0
    robots.script = [("succeeded", 2.5)]
    robots.locate("digit")
    scanned(robots, "digit", 9.0)
    world.start(scenario.robots[0], EAST, 2)
    world.wait(0.02)
    scanned(robots, "digit", 0.6, ahead=3)
    assert [told(event)[0] for event in world.wait(5.0)] == ["Arrived"]
    assert world.sense(scenario.robots[0], 16) is None


@pytest.mark.parametrize("jump", [-3600.0, 3600.0])
def test_a_robot_whose_clock_is_set_is_heard(jump: float) -> None:
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 1)
    old = robots.stamp + 0.5
    robots.post(Scanned("digit", old, 0.0, math.pi / 2, rays(9.0, 1)))
    robots.stamp += jump
    assert world.wait(0.02) == []
    robots.locate("digit")
    scanned(robots, "digit", 9.0)  # may still be from before that
    events = [told(event) for event in world.wait(5.0)]
    robots.now += 2.5
    robots.locate("digit")
    scanned(robots, "digit", 0.6)
    events += [told(event) for event in world.wait(0.02)]
    assert sorted(event[0] for event in events) == ["Arrived", "Sensed"]
    assert world.sense(scenario.robots[0], 10) is not None


@pytest.mark.parametrize("comes", ["free", "door", "hit", "nothing"])
def test_a_robot_sets_out_when_it_has_seen_the_region_before_it(comes: str) -> None:
    """Another robot was what its last scan hit there, and has left since."""
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    robots.x["quad"], robots.y["quad"] = 2.5, 2.5
    world.placed(scenario.robots[1], Pose(9))
    robots.locate("quad")
    scanned(robots, "quad", 9.0)
    scanned(robots, "digit", 0.6)
    assert world.wait(0.02) == [] and world.sense(scenario.robots[0], 9) is None
    robots.script = [("succeeded", 3.5)]
    world.start(scenario.robots[1], Pose(10), 1)
    world.wait(0.02)
    scanned(robots, "quad", 9.0)
    assert [told(event)[0] for event in world.wait(0.02)] == ["Arrived"]
    world.start(scenario.robots[0], EAST, 2)
    assert world.wait(0.02) == [] and len(robots.goals) == 1  # it may be a door
    robots.script = [("succeeded", 2.5)]
    if comes == "free":
        scanned(robots, "digit", 9.0)
    elif comes == "door":
        robots.now += 2.5
        robots.locate("quad")
        scanned(robots, "digit", 0.6)
    elif comes == "hit":
        robots.now += 1.0
        scanned(robots, "digit", 0.6)
    found = [told(event) for event in world.wait(0.02)]
    if comes == "free":
        assert len(robots.goals) == 2
    elif comes == "door":
        assert [event[0] for event in found] == ["Sensed", "Blocked"]
    else:
        robots.now += 1.9
        robots.locate("digit")
        assert [told(event) for event in world.wait(0.5)] == [("Failed", HOME, False)]
    assert len(robots.goals) == 1 + (comes == "free")


def test_a_robot_beside_a_region_does_not_hide_a_door_there() -> None:
    """It stands 0.2 m off the middle of the next region: the hit is too far from it."""
    world, robots, scenario = started(side=2.0, scan=ScanUse("scan", "door"))
    robots.x["quad"], robots.y["quad"] = 3.4, 2.5
    world.placed(scenario.robots[1], Pose(10))
    robots.locate("quad")
    scanned(robots, "digit", 1.5)
    (found,) = world.wait(0.02)
    assert told(found) == ("Sensed", "digit", True)


def test_a_robot_sets_out_towards_one_that_stands_behind_the_region() -> None:
    """In small regions a lidar reaches beyond the one before it."""
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    robots.x["quad"], robots.y["quad"] = 3.2, 2.5
    world.placed(scenario.robots[1], Pose(10))
    robots.locate("quad")
    scanned(robots, "digit", 1.25)
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 1)
    assert world.wait(0.02) == [] and len(robots.goals) == 1


def test_a_leaf_before_a_region_is_not_an_obstacle_in_it() -> None:
    """A robot in the region of an open door is near to its leaves."""
    world, robots, scenario = started(side=2.0, scan=ScanUse("scan", "door"))
    scanned(robots, "digit", 0.4)
    assert world.wait(0.02) == [] and world.sense(scenario.robots[0], 9) is None
    world.start(scenario.robots[0], EAST, 1)
    assert world.wait(0.02) == [] and robots.goals == []


def test_a_door_that_is_ajar_is_not_gone() -> None:
    """Its leaves are beside the middle of the passage, through which a ray goes."""
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    door = seen(world, robots, scenario)
    robots.now += 5.0
    robots.locate("digit")
    for ranges in ([1.02, 9.0, 1.02], [9.0, 9.0, 9.0]):
        robots.stamp += 1.0
        robots.post(Scanned("digit", robots.stamp, -0.2, 0.2, ranges))
        robots.locate("digit")
    (gone,) = world.wait(0.02)
    assert told(gone) == ("Sensed", "digit", False) and gone.obstacle is door
    assert world.wait(0.02) == []


@pytest.mark.parametrize("sensor", ["scan", "report"])
def test_a_late_sighting_of_a_resolved_obstacle_is_of_the_past(sensor: str) -> None:
    """It was on its way when the obstacle was resolved; one that comes 2 s later is new."""
    world, robots, scenario = started(scan=ScanUse("scan", "door"), report="obstacles")
    door = seen(world, robots, scenario)
    robots.results = [(ActResult.DONE, "")]
    world.act(scenario.robots[0], [door], 1)
    assert [told(event)[0] for event in world.wait(5.0)] == ["Acted"]
    for later, expected in ((0.5, []), (2.5, ["Sensed"])):
        robots.now += later
        robots.locate("quad")
        robots.locate("digit")
        if sensor == "scan":
            scanned(robots, "digit", 0.6)
        else:
            robots.post(Reported("quad", "door@9"))
        assert [told(event)[0] for event in world.wait(0.02)] == expected


def test_a_late_report_does_not_hide_what_a_lidar_sees() -> None:
    world, robots, _ = started(scan=ScanUse("scan", "door"), report="obstacles")
    scanned(robots, "digit", 0.6)
    robots.post(Reported("quad", "-door@9"))
    assert [told(event) for event in world.wait(0.02)] == [("Sensed", "digit", True)]
    robots.now += 2.5
    robots.post(Reported("quad", "-door@9"))
    assert [told(event) for event in world.wait(0.02)] == [("Sensed", "quad", False)]


def test_what_was_heard_while_the_run_thought_counts_before_its_time_limits() -> None:
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 1)
    world.told(Depart(1, 1, "digit", 8, 9, "east", MovedBy.STRATEGY))
    robots.now += 60.0  # a synthesis; odometry and scans continue
    robots.locate("digit")
    scanned(robots, "digit", 0.6)
    events = world.wait(0.0)
    assert [told(event)[0] for event in events] == ["Sensed", "Arrived"]
    assert robots.cancelled == [] and len(robots.goals) == 1


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


def test_who_goes_to_a_region_into_which_a_person_moves_another_robot_stops() -> None:
    world, robots, scenario = started()
    other = scenario.robots[1]
    conflicts = scenario.conflict(scenario.robots[0], other)
    robots.script = [(None, 1.7), ("canceled", None), ("succeeded", 1.5)]
    world.start(scenario.robots[0], EAST, 1)
    assert world.wait(0.0) == []
    robots.x["quad"], robots.y["quad"] = 2.5, 2.5
    robots.locate("quad")
    found = [told(event)[0] for event in world.wait(0.02)]
    assert found == ["Failed"] * conflicts and robots.cancelled == ["digit"] * conflicts


@pytest.mark.parametrize("carried", ["digit", "cart"])
def test_a_robot_does_not_set_out_if_a_person_has_moved_one(carried: str) -> None:
    """It waits for its lidar meanwhile: it is lost, or the other one blocks its way."""
    scenario = load_scenario_text(CORRIDOR, "corridor.yaml")
    robots = Robots()
    robots.x, robots.y = {"digit": 1.5, "cart": 3.5}, {"digit": 2.5, "cart": 1.5}
    given = GIVEN | {"scan": ScanUse("scan", "door")}
    stations = {name: Station(f"/{name}", **given) for name in robots.x}
    world = FleetWorld(scenario, stations, robots, robots.clock)  # type: ignore[arg-type]
    world.open()
    world.start(scenario.robots[0], EAST, 1)
    assert world.wait(0.0) == []
    robots.x[carried], robots.y[carried] = 2.5, 2.5
    robots.locate(carried)
    robots.locate("digit")
    if carried == "cart":
        scanned(robots, "digit", 0.6)
    (event,) = world.wait(0.02)
    assert robots.goals == []
    if carried == "digit":
        assert told(event) == ("Lost", frozenset({8, 9}))
    else:
        assert told(event) == ("Blocked", HOME)
        assert event.obstacle.name == "lost_cart@9"  # type: ignore[attr-defined]


def test_who_is_cancelled_before_it_sets_out_does_not_move() -> None:
    world, robots, scenario = started()
    world.start(scenario.robots[0], EAST, 1)
    world.cancel(scenario.robots[0])
    assert [told(event) for event in world.wait(0.0)] == [("Failed", HOME, False)]
    assert robots.goals == [] and world.idle


def test_who_is_cancelled_where_it_was_sent_has_arrived() -> None:
    """Its lidar still looks: the run has no patience for that, and the robot is not lost."""
    world, robots, scenario = started(scan=ScanUse("scan", "door"))
    robots.script = [("succeeded", 2.5)]
    world.start(scenario.robots[0], EAST, 1)
    assert world.wait(0.02) == []
    world.cancel(scenario.robots[0])
    assert [told(event)[0] for event in world.wait(0.0)] == ["Arrived"]
    assert robots.cancelled == []


@pytest.mark.parametrize("late", [False, True])
def test_who_is_stopped_by_a_door_that_was_seen_is_blocked(late: bool) -> None:
    world, robots, scenario = started(report="obstacles")
    robots.script = [(None, 1.6), ("succeeded", 1.5)]
    world.start(scenario.robots[0], EAST, 4)
    if late:
        assert world.wait(0.0) == []
    for text in ("door@9", "elephant@9", "nonsense"):
        robots.post(Reported("quad", text))
    robots.post(GoalEnded("digit", 1, GoalEnd.ABORTED))
    events = world.wait(5.0)
    assert [told(event)[0] for event in events] == ["Sensed", "Blocked"]
    assert told(events[1]) == ("Blocked", HOME)
    # no second try against a closed door, and none if it is seen before the robot sets out
    assert len(robots.goals) == (2 if late else 0)


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


@pytest.mark.parametrize("result", [ActResult.DONE, ActResult.FAILED], ids=str)
def test_a_robot_acts_on_what_only_the_fleet_knows(result: ActResult) -> None:
    """It entered the door that it had found: the team has not heard of that."""
    world, robots, scenario = started()
    door = seen(world, robots, scenario)
    robots.x["digit"] = 2.5
    robots.locate("digit")
    world.placed(scenario.robots[0], EAST)
    robots.results = [(result, "so it is")]
    assert world.act(scenario.robots[0], [], 9) is None
    (event,) = world.wait(5.0)
    done = result is ActResult.DONE
    assert told(event) == ("Acted", [(door, result)] * done) and robots.results == []
    world.act(scenario.robots[1], [], 10)  # it cannot push there
    assert (world.sense(scenario.robots[0], 9) is None) == done


def test_a_reading_from_before_a_resolution_is_of_the_past() -> None:
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


def test_what_an_operator_does_is_heeded() -> None:
    """A resolved obstacle is forgotten; a robot that is not where it was put is lost in both."""
    world, robots, scenario = started()
    door = seen(world, robots, scenario)
    world.cleared(door)
    assert world.sense(scenario.robots[0], 9) is None
    world.placed(scenario.robots[0], Pose(11, Heading.EAST))
    event = world.start(scenario.robots[0], Pose(12, Heading.EAST), 1)
    assert event is not None and told(event) == ("Lost", frozenset({8, 11})) and world.idle
    robots.x["digit"] = 4.5
    robots.locate("digit")
    robots.script = [("succeeded", 5.5)]
    world.wait(0.05)
    assert world.start(scenario.robots[0], Pose(12, Heading.EAST), 2) is None
    assert [told(event)[0] for event in world.wait(5.0)] == ["Arrived"]


def test_a_robot_that_is_silent_or_begins_elsewhere_is_named() -> None:
    scenario = load_scenario_text(SCENARIO.format(resolution=1.0), "hall.yaml")
    stations = {name: Station(f"/{name}") for name in ("digit", "quad")}
    robots = Robots()
    robots.x = {}
    with pytest.raises(FleetError, match=r"no answer in 0\.05 s from /digit/odom, /quad/odom"):
        FleetWorld(scenario, stations, robots, robots.clock).open(patience=0.05)
    robots = Robots()
    robots.x["digit"] = 3.5
    with pytest.raises(FleetError, match=r"digit is in region 10 \(3.50, 2.50 m\).* begin in 8"):
        FleetWorld(scenario, stations, robots, robots.clock).open()


def test_a_map_without_metres_is_refused() -> None:
    text = SCENARIO.format(resolution=1.0).replace("  resolution: 1.0\n", "")
    scenario = load_scenario_text(text, "hall.yaml")
    with pytest.raises(FleetError, match=r"add 'resolution: 1\.0'"):
        FleetWorld(scenario, {}, Robots())


def test_who_comes_back_looks_before_it_says_that_it_failed() -> None:
    """A door may have closed after its last look; the goal then failed for a reason."""
    world, robots, scenario = started(scan=ScanUse("scan", "door"), retries=0)
    robots.script = [("aborted", 1.6), ("succeeded", 1.5)]
    world.start(scenario.robots[0], EAST, 4)
    assert world.wait(0.0) == [] and not robots.script
    scanned(robots, "digit", 0.6)
    events = world.wait(5.0)
    assert [told(event)[0] for event in events] == ["Sensed", "Blocked"]
    assert told(events[1]) == ("Blocked", HOME)


def test_what_is_gone_while_somebody_acts_on_it_is_told_by_the_result() -> None:
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


CORRIDOR = """\
safenav: 1
name: corridor
map:
  resolution: 1.0
  grid: |
    #######
    #.....#
    ###.###
    #######
catalogue: {robots: {cart: {mobility: free, layer: ground, capabilities: []}}}
robots:
  digit: {model: digit, start: [1, 1], heading: east, objective: {visit: [[1, 5]]}}
  cart: {model: cart, start: [2, 3], objective: {hold: [2, 3]}}
until: {rounds: 1}
clock: live
"""


class Obedient:
    """A transport whose robots are at once where they are sent. Somebody moves the cart into the
    corridor when digit sets out first, and back when digit has been sent ``patience`` times. Time
    passes while somebody waits, with odometry."""

    def __init__(self, places: Places, scenario: Scenario) -> None:
        self.places, self.stamp, self.now = places, 0.0, 0.0
        self.clock = FleetClock(lambda: self.now, self.step)
        self.at = {r.name: places.centre(r.start.region) for r in scenario.robots}
        self.entered: list[int | None] = []

    def open(self, post: Callable[[Message], None]) -> None:
        self.post = post
        self.step()

    def step(self) -> None:
        self.now += 0.01
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


def test_nobody_enters_a_region_into_which_somebody_has_moved_a_robot() -> None:
    scenario = load_scenario_text(CORRIDOR, "corridor.yaml")
    robots = Obedient(Places(scenario.map, scenario.map.frame), scenario)  # type: ignore[arg-type]
    stations = {name: Station(f"/{name}") for name in ("digit", "cart")}
    world = FleetWorld(scenario, stations, robots, robots.clock)  # type: ignore[arg-type]
    world.open()
    run = Run()
    mission = Mission(scenario, world=world, listeners=[run, world.told], attended=True)
    mission.start()
    for _ in range(500):
        if mission.waiting is not None:
            break
        mission.step()
    assert "lost_cart@10" in mission.waiting.explanation and 10 not in robots.entered
    robots.locate("cart", *robots.places.centre(17))  # it is carried back
    for _ in range(500):
        if mission.result is not None:
            break
        mission.step()
    assert mission.result.outcome is Outcome.COMPLETED and 10 in robots.entered
    assert not run.findings
