"""Results of a search for a joint plan: a plan, a proof that there is none, or no verdict."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from safenav.runtime.traffic.joint import Joint


class Found(Struct, frozen=True):
    """A plan: the joint states from the first to the last."""

    states: tuple[Joint, ...]


class Exhausted(Struct, frozen=True):
    """No plan exists: these are all states that can be reached."""

    states: frozenset[Joint]


class Spent(Struct, frozen=True):
    """The budget is exhausted: no verdict."""

    states: int


Answer = Found | Exhausted | Spent


def way_to(before: Mapping[Joint, Joint | None], last: Joint) -> Found:
    """The plan that ends in a state, of the state before each."""
    way = []
    state: Joint | None = last
    while state is not None:
        way.append(state)
        state = before[state]
    return Found(tuple(reversed(way)))
