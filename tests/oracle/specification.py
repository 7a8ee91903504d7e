"""A specification as the oracle sees it: declared variables and six lists of formulas."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from oracle.formula import Formula, is_boolean

Owner = Literal["input", "output"]


@dataclass(frozen=True)
class Variable:
    """A Boolean (no range) or an integer with `low <= value <= high`."""

    name: str
    owner: Owner
    range: tuple[int, int] | None = None

    @property
    def bits(self) -> tuple[str, ...]:
        """Names of its bits, least significant first (`x@0.min.max`, `x@1`, ...)."""
        if self.range is None:
            return (self.name,)
        low, high = self.range
        count = (high - low).bit_length()
        return tuple(
            f"{self.name}@0.{low}.{high}" if i == 0 else f"{self.name}@{i}" for i in range(count)
        )


@dataclass(frozen=True)
class Specification:
    """Variables in declaration order, which fixes the lexicographic order of states."""

    variables: tuple[Variable, ...]
    env_init: tuple[Formula, ...] = ()
    sys_init: tuple[Formula, ...] = ()
    env_trans: tuple[Formula, ...] = ()
    sys_trans: tuple[Formula, ...] = ()
    env_liveness: tuple[Formula, ...] = ()
    sys_liveness: tuple[Formula, ...] = ()

    @property
    def bits(self) -> tuple[str, ...]:
        """In the order in which a strategy prints them."""
        return tuple(bit for variable in self.variables for bit in variable.bits)

    def is_boolean(self) -> bool:
        """Whether it can be written in slugsin as it stands."""
        return all(v.range is None for v in self.variables) and all(
            is_boolean(f) for section in SECTIONS for f in self.section(section)
        )

    def section(self, name: Section) -> tuple[Formula, ...]:
        formulas: tuple[Formula, ...] = getattr(self, name)
        return formulas


Section = Literal["env_init", "sys_init", "env_trans", "sys_trans", "env_liveness", "sys_liveness"]
SECTIONS: tuple[Section, ...] = (
    "env_init",
    "sys_init",
    "env_trans",
    "sys_trans",
    "env_liveness",
    "sys_liveness",
)
