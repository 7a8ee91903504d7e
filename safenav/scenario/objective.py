"""Objectives as data: the task that a robot pursues (DESIGN section 3).

A target is a set of regions, any of which counts. How an objective becomes GR(1) is
``safenav.spec.objective``'s business.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field

from safenav.dataclass import dataclass
from safenav.world.map import Region

Target = frozenset[Region]
"""Regions of which any one counts."""

Word = Callable[[Region | Target], str]
"""The name of a region or of a target (``RegionMap.word``)."""


def number_word(place: Region | Target) -> str:
    """A region's number; the numbers of a target: ``47|58``."""
    return str(place) if isinstance(place, int) else "|".join(map(str, sorted(place)))


@dataclass(frozen=True)
class Patrol:
    """Alternate between two targets by the paper's Patrol formula (Section VI), which also
    forbids to touch the target whose turn it is not. Unless it is to be ``literal``, plain
    alternation will do where the formula cannot be kept (``spec.forms``)."""

    first: Target
    second: Target
    literal: bool = False


@dataclass(frozen=True)
class Visit:
    """Visit the targets in order, forever; passing another target on the way is allowed."""

    targets: tuple[Target, ...]


@dataclass(frozen=True)
class Cover:
    """Visit all targets in any order, forever."""

    targets: tuple[Target, ...]


@dataclass(frozen=True)
class Hold:
    """Go to the target and stay there (the paper's Patrol(s, s))."""

    target: Target


@dataclass(frozen=True)
class Ltl:
    """Guarantees in the structured-slugs language over the robot's own variables
    (``region``, ``heading``) and declared memory.

    ``memory`` maps a name to None (Boolean) or to its (min, max).
    """

    init: tuple[str, ...] = ()
    safety: tuple[str, ...] = ()
    liveness: tuple[str, ...] = ()
    memory: Mapping[str, tuple[int, int] | None] = field(default_factory=dict)

    def __hash__(self) -> int:
        return hash((self.init, self.safety, self.liveness, tuple(sorted(self.memory))))


Objective = Patrol | Visit | Cover | Hold | Ltl


def targets_of(objective: Objective) -> tuple[Target, ...]:
    """The objective's targets in its own order; none for ``ltl``."""
    match objective:
        case Patrol(first, second, _):
            return (first, second)
        case Visit(targets) | Cover(targets):
            return targets
        case Hold(target):
            return (target,)
        case Ltl():
            return ()


def with_targets(objective: Objective, targets: Sequence[Target]) -> Objective:
    """The same objective with other targets, as many as it has."""
    match objective:
        case Patrol():
            return Patrol(targets[0], targets[1], objective.literal)
        case Visit():
            return Visit(tuple(targets))
        case Cover():
            return Cover(tuple(targets))
        case Hold():
            return Hold(targets[0])
        case Ltl():
            return objective


def to_data(objective: Objective) -> dict[str, object]:
    """The objective as it stands in a scenario or a trace, regions as numbers.

    A target of one region is a number, a larger one a sorted list.
    """
    match objective:
        case Patrol(first, second, literal):
            told: dict[str, object] = {"patrol": [_target_data(first), _target_data(second)]}
            return {**told, "form": "literal"} if literal else told
        case Visit(targets):
            return {"visit": [_target_data(t) for t in targets]}
        case Cover(targets):
            return {"cover": [_target_data(t) for t in targets]}
        case Hold(target):
            return {"hold": _target_data(target)}
        case Ltl():
            memory = {n: list(b) if b else "bool" for n, b in objective.memory.items()}
            parts = {
                "init": list(objective.init),
                "safety": list(objective.safety),
                "liveness": list(objective.liveness),
                "memory": memory,
            }
            return {"ltl": {key: value for key, value in parts.items() if value}}


def _target_data(target: Target) -> int | list[int]:
    return next(iter(target)) if len(target) == 1 else sorted(target)


def describe(objective: Objective, word: Word = number_word) -> str:
    """The objective in a few words, for people: ``patrol 58 <-> 28``, or with ``RegionMap.word``
    ``patrol dock <-> ward_a``."""
    match objective:
        case Patrol(first, second, literal):
            strictly = " (form: literal)" if literal else ""
            return f"patrol {word(first)} <-> {word(second)}{strictly}"
        case Visit(targets):
            return "visit " + ", ".join(word(t) for t in targets) + " in turn"
        case Cover(targets):
            return "cover " + ", ".join(word(t) for t in targets)
        case Hold(target):
            return f"hold {word(target)}"
        case Ltl():
            safety, liveness = len(objective.safety), len(objective.liveness)
            return f"meet its formulas ({safety} safety, {liveness} liveness)"


def written(objective: Objective, word: Word = number_word) -> str:
    """The objective as one writes it in a scenario: ``{patrol: [dock, shelf]}``."""

    def target(regions: Target) -> str:
        words = word(regions).split("|")
        return words[0] if len(words) == 1 else f"{{any: [{', '.join(words)}]}}"

    if isinstance(objective, Ltl):
        return json.dumps(to_data(objective))
    kind, *form = to_data(objective)
    listed = [target(regions) for regions in targets_of(objective)]
    told = listed[0] if kind == "hold" else f"[{', '.join(listed)}]"
    return f"{{{kind}: {told}{', form: literal' if form else ''}}}"
