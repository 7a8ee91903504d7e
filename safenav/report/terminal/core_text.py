"""Claims about an unrealizable core, in words: only those that were proven."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from safenav.explain.explanation import Core, CoreMember

_NAMED = 3


def core_heading(core: Core) -> str:
    """Return the line above the members of a core."""
    if len(core.members) == 1:
        more = "; without it, the rest is realizable" if core.decisive else ""
        return f"This guarantee cannot be kept{more}:"
    if core.decisive:
        return "These guarantees conflict; without any one of them, the rest is realizable:"
    if core.minimal:
        return "These guarantees conflict; without any one of them, the others do not:"
    return "These guarantees conflict:"


def core_notes(core: Core, others: str, name: Callable[[CoreMember], str]) -> Iterator[str]:
    """Yield notes on a core. ``others``: who could cooperate; ``name``: a member in words."""
    if core.together and core.all_together:
        yield f"(realizable if {others} cooperated)"
    elif core.together:
        yield f"(these alone are realizable if {others} cooperated)"
    if not core.minimal:
        yield "(some checks timed out: the core may not be minimal)"
    if core.vain:
        without = " or without ".join(map(name, core.vain))
        if len(core.vain) > _NAMED:
            which = "" if len(core.vain) == len(core.members) else f" of {len(core.vain)}"
            without = f"any one{which} of them"
        yield f"(another conflict remains: still unrealizable without {without})"
