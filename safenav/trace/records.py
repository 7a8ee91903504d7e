"""Typed lines of a trace, for all code that writes or reads them (docs/trace.md).

Each type of line has a frozen class. Its annotations drive the reader, the writer and the JSON
Schema. A field's JSON name is its name here, without the underscore that distinguishes it from a
Python keyword. A field with a default may be absent; a field whose value and default are None is
omitted.
"""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from msgspec import Meta, Struct

from safenav.data import Count, Heading, Place, Region, Seconds, Sha256
from safenav.errors import Outcome, Verdict
from safenav.scenario.model import Clock, Obstacle, Scenario
from safenav.scenario.objective import Objective
from safenav.trace import vocabulary
from safenav.trace.vocabulary import Proof

VERSION = 4
"""The only version of the format."""


class TickLine(Struct, frozen=True, rename={"from_": "from"}):
    """A line with a ``tick``: 0 before the first move; in a live run, the number of the pass."""

    tick: Count


class Record(TickLine, frozen=True, kw_only=True):
    """Fields of all lines. ``t``: the time in seconds, in a live run. ``line``: the line's number
    in its file, from 1 (0: not from a file), which is not part of the line."""

    type: ClassVar[str]
    note: ClassVar[bool] = False
    t: Seconds | None = None
    line: int = 0

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and all(
            getattr(self, name) == getattr(other, name)
            for name in self.__struct_fields__
            if name != "line"
        )


class Note(Record, frozen=True):
    """A line that explains: the judge skips it, and it changes nothing. All others are facts."""

    note: ClassVar[bool] = True


class Header(Record, frozen=True, tag="header"):
    """The first line. ``scenario``: the scenario as it was read, with the clock, the limits and the
    seed of this run. ``world``: ``external`` if its obstacles are not simulated, so that their
    truths are unknown. ``cells``: the cells of beliefs, if a robot keeps any."""

    trace: int
    safenav: str
    scenario: Scenario
    world: Literal["simulated", "external"] = "simulated"
    cells: tuple[tuple[Region, ...], ...] | None = None

    @property
    def live(self) -> bool:
        """Whether the run is in seconds, not in ticks."""
        return self.scenario.clock is Clock.LIVE


class Synthesis(Record, frozen=True, tag="synthesis"):
    """A synthesis for a robot. ``verified``: null if it was not checked; ``spec``, ``strategy``:
    sha256 of the specification and of the strategy's JSON; ``assumptions``: in words; ``node``: the
    first node of an installed strategy.

    The data of the specification: the pose (``region``, ``heading``); ``memory`` at the start;
    ``inputs`` that its formulas name; ``closed``: regions other than walls, each with the obstacle
    or rule; ``knowledge``: robots whose positions are inputs -> the initial region, or the cells
    that may hold it; ``beliefs``: robot -> lists of cells, value N + i of its input stands for the
    i-th (N regions); ``sight_closed``: regions that block the view; ``places`` that may be
    assigned; ``forbidden``: poses from which the team could not continue; ``form`` of the
    objective, and the moves that it ``allows``.
    """

    robot: str
    verdict: Verdict
    seconds: Seconds
    states: Count | None
    cached: bool
    verified: bool | None
    spec: Sha256
    strategy: Sha256 | None
    objective: Objective
    assumptions: tuple[str, ...] = ()
    node: Count | None = None
    region: Region | None = None
    heading: Heading | None = None
    memory: Mapping[str, int] | None = None
    inputs: Mapping[str, bool] | None = None
    closed: tuple[tuple[Region, str], ...] | None = None
    knowledge: Mapping[str, Region | tuple[Count, ...]] | None = None
    beliefs: Mapping[str, tuple[tuple[Count, ...], ...]] | None = None
    sight_closed: tuple[Region, ...] | None = None
    places: tuple[Region, ...] | None = None
    forbidden: tuple[Place, ...] | None = None
    form: vocabulary.Form | None = None
    allows: str | None = None


class Move(Record, frozen=True, tag="move"):
    """A robot's turn in a tick. ``heading`` after the move. ``toward``: during a step of several
    ticks, the region that the robot will enter and already occupies. ``by``: the origin of the move
    (null in transit). ``result`` of a step that ended elsewhere than commanded."""

    robot: str
    from_: Region
    to: Region
    heading: Heading | None
    toward: Region | None = None
    by: vocabulary.MovedBy | None = None
    result: vocabulary.MoveEnd | None = None


class Depart(Record, frozen=True, tag="depart"):
    """Live: a robot begins a step. ``heading`` at its end. ``node``: the strategy's node after the
    step; ``seconds``: expected duration."""

    command: Count
    robot: str
    from_: Region
    to: Region
    heading: Heading | None
    by: vocabulary.MovedBy
    node: Count | None = None
    seconds: Seconds | None = None


class Arrive(Record, frozen=True, tag="arrive"):
    """Live: a robot's step has ended; the robot occupies only the region ``at`` (lost: it is
    somewhere in ``regions``). ``reason``: why the step ended otherwise, or took several
    attempts."""

    command: Count
    robot: str
    at: Region
    heading: Heading | None
    result: vocabulary.MoveEnd
    reason: str | None = None
    regions: tuple[Region, ...] | None = None


class Act(Record, frozen=True, tag="act"):
    """Live: a robot begins to act on ``obstacles`` (none: an obstacle unknown to the team) where it
    stands. ``robots``: all participants, which stay until the ``acted`` line."""

    command: Count
    robot: str
    robots: tuple[str, ...]
    obstacles: tuple[str, ...]


class ActionEnd(Record, frozen=True, tag="acted"):
    """The end of an action; in lockstep only of a failed action, with ``command`` 0. ``results``:
    one for each obstacle. ``barred``: obstacles on which the robot has failed too often; it does
    not act on them until they change or it is back in service. ``reason`` of the failure."""

    command: Count
    robot: str
    results: Mapping[str, vocabulary.ActResult]
    barred: tuple[str, ...] | None = None
    reason: str | None = None


class Late(Note, frozen=True, tag="late"):
    """A report of the world or an intervention was dropped. ``event``: its kind; ``reason``: why
    it was dropped."""

    event: str
    reason: str
    robot: str | None = None
    obstacle: str | None = None


class Reopened(Record, frozen=True, tag="reopened"):
    """A given-up obstacle (``blocked``) is open again."""

    obstacle: str


class Waiting(Record, frozen=True, tag="waiting"):
    """The run waits instead of ending with this ``outcome``: in a live run for an operator, or
    ``until`` the tick or second of a change in the scenario."""

    outcome: vocabulary.AvertedEnd
    explanation: str
    cause: vocabulary.OperatorCause | None = None
    proof: Proof | None = None
    until: Seconds | None = None
    unrealizable: Mapping[str, Sha256] | None = None


class Operator(Record, frozen=True, tag="operator"):
    """Live: an intervention of an operator."""

    intervention: vocabulary.OperatorIntervention
    robot: str | None = None
    obstacle: str | None = None
    region: Region | None = None
    heading: Heading | None = None
    objective: Objective | None = None


class Discovered(Record, frozen=True, tag="discovered"):
    """An obstacle that the header does not list. This line precedes all lines that name it."""

    obstacle: Obstacle


class ObstacleChange(Record, frozen=True):
    """A change of an obstacle that no robot caused."""

    obstacle: str
    cause: vocabulary.ChangeCause


class Appeared(ObstacleChange, frozen=True, tag="appeared"):
    """An obstacle is present from now on. ``cause``: ``scenario``, ``user``, ``battery`` for an
    empty battery, ``world`` if a sensor shows a resolved obstacle."""


class Ordered(ObstacleChange, frozen=True, tag="order"):
    """The team must resolve an obstacle that has just appeared, although no robot has encountered
    it."""


class Gone(ObstacleChange, frozen=True, tag="gone"):
    """An obstacle disappeared without being resolved."""


class Truth(Record, frozen=True, tag="truth"):
    """The truth that resolving the obstacle reveals from now on."""

    obstacle: str
    traversable: bool
    cause: vocabulary.ChangeCause


class NewObjective(Record, frozen=True, tag="objective"):
    """A robot has another objective of its own from now on; its rounds restart. ``at_once``: false
    if the robot waits or helps, and gets the objective afterwards."""

    robot: str
    objective: Objective
    at_once: bool
    cause: vocabulary.ChangeCause
    within: Count | None = None


class Inputs(Record, frozen=True, tag="inputs"):
    """The inputs of the environment from now on, written when one changes. Before the first such
    line, all are off. ``user``: inputs that a user has set."""

    values: Mapping[str, bool]
    user: tuple[str, ...] | None = None


class Service(Record, frozen=True, tag="service"):
    """A robot is out of service (``active`` false), or is back. The robot first ends a step that it
    has begun."""

    robot: str
    active: bool
    cause: vocabulary.ChangeCause


class Violation(Record, frozen=True, tag="violation"):
    """The robot would have entered ``proposed`` (equal to ``at`` if the obstacle is in its own
    region); ``action`` is that of the obstacle's next need."""

    robot: str
    at: Region
    proposed: Region
    obstacle: str
    action: str


class Backtrack(Note, frozen=True, tag="backtrack"):
    """The region where the robot stays, or goes instead."""

    robot: str
    to: Region


class Request(Record, frozen=True, tag="request"):
    """A request for help. ``bids``: robot in service with the action -> ticks (live: seconds) to
    reach this need and later ones of the ``same`` robots (null: no path); ``helpers``: may include
    the requester; ``need``: its number, from 0, if the obstacle has several; ``because``: in words,
    why no robot or not the nearest robot helps. An order has no ``requester``."""

    obstacle: str
    requester: str | None
    bids: Mapping[str, Seconds | None]
    helpers: tuple[str, ...]
    need: Count | None = None
    because: str | None = None


class StackEntry(Note, frozen=True):
    """An entry of the stack of objectives: obstacle, requester and helpers."""

    depth: Count
    obstacle: str
    requester: str | None
    helpers: tuple[str, ...]


class Push(StackEntry, frozen=True, tag="push"):
    """A request enters the stack of objectives, which has this ``depth``."""


class Pop(StackEntry, frozen=True, tag="pop"):
    """An entry leaves the stack; the fields identify it."""


class Duty(Record, frozen=True, tag="duty"):
    """Robots pursue these ``objectives`` from now on."""

    objectives: Mapping[str, Objective]


class Part(Record, frozen=True, tag="part"):
    """``robot`` has done its part of need number ``need`` in the region ``at``. The last part of an
    obstacle with a single need has only the line ``resolved``. ``robots``: all that did so, if
    together; ``missing``: how many must still do so."""

    obstacle: str
    need: Count
    action: str
    robot: str
    at: Region
    robots: tuple[str, ...] | None = None
    missing: Count | None = None


class Resolved(Record, frozen=True, tag="resolved"):
    """An obstacle is resolved: its last need was fulfilled. ``requested``: whether a request for it
    was open; ``traversable``: the truth that it revealed; ``robots``: all that fulfilled its only
    need, if several."""

    obstacle: str
    robot: str
    at: Region
    requested: bool
    traversable: bool | None
    robots: tuple[str, ...] | None = None


class KnownObstacle(Record, frozen=True, tag="blocked"):
    """An obstacle became permanent for ``robots``. ``because``: the missing capability;
    ``for_now``: true if the scenario changes something later."""

    obstacle: str
    robots: frozenset[str]
    reason: vocabulary.BlockReason
    because: str | None = None
    for_now: bool | None = None


class Goal(Record, frozen=True, tag="goal"):
    """An objective made progress. ``goal``: index of the target in it; ``round``: completed
    rounds; ``duty``: true if not the robot's own."""

    robot: str
    goal: Count
    region: Region
    round: Count
    duty: bool | None = None


class Belief(Note, frozen=True, tag="belief"):
    """From now on ``robot`` sees ``of``, in the only one of ``regions``, or believes it to be in
    one of them."""

    robot: str
    of: str
    seen: bool
    regions: frozenset[Region]


class Charge(Note, frozen=True, tag="charge"):
    """The charge of a robot's battery from now on, in percent of its capacity."""

    robot: str
    percent: Count


class Assumption(Record, frozen=True, tag="assumption"):
    """The other robots violated an assumption of the robot's strategy."""

    robot: str
    name: str


class Deadline(Record, frozen=True, tag="deadline"):
    """The state of a deadline ``of`` a robot (a round), an obstacle (its resolution) or the
    ``mission``. ``earliest``: it cannot be met before the end of this tick."""

    of: str
    due: Count
    verdict: vocabulary.DeadlineVerdict
    earliest: Count | None = None


class Plan(Record, frozen=True, tag="plan"):
    """A joint plan. ``robots``: the waypoints of each, from its present pose. ``orders``: ``[first,
    i, then, j]``: ``then`` enters its waypoint ``j`` only when ``first`` has arrived at its
    waypoint ``i`` (both count from 0)."""

    reason: str
    robots: Mapping[str, Annotated[tuple[Place, ...], Meta(min_length=1)]]
    orders: tuple[tuple[str, Count, str, Count], ...]


class PlanEnd(Record, frozen=True, tag="plan_end"):
    """The end of the last recorded joint plan."""

    reason: vocabulary.PlanEndReason


class Checkpoint(Record, frozen=True, tag="checkpoint"):
    """The state of the run after these ``lines`` (with the header). ``safenav resume`` continues
    from it; only the version of safenav that wrote ``run`` reads it. ``run.sha256``: the checksum
    of the header without ``limits`` and of the other data of ``run``. It reveals changes, but a
    forger can update it."""

    lines: Count
    run: Mapping[str, object]


class Resumed(Note, frozen=True, tag="resumed"):
    """The run ended early (interrupted, killed or at a limit), and continues from its last
    checkpoint."""


class End(Record, frozen=True, tag="outcome"):
    """The last line of a complete trace. ``rounds`` of each robot; ``syntheses``: calls of the
    synthesizer. ``cause``: the reason why an operator is needed. ``proof`` of a ``deadlock``.
    ``unrealizable``: robot and spec of each synthesis that ended the run. Live: ``makespan``, the
    end of the last command. ``late``: the missed deadlines; ``refused``: deadlines that cannot be
    met from the start (``NAME.battery`` for a charge), each with the least feasible value (None:
    there is none)."""

    outcome: Outcome
    explanation: str
    rounds: Mapping[str, Count]
    ticks: Count
    seconds: Seconds
    syntheses: Count
    synthesis_seconds: Seconds
    cause: vocabulary.OperatorCause | None = None
    proof: Proof | None = None
    unrealizable: Mapping[str, Sha256] | None = None
    makespan: Seconds | None = None
    late: tuple[str, ...] | None = None
    refused: Mapping[str, Count | None] | None = None


KINDS: Mapping[str, type[Record]] = {
    str(kind.__struct_config__.tag): kind
    for kind in list(globals().values())
    if isinstance(kind, type) and issubclass(kind, Record) and kind.__struct_config__.tag
}
"""All types of lines above, by the ``type`` in the file (the class's tag)."""

for _tag, _kind in KINDS.items():
    _kind.type = _tag
