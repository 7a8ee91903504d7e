"""Data of an explanation; ``report.terminal.explanation_text`` puts it into words."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping
from enum import StrEnum

from msgspec import Struct

from safenav.scenario.model import Robot, Scenario
from safenav.scenario.objective import Target
from safenav.spec.specification import Constraint, Origin, Section, Specification
from safenav.spec.task import Known, Task
from safenav.synthesis.strategy import Strategy
from safenav.world.map import Heading, Region

Values = Mapping[str, int]
"""The values of all variables at one moment."""


class NoStrategyCause(StrEnum):
    """Cause of unrealizability. All but the last three hold whatever the moving robots do."""

    NO_WAY = "no_way"
    """Walls are between the robot and a target."""
    OBSTACLE = "obstacle"
    """A known obstacle is on the only path."""
    HEADING = "heading"
    """It faces the wrong way at its start, and cannot turn on the spot."""
    ONE_WAY = "one_way"
    """Its mobility allows no path to a target, or none from there to the next one."""
    CROSSING = "crossing"
    """Patrol forbids crossing a target out of its turn, and there is no other path."""
    IMPOSSIBLE_START = "impossible_start"
    """The objective does not allow the robot's start."""
    CONTRADICTION = "contradiction"
    """The objective contradicts itself, on any map."""
    FORBIDDEN_WAY = "forbidden_way"
    """The objective forbids the moves that the map requires."""
    CORNERED = "cornered"
    """Other robots or inputs can bring it where each move, and staying, breaks a guarantee."""
    KEPT_AWAY = "kept_away"
    """Other robots or inputs can keep it from a target forever."""
    CONFLICT = "conflict"
    """Its guarantees conflict; nothing more was found within the limits."""


class Diagnosis(Struct, frozen=True):
    """Result of graph search alone (``explain.diagnosis``).

    ``cause``: None if the map and the robot's mobility are not the reason. ``lost``: targets
    without any path. ``confined``: the regions that it can reach. ``culprits``: obstacles or robots
    in the way, for OBSTACLE. ``crossing``: the target in the way, for CROSSING."""

    cause: NoStrategyCause | None
    lost: tuple[Target, ...] = ()
    confined: frozenset[Region] = frozenset()
    culprits: tuple[Known, ...] = ()
    crossing: Target | None = None


class CoreMember(Struct, frozen=True):
    """Guarantees that belong together: they share an origin and are dropped together."""

    origin: Origin
    constraints: tuple[Constraint, ...]
    regions: tuple[Region, ...] = ()


class Core(Struct, frozen=True):
    """A minimal set of guarantees that no strategy can keep together.

    With all assumptions and these guarantees alone there is no strategy; without any one of the
    members there is one (if ``minimal``: else time ran out on some query). ``together``: whether
    they can be kept with a cooperating environment (None: not known); ``all_together``: so can all
    guarantees of the specification. ``fairness``: the fairness
    that it was allowed to assume, without success. ``decisive``: without any one of the members,
    the whole specification is realizable; ``vain``: members without which it is still
    unrealizable, because of another conflict."""

    members: tuple[CoreMember, ...]
    together: bool | None
    fairness: tuple[Origin, ...] = ()
    minimal: bool = True
    all_together: bool = False
    decisive: bool = False
    vain: tuple[CoreMember, ...] = ()

    @property
    def alone(self) -> bool:
        """Return whether they conflict even with a cooperating environment."""
        return self.together is False

    @property
    def constraints(self) -> list[Constraint]:
        """Return all guarantees of the core."""
        return [constraint for member in self.members for constraint in member.constraints]

    @property
    def walls(self) -> tuple[Region, ...]:
        """Return the walls of the core."""
        found = [m.regions for m in self.members if m.origin.item == "map"]
        return tuple(sorted(region for regions in found for region in regions))


def with_guarantees(whole: Specification, guarantees: Iterable[Constraint]) -> Specification:
    """Return ``whole`` with all its assumptions, but these guarantees only."""
    return whole.without(filter(is_guarantee, whole.constraints)).with_more(*guarantees)


def is_guarantee(constraint: Constraint) -> bool:
    return constraint.section in (Section.SYS_INIT, Section.SYS_TRANS, Section.SYS_LIVENESS)


class PlayEnd(StrEnum):
    """End of a losing play."""

    CONFINED = "confined"
    """It visits all regions that it can reach, and the target is not among them."""
    STUCK = "stuck"
    """It has no allowed move left."""
    STARVED = "starved"
    """It cycles forever without meeting its goals."""
    NO_BEGINNING = "no_beginning"
    """It cannot even begin."""


class Dilemma(Struct, frozen=True):
    """One move that it could still make, and a guarantee that this would break."""

    region: Region
    heading: Heading | None
    broken: Constraint


class LosingPlay(Struct, frozen=True):
    """A play of a system that does its best against the environment's ``strategy``, as values.

    ``walk`` from the start on; then ``cycle`` repeats forever and ``goal`` is never met (STARVED),
    or the next inputs ``pressure`` leave no output (STUCK; ``dilemmas``: the moves of a robot). The
    initial inputs ``pressure`` leave none (NO_BEGINNING). CONFINED has no play, but a diagnosis."""

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
    """One more robot; like those below, for a run that needs an operator."""
    WALL = "wall"
    TARGET = "target"


class Repair(Struct, frozen=True):
    """A change under which the robot has a strategy: each was checked by synthesis.

    ``change``: the scenario's items and their new values, as they would be written. ``scenario``:
    the scenario with the change. ``helpers``: robots that have the capability that an obstacle
    needs and can reach it; ``action``: that capability."""

    kind: RepairKind
    change: tuple[tuple[str, str], ...]
    scenario: Scenario
    helpers: tuple[str, ...] = ()
    action: str | None = None


class RepairProblem(Struct, frozen=True):
    """The robot and the reasons for which a repair is sought."""

    scenario: Scenario
    task: Task
    cause: NoStrategyCause
    diagnosis: Diagnosis
    deadline: float = math.inf

    @property
    def late(self) -> bool:
        """Return whether the deadline has passed (by the monotonic clock)."""
        return time.monotonic() > self.deadline

    @property
    def robot(self) -> Robot:
        return self.scenario.robot(self.task.robot.name)


class Explanation(Struct, frozen=True):
    """Explanation of one robot's unrealizability."""

    robot: str
    task: Task
    cause: NoStrategyCause
    diagnosis: Diagnosis
    core: Core
    play: LosingPlay | None
    repairs: tuple[Repair, ...]
    seconds: float
