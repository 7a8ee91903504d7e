"""The kinds of objectives about targets, as judges know them: one table.

The rules of the audit and the checker of bundles query it and name no kind. Written from
docs/scenario.md, independently of ``safenav.scenario.objective``."""

from __future__ import annotations

from typing import NamedTuple


class Shape(NamedTuple):
    """``in_turn``: the targets are met in their order; else in any order. ``settles``: at its last
    target the robot stays, and each tick there is a round. ``one``: a single target, which is
    written without a list. ``strict``: the robot leaves a target immediately, and touches none out
    of turn; a weaker form is ``ALTERNATION``. ``known``: the kind is in the table."""

    in_turn: bool = False
    settles: bool = False
    one: bool = False
    strict: bool = False
    known: bool = True

    @property
    def ends(self) -> bool:
        """Whether each target is met once, and then the robot stays."""
        return self.settles and self.in_turn

    @property
    def ordered(self) -> bool:
        """Whether the target that is next is always known."""
        return self.in_turn or self.settles

    @property
    def covers(self) -> bool:
        """Whether each target is met once in a round, in any order."""
        return self.known and not self.ordered

    @property
    def recurs(self) -> bool:
        """Whether its rounds are its targets, met one by one, forever."""
        return self.known and not self.settles


KINDS = {
    "patrol": Shape(in_turn=True, strict=True),
    "circuit": Shape(in_turn=True, strict=True),
    "visit": Shape(in_turn=True),
    "cover": Shape(),
    "hold": Shape(settles=True, one=True),
    "once": Shape(in_turn=True, settles=True),
}
_NO_TARGETS = Shape(known=False)
ALTERNATION = "visit"
"""Kind of a helper's objective, and of the weaker form of a strict one."""
STAYING = "hold"
"""The kind of a robot that waits or charges."""


def shape_of(kind: str) -> Shape:
    """The shape of an objective; formulas, and kinds that are not in the table, have none."""
    return KINDS.get(kind, _NO_TARGETS)
