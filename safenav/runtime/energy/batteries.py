"""Batteries during a run: each robot's charge and charging stops, and robots with an empty
battery."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from math import ceil

from msgspec.structs import replace

from safenav.runtime.coordination.events import Event, OutsideStrategy, ServiceChanged, Unsettled
from safenav.runtime.duties.settlement import Duty
from safenav.runtime.energy.charges import SHARPNESS, Charges
from safenav.runtime.stops import NEVER, SPARE, Stops
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.turns.relocation import Relocation
from safenav.runtime.worlds.world import SimulatedWorld
from safenav.scenario.model import Battery, Obstacle
from safenav.scenario.objective import Ltl, Objective
from safenav.trace import records
from safenav.trace.vocabulary import ChangeCause, Reason
from safenav.world.map import Region
from safenav.world.moves import Pose
from safenav.world.poses import Mask, bits

_SEARCHED = 4_000
"""Maximum number of poses for the search for a sufficient capacity, which then takes under a
second."""


_SWAP = 6
"""Maximum ticks for two robots to change places at a charger by a joint plan."""


class Batteries:
    """Updates ``RobotState.charge`` after moves, and decides each robot's next stop
    (``RobotState.stop``). ``world``: the simulated world, if any, to which an obstacle is added for
    a robot with an empty battery."""

    def __init__(
        self, team: TeamState, relocation: Relocation, world: SimulatedWorld | None
    ) -> None:
        self.team, self.relocation, self.world = team, relocation, world
        self._flat: dict[str, str] = {}  # the robot that each obstacle represents
        self._charged: list[str] = []
        self._later: dict[str, None] = {}  # robots whose stop is not decided yet
        self._known: dict[str, tuple[object, Stops]] = {}
        self._free: dict[tuple[str, Objective, frozenset[Region]], Stops] = {}
        robots = team.robots.items()
        batteries = {name: r.robot.model.battery for name, r in robots if r.robot.model.battery}
        starts = {name: robot.pose.region for name, robot in robots}
        had = () if team.scenario.begun is None else team.scenario.begun.had
        about = batteries, starts, team.scenario.chargers
        self._charges = Charges(*about, live=team.live, had=had)
        for name, charge in self._charges.charge.items():
            team.robots[name].charge = charge

    def __call__(self, record: records.Record) -> None:
        """Process records of moves and of replaced batteries."""
        if isinstance(record, records.Move | records.Depart | records.Arrive | records.Operator):
            self._charges.take(record)
            if record.robot in self._charges.charge:
                charge = self._charges.at(record.robot, record.t or 0.0)
                self.team.robots[record.robot].charge = charge
        elif isinstance(record, records.Resolved) and record.obstacle in self._flat:
            self._charged.append(self._flat.pop(record.obstacle))

    @property
    def returns(self) -> bool:
        """Return whether a robot returns to service in the next tick because its battery was
        replaced."""
        return bool(self._charged)

    def tick_begins(self) -> Iterator[Event]:
        """Return robots to service whose battery was replaced in the previous tick; decide the
        first stops. Live: update all charges to the present time."""
        begins, begun = self.team.tick == 1, self.team.scenario.begun
        if begins and begun is not None and begun.charging:  # they stay at their chargers
            for name in begun.charging:
                self.team.robots[name].stop = self.team.robots[name].pose
            yield Unsettled(Reason.CHARGE)
        for name in [*self._charges.since]:
            robot = self.team.robots[name]
            before, robot.charge = robot.charge, self._charges.at(name, self._now())
            if robot.charge != before or self._makes_room(robot):  # decide before its next step
                yield from self.turn_ends(robot)
        for robot in self.team.robots.values() if begins else ():
            if robot.too_flat or not self.team.has_had_turn(robot):  # count its targets first
                yield from self.turn_ends(robot)
        later, self._later = self._later, {}
        for name in later:
            yield from self.turn_ends(self.team.robots[name])
        charged, self._charged = self._charged, []
        for name in charged:
            robot = self.team.robots[name]
            self._charges.stands(name, robot.pose.region, self._now())
            robot.charge = self._charges.charge[name]
            yield from self.relocation.serve(robot, active=True, cause=ChangeCause.BATTERY)

    def turn_ends(self, robot: RobotState, *, completes: bool = False) -> Iterator[Event]:
        """Decide the next stop of a robot after its turn. ``completes``: the mission is completed
        in this state, so the stop is decided at the start of the next tick, if there is one."""
        battery, scenario = robot.robot.model.battery, self.team.scenario
        busy = robot.transit is not None or robot.acting is not None or not robot.active
        if battery is None or robot.charge is None or busy:
            return
        on_charger = robot.pose.region in scenario.chargers
        if robot.too_flat and not on_charger:
            yield from self._runs_flat(robot)
        elif completes or self._keeps_to_plan(robot):  # the stop is decided afterwards
            self._later[robot.name] = None
        elif scenario.chargers:
            while (stop := self._stop(robot)) != robot.stop:  # a target may count immediately
                robot.stop = stop
                if not self.relocation.traffic.plan.goes_on_without(robot):
                    yield from self.relocation.leave_plan()
                if self.team.waiting is None:
                    yield Unsettled(Reason.CHARGE)
                else:  # a waiting team decides no duties
                    yield OutsideStrategy(robot.name, Reason.CHARGE)

    def _keeps_to_plan(self, robot: RobotState) -> bool:
        """Return whether a robot has the charge for the remaining joint plan and its need
        afterwards; its next stop is then chosen after the plan. Otherwise the robot might leave the
        plan for a charger, and the same plan would be made repeatedly."""
        takes, battery = self.relocation.traffic.plan.takes(robot), robot.robot.model.battery
        if takes is None or battery is None or robot.charge is None:
            return False
        on_charger = robot.pose.region in self.team.scenario.chargers
        return takes <= (battery.capacity if on_charger else robot.charge)

    def stops(self, robot: RobotState) -> Stops | None:
        """Return the charging stops of a robot on the known floor; None if it has no battery or its
        objective is a formula."""
        return self._on_floor(robot, frozenset(self.team.knowledge.pending))

    def lasts_until(self, name: str, obstacle: str, *, had_turn: bool) -> int | None:
        """Return the last tick in which an obstacle that cuts a robot off from its chargers can be
        resolved before the robot's charge is too low; None if it is not cut off, or waiting is
        free. ``had_turn``: whether its charge already includes this tick."""
        robot = self.team.robots[name]
        battery, pending = robot.robot.model.battery, frozenset(self.team.knowledge.pending)
        if battery is None or robot.charge is None or not battery.stay:
            return None
        blocked = self._on_floor(robot, pending)
        behind = self._on_floor(robot, pending - {obstacle})
        if blocked is None or behind is None:
            return None
        waits = not (had_turn or self.team.has_had_turn(robot))
        charge = robot.charge - battery.stay * waits
        pose = blocked.graph.number(robot.pose)
        turn = blocked.turn(robot.own.memory.index)
        need = behind.need(pose, turn)
        if blocked.need(pose, turn) <= charge or need > charge:
            return None
        if blocked.nearest(pose, blocked.chargers) * battery.move <= charge:
            return None  # it can wait at a charger
        return self.team.tick + int(int(charge - need) // battery.stay)

    def times(self) -> Iterator[float]:
        """Live: yield the times at which a charging robot reaches the charge for which it waits (at
        least that of one step), and those at which the charge of an idle robot falls to the next
        whole number."""
        for name, since in self._charges.since.items():
            robot, charge = self.team.robots[name], self._charges.charge[name]
            battery, rate = robot.robot.model.battery, self._charges.rate(name)
            if battery is None or robot.transit is not None or not robot.active:
                continue
            if self._charges.region[name] not in self.team.scenario.chargers:
                left = ceil(self._charges.at(name, self._now()) - 1) - charge
            elif (takes := self.relocation.traffic.plan.takes(robot)) is not None:
                left = max(takes, battery.move) - charge
            elif robot.stop is not None or robot.too_flat:
                wanted = self._wanted(robot) if robot.stop is not None else 0
                left = max(wanted, battery.move) - charge
            else:
                continue
            if rate:
                yield since + ceil(left / rate * 10**SHARPNESS) / 10**SHARPNESS

    def _wanted(self, robot: RobotState) -> int:
        """Return the charge with which a robot leaves its present charger."""
        stops = self.stops(robot)
        assert stops is not None
        return self._leaves_with(robot, stops, stops.turn(robot.own.memory.index))

    def _leaves_with(self, robot: RobotState, stops: Stops, turn: int) -> int:
        """Return the charge with which a robot leaves a stop. A helper leaves with a full battery,
        since its duty needs more than its own objective."""
        pose = stops.graph.number(robot.pose)
        if self._duty(robot) is not None:
            return stops.battery.capacity if stops.chargers >> pose & 1 else 0
        return stops.wanted(pose, turn)

    def _now(self) -> float:
        return round(self.team.now(), 9) if self.team.now is not None else 0.0

    def _on_floor(self, robot: RobotState, avoid: frozenset[str]) -> Stops | None:
        battery, objective = robot.robot.model.battery, robot.own.objective
        if battery is None or isinstance(objective, Ltl):
            return None
        walls = self.team.knowledge.walls_for(robot.robot, avoid)
        closed = frozenset(known.region for known in walls)
        before, found = self._known.get(robot.name, (None, None))
        if found is None or before != (objective, closed):
            graph = self.team.graph(robot)
            targets, allowed = graph.on_each(objective.targets), graph.outside(closed)
            chargers = graph.on(self.team.scenario.chargers) & allowed
            detours = objective.strict and objective.literal
            full, ends = detours or bool(self.team.rivals(robot.robot)), objective.settles
            found = Stops(graph, targets, allowed, chargers, battery, full=full, settles=ends)
            self._known[robot.name] = (objective, closed), found
        return found

    def _stop(self, robot: RobotState) -> Pose | None:
        """Return the next charging stop of a robot, or the charger at which it stays; None if it
        continues with its objective."""
        stops = self.stops(robot)
        assert stops is not None
        assert robot.charge is not None
        pose = stops.graph.number(robot.pose)
        turn, duty = stops.turn(robot.own.memory.index), self._duty(robot)
        helping = None if duty is None else stops.for_duty(duty.goal, turn)
        if helping is not None:
            stops, turn = helping, 0
        stop, rivals = robot.stop, self.team.rivals(robot.robot)
        others = self.team.in_conflict(robot.robot)
        held = stops.graph.on(r.pose.region for r in others if self._stays(r))
        if stop is not None:
            here = stop == robot.pose or (rivals and stop.region == robot.pose.region)
            there = stops.graph.number(stop)
            if not here:
                to = stops.graph.on({stop.region}) if rivals else 1 << there
                steps = stops.graph.steps_between(1 << pose, to, stops.allowed)
                near = steps is not None and steps * stops.battery.move <= robot.charge
                settled = self.team.settled
                if settled is not None and robot.pose == settled.notes.hemmed_in.get(
                    settled.floor.index(robot.name)
                ):  # a search has shown that no order of moves brings it to its stop
                    near, held = False, held | to
                if near and not held >> there & 1:
                    return stop
            elif robot.charge < self._leaves_with(robot, stops, turn):
                return stop
            elif (stops.targets[turn] & ~stops.chargers) >> there & 1:
                return None  # its objective begins at a target that it already occupies
        away = (r.pose if r.stop is None else r.stop for r in others)
        taken = stops.graph.on(there.region for there in away)
        place = stops.next(pose, turn, robot.charge, held, taken, helps=duty is not None)
        if place is None and duty is None:
            free = stops.reachable(pose, stops.chargers & ~held)
            place = self._waits_at(robot, stops, free & ~taken or free)
        return None if place is None else stops.graph.pose(place)

    def _waits_at(self, robot: RobotState, stops: Stops, chargers: Mask) -> int | None:
        """Return the charger to which a waiting robot must return now, or at which it stays, since
        waiting uses charge; None if it does not wait, or can still wait in its pose."""
        battery, charge = stops.battery, robot.charge
        pose = stops.graph.number(robot.pose)
        assert charge is not None
        if not battery.stay or not self._is_cut_off(robot):  # a low charge alone: it tries
            return None
        if stops.chargers >> pose & 1:
            return pose if robot.stop == robot.pose and not self._makes_room(robot) else None
        steps = stops.nearest(pose, chargers)
        spare = SPARE * battery.move if self.team.rivals(robot.robot) else 0
        later = charge - (1 if self.team.live else battery.stay)
        takes = steps * battery.move
        if takes > charge or later >= takes + spare + self._queue(robot, battery):
            return None
        there = (at for at in bits(chargers) if stops.steps(pose, at) == steps)
        return min(there, default=None)

    def _makes_room(self, robot: RobotState) -> bool:
        """Return whether a robot waits at a charger with enough charge while another robot needs
        the charger."""
        battery, here = robot.robot.model.battery, robot.pose.region
        if battery is None or robot.charge != battery.capacity:
            return False
        stops = (other.stop for other in self.team.in_conflict(robot.robot))
        return any(stop is not None and stop.region == here for stop in stops)

    def _queue(self, robot: RobotState, battery: Battery) -> int:
        """Return the charge that a robot uses while the other waiting robots charge, at most half
        of its capacity."""
        waiting = (other for other in self.team.in_conflict(robot.robot) if self._is_cut_off(other))
        batteries = (other.robot.model.battery for other in waiting)
        ticks = sum(ceil(one.capacity / one.charge) + _SWAP for one in batteries if one is not None)
        return min(ceil(ticks * battery.stay), battery.capacity // 2)

    def _is_cut_off(self, robot: RobotState) -> bool:
        """Return whether obstacles that may still be resolved keep a robot from its targets: with
        them no charge suffices, without them some charge does."""
        stops = self.stops(robot) if robot.active else None
        if stops is None:
            return False
        pose, turn = stops.graph.number(robot.pose), stops.turn(robot.own.memory.index)
        return stops.need(pose, turn) >= NEVER and self._unhindered(robot).need(pose, turn) < NEVER

    def _unhindered(self, robot: RobotState) -> Stops:
        """Return the charging stops of a robot on the floor without obstacles; with permanent ones,
        unless the team waits for a change."""
        objective, (_, stops) = robot.own.objective, self._known[robot.name]
        lasting = [] if self.team.waiting else self.team.knowledge.walls_for(robot.robot)
        key = robot.name, objective, frozenset(known.region for known in lasting)
        if key not in self._free:
            allowed = stops.graph.outside(key[2])
            chargers = stops.graph.on(self.team.scenario.chargers) & allowed
            self._free[key] = replace(stops, allowed=allowed, chargers=chargers)
        return self._free[key]

    def _duty(self, robot: RobotState) -> Duty | None:
        """Return the present duty of a robot; None if it has none."""
        if self.team.settled is None:
            return None
        floor, found = self.team.settled.floor, self.team.settled.found
        return found.duties.get(floor.index(robot.name))

    def _stays(self, robot: RobotState) -> bool:
        """Return whether a robot stays in its region: it is out of service, or its only target is
        there."""
        here, targets = {robot.pose.region}, robot.own.objective.targets
        holds = robot.stop is None and targets and all(target == here for target in targets)
        return robot.transit is None and (not robot.active or bool(holds))

    def _runs_flat(self, robot: RobotState) -> Iterator[Event]:
        """Represent a robot with an empty battery by an obstacle, and request its resolution;
        without an obstacle type for that the robot is out of service until the run ends."""
        kind, world, region = self.team.scenario.flat, self.world, robot.pose.region
        known = self.team.knowledge.obstacles
        there = known if world is None else {n: w.obstacle for n, w in world.works.open.items()}
        obstacle = None if kind is None else Obstacle(kind, region, appears=int(self.team.time))
        if obstacle is None or any(
            one.region == region and (not one.ordered or one.name == obstacle.name)
            for one in there.values()
        ):  # the region already holds an unresolved obstacle
            yield from self.relocation.serve(robot, active=False, cause=ChangeCause.BATTERY)
            return
        self._flat[obstacle.name] = robot.name
        yield from self.relocation.leave_plan()
        if world is not None:
            world.place(obstacle)
        self.team.introduce(obstacle)
        yield ServiceChanged(robot.name, False, ChangeCause.BATTERY, obstacle)


def least_charge(batteries: Batteries, robot: RobotState) -> int | None:
    """Return the charge that a robot needs in its pose to continue forever; None if none
    suffices."""
    stops = batteries.stops(robot)
    if stops is None:
        return 0
    turn = stops.turn(robot.own.memory.index)
    need = stops.need(stops.graph.number(robot.pose), turn)
    return None if need >= NEVER else need


def least_capacity(batteries: Batteries, robot: RobotState) -> int | None:
    """Return the least capacity with which a fully charged robot could continue forever from its
    pose; None if none suffices, or the floor is too large for a search."""
    stops = batteries.stops(robot)
    if stops is None or stops.allowed.bit_count() > _SEARCHED:
        return None
    pose, turn = stops.graph.number(robot.pose), stops.turn(robot.own.memory.index)

    def suffices(capacity: int) -> bool:
        larger = replace(stops.battery, capacity=capacity)
        return replace(stops, battery=larger).need(pose, turn) <= capacity

    legs = len(stops.targets) + 1  # each leg passes a pose at most once
    most = stops.battery.capacity + legs * stops.allowed.bit_count() * stops.battery.move
    tried = range(stops.battery.capacity, most)
    found = bisect_left(tried, True, key=suffices)
    return tried[found] if found < len(tried) else None
