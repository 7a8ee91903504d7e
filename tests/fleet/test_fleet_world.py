"""A fleet's world over a transport of the test's own: each command ends by one true event."""

import math
from collections.abc import Callable

import pytest

from fleet.hall import (
    EAST,
    GIVEN,
    HOME,
    SCENARIO,
    Robots,
    rays,
    scanned,
    seen,
    set_out,
    started,
    told,
)
from once import beside
from runtime.played import Run
from safenav import Mission
from safenav.errors import UsageError
from safenav.fleet.file import ScanUse, Station
from safenav.fleet.goals import FleetClock
from safenav.fleet.transport import (
    GoalEnd,
    GoalEnded,
    GoalPoint,
    Located,
    Message,
    Places,
    Reported,
    Scanned,
)
from safenav.fleet.world import FleetWorld
from safenav.outcome import Outcome
from safenav.runtime.worlds.protocol import Failed, Lost, WorldEvent
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.records import Depart
from safenav.trace.vocabulary import MovedBy
from safenav.world.map import Heading
from safenav.world.poses import Pose

pytestmark = pytest.mark.usefixtures("short_limits")


FAILED = ("Failed", HOME, False)
STEPS = {
    "it arrives": ([("succeeded", 2.5)], ("Arrived",)),
    "it arrives beside the middle, within its tolerance": ([("succeeded", 2.3)], ("Arrived",)),
    "a failure: it is sent back first": ([("aborted", 1.9), ("succeeded", 1.5)], FAILED),
    "rejected, and home at once": ([("rejected", None), ("succeeded", 1.5)], FAILED),
    "a server that is not there": ([("unreachable", None), ("succeeded", 1.5)], FAILED),
    "a success that is none": ([("succeeded", 1.9), ("succeeded", 1.5)], FAILED),
    "it cannot be sent back": (
        [("aborted", 1.9), *[("aborted", 2.1)] * 9],
        ("Lost", frozenset({8, 9})),
    ),
    "it is sent back at the second try": (
        [("aborted", 1.9), ("aborted", 2.1), ("succeeded", 1.5)],
        FAILED,
    ),
    "it is sent back and stands elsewhere": (
        [("aborted", 1.9), ("succeeded", 3.5)],
        ("Elsewhere", Pose(10, Heading.EAST)),
    ),
    "no answer: it is stopped, and sent back": (
        [(None, 1.6), ("canceled", None), ("succeeded", 1.5)],
        FAILED,
    ),
    "it goes around, through another region: it is stopped, and sent back": (
        [(None, 3.4), ("canceled", None), ("succeeded", 1.5)],
        FAILED,
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


REFUSES = [("rejected", None)] * 9
LOST = {
    "goals are refused": (REFUSES, 1.5, "rejected; its return ended: rejected"),
    "it returns too slowly": (
        [("rejected", None), (None, 1.6)],
        1.6,
        "rejected; its return did not end within 0.1 s",
    ),
    "no odometry": ([(None, None)] * 2, None, "its odometry is 0.5 s old"),
    "it is in a wall": ([("succeeded", 0.5)], 0.5, "by its odometry it is in no free region"),
}


@pytest.mark.parametrize("case", LOST)
def test_a_lost_robot_reports_the_reason(case: str) -> None:
    script, stays, reason = LOST[case]
    world, robots, _ = set_out(script)
    events: list[WorldEvent] = []
    while not events:
        events += world.wait(0.01)
        if stays is not None:
            robots.x["digit"] = stays
            robots.locate("digit")
    (event,) = events
    assert isinstance(event, Lost) and event.reason == reason
    if case == "it returns too slowly":
        assert robots.cancelled == ["digit"]


def test_a_return_is_sent_again_after_a_pause_to_a_robot_that_refused_it() -> None:
    """It was asked three times within milliseconds: an emergency stop of a second lost it."""
    world, robots, _ = set_out([("rejected", None), ("rejected", None), ("succeeded", 1.5)])
    assert world.wait(0.01) == [] and len(robots.goals) == 2
    (event,) = world.wait(1.0)
    assert told(event) == FAILED and len(robots.goals) == 3


def test_a_time_limit_is_reported_in_seconds_of_the_goal() -> None:
    """It was told in seconds of the run."""
    world, robots, scenario = started()
    robots.script = [(None, 1.6), ("canceled", None), ("succeeded", 1.5)]
    robots.now += 100.0
    robots.locate("digit")
    world.start(scenario.robots[0], EAST, 1)
    (event,) = world.wait(30.0)
    assert isinstance(event, Failed) and event.reason == "the goal did not end within 0.4 s"


def test_results_of_earlier_goals_are_ignored() -> None:
    world, robots, scenario = set_out([("succeeded", 2.5), (None, None)])
    assert [told(event)[0] for event in world.wait(5.0)] == ["Arrived"]
    world.start(scenario.robots[0], Pose(10, Heading.EAST), 2)
    robots.post(GoalEnded("digit", 1, GoalEnd.SUCCEEDED))
    robots.post(GoalEnded("nobody", 2, GoalEnd.SUCCEEDED))
    assert world.wait(0.02) == [] and not world.idle


LATE_ODOMETRY = {
    "it has arrived": ([("succeeded", None)], 1.9, 2.5, ("Arrived",), 1),
    "it is back": (
        [("aborted", 2.1), ("succeeded", None)],
        None,
        1.5,
        FAILED,
        2,
    ),
}


@pytest.mark.parametrize("case", LATE_ODOMETRY)
def test_a_result_waits_for_later_odometry(case: str) -> None:
    """It was read too early: a robot that was back stood in a region that it had left."""
    script, on_the_way, there, expected, goals = LATE_ODOMETRY[case]
    world, robots, _ = set_out(script)
    if on_the_way is not None:
        robots.x["digit"] = on_the_way
        robots.locate("digit")
    assert world.wait(0.03) == []
    robots.x["digit"] = there
    robots.locate("digit")
    assert [told(event) for event in world.wait(5.0)] == [expected]
    assert len(robots.goals) == goals


def test_a_robot_that_returns_to_a_border_is_lost_in_both_regions() -> None:
    """It says that it is back, and still reaches into the region that it was to leave."""
    world, _, _ = set_out([("aborted", 2.1), ("succeeded", 2.05)])
    (event,) = world.wait(5.0)
    assert told(event) == ("Lost", frozenset({8, 9}))


@pytest.mark.parametrize("jump", [-3600.0, 3600.0])
def test_messages_count_after_the_clock_of_a_robot_is_set(jump: float) -> None:
    world, robots, scenario = set_out([("succeeded", 2.5)], scan=ScanUse("door"))
    old = robots.stamp + 0.5
    robots.post(Scanned("digit", old, 0.0, math.pi / 2, rays(9.0, 1)))
    robots.stamp += jump
    assert world.wait(0.02) == []
    robots.locate("digit")
    scanned(robots, "digit", 9.0)  # the scan may be older than the jump
    events = [told(event) for event in world.wait(5.0)]
    robots.now += 2.5
    robots.locate("digit")
    scanned(robots, "digit", 0.6)
    events += [told(event) for event in world.wait(0.02)]
    assert sorted(event[0] for event in events) == ["Arrived", "Sensed"]
    assert world.sense(scenario.robots[0], 10) is not None


def test_messages_during_a_synthesis_count_before_time_limits() -> None:
    world, robots, _ = set_out([("succeeded", 2.5)], scan=ScanUse("door"))
    world.observe(Depart(1, 1, "digit", 8, 9, "east", MovedBy.STRATEGY))
    robots.now += 60.0  # a synthesis; odometry and scans continue
    robots.locate("digit")
    scanned(robots, "digit", 0.6)
    events = world.wait(0.0)
    assert [told(event)[0] for event in events] == ["Sensed", "Arrived"]
    assert robots.cancelled == [] and len(robots.goals) == 1


def test_a_robot_stops_when_another_is_carried_into_its_target_region() -> None:
    world, robots, scenario = started()
    other = scenario.robots[1]
    conflicts = scenario.robots[0].conflicts(other)
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
    given = GIVEN | {"scan": ScanUse("door")}
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


def test_a_robot_cancelled_before_it_departs_does_not_move() -> None:
    world, robots, scenario = started()
    world.start(scenario.robots[0], EAST, 1)
    world.cancel(scenario.robots[0])
    assert [told(event) for event in world.wait(0.0)] == [("Failed", HOME, False)]
    assert robots.goals == [] and world.idle


def test_a_robot_cancelled_at_its_destination_is_reported_as_arrived() -> None:
    """Its lidar still looks: the run has no patience for that, and the robot is not lost."""
    world, robots, scenario = set_out([("succeeded", 2.5)], scan=ScanUse("door"))
    assert world.wait(0.02) == []
    world.cancel(scenario.robots[0])
    assert [told(event)[0] for event in world.wait(0.0)] == ["Arrived"]
    assert robots.cancelled == []


@pytest.mark.parametrize("late", [False, True])
def test_a_robot_stopped_by_a_known_door_is_blocked(late: bool) -> None:
    world, robots, _ = set_out([(None, 1.6), ("succeeded", 1.5)], report="obstacles", command=4)
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


def test_an_operator_resolves_obstacles_and_puts_robots_back() -> None:
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


def test_a_robot_that_is_silent_or_begins_in_another_pose_is_named() -> None:
    scenario = load_scenario_text(SCENARIO.format(resolution=1.0), "hall.yaml")
    stations = {name: Station(f"/{name}") for name in ("digit", "quad")}
    robots = Robots()
    robots.x = {}
    with pytest.raises(UsageError, match=r"no answer in 0\.05 s from /digit/odom, /quad/odom"):
        FleetWorld(scenario, stations, robots, robots.clock).open(patience=0.05)
    robots = Robots()
    robots.x["digit"] = 3.5
    with pytest.raises(
        UsageError,
        match=r"digit is in region 10 \(3.50, 2.50 m\).* begins with it in 8 \(.*\n.*of the map",
    ):
        FleetWorld(scenario, stations, robots, robots.clock).open()
    robots = Robots()
    robots.open = lambda post: [  # type: ignore[method-assign, assignment]
        post(Located(name, 1.0, robots.x[name], robots.y[name], 1.5)) for name in robots.x
    ]
    with pytest.raises(UsageError, match=r"digit faces north; the run .* facing east\n"):
        FleetWorld(scenario, stations, robots, robots.clock).open()


def test_a_map_without_metres_is_refused() -> None:
    text = SCENARIO.format(resolution=1.0).replace("  resolution: 1.0\n", "")
    scenario = load_scenario_text(text, "hall.yaml")
    with pytest.raises(UsageError, match=r"add 'resolution: 1\.0'"):
        FleetWorld(scenario, {}, Robots())


def test_a_robot_that_returns_scans_before_it_reports_failure() -> None:
    """A door may have closed after its last look; the goal then failed for a reason."""
    world, robots, _ = set_out(
        [("aborted", 1.6), ("succeeded", 1.5)], scan=ScanUse("door"), command=4
    )
    assert world.wait(0.0) == [] and not robots.script
    scanned(robots, "digit", 0.6)
    events = world.wait(5.0)
    assert [told(event)[0] for event in events] == ["Sensed", "Blocked"]
    assert told(events[1]) == ("Blocked", HOME)


CORRIDOR = beside(__file__, "scenarios/side_room.yaml")


class Obedient:
    """A transport whose robots arrive immediately. A person moves the cart into the
    corridor when digit sets out first, and back when digit has been sent ``patience`` times. Time
    passes during waits, with odometry."""

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


def test_no_robot_enters_a_region_into_which_a_person_moved_another() -> None:
    scenario = load_scenario_text(CORRIDOR, "corridor.yaml")
    robots = Obedient(Places(scenario.map, scenario.map.frame), scenario)  # type: ignore[arg-type]
    stations = {name: Station(f"/{name}") for name in ("digit", "cart")}
    world = FleetWorld(scenario, stations, robots, robots.clock)  # type: ignore[arg-type]
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
