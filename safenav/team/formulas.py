"""Formulas (``ltl`` and ``always``) in a robot's graph: the steps that they allow, and the states
that meet goals.

Allowed steps depend on the memory of the formulas. In a joint plan, a robot's states are poses with
a memory. A lone robot follows its strategy, so poses suffice as its states.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from itertools import combinations, product

from safenav.data import cached_method
from safenav.errors import UsageError
from safenav.scenario.model import Robot
from safenav.scenario.objective import Ltl, Objective, formulas_in
from safenav.spec.guarantees import guarantees_of
from safenav.team.state import RobotNow
from safenav.world.map import RegionMap
from safenav.world.poses import Mask, Mobility, Pose, PoseGraph, bits, plain_graph, region_mask

MOST_STATES = 4000
"""Maximum number of states of a robot in joint plans."""


def graph_of(
    robot: Robot, world: RegionMap, *, shared: bool, on: frozenset[str] | None = None
) -> PoseGraph:
    """Return the graph of a robot's states and the steps that its rules allow. ``on``: the inputs
    that are on (None: unknown). Raises UsageError if there are too many states."""
    found, mobility = formulas_in(robot.objective), robot.model.mobility
    if found is None:
        return plain_graph(world, mobility)
    guarantees = guarantees_of(found, on)
    goals, memories = guarantees.goals_of_steps, len(guarantees.memories)
    if not shared or not (guarantees.remember_something or goals):
        return _posed(found, world, mobility, on)
    poses = len(world.free) * plain_graph(world, mobility).blocks
    if not 0 < poses * memories << len(goals) <= MOST_STATES:
        raise UsageError(
            f"robots.{robot.name}.objective: its formulas have more than {MOST_STATES} states "
            f"({poses} poses, each with the values of its memory), too many for a "
            "joint plan\n    use fewer or smaller memory variables, or 'avoids: []' without rivals"
        )
    return _remembering(found, world, mobility, on)


def targets_of(
    objective: Objective, graph: PoseGraph, *, on: frozenset[str] | None = None
) -> tuple[Mask, ...]:
    """Return, for each goal of an objective, the states that meet it. ``on``: as in
    ``graph_of``."""
    if objective.formulas is None:
        return graph.on_each(objective.targets)
    if graph.remembers:
        return graph.goals
    found = guarantees_of(objective.formulas, on)

    def poses_of(goal: int) -> Mask:
        return graph.where_met(lambda p, q: found.meets(goal, graph.pose(p), graph.pose(q)))

    return tuple(map(poses_of, range(found.goals))) or (graph.everywhere,)


@lru_cache(maxsize=256)
def _posed(
    formulas: Ltl, world: RegionMap, mobility: Mobility, on: frozenset[str] | None
) -> PoseGraph:
    """Return the graph of poses with the steps that formulas allow for at least one memory."""
    graph, allows = plain_graph(world, mobility), guarantees_of(formulas, on).allows
    steps = ((pose, step) for pose in bits(graph.everywhere) for step in graph.steps(pose))
    closed = (each for each in steps if not allows(graph.pose(each[0]), graph.pose(each[1])))
    return PoseGraph(world, mobility, frozenset(closed))


def reached(objective: Objective, graph: PoseGraph, robot: RobotNow) -> int:
    """Return a mask of the targets on which a robot stands or, with formulas, of the goals that its
    last turn met."""
    if objective.formulas is None:
        return objective.reached(robot.pose % graph.size)
    if robot.came is None:
        return 0
    found, after = guarantees_of(objective.formulas), graph.pose(robot.pose)
    step = graph.pose(robot.came[0]), dict(robot.came[1]), after, dict(robot.values)
    goals = (goal for goal in range(found.goals) if found.meets_with(goal, *step))
    return sum(1 << goal for goal in goals) if found.goals else 1


class StateGraph(PoseGraph):
    """A graph whose states consist of a pose, a memory and the goals that the last step met. The
    index of a state is its pose plus its memory times the number of poses. A step that changes only
    the memory leaves the robot where it stands."""

    def __init__(
        self,
        formulas: Ltl,
        world: RegionMap,
        mobility: Mobility,
        on: frozenset[str] | None,
        shut: frozenset[int] = frozenset(),
    ) -> None:
        super().__init__(world, mobility)
        self.remembers, self._goes_straight = True, False  # a step may change the memory
        self._formulas, self._on, self._shut = formulas, on, shut
        self._guarantees = guarantees_of(formulas, on)
        goals = self._guarantees.goals_of_steps
        met = [frozenset(few) for n in range(len(goals) + 1) for few in combinations(goals, n)]
        memories: Sequence[Mapping[str, int]] = self._guarantees.memories
        self._memories = [*product(memories, met)]
        self._span = self.size * self.blocks
        self.blocks *= len(self._memories)

    @property
    def one_way(self) -> bool:
        return self._guarantees.remember_something or plain_graph(self.world, self.mobility).one_way

    def memory(self, number: int) -> Mapping[str, int]:
        return self._memories[number // self._span][0]

    def number(self, pose: Pose) -> int:
        """Return the state in which a robot begins in a pose."""
        here = super().number(pose)
        begins, every = self._guarantees.begins, enumerate(self._memories)
        begun = (k for k, (memory, met) in every if not met and begins(memory, pose))
        return here + next(begun, 0) * self._span

    def moved(self, number: int, pose: Pose) -> int:
        same = self._memories.index((self.memory(number), frozenset()))
        return super().number(pose) + same * self._span

    def strayed(self, number: int, pose: Pose) -> int:
        memory = self._guarantees.memory_after(self.pose(number), self.memory(number), pose)
        return super().number(pose) + self._memories.index((memory, frozenset())) * self._span

    def pose(self, number: int) -> Pose:
        return super().pose(number % self._span)

    def left_only(self, pose: int, behind: int | None = None) -> PoseGraph:  # noqa: ARG002
        """Return this graph without steps into a pose, for any memory. All steps from the pose
        remain, even for a robot that has to back out to ``behind``."""
        shut = self._shut | {pose % self._span}
        return StateGraph(self._formulas, self.world, self.mobility, self._on, shut)

    @cached_method
    def steps(self, pose: int) -> tuple[int, ...]:
        plain, (k, here) = plain_graph(self.world, self.mobility), divmod(pose, self._span)
        before, (old, _) = plain.pose(here), self._memories[k]
        return tuple(
            to + later * self._span
            for to in (*plain.steps(here), here)
            if to not in self._shut
            for later, (new, met) in enumerate(self._memories)
            if (to != here or new != old)
            and self._guarantees.allows_with(before, old, plain.pose(to), new)
            and met == self._met_on(pose, to + later * self._span)
        )

    def forward(self, poses: Mask) -> Mask:
        found = 0
        for by, states in self._moves.items():
            found |= _moved(poses & states, by)
        return found

    def backward(self, poses: Mask) -> Mask:
        found = 0
        for by, states in self._moves.items():
            found |= _moved(poses, -by) & states
        return found

    @cached_property
    def goals(self) -> tuple[Mask, ...]:
        """For each goal, the states that meet it: by a stay, or by the step into the state if a
        stay at neither of its ends meets the goal."""
        by_steps = (
            sum(1 << s for s in bits(self.everywhere) if goal in self._memories[s // self._span][1])
            for goal in range(self._guarantees.goals)
        )
        found = tuple(one | other for one, other in zip(by_steps, self.stays, strict=True))
        return found or (self.everywhere,)

    @cached_property
    def stays(self) -> tuple[Mask, ...]:
        """For each goal, the states in which a stay meets it."""
        states = [(s, (self.pose(s), self.memory(s))) for s in bits(self.everywhere)]
        meets = self._guarantees.meets_with
        return tuple(
            sum(1 << s for s, here in states if meets(goal, *here, *here))
            for goal in range(self._guarantees.goals)
        )

    def _met_on(self, pose: int, step: int) -> frozenset[int]:
        """Return the goals that a step meets, but a stay at neither of its ends."""
        ends = self.pose(pose), self.memory(pose), self.pose(step), self.memory(step)
        goals, stays = self._guarantees.goals_of_steps, self.stays
        met = (g for g in goals if self._guarantees.meets_with(g, *ends))
        return frozenset(g for g in met if not (stays[g] >> pose | stays[g] >> step) & 1)

    @cached_property
    def _moves(self) -> dict[int, Mask]:
        """For each difference between the numbers of two states, the states with such a step."""
        found = defaultdict[int, list[int]](list)
        for state in bits(self.everywhere):
            for step in self.steps(state):
                found[step - state].append(state)
        return {by: region_mask(states) for by, states in found.items()}


def _moved(states: Mask, by: int) -> Mask:
    return states << by if by >= 0 else states >> -by


_remembering = lru_cache(maxsize=64)(StateGraph)
