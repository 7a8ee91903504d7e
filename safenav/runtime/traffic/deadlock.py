"""Proofs of deadlock: no order of moves lets every robot complete, even with all obstacles
resolved.

The search for a plan can exhaust the joint states of a small team, but not those of a large one.
However, two or three robots that cannot complete even without the other robots and open obstacles
can never complete, since both only restrict their moves.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Iterator, Sequence
from itertools import chain, combinations, islice

from msgspec.structs import replace

from safenav.outcome import Outcome
from safenav.runtime.resolution.problem import Floor, Problem
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.termination import Conclusion, RunEnded
from safenav.runtime.traffic.budgets import FEW_GROUPS, FEW_SIZES, FEW_STATES
from safenav.runtime.traffic.joint_search.formula_memory import StateGraph
from safenav.runtime.traffic.joint_search.immobile import ImmobileRobots
from safenav.runtime.traffic.joint_search.search import Search
from safenav.runtime.traffic.joint_search.states import Count, Course, Effort, Exhausted
from safenav.scenario.room import room_words, without_room
from safenav.trace import proofs
from safenav.trace.words import listed
from safenav.world.poses import bits


def deadlock_of_few(
    floor: Floor,
    among: Collection[int],
    rounds: int,
    counts: Sequence[Count],
    stopping: Callable[[], None],
    work: Effort | None = None,
) -> tuple[Floor, Course, Exhausted] | None:
    """Return a few robots that cannot complete even alone, as a separate floor, with their
    reachable states: immobile robots, or any two or three; None if none are found. ``among``: the
    robots to examine, none of them out of service, since these may return."""
    whole = Course(floor.problem, rounds)
    now = whole.begun(floor.poses, tuple(counts), floor.stages)
    stuck = ImmobileRobots(whole).cannot_complete(now)
    groups = [tuple(sorted(stuck))] if stuck and stuck <= {*among} else []
    sizes = [size for size in FEW_SIZES if size <= len(floor.names)]
    by_size = (islice(_groups(floor, among, size), FEW_GROUPS) for size in sizes)
    for group in chain(groups, *by_size):
        stopping()
        few = _only(floor, group)
        course = Course(few.problem, rounds, any_first=True)
        start = course.begun(few.poses, tuple(counts[i] for i in group), ())
        goals = [None] * len(group)
        search = Search(
            course, lambda *_, g=goals: g, start, course.completed, stopping=stopping, work=work
        )
        answer = search.singles(FEW_STATES) if group in groups else search.run(1, FEW_STATES)
        if isinstance(answer, Exhausted):
            return few, course, answer
    return None


def _groups(floor: Floor, among: Collection[int], size: int) -> Iterator[tuple[int, ...]]:
    """Yield groups of robots that each conflict with another of the group, near ones first."""
    problem = floor.problem
    cols = problem.members[0].graph.world.cols
    places = [
        divmod(pose % member.graph.size, cols)
        for member, pose in zip(problem.members, floor.poses, strict=True)
    ]

    def spread(group: tuple[int, ...]) -> int:
        rows, columns = zip(*(places[i] for i in group), strict=True)
        return int(max(rows) - min(rows) + max(columns) - min(columns))

    found = [
        group
        for group in combinations(among, size)
        if all(problem.conflicts[i] & {*group} for i in group)
    ]
    yield from sorted(found, key=spread)


def _only(floor: Floor, group: tuple[int, ...]) -> Floor:
    """Return the floor with these robots alone, and without open obstacles."""
    problem = floor.problem
    conflicts = tuple(
        frozenset(k for k, other in enumerate(group) if other in problem.conflicts[i])
        for i in group
    )
    return replace(
        floor,
        problem=Problem(tuple(problem.members[i] for i in group), (), conflicts),
        stages=(),
        poses=tuple(floor.poses[i] for i in group),
        names=tuple(floor.names[i] for i in group),
        gates=(),
    )


def meets_the_rest_alone(floor: Floor, robot: RobotState, *, returns: bool) -> bool:
    """Return whether a robot can meet all remaining targets of a terminating objective if all other
    robots and open obstacles are absent. ``returns``: it must also be able to leave the last target
    and return, as assignable goals require."""
    index = floor.index(robot.name)
    member, here = floor.problem.members[index], 1 << floor.poses[index]
    graph = member.graph
    if not (member.in_turn and member.settles):
        return False
    for target in member.targets[robot.own.memory.index :]:
        here = graph.closure(here, member.floor) & target
    rounds = ((p % graph.size, graph.around(1 << p, member.floor)) for p in bits(here))
    return any(not returns or round_ & ~graph.poses_on(1 << at) for at, round_ in rounds)


def crowded(state: TeamState) -> RunEnded | None:
    """Return the end of a run in which robots must stay in fewer regions than they are; None if
    there are no such robots."""
    own = [robot.robot for robot in state.robots.values() if robot.base is None]
    group = next(without_room(own), None)
    if group is None:
        return None
    names = tuple(robot.name for robot in group)
    words = f"deadlock: {room_words(group, state.scenario.map)}"
    proof = proofs.NoRoom(names)
    return RunEnded(Conclusion(Outcome.OPERATOR_NEEDED, words, "deadlock", proof, stuck=names))


def deadlocked(state: TeamState, floor: Floor, course: Course, answer: Exhausted) -> RunEnded:
    """Return the end of a run in which no order of moves of the robots of ``floor`` completes the
    mission."""
    label = state.scenario.map.label
    robots = [state.robots[name] for name in floor.names]
    robots = [robot for robot in robots if state.rivals(robot.robot)] or robots
    poses = (
        f"{robot.name} {'at' if robot.transit is None else 'on its way to'} "
        f"{label(robot.next_pose.region)}"
        for robot in robots
    )
    where = ", ".join(poses)
    alone = ""
    if len(floor.names) < len(state.robots):
        alone = ", even with all other robots and open obstacles out of the way"
    stay = [robot.name for robot in robots if robot.own.objective.settles]
    ends = f" with {listed(stay)} at the last target{'s' if len(stay) > 1 else ''}" if stay else ""
    words = (
        f"{where}: deadlock; none of the {len(answer.states)} reachable joint states "
        f"completes every objective{ends}{alone}"
    )
    members = zip(floor.names, floor.problem.members, strict=True)
    remember = [state.robots[name] for name, m in members if isinstance(m.graph, StateGraph)]
    memory = {r.name: {**r.next_memory.values} for r in remember if r.next_memory.values}
    places = course.places(answer.states)
    text = "".join(f"{line}\n" for line in places)
    proof = proofs.JointSearch(
        floor.names,
        {name: state.robots[name].next_pose.place for name in floor.names},
        {
            **{g: stage.need for g, stage in zip(floor.gates, floor.stages, strict=True)},
            **state.knowledge.given_up(),
        },
        proofs.JointGoal(course.rounds),
        len(places),
        hashlib.sha256(text.encode()).hexdigest(),
        memory or None,
    )
    return RunEnded(
        Conclusion(Outcome.OPERATOR_NEEDED, words, "deadlock", proof, stuck=floor.names)
    )
