"""Events: the reasons for which the coordination layer decides again."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct, field

from safenav.runtime.characterization import ForbiddenMove
from safenav.runtime.coordination.strategy_search import TaskResult
from safenav.runtime.progress import Progress
from safenav.runtime.termination import Conclusion
from safenav.runtime.worlds.world import Change
from safenav.scenario.model import Obstacle, Robot
from safenav.scenario.objective import Objective
from safenav.trace.vocabulary import ChangeCause, Reason


class Started(Struct, frozen=True):
    """The run begins: every robot needs its first strategy. ``waits``: it continues another one,
    and cannot proceed until something changes; ``idle``: robots without a strategy for their own
    objective."""

    waits: bool = False
    idle: frozenset[str] = frozenset()


class Continued(Struct, frozen=True):
    """The run continues another one; the team knows the obstacles encountered there."""


class ObstacleEncountered(Struct, frozen=True):
    """A robot has encountered an obstacle, which the team knows from now on; ``HelpRequested``
    follows once the robot has backed up."""

    violation: ForbiddenMove


class HelpRequested(Struct, frozen=True):
    """A robot has backed up from an obstacle, and requests help from its present region."""

    violation: ForbiddenMove


class ObstaclesResolved(Struct, frozen=True):
    """Obstacles were resolved where ``robot`` stands, requested or not; each with its truth."""

    robot: Robot
    found: tuple[tuple[Obstacle, bool | None], ...]


class ObstacleChanged(Struct, frozen=True):
    """An obstacle has appeared, where no robot knows it yet, or has disappeared."""

    change: Change


class ObstacleDeclaredPermanent(Struct, frozen=True):
    """An operator reports that an obstacle is permanent."""

    obstacle: Obstacle


class RequestsSetAside(Struct, frozen=True):
    """No joint state that the team can reach serves these obstacles: they are walls for now."""

    obstacles: frozenset[str]


class ObstaclesReopened(Struct, frozen=True):
    """Obstacles that were given up may be resolvable again: an operator has intervened, the wait
    for a change is over, or a robot has another objective."""

    reason: Reason = Reason.SERVICE


class ServiceChanged(Struct, frozen=True):
    """A robot is out of service, or back in it. ``obstacle``: the one that appeared in its region
    when its charge was used up, and that it requests to be resolved."""

    robot: str
    active: bool
    cause: ChangeCause
    obstacle: Obstacle | None = None


class ObjectiveGiven(Struct, frozen=True):
    """A robot has another objective of its own, with its progress (None: none so far). ``hope``:
    obstacles that were given up may be resolvable with it."""

    robot: str
    objective: Objective
    within: int | None
    progress: Progress | None
    hope: bool


class Unsettled(Struct, frozen=True):
    """Duties must be derived from the present state. ``refused``: (robot, obstacle) for which no
    strategy was found; ``idle``: robots for whose own objective none was found; ``off``: those that
    wait for a joint plan instead, since their strategies have no node for their poses."""

    reason: Reason
    refused: Mapping[tuple[str, str], TaskResult] = field(default_factory=dict)
    idle: frozenset[str] = frozenset()
    off: frozenset[str] = frozenset()


class OutsideStrategy(Struct, frozen=True):
    """A robot is in no node of its strategy, and needs a strategy from its pose. ``end``:
    conclusion of the run if there is none; None: the robot stays, and tries again. ``waits``: the
    team waits for a change of the scenario, and the robot needs a strategy for its objective while
    it waits."""

    robot: str
    reason: Reason
    end: Conclusion | None = None
    waits: bool = False


Event = (
    Started
    | Continued
    | ObstacleEncountered
    | HelpRequested
    | ObstaclesResolved
    | ObstacleChanged
    | ObstacleDeclaredPermanent
    | RequestsSetAside
    | ObstaclesReopened
    | ServiceChanged
    | ObjectiveGiven
    | Unsettled
    | OutsideStrategy
)
