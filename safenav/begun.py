"""The run that another one continues: in scenarios, and in the headers of traces."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from safenav.bounds import Count, Place, Region, Sha256


class RoundClock(Struct, frozen=True):
    """A round that was begun ``since`` so many ticks (-1: in tick 1). ``disturbed``: the
    robot has done something else in it, ``before``: in the one before it; ``over``: it is judged
    already."""

    since: int
    disturbed: bool = False
    before: bool = False
    over: bool = False


class Done(Struct, frozen=True):
    """A robot's progress with its own objective: ``rounds`` since the last resolution, the targets
    ``seen`` in the present one, the target whose ``turn`` it is. ``uncounted``: what it meets where
    it stands is not counted yet. ``memory``: of its formulas."""

    rounds: Count = 0
    seen: tuple[Count, ...] = ()
    turn: Count = 0
    uncounted: bool = False
    clock: RoundClock | None = None
    memory: Mapping[str, int] = {}


class PlanLeft(Struct, frozen=True):
    """The rest of a joint plan: the places of each robot (region and heading), the first where it
    stands; ``[first, i, then, j]``: ``then`` enters its place ``j`` only when ``first`` has
    arrived at its place ``i``; why the plan was made."""

    robots: Mapping[str, tuple[Place, ...]]
    orders: tuple[tuple[str, Count, str, Count], ...]
    reason: str


class Begun(Struct, frozen=True):
    """The run that this one continues, whose promises and objectives were accepted: what cannot be
    kept from here is judged, and not refused. ``trace``: the sha256 of its trace, if it is a file;
    ``robots``: those that had begun; ``due``: the ticks left for the requests that were open;
    ``late``: the obstacles whose promise is broken; ``closed``: those that were found
    untraversable; ``had``: the robots that have had their turn of tick 1 before; ``met``: the
    robots that met the first needs of obstacles, where the same robots must meet the next;
    ``asked``: the obstacles that were requested, the oldest first, with the region where each
    requester waits; ``stays``: those of which an operator says that they stay;
    ``plan``: the rest of the joint plan that was followed; ``waited``: the ticks for which robots
    had stood before, without another target; ``charging``: those that charge where they stand;
    ``ran``: it was not refused before its first tick."""

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
