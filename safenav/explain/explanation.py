"""The data of an explanation, and the diagnosis by graph search: the cause and a one-sentence
reason, which check, synth and run print immediately.

The diagnosis removes one restriction at a time (walls, obstacles, the heading, the strictness of
the objective). The cause is the first one without which the robot alone could meet its objective.
This one-player game is explicit and small (poses times the objective's memory), so it takes
milliseconds and no synthesis. Its objective is an automaton (``scenario.objective``); raw formulas
(``ltl``) are not covered."""

import math
import time
from collections.abc import Iterable, Iterator, Mapping
from enum import StrEnum
from functools import cache

from msgspec import Struct
from msgspec.structs import replace

from safenav.components import cyclic_parts, reached
from safenav.scenario.model import Robot, Scenario
from safenav.scenario.objective import Ltl, Objective, Target, alternation, describe, formulas_in
from safenav.spec.guarantees import guarantees_of
from safenav.spec.specification import Constraint, Origin, Section, Specification
from safenav.spec.task import Known, Memory, Task, asked_of
from safenav.synthesis.strategy import Strategy
from safenav.trace.words import some
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.poses import Mobility, Pose, moves
from safenav.world.reachability import Reachability

Values = Mapping[str, int]
"""The values of all variables at one moment."""


class NoStrategyCause(StrEnum):
    """The cause of unrealizability. Only the last three depend on the other robots."""

    NO_WAY = "no_way"
    """Walls are between the robot and a target."""
    OBSTACLE = "obstacle"
    """A known obstacle is on the only path."""
    HEADING = "heading"
    """It faces in the wrong direction at its start and cannot turn on the spot."""
    ONE_WAY = "one_way"
    """Its mobility allows no path to a target, or none from there to the next target."""
    CROSSING = "crossing"
    """``form: literal`` forbids crossing a target out of turn, and every path crosses one."""
    IMPOSSIBLE_START = "impossible_start"
    """The objective excludes the robot's initial pose."""
    CONTRADICTION = "contradiction"
    """The objective contradicts itself, its start or an assumption, on any map."""
    FORBIDDEN_WAY = "forbidden_way"
    """The objective forbids the moves that the map requires."""
    CORNERED = "cornered"
    """Other robots or inputs can force it into a state where every move breaks a guarantee."""
    KEPT_AWAY = "kept_away"
    """Other robots or inputs can keep it from a target forever."""
    CONFLICT = "conflict"
    """Its guarantees conflict; nothing more was found within the limits."""


class Diagnosis(Struct, frozen=True):
    """The result of the graph search.

    ``cause``: None if neither the map nor the robot's mobility is one. ``lost``: targets without a
    path. ``confined``: the regions that the robot can reach. ``culprits``: obstacles or robots in
    its way, for OBSTACLE. ``crossing``: the target in its way, for CROSSING."""

    cause: NoStrategyCause | None
    lost: tuple[Target, ...] = ()
    confined: frozenset[Region] = frozenset()
    culprits: tuple[Known, ...] = ()
    crossing: Target | None = None


class CoreMember(Struct, frozen=True):
    """Guarantees with the same origin, kept or omitted together."""

    origin: Origin
    constraints: tuple[Constraint, ...]
    regions: tuple[Region, ...] = ()


class Core(Struct, frozen=True):
    """A minimal set of guarantees that no strategy can keep together.

    With all assumptions and these guarantees there is no strategy. Without any one member there is
    one (known only if ``minimal``: otherwise some query ran out of time). ``together``: whether
    they can be kept if the environment cooperates (None: unknown); ``all_together``: whether all
    guarantees of the specification can be. ``fairness``: fairness assumptions that did not help.
    ``decisive``: whether the omission of any one member makes the whole specification realizable;
    ``vain``: members whose omission does not, due to another conflict."""

    members: tuple[CoreMember, ...]
    together: bool | None
    fairness: tuple[Origin, ...] = ()
    minimal: bool = True
    all_together: bool = False
    decisive: bool = False
    vain: tuple[CoreMember, ...] = ()

    @property
    def alone(self) -> bool:
        """Whether the members conflict even if the environment cooperates."""
        return self.together is False

    @property
    def constraints(self) -> list[Constraint]:
        """All guarantees of the core."""
        return [constraint for member in self.members for constraint in member.constraints]

    @property
    def walls(self) -> tuple[Region, ...]:
        """The walls of the core."""
        found = [m.regions for m in self.members if m.origin.item == "map"]
        return tuple(sorted(region for regions in found for region in regions))


def with_guarantees(whole: Specification, guarantees: Iterable[Constraint]) -> Specification:
    """Return the specification with all its assumptions and only these guarantees."""
    return whole.without(filter(is_guarantee, whole.constraints)).with_more(*guarantees)


def is_guarantee(constraint: Constraint) -> bool:
    return constraint.section in (Section.SYS_INIT, Section.SYS_TRANS, Section.SYS_LIVENESS)


class PlayEnd(StrEnum):
    """The ways in which a losing play can end."""

    CONFINED = "confined"
    """It visits all regions that it can reach, without the target."""
    STUCK = "stuck"
    """It has no allowed move left."""
    STARVED = "starved"
    """It cycles forever without meeting its goals."""
    NO_BEGINNING = "no_beginning"
    """It cannot even begin."""


class Dilemma(Struct, frozen=True):
    """A move of the robot and a guarantee that the move would break."""

    region: Region
    heading: Heading | None
    broken: Constraint


class LosingPlay(Struct, frozen=True):
    """A play that the system loses to the environment's ``strategy``.

    It begins with ``walk``. Then ``cycle`` repeats forever and never meets ``goal`` (STARVED), or
    the next inputs ``pressure`` allow no output (STUCK; ``dilemmas``: the moves of a robot).
    NO_BEGINNING: the initial inputs ``pressure`` allow no output. CONFINED: no play, only a
    diagnosis."""

    ending: PlayEnd
    strategy: Strategy | None = None
    walk: tuple[Values, ...] = ()
    cycle: tuple[Values, ...] = ()
    goal: Constraint | None = None
    pressure: tuple[tuple[str, int], ...] = ()
    dilemmas: tuple[Dilemma, ...] = ()


class RepairKind(StrEnum):
    OPEN_WALL = "open_wall"
    """An obstacle that a robot can resolve instead of a wall."""
    REMOVE_WALLS = "remove_walls"
    HEADING = "heading"
    START = "start"
    MOBILITY = "mobility"
    OBJECTIVE = "objective"
    INPUT = "input"
    """An assumption on an input."""
    CAPABILITY = "capability"
    ROBOT = "robot"
    """An additional robot. This and the next kinds repair a run that needs an operator."""
    WALL = "wall"
    TARGET = "target"


class Repair(Struct, frozen=True):
    """A change that gives the robot a strategy, as a synthesis has shown.

    ``change``: the changed items of the scenario and their new values, in the form of a file.
    ``scenario``: the changed scenario. ``helpers``: robots that can reach an obstacle and have the
    required capability; ``action``: this capability."""

    kind: RepairKind
    change: tuple[tuple[str, str], ...]
    scenario: Scenario
    helpers: tuple[str, ...] = ()
    action: str | None = None


class RepairProblem(Struct, frozen=True):
    """The robot that needs repairs, and the reasons why it has no strategy."""

    scenario: Scenario
    task: Task
    cause: NoStrategyCause
    diagnosis: Diagnosis
    deadline: float = math.inf

    @property
    def late(self) -> bool:
        """Whether the deadline has passed, by the monotonic clock."""
        return time.monotonic() > self.deadline

    @property
    def robot(self) -> Robot:
        return self.scenario.robot(self.task.robot.name)


class Explanation(Struct, frozen=True):
    """The explanation of one robot's unrealizable specification."""

    robot: str
    task: Task
    cause: NoStrategyCause
    diagnosis: Diagnosis
    core: Core
    play: LosingPlay | None
    repairs: tuple[Repair, ...]
    seconds: float


# Diagnosis.


class State(Struct, frozen=True):
    """A robot's pose and the memory of its objective."""

    pose: Pose
    memory: int = 0


class Solo(Struct, frozen=True):
    """The possible moves of a robot without other robots. ``regions``: those that it can reach by
    its rules; ``winnable``: whether it can meet all goals infinitely often or, if its objective
    ends at the last goal, stay there."""

    regions: frozenset[Region]
    winnable: bool


def play(
    mobility: Mobility,
    pose: Pose,
    objective: Objective,
    memory: Memory,
    world: RegionMap,
    blocked: frozenset[Region] = frozenset(),
) -> Solo:
    """Return all possible moves of a robot alone. ``objective`` must not be ``Ltl``."""
    assert not isinstance(objective, Ltl)
    pursuit = objective
    first = State(pose, pursuit.begin(pose.region, memory.index) if pursuit.in_turn else 0)
    after = cache(lambda state: tuple(_steps(mobility, state, pursuit, world, blocked)))
    ways = {state: after(state) for state in reached([first], after)}
    met: dict[int, set[int]] = {}
    for state, part in cyclic_parts(ways).items():
        met.setdefault(part, set()).update(pursuit.met(state.memory, state.pose.region))
    last = len(pursuit.targets) - 1
    again = {last} if pursuit.settles else {*range(last + 1)}
    return Solo(
        frozenset(state.pose.region for state in ways),
        any(again <= goals for goals in met.values()),
    )


def _steps(
    mobility: Mobility,
    state: State,
    pursuit: Objective,
    world: RegionMap,
    blocked: frozenset[Region],
) -> Iterator[State]:
    """Yield the possible next states of a robot, which may stay even in a blocked region."""
    here, memory = state.pose.region, state.memory
    after = pursuit.turned(memory, here) if pursuit.in_turn else memory
    rules = formulas_in(pursuit)
    for pose in moves(mobility, state.pose, world, blocked):
        if rules and pose != state.pose and not guarantees_of(rules).allows(state.pose, pose):
            continue
        if not pursuit.forbidden(memory, here, pose.region):
            yield State(pose, after)


def diagnose(task: Task, world: RegionMap) -> Diagnosis:
    """Return the diagnosis, with the cause as far as map, mobility and objective determine it."""
    mobility, blocked = task.robot.model.mobility, {known.region for known in task.blocked}
    walkable = Reachability(mobility, task.pose, world, blocked)
    if isinstance(task.objective, Ltl):
        return Diagnosis(None, confined=walkable.regions)
    solo = _solo(task, world)
    if solo.winnable:
        return Diagnosis(None, confined=solo.regions)
    lost = tuple(t for t in task.targets if not walkable.reaches(t))
    found = Diagnosis(NoStrategyCause.NO_WAY, lost, walkable.regions)
    if not _connected(task, world):
        return found
    culprits = _culprits(task, world)
    if culprits:
        return replace(found, cause=NoStrategyCause.OBSTACLE, culprits=culprits)
    if task.robot.model.mobility is Mobility.HEADING and _facing_elsewhere(task, world):
        return replace(found, cause=NoStrategyCause.HEADING)
    free = replace(task, objective=task.objective.changed(always=()))
    if task.objective.always and _solo(free, world).winnable:
        return replace(found, cause=NoStrategyCause.FORBIDDEN_WAY)
    plain = replace(task, objective=alternation(task.targets, task.objective))
    if task.objective.strict and _solo(plain, world).winnable:
        return replace(
            found,
            cause=NoStrategyCause.CROSSING,
            confined=solo.regions,
            crossing=_crossing(task, world),
        )
    return replace(found, cause=NoStrategyCause.ONE_WAY)


def _solo(task: Task, world: RegionMap) -> Solo:
    blocked = frozenset(known.region for known in task.blocked)
    mobility = task.robot.model.mobility
    return play(mobility, task.pose, task.objective, task.memory, world, blocked)


def _connected(task: Task, world: RegionMap) -> bool:
    """Return whether a robot that can turn on the spot has a path past the walls to each target."""
    reach = Reachability(Mobility.FREE, Pose(task.pose.region), world)
    return all(map(reach.reaches, task.objective.targets))


def _culprits(task: Task, world: RegionMap) -> tuple[Known, ...]:
    """Return the known obstacles and robots in the way: those whose removal suffices, or all of
    them if only the removal of all suffices."""
    if not task.blocked or not _solo(replace(task, blocked=()), world).winnable:
        return ()
    single = tuple(
        known
        for known in task.blocked
        if _solo(
            replace(task, blocked=tuple(k for k in task.blocked if k is not known)), world
        ).winnable
    )
    return single or task.blocked


def _facing_elsewhere(task: Task, world: RegionMap) -> bool:
    """Return whether another initial heading would let the robot meet its objective."""
    return any(
        _solo(replace(task, pose=Pose(task.pose.region, heading)), world).winnable
        for heading in Heading
        if heading is not task.pose.heading
    )


def _crossing(task: Task, world: RegionMap) -> Target | None:
    """Return the first target that blocks the path to another one, or None."""
    blocked = {known.region for known in task.blocked}
    targets = task.objective.targets
    for target in targets:
        reach = Reachability(task.robot.model.mobility, task.pose, world, blocked | target)
        if not all(reach.reaches(other) for other in targets if other != target):
            return target
    return None


def explain_unrealizable(robot: Robot, task: Task, world: RegionMap) -> str:
    """Return the reason, in a sentence, why the map keeps ``robot`` from its ``task``."""
    why = why_words(diagnose(task, world), task, world)
    return f"{robot.name} cannot {describe(asked_of(task), world.word)}: {why}"


def _closed_words(found: Diagnosis, world: RegionMap) -> str:
    """Return, in words, the regions that the culprits close, grouped by reason."""
    by_reason: dict[str, list[str]] = {}
    for known in found.culprits:
        by_reason.setdefault(known.reason, []).append(world.label(known.region))
    said = []
    for reason, regions in by_reason.items():
        if len(regions) > 1 and reason.endswith(" it"):
            reason = f"{reason.removesuffix('it')}them"
        said.append(f"{some(regions)} {'is' if len(regions) == 1 else 'are'} closed ({reason})")
    return ", ".join(said)


def why_words(found: Diagnosis, task: Task, world: RegionMap) -> str:
    """Return the cause as a clause that mentions neither the robot nor its objective."""
    here = world.label(task.pose.region)
    lost = " and ".join(world.labels(target) for target in found.lost)
    things = _closed_words(found, world)
    match found.cause:
        case NoStrategyCause.NO_WAY:
            return f"there is no path from {here} to {lost}: walls are between them"
        case NoStrategyCause.OBSTACLE:
            way = f"from {here} to {lost}" if lost else "to its targets"
            return f"there is no path {way}: {things}"
        case NoStrategyCause.HEADING:
            facing = "" if task.pose.heading is None else f" facing {task.pose.heading.label}"
            return f"from {here}{facing} it cannot reach its targets: it cannot turn on the spot"
        case NoStrategyCause.CROSSING:
            what = world.labels(found.crossing) if found.crossing else "a target"
            return (
                f"'form: literal' forbids crossing {what} out of turn, and there is no other path; "
                "without it, crossing is allowed"
            )
        case NoStrategyCause.FORBIDDEN_WAY:
            return "its 'always' rules leave no path"
        case NoStrategyCause.ONE_WAY:
            if found.lost:
                return f"its mobility allows no path from {here} to {lost}"
            return "its mobility allows it to enter a region on the path, but not to leave it"
    if isinstance(task.objective, Ltl):
        inputs = " or ".join(task.objective.inputs)
        could = f", or the input {inputs} can keep it from its goals" if inputs else ""
        return f"its guarantees conflict{could}"
    others = ", ".join(task.avoids)
    if others:
        return f"{others} could keep it away forever, or corner it"
    return "its guarantees conflict"
