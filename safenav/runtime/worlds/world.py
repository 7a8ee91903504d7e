"""Reports of a world that changes by itself: obstacles that come and go, and inputs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Protocol

from msgspec import Struct

from safenav.scenario.model import Obstacle
from safenav.world.map import Region


class Change(Struct, frozen=True):
    """An obstacle that appeared, or disappeared without being resolved. ``by_user``: a user who
    watches the run caused it. ``truth``: revealed by resolving it; ``another``: it differs from
    that of the last obstacle of this name."""

    obstacle: Obstacle
    appeared: bool
    by_user: bool = False
    truth: bool | None = None
    another: bool = False


class ChangingWorld(Protocol):
    """A world in which obstacles appear and disappear."""

    def changes(self, tick: int, occupied: Collection[Region]) -> Iterable[Change]:
        """Return the obstacles that appeared or disappeared by the beginning of a tick.
        ``occupied``: the regions in which robots stand or which they are entering; nothing may
        appear there."""


class InputWorld(Protocol):
    """A world that sets the inputs of the scenario."""

    def inputs(self, tick: int) -> Mapping[str, bool]:
        """Return the inputs of a tick; those that are missing stay as they are."""
