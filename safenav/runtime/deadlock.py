"""Deadlocks: robots that wait for each other, and who could give way to whom.

Each controller is correct under the assumption that nobody stays in its way for ever. Two
robots that meet in a corridor both wait, and each breaks the other's assumption: taken
mutually, fairness is circular (the paper leaves deadlocks as future work). Here they are found
from the outside, by who stands in whose way, and a way out is looked for on the map; taking it
is the coordination layer's work.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import islice

from safenav.runtime.coordination import Cause, Impasse, Resynthesis
from safenav.runtime.refuge import Deadlock, Places, Refuge, known_regions, refuges
from safenav.runtime.state import TeamState
from safenav.runtime.tasks import Assignment, Frame
from safenav.runtime.traffic import Traffic
from safenav.scenario.model import Robot
from safenav.trace import records
from safenav.world.map import Region
from safenav.world.moves import moves, shortest_path

PATIENCE = 3
"""Ticks that a robot waits in front of another before anybody asks whether that is for ever,
beyond the longest step that another one may be taking."""

TRIES = 12
"""Ways out of one deadlock for which a synthesis is tried."""

ATTEMPTS = 20
"""Times that others give way to one robot before it must have got somewhere."""


class Watch:
    """Notices who gets nowhere, from the positions alone."""

    def __init__(self, state: TeamState, coordination: Resynthesis, traffic: Traffic) -> None:
        self._state = state
        self._traffic = traffic
        self._coordination = coordination
        self._unsolved = 0
        self._tried: dict[str, Counter[Places]] = {}
        self._favoured: Counter[str] = Counter()
        self._goals: dict[str, int] = {}
        self._idle: dict[str, int] = {}
        self._fruitless: dict[str, int] = {}
        self._last: dict[str, Region] = {}
        slowest = max(r.model.timing.most for r in state.scenario.robots)
        self._patience = PATIENCE + slowest
        # Every pose of the map once there and once back: whoever needs longer for one target
        # is being led around in circles.
        self._bound = 8 * len(state.scenario.map.free) * slowest + 20

    def __call__(self, event: records.Record) -> None:
        """Hear of goals: whoever meets one gets somewhere."""
        if isinstance(event, records.Goal):
            self._goals[event.robot] = self._goals.get(event.robot, 0) + 1
            if not self._state.tasks.current[event.robot].temporary:
                self._fruitless[event.robot] = 0
                self._tried.pop(event.robot, None)

    def tick(self) -> Impasse | None:
        """Look at the team after a tick: end what has served its purpose, and if somebody
        waits for ever, let somebody give way. An impasse if nobody can."""
        for robot in self._state.scenario.robots:
            name = robot.name
            here = self._state.region(robot)
            still = self._last.get(name) == here and name not in self._state.transits
            self._idle[name] = self._idle.get(name, 0) + 1 if still else 0
            self._fruitless[name] = self._fruitless.get(name, 0) + 1
            self._last[name] = here
        for frame in self._state.tasks.giving_way():
            if self._used(frame):
                impasse = self._coordination.end_way(frame)
                if impasse is not None:
                    return impasse
        deadlock = self.find()
        if deadlock is not None:
            if self._solve(deadlock):
                return None
            self._unsolved += 1
            names = (deadlock.stuck, *deadlock.ring)
            return Impasse(Cause.DEADLOCK, None, names) if self._unsolved > self._patience else None
        self._unsolved = 0
        for starving in self._starving():
            if self._solve(starving, only=starving.stuck):
                break
        return None

    def _solve(self, deadlock: Deadlock, only: str | None = None) -> bool:
        """Let somebody give way (to ``only`` if that is given); whether anybody can."""
        possible = [
            refuge
            for refuge in islice(refuges(deadlock, self._state), TRIES)
            if self._ways_tried(refuge).total() < ATTEMPTS and only in (None, refuge.stuck)
        ]
        # What has been tried already for a robot that has got nowhere since comes last; and
        # those to whom others gave way less often come first, lest one be served for ever.
        for refuge in sorted(possible, key=self._reluctance):
            if self._coordination.give_way(refuge):
                self._ways_tried(refuge)[refuge.places] += 1
                self._favoured[refuge.stuck] += 1
                self._unsolved = 0
                frame = self._state.tasks.frames[-1]
                frame.goals_before = self._goals.get(frame.requester, 0)
                for name in (deadlock.stuck, *deadlock.ring):
                    self._idle[name] = 0
                self._fruitless[refuge.stuck] = 0
                return True
        return False

    def _reluctance(self, refuge: Refuge) -> tuple[int, int]:
        return self._ways_tried(refuge)[refuge.places], self._favoured[refuge.stuck]

    def _ways_tried(self, refuge: Refuge) -> Counter[Places]:
        return self._tried.setdefault(refuge.stuck, Counter())

    def _used(self, frame: Frame) -> bool:
        """Whether the way that was made has been used: the robot that it was made for has met
        its goal, or what it still has to go crosses nobody's way who stood aside."""
        state = self._state
        if self._goals.get(frame.requester, 0) > frame.goals_before:
            return True
        stuck = state.scenario.robot(frame.requester)
        ahead = _way(stuck, state.tasks.current[stuck.name], state)
        if ahead is None:
            return False
        aside = [n for n, a in state.tasks.current.items() if a is not frame.saved.get(n)]
        for name in aside:
            robot = state.scenario.robot(name)
            if robot is stuck or name not in frame.saved:
                continue
            back = _way(robot, frame.saved[name], state)
            if name in state.transits or back is None or not set(back).isdisjoint(ahead):
                return False
        return True

    def find(self) -> Deadlock | None:
        """The first robot, in the team's order, that waits for ever as things stand."""
        blockers = {
            robot.name: self._blockers(robot)
            for robot in self._state.scenario.robots
            if self._idle.get(robot.name, 0) >= self._patience
        }
        for name, waits_for in blockers.items():
            ring = self._closed(name, waits_for, blockers)
            if ring:
                return Deadlock(name, ring)
        return None

    def _starving(self) -> Iterator[Deadlock]:
        """The robots that have met no goal for far longer than the map explains."""
        state = self._state
        for robot in state.scenario.robots:
            name = robot.name
            if self._fruitless.get(name, 0) <= self._bound or state.tasks.current[name].temporary:
                continue
            ring = tuple(
                other.name
                for other in state.scenario.robots
                if other is not robot and state.scenario.conflict(robot, other)
            )
            if ring:
                yield Deadlock(name, ring)

    def _closed(
        self, name: str, waits_for: tuple[str, ...], blockers: Mapping[str, tuple[str, ...]]
    ) -> tuple[str, ...]:
        """The robots that ``name`` waits for, directly or not, if none of them will move."""
        found: list[str] = []
        queue = list(waits_for)
        while queue:
            other = queue.pop(0)
            if other == name or other in found:
                continue
            found.append(other)
            if self._rests(other):
                continue
            if not blockers.get(other):
                return ()  # it is on its way, or waits for something else than a robot
            queue += blockers[other]
        return tuple(found)

    def _rests(self, name: str) -> bool:
        """Whether a robot stands where its objective wants it to stay."""
        robot = self._state.scenario.robot(name)
        return self._idle.get(name, 0) >= self._patience and self._state.region(
            robot
        ) in self._awaited(robot)

    def _blockers(self, robot: Robot) -> tuple[str, ...]:
        """The robots that one that waits may be waiting for: those on the regions that it could
        step to, and those in a corridor that is closed to it. Nobody if it is where it wants to
        be.

        Not only those on its shortest way: a strategy may wait for one side to become free
        although another one is.
        """
        state, here = self._state, self._state.region(robot)
        awaited = self._awaited(robot)
        if not awaited or here in awaited:
            return ()
        known = known_regions(robot, state)
        steps = {
            pose.region
            for pose in moves(
                robot.model.mobility, state.poses[robot.name], state.scenario.map, known
            )
        } - {here}
        found = list(self._traffic.in_the_way(robot))
        found += [
            other.name
            for other in state.scenario.robots
            if other is not robot
            and state.scenario.conflict(robot, other)
            and not steps.isdisjoint(state.occupied(other))
        ]
        return tuple(dict.fromkeys(found))

    def _awaited(self, robot: Robot) -> frozenset[Region]:
        return self._state.tasks.current[robot.name].progress.awaited()


def _way(robot: Robot, assignment: Assignment, state: TeamState) -> list[Region] | None:
    """A shortest way from where the robot is to what an assignment has it await."""
    awaited = assignment.progress.awaited()
    pose = state.next_pose(robot)
    return shortest_path(
        robot.model.mobility, pose, awaited, state.scenario.map, known_regions(robot, state)
    )
