"""The scenario in the form of a trace header: map, robots, obstacles, limits."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from safenav.bounds import Count, Heading, Positive, Region
from safenav.scenario.model import Battery
from safenav.scenario.settings import Exclusion, Input, Limits
from safenav.trace.fields import Objective


def without_underscore(name: str) -> str:
    """Return the name of a field in JSON: the underscore distinguishes it from words of Python."""
    return name.rstrip("_")


class WhenHeader(Struct, frozen=True):
    """The ``objective`` of a robot while an input is on and none listed before it."""

    input: str
    objective: Objective


class RobotHeader(Struct, frozen=True):
    """A robot in the header. ``conflicts``: those it must not share a region with (None: those
    of its layer). ``vision``: how far it sees, in regions; None: without limit. ``motion``: its
    kind of motion in metres and all parameters (docs/motion.md). ``while_waiting``: its objective
    while it waits for help."""

    model: str
    mobility: str
    layer: str
    capabilities: frozenset[str]
    start: Region
    heading: Heading | None
    objective: Objective
    conflicts: frozenset[str] | None = None
    vision: float | None = None
    tracks: tuple[str, ...] | None = None
    timing: Positive | None = None
    motion: Mapping[str, object] | None = None
    while_waiting: Objective | None = None
    battery: Battery | None = None
    when: tuple[WhenHeader, ...] | None = None


class NeedHeader(Struct, frozen=True):
    """One of several actions that an obstacle needs, in order: by ``robots`` distinct robots,
    ``together`` in one tick, from ``regions``; ``same``: by robots that met the need before it."""

    action: str
    regions: tuple[Region, ...]
    robots: Positive = 1
    together: bool = False
    same: bool | None = None


class ObstacleHeader(Struct, frozen=True, rename=without_underscore):
    """A hidden obstacle. ``blocks``: the names of the robots that it physically stops, whatever
    they can do. ``traversable``: the truth of this run.
    ``needs``: all its needs if there are several (``action`` and ``resolution_regions`` are
    those of the first). ``from_`` and ``until``: when it appears and disappears.
    ``resolve_within``: the most ticks from its request to its resolution. ``ordered``: the team
    is to resolve it as soon as it appears."""

    type: str
    name: str
    region: Region
    action: str
    resolution_regions: tuple[Region, ...]
    blocks: frozenset[str]
    traversable: bool | None
    needs: tuple[NeedHeader, ...] | None = None
    from_: Count | None = None
    until: Count | None = None
    resolve_within: Count | None = None
    ordered: bool | None = None

    @property
    def all_needs(self) -> tuple[NeedHeader, ...]:
        """Its needs in order, also where the trace records only one."""
        return self.needs or (NeedHeader(self.action, self.resolution_regions),)

    def resolved_by_entering(self, robot: RobotHeader, stage: int) -> bool:
        """Whether a robot alone resolves it by entering its region once ``stage`` needs are met:
        only one is left, and the region is one of that need's."""
        last = self.all_needs[-1]
        only = stage == len(self.all_needs) - 1 and last.robots == 1 and not last.same
        return only and self.region in last.regions and last.action in robot.capabilities


class ChangeHeader(Struct, frozen=True):
    """A change for a robot during the run, at the beginning of tick ``at`` (live: this many seconds
    after its start): another ``objective``, or whether it is in service (``active``)."""

    at: Count
    robot: str
    objective: Objective | None = None
    active: bool | None = None
    within: Count | None = None


class MapHeader(Struct, frozen=True):
    """The map. ``resolution``: metres that a region measures from west to east and from south
    to north. ``origin``: x, y (metres) and yaw (radians) of its south-western corner."""

    rows: Count
    cols: Count
    grid: tuple[str, ...]
    resolution: tuple[float, float] | None = None
    origin: tuple[float, float, float] | None = None
    names: Mapping[str, Count] | None = None
    """The regions to which the scenario gives names."""
    areas: Mapping[str, tuple[Region, ...]] | None = None
    """The sets of regions to which the scenario gives names."""


class UntilHeader(Struct, frozen=True):
    """The run is completed when every objective was met this many times after the last
    resolution."""

    rounds: Count | None = None


class PromisesHeader(Struct, frozen=True):
    """The deadlines: of a round in ticks, by robot; of the mission, a tick; whether the run ends
    with the first missed deadline (``stop``)."""

    within: Mapping[str, Count]
    by: Count | None = None
    late: str = "go_on"


class ScenarioHeader(Struct, frozen=True):
    """The scenario, fully resolved. ``robots`` are in the order of their turns. ``world``:
    ``simulated`` or ``external``. ``partition``: the cells of beliefs, None where no robot keeps
    any. ``changes``: the changes for robots during the run, by tick. ``requirements``: formulas
    over the motion of the run, by name. ``chargers``: regions where batteries are charged;
    ``flat``: the type of obstacle that appears at a robot whose charge is used up."""

    name: str
    map: MapHeader
    robots: Mapping[str, RobotHeader]
    obstacles: tuple[ObstacleHeader, ...]
    until: UntilHeader
    limits: Limits
    seed: int
    coordination: str
    world: str = "simulated"
    partition: tuple[tuple[Region, ...], ...] | None = None
    changes: tuple[ChangeHeader, ...] | None = None
    requirements: Mapping[str, str] | None = None
    never_together: tuple[Exclusion, ...] | None = None
    promises: PromisesHeader | None = None
    chargers: tuple[Region, ...] | None = None
    inputs: tuple[Input, ...] | None = None
    flat: str | None = None
