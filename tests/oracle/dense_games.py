"""Random games whose decision diagrams are large for their few bits.

Parities over many variables have no good order, so a symbolic solver has to reorder, collect and
regrow its tables, which the tiny games never make it do; explicit sets do not care.
"""

from random import Random

from oracle.formula import Atom, Binary, Connective, Formula, Not
from oracle.specification import Specification, Variable

_MIXED: tuple[Connective, ...] = ("^", "^", "&", "|")


def dense_game(source: Random, bits: int = 11) -> Specification:
    """A game of exactly `bits` Booleans, two to four of them inputs, declared in any order."""
    inputs = source.randint(2, 4)
    variables = [Variable(f"v{i}", "input" if i < inputs else "output") for i in range(bits)]
    source.shuffle(variables)
    ins = [v.name for v in variables if v.owner == "input"]
    outs = [v.name for v in variables if v.owner == "output"]
    every = ins + outs

    def goals(count: int) -> tuple[Formula, ...]:
        return tuple(mixed(source, every, every, source.choice((1, 2, 4))) for _ in range(count))

    rules: list[Formula] = [
        Binary("->", mixed(source, every, ins, 6), mixed(source, [], outs, 3))
        for _ in range(source.randint(3, 5))
    ]
    rules += [
        Binary("<->", Atom(name, True), mixed(source, every, ins, 5))
        for name in source.sample(outs, 2)
    ]
    return Specification(
        tuple(variables),
        sys_init=(mixed(source, outs, [], 3),),
        env_trans=tuple(
            Binary("->", mixed(source, every, [], 5), mixed(source, [], ins, 2)) for _ in range(2)
        ),
        sys_trans=tuple(rules),
        env_liveness=goals(source.randint(0, 3)),
        sys_liveness=goals(source.randint(1, 4)),
    )


def mixed(source: Random, now: list[str], later: list[str], count: int) -> Formula:
    """A chain of `count` literals, mostly exclusive-or."""
    atoms = [Atom(name) for name in now] + [Atom(name, True) for name in later]

    def literal() -> Formula:
        atom = source.choice(atoms)
        return atom if source.random() < 0.5 else Not(atom)

    formula = literal()
    for _ in range(count - 1):
        formula = Binary(source.choice(_MIXED), formula, literal())
    return formula
