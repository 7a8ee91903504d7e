"""The run that another one continues: in scenarios, and in the headers of traces."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from safenav.bounds import Count, Place, Region, Sha256


class RoundClock(Struct, frozen=True):
    """The clock of a round with a deadline. ``since``: ticks since it began (-1: it begins in tick
    1); ``disturbed``: the robot did something else in this round, ``before``: in the previous one;
    ``over``: its deadline has been judged."""

    since: int
    disturbed: bool = False
    before: bool = False
    over: bool = False


class Done(Struct, frozen=True):
    """A robot's progress with its own objective: ``rounds`` since the last resolution, the targets
    ``seen`` in the present round, the target whose ``turn`` it is. ``uncounted``: whether a target
    at its pose is not counted yet; ``memory``: values of its formulas' variables."""

    rounds: Count = 0
    seen: tuple[Count, ...] = ()
    turn: Count = 0
    uncounted: bool = False
    clock: RoundClock | None = None
    memory: Mapping[str, int] = {}


class PlanLeft(Struct, frozen=True):
    """The rest of a joint plan. ``robots``: poses of each robot, its present one first; ``orders``:
    ``[first, i, then, j]``, ``then`` enters its pose ``j`` only when ``first`` has arrived at its
    pose ``i``; ``reason``: why the plan was made."""

    robots: Mapping[str, tuple[Place, ...]]
    orders: tuple[tuple[str, Count, str, Count], ...]
    reason: str


class Begun(Struct, frozen=True):
    """The run that this one continues. Its deadlines and objectives were accepted, so those that
    are infeasible from here are judged, not refused. ``trace``: sha256 of its trace, if that is a
    file; ``robots``: progress of the robots that had begun; ``due``: ticks left for each open
    request; ``late``: obstacles whose deadline had passed; ``closed``: obstacles found
    untraversable; ``had``: robots that have already had their turn of tick 1; ``met``: the robots
    that fulfilled the first needs of an obstacle, if the same robots must fulfil the next;
    ``asked``: requested obstacles, the oldest first, with the region where each requester waits;
    ``stays``: obstacles that an operator has declared permanent; ``plan``: the rest of the joint
    plan; ``waited``: ticks without progress of each robot; ``charging``: robots that charge at
    their pose; ``ran``: the run was not refused before its first tick."""

    trace: Sha256 | None = None
    robots: Mapping[str, Done] = {}
    due: Mapping[str, Count] = {}
    late: tuple[str, ...] = ()
    closed: tuple[str, ...] = ()
    had: tuple[str, ...] = ()
    met: Mapping[str, tuple[tuple[str, ...], ...]] = {}
    asked: Mapping[str, Mapping[str, Region]] = {}
    stays: tuple[str, ...] = ()
    plan: PlanLeft | None = None
    waited: Mapping[str, Count] = {}
    charging: tuple[str, ...] = ()
    ran: bool = False
