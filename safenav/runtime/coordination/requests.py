"""The stack of open requests: who asked for help with which obstacle, and what was interrupted.

A request is pushed when a robot cannot pass an obstacle, and leaves the stack, wherever it stands
in it, when the obstacle is resolved, gone, or known to stay (paper, Section V-D and Algorithm 1).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field

from safenav.dataclass import dataclass
from safenav.scenario.model import Obstacle
from safenav.trace.objective import Objective
from safenav.world.map import Region


@dataclass
class Request:
    """An open request. ``requesters``: all that met the obstacle, the first first, and where each
    stood. ``interrupted``: the objectives that were in force. ``helpers``: who serves it now,
    ``told``: whom the trace named last; ``entries``: requester and helpers of each push."""

    obstacle: Obstacle
    requesters: dict[str, Region]
    tick: int
    interrupted: Mapping[str, Objective]
    helpers: tuple[str, ...] = ()
    told: tuple[str, ...] | None = None
    entries: list[tuple[str, tuple[str, ...]]] = field(default_factory=list)

    @property
    def unpushed(self) -> list[str]:
        """The requesters for whom nothing was pushed yet."""
        pushed = {requester for requester, _ in self.entries}
        return [name for name in self.requesters if name not in pushed]


@dataclass
class Requests:
    """The open requests, the oldest first."""

    stack: list[Request] = field(default_factory=list)

    def __iter__(self) -> Iterator[Request]:
        return iter(self.stack)

    @property
    def depth(self) -> int:
        return sum(len(request.entries) for request in self.stack)

    def of(self, obstacle: str) -> Request | None:
        """The request for an obstacle of that name."""
        return next((r for r in self.stack if r.obstacle.name == obstacle), None)

    def open(
        self,
        obstacle: Obstacle,
        requester: str,
        place: Region,
        tick: int,
        interrupted: Mapping[str, Objective],
    ) -> Request:
        """The request for an obstacle, with one more requester."""
        found = self.of(obstacle.name)
        if found is None:
            found = Request(obstacle, {}, tick, interrupted)
            self.stack.append(found)
        found.requesters.pop(requester, None)
        found.requesters[requester] = place
        return found

    def close(self, obstacle: str) -> Request | None:
        """Drop the request for an obstacle, if there is one."""
        found = self.of(obstacle)
        if found is not None:
            self.stack.remove(found)
        return found

    def waits(self, robot: str) -> list[Request]:
        """The requests that a robot has made."""
        return [r for r in self.stack if robot in r.requesters]
