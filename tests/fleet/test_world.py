"""A fleet's world over a transport that follows a script: each command ends by one true event.

``hall.txt`` has a case for each paragraph, with its name and its lines. ``->``: the events, or the
obstacle, that must result. A paragraph ``define NAME`` has the lines for which its name stands.
"""

import math
from collections.abc import Callable, Iterator

import pytest

from once import beside
from runtime.played import Run
from safenav import (
    ActResult,
    Heading,
    Mission,
    Obstacle,
    Outcome,
    Pose,
    Scenario,
    UsageError,
    built_in,
    load_scenario_text,
)
from safenav.fleet import goals, transport
from safenav.fleet import world as fleet
from safenav.fleet.file import ScanUse, Station
from safenav.fleet.world import FleetWorld
from safenav.runtime.worlds import protocol

HALL = beside(__file__, "scenarios/two_robots.yaml")
CORRIDOR = beside(__file__, "scenarios/side_room.yaml")
YARD = beside(__file__, "scenarios/crate_and_gate.yaml")
SIDES = ("front", "left", "back", "right")
LIMITS = {"SETTLING": 0.05, "STOPPING": 0.05, "FRESH": 0.05, "LATE": 0.05, "STALE": 0.2}
LIMITS |= {"PAUSE": 0.02, "RETURNING": 0.05}


@pytest.fixture(autouse=True)
def short_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time limits of hundredths of seconds."""
    for name, seconds in LIMITS.items():
        monkeypatch.setattr(goals, name, seconds)
    monkeypatch.setattr(fleet, "FRESH", 0.05)


class Robots:
    """A transport whose robots do what a script says, goal by goal: the end of the goal, and the
    robot's position then (in regions east of the map's corner; None: no more messages). Time passes
    during waits."""

    def __init__(self, scenario: Scenario) -> None:
        world, frame = scenario.map, scenario.map.frame
        self.side = 1.0 if frame is None else frame.resolution
        self.script: list[tuple[str | None, float | None]] = []
        self.results: list[tuple[ActResult, str]] = []
        self.goals: list[transport.GoalPoint] = []
        self.services: list[str] = []
        self.cancelled: list[str] = []
        self.stamp = self.time = 0.0
        starts = {robot.name: world.position(robot.start.region) for robot in scenario.robots}
        self.x = {name: col + 0.5 for name, (_, col) in starts.items()}
        self.y = {name: world.rows - row - 0.5 for name, (row, _) in starts.items()}
        self.yaw = 0.0
        self.post: Callable[[transport.Message], None] = print

    def now(self) -> float:
        return self.time

    def step(self) -> None:
        self.time += 0.01

    def open(self, post: Callable[[transport.Message], None]) -> None:
        self.post = post
        for name in self.x:
            self.locate(name, self.yaw)

    def locate(self, name: str, yaw: float = 0.0) -> None:
        self.stamp += 1.0
        x, y = self.x[name] * self.side, self.y[name] * self.side
        self.post(transport.Located(name, self.stamp, x, y, yaw))

    def scan(self, name: str, stamp: float, metres: float, side: str) -> None:
        """A lidar of four rays: one of them hits something."""
        rays = [metres if each == side else math.inf for each in SIDES]
        self.post(transport.Scanned(name, stamp, 0.0, math.pi / 2, rays))

    def missing(self) -> list[str]:
        return []

    def navigate(self, robot: str, goal: transport.GoalPoint) -> None:
        self.goals.append(goal)
        end, at = self.script.pop(0)
        if at is not None:
            self.x[robot] = at
            self.locate(robot)
        if end is not None:
            self.post(transport.GoalEnded(robot, goal.number, transport.GoalEnd(end)))

    def cancel(self, robot: str) -> None:
        self.cancelled.append(robot)
        if self.script and self.script[0][0] == "canceled":
            self.script.pop(0)
            self.post(transport.GoalEnded(robot, self.goals[-1].number, transport.GoalEnd.CANCELED))

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        self.services.append(f"{robot} {action} {obstacle}")
        if self.results:
            self.post(transport.Performed(robot, number, *self.results.pop(0)))

    def close(self) -> None: ...


def paragraphs() -> dict[str, list[str]]:
    """The lines of each case and definition."""
    found = {}
    for paragraph in beside(__file__, "hall.txt").strip().split("\n\n"):
        name, *lines = paragraph.splitlines()
        assert name not in found
        found[name] = [line for line in lines if not line.startswith("#")]
    return found


CASES = paragraphs()


def shown(event: protocol.WorldEvent | None) -> str:
    """An event in the words of a script, without its time and command."""
    words = [type(event).__name__]
    match event:
        case protocol.Sensed(obstacle=obstacle, by=by, there=there):
            words += ["-" * (not there) + obstacle.name, f"by {by}"]
        case protocol.Lost(regions=regions):
            words += map(str, sorted(regions))
        case protocol.Acted(found=found):
            words += [f"{obstacle.name} {result}" for obstacle, result in found]
        case protocol.Elsewhere(pose=pose) | protocol.Failed(pose=pose):
            words += [placed(pose)]
        case protocol.Blocked(pose=pose, obstacle=obstacle):
            words += [placed(pose), obstacle.name if obstacle else "?"]
    reason = getattr(event, "reason", "")
    return " ".join(words) + f": {reason}" * bool(reason)


def placed(pose: Pose) -> str:
    return f"{pose.region}{'' if pose.heading is None else pose.heading.label[0].upper()}"


class Case:
    """A case that is played. Its steps have the first or second word of a line as their names."""

    def __init__(self, lines: list[str]) -> None:
        first = lines[0].split() if lines[0].startswith("hall") else [""]
        side = first[first.index("side") + 1] if "side" in first else "1.0"
        text = CORRIDOR if "corridor" in first else YARD if "yard" in first else HALL
        self.scenario = load_scenario_text(text.replace("resolution: 1.0", f"resolution: {side}"))
        self.robots = robots = Robots(self.scenario)
        station = Station(
            "",
            speed=10.0,
            act={} if "bare" in first else {"push": "push", "lift": "grip", "unlock": "key"},
            scan=ScanUse(built_in().obstacles["door"]) if "scan" in first else None,
            report="obstacles" if "report" in first else None,
        )
        self.world = FleetWorld(self.scenario, dict.fromkeys(robots.x, station), robots)
        robots.x = {"silent": {}, "elsewhere": robots.x | {"digit": 3.5}}.get(first[-1], robots.x)
        robots.yaw = 1.5 if first[-1] == "turned" else 0.0
        if lines[1].startswith("refused"):
            with pytest.raises(UsageError) as error:
                self.world.open(patience=0.05)
            assert all(words in str(error.value) for words in lines[1].split(": ")[1:])
            return
        self.world.open()
        for name in robots.x if "scan" in first and "blind" not in first else ():
            self.scan(name, "9")
        self.team = {robot.name: robot for robot in self.scenario.robots}
        self.marked, self.commands = 0.0, iter(range(1, 100))
        for line in lines[first != [""] :]:
            self.play(line)

    def play(self, line: str) -> None:
        if f"define {line}" in CASES:
            for each in CASES[f"define {line}"]:
                self.play(each)
            return
        does, _, expected = line.partition(" ->")
        words = does.split()
        if words[0] in self.team:
            words = [words[1], words[0], *words[2:]]
        wanted = [text for text in expected.strip().split(" | ") if text]
        told = [*(getattr(self, words[0])(*words[1:]) or ())]
        same = all(a == b or a.startswith(f"{b}:") for a, b in zip(told, wanted, strict=False))
        assert same and len(told) == len(wanted), f"{line}: {told}"

    # Events of robots

    def does(self, name: str, *words: str) -> None:
        """Extend the script: ends with positions, each perhaps several times."""
        del name
        for step in " ".join(words).split(", "):
            end, *rest = step.split()
            times = next((int(word[1:]) for word in rest if word[0] == "x"), 1)
            at = next((float(word) for word in rest if word[0] != "x"), None)
            self.robots.script += [(None if end == "silent" else end, at)] * times

    def at(self, name: str, x: str, y: str = "", yaw: str = "0") -> None:
        self.robots.x[name] = float(x)
        self.robots.y[name] = float(y) if y else self.robots.y[name]
        self.robots.locate(name, float(yaw))

    def locate(self, name: str, *words: str) -> list[str]:
        """Send odometry: once, with a yaw, or until an event comes."""
        events: list[str] = []
        if words[:1] != ("until",):
            self.robots.locate(name, *map(float, words))
            return events
        while not events:
            events += self.wait("0.01")
            self.robots.locate(name)
        return events

    def scan(self, name: str, metres: str, side: str = "front", *at: str) -> None:
        """Send a scan with odometry, or without it ``at`` a time from the present one, or from that
        of ``mark``."""
        since = self.marked if "mark" in at else self.robots.stamp
        self.robots.stamp += not at
        self.robots.scan(name, since + float(at[-1] if at else 1.0), float(metres), side)
        if not at:
            self.robots.locate(name)

    def fan(self, name: str, *ranges: str) -> None:
        """Send a scan of rays near the front."""
        self.robots.stamp += 1.0
        rays = [*map(float, ranges)]
        self.robots.post(transport.Scanned(name, self.robots.stamp, -0.2, 0.2, rays))
        self.robots.locate(name)

    def report(self, name: str, text: str) -> None:
        self.robots.post(transport.Reported(name, text))

    def ends(self, name: str, number: str, end: str) -> None:
        self.robots.post(transport.GoalEnded(name, int(number), transport.GoalEnd(end)))

    def result(self, word: str, *reason: str) -> None:
        self.robots.results.append((ActResult(word), " ".join(reason)))

    def performed(self, name: str, number: str, word: str, *reason: str) -> None:
        done = transport.Performed(name, int(number), ActResult(word), " ".join(reason))
        self.robots.post(done)

    # Commands of the run

    def start(self, name: str, to: str) -> list[str]:
        event = self.world.start(self.team[name], self._pose(to), next(self.commands))
        return [shown(event)] if event is not None else []

    def act(self, name: str, *obstacles: str) -> list[str]:
        known = [self._obstacle(name, obstacle) for obstacle in obstacles]
        found = [obstacle for obstacle in known if obstacle is not None]
        event = self.world.act(self.team[name], found, next(self.commands))
        return [shown(event)] if event is not None else []

    def wait(self, seconds: str) -> Iterator[str]:
        yield from map(shown, self.world.wait(float(seconds)))

    def cancel(self, name: str) -> None:
        self.world.cancel(self.team[name])

    def placed(self, name: str, at: str) -> None:
        self.world.placed(self.team[name], self._pose(at))

    def cleared(self, region: str) -> None:
        obstacle = self._obstacle(next(iter(self.team)), region)
        assert obstacle is not None
        self.world.cleared(obstacle)

    def sense(self, name: str, region: str) -> list[str]:
        found = self._obstacle(name, region)
        return [] if found is None else [found.name]

    def _obstacle(self, name: str, what: str) -> Obstacle | None:
        """The obstacle of a name, of the scenario, or the one that is known in a region."""
        if what.isdecimal():
            return self.world.sense(self.team[name], int(what))
        return next(one for one in self.scenario.obstacles if one.name == what)

    def _pose(self, text: str) -> Pose:
        return Pose(int(text.rstrip("E")), Heading.EAST if text.endswith("E") else None)

    # Time, and expectations

    def mark(self) -> None:
        self.marked = self.robots.stamp

    def later(self, seconds: str) -> None:
        self.robots.time += float(seconds)

    def clock(self, seconds: str) -> None:
        self.robots.stamp += float(seconds)

    def goals(self, count: str, *at: str) -> None:
        """Compare the number of goals sent and, if given, x, y and yaw of the last one."""
        assert len(self.robots.goals) == int(count), self.robots.goals
        if at:
            goal = self.robots.goals[-1]
            assert [goal.x, goal.y, goal.yaw] == [float(number) for number in at[1:]]

    def services(self, *words: str) -> None:
        """Compare the services called: robot, service, obstacle."""
        assert ", ".join(self.robots.services) == " ".join(words)
        self.robots.services.clear()

    def cancelled(self, *names: str) -> None:
        assert self.robots.cancelled == [*names]

    def idle(self) -> None:
        assert all(body.task is None for body in self.world.goals.bodies.values())

    def busy(self) -> None:
        assert any(body.task is not None for body in self.world.goals.bodies.values())


@pytest.mark.parametrize("name", [name for name in CASES if not name.startswith("define ")])
def test_a_command_ends_with_exactly_one_true_event(name: str) -> None:
    Case(CASES[name])


class Obedient(Robots):
    """Robots that arrive immediately; a person moves the cart into region 10 when digit first sets
    out."""

    def step(self) -> None:
        super().step()
        for name in self.x:
            self.locate(name)

    def navigate(self, robot: str, goal: transport.GoalPoint) -> None:
        if not self.goals:
            self.y["cart"] = 2.5
            self.locate("cart")
        self.goals.append(goal)
        self.x[robot], self.y[robot] = goal.x, goal.y
        self.locate(robot)
        self.post(transport.GoalEnded(robot, goal.number, transport.GoalEnd.SUCCEEDED))


def test_no_robot_enters_a_region_into_which_a_person_moved_another() -> None:
    scenario = load_scenario_text(CORRIDOR)
    robots, run = Obedient(scenario), Run()
    stations = {name: Station(f"/{name}") for name in ("digit", "cart")}
    world = FleetWorld(scenario, stations, robots)
    world.open()
    mission = Mission(scenario, world=world, listeners=[run], attended=True)
    mission.start()

    def steps(ended: Callable[[], object]) -> None:
        for _ in range(500):
            if ended() is None:
                mission.step()

    steps(lambda: mission.waiting)
    assert "lost_cart@10" in mission.waiting.explanation
    assert 3.5 not in [goal.x for goal in robots.goals]
    robots.y["cart"] = 1.5  # a person carries it back
    steps(lambda: mission.result)
    assert mission.result.outcome is Outcome.COMPLETED
    assert 3.5 in [goal.x for goal in robots.goals] and not run.findings
