"""A run's commands to its world, in lockstep or live, and the events that end them, which are
checked.

In a live run, an event that cannot be true counts as a lost robot or a failed action. An event that
ends no open command is dropped. Neither has any other effect.
"""

import queue
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence

from msgspec import Struct

from safenav.runtime.worlds import protocol
from safenav.runtime.worlds.simulation import LiveSimulation, SimulatedWorld
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.team.team import pace_on
from safenav.trace.vocabulary import ActResult
from safenav.trace.words import seconds_words
from safenav.world.map import Region
from safenav.world.poses import Mobility, Pose

SLICE = 0.05
"""Seconds between checks for posted events and finished syntheses during a wait for a real
world."""
LEAST = 1e-6
"""Seconds of the shortest wait. A floating-point clock of seconds since 1970 that advances only by
waits cannot advance by much less."""
KEPT, FEWEST = 50, 5
"""Maximum number of durations kept per robot, and the minimum for a median."""
FIRST = 60.0
"""Minimum time limit of a step, in seconds, before there is a median: the robot's own software may
still be starting."""
SOONEST = 1.0
"""Minimum time limit of a step, in seconds, without a ``timeout``. The median of a mock-up, or of
steps without duration on the world's clock, may be shorter than a pause of the operating system."""


class Lockstep:
    """The commands of a run to a blocking world. Each command has ended when its call returns,
    except a step of several ticks: a simulation makes it at its end, another world at its
    beginning. Raises WorldError for impossible results."""

    live = simulated = pauses = idle = False
    zero = 0.0

    def __init__(self, world: protocol.BlockingWorld, scenario: Scenario) -> None:
        self._world, self._scenario, self._tick = world, scenario, 0
        self._simulated = world if isinstance(world, SimulatedWorld) else None
        self._ended: dict[str, protocol.Ended] = {}

    def resume(self, time: float, poses: Mapping[str, Pose], last: int) -> None:
        """Continue after the given tick."""
        del poses, last
        self._tick = int(time)

    def now(self) -> float:
        return float(self._tick)

    def number(self, name: str) -> int:
        """Return 0, since commands have no numbers in lockstep."""
        del name
        return 0

    def expected(self, robot: Robot) -> float | None:
        """Return None, since steps have no duration in seconds in lockstep."""

    def hear(self, due: float | None, changed: bool) -> bool:
        """Begin the next tick."""
        del due, changed
        self._tick += 1
        return True

    def start(self, robot: Robot, here: Pose, pose: Pose) -> protocol.Ended | None:
        """Send a robot to ``pose``. Return the end of the step; None if it has not ended."""
        if pose.region == here.region or robot.model.timing == 1:
            return self._moved(robot, pose)
        if self._simulated is None:
            self._ended[robot.name] = self._moved(robot, pose)
        return None

    def ended(self, robot: Robot, to: Pose) -> protocol.Ended:
        """Return the end of a robot's step of several ticks if it ends in this turn, else None."""
        return self._ended.pop(robot.name, None) or self._moved(robot, to)

    def act(self, robot: Robot, here: Pose, obstacles: Sequence[Obstacle]) -> protocol.Acted:
        """Return the obstacles that a robot has resolved. Raises WorldError if impossible."""
        if self._simulated is not None:  # other worlds resolve all that the robot can
            self._simulated.cleared = {obstacle.name for obstacle in obstacles}
        call, kind = f"act({robot.name!r})", list[tuple[Obstacle, bool | None]]
        found = tuple(
            (obstacle, ActResult.of(truth))
            for obstacle, truth in protocol.returned(call, lambda: self._world.act(robot), kind)
        )
        for obstacle, _ in found:
            self._check(call, robot, here.region, obstacle)
        return protocol.Acted(self.now(), robot.name, found)

    def acted(self, robot: Robot) -> protocol.Acted | None:
        """Return None, since no action is under way in lockstep."""

    def _moved(self, robot: Robot, pose: Pose) -> protocol.Ended:
        """Return the end of a step at the pose that the world reports. Raises WorldError."""
        call = f"move({robot.name!r}, {pose.region})"
        told = protocol.returned(call, lambda: self._world.move(robot, pose), Pose | None)
        found: Pose = pose if told is None else told
        if not self._scenario.map.is_free(found.region):
            raise protocol.wrong(call, f"region {found.region} is a wall or off the map")
        if (found.heading is None) != (robot.model.mobility is Mobility.FREE):
            raise protocol.wrong(
                call, f"{robot.name} is a robot of {robot.model.mobility} mobility"
            )
        if found == pose:
            return protocol.Arrived(self.now(), robot.name)
        return protocol.Elsewhere(self.now(), robot.name, found)

    def _check(self, call: str, robot: Robot, here: Region, obstacle: Obstacle) -> None:
        """Raise WorldError if a robot cannot have resolved an obstacle."""
        last = len(protocol.checked(call, obstacle, self._scenario.map).needs) - 1
        if obstacle.needs[last].action not in robot.capabilities:
            action = obstacle.needs[last].action
            raise protocol.wrong(call, f"{robot.name} cannot '{action}' {obstacle.name}")
        places = obstacle.resolution_regions(self._scenario.map, last)
        if here not in places:
            where = ", ".join(map(str, places)) or "nowhere"
            where = f"{robot.name} is at {here}; {obstacle.name} can be resolved at {where}"
            raise protocol.wrong(call, where)


class OpenCommand(Struct):
    """A command that has not ended. ``target``: the pose to which a step leads; None for an action.
    ``trouble``: the error raised by its cancellation."""

    command: int
    robot: Robot
    start: Pose
    target: Pose | None
    obstacles: Sequence[Obstacle]
    since: float
    limit: float | None = None
    cancelled: float | None = None
    trouble: str = ""

    def failed(self, at: float, why: str) -> protocol.Acted:
        """Return the event of this action's failure."""
        found = tuple((obstacle, ActResult.FAILED) for obstacle in self.obstacles)
        return protocol.Acted(at, self.robot.name, found, why, command=self.command)


class Commands:
    """The commands to a live world, and its reports. ``dropped`` (with the reason) and ``sensed``:
    reports that their reader has not removed yet."""

    live = True

    def __init__(self, world: protocol.World, scenario: Scenario) -> None:
        self.world = world
        self.scenario = scenario
        self.dropped: list[tuple[protocol.WorldEvent, str]] = []
        self.sensed: list[protocol.Sensed] = []
        self.expected: Callable[[Robot], float | None] = protocol.optional(world, "expected")
        self.placed: Callable[[Robot, Pose], None] = protocol.optional(world, "placed")
        self.cleared: Callable[[Obstacle], None] = protocol.optional(world, "cleared")
        self.times: Callable[[], Sequence[float]] = protocol.optional(world, "times", ())
        self.simulated = hasattr(world, "expected") and hasattr(world, "times")
        """Whether the world knows how long commands take."""
        self.pauses = self.simulated or bool(getattr(world, "pauses", False))
        """Whether time passes only while the run waits."""
        self._names = frozenset(robot.name for robot in scenario.robots)
        self._open: dict[str, OpenCommand] = {}
        self._ended: dict[str, protocol.WorldEvent] = {}
        self._posted: queue.SimpleQueue[protocol.WorldEvent] = queue.SimpleQueue()
        self._count = 0
        self._took: dict[str, deque[float]] = {}
        self.zero = self._now = 0.0

    @property
    def idle(self) -> bool:
        """Whether no command is open and each command's end has been processed."""
        return not self._open and not self._ended

    def now(self) -> float:
        """Return the present second of the run, which never decreases."""
        self._now = max(self._now, self._clock() - self.zero)
        return self._now

    def post(self, event: protocol.WorldEvent) -> None:
        """Report an event, from any thread."""
        self._posted.put(event)

    def begin(self) -> None:
        """Begin the run, with time 0 at ``zero`` on the world's clock."""
        self.zero = self._clock()

    def resume(self, time: float, poses: Mapping[str, Pose], last: int) -> None:
        """Continue at a time of the run. ``last``: the number of the last command."""
        if isinstance(self.world, LiveSimulation):
            self.world.resume(time, poses)
        self._count, self.zero = last, self._clock() - time

    def at(self, event: protocol.WorldEvent) -> float:
        """Return the time of an event in seconds of the run, at most the present time."""
        return min(float(event.at) - self.zero, self.now())

    def number(self, name: str) -> int:
        """Return the number of a robot's open command or, if it has none, of its last command."""
        return self._open[name].command if name in self._open else self._count

    def start(self, robot: Robot, here: Pose, pose: Pose) -> protocol.Ended | None:
        """Send a robot to ``pose``. Return the end of the step; None if it has not ended."""
        self._send(robot, here, pose, (), lambda number: self.world.start(robot, pose, number))
        return self.ended(robot, pose)

    def ended(self, robot: Robot, to: Pose) -> protocol.Ended | None:
        """Return the end of a robot's step in its turn; None while it is in transit."""
        del to
        found = self._ended.pop(robot.name, None)
        assert isinstance(found, protocol.Ended | None)
        return found

    def act(self, robot: Robot, here: Pose, obstacles: Sequence[Obstacle]) -> protocol.Acted | None:
        """Let a robot act where it stands. Return the results; None if the action has not ended."""
        act = self.world.act
        self._send(robot, here, None, obstacles, lambda number: act(robot, obstacles, number))
        return self.acted(robot)

    def acted(self, robot: Robot) -> protocol.Acted | None:
        """Return the end of a robot's action in its turn; None until it has ended."""
        found = self._ended.pop(robot.name, None)
        assert found is None or isinstance(found, protocol.Acted)
        return found

    def hear(self, due: float | None, changed: bool) -> bool:
        """Receive events. If there are none and nothing has ``changed``, wait for one until ``due``
        (None: without limit). Return whether the run has something to do."""
        heard = self._drain() or changed
        times = [due, *(time for _, time in self._overdue())]
        due = min((time for time in times if time is not None), default=None)
        left = None if due is None else due - self.now()
        timeout = left if left is None else max(left, LEAST if left > 0 else 0.0)
        if heard:
            timeout = 0.0
        elif not self.simulated:
            timeout = SLICE if timeout is None else min(timeout, SLICE)
        for event in protocol.asked(f"wait({timeout})", lambda: list(self.world.wait(timeout))):
            self._take(event)
            heard = True
        self._cancel_overdue()
        over = due is not None and self.now() >= due
        return self._drain() or heard or over or self.simulated

    def _clock(self) -> float:
        """Return the present second on the world's clock. Raises WorldError."""
        found = protocol.asked("now()", self.world.now)
        if not protocol.is_time(found):
            raise protocol.WorldError(f"World.now() returned {found!r}, not seconds")
        return float(found)

    def _send(
        self,
        robot: Robot,
        here: Pose,
        target: Pose | None,
        obstacles: Sequence[Obstacle],
        send: Callable[[int], protocol.WorldEvent | None],
    ) -> None:
        """Send the next command to the world. It fails if a user's world raises an exception."""
        assert robot.name not in self._open, "one command at a time"
        self._count += 1
        command = OpenCommand(self._count, robot, here, target, obstacles, self.now())
        self._open[robot.name] = command
        try:
            event = send(command.command)
            if not isinstance(event, protocol.WorldEvent | None):
                raise TypeError(f"it returned {event!r}, neither None nor an event")
        except Exception as error:
            if type(self.world) is LiveSimulation:
                raise  # a defect of safenav, not a failure of the robot
            reason = f"{'act' if target is None else 'start'}: {error}"
            who = self.now(), robot.name, here
            event = protocol.Failed(*who, reason, True, command=command.command)
        if event is not None:
            self._take(event)
        else:
            command.limit = self._limit(command)

    def _drain(self) -> bool:
        heard = False
        while not self._posted.empty():
            self._take(self._posted.get())
            heard = True
        return heard

    def _take(self, event: protocol.WorldEvent) -> None:
        wrong, open_ = None, self._ended_by(event)
        try:
            event = protocol.well_formed(event, self._names)
        except ValueError as error:
            wrong = str(error)
        if wrong is not None and open_ is None:
            self.dropped.append((event, wrong))
            return
        if isinstance(event, protocol.Sensed):
            self.sensed.append(event)
            return
        if open_ is None:
            self.dropped.append((event, "the event ends no open command"))
            return
        del self._open[open_.robot.name]
        took = max(0.0, self.now() - open_.since)
        durations = self._took.setdefault(open_.robot.name, deque(maxlen=KEPT))
        if open_.target is not None and isinstance(event, protocol.Arrived):
            durations.append(took)
        self._ended[open_.robot.name] = self._checked(event, open_, wrong)

    def _ended_by(self, event: protocol.WorldEvent) -> OpenCommand | None:
        """Return the open command that a report ends; None if there is none."""
        name, number = getattr(event, "robot", None), getattr(event, "command", None)
        open_ = self._open.get(name) if isinstance(name, str) else None
        return open_ if open_ is not None and number == open_.command else None

    def _checked(
        self, event: protocol.WorldEvent, open_: OpenCommand, wrong: str | None
    ) -> protocol.WorldEvent:
        """Return the event or, if it cannot be true, a failed action or a lost robot (whose
        reported pose is unreliable). ``wrong``: the reason why the event is malformed."""
        name, here, at = open_.robot.name, open_.start, self.zero + self.now()
        if open_.target is None:
            wrong = wrong or protocol.wrong_result(event)
            return event if wrong is None else open_.failed(at, wrong)
        regions = {here.region, open_.target.region}
        if wrong is None:
            about = event, self.scenario.map, open_.robot, here, open_.target
            if (wrong := protocol.wrong_step(*about)) is None:
                return event
            pose = getattr(event, "pose", None)
            named = getattr(event, "regions", ()) if pose is None else (pose.region,)
            regions.update(filter(self.scenario.map.is_free, named))
        return protocol.Lost(at, name, frozenset(regions), wrong, command=open_.command)

    def _limit(self, command: OpenCommand) -> float | None:
        """Return the maximum seconds of a command; None if there is no limit."""
        policy, robot = self.scenario.failures, command.robot
        limits = [policy.timeout] if policy.timeout is not None else []
        took = self._took.get(robot.name, ())
        known = self.expected(robot) or 0.0
        if command.target is None:
            pass  # actions have no limit of their own
        elif len(took) >= FEWEST:
            limits.append(max(SOONEST, policy.patience * max(sorted(took)[len(took) // 2], known)))
        elif robot.model.motion is not None:
            pace = pace_on(self.scenario.map, robot)
            way = command.start.region, command.target.region
            seconds = max(pace.step(command.since, *way), known, *took)
            limits.append(max(FIRST, policy.patience * seconds))
        return min(limits, default=None)

    def _overdue(self) -> Iterator[tuple[OpenCommand, float]]:
        """Yield the open commands, each with the time of its next timeout."""
        for open_ in self._open.values():
            if open_.limit is not None:
                since = open_.since if open_.cancelled is None else open_.cancelled
                yield open_, since + open_.limit

    def _cancel_overdue(self) -> None:
        """Cancel commands that take too long. A robot that does not end a cancelled one is lost."""
        now = self.now()
        for open_, due in list(self._overdue()):
            if due > now:
                continue
            if open_.cancelled is None:
                open_.cancelled = now
                try:
                    self.world.cancel(open_.robot)
                except Exception as error:  # the command may still end
                    open_.trouble = f" (cancel: {error})"
            elif open_.target is not None:
                regions = frozenset({open_.start.region, open_.target.region})
                waited = seconds_words(now - open_.cancelled)
                why = f"the command did not end within {waited} of its cancellation{open_.trouble}"
                command = open_.command
                self._take(protocol.Lost(now, open_.robot.name, regions, why, command=command))
            else:
                waited = seconds_words(now - open_.since)
                self._take(open_.failed(now, f"the command did not end within {waited}"))
