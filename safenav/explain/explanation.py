"""What an explanation is made of, as data; ``report.explanation`` puts it into words."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

from safenav.dataclass import dataclass
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Target
from safenav.spec.specification import Constraint, Origin, Section, Specification
from safenav.spec.task import Known, Task
from safenav.world.map import Heading, Region


class NoStrategyCause(StrEnum):
    """Why a robot has no strategy. All but the last two hold whatever the moving robots do."""

    NO_WAY = "no_way"
    """Walls are between the robot and a target."""
    OBSTACLE = "obstacle"
    """A known obstacle is in the only way."""
    PARKED_ROBOT = "parked_robot"
    """A robot that stays where it is stands in the only way."""
    HEADING = "heading"
    """From where it starts it faces the wrong way, and cannot turn on the spot."""
    ONE_WAY = "one_way"
    """Under its mobility it cannot get there, or not from there to the next target."""
    CROSSING = "crossing"
    """Patrol forbids to cross a target out of its turn, and there is no other way."""
    IMPOSSIBLE_START = "impossible_start"
    """The objective does not allow it to begin where it is."""
    CONTRADICTION = "contradiction"
    """The objective contradicts itself, on whatever map."""
    FORBIDDEN_WAY = "forbidden_way"
    """The objective forbids what the map makes it do."""
    CORNERED = "cornered"
    """Other robots can bring it where each move, and staying, breaks a guarantee."""
    KEPT_AWAY = "kept_away"
    """Other robots can keep it from a target for ever."""


@dataclass(frozen=True)
class Diagnosis:
    """What graph search alone can tell (``explain.diagnosis``).

    ``cause``: None if the map and the robot's mobility are not the reason. ``lost``: targets
    without any way. ``confined``: the regions that it can get to. ``culprits``: what stands in
    the way, for OBSTACLE and PARKED_ROBOT. ``crossing``: the target in the way, for CROSSING.
    """

    cause: NoStrategyCause | None
    lost: tuple[Target, ...] = ()
    confined: frozenset[Region] = frozenset()
    culprits: tuple[Known, ...] = ()
    crossing: Target | None = None


@dataclass(frozen=True)
class CoreMember:
    """Guarantees that belong together: they share an origin and are dropped together."""

    origin: Origin
    constraints: tuple[Constraint, ...]
    regions: tuple[Region, ...] = ()


@dataclass(frozen=True)
class Core:
    """A minimal set of guarantees that nobody can keep together.

    With all assumptions and these guarantees alone there is no strategy; without any one of
    the members there is one (if ``minimal``: else time ran out on some query). ``alone``: not
    even if the others did whatever the robot would like. ``fairness``: what it was allowed to
    rely on, to no avail. ``queries``: realizability questions that were asked.
    """

    members: tuple[CoreMember, ...]
    alone: bool
    fairness: tuple[Origin, ...] = ()
    minimal: bool = True
    queries: int = 0

    @property
    def walls(self) -> tuple[Region, ...]:
        """The walls of the core."""
        found = [m.regions for m in self.members if m.origin.item == "map"]
        return tuple(sorted(region for regions in found for region in regions))

    def specification(
        self, whole: Specification, without: Iterable[CoreMember] = ()
    ) -> Specification:
        """``whole`` with no other guarantees than the members, less some of them."""
        dropped = set(without)
        guarantees = [c for m in self.members if m not in dropped for c in m.constraints]
        return with_guarantees(whole, guarantees)


def with_guarantees(whole: Specification, guarantees: Iterable[Constraint]) -> Specification:
    """``whole`` with all its assumptions, but these guarantees only."""
    assumptions = [c for c in whole.constraints if not is_guarantee(c)]
    return Specification(whole.robot, whole.title, whole.variables, (*assumptions, *guarantees))


def is_guarantee(constraint: Constraint) -> bool:
    return constraint.section in (Section.SYS_INIT, Section.SYS_TRANS, Section.SYS_LIVENESS)


class WitnessEnd(StrEnum):
    """How a witness ends."""

    CONFINED = "confined"
    """It goes wherever it can, and the target is not among it."""
    STUCK = "stuck"
    """Nothing is left that it may do."""
    STARVED = "starved"
    """It goes round for ever without meeting its goals."""
    NO_BEGINNING = "no_beginning"
    """It cannot even begin."""


@dataclass(frozen=True)
class PlayMoment:
    """One moment of a story. ``others``: what it observes (inputs), Booleans as 0 and 1;
    ``memory``: its outputs beyond the pose."""

    region: Region | None
    heading: Heading | None = None
    others: tuple[tuple[str, int], ...] = ()
    memory: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True)
class Dilemma:
    """One thing that it could still do, and a guarantee that this would break."""

    region: Region
    heading: Heading | None
    broken: Constraint


@dataclass(frozen=True)
class Witness:
    """How it fails although it does its best.

    ``moments`` from the start on; then ``cycle`` repeats for ever (STARVED). For
    STUCK: ``pressure`` holds the others' last moves, ``dilemmas`` why no answer is left.
    ``goal``: what is never met. ``confined``: the regions within reach (CONFINED).
    """

    ending: WitnessEnd
    moments: tuple[PlayMoment, ...] = ()
    cycle: tuple[PlayMoment, ...] = ()
    pressure: tuple[tuple[str, int], ...] = ()
    dilemmas: tuple[Dilemma, ...] = ()
    goal: Constraint | None = None
    confined: frozenset[Region] = frozenset()


class RepairKind(StrEnum):
    OPEN_WALL = "open_wall"
    """An obstacle that somebody can resolve instead of a wall."""
    REMOVE_WALLS = "remove_walls"
    HEADING = "heading"
    START = "start"
    MOBILITY = "mobility"
    OBJECTIVE = "objective"
    OTHER_START = "other_start"
    AVOIDS = "avoids"
    TRACKING = "tracking"
    """Another model of the other robots, under which other assumptions can be made."""
    ASSUMPTION = "assumption"
    """Something that the others would have to promise."""


@dataclass(frozen=True)
class Repair:
    """A change under which the robot has a strategy: that was asked, it is no guess.

    ``change``: the scenario's items and their new values, as they would be written.
    ``scenario``: the scenario with the change (None for an assumption, which no scenario can
    make). ``helpers``: who has the capability that an obstacle needs and can get there;
    ``action``: that capability.
    """

    kind: RepairKind
    change: tuple[tuple[str, str], ...]
    scenario: Scenario | None = None
    helpers: tuple[str, ...] = ()
    action: str | None = None


@dataclass(frozen=True)
class Explanation:
    """Everything that is known of one robot's failure."""

    robot: str
    task: Task
    cause: NoStrategyCause
    diagnosis: Diagnosis
    core: Core
    witness: Witness | None
    repairs: tuple[Repair, ...]
    seconds: float
