"""Lines of a trace, and parts of its header, as objects with the fields of docs/trace.md."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import takewhile
from types import SimpleNamespace
from typing import Any, NamedTuple

from safenav.audit.kinds import shape_of
from safenav.audit.needs import Need, OpenObstacle

Line = Any
"""A line of a trace, with its ``type``; a missing field is None or its default (docs/trace.md)."""

_NAMED = (
    *("again", "asked", "beliefs", "bids", "busy", "due", "inputs", "knowledge", "memory", "met"),
    *("nodes", "objectives", "others_targets", "refused", "results", "robots", "rounds"),
    *("unrealizable", "values", "waited", "waiting", "within"),
)
"""Fields whose value may be a mapping from names."""
_SETS = ("blocks", "capabilities", "conflicts")


class Made(SimpleNamespace):
    """A line, or a part of one; a missing field is None. Two lines that differ only in their number
    are equal, as in ``safenav.trace``."""

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Made):
            return NotImplemented
        return {**vars(self), "line": 0} == {**vars(other), "line": 0}

    def __getattr__(self, name: str) -> None:
        """Return None for a missing field."""


class Objective(NamedTuple):
    """An objective. ``targets``: sets of regions, any of which counts; ``body``: its JSON in a
    normal form; ``literal``: a weaker form does not suffice; ``avoid``, ``always``: its safety
    rules."""

    kind: str
    targets: tuple[frozenset[int], ...]
    body: str
    literal: bool = False
    avoid: frozenset[int] = frozenset()
    always: tuple[str, ...] = ()

    def __str__(self) -> str:
        shown = ", ".join("|".join(map(str, sorted(target))) for target in self.targets)
        never = f", never in {', '.join(map(str, sorted(self.avoid)))}" if self.avoid else ""
        rest = "".join(f", always {formula}" for formula in self.always)
        return f"{self.kind} {shown or self.body}{never}{rest}"


class Obstacle(Made):
    """An obstacle of the header, or one that a line describes. ``all_needs``: its needs in order,
    even if there is only one."""

    @classmethod
    def of(cls, stated: Line, robots: Mapping[str, Line]) -> Obstacle:
        one = Made(action=stated.action, regions=stated.resolution_regions)
        listed, needs = stated.needs or (one,), list[Need]()
        for k, need in enumerate(listed):
            chain = (need, *takewhile(lambda other: other.same, listed[k + 1 :]))
            actions = {each.action for each in chain}
            able = frozenset(n for n, robot in robots.items() if actions <= robot.capabilities)
            how = need.robots or 1, bool(need.together), bool(need.same)
            needs.append(Need(able, frozenset(need.regions), *how, need.action))
        fields = ("name", "region", "blocks", "traversable", "from_", "until", "resolve_within")
        about = {name: getattr(stated, name) for name in (*fields, "ordered", "type")}
        return cls(all_needs=tuple(needs), **about)

    def opened(self) -> OpenObstacle:
        """Return the obstacle with no need met."""
        number = self.name.partition("#")[2]
        order = self.type, self.region, int(number) if number.isdecimal() else 1
        about = self.name, self.region, frozenset(self.blocks), self.all_needs
        return OpenObstacle(*about, order=order)


def proof_of(line: Line) -> Mapping[str, Any] | None:
    """Return the proof in a line, as in the file; None if there is none."""
    return line.proof if isinstance(line.proof, Mapping) else None


def read_line(data: Mapping[str, Any], number: int) -> Line:
    """Return a line of the file (``data``) as an object."""
    line = _read(data, "")
    if line.type == "belief":
        line.regions = frozenset(line.regions)
    elif line.type == "blocked":
        line.robots = frozenset(line.robots)
    line.line, line.data = number, data
    return line


def _read(value: Any, key: str) -> Any:
    if isinstance(value, list):
        items = (_read(item, "") for item in value)
        return frozenset(items) if key in _SETS else tuple(items)
    if not isinstance(value, dict) or key == "proof":
        return value
    if key in ("objective", "while_waiting"):
        return read_objective(value)
    if key in _NAMED:
        inner = {"objectives": "objective", "asked": "asked"}.get(key, "")
        return {name: _read(item, inner) for name, item in value.items()}
    fields = {"from_" if k == "from" else k: _read(item, k) for k, item in value.items()}
    return Made(**fields)


def read_objective(data: Mapping[str, Any]) -> Objective:
    """Return an objective of the file as an object."""
    literal = data.get("form") == "literal"
    rest = {k: v for k, v in data.items() if k not in ("avoid", "always", "form")}
    ((kind, body),) = rest.items()
    targets: list[frozenset[int]] = []
    one = shape_of(kind).one
    if one or isinstance(body, list):
        listed = [body] if one else body
        targets = [frozenset(item if isinstance(item, list) else [item]) for item in listed]
        plain = [next(iter(one)) if len(one) == 1 else sorted(one) for one in targets]
        body = plain[0] if one else plain
    spelled = json.dumps(body, sort_keys=True)
    rules = frozenset(data.get("avoid", ())), tuple(data.get("always", ()))
    return Objective(kind, tuple(targets), spelled, literal, *rules)
