"""Scenarios as data: map, robots, hidden obstacles, end and expected result.

The data are immutable and validated (see ``safenav.scenario.reading.loader``), so no user of a
Scenario needs to check it again.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from itertools import takewhile
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from msgspec import Meta, Struct, field
from msgspec.structs import replace

from safenav.data import Count, Positive, Seconds
from safenav.errors import Outcome
from safenav.scenario import values
from safenav.scenario.objective import Objective, Target
from safenav.scenario.yaml.keys import Key, OwnName, Part, key, name_key
from safenav.world.map import Cells, Region, RegionMap, tiles
from safenav.world.poses import Mobility, Pose

if TYPE_CHECKING:
    from safenav.pace.robot import Figures


class RobotChange(Struct, frozen=True):
    """A change for a robot during the run, at the beginning of tick ``at``: a new ``objective``
    (each round due ``within`` this many ticks) or a change of service (``active``). The other of
    the two is None."""

    at: Count
    robot: str
    objective: Objective | None = None
    active: bool | None = None
    within: Count | None = None


class Input(Part, frozen=True):
    """A Boolean that the environment sets.

    It is the same for all robots in a tick and off before the first tick. A simulation turns it on
    in the ticks of ``spans`` (first and last). ``again``: the values that specifications assume to
    occur infinitely often.
    """

    one: ClassVar = "input {name}"
    example: ClassVar = "{at: 12-30}; {} for one that a program sets"
    elsewhere: ClassVar = dict.fromkeys(("from", "until"), "write the ticks as 'at: 12-30'")
    spelled: ClassVar = {"spans": "at", "again": "always_eventually"}
    name: OwnName
    spans: values.Spans = key(
        "Ticks when it is on in simulations: 12, 20-30 or a list.", default=()
    )
    again: values.Again = key(
        "Values that specifications assume to recur infinitely often: off, on or both.", default=()
    )

    def is_on(self, tick: int) -> bool:
        """Return whether a simulation turns the input on in a tick."""
        return any(first <= tick <= last for first, last in self.spans)


def switching(inputs: Iterable[Input]) -> list[int]:
    """Return the ticks, in ascending order, in which an input changes."""
    found = set[int]()
    for each in inputs:
        edges = {tick for first, last in each.spans for tick in (first, last + 1)}
        found |= {tick for tick in edges if each.is_on(tick) != each.is_on(tick - 1)}
    return sorted(found)


KnownRobot = Annotated[str, Key(by="robot")]


class Exclusion(Part, frozen=True):
    """A group of robots of which at most one may be in some regions.

    A robot in transit is in both of its regions.
    """

    label: ClassVar = "of never_together"
    example: ClassVar = "{robots: [quad, digit], in: [47]}"
    spelled: ClassVar = {"regions": "in"}
    robots: frozenset[KnownRobot] = key(
        "At least two robots.", "name two robots or more, for example 'robots: [quad, digit]'"
    )
    regions: values.ZoneValue = key(
        "At any time, at most one of them is in these regions.",
        "name regions or areas, for example 'in: bridge'",
        schema={"minItems": 1},
    )


class Coordination(StrEnum):
    """Method by which the coordination layer reassigns robots (docs/coordination.md)."""

    RESYNTHESIS = "resynthesis"
    ASSIGNABLE = "assignable"


class Clock(StrEnum):
    """The time of a run. In lockstep it is in ticks: in each, every robot takes its turn. In a live
    run (``live``) it is in seconds, and each robot decides when its last command has ended."""

    LOCKSTEP = "lockstep"
    LIVE = "live"


class FailedMoves(StrEnum):
    """Policy after too many failed moves of a robot into a region: the region counts as an obstacle
    that only an operator resolves, or the robot is out of service."""

    OBSTACLE = "obstacle"
    OUT_OF_SERVICE = "out_of_service"


class Failures(Part, frozen=True):
    """Reactions to robots that fail to execute a command in a live run.

    A command that has not ended after its time limit is cancelled; if it has not ended after the
    same time again, the robot is lost, or its action has failed."""

    example: ClassVar = "{retries: 3}"
    retries: int = key("Number of retries of a failed move into a region.", default=2)
    then: FailedMoves = key(
        "After the retries, the region is an obstacle, or the robot is out of service.",
        default=FailedMoves.OBSTACLE,
    )
    most: int = key(
        "Failed moves in a row after which a robot is out of service.", least=1, default=6
    )
    actions: int = key("Failed actions after which another robot helps.", least=1, default=2)
    patience: float = key(
        "Time limit of a step, as a multiple of the robot's median step.", above=0, default=10.0
    )
    timeout: float | None = key(
        "Seconds after which a command is cancelled. Default: none.", above=0
    )


class LatePolicy(StrEnum):
    """Policy after a missed deadline: the run continues, or ends with the outcome ``late``."""

    GO_ON = "go_on"
    STOP = "stop"


class Until(Part, frozen=True):
    """The condition under which a run is completed."""

    example: ClassVar = "{rounds: 2}"
    rounds: int = key("Rounds of each robot after the last resolution.", least=1, default=2)
    by: int | None = key("The latest tick at which the mission is completed.", least=1)


class Limits(Part, frozen=True):
    """Limits of the run and of each synthesis."""

    example: ClassVar = "{ticks: 500}"
    ticks: int = key("Maximum number of ticks.", least=1, default=1000)
    synthesis_seconds: float = key("Maximum seconds of each synthesis.", above=0, default=60.0)
    synthesis_memory: int = key("Maximum memory of each synthesis, in MiB.", least=1, default=2048)
    seconds: float | None = key(
        "Maximum seconds of a run; live: on its clock. Default: none; live: 20 times 'ticks'.",
        above=0,
    )


ObstacleName = Annotated[
    str, Key("An obstacle: type@region.", by="obstacle", schema={"pattern": "^(?:.+@.+)$"})
]
Subject = Annotated[str, Key(by="subject")]
"""A robot, an obstacle, or the mission: the subject of a deadline."""


class Expect(Part, frozen=True):
    """The expected result of a run. A missing key is checked only if it has a default."""

    example: ClassVar = "{outcome: completed}"
    outcome: Outcome | None = key("The outcome of the run.", without=(Outcome.ERROR,))
    late: frozenset[Subject] | None = key(
        "Exactly the missed deadlines: robots, obstacles, mission. Default: none."
    )
    resolved: frozenset[ObstacleName] | None = key("Exactly the obstacles that are resolved.")
    blocked: frozenset[ObstacleName] | None = key(
        "Exactly the permanent obstacles and the open orders. Default: no order is open."
    )
    helpers: dict[ObstacleName, KnownRobot] | None = key("The requested helper of each obstacle.")
    ticks: int | None = key("At most this many ticks (lockstep).", least=1)
    rounds: int | None = key("At least this many rounds of every robot, as in 'until'.", least=1)


MOST_CHARGE = 1_000_000
Charge = Annotated[int, Meta(ge=0, le=MOST_CHARGE)]
SomeCharge = Annotated[int, Meta(ge=1, le=MOST_CHARGE)]
DECIMALS = 9
"""Decimals of a charge."""


class Battery(Part, frozen=True):
    """Charge, in units of your choice.

    It is ``start`` initially, at most ``capacity``. A step takes ``move``; a tick (live: a second)
    without a step takes ``stay``, or gives ``charge`` on a charger.
    """

    example: ClassVar = "{capacity: 60, charge: 5}"
    capacity: SomeCharge = key("Full charge.", "for example 'capacity: 60'")
    charge: SomeCharge = key(
        "Charge gained per tick (live: per second) on a charger.", "for example 'charge: 5'"
    )
    start: Charge = key("Initial charge. Default: full.", like="capacity")
    move: Charge = key("Charge used by a step.", default=1)
    stay: Seconds = key(
        "Charge used per tick (live: per second) without a step; live, also a fraction.",
        most=MOST_CHARGE,
        check=values.charge,
        default=0,
    )

    def flaws(self) -> Iterator[tuple[str, str, str]]:
        """Yield keys whose values contradict others, each with the error and a remedy."""
        for word, given in (("start", self.start), ("move", self.move)):
            if given > self.capacity:
                yield word, f" is {given}, more than the capacity of {self.capacity}", ""

    def stepped(self, charge: float) -> float:
        """Return the charge after a step."""
        return round(max(0, charge - self.move), DECIMALS)

    def stayed(self, charge: float, time: float, *, charging: bool) -> float:
        """Return the charge after a time without a step. ``charging``: whether on a charger."""
        rate = self.charge if charging else -self.stay
        return round(min(self.capacity, max(0, charge + rate * time)), DECIMALS)

    def percent(self, charge: float) -> int:
        """Return a charge in percent of the capacity."""
        return round(100 * charge / self.capacity)


OPERATOR_ACTION = "operator"
"""The action for an obstacle that represents a failure. No robot has it."""
Action = Annotated[
    str,
    name_key(
        "an action", taken=frozenset({OPERATOR_ACTION}), reserved="is reserved for human operators"
    ),
]


class RobotModel(Part, frozen=True):
    """A robot model.

    ``vision``: None for unlimited. ``size``, ``speed`` and ``motion`` determine its motion in
    metres (docs/motion.md).
    """

    one: ClassVar = "robot model {name}"
    example: ClassVar = "{mobility: free, layer: ground}"
    name: OwnName
    mobility: Mobility = key(
        "free: steps to any neighbour; heading: straight on, or after a turn of 90 degrees.",
        "'mobility: free' or 'mobility: heading'",
    )
    layer: values.Layer = key(
        "Robots of one layer avoid each other.", "for example 'layer: ground'"
    )
    capabilities: frozenset[Action] = key("Actions that it can perform.", default=frozenset())
    vision: values.Vision = None
    size: float | None = key(
        "Diameter of its body's bounding circle in metres. Default: that of its motion.", above=0
    )
    speed: float | None = key(
        "Metres per second (of a walker: above each foot). Default: that of its motion.", above=0
    )
    timing: Annotated[int, Meta(ge=1, le=1000)] = key(
        "Ticks that a step takes in lockstep (live: the time of its motion).", default=1
    )
    motion: Literal["walker", "flyer", "rover", "disc"] | None = key(
        "Its motion in metres: walker, flyer, rover or disc. Default: flyer (layer air); with "
        "'speed', disc."
    )
    battery: Battery | None = None

    def flaws(self) -> Iterator[tuple[str, str, str]]:
        """Yield keys whose values contradict others, each with the error and a remedy."""
        if self.motion is None:
            return
        from safenav.pace.robot import BOUNDS, MEANINGS  # here to avoid an import cycle

        if self.motion == "walker" and self.mobility is Mobility.FREE:
            hint = "it cannot turn around within a region: write 'mobility: heading'"
            yield "motion", f": a {self.motion} moves with a heading", hint
        for word, value in (("size", self.size), ("speed", self.speed)):
            least, most = BOUNDS[self.motion][word]
            if value is not None and not least <= value <= most:
                found = f" is {value:g}, and must be from {least:g} to {most:g}"
                yield word, found, MEANINGS[word]

    @property
    def figures(self) -> Figures | None:
        """The kind of motion with all parameters; None if the model has none."""
        from safenav.pace.robot import resolved

        return resolved(self.motion, self.size, self.speed, self.layer)


class Robot(Struct, frozen=True):
    """One robot of the team (the paper's agent p with its C_p and objective).

    ``avoids``: the robots with which it must not share a region; None for those of its layer.
    ``tracks``: the robots whose positions its specification models, by beliefs (docs/tracking.md).
    ``while_waiting``: its objective while it waits for help; None: it stays. ``within``: the
    deadline of a round of its objective in ticks, if it has one. ``when``: its objectives while
    inputs are on; the first input that is on decides.
    """

    name: str
    model: RobotModel
    start: Pose
    objective: Objective
    avoids: frozenset[str] | None = None
    tracks: frozenset[str] = frozenset()
    while_waiting: Objective | None = None
    within: int | None = None
    when: tuple[tuple[str, Objective], ...] = ()

    @property
    def capabilities(self) -> frozenset[str]:
        return self.model.capabilities

    def conflicts(self, other: Robot) -> bool:
        """Return whether these two robots must never share a region. The requirement of one
        suffices, since each robot assumes the other's guarantee."""
        share, pairs = self.model.layer == other.model.layer, ((self, other), (other, self))
        return any(share if a.avoids is None else b.name in a.avoids for a, b in pairs)


class ResolveAt(StrEnum):
    """Resolution regions relative to the obstacle (the paper's S_r)."""

    SELF = "self"
    NEIGHBOURS = "neighbours"


Where = Annotated[
    ResolveAt | Target,
    Key(
        "Where the action works: self, neighbours or regions.",
        form=ResolveAt | tuple[values.Regions, ...],
        entries=1,
        expected="self, neighbours or a list of regions",
        why="name regions in brackets: [47, dock]",
        check=values.united,
    ),
]


class Need(Part, frozen=True):
    """One of several actions that an obstacle needs.

    ``robots`` distinct robots perform ``action``, each in one of the regions of ``at``; in the same
    tick if ``together``. ``same``: the robots that fulfilled the previous need.
    """

    one: ClassVar = "need {name} {rest}"
    example: ClassVar = "{action: push, at: neighbours}"
    action: Action = key("The capability that fulfils it.", "for example 'action: push'")
    robots: Positive = key("Number of distinct robots that perform it.", most=100, default=1)
    at: Where = ResolveAt.SELF
    together: bool = key("Whether all perform it in the same tick.", default=False)
    same: bool = key(
        "Whether the robots that fulfilled the previous need must fulfil this one.", default=False
    )

    @property
    def places(self) -> frozenset[Region]:
        """The regions that are listed in ``at``."""
        return self.at if isinstance(self.at, frozenset) else frozenset()


def actions_of(needs: Sequence[Need], number: int) -> frozenset[str]:
    """Return the actions that a robot must have to fulfil a need: its action, and those of the
    following needs that the same robots must fulfil."""
    chain = [needs[number], *takewhile(lambda need: need.same, needs[number + 1 :])]
    return frozenset(need.action for need in chain)


class ObstacleType(Struct, frozen=True):
    """A type of resolvable obstacle: the needs that resolve it, in order, with the paper's action
    c_r and regions S_r, and the robots that it blocks.

    ``blocks`` lists the layers, robot models and robots that it physically stops, whatever their
    capabilities; None means every robot. ``has_truth``: resolving it may also reveal that the
    region is not traversable. ``resolve_within``: maximum number of ticks from the request to the
    resolution.
    """

    name: str
    needs: Annotated[tuple[Need, ...], Meta(min_length=1)]
    blocks: frozenset[str] | None = None
    has_truth: bool = False
    resolve_within: Count | None = None


FAILURES = ("lost_", "unknown_")
"""Prefixes of obstacle types that represent failures: ``unknown_ground``, ``lost_digit``."""


class Catalogue(Struct, frozen=True):
    """Robot models and obstacle types by name."""

    robots: Mapping[str, RobotModel] = field(default_factory=dict)
    obstacles: Mapping[str, ObstacleType] = field(default_factory=dict)


class Obstacle(Struct, frozen=True):
    """A hidden obstacle r in R. ``traversable`` is the truth that resolving it reveals: True,
    False, or None if its type has no truth to reveal. ``appears`` and ``goes``: the ticks at which
    it appears (None: from the beginning) and disappears (None: never). ``resolve_within``: the
    deadline in ticks from the request to the resolution, None for that of its type. ``ordered``:
    whether it is requested as soon as it appears. ``number``: its number among orders of the same
    type and region, from 1."""

    type: ObstacleType
    region: Region
    traversable: bool | None = None
    appears: Count | None = None
    goes: Count | None = None
    resolve_within: Count | None = None
    ordered: bool = False
    number: Positive = 1

    @property
    def name(self) -> str:
        """The obstacle's name everywhere: ``door@47``; ``crate@47#2`` for a second order."""
        return f"{self.type.name}@{self.region}" + f"#{self.number}" * (self.number > 1)

    @property
    def order(self) -> tuple[str, int, int]:
        """The sort key for the order in which a robot takes loads."""
        return self.type.name, self.region, self.number

    @property
    def needs(self) -> tuple[Need, ...]:
        """The needs that resolve the obstacle, in order."""
        return self.type.needs

    def blocks(self, robot: Robot) -> bool:
        """Return whether the obstacle physically stops this robot, regardless of capabilities."""
        listed = self.type.blocks
        names = (robot.model.layer, robot.model.name, robot.name)
        return listed is None or any(name in listed for name in names)

    def resolved_by_entering(self, robot: Robot, need: int = 0) -> bool:
        """Return whether this robot alone resolves the obstacle by entering its region: ``need`` is
        the last need, requires one robot, and its S_r contains the region."""
        last = self.needs[-1]
        inside = last.at == ResolveAt.SELF or self.region in last.places
        only = need == len(self.needs) - 1 and last.robots == 1 and not last.same
        return only and inside and last.action in robot.capabilities

    def closed_to(self, robot: Robot, need: int = 0) -> bool:
        """Return whether this robot must not enter the obstacle's region until need number ``need``
        and all later ones are fulfilled. This is stricter than the paper's phi_a, which lets any
        robot with the action pass wherever it works (docs/paper.md)."""
        return self.blocks(robot) and not self.resolved_by_entering(robot, need)

    def shuts_in(self, robot: Robot) -> bool:
        """Return whether this obstacle is initially present in the start region of a robot that
        must not enter it. A later obstacle appears only when no robot is there."""
        here = self.appears is None and self.region == robot.start.region
        return here and self.closed_to(robot)

    def resolution_regions(self, world: RegionMap, need: int = 0) -> tuple[Region, ...]:
        """Return the free regions of a need's S_r in ascending order."""
        match self.needs[need].at:
            case ResolveAt.SELF:
                return (self.region,)
            case ResolveAt.NEIGHBOURS:
                return tuple(sorted(world.neighbours(self.region)))
            case regions:
                return tuple(sorted(r for r in regions if world.is_free(r)))


def name_parts(name: str) -> tuple[str, str, int]:
    """Return the parts of an obstacle's name: type, region as written, and number. They are
    ``crate``, ``dock`` and 2 for ``crate@dock#2``."""
    kind, _, place = name.partition("@")
    where, _, number = place.partition("#")
    return (kind, where, int(number)) if number.isdecimal() else (kind, place, 1)


class Scenario(Struct, frozen=True):
    """Complete input of a run. ``source`` is its file, for messages.

    ``tiles``: rows and columns of the cells of beliefs, None for the rooms of the map.
    ``changes``: the changes for robots during the run, by tick (live: at this many seconds).
    ``catalogue``: all available models and types, including its own. ``failures``: policies of a
    drive, from its fleet file. ``requirements``: formulas over the motion, by name.
    ``never_together``: exclusions. ``resolve_within``: the deadline of obstacles without their
    own; ``late``: whether a missed deadline ends the run. ``chargers``: regions where batteries are
    charged; ``flat``: the obstacle type that represents a robot without charge. ``inputs``:
    Booleans that the environment sets.
    """

    name: str
    map: RegionMap
    robots: tuple[Robot, ...]
    obstacles: tuple[Obstacle, ...] = ()
    until: Until = Until()
    limits: Limits = Limits()
    seed: int = 0
    coordination: Coordination = Coordination.RESYNTHESIS
    expect: Expect = Expect()
    source: str = ""
    tiles: tuple[int, int] | None = None
    changes: tuple[RobotChange, ...] = ()
    requirements: Mapping[str, str] = field(default_factory=dict)
    catalogue: Catalogue = Catalogue()
    clock: Clock = Clock.LOCKSTEP
    failures: Failures = Failures()
    never_together: tuple[Exclusion, ...] = ()
    resolve_within: int | None = None
    late: LatePolicy = LatePolicy.GO_ON
    chargers: frozenset[Region] = frozenset()
    flat: ObstacleType | None = None
    inputs: tuple[Input, ...] = ()

    @property
    def recorded(self) -> Scenario:
        """The scenario in the form of a trace: without file names, also in the notes on its map."""
        return replace(self, source="", map=replace(self.map, notes=()))

    @property
    def partition(self) -> Cells | None:
        """The cells of beliefs; None if these are the rooms of the map."""
        return tiles(self.map, *self.tiles) if self.tiles else None

    @property
    def deadlines(self) -> tuple[str, ...]:
        """The keys with which the scenario sets deadlines in ticks."""
        rounds = [*(r.within for r in self.robots), *(c.within for c in self.changes)]
        types = (*self.catalogue.obstacles.values(), *(each.type for each in self.obstacles))
        limits = [*(o.resolve_within for o in self.obstacles), *(t.resolve_within for t in types)]
        limits.append(self.resolve_within)
        given = {"by": [self.until.by], "within": rounds, "resolve_within": limits}
        return tuple(key for key, each in given.items() if any(n is not None for n in each))

    def limit_of(self, obstacle: Obstacle) -> int | None:
        """Return the maximum number of ticks from the request for an obstacle to its resolution:
        its own limit, that of its type, or that of the scenario (None: no limit)."""
        limits = (obstacle.resolve_within, obstacle.type.resolve_within, self.resolve_within)
        return next((limit for limit in limits if limit is not None), None)

    def robot(self, name: str) -> Robot:
        """Return the robot with this name. Raises KeyError."""
        return {robot.name: robot for robot in self.robots}[name]

    def restarts_rounds(self, obstacle: str) -> bool:
        """Return whether the named obstacle's resolution restarts rounds, unlike a battery's."""
        return self.flat is None or name_parts(obstacle)[0] != self.flat.name
