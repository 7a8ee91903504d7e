"""The commands of a run to its world, and the events that end them, each checked before it is used.

An event that cannot be true counts as a fatal failure of its robot; one that ends no open command
is dropped. Both leave the run as it is.
"""

from __future__ import annotations

import queue
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from statistics import median

from msgspec import Struct

from safenav.runtime.worlds import protocol
from safenav.runtime.worlds.adapter import BlockingAdapter, WorldError
from safenav.runtime.worlds.simulation import pace_on
from safenav.runtime.worlds.world import NO_TAKERS, Change, ChangingWorld, Takers
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.trace.vocabulary import ActResult
from safenav.trace.words import seconds_words
from safenav.world.map import Region
from safenav.world.moves import Mobility, Pose

SLICE = 0.05
"""Seconds after which a wait for a real world looks at what others post, and at syntheses."""
KEPT, FEWEST = 50, 5
"""Durations of a robot's commands that are kept, and with which their median means something."""
FIRST = 60.0
"""Seconds that a step may take at least before that: the robot's own software may be starting."""


class OpenCommand(Struct):
    """A command that is not over. ``target``: where a step goes; None: an action."""

    command: int
    robot: Robot
    start: Pose
    target: Pose | None
    obstacles: Sequence[Obstacle]
    since: float
    limit: float | None = None
    cancelled: float | None = None

    def failed(self, at: float, why: str) -> protocol.Acted:
        """The end of an action that has failed."""
        found = tuple((obstacle, ActResult.FAILED) for obstacle in self.obstacles)
        return protocol.Acted(at, self.robot.name, found, why, command=self.command)


class Commands:
    """Gives commands to a world, and takes in what it reports. ``busy``: seconds in which each
    robot had a command; ``over``: the time of the last end of one; ``dropped`` (with the reason)
    and ``sensed``: reports that wait for their reader, who removes them."""

    def __init__(self, world: protocol.World, scenario: Scenario) -> None:
        self.world = world
        self.scenario = scenario
        self.busy: dict[str, float] = {}
        self.over = 0.0
        self.dropped: list[tuple[protocol.WorldEvent, str]] = []
        self.sensed: list[protocol.Sensed] = []
        self.live = not isinstance(world, BlockingAdapter)
        self._timed = world if isinstance(world, protocol.TimedWorld) else None
        self._changing = world if isinstance(world, ChangingWorld) else None
        self.simulated = self._timed is not None
        """Whether the world knows how long commands take."""
        self.pauses = self.simulated or (isinstance(world, protocol.PausingWorld) and world.pauses)
        """Whether time passes only while the run waits."""
        self._open: dict[str, OpenCommand] = {}
        self._ended: dict[str, protocol.WorldEvent] = {}
        self._posted: queue.SimpleQueue[protocol.WorldEvent] = queue.SimpleQueue()
        self._count = 0
        self._took: dict[str, deque[float]] = {}
        self.zero = self._now = self._looked = self._steps = 0.0
        self._all: deque[float] = deque(maxlen=KEPT)

    @property
    def idle(self) -> bool:
        """Whether no command is open and no end of one is to be taken in."""
        return not self._open and not self._ended

    def now(self) -> float:
        """Seconds of the run; never less than before."""
        self._now = max(self._now, self.world.now() - self.zero)
        return self._now

    def steps(self) -> float:
        """The time in durations of a step: ticks in lockstep; live, the sum of those since the
        beginning, each as long as the median of the last ones."""
        now = self.now()
        if self.live and self._all:
            self._steps += (now - self._looked) / (median(self._all) or 1.0)
        elif not self.live:
            self._steps = now
        self._looked = now
        return self._steps

    def post(self, event: protocol.WorldEvent) -> None:
        """Report an event, from any thread."""
        self._posted.put(event)

    def begin(self) -> None:
        """The run begins now: its times count from ``zero`` on the world's clock."""
        self.zero = self.world.now() if self.live else 0.0

    def at(self, event: protocol.WorldEvent) -> float:
        """The seconds of the run at which an event was so."""
        return event.at - self.zero

    def number(self, name: str) -> int:
        """The number of a robot's open command, or of its last one."""
        return self._open[name].command if name in self._open else self._count

    def expected(self, robot: Robot) -> float | None:
        """The expected duration of a robot's last command, if the world knows it."""
        return None if self._timed is None else self._timed.expected(robot)

    def placed(self, robot: Robot, pose: Pose) -> None:
        """Notify a world that keeps poses of a robot that an operator has put somewhere."""
        if isinstance(self.world, protocol.PlacingWorld):
            self.world.placed(robot, pose)

    def cleared(self, obstacle: Obstacle) -> None:
        """Notify a world that remembers obstacles of one that an operator has resolved."""
        if isinstance(self.world, protocol.RememberingWorld):
            self.world.cleared(obstacle)

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        """The obstacle in ``region``, as far as the world's sensors know. Raises WorldError."""
        if not self.live:
            return self.world.sense(robot, region)
        try:
            found = self.world.sense(robot, region)
        except Exception as error:
            raise WorldError(f"World.sense({robot.name!r}, {region}) failed: {error}") from error
        if found is None or (isinstance(found, Obstacle) and found.region == region):
            return found
        raise WorldError(f"World.sense({robot.name!r}, {region}) returned {found!r}")

    def start(self, robot: Robot, here: Pose, pose: Pose) -> protocol.Ended | None:
        """Send a robot to ``pose``; the end of its step, if that is over already."""
        number = self._begin(robot, here, pose, ())
        self._send(robot, here, "start", lambda: self.world.start(robot, pose, number))
        return self.ended(robot)

    def ended(self, robot: Robot) -> protocol.Ended | None:
        """The end of a robot's step, taken in its turn; None while it is under way."""
        if isinstance(self.world, BlockingAdapter) and robot.name in self._open:
            event = self.world.ended(robot.name)
            if event is not None:
                self._take(event)
        found = self._ended.pop(robot.name, None)
        assert not isinstance(found, protocol.Acted | protocol.Sensed)
        return found  # type: ignore[return-value]

    def may_have_ended(self, name: str) -> bool:
        """Whether a robot's step has ended, as far as that is known before its turn."""
        return not self.live or name in self._ended

    def act(
        self, robot: Robot, here: Pose, obstacles: Sequence[Obstacle], takers: Takers = NO_TAKERS
    ) -> protocol.Acted | None:
        """Let a robot act where it stands; the results, if it is over already. ``takers``: in
        lockstep, of some loads the only robots that take them."""
        if isinstance(self.world, BlockingAdapter):  # also while it is on its way
            return self.world.act(robot, obstacles, self._count, takers)
        number = self._begin(robot, here, None, obstacles)
        self._send(robot, here, "act", lambda: self.world.act(robot, obstacles, number))
        return self.acted(robot)

    def within_reach(self, robot: Robot, cleared: Sequence[Obstacle]) -> bool | None:
        """Lockstep: whether a robot can act on something where it stands; None if the world does
        not say so before it acts."""
        assert isinstance(self.world, BlockingAdapter), "a live world is asked by a command"
        return self.world.within_reach(robot, cleared)

    def acted(self, robot: Robot) -> protocol.Acted | None:
        """The end of a robot's action, taken in its turn; None while it is under way."""
        found = self._ended.pop(robot.name, None)
        assert found is None or isinstance(found, protocol.Acted)
        return found

    def hear(self, due: float | None, changed: bool) -> bool:
        """Take in what has happened, and if that is nothing and nothing has ``changed``, wait for
        something until ``due`` (None: without limit); whether there is something to do."""
        if not self.live:
            self.world.wait(None)
            return True
        heard = self._drain() or changed
        times = [due, *(time for _, time in self._overdue())]
        due = min((time for time in times if time is not None), default=None)
        timeout = None if due is None else max(0.0, due - self.now())
        if heard:
            timeout = 0.0
        elif not self.simulated:
            timeout = SLICE if timeout is None else min(timeout, SLICE)
        try:
            events = list(self.world.wait(timeout))
        except Exception as error:
            raise WorldError(f"World.wait({timeout}) failed: {error}") from error
        for event in events:
            self._take(event)
            heard = True
        self._cancel_overdue()
        over = due is not None and self.now() >= due
        return self._drain() or heard or over or self.simulated

    def times(self) -> Sequence[float]:
        """The times to come at which a simulation changes something."""
        if isinstance(self.world, BlockingAdapter):
            return self.world.times()
        return () if self._timed is None else self._timed.times()

    def changes(self, occupied: Collection[Region]) -> Sequence[Change]:
        """The obstacles that have appeared or disappeared."""
        if self._changing is None:
            return ()
        return tuple(self._changing.changes(int(self.now()), occupied))

    def _begin(
        self, robot: Robot, here: Pose, target: Pose | None, obstacles: Sequence[Obstacle]
    ) -> int:
        assert robot.name not in self._open, "one command at a time"
        self._count += 1
        self._open[robot.name] = OpenCommand(
            self._count, robot, here, target, obstacles, self.now()
        )
        return self._count

    def _send(
        self, robot: Robot, here: Pose, word: str, send: Callable[[], protocol.WorldEvent | None]
    ) -> None:
        """Give the world the command that has just begun; an exception of the world ends it."""
        command = self._open[robot.name]
        try:
            event = send()
        except WorldError:
            raise
        except Exception as error:
            reason, number = f"{word}: {error}", command.command
            event = protocol.Failed(self.now(), robot.name, here, reason, True, command=number)
        if event is not None:
            self._take(event)
        elif self.live:
            command.limit = self._limit(command)

    def _drain(self) -> bool:
        heard = False
        while not self._posted.empty():
            self._take(self._posted.get())
            heard = True
        return heard

    def _take(self, event: protocol.WorldEvent) -> None:
        if not isinstance(event, protocol.WorldEvent):
            self.dropped.append(
                (protocol.WorldEvent(self.world.now()), f"{event!r} is not an event")
            )
            return
        if isinstance(event, protocol.Sensed) and not isinstance(event.obstacle, Obstacle):
            self.dropped.append((event, f"{event.obstacle!r} is not an Obstacle"))
            return
        if isinstance(event, protocol.Sensed):
            self.sensed.append(event)
            return
        name = getattr(event, "robot", None)
        open_ = self._open.get(name) if isinstance(name, str) else None
        if open_ is None or event.command != open_.command:
            self.dropped.append((event, "it ends no open command"))
            return
        del self._open[open_.robot.name]
        took = max(0.0, self.now() - open_.since)
        kept = self._took.setdefault(open_.robot.name, deque(maxlen=KEPT))
        if open_.target is not None and isinstance(event, protocol.Arrived):
            kept.append(took)
            self._all.append(took)
        self.busy[open_.robot.name] = self.busy.get(open_.robot.name, 0.0) + took
        self.over = self.now()
        self._ended[open_.robot.name] = self._checked(event, open_) if self.live else event

    def _checked(self, event: protocol.WorldEvent, open_: OpenCommand) -> protocol.WorldEvent:
        """The event; a failed action if it cannot be true, or a robot that is lost: where it is
        cannot be said by one that says so."""
        name, here = open_.robot.name, open_.start
        if open_.target is None:
            wrong = _wrong_result(event)
            return event if wrong is None else open_.failed(event.at, wrong)
        wrong = self._wrong(event, open_.robot, here, open_.target)
        if wrong is None:
            return event
        told = getattr(event, "regions", None) or {getattr(event, "pose", here).region}
        free = {region for region in told if self.scenario.map.is_free(region)}
        regions = frozenset({here.region, open_.target.region, *free})
        return protocol.Lost(event.at, name, regions, wrong, command=open_.command)

    def _wrong(
        self, event: protocol.WorldEvent, robot: Robot, here: Pose, target: Pose
    ) -> str | None:
        """The reason why an event cannot end a step from ``here`` to ``target``."""
        world = self.scenario.map
        match event:
            case protocol.Arrived():
                return None
            case protocol.Lost(regions=regions):
                wrong = [region for region in regions if not world.is_free(region)]
                return f"it cannot be lost in region {wrong[0]}, a wall" if wrong else None
            case protocol.Blocked(pose=pose) if pose.region != here.region:
                return f"blocked, but not back in region {here.region}"
            case (
                protocol.Elsewhere(pose=pose)
                | protocol.Blocked(pose=pose)
                | protocol.Failed(pose=pose)
            ):
                near = {here.region, target.region}
                near |= {r for region in near for r in world.neighbours(region)}
                if pose.region not in near:
                    return f"region {pose.region} is not next to its step"
                if (pose.heading is None) != (robot.model.mobility is Mobility.FREE):
                    return f"it is a robot of {robot.model.mobility} mobility"
                return None
        return f"{type(event).__name__} ends no step"

    def _limit(self, command: OpenCommand) -> float | None:
        """Seconds that a command may take; None: there is no limit."""
        policy, robot = self.scenario.failures, command.robot
        limits = [policy.timeout] if policy.timeout is not None else []
        took = self._took.get(robot.name, ())
        known = self.expected(robot) or 0.0
        if command.target is None:
            pass  # an action takes as long as it takes
        elif len(took) >= FEWEST:
            limits.append(policy.patience * max(median(took), known))
        elif robot.model.motion is not None:
            pace = pace_on(self.scenario.map, robot)
            ticks, way = robot.model.timing.most, (command.start.region, command.target.region)
            seconds = max(pace.step(command.since, *way, ticks), known, *took)
            limits.append(max(FIRST, policy.patience * seconds))
        return min(limits, default=None)

    def _overdue(self) -> Iterator[tuple[OpenCommand, float]]:
        """Open commands, each with the time at which its patience ends next."""
        for open_ in self._open.values():
            if open_.limit is not None:
                since = open_.since if open_.cancelled is None else open_.cancelled
                yield open_, since + open_.limit

    def _cancel_overdue(self) -> None:
        """Cancel commands that take too long; robots that do not end them are lost."""
        now = self.now()
        for open_, due in list(self._overdue()):
            if due > now:
                continue
            if open_.cancelled is None:
                open_.cancelled = now
                self.world.cancel(open_.robot)
            elif open_.target is not None:
                regions = frozenset({open_.start.region, open_.target.region})
                waited = seconds_words(now - open_.cancelled)
                why = f"no end within {waited} after it was cancelled"
                command = open_.command
                self._take(protocol.Lost(now, open_.robot.name, regions, why, command=command))
            else:
                self._take(open_.failed(now, f"no end within {seconds_words(now - open_.since)}"))


def _wrong_result(event: protocol.WorldEvent) -> str | None:
    """The reason why an event reports no results of an action."""
    match event:
        case protocol.Acted(found=found, reason=str()) if isinstance(found, Sequence) and all(
            isinstance(pair, tuple | list)
            and len(pair) == 2
            and isinstance(pair[0], Obstacle)
            and isinstance(pair[1], ActResult)
            for pair in found
        ):
            return None
        case protocol.Acted():
            return f"its results are {event.found!r}"
        case protocol.Failed():
            return event.reason
    return f"{type(event).__name__} ends no action"
