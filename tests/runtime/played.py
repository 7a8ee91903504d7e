"""A run as its trace tells it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Run:
    """The records of one run's trace, checked by the independent audit."""

    records: list[dict[str, Any]]

    def all(self, kind: str, **fields: object) -> list[dict[str, Any]]:
        """The records of a type whose fields have these values."""
        return [
            r
            for r in self.records
            if r["type"] == kind and all(r.get(k) == v for k, v in fields.items())
        ]

    def one(self, kind: str, **fields: object) -> dict[str, Any]:
        """The only such record."""
        found = self.all(kind, **fields)
        assert len(found) == 1, f"{len(found)} records {kind} {fields}"
        return found[0]

    @property
    def outcome(self) -> dict[str, Any]:
        return self.one("outcome")

    def path(self, robot: str) -> list[int]:
        """Where the robot was after each tick."""
        return [r["to"] for r in self.all("move", robot=robot)]

    def position(self, robot: str, tick: int) -> int:
        return self.path(robot)[tick - 1]

    def order(self, *kinds: str) -> list[tuple[str, Any]]:
        """(type, obstacle) of the records of these types, in order."""
        return [(r["type"], r.get("obstacle")) for r in self.records if r["type"] in kinds]


Runner = Callable[[str], Run]
