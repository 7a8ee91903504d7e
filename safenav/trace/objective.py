"""An objective as a trace spells it: ``{"visit": [[42, 44], 41]}``."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping

ONE_TARGET = ("hold",)
"""Kinds with a single target, so that a list is a set of regions."""
SEVERAL_TARGETS = ("patrol",)
TARGETS = ("patrol", "visit", "cover")
"""Kinds that require a list of targets."""
FORMULAS = "ltl"
_VARIABLE = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,99}")
_LARGEST = 2**31 - 1
EXAMPLE = '{"visit": [3, [5, 6]]}'
"""An objective, for messages and the schema."""


class Objective:
    """The objective of a robot: frozen data, but not a ``Struct``, because its keys are data, too,
    so that msgspec has it made by ``of``.

    ``targets``: sets of regions of which any counts, in the objective's own order; none for ``ltl``
    and for kinds that this version does not know. The list of any other kind holds targets, so that
    a new kind needs no change here. ``body``: the value of the kind as canonical JSON, so that
    equal objectives are equal data. ``literal``: no weaker form is allowed. ``avoid``: regions that
    the robot never enters; ``always``: formulas that each of its steps keeps.
    """

    __slots__ = ("always", "avoid", "body", "kind", "literal", "targets")

    def __init__(
        self,
        kind: str,
        targets: tuple[frozenset[int], ...],
        body: str,
        literal: bool = False,
        avoid: frozenset[int] = frozenset(),
        always: tuple[str, ...] = (),
    ) -> None:
        self.kind = kind
        self.targets = targets
        self.body = body
        self.literal = literal
        self.avoid = avoid
        self.always = always

    def __repr__(self) -> str:
        return f"Objective.of({self.data})"

    def _values(self) -> tuple[object, ...]:
        return self.kind, self.body, self.literal, self.avoid, self.always

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Objective) and self._values() == other._values()

    def __hash__(self) -> int:
        return hash(self._values())

    @classmethod
    def of(cls, value: object) -> Objective | None:
        """The objective in a JSON value; None if it is not an objective."""
        if not isinstance(value, Mapping):
            return None
        literal = value.get("form") == "literal"
        rules = {"avoid", "always"} if len(value) > 1 + literal else set[str]()
        avoid, always = (value.get(key, []) if key in rules else [] for key in ("avoid", "always"))
        if not _all(avoid, int) or not _all(always, str):
            return None
        rest = [(k, v) for k, v in value.items() if k not in rules and (k != "form" or not literal)]
        if len(rest) != 1:
            return None
        ((kind, body),) = rest
        targets: list[frozenset[int]] = []
        if kind in ONE_TARGET or isinstance(body, list):
            listed = [body] if kind in ONE_TARGET else body
            if not listed or (kind in SEVERAL_TARGETS) > (len(listed) >= 2):
                return None
            for item in listed:
                regions = item if isinstance(item, list) else [item]
                if not regions or not all(type(region) is int for region in regions):
                    return None
                targets.append(frozenset(regions))
            plain = [_plain(target) for target in targets]
            body = plain[0] if kind in ONE_TARGET else plain
        elif kind in TARGETS or (kind == FORMULAS and not _are_formulas(body)):
            return None
        try:
            spelled = json.dumps(body, sort_keys=True)
            data = literal, frozenset(avoid), tuple(always)
            return cls(str(kind), tuple(targets), spelled, *data)
        except (RecursionError, TypeError, ValueError):
            return None

    @property
    def data(self) -> dict[str, object]:
        """The objective as a JSON value."""
        data = {self.kind: json.loads(self.body), "form": "literal" if self.literal else None}
        data |= {"avoid": sorted(self.avoid), "always": list(self.always)}
        return {key: value for key, value in data.items() if value or key == self.kind}

    def __str__(self) -> str:
        shown = ", ".join("|".join(map(str, sorted(target))) for target in self.targets)
        text = f"{self.kind} {shown or self.body}"
        if self.avoid:
            text += f", never in {', '.join(map(str, sorted(self.avoid)))}"
        return text + "".join(f", always {formula}" for formula in self.always)


def _are_formulas(body: object) -> bool:
    """Whether a value has formulas only (``init``, ``safety``, ``liveness``), with the ``memory``
    and the ``inputs`` that they name."""
    if not isinstance(body, Mapping):
        return body is None
    memory = body.get("memory") or {}
    listed = [body.get(key) or [] for key in ("init", "safety", "liveness", "inputs")]
    if not isinstance(memory, Mapping) or not all(
        isinstance(x, str) or _all(x, str) for x in listed
    ):
        return False
    inputs = [listed[-1]] if isinstance(listed[-1], str) else listed[-1]
    named = all(_VARIABLE.fullmatch(name) for name in (*memory, *inputs))
    return named and all(kind == "bool" or _is_range(kind) for kind in memory.values())


def _is_range(value: object) -> bool:
    if not isinstance(value, list) or len(value) != 2 or not _all(value, int):
        return False
    return bool(-_LARGEST <= value[0] <= value[1] <= _LARGEST)


def _all(listed: object, kind: type) -> bool:
    return isinstance(listed, list) and all(type(item) is kind for item in listed)


def _plain(target: frozenset[int]) -> int | list[int]:
    return next(iter(target)) if len(target) == 1 else sorted(target)
