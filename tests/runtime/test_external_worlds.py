"""A world that is no simulation: obstacles that no scenario lists, doors that fall shut again,
pushes that fail. The trace of such a run is one that the checker and the replay can read."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import pytest
from msgspec.structs import replace

from once import beside
from runtime.played import Run, begin, completed, loaded, play
from runtime.worlds import Bare, Driven, Remote
from safenav import Mission
from safenav.report.terminal.story import Story
from safenav.run.reading import read_run
from safenav.runtime.worlds.protocol import Acted, Arrived, WorldEvent
from safenav.runtime.worlds.truth import SimulatedWorld
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.settings import Failures
from safenav.trace.vocabulary import ActResult
from safenav.world.moves import Pose

BUILDING = """
name: building
map: {grid: ["###########", "#....#....#", "#.........#", "#....#....#", "###########"]}
robots:
  drone: {model: quadcopter, start: [1, 1], objective: {patrol: [[1, 1], [3, 9]]}}
  walker: {model: digit, start: [3, 2], heading: east, objective: {visit: [[3, 1], [1, 4]]}}
"""
DOOR = 2 * 11 + 5
SUSPECTED = "obstacles: [{type: door, region: [2, 7]}, {type: uncertainty, region: [1, 7], %s}]\n"


class Building:
    """A door that is not in the scenario. It jams for ``jams`` pushes, and falls shut again after
    the walker has gone, ``closings`` times in all."""

    def __init__(self, scenario: Scenario, jams: int = 0, closings: int = 1) -> None:
        self.at = {robot.name: robot.start.region for robot in scenario.robots}
        self.jams = jams
        self.closings = closings
        self.closed = True
        self.door = Obstacle(built_in().obstacles["door"], DOOR)

    def sense(self, robot: Robot, region: int) -> Obstacle | None:
        del robot
        return self.door if self.closed and region == DOOR else None

    def move(self, robot: Robot, pose: Pose) -> None:
        if robot.name == "walker" and self.at["walker"] == DOOR != pose.region:
            self.closed = self.closed or self.closings > 0
        self.at[robot.name] = pose.region

    def act(self, robot: Robot) -> Iterable[tuple[Obstacle, bool | None]]:
        if robot.name != "walker" or self.at["walker"] != DOOR or not self.closed:
            return
        if self.jams:
            self.jams -= 1
            return
        self.closed = False
        self.closings -= 1
        yield self.door, None


def built(text: str = BUILDING, **options: int) -> Run:
    """Return a run in the building, which must complete, with the door resolved in its story."""
    scenario, run, told = loaded(text), Run(), list[str]()
    story = Story(scenario, lambda line: told.append(str(line)))
    Mission(scenario, world=Building(scenario, **options), listeners=[run, story]).run()
    assert run.outcome["outcome"] == "completed", run.outcome
    assert any("door@27" in line and "resolves" in line for line in told)
    assert not run.findings, run.findings
    return run


def test_an_unlisted_obstacle_is_declared_before_it_is_named(tmp_path: Path) -> None:
    run = built()
    records = run.records
    assert records[0]["scenario"]["world"] == "external"
    discovered = run.one("discovered")
    assert discovered["obstacle"] == {
        "type": "door",
        "name": "door@27",
        "region": DOOR,
        "needs": [{"action": "push", "regions": [DOOR], "robots": 1, "together": False}],
        "blocks": ["drone", "walker"],
        "traversable": None,
    }
    first = next(record for record in records if record.get("obstacle") == "door@27")
    assert first["type"] == "violation" and records.index(discovered) < records.index(first)
    trace = tmp_path / "trace.jsonl"
    trace.write_text(run.text)
    (hidden,) = read_run(trace).hidden.values()
    assert (hidden.name, hidden.region) == ("door@27", DOOR)


def test_a_door_that_jams_and_falls_shut_is_resolved_each_time() -> None:
    run = built(jams=1, closings=3)
    assert run.one("discovered")
    order = [kind for kind, _ in run.order("violation", "resolved")]
    assert order.count("resolved") >= 2 and order[0] == "violation"
    assert run.one("acted")["results"] == {"door@27": "failed"}


JAMMED = """
name: a door that does not open
map: {grid: ["#########", "#.......#", "#########"]}
catalogue:
  robots: {pusher: {mobility: free, layer: ground, capabilities: [push], size: 0.5, speed: 1}}
robots: {p: {model: pusher, start: [1, 1], objective: {visit: [[1, 7], [1, 1]]}}}
obstacles: [{type: door, region: [1, 4]}]
limits: {ticks: 60}
"""
AROUND = JAMMED.replace('"#########"]', '"#.#####.#", "#.......#", "#########"]')


class Stuck(Driven):
    """A blocking world whose door never opens: ``act`` returns nothing."""

    def act(self, robot: Robot) -> list[tuple[Obstacle, bool | None]]:
        del robot
        return []


class StuckInTime(Remote):
    """The same in time: an action ends with an empty ``Acted``, or one with the failure."""

    says: tuple[ActResult, ...] = ()

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted:
        del obstacles
        (door,) = self.simulation.truth.standing().values()
        there = self.simulation._poses[robot.name].region == door.region
        found = tuple((door, result) for result in self.says if there)
        return Acted(self.now(), robot.name, found, command=command)


class Failing(StuckInTime):
    says = (ActResult.FAILED,)


@pytest.mark.parametrize("world", [Stuck, StuckInTime, Failing])
@pytest.mark.parametrize("objective", ["visit: [[1, 7], [1, 1]]", "hold: [1, 7]"])
@pytest.mark.parametrize("text", [JAMMED, AROUND])
def test_no_robot_passes_a_door_that_does_not_open(
    text: str, objective: str, world: type[Stuck | StuckInTime]
) -> None:
    """It has entered the door to open it, tries twice, and goes back; then around, if it can."""
    clock = "" if world is Stuck else "clock: live\n"
    scenario, run = loaded(text.replace("visit: [[1, 7], [1, 1]]", objective) + clock), Run()
    Mission(scenario, world=world(scenario), listeners=[run]).run()
    door = scenario.obstacles[0].region
    lines = run.all("move" if world is Stuck else "depart")
    assert not [line for line in lines if (line["from"], line["to"]) == (door, door + 1)]
    assert run.outcome["outcome"] == ("completed" if text is AROUND else "operator_needed")
    assert run.all("violation", obstacle="door@13") and not run.findings
    assert [line.get("barred") for line in run.all("acted")] == [None, ["door@13"]]
    if text is AROUND:
        left = next(line for line in lines if line["from"] == door != line["to"])
        left["to"] = door + 1
        assert "unresolved-obstacle" in run.broken


class Swinging(Driven):
    """The door falls shut whenever the robot has left it."""

    shut = True

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        (self.door,) = scenario.obstacles
        self.here = scenario.robots[0].start.region

    def sense(self, robot: Robot, region: int) -> Obstacle | None:
        del robot
        return self.door if self.shut and region == self.door.region else None

    def move(self, robot: Robot, pose: Pose) -> None:
        del robot
        self.shut = self.shut or self.here == self.door.region != pose.region
        self.here = pose.region

    def act(self, robot: Robot) -> Iterable[tuple[Obstacle, bool | None]]:
        del robot
        if self.shut and self.here == self.door.region:
            self.shut = False
            yield self.door, None


def test_rounds_do_not_restart_when_a_robot_opens_a_door_again_in_passing() -> None:
    assert completed(JAMMED, world=Swinging).one("resolved")


class Sliding(Building):
    """Some moves of the drone, by their number, end in another region than commanded."""

    def __init__(self, scenario: Scenario, slides: dict[int, int]) -> None:
        super().__init__(scenario)
        self.closed, self.slides, self.moves = False, slides, 0

    def move(self, robot: Robot, pose: Pose) -> Pose:  # type: ignore[override]
        self.moves += robot.name == "drone"
        slides = robot.name == "drone" and self.moves in self.slides
        pose = Pose(self.slides[self.moves]) if slides else pose
        super().move(robot, pose)
        return pose


@pytest.mark.parametrize(
    ("model", "objective", "slides"),
    [
        ("quadcopter", "hold: [1, 1]", {2: 23}),
        ("pusher", "patrol: [[1, 1], [1, 3]]", {1: 13, 2: 24}),
        ("quadcopter", "patrol: [[1, 1], [1, 3]]", {3: 24}),
        ("quadcopter", "cover: [[1, 1], [2, 2]]", {3: 23}),
    ],
)
def test_a_robot_that_slides_continues_from_where_it_ends(
    model: str, objective: str, slides: dict[int, int]
) -> None:
    text = BUILDING.replace("quadcopter", model).replace("patrol: [[1, 1], [3, 9]]", objective)
    text += "catalogue: {robots: {pusher: {mobility: free, layer: air, capabilities: [push]}}}\n"
    run = Run()
    scenario = loaded(text + "until: {rounds: 3}\n")
    Mission(scenario, world=Sliding(scenario, slides), listeners=[run]).run()
    assert run.outcome["outcome"] == "completed", run.outcome
    assert [r["to"] for r in run.all("move", result="elsewhere")] == [*slides.values()]
    assert not run.findings


@pytest.mark.parametrize("region", [12, DOOR, DOOR + 1])
def test_a_robot_may_be_carried_while_the_team_waits(region: int) -> None:
    """For a change of the scenario, as no robot can open the door; even into the door. Where it can
    meet its objective, it does not wait any longer."""
    text = BUILDING[: BUILDING.index("  walker")].replace(
        "patrol: [[1, 1], [3, 9]]", "hold: [2, 7]"
    )
    text += "changes: [{at: 20, robot: drone, service: back}]\nlimits: {ticks: 25}\n"
    scenario, run = loaded(text), Run()
    world = Sliding(scenario, {10: region})
    world.closed = True
    Mission(scenario, world=world, listeners=[run]).run()
    (carried,) = run.all("move", result="elsewhere")
    assert run.all("waiting")[0]["tick"] < carried["tick"] < 20
    ends = "operator_needed" if region == 12 else "completed"
    assert run.outcome["outcome"] == ends and not run.findings
    assert (run.outcome["ticks"] < 19) == (region != 12)


SLOW = beside(__file__, "scenarios/external_worlds_slow.yaml")


class Reached(Sliding):
    """No robot is sent to where the other one is, nor into the door, which only the drone sees."""

    def move(self, robot: Robot, pose: Pose) -> Pose:
        others = [at for name, at in self.at.items() if name != robot.name]
        assert pose.region not in others and not (self.closed and pose.region == DOOR)
        return super().move(robot, pose)


@pytest.mark.parametrize("slides", [{2: DOOR}, {1: DOOR, 3: DOOR + 4}])
def test_a_step_of_several_ticks_is_given_up_where_another_robot_has_slid(
    slides: dict[int, int],
) -> None:
    """A world learns of such a step when it ends; the other robot may then be carried on."""
    scenario, run = loaded(SLOW), Run()
    Mission(scenario, world=Reached(scenario, slides), listeners=[run]).run()
    first = run.all("move", result="elsewhere", robot="slow")[0]
    assert first["from"] == first["to"] == DOOR - 1 and not run.findings
    assert 3 in slides or DOOR not in run.path("slow")[:9]


class HalfBlind(Reached):
    """The door is closed in the middle of the step, when a robot (``seer``) looks at it."""

    seer, looks = "drone", 0

    def sense(self, robot: Robot, region: int) -> Obstacle | None:
        self.looks += robot.name == "slow" and region == DOOR
        sees = self.looks > 1 if self.seer == "slow" else robot.name == "drone" and region == DOOR
        self.closed = sees or self.closed
        return super().sense(robot, region)


@pytest.mark.parametrize("seer", ["drone", "slow"])
def test_a_step_of_several_ticks_is_given_up_where_an_obstacle_has_been_found(seer: str) -> None:
    text = SLOW.replace("model: cart", "model: quadcopter").replace(
        "visit: [[2, 7], [1, 7]]", "hold: [2, 5]"
    )
    scenario, run = loaded(text), Run()
    world = HalfBlind(scenario, {})
    world.seer = seer
    Mission(scenario, world=world, listeners=[run]).run()
    assert run.outcome["outcome"] == "operator_needed" and not run.findings


def test_a_suspected_obstacle_may_be_absent() -> None:
    """The drone flies through both; the truth of the second one is anybody's guess."""
    run = built(BUILDING + SUSPECTED % "traversable: true")
    listed = run.records[0]["scenario"]["obstacles"]
    assert [entry["traversable"] for entry in listed] == [None, None]
    assert run.one("discovered")


def test_a_program_that_steps_itself_can_give_up() -> None:
    mission, run = begin(BUILDING, world=Building)
    for _ in range(12):
        mission.step()
    result = mission.give_up("battery low")
    assert mission.give_up("again") is mission.result is result
    last = run.records[-1]
    assert (last["outcome"], last["explanation"]) == ("interrupted", "battery low")
    assert not run.findings


class SinceEpoch(Bare):
    """A clock of seconds since 1970 that advances only by waits: by nothing if they are short. No
    step ends before it is cancelled."""

    def __init__(self) -> None:
        super().__init__()
        self.time, self.waits = 1.7e9, 0

    def start(self, robot: Robot, pose: Pose, command: int) -> None:
        del robot, pose, command

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        self.waits += 1
        assert self.waits < 2000, f"no time passes in wait({timeout})"
        return super().wait(timeout)


@pytest.mark.parametrize("timeout", [1.0, 1.1, 1.3, 1.7])
def test_waits_are_long_enough_for_clocks_that_advance_by_them(timeout: float) -> None:
    scenario = replace(loaded(BUILDING + "clock: live\n"), failures=Failures(timeout=timeout))
    lost = play(scenario, world=SinceEpoch()).all("arrive", result="lost")
    assert {line["robot"] for line in lost} == {"drone", "walker"}
    assert [line["t"] for line in lost] == [pytest.approx(2 * timeout, abs=0.2)] * 2


class Sudden(Bare):
    """Steps take no time by the world's clock, but for each seventh, which takes half a second."""

    def __init__(self) -> None:
        super().__init__()
        self.steps, self.under_way = 0, list[WorldEvent]()

    def start(self, robot: Robot, pose: Pose, command: int) -> WorldEvent | None:
        del pose
        self.steps += 1
        if self.steps % 7:
            return Arrived(self.time, robot.name, command=command)
        self.under_way.append(Arrived(self.time + 0.5, robot.name, command=command))
        return None

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        super().wait(timeout)
        ended = [event for event in self.under_way if event.at <= self.time]
        self.under_way = [event for event in self.under_way if event.at > self.time]
        return ended


def test_steps_that_take_no_time_make_the_patience_no_shorter_than_a_second() -> None:
    world = Sudden()
    run = completed(BUILDING + "clock: live\n", world=world)
    assert world.steps > 14 and not run.all("arrive", result="lost")


class Flickering(SimulatedWorld):
    """A camera that sees the door once, and then no longer while it is closed."""

    looks = 0

    def sense(self, robot: Robot, region: int) -> Obstacle | None:
        found = super().sense(robot, region)
        self.looks += found is not None
        return found if self.looks < 2 else None


def test_a_known_door_stays_closed_when_its_sensor_no_longer_reports_it() -> None:
    text = (Path(__file__).parent / "cases/buttons/pressed_before_it_passes.yaml").read_text()
    scenario = loaded(text.replace("visit: [[2, 2], [2, 6]]", "visit: [[2, 6], [2, 2]]"))
    completed(scenario, world=Flickering(scenario))


class Early(Bare):
    """A floor without announced changes, on which the door that is listed for later stands
    already."""

    def sense(self, robot: Robot, region: int) -> Obstacle | None:
        del robot
        return next((each for each in self.scenario.obstacles if each.region == region), None)

    def __init__(self, scenario: Scenario) -> None:
        super().__init__()
        self.scenario, self.entered = scenario, set[int]()

    def start(self, robot: Robot, pose: Pose, command: int) -> WorldEvent | None:
        self.entered.add(pose.region)
        return super().start(robot, pose, command)


def test_a_sensed_obstacle_is_closed_although_it_is_listed_for_later() -> None:
    scenario = loaded("""
map: {grid: ["....", "...."]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: []}}
  obstacles: {gate: {action: push}}
robots: {c: {model: cart, start: 0, objective: {visit: [3, 0]}}}
obstacles: [{type: gate, region: 2, from: 900}]
until: {rounds: 1}
clock: live
""")
    world = Early(scenario)
    run = completed(scenario, world=world)
    assert 2 not in world.entered and run.one("violation", obstacle="gate@2")
