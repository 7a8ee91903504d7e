"""The execution of a plan: the times of each robot's steps and the charges then.

Plans state the order of steps, not their times. A robot leaves a charger as soon as it has enough
charge until its next stop. If a charge does not suffice, the robot waits on the charger rather than
elsewhere.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from math import ceil

from safenav.plan.order import plan_of
from safenav.scenario.model import DECIMALS
from safenav.team.battery import AMPLE, Energy
from safenav.team.floor import Floor, Joint
from safenav.team.state import Plan, Waypoint

COURSES = 4
MEAN = 0.1
"""The weight of the robots' mean time, relative to the time of the last robot."""


Leaves = Callable[[int, int, float, float], float]
"""The time of a robot's step to a place of its path. Arguments: robot, place, arrival time at the
previous place, and earliest time of the step."""


def timed(
    floor: Floor,
    plan: Plan,
    ticks: Sequence[Joint],
    times: Sequence[float],
    leaves: Leaves | None = None,
    acts: Sequence[float] = (),
) -> list[list[float]]:
    """Return the times at which each robot arrives at the waypoints of its path, if its steps take
    ``times`` and its actions ``acts``. ``ticks``: the successive joint states of the plan."""
    arrives: list[list[float]] = [[0] for _ in times]
    met, opened = dict[tuple[int, int], float](), dict[tuple[int, int], float]()
    size, lockstep = floor.team.size, not floor.team.live  # in lockstep robots move in turn
    for before, joint in pairwise(ticks):
        last = 0.0
        moved = deque(i for i in floor.robots if before.poses[i] != joint.poses[i])
        while moved:
            i = moved.popleft()
            place, came = len(arrives[i]), arrives[i][-1]
            waypoint = plan.ways[i][place]
            if any(len(arrives[j]) <= other for j, other in waypoint.after):
                moved.append(i)  # another robot has to leave first
                continue
            waits = [arrives[j][other] - (j < i and lockstep) for j, other in waypoint.after]
            waits += [met.get(need, 0) for need in waypoint.needs]
            ready = max(came, *waits, opened.get((i, waypoint.pose % size), 0))
            ready = ready if leaves is None else leaves(i, place, came, ready)
            arrives[i].append(ready + times[i])
            last = max(last, arrives[i][-1])
        if joint.stages != before.stages:
            now = last
            there = floor.acting(before.stages) if acts else 0
            on = (i for i in floor.robots if there >> joint.poses[i] % size & 1)
            now += max((acts[i] for i in on), default=0)
            pairs = zip(floor.gates, before.stages, joint.stages, strict=True)
            met |= {(k, n + 1): now for k, a, b in pairs for n in range(a.need, b.need)}
            over = {*floor.open(before.stages)}.difference(floor.open(joint.stages))
            for gate in map(floor.gate, over):
                opened |= {(i, gate.region): now for i in gate.blocks}
    return arrives


def cost(floor: Floor, ends: Sequence[float]) -> float:
    """Return the time of the last robot, plus a share of the mean time if robots' speeds differ."""
    mixed = len({floor.team.step_times[i] for i in floor.robots}) > 1
    return max(ends) + (MEAN * sum(ends) / len(ends) if mixed else 0)


class Course:
    """An execution of a plan. Each robot leaves a charger with at least the charge ``least`` of
    (robot, waypoint), and no earlier than ``since``. ``failed``: the robots whose charge does not
    suffice; ``strands``: whether a robot lacks the charge for a step."""

    def __init__(
        self,
        floor: Floor,
        states: Sequence[Joint],
        plan: Plan,
        least: Mapping[tuple[int, int], float],
        since: Mapping[tuple[int, int], float] = {},
    ) -> None:
        self.floor, self.states, self.plan = floor, states, plan
        self.least, self.since = least, since
        self.charges, team = [*states[0].charges], floor.team
        self.energies = {i: e for i in floor.robots if (e := team.members[i].energy) is not None}
        self.left = dict[tuple[int, int], tuple[float, float, float]]()
        self.waits = dict[tuple[int, int], float]()
        self.strands = False
        self.failed, acts = set[int](), team.act_times if team.live else ()
        self.arrives = timed(floor, plan, states, team.step_times, self._leaves, acts)
        ends = [each[-1] for each in self.arrives]
        self.end, self.cost = max(ends), cost(floor, ends)
        for i, energy in self.energies.items():
            waits, pose = self.end - self.arrives[i][-1], states[-1].poses[i]
            self.charges[i] = _stayed(energy, self.charges[i], pose, waits)
            if self.charges[i] < _wanted(floor, states[-1], i):
                self.failed.add(i)

    def _leaves(self, i: int, place: int, came: float, ready: float) -> float:
        if (energy := self.energies.get(i)) is None:
            return ready
        pose, battery, key = self.plan.ways[i][place - 1].pose, energy.battery, (i, place)
        if energy.charging(pose):
            waits = max(0.0, self.least[key] - self.charges[i]) / battery.charge
            self.waits[key] = waits
            ready = max(ready, came + (waits if self.floor.team.live else ceil(waits)))
            ready = max(ready, self.since.get(key, 0))
        self.charges[i] = _stayed(energy, self.charges[i], pose, ready - came)
        self.left[key] = came, ready, self.charges[i]
        self.charges[i] = round(self.charges[i] - battery.move, DECIMALS)
        if self.charges[i] < 0:
            self.failed.add(i)
            self.strands = True
        return ready

    def needs(self) -> Iterator[tuple[tuple[int, int], float, float]]:
        """Yield, for each step of each robot, its needed charge to the next charger with this
        execution's waits, and the departure time that avoids these waits."""
        last = self.states[-1]
        for i, energy in self.energies.items():
            on, way = energy.charging(last.poses[i]), self.plan.ways[i]
            waits = 0 if on else self.end - self.arrives[i][-1]
            need = _wanted(self.floor, last, i) + waits * energy.battery.stay
            for place in range(len(way) - 1, 0, -1):
                need += energy.battery.move
                came, ready, _ = self.left[i, place]
                yield (i, place), need, ready + waits
                on = energy.charging(way[place - 1].pose)
                waits = 0 if on else waits + ready - came
                need = 0 if on else need + (ready - came) * energy.battery.stay

    def stops(self, i: int) -> dict[int, int]:
        """Return the waypoints at which a robot waits for charge, each with its ticks there."""
        tick = min(self.floor.team.step_times[j] for j in self.floor.robots)
        found = ((place, ceil(waits / tick)) for (j, place), waits in self.waits.items() if j == i)
        return {place - 1: ticks for place, ticks in found}

    def way(self, i: int, begun: float) -> tuple[Waypoint, ...]:
        """Return the path of a robot that leaves chargers with enough charge. If waits elsewhere
        use charge, it leaves chargers where it waits no earlier than in this course."""
        if (energy := self.energies.get(i)) is None:
            return self.plan.ways[i]
        way = [*self.plan.ways[i]]
        for place in range(1, len(way)):
            came, ready, charge = self.left[i, place]
            due = 0.0
            if energy.charging(way[place - 1].pose):
                charge = self.least[i, place]
                if energy.battery.stay and ready > came:
                    due = begun + ready + (not self.floor.team.live)
            way[place] = way[place]._replace(charge=charge, tick=due)
        return tuple(way)

    def planned(self, begun: float) -> Plan:
        """Return the joint plan. ``begun``: the tick before its first tick (live: its start
        time)."""
        ways: list[tuple[Waypoint, ...]] = [()] * len(self.charges)
        for i in self.floor.robots:
            ways[i] = self.way(i, begun)
        return Plan(tuple(ways), self.plan.foreseen, tuple(self.charges))


def course_of(floor: Floor, states: Sequence[Joint]) -> Course:
    """Return the earliest-ending execution of the plan with these states: robots leave chargers
    with the charges of the states, or with less where that suffices. If all such executions fail,
    return the one that takes as long as the states."""
    plan, _ = plan_of(floor, states[0], [joint.poses for joint in states])
    at, tick = [0] * len(plan.ways), 0.0
    planned, since = dict[tuple[int, int], float](), dict[tuple[int, int], float]()
    for before, joint in pairwise(states):
        for i in floor.robots:
            if before.poses[i] != joint.poses[i]:
                at[i] += 1
                planned[i, at[i]] = before.charges[i]
                since[i, at[i]] = tick
        tick += _duration(floor.team.step_times, before, joint)
    best, course, later = None, Course(floor, states, plan, planned), dict[tuple[int, int], float]()
    for _ in range(COURSES):
        if not course.failed and (best is None or course.cost < best.cost):
            best = course
        least = {}
        for key, need, ready in course.needs():
            battery = course.energies[key[0]].battery
            spare = min(planned[key], need + AMPLE * battery.capacity * (battery.stay > 0))
            least[key] = min(battery.capacity, max(need, spare))
            if key[0] in course.failed:  # the robot waits on the charger instead
                later[key] = ready
        course = Course(floor, states, plan, least, later)
    return best or Course(floor, states, plan, planned, since)


def _stayed(energy: Energy, charge: float, pose: int, time: float) -> float:
    """Return the charge of a battery after its robot has stayed in ``pose`` for ``time``."""
    battery = energy.battery
    if energy.charging(pose):
        return min(battery.capacity, round(charge + time * battery.charge, DECIMALS))
    return round(charge - time * battery.stay, DECIMALS)


def _wanted(floor: Floor, last: Joint, i: int) -> float:
    """Return the charge that a robot must have at the end of a plan: enough to continue, off the
    chargers with an ample reserve, but at most its charge in the plan."""
    energy = floor.team.members[i].energy
    assert energy is not None
    more = 0 if energy.charging(last.poses[i]) or not energy.battery.stay else AMPLE
    return min(needed(floor, last, i) + more * energy.battery.capacity, last.charges[i])


def needed(floor: Floor, joint: Joint, i: int) -> float:
    """Return the least charge with which a robot that has a battery can continue forever."""
    energy = floor.team.members[i].energy
    assert energy is not None
    allowed, turn = floor.allowed(i, joint.stages), energy.turn(joint.counts[i][0])
    return energy.need(allowed, joint.poses[i], turn)


def _duration(times: Sequence[float], before: Joint, joint: Joint) -> float:
    """Return the duration of a transition: the largest of the ``times`` of robots that step."""
    steps = zip(times, before.poses, joint.poses, strict=True)
    return max((time for time, a, b in steps if a != b), default=1)
