"""The input of a synthesis: all data of a robot's specification except the map, and the forms of
its objective, from the strongest to the weakest.

A strict objective, such as a patrol, keeps its literal formula (paper, Section VI) if the robot can
satisfy it with its present memory or with another target first. Otherwise it becomes plain
alternation: the robot may cross a target out of turn and wait at a target. Robots that share a
floor or have assignable goals use plain alternation from the start. All other objectives, and a
strict one with ``form: literal``, have one form. ``run``, ``check``, ``synth``, ``explain``, the
studio and certificates try these forms in this order.
"""

from collections.abc import Iterator, Mapping, Sequence
from enum import StrEnum
from functools import reduce
from operator import or_

from msgspec import Struct, field

from safenav.scenario.model import Input, Robot
from safenav.scenario.objective import Ltl, Objective, Target, Word, number_word
from safenav.world.map import Cells, Region, RegionMap
from safenav.world.poses import Mask, Mobility, Pose, PoseGraph, bits, plain_graph, region_mask


class Memory(Struct, frozen=True):
    """A robot's progress in its objective when it is resynthesized.

    ``index``: the next target; without an order, one more than the last counted target (0: none has
    counted). ``values``: the memory variables of an ``ltl`` objective, empty at the start of a run.
    """

    index: int = 0
    values: Mapping[str, int] = field(default_factory=dict)


NO_MEMORY = Memory()


class Known(Struct, frozen=True):
    """A region that the robot must not enter now and the scenario item that closes it."""

    region: Region
    item: str
    reason: str


class Observed(Struct, frozen=True):
    """A tracked robot: its region or, out of sight, the cells that may contain it (``belief``, see
    ``spec.belief``)."""

    name: str
    region: Region
    belief: frozenset[int] | None = None

    @property
    def variable(self) -> str:
        return f"at_{self.name}"


class Task(Struct, frozen=True):
    """The complete input of one robot's specification, except the map.

    ``blocked``: known obstacles (O beyond the walls) that block this robot. ``observed``: the
    robots that it tracks by beliefs; ``partition``: that of the map (None: its rooms); ``closed``:
    regions whose obstacles block the view. ``avoids``: names of robots with which it must not
    collide (``synth --avoiding``; in a run joint plans drive these). ``assignable``: whether goals
    can be assigned at runtime. ``forbidden``: poses from which the team could not continue.
    ``inputs``: the objective's inputs with their present values. ``live``: whether other robots may
    move any distance between two observations.
    """

    robot: Robot
    pose: Pose
    objective: Objective
    memory: Memory = NO_MEMORY
    blocked: tuple[Known, ...] = ()
    observed: tuple[Observed, ...] = ()
    partition: Cells | None = None
    closed: frozenset[Region] = frozenset()
    assignable: bool = False
    forbidden: frozenset[Pose] = frozenset()
    inputs: tuple[tuple[Input, bool], ...] = ()
    live: bool = False
    avoids: tuple[str, ...] = ()

    @property
    def targets(self) -> tuple[Target, ...]:
        return self.objective.targets

    @property
    def item(self) -> str:
        """The name of the robot's item in the scenario, for origins."""
        return f"robots.{self.robot.name}"

    def tour(self, world: RegionMap) -> list[int]:
        """Return the targets of an objective without an order, in the order of a short round: each
        is the nearest to its predecessor, the first to the robot's start. They begin after the last
        counted target."""
        start, avoid = self.robot.start, self.objective.avoid
        graph, found = plain_graph(world, self.robot.model.mobility), list[int]()
        left, at = dict(enumerate(graph.on_each(self.targets))), graph.number(start)
        while left:
            there = graph.nearest(at, reduce(or_, left.values()), graph.outside(avoid))
            found.append(next(k for k in left if left[k] & there))
            at = next(bits(there & left.pop(found[-1])))
        first = found.index(self.memory.index - 1) + 1 if self.memory.index else 0
        return found[first:] + found[:first]

    @property
    def remembers(self) -> bool:
        """Whether the specification needs a variable for the next target. A strategy takes its
        goals in their order, but it skips goals that one step meets together, and goals assigned at
        runtime disturb the order."""
        objective, targets = self.objective, self.targets
        if not objective.turn or len(targets) == 1:
            return False
        following = (*targets[1:], targets[0])
        together = any(one & other for one, other in zip(targets, following, strict=True))
        return objective.strict or objective.settles or self.assignable or together

    @property
    def begins(self) -> dict[str, int] | None:
        """The memory variables with their initial values; None if there are none."""
        if self.remembers:
            first = self.objective.begin(self.pose.region, self.memory.index)
            return {self.objective.turn: first}
        return dict(self.memory.values) or None


class Weakening(StrEnum):
    """The reasons for a weaker form of an objective; each value states its reason in words."""

    TURNED = "from its pose it cannot begin with the target whose turn it is"
    CORRIDOR = "the map leaves no other path"
    MOBILITY = "its mobility leaves no other path"
    RULES = "its 'avoid' and 'always' leave no other path"
    OBSTACLES = "the known obstacles leave no other path"
    KEPT = "the team could not continue from a pose on the other path"
    PLANNED = "a joint plan drives it"
    SHARED = "other robots may be in its way"
    ASSIGNED = "it can be assigned another region at any time"


class ObjectiveForm(Struct, frozen=True):
    """One form of an objective. ``turn``: the index of the first target. ``weakening``: the reason
    why stronger forms are impossible; None for the strongest form."""

    objective: Objective
    turn: int
    weakening: Weakening | None = None


def forms(
    objective: Objective,
    turn: int,
    pose: Pose,
    graph: PoseGraph,
    blocked: Mask = 0,
    *,
    planned: bool = False,
    assigned: bool = False,
) -> Iterator[ObjectiveForm]:
    """Yield the forms to try, from the strongest to the weakest, for a robot at ``pose`` whose next
    target has the index ``turn``. ``blocked``: a mask of the regions that it cannot enter. Forms
    that the robot could not keep even if it were alone are omitted, except the last one."""
    plain = objective.relaxed()
    if isinstance(objective, Ltl) or plain == objective:
        yield ObjectiveForm(objective, turn)
        return
    if planned or assigned:
        yield ObjectiveForm(plain, turn, Weakening.PLANNED if planned else Weakening.ASSIGNED)
        return
    count = len(objective.targets)
    turns = [(turn + k) % count for k in range(count)]
    tried = [first for first in turns if can_keep(graph, pose, objective, first, blocked)]
    for first in tried:
        yield ObjectiveForm(objective, first, None if first == turn else Weakening.TURNED)
    why = Weakening.KEPT if tried else _obstruction(graph, pose, objective, blocked)
    yield ObjectiveForm(plain, turn, why)


def concession(asked: Objective, rung: ObjectiveForm, word: Word = number_word) -> str | None:
    """Return, in words, how and why a form is weaker than the objective: ``may cross a target on
    the way: the map leaves no other path``. None for the strongest form."""
    if rung.weakening is None:
        return None
    if rung.weakening is Weakening.TURNED:
        first, *others = (word(target) for target in _from(rung.turn, asked.targets))
        other = others[0] if len(others) == 1 else "the one whose turn it is"
        return f"{first} first: from here it cannot begin with {other} without crossing {first}"
    waits = rung.weakening in (Weakening.PLANNED, Weakening.SHARED, Weakening.ASSIGNED)
    return f"may cross a target on the way{' and wait at one' * waits}: {rung.weakening.value}"


def asked_of(task: Task) -> Objective:
    """Return the objective that the user stated; a task may have a weaker form of it."""
    own = task.robot.objective
    return own if task.objective in (own, own.relaxed()) else task.objective


def _from(turn: int, targets: Sequence[Target]) -> Sequence[Target]:
    return (*targets[turn:], *targets[:turn])


def _obstruction(graph: PoseGraph, pose: Pose, strict: Objective, blocked: Mask) -> Weakening:
    """Return the reason why a robot cannot keep a strict objective."""
    avoided, turns = region_mask(strict.avoid), range(len(strict.targets))
    if blocked & ~avoided and any(can_keep(graph, pose, strict, turn, avoided) for turn in turns):
        return Weakening.OBSTACLES
    plain = plain_graph(graph.world, graph.mobility)
    if (avoided or strict.always) and any(can_keep(plain, pose, strict, t) for t in turns):
        return Weakening.RULES
    free = plain_graph(graph.world, Mobility.FREE)
    there = Pose(pose.region)
    if graph.one_way and any(can_keep(free, there, strict, turn, blocked) for turn in turns):
        return Weakening.MOBILITY
    return Weakening.CORRIDOR


def can_keep(
    graph: PoseGraph, pose: Pose, strict: Objective, memory: int, blocked: Mask = 0
) -> bool:
    """Return whether a robot alone, at ``pose`` with ``memory``, can keep the literal form of a
    strict objective forever. ``blocked``: a mask of the regions that it cannot enter.

    In the literal form (paper, Section VI) a robot leaves a target immediately and touches none out
    of turn. The check is a one-player game on sets of poses.
    """
    begun = strict.begin(pose.region, memory)
    targets = graph.on_each(strict.targets)
    count = len(targets)
    open_poses = graph.everywhere & ~graph.poses_on(blocked)
    # Poses between targets and, for each target, those from which it can continue.
    between, met = open_poses, []
    for turn, target in enumerate(targets):
        between &= ~target
        others = reduce(or_, (*targets[:turn], *targets[turn + 1 :]), 0)
        met.append(target & open_poses & ~others)
    while True:
        before = list(met)
        for turn in range(count):
            met[turn] &= graph.backward(graph.back(met[(turn + 1) % count], between))
        if met == before:
            break
    here = 1 << graph.number(pose)
    after = (begun + 1) % count if here & targets[begun] else begun
    return bool(graph.forward(here) & graph.back(met[after], between))
