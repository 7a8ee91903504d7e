"""Objectives as automata over regions: what counts when, which target is next, what is forbidden.

One small automaton for each kind. The specification states it in formulas (``spec.objective``),
the runtime counts goals by it (``runtime.progress``), and graph search plays it
(``explain.undisturbed``). The audit has its own, on purpose.

The memory is a number: the target whose turn it is (``patrol``, ``visit``), the set of targets
met in this round as bits (``cover``), nothing (``hold``). Raw formulas (``ltl``) are not such an
automaton: the synthesizer makes theirs.
"""

from __future__ import annotations

from safenav.dataclass import dataclass
from safenav.scenario.objective import Cover, Hold, Patrol, Target, Visit, targets_of
from safenav.world.map import Region


@dataclass(frozen=True)
class Pursuit:
    """The automaton of an objective; its targets are numbered in the objective's order."""

    objective: Patrol | Visit | Cover | Hold

    @property
    def targets(self) -> tuple[Target, ...]:
        return targets_of(self.objective)

    @property
    def in_turn(self) -> bool:
        """Whether the targets count in their order only."""
        return isinstance(self.objective, Patrol | Visit)

    def begin(self, region: Region, memory: int = 0) -> int:
        """The memory of a robot that gets the objective in ``region``, having remembered
        ``memory``. Standing on a target of a patrol settles it: the formula forbids the first
        one with ``scout`` and the second one without (paper, Section VI)."""
        if isinstance(self.objective, Patrol):
            if region in self.objective.second:
                return 1
            if region in self.objective.first:
                return 0
        return memory

    def met(self, memory: int, region: Region) -> tuple[int, ...]:
        """The targets that count for being in ``region``."""
        if self.in_turn:
            return (memory,) if region in self.targets[memory] else ()
        return tuple(i for i, target in enumerate(self.targets) if region in target)

    def turned(self, memory: int, region: Region) -> int:
        """The memory of a robot that leaves ``region``, or stays there."""
        if self.in_turn:
            return (memory + 1) % len(self.targets) if self.met(memory, region) else memory
        if isinstance(self.objective, Hold):
            return memory
        seen = memory | sum(1 << i for i in self.met(memory, region))
        return 0 if seen == (1 << len(self.targets)) - 1 else seen

    def forbidden(self, memory: int, region: Region, after: Region) -> bool:
        """Whether the objective itself forbids the step from ``region`` to ``after``.

        A patrol turns round immediately at its target, and never touches the one whose turn it is
        not; a robot that holds a target stays in it.
        """
        match self.objective:
            case Patrol(first, second):
                now = self.turned(memory, region)
                left = self.targets[memory] if now != memory else frozenset()
                return after in left or after in (first if now == 1 else second)
            case Hold(target):
                return region in target and after != region
            case _:
                return False

    def awaited(self, memory: int) -> Target:
        """The regions of which the robot must reach one next."""
        if self.in_turn:
            return self.targets[memory]
        left = [t for i, t in enumerate(self.targets) if not memory >> i & 1]
        return frozenset().union(*left)
