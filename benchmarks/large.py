"""Specifications that are large and simple, for what must not grow faster than they do."""

from __future__ import annotations


def long_sum(terms: int, variables: int = 10) -> str:
    """A bound on one sum of many terms, which repeats few variables."""
    names = [f"x{i}" for i in range(variables)]
    line = " + ".join(names[i % variables] for i in range(terms))
    declared = "".join(f"{name}:0...9\n" for name in names)
    return f"[OUTPUT]\n{declared}\n[SYS_TRANS]\n{line} <= {3 * terms}\n"


def pairs(count: int) -> str:
    """So many outputs, each of which repeats an input of its own."""
    every = range(count)
    inputs = "".join(f"i{k}\n" for k in every)
    outputs = "".join(f"o{k}\n" for k in every)
    copies = "".join(f"o{k}' <-> i{k}'\n" for k in every)
    return f"[INPUT]\n{inputs}\n[OUTPUT]\n{outputs}\n[SYS_TRANS]\n{copies}"
