"""A hall with two robots over a transport that follows a script: ``hall.txt``, a case for each
paragraph, with its name and its lines. ``->``: the events or the obstacle that must come of it."""

import math
from collections.abc import Callable, Iterator

from once import beside
from safenav.fleet import transport
from safenav.fleet.file import ScanUse, Station
from safenav.fleet.world import FleetWorld
from safenav.runtime.worlds import protocol
from safenav.scenario.model import Obstacle
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.records import Depart
from safenav.trace.vocabulary import ActResult, MovedBy
from safenav.world.map import Heading
from safenav.world.poses import Pose

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
CORRIDOR = beside(__file__, "scenarios/side_room.yaml")
SIDES = ("front", "left", "back", "right")


class Robots:
    """A transport whose robots do what a script says, goal by goal: the end of the goal, and the
    robot's position then (in regions east of its start; None: no more messages). Time passes during
    waits."""

    def __init__(self, side: float = 1.0) -> None:
        self.side = side
        self.script: list[tuple[str | None, float | None]] = []
        self.results: list[tuple[ActResult, str]] = []
        self.goals: list[transport.GoalPoint] = []
        self.cancelled: list[str] = []
        self.stamp = self.time = 0.0
        self.x = {"digit": 1.5, "quad": 1.5}
        self.y = {"digit": 2.5, "quad": 1.5}
        self.post: Callable[[transport.Message], None] = print

    def now(self) -> float:
        return self.time

    def step(self) -> None:
        self.time += 0.01

    def open(self, post: Callable[[transport.Message], None]) -> None:
        self.post = post
        for name in self.x:
            self.locate(name)

    def locate(self, name: str, yaw: float = 0.0) -> None:
        self.stamp += 1.0
        x, y = self.x[name] * self.side, self.y[name] * self.side
        self.post(transport.Located(name, self.stamp, x, y, yaw))

    def missing(self) -> list[str]:
        return [] if "digit" in self.x else ["/digit/move_base"]

    def navigate(self, robot: str, goal: transport.GoalPoint) -> None:
        self.goals.append(goal)
        end, at = self.script.pop(0)
        if at is not None:
            self.x[robot] = at
            self.locate(robot)
        if end is not None:
            ended = transport.GoalEnded(robot, goal.number, transport.GoalEnd(end), "")
            self.post(ended)

    def cancel(self, robot: str) -> None:
        self.cancelled.append(robot)
        if self.script and self.script[0][0] == "canceled":
            self.script.pop(0)
            self.post(transport.GoalEnded(robot, self.goals[-1].number, transport.GoalEnd.CANCELED))

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        assert (action, obstacle) == ("push", "door@9")
        if self.results:
            self.post(transport.Performed(robot, number, *self.results.pop(0)))

    def close(self) -> None: ...


def scanned(robots: Robots, name: str, metres: float, side: str = "front") -> None:
    """A scan where the robot stands, and odometry from after it."""
    robots.stamp += 1.0
    scan(robots, name, robots.stamp, metres, side)
    robots.locate(name)


def scan(robots: Robots, name: str, stamp: float, metres: float, side: str) -> None:
    """A lidar of four rays: one of them hits something."""
    rays = [metres if each == side else math.inf for each in SIDES]
    robots.post(transport.Scanned(name, stamp, 0.0, math.pi / 2, rays))


def cases() -> dict[str, list[str]]:
    """The lines of each case."""
    found = {}
    for paragraph in beside(__file__, "hall.txt").strip().split("\n\n"):
        name, *lines = paragraph.splitlines()
        assert name not in found
        found[name] = [line for line in lines if not line.startswith("#")]
    return found


def shown(event: protocol.WorldEvent) -> str:
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
    return f"{pose.region}{pose.heading.label[0].upper() if pose.heading else ''}"


class Case:
    """A case that is played. Its steps have the first or second word of a line as their names."""

    def __init__(self, lines: list[str]) -> None:
        first = lines[0].split() if lines[0].startswith("hall") else []
        side = float(first[first.index("side") + 1]) if "side" in first else 1.0
        self.robots = robots = Robots(side)
        text = SCENARIO.format(resolution=side)
        if "corridor" in first:
            text = CORRIDOR
            robots.x, robots.y = {"digit": 1.5, "cart": 3.5}, {"digit": 2.5, "cart": 1.5}
        scenario = load_scenario_text(text, "hall.yaml")
        station = Station(
            "",
            speed=10.0,
            act={"push": "push"},
            scan=ScanUse("door") if "scan" in first else None,
            report="obstacles" if "report" in first else None,
        )
        self.world = FleetWorld(scenario, dict.fromkeys(robots.x, station), robots)
        self.world.open()
        for name in robots.x if "scan" in first and "blind" not in first else ():
            scanned(robots, name, 9.0)
        self.team = {robot.name: robot for robot in scenario.robots}
        self.marked, self.commands = 0.0, iter(range(1, 100))
        for line in lines[bool(first) :]:
            self.play(line)

    def play(self, line: str) -> None:
        does, _, expected = line.partition(" ->")
        words = does.split()
        if words[0] in self.team:
            words = [words[1], words[0], *words[2:]]
        try:
            came = getattr(self, words[0])(*words[1:])
        except StopIteration:
            raise AssertionError(f"{line}: too many commands") from None
        wanted = [text for text in expected.strip().split(" | ") if text]
        told = [*(came or ())]
        same = all(a == b or a.startswith(f"{b}:") for a, b in zip(told, wanted, strict=False))
        assert same and len(told) == len(wanted), f"{line}: {told}"

    # What robots do

    def does(self, name: str, *words: str) -> None:
        """Extend the script: ends with positions, each perhaps several times."""
        del name
        for step in " ".join(words).split(", "):
            end, *rest = step.split()
            times = next((int(word[1:]) for word in rest if word[0] == "x"), 1)
            at = next((float(word) for word in rest if word[0] != "x"), None)
            self.robots.script += [(None if end == "silent" else end, at)] * times

    def at(self, name: str, x: str, y: str = "") -> None:
        self.robots.x[name] = float(x)
        self.robots.y[name] = float(y) if y else self.robots.y[name]
        self.robots.locate(name)

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
        if not at:
            scanned(self.robots, name, float(metres), side)
            return
        since = self.marked if "mark" in at else self.robots.stamp
        scan(self.robots, name, since + float(at[-1]), float(metres), side)

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

    def performed(self, name: str, number: str, word: str) -> None:
        self.robots.post(transport.Performed(name, int(number), ActResult(word)))

    def passes(self, name: str, _: str) -> None:
        """Let the quadcopter go from region 15, south of digit, to 17."""
        for number, x in ((16, 2.5), (17, 3.5)):
            for line in (f"{name} does succeeded {x}", f"start {name} {number}", "wait 0.02"):
                self.play(line)
            self.play(f"scan {name} 9")
            self.play("wait 0.05 -> Arrived")
        self.robots.goals.clear()

    def leaves(self, name: str, *_: str) -> None:
        """Let the quadcopter, which stood in region 9, leave it; digit is to enter it."""
        for line in (
            *(f"placed {name} 9", f"at {name} 2.5 2.5", f"scan {name} 9", "scan digit 0.6"),
            *("wait 0.02", "sense digit 9", f"{name} does succeeded 3.5", f"start {name} 10"),
            *("wait 0.02", f"scan {name} 9", "wait 0.02 -> Arrived"),
            *("start digit 9E", "wait 0.02", "goals 1"),
        ):
            self.play(line)

    # What the run does

    def start(self, name: str, to: str) -> list[str]:
        event = self.world.start(self.team[name], self._pose(to), next(self.commands))
        return [shown(event)] if event is not None else []

    def depart(self, name: str, here: str, to: str) -> None:
        self.world.observe(Depart(1, 1, name, int(here), int(to), "east", MovedBy.STRATEGY))

    def act(self, name: str, *regions: str) -> list[str]:
        known = [self._obstacle(name, region) for region in regions]
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
        obstacle = self._obstacle("digit", region)
        assert obstacle is not None
        self.world.cleared(obstacle)

    def sense(self, name: str, region: str) -> list[str]:
        found = self._obstacle(name, region)
        return [] if found is None else [found.name]

    def _obstacle(self, name: str, region: str) -> Obstacle | None:
        return self.world.sense(self.team[name], int(region))

    def _pose(self, text: str) -> Pose:
        return Pose(int(text.rstrip("E")), Heading.EAST if text.endswith("E") else None)

    # Time, and what is to be true

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

    def cancelled(self, *names: str) -> None:
        assert self.robots.cancelled == [*names]

    def idle(self) -> None:
        assert self.world.idle

    def busy(self) -> None:
        assert not self.world.idle
