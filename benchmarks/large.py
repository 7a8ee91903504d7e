"""Specifications that are large and simple, for what must not grow faster than they do."""

from random import Random


def long_sum(terms: int, variables: int = 10) -> str:
    """A bound on one sum of many terms, which repeats few variables."""
    names = [f"x{i}" for i in range(variables)]
    line = " + ".join(names[i % variables] for i in range(terms))
    declared = "".join(f"{name}:0...9\n" for name in names)
    return f"[OUTPUT]\n{declared}\n[SYS_TRANS]\n{line} <= {3 * terms}\n"


def pairs(count: int) -> str:
    """This many outputs, each of which repeats an input of its own."""
    every = range(count)
    inputs = "".join(f"i{k}\n" for k in every)
    outputs = "".join(f"o{k}\n" for k in every)
    copies = "".join(f"o{k}' <-> i{k}'\n" for k in every)
    return f"[INPUT]\n{inputs}\n[OUTPUT]\n{outputs}\n[SYS_TRANS]\n{copies}"


def literals(megabytes: int, variables: int = 5000) -> str:
    """Conjunctions of a thousand random literals, in slugsin, until the text is so long.

    They contradict each other, so what it takes is to read them.
    """
    names = [f"x{k}" for k in range(variables)]
    literals = [sign + name + prime for name in names for sign in ("", "! ") for prime in ("", "'")]
    random = Random(0)
    lines, size = [], 0
    while size < megabytes * 1_000_000:
        *most, last = random.choices(literals, k=1000)
        lines.append("".join(f"& {literal} " for literal in most) + last + "\n")
        size += len(lines[-1])
    declared = [name + "\n" for name in names]
    half = variables // 2
    inputs, outputs = "".join(declared[:half]), "".join(declared[half:])
    return f"[INPUT]\n{inputs}\n[OUTPUT]\n{outputs}\n[SYS_TRANS]\n{''.join(lines)}"
