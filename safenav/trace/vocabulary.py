"""Values of a trace's fields: words, which docs/trace.md explains, and parts of records."""

from collections.abc import Mapping
from enum import StrEnum

from msgspec import Struct


class Form(StrEnum):
    """The form of an objective in the specification (docs/scenario.md, forms of a patrol)."""

    LITERAL = "literal"
    OTHER_MEMORY = "other_memory"
    ALTERNATION = "alternation"


class BlockReason(StrEnum):
    """Reason why an obstacle became permanent."""

    UNTRAVERSABLE = "untraversable"
    NO_CAPABLE_ROBOT = "no_capable_robot"
    UNRESOLVABLE = "unresolvable"
    """The closure of all that the team can do never resolves it."""
    OPERATOR = "operator"
    """Live: an operator declared it permanent."""


class MovedBy(StrEnum):
    """The origin of a move."""

    STRATEGY = "strategy"
    BACKTRACK = "backtrack"
    PLAN = "plan"
    STAY = "stay"
    """The robot acts, is out of service, has no successor, or is held back by coordination."""


class MoveEnd(StrEnum):
    """End of a step."""

    ARRIVED = "arrived"
    ELSEWHERE = "elsewhere"
    BLOCKED = "blocked"
    FAILED = "failed"
    LOST = "lost"


class ActResult(StrEnum):
    """The result of an action on an obstacle."""

    DONE = "done"
    UNTRAVERSABLE = "untraversable"
    FAILED = "failed"
    NOTHING = "nothing"
    """There is no such obstacle."""

    @classmethod
    def of(cls, truth: bool | None) -> "ActResult":
        """Return the result of the action that reveals this truth (None: the obstacle has none)."""
        return cls.UNTRAVERSABLE if truth is False else cls.DONE


class OperatorIntervention(StrEnum):
    """An intervention of an operator."""

    RESOLVED = "resolved"
    PERMANENT = "permanent"
    PUT_BACK = "put_back"
    OUT_OF_SERVICE = "out_of_service"
    OBJECTIVE = "objective"
    ADDED = "added"
    GIVE_UP = "give_up"


class ChangeCause(StrEnum):
    """Cause of a change of an obstacle, an objective or the service of a robot."""

    SCENARIO = "scenario"
    WORLD = "world"
    USER = "user"
    INPUT = "input"
    BATTERY = "battery"
    """A robot's charge is used up, or its battery was replaced."""


class PlanEndReason(StrEnum):
    """Reason for the end of a joint plan."""

    REACHED = "reached"
    VIOLATION = "violation"
    CHANGED = "changed"
    """An obstacle was resolved, appeared or disappeared, or duties changed."""


class DeadlineVerdict(StrEnum):
    """The state of a deadline: it begins, is kept, is missed, is excused, or can no longer be
    kept."""

    SET = "set"
    KEPT = "kept"
    LATE = "late"
    EXCUSED = "excused"
    LOST = "lost"


class OperatorCause(StrEnum):
    """Reason why an operator is needed."""

    NO_CAPABLE_ROBOT = "no_capable_robot"
    CYCLIC_REQUESTS = "cyclic_requests"
    UNREALIZABLE = "unrealizable"
    DEADLOCK = "deadlock"
    NEVER_RESOLVABLE = "never_resolvable"
    """A robot cannot continue in the closure of all that the team can do."""
    OUT_OF_SERVICE = "out_of_service"
    """Nothing is left to do while robots are out of service."""


class AvertedEnd(StrEnum):
    """An outcome that a change, or an operator, may avert, so that the run waits instead."""

    OPERATOR_NEEDED = "operator_needed"
    ASSUMPTION_VIOLATED = "assumption_violated"
    SEARCH_LIMIT = "search_limit"
    TIME_LIMIT = "time_limit"


class Proof(Struct, frozen=True):
    """No order of moves of these ``robots`` completes the mission, even without all other robots.
    ``memory``: the memory of some robots' formulas."""

    robots: tuple[str, ...]
    memory: Mapping[str, Mapping[str, int]] | None = None
