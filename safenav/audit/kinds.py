"""Kinds of objectives with targets, as the judges see them: one table.

The rules of the audit and the checker of bundles query it and name no kind. Written from
docs/scenario.md, independently of ``safenav.scenario.objective``.
"""

from __future__ import annotations

from typing import NamedTuple


class Shape(NamedTuple):
    """Properties of a kind. ``in_turn``: the targets are met in their order, otherwise in any
    order. ``settles``: the robot stays at its last target, where each tick is a round. ``one``:
    there is a single target, written without a list. ``strict``: the robot leaves a target
    immediately, and touches none out of turn; its weaker form is ``ALTERNATION``. ``known``: the
    kind is in the table."""

    in_turn: bool = False
    settles: bool = False
    one: bool = False
    strict: bool = False
    known: bool = True

    @property
    def ends(self) -> bool:
        """Whether each target is met once, after which the robot stays."""
        return self.settles and self.in_turn

    @property
    def ordered(self) -> bool:
        """Whether the next target is always known."""
        return self.in_turn or self.settles

    @property
    def covers(self) -> bool:
        """Whether each target is met once in a round, in any order."""
        return self.known and not self.ordered

    @property
    def recurs(self) -> bool:
        """Whether the robot meets its targets forever, and each pass through them is a round."""
        return self.known and not self.settles


KINDS = {
    "patrol": Shape(in_turn=True, strict=True),
    "visit": Shape(in_turn=True),
    "cover": Shape(),
    "hold": Shape(settles=True, one=True),
    "once": Shape(in_turn=True, settles=True),
}
_NO_TARGETS = Shape(known=False)
ALTERNATION = "visit"
"""Kind of a helper's objective, and of the weaker form of a strict one."""
STAYING = "hold"
"""Kind of the objective of a robot that waits or charges."""


def shape_of(kind: str) -> Shape:
    """Return the shape of a kind of objective; formulas and unknown kinds get one with ``known``
    False."""
    return KINDS.get(kind, _NO_TARGETS)
