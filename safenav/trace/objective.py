"""An objective as a trace spells it: ``{"visit": [[42, 44], 41]}``."""

from __future__ import annotations

import json
from collections.abc import Mapping

from safenav.dataclass import dataclass


@dataclass(frozen=True)
class Objective:
    """The objective of a robot.

    ``targets``: sets of regions of which any counts, in the objective's own order; none for
    ``ltl`` and for kinds that this version does not know. ``body``: what stands behind the
    kind, as JSON in one spelling, so that equal objectives are equal data. ``literal``: no weaker
    form of a patrol will do.
    """

    kind: str
    targets: tuple[frozenset[int], ...]
    body: str
    literal: bool = False

    @classmethod
    def of(cls, value: object) -> Objective | None:
        """The objective in a JSON value; None if it is none."""
        if not isinstance(value, Mapping):
            return None
        literal = "patrol" in value and value.get("form") == "literal"
        if len(value) != 1 + literal:
            return None
        kind, body = next((k, v) for k, v in value.items() if k != "form" or not literal)
        targets: list[frozenset[int]] = []
        if kind == "hold" or isinstance(body, list):
            listed = [body] if kind == "hold" else body
            if not listed or (kind == "patrol") > (len(listed) == 2):
                return None
            for item in listed:
                regions = item if isinstance(item, list) else [item]
                if not regions or not all(type(region) is int for region in regions):
                    return None
                targets.append(frozenset(regions))
            plain = [_plain(target) for target in targets]
            body = plain[0] if kind == "hold" else plain
        elif kind in ("patrol", "visit", "cover"):
            return None
        try:
            return cls(str(kind), tuple(targets), json.dumps(body, sort_keys=True), literal)
        except (RecursionError, TypeError, ValueError):
            return None

    @property
    def data(self) -> dict[str, object]:
        """The objective as a JSON value."""
        told = {self.kind: json.loads(self.body)}
        return {**told, "form": "literal"} if self.literal else told

    def __str__(self) -> str:
        if not self.targets:
            return f"{self.kind} {self.body}"
        shown = ", ".join("|".join(map(str, sorted(target))) for target in self.targets)
        return f"{self.kind} {shown}"


def _plain(target: frozenset[int]) -> int | list[int]:
    return next(iter(target)) if len(target) == 1 else sorted(target)
