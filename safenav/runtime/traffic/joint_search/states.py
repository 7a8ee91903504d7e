"""Joint states of a team (pose and progress of each robot, stages of the obstacles), and the
results of a search among them.

One robot's step is one transition; waiting costs nothing. The states that can be reached, and the
condition for the end of the mission, are defined here once, for plans and for proofs alike, and
in words in docs/trace.md, for checkers of the proofs.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property, reduce
from operator import or_

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.cached_method import cached_method
from safenav.runtime.resolution.problem import Problem, Stages
from safenav.runtime.stops import Stops
from safenav.scenario.pursuit import Pursuit
from safenav.world.poses import Mask, PoseGraph, bits

Count = tuple[int, int, int]
"""Progress of a robot since the last resolution: the memory of its ``Pursuit``, as the next target
(0 without an order) and the targets met in this round (0 with an order), and the goals or rounds
met."""

DONE_HOLDING = 1


def has_met(count: Count, due: Count) -> bool:
    """Return whether a robot with this count has met all goals of ``due``."""
    return (count[2], count[1] & due[1]) >= (due[2], due[1])


class JointState(Struct, frozen=True):
    """One joint state. ``poses`` by number, see ``PoseGraph``; ``charges`` of the robots whose
    batteries a course follows, in its order."""

    poses: tuple[int, ...]
    counts: tuple[Count, ...]
    stages: Stages
    charges: tuple[int, ...] = ()


class Steps(dict[int, tuple[int, ...]]):
    """The ``allowed`` poses one step away from each pose; computed on demand."""

    def __init__(self, graph: PoseGraph, allowed: Mask) -> None:
        self.graph = graph
        self.allowed = allowed

    def __missing__(self, pose: int) -> tuple[int, ...]:
        after = tuple(q for q in self.graph.steps(pose) if self.allowed >> q & 1)
        self[pose] = after
        return after


class Reached(dict[int, int]):
    """The targets that each pose reaches, as a mask; computed on demand."""

    def __init__(self, targets: tuple[Mask, ...]) -> None:
        self.targets = targets

    def __missing__(self, pose: int) -> int:
        found = sum(1 << k for k, target in enumerate(self.targets) if target >> pose & 1)
        self[pose] = found
        return found


class Course(Struct, frozen=True, eq=False, dict=True):
    """The rules by which joint states follow one another.

    ``rounds``: rounds that each robot must complete after the last resolution. ``served``: the
    obstacles that must be resolved before the mission ends. ``sent``: the obstacle to which a robot
    is sent; if it is a load, the robot keeps room for it. ``excused``: robots whose rounds the
    mission does not require. ``any_first``: robots begin with any of their targets where they may
    (of more than two with the first that they reach, which may miss a plan). ``batteries``: those
    of the robots whose charge it tracks. A robot waits on a charger until it is full, and its
    charge always suffices to continue alone.
    """

    problem: Problem
    rounds: int
    served: frozenset[int] = frozenset()
    sent: Mapping[int, int] = field(default_factory=dict)
    excused: frozenset[int] = frozenset()
    any_first: bool = False
    batteries: Mapping[int, Stops] = field(default_factory=dict)

    @cached_property
    def _pursuits(self) -> list[Pursuit]:
        return [member.pursuit for member in self.problem.members]

    @cached_property
    def _reached(self) -> list[Reached]:
        return [Reached(member.targets) for member in self.problem.members]

    def serving(self, served: frozenset[int]) -> Course:
        """Return the rules with other obstacles to resolve; robots keep room for these loads
        only."""
        sent = {robot: gate for robot, gate in self.sent.items() if gate in served}
        return replace(self, served=served, sent=sent)

    def begun(
        self, poses: tuple[int, ...], counts: tuple[Count, ...], stages: Stages
    ) -> JointState:
        """Return the start state of a search: goals that waiting meets count as met."""
        return self._settled(poses, counts, stages, range(len(poses)))

    def moved(self, state: JointState, poses: tuple[int, ...], who: Iterable[int]) -> JointState:
        """Return the state after the robots ``who`` have reached their poses in ``poses``."""
        found = self._settled(poses, state.counts, state.stages, who)
        if not self.batteries:
            return found
        pairs = zip(self.batteries.items(), state.charges, strict=True)
        charges = tuple(
            stops.charge_after(charge, poses[robot], moves=poses[robot] != state.poses[robot])
            for (robot, stops), charge in pairs
        )
        return replace(found, charges=charges)

    def has_charge(self, state: JointState) -> bool:
        """Return whether each robot has enough charge to continue alone."""
        return not self.batteries or all(
            charge >= stops.needed(state.poses[robot], stops.turn(state.counts[robot][0]))
            for (robot, stops), charge in zip(self.batteries.items(), state.charges, strict=True)
        )

    def along(self, first: JointState, joint_poses: Iterable[tuple[int, ...]]) -> list[JointState]:
        """Return the states from the first on while the robots go to these joint poses."""
        found = [first]
        for poses in joint_poses:
            found.append(self.moved(found[-1], poses, range(len(poses))))
        return found

    @cached_method
    def steps(self, stages: Stages) -> tuple[Steps, ...]:
        """Return for each robot the steps that walls and open obstacles leave to it."""
        return tuple(
            Steps(member.graph, self.problem.allowed(i, stages))
            for i, member in enumerate(self.problem.members)
        )

    @cached_method
    def hopeful(self, stages: Stages) -> tuple[Steps, ...]:
        """Return those of ``steps`` after which the robot could still continue forever if all
        obstacles were out of its way: no other step leads to the end of the mission."""
        return tuple(
            Steps(m.graph, steps.allowed & m.live(m.floor))
            for m, steps in zip(self.problem.members, self.steps(stages), strict=True)
        )

    def singles(self, state: JointState) -> Iterator[tuple[int, int]]:
        """Yield (robot, pose) for every step that one robot can take while the others stand
        still."""
        apart, poses = self.problem.separation, state.poses
        for robot, steps in enumerate(self.steps(state.stages)):
            closed, size = apart.closed(robot, poses), apart.sizes[robot]
            for pose in steps[poses[robot]]:
                if not closed >> pose % size & 1:
                    yield robot, pose

    def next_poses(self, state: JointState) -> set[tuple[int, ...]]:
        """Return the joint poses after each of ``singles``."""
        at = state.poses
        return {(*at[:robot], pose, *at[robot + 1 :]) for robot, pose in self.singles(state)}

    def after(self, state: JointState, robot: int, pose: int) -> JointState:
        """Return the state after one step of one robot."""
        poses = (*state.poses[:robot], pose, *state.poses[robot + 1 :])
        return self.moved(state, poses, (robot,))

    def is_done(self, robot: int, count: Count) -> bool:
        """Return whether a robot has completed all its rounds."""
        member = self.problem.members[robot]
        if member.settles:
            return count[2] >= DONE_HOLDING
        if not member.targets:
            return True
        return count[2] >= self.rounds * (len(member.targets) if member.in_turn else 1)

    def stands(self, robot: int, pose: int) -> bool:
        """Return whether the mission may end with a robot in a pose: one whose objective ends is at
        its last target."""
        member = self.problem.members[robot]
        return not member.settles or bool(member.targets[-1] >> pose & 1)

    def completed(self, state: JointState) -> bool:
        """Return whether every robot that is not excused has completed its rounds and stands at its
        last target, if its objective ends; every robot can continue forever from its pose; and all
        served obstacles are resolved."""
        if not all(
            i in self.excused or (self.is_done(i, count) and self.stands(i, pose))
            for i, (count, pose) in enumerate(zip(state.counts, state.poses, strict=True))
        ):
            return False
        if not all(self.problem.resolved(gate, state.stages) for gate in self.served):
            return False
        alive = self.problem.live(state.stages)
        return all(alive[i] >> pose & 1 for i, pose in enumerate(state.poses))

    def awaited(self, robot: int, count: Count) -> Mask:
        """Return the poses of the targets that a robot may meet next. If it has completed its
        rounds: those of its last target if its objective ends, else none."""
        member = self.problem.members[robot]
        if self.is_done(robot, count):
            return member.targets[-1] if member.settles else 0
        if self._is_open(robot, count):
            return reduce(or_, member.targets)
        return member.awaited(count[0] | count[1])

    def _is_open(self, robot: int, count: Count) -> bool:
        """Return whether a robot may meet any of its targets first."""
        return self.any_first and count[2] == 0 and self.problem.members[robot].any_first

    def places(self, states: Iterable[JointState]) -> list[str]:
        """Return the joint poses of some states without duplicates as text: a JSON list of [region,
        heading] for each robot, sorted (docs/trace.md)."""
        graphs = [member.graph for member in self.problem.members]
        found = set()
        for poses in {state.poses for state in states}:
            pairs = zip(graphs, poses, strict=True)
            placed = [graph.pose(number).place for graph, number in pairs]
            found.add(json.dumps(placed, separators=(",", ":")))
        return sorted(found)

    def _settled(
        self, poses: tuple[int, ...], counts: tuple[Count, ...], stages: Stages, who: Iterable[int]
    ) -> JointState:
        """Return the state after every robot has acted where it stands, with the goals counted that
        waiting meets there."""
        acting = self.problem.acting_in(stages)
        if any(mask >> pose & 1 for mask, pose in zip(acting, poses, strict=True)):
            before = self._restarts(stages)
            stages = performed(self.problem, poses, stages, self.sent)
            if self._restarts(stages) != before:
                counts = tuple((index, 0, 0) for index, _, _ in counts)
                who = range(len(poses))
        changed: list[Count] | None = None
        for robot in who:
            count = self._counted(robot, poses[robot], counts[robot])
            if count != counts[robot]:
                changed = changed or list(counts)
                changed[robot] = count
        return JointState(poses, tuple(changed) if changed else counts, stages)

    def _restarts(self, stages: Stages) -> int:
        """Return the number of resolutions after which rounds restart."""
        gates = enumerate(self.problem.gates)
        return sum(self.problem.resolved(k, stages) for k, gate in gates if gate.restarts)

    def _counted(self, robot: int, pose: int, count: Count) -> Count:
        pursuit, here = self._pursuits[robot], self._reached[robot][pose]
        if here and self._is_open(robot, count) and not here >> count[0] & 1:
            count = (next(bits(here)), 0, 0)
        while here and not self.is_done(robot, count):
            memory, counted = pursuit.step(count[0] | count[1], here)
            met = count[2] + counted
            after = (memory, 0, met) if pursuit.in_turn else (0, memory, met)
            if after == count:
                break
            count = after
        return count


def performed(
    problem: Problem, poses: tuple[int, ...], stages: Stages, sent: Mapping[int, int]
) -> Stages:
    """Return the stages after every robot has acted where it stands; ``sent``: robots that keep
    room for a load."""
    changing = True
    while changing:
        changing = False
        for gate in _last_the_loads(problem, stages):
            stage, need = stages[gate], problem.next_need(gate, stages)
            here = [
                i
                for i in problem.acting(gate, stages)
                if need.regions >> (poses[i] % problem.members[i].graph.size) & 1
            ]
            takes = problem.takes(gate, stages)
            if takes and sent:
                here = [i for i in here if not _keeps_room(problem, i, gate, stages, sent)]
            if not here:
                continue
            if takes and not need.together:  # in the order of their turns
                here = here[: problem.missing(gate, stages)]
            stages = problem.acted(gate, stages, here)
            if stages[gate] == stage:
                continue
            changing = True
            if takes:
                break  # another load may have to wait for this one
    return stages


def _keeps_room(
    problem: Problem, robot: int, gate: int, stages: Stages, sent: Mapping[int, int]
) -> bool:
    """Return whether a robot leaves a load, since its only room is for its assigned one."""
    load = sent.get(robot, gate)
    if load == gate or problem.resolved(load, stages) or not problem.takes(load, stages):
        return False
    need = problem.next_need(load, stages)
    return need.together or need.robots == 1


def _last_the_loads(problem: Problem, stages: Stages) -> list[int]:
    """Return the open obstacles: first those that are not loads to be taken next, then these loads
    in the order in which a robot takes them."""
    loads = [gate for gate in problem.open(stages) if problem.takes(gate, stages)]
    loads.sort(key=lambda gate: problem.gates[gate].order)
    return [gate for gate in problem.open(stages) if gate not in loads] + loads


class Found(Struct, frozen=True):
    """A plan: the joint states from the first to the last."""

    states: tuple[JointState, ...]


class Exhausted(Struct, frozen=True):
    """All reachable joint states, if none completes a plan."""

    states: frozenset[JointState]


class BudgetExhausted(Struct, frozen=True):
    """The budget is exhausted: no verdict."""


Answer = Found | Exhausted | BudgetExhausted


class Effort(Struct):
    """Remaining effort of searches, in steps of one robot in a joint state: unlike a number of
    states, it takes about the same time in large and small teams."""

    left: int

    @property
    def done(self) -> bool:
        return self.left <= 0
