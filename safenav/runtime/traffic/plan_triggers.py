"""Triggers of a joint plan: a robot that blocks a helper, or starvation.

A strategy assumes that the others are infinitely often out of its way. No finite run refutes this,
but it reveals a robot that makes no progress towards its goal poses. Only progress on its *current*
assignment counts: a robot that holds meets its goal in every tick, which does not count after it
gets a destination.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Mapping

from msgspec import Struct

from safenav.runtime.coordination.waiting import in_the_way
from safenav.runtime.resolution.problem import Floor
from safenav.runtime.stops import SPARE
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.runtime.traffic import budgets
from safenav.runtime.traffic.joint_search import execution
from safenav.runtime.traffic.searches import Searches
from safenav.world.poses import FAR, Mask


class PlanTrigger(Struct, frozen=True):
    """The reason for a joint plan, and the robot for which it is made."""

    reason: str
    robot: str


class PlanTriggers:
    """Finds triggers in the state of a team. ``watch``: how long each robot has made no progress
    towards its target."""

    def __init__(self, state: TeamState, searches: Searches, clock: Callable[[], float]) -> None:
        self.state = state
        sharing = (robot for robot in state.scenario.robots if robot.name in searches.sharing)
        slowest = max((robot.model.timing for robot in sharing), default=1)
        begun = state.scenario.begun
        self._objectives = {robot.name: robot.objective for robot in state.scenario.robots}
        self.watch = StarvationMonitor(slowest, None if begun is None else begun.waited)
        self.tried: Counter[Hashable] = Counter()
        self._searches = searches
        self._clock = clock

    def next(self) -> PlanTrigger | None:
        """Return the most urgent trigger after a tick."""
        return self._clearing() or self._starving()

    def stuck(self, *, all_still: bool) -> PlanTrigger | None:
        """Live: return a trigger if robots wait only for waiting robots. ``all_still``: no robot
        has a command."""
        robots = self.state.robots
        waits = {}
        for name, robot in robots.items():
            sides = {robot.pose.region, *self.state.scenario.map.neighbours(robot.pose.region)}
            for each in self.state.scenario.never_together:
                sides |= each.regions if name in each.robots and sides & each.regions else set()
            rivals = self.state.rivals(robot.robot)
            waits[name] = [other.name for other in rivals if other.occupied & sides]
        moving = [name for name, robot in robots.items() if robot.transit is not None]
        floor = self._searches.remembered(self._searches.floor())
        unmoved = execution.still(waits, moving)
        for name in robots:  # in this order: the first is named, and the plan is made for it
            if name not in unmoved or name not in self._searches.sharing or not robots[name].active:
                continue
            if not 0 < self._distance(floor, name) < FAR:
                continue
            # A repetition only helps while budgets grow, and some robot must move first.
            key, active = self._present(floor), all(r.active for r in robots.values())
            self.tried[key] += 1
            if self.tried[key] > (4 * budgets.MOST_FAILURES if all_still and active else 1):
                return None
            return PlanTrigger(f"{name} makes no progress towards its target", name)
        return None

    def frees(self, name: str) -> bool:
        """Return whether a plan may help a robot that has no strategy from its pose."""
        floor = self._searches.remembered(self._searches.floor())
        if name not in self._searches.sharing or not 0 < self._distance(floor, name) < FAR:
            return False
        key = name, self._present(floor)
        self.tried[key] += 1
        return self.tried[key] <= 4 * budgets.MOST_FAILURES

    def _present(self, floor: Floor) -> Hashable:
        """Return the state on which the success of a plan depends."""
        robots = [(r.active, r.own.objective) for r in self.state.robots.values()]
        return floor.poses, floor.stages, tuple(robots), tuple(self.state.inputs.items())

    def _clearing(self) -> PlanTrigger | None:
        """Return a trigger if by the last decision a robot that waits for help blocks its helper;
        None if none does, or if a plan was already requested for it."""
        settled = self.state.last_settled
        if settled.notes.cleared:
            return None
        settled.notes.cleared = True
        floor, duties = self._searches.floor(), settled.found.duties
        for index, (name, robot) in enumerate(self.state.robots.items()):
            helpers = sorted(floor.problem.conflicts[index] & duties.keys())
            if robot.assignment.role is not Role.WAITS or not robot.active or not helpers:
                continue
            if in_the_way(floor, duties, index, robot.next_pose.region):
                helper = floor.names[helpers[0]]
                return PlanTrigger(f"{name} stands in the way of {helper}", helper)
        return None

    def _starving(self) -> PlanTrigger | None:
        """Return the first robot without progress towards its assigned target; None if none."""
        floor = self._searches.remembered(self._searches.floor())
        found = None
        for name, robot in self.state.robots.items():
            if name not in self._searches.sharing:
                continue
            goal = self._searches.goal(floor, name)
            distance = self._distance(floor, name)
            pursued = (robot.assignment.objective, goal, floor.stages)
            hasty = distance < FAR and self._runs_low(robot, distance)
            hasty = hasty or (not self.state.live and self._faces_one_that_waits(robot))
            if robot.robot.objective is not self._objectives[name]:
                self.watch.forget(name)
            each = self._to_each(floor, robot, goal, distance)
            if self.watch.look(name, pursued, each, self._clock(), hasty) and found is None:
                found = PlanTrigger(f"{name} makes no progress towards its target", name)
        return found

    def _faces_one_that_waits(self, robot: RobotState) -> bool:
        """Return whether another robot that waits, too, stands at most two steps from a robot.
        Plans cost charge: in a team with batteries, robots are patient."""
        if any(each.charge is not None for each in self.state.robots.values()):
            return False
        world, here = self.state.scenario.map, robot.pose.region
        near = {here, *world.neighbours(here)}
        near |= {region for side in [*near] for region in world.neighbours(side)}
        return any(
            other.active
            and other.pose.region in near
            and self.watch.waits(other.name, self._clock())
            for other in self.state.in_conflict(robot.robot)
        )

    def _distance(self, floor: Floor, name: str) -> int:
        """Return the steps of a robot to its goal poses; FAR if it has none, or waits for a
        charger."""
        goal, index = self._searches.goal(floor, name), floor.index(name)
        if not goal or self._awaits_charger(self.state.robots[name]):
            return FAR
        allowed = floor.problem.allowed(index, floor.stages)
        return floor.problem.members[index].graph.distances(goal, allowed)[floor.poses[index]]

    def _to_each(
        self, floor: Floor, robot: RobotState, goal: Mask, distance: int
    ) -> tuple[int, ...]:
        """Return the steps of a robot to each target that may be its next one: with targets in any
        order, its strategy may go to a farther one first. ``distance``: the steps to the nearest
        pose of ``goal``."""
        index = floor.index(robot.name)
        member = floor.problem.members[index]
        own = robot.assignment.role is Role.OWN and not member.in_turn and 0 < distance < FAR
        parts = [target & goal for target in member.targets if own and target & goal]
        if len(parts) < 2:
            return (distance,)
        allowed = floor.problem.allowed(index, floor.stages)
        return tuple(member.graph.distances(each, allowed)[floor.poses[index]] for each in parts)

    def _runs_low(self, robot: RobotState, distance: int) -> bool:
        """Return whether a waiting robot uses charge that it needs, with a small reserve, for its
        next ``distance`` steps or to continue from here without charging first."""
        battery, stops = robot.robot.model.battery, self.state.stops(robot)
        if battery is None or stops is None or not battery.stay or robot.charge is None:
            return False
        chargers = self.state.scenario.chargers
        if robot.pose.region in chargers:
            return False
        need = distance * battery.move
        if robot.stop is None or robot.stop.region not in chargers:
            turn, pose = stops.turn(robot.own.memory.index), stops.graph.number(robot.pose)
            duty = (
                stops.for_duty(robot.assignment.goal, turn)
                if robot.assignment.role is Role.HELPS
                else None
            )
            goes_on = stops.goes_on_with(pose, turn) if duty is None else duty.goes_on_with(pose, 0)
            need = max(need, min(goes_on, battery.capacity))
        return robot.charge <= need + SPARE * battery.move

    def _awaits_charger(self, robot: RobotState) -> bool:
        """Return whether another robot charges at this one's charger: it leaves when it has
        charged, whereas a plan would only swap the two, each time with less charge."""
        return robot.stop is not None and any(
            each.active and each.transit is None and each.pose.region == each.stop.region
            for each in self.state.rivals(robot.robot)
            if each.stop is not None and each.stop.region == robot.stop.region
        )


class _Wait(Struct):
    pursued: Hashable
    nearest: tuple[int, ...]
    since: float


class StarvationMonitor:
    """Counts ticks without progress. ``slowest``: ticks of the team's slowest step; ``waited``:
    ticks that robots had waited before the run."""

    def __init__(self, slowest: int, waited: Mapping[str, int] | None = None) -> None:
        self.slowest = slowest
        self.patience = 3 * slowest + 2
        self._waits: dict[str, _Wait] = {}
        self._waited = dict(waited or {})

    def look(
        self,
        robot: str,
        pursued: Hashable,
        distances: tuple[int, ...],
        tick: float,
        hasty: bool = False,
    ) -> bool:
        """Whether a robot with the assignment ``pursued`` starves: it has not come nearer to any of
        its targets. ``distances``: remaining steps to each (FAR: no path, or no goal; its wait
        continues). Call once per tick (in a live run, a tick is the duration of a step).
        ``hasty``: it cannot wait for long."""
        wait, before = self._waits.get(robot), self._waited.pop(robot, 0)
        if min(distances) == 0:
            self._waits.pop(robot, None)
        if min(distances) >= FAR or min(distances) == 0:
            return False
        if wait is None or wait.pursued != pursued:
            self._waits[robot] = _Wait(pursued, distances, tick - before)
            return before >= self.patience
        nearest = tuple(map(min, distances, wait.nearest))
        if nearest != wait.nearest:
            self._waits[robot] = _Wait(pursued, nearest, tick)
            return False
        return tick - wait.since >= (self.slowest if hasty else self.patience)

    def waits(self, robot: str, tick: float) -> bool:
        """Whether a robot has made no progress for the duration of a step."""
        wait = self._waits.get(robot)
        return wait is not None and tick - wait.since >= self.slowest

    def forget(self, robot: str) -> None:
        """Discard the time that a robot had waited before the run: it was for another target."""
        self._waited.pop(robot, None)

    def begin_anew(self) -> None:
        """Reset the waits of all robots: a plan was tried."""
        self._waits.clear()
        self._waited.clear()
