"""The memory that a robot's formulas may have where a trace has led it.

A trace has poses, not nodes: several memories may fit. Each that fits is one of a behaviour that
keeps the formulas, so any of them continues it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from msgspec import Struct

from safenav.scenario.guarantees import MOST_VALUATIONS, Guarantees, Values
from safenav.world.map import Region
from safenav.world.moves import Pose


class Memories(Struct):
    """The memories that a robot may have, the likeliest first; none if too many fit. ``begun``: by
    a strategy, which has chosen among those at the start. ``ahead``: the region to which it is on
    its way, and what it remembers there, if it has got a strategy meanwhile."""

    guarantees: Guarantees
    possible: Sequence[Mapping[str, int]]
    begun: bool = False
    ahead: tuple[Region, Mapping[str, int]] | None = None

    @classmethod
    def at_start(cls, guarantees: Guarantees, pose: Pose) -> Memories:
        """Those with which the objective may begin in a pose."""
        fit = (memory for memory in guarantees.memories if guarantees.begins(memory, pose))
        return cls(guarantees, [*fit])

    @property
    def likeliest(self) -> Mapping[str, int]:
        """The one to continue with; none before the first step."""
        return next(iter(self.possible), {}) if self.begun else {}

    def choose(self, memory: Mapping[str, int], region: Region, here: Region) -> None:
        """Begin with a strategy that remembers that in a region: here, or where the robot is on its
        way."""
        self.begun, self.ahead = True, None if region == here else (region, memory)
        if self.ahead is None:
            self.possible = [memory]

    def step(self, before: Pose, after: Pose, inputs: tuple[Values, Values]) -> None:
        """Follow a step, or a turn in which a strategy has let the robot stay. A step that the
        formulas forbid was made by no strategy: it changes nothing."""
        ahead, self.ahead = self.ahead, None
        if ahead is not None and ahead[0] == after.region:
            self.possible = [ahead[1]]
            return
        found = self._after(self.possible, before, after, inputs)
        self.possible, self.begun = found or self.possible, True

    def stood(self, pose: Pose, *, long: bool) -> None:
        """Note that a robot may have stayed in turns that have no lines. ``long``: time has passed
        since it arrived there, so that it probably has."""
        self.begun = True
        stayed = self._after(self.possible, pose, pose, ({}, {}))
        both = (*stayed, *self.possible) if long else (*self.possible, *stayed)
        self.possible = _different(iter(both))

    def _after(
        self,
        memories: Iterable[Mapping[str, int]],
        before: Pose,
        after: Pose,
        inputs: tuple[Values, Values],
    ) -> list[Mapping[str, int]]:
        return _different(
            new
            for memory in memories
            for new in self.guarantees.after(memory, before, after, inputs)
        )


def _different(memories: Iterator[Mapping[str, int]]) -> list[Mapping[str, int]]:
    """The first so many different memories."""
    found: dict[tuple[tuple[str, int], ...], Mapping[str, int]] = {}
    for memory in memories:
        found.setdefault(tuple(sorted(memory.items())), memory)
        if len(found) == MOST_VALUATIONS:
            break
    return [*found.values()]
