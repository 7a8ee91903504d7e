"""The charge of each robot in a run: stops to chargers, and robots whose charge is used up."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, replace
from itertools import islice, product

from safenav.dataclass import dataclass
from safenav.runtime.coordination.events import BatteryFlat, Event, Unsettled
from safenav.runtime.energy.need import NEVER
from safenav.runtime.energy.stops import Stops
from safenav.runtime.formulas import graph_of
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.turn import Turns
from safenav.runtime.world import SimulatedWorld
from safenav.scenario.model import Obstacle
from safenav.scenario.objective import Ltl, targets_of
from safenav.trace import records
from safenav.trace.vocabulary import ChangeCause, PlanEndReason, Reason
from safenav.world.moves import Pose
from safenav.world.poses import Mask, bits, region_mask

MOST_CHOICES = 64
"""Choices of poses for the targets of a robot that are compared."""


@dataclass(eq=False)
class Batteries:
    """Keeps ``RobotState.charge`` as moves change it, and decides each robot's next stop
    (``RobotState.stop``). ``world``: where a flat robot becomes an obstacle, if simulated."""

    team: TeamState
    turns: Turns
    world: SimulatedWorld | None
    _flat: dict[str, str] = field(default_factory=dict)  # the robot at which an obstacle appeared
    _charged: list[str] = field(default_factory=list)
    _known: dict[str, tuple[object, Stops]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for robot in self.team.robots.values():
            if robot.robot.model.battery is not None:
                robot.charge = robot.robot.model.battery.start
                if self.team.scenario.chargers:
                    self.choose_places(robot)

    def __call__(self, record: records.Record) -> None:
        """Hear of moves, and of batteries that were brought."""
        if isinstance(record, records.Move):
            self._moved(record)
        elif isinstance(record, records.Resolved) and record.obstacle in self._flat:
            self._charged.append(self._flat.pop(record.obstacle))

    def tick_begins(self) -> Iterator[Event]:
        """Put robots back in service whose battery was replaced in the tick before; decide the
        first stops."""
        for robot in self.team.robots.values() if self.team.tick == 1 else ():
            yield from self.turn_ends(robot)
        charged, self._charged = self._charged, []
        for name in charged:
            robot = self.team.robots[name]
            assert robot.robot.model.battery is not None
            robot.charge = robot.robot.model.battery.capacity
            yield from self.turns.serve(robot, active=True, cause=ChangeCause.BATTERY)

    def turn_ends(self, robot: RobotState) -> Iterator[Event]:
        """Decide what a robot does next for its charge."""
        battery, scenario = robot.robot.model.battery, self.team.scenario
        if battery is None or robot.charge is None or robot.transit is not None or not robot.active:
            return
        on_charger = robot.pose.region in scenario.chargers
        if robot.charge < battery.move and not on_charger:
            yield from self._runs_flat(robot)
        elif scenario.chargers:
            stop = self._stop(robot)
            if stop != robot.stop:
                robot.stop = stop
                yield from self.turns.leave_plan(PlanEndReason.CHANGED, settling=True)
                yield Unsettled(Reason.CHARGE)

    def choose_places(self, robot: RobotState) -> None:
        """Choose one pose for each target of a robot that can be in it in several, so that its
        strategy takes the shortest path to the pose that its charge was compared for."""
        stops, charge = self.stops(robot), robot.charge
        robot_objective = robot.own.objective
        if stops is None or charge is None or self.team.rivals(robot.robot):
            return
        if isinstance(robot_objective, Ltl) or robot_objective.settles:
            return
        start = stops.graph.number(robot.pose)
        several = any(target & (target - 1) for target in stops.targets)
        if not several or stops.need(start, 0) > charge:
            return
        poses = [[1 << pose for pose in bits(t & stops.allowed)] for t in stops.targets]
        best = 0
        for places in islice(product(*poses), MOST_CHOICES):
            tried = replace(stops, targets=places, _needs=None, _hops={})
            slack = charge + 1 - tried.need(start, 0)
            if slack > best:
                best, robot.places = slack, places
        self._known.pop(robot.name, None)

    def stops(self, robot: RobotState) -> Stops | None:
        """The stops of a robot on the floor as it is known; None without a battery."""
        return self._on_floor(robot, frozenset(self.team.knowledge.pending))

    def lasts_until(self, name: str, obstacle: str) -> int | None:
        """The last tick in which an obstacle that cuts a robot off from its chargers can be
        resolved, by its charge as it waits; None if it does not cut it off, or waiting is free."""
        robot = self.team.robots[name]
        battery, pending = robot.robot.model.battery, frozenset(self.team.knowledge.pending)
        if battery is None or robot.charge is None or not battery.stay:
            return None
        self._known.pop(name, None)
        chosen, robot.places = robot.places, ()
        shut, behind = self._on_floor(robot, pending), self._on_floor(robot, pending - {obstacle})
        robot.places = chosen
        self._known.pop(name, None)
        if shut is None or behind is None:
            return None
        pose = shut.graph.number(robot.pose)
        turn = robot.own.memory.index % len(shut.targets)
        need = behind.need(pose, turn)
        if shut.need(pose, turn) <= robot.charge or need > robot.charge:
            return None
        return self.team.tick + (robot.charge - need) // battery.stay

    def _on_floor(self, robot: RobotState, avoid: frozenset[str]) -> Stops | None:
        battery, objective = robot.robot.model.battery, robot.own.objective
        if battery is None or isinstance(objective, Ltl):
            return None
        known_walls = self.team.knowledge.walls_for(robot.robot, avoid)
        closed = region_mask(known.region for known in known_walls)
        key = (objective, closed)
        known = self._known.get(robot.name)
        if known is not None and known[0] == key:
            return known[1]
        graph = graph_of(robot.robot, self.team.scenario.map)
        masks = tuple(graph.poses_on(region_mask(t)) for t in targets_of(objective))
        masks = masks[-1:] if objective.settles else masks
        masks = robot.places if robot.places and not closed else masks
        chargers: Mask = graph.poses_on(region_mask(self.team.scenario.chargers))
        allowed = graph.everywhere & ~graph.poses_on(closed)
        shared = bool(self.team.rivals(robot.robot))
        found = Stops(graph, masks, allowed, chargers & allowed, battery, full=shared)
        self._known[robot.name] = (key, found)
        return found

    def _stop(self, robot: RobotState) -> Pose | None:
        """Where a robot is to charge, or to stay and charge; None: it pursues its own objective."""
        stops = self.stops(robot)
        assert stops is not None
        assert robot.charge is not None
        pose = stops.graph.number(robot.pose)
        turn = robot.own.memory.index % len(stops.targets)
        stop, rivals = robot.stop, self.team.rivals(robot.robot)
        if stop is not None:
            here = stop == robot.pose or (rivals and stop.region == robot.pose.region)
            there = 1 << stops.graph.number(stop)
            if not here:
                if stops.graph.steps_between(1 << pose, there, stops.allowed) is not None:
                    return stop
            elif robot.charge < stops.wanted(pose, turn):
                return stop
        charger = stops.charger(pose, turn, robot.charge)
        return None if charger is None else stops.graph.pose(charger)

    def _moved(self, move: records.Move) -> None:
        robot = self.team.robots[move.robot]
        battery = robot.robot.model.battery
        if battery is None or robot.charge is None:
            return
        if move.to != move.from_:
            robot.charge -= battery.move
        elif move.toward is None and move.to in self.team.scenario.chargers:
            robot.charge = min(battery.capacity, robot.charge + battery.charge)
        elif move.toward is None:
            robot.charge = max(0, robot.charge - battery.stay)

    def _runs_flat(self, robot: RobotState) -> Iterator[Event]:
        """An obstacle appears where the robot stands, which asks for its resolution; where none
        can, the robot is out of service for the rest of the run."""
        kind, world, region = self.team.scenario.flat, self.world, robot.pose.region
        if kind is None or world is None or region in world.standing():
            cause = ChangeCause.BATTERY  # nothing can be brought here
            yield from self.turns.serve(robot, active=False, cause=cause)
            return
        obstacle = Obstacle(kind, region, appears=self.team.tick)
        self._flat[obstacle.name] = robot.name
        yield from self.turns.leave_plan(PlanEndReason.CHANGED, settling=True)
        world.place(obstacle)
        self.team.introduce(obstacle)
        robot.active = False
        yield BatteryFlat(obstacle, robot.name)


def least_charge(batteries: Batteries, robot: RobotState) -> int | None:
    """The charge that a robot needs where it is to continue forever; None if none suffices."""
    stops = batteries.stops(robot)
    if stops is None:
        return 0
    turn = robot.own.memory.index % len(stops.targets)
    need = stops.need(stops.graph.number(robot.pose), turn)
    return None if need >= NEVER else need
