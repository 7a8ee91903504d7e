"""The stack of open requests: which robots wait for which obstacle.

A request is pushed when a robot must not pass an obstacle, and leaves the stack, from any position,
when the obstacle is resolved, gone, or permanent (paper, Section V-D and Algorithm 1). Immutable:
each change gives another stack.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.objective import Objective
from safenav.world.map import Region


class OpenRequest(Struct, frozen=True):
    """An open request. ``requesters``: the robots that encountered the obstacle, in order, each
    with the region where it stood. ``helpers``: the robots that serve it now; ``recorded``: the
    helpers that the trace named last, None before the first line; ``entries``: requester and
    helpers of each push; ``aside``: the trace says that it is set aside; ``saved``: the obstacle
    and the objective of each robot that helped before the first push.
    """

    obstacle: Obstacle
    requesters: Mapping[str, Region] = field(default_factory=dict)
    helpers: tuple[str, ...] = ()
    recorded: tuple[str, ...] | None = None
    entries: tuple[tuple[str | None, tuple[str, ...]], ...] = ()
    aside: bool = False
    saved: Mapping[str, tuple[str | None, Objective]] = field(default_factory=dict)

    @property
    def unpushed(self) -> list[str | None]:
        """Return the requesters without a stack entry; None stands for an order."""
        pushed = {requester for requester, _ in self.entries}
        made: list[str | None] = [None] if self.obstacle.ordered else []
        return [name for name in (*made, *self.requesters) if name not in pushed]


class Requests(Struct, frozen=True):
    """The open requests, the oldest first; ``closed``: removed ones whose pops are not recorded
    yet; ``given_up``: those whose obstacles were found never resolvable; ``aside``: obstacles that
    no joint state serves until something changes."""

    stack: tuple[OpenRequest, ...] = ()
    closed: tuple[OpenRequest, ...] = ()
    given_up: tuple[OpenRequest, ...] = ()
    aside: frozenset[str] = frozenset()

    def continued(self, scenario: Scenario) -> Requests:
        """Return the stack with the requests that were open in a run that this one continues."""
        asked = {} if scenario.begun is None else scenario.begun.asked
        there = {o.name: o for o in scenario.obstacles if o.appears is None}
        before = tuple(OpenRequest(there[name], asked[name]) for name in asked)
        return replace(self, stack=(*before, *self.stack))

    def __iter__(self) -> Iterator[OpenRequest]:
        return iter(self.stack)

    @property
    def depth(self) -> int:
        return sum(len(request.entries) for request in self.stack)

    def of(self, obstacle: str) -> OpenRequest | None:
        """The request for an obstacle of that name."""
        return next((r for r in self.stack if r.obstacle.name == obstacle), None)

    def ordered(self, obstacle: Obstacle) -> Requests:
        """Return the stack with an order: a request that no robot has made."""
        return replace(self, stack=(*self.stack, OpenRequest(obstacle)))

    def opened(self, obstacle: Obstacle, requester: str, place: Region) -> Requests:
        """Return the stack with a request for an obstacle by a robot at ``place``, which the trace
        must record."""
        found = self.of(obstacle.name)
        if found is None:
            asked = OpenRequest(obstacle, {requester: place})
            return replace(self, stack=(*self.stack, asked), aside=frozenset())
        others = {name: at for name, at in found.requesters.items() if name != requester}
        changed = replace(found, requesters=others | {requester: place}, recorded=None)
        return replace(self._put(changed), aside=frozenset())

    def waiting(self, obstacle: str, requester: str, place: Region) -> Requests:
        """Return the stack with another waiting region of a requester."""
        found = self.of(obstacle)
        if found is None:
            return self
        return self._put(replace(found, requesters={**found.requesters, requester: place}))

    def without(self, obstacle: str, *, given_up: bool = False) -> Requests:
        """Return the requests without the one for an obstacle, open or given up."""
        found = self.of(obstacle)
        lost = tuple(r for r in self.given_up if r.obstacle.name != obstacle)
        if found is None:
            return replace(self, given_up=lost)
        left = tuple(request for request in self.stack if request is not found)
        return Requests(left, (*self.closed, found), (*lost, found) if given_up else lost)

    def reopened(self, request: OpenRequest) -> Requests:
        """Return the requests with one that was given up, as a new one."""
        again = OpenRequest(request.obstacle, request.requesters)
        left = self.without(request.obstacle.name)
        return replace(left, stack=(*left.stack, again), aside=frozenset())

    def _put(self, changed: OpenRequest) -> Requests:
        name = changed.obstacle.name
        stack = (changed if request.obstacle.name == name else request for request in self.stack)
        return replace(self, stack=tuple(stack))

    def waits(self, robot: str) -> list[OpenRequest]:
        """The requests that a robot has made."""
        return [r for r in self.stack if robot in r.requesters]
