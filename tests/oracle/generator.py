"""Random specifications, small enough for brute force, and unusual enough to find errors.

Some have no inputs, no outputs, no goals or contradictions; most have a few constraints that
leave both players some freedom, so that both verdicts are frequent and strategies have loops. Games
of parities have large decision diagrams for their few bits: no order of their variables is good.
"""

from collections.abc import Sequence
from random import Random

from oracle.specification import (
    Atom,
    Compare,
    Constant,
    Formula,
    Number,
    Specification,
    Variable,
    apply,
)

_NAMES = ("a", "b", "c", "go", "x_1", "y2", "Done", "in_put")
_CONNECTIVES = ("&", "|", "|", "^", "->", "<->")
_RELATIONS = ("=", "!=", "<", "<=", ">", ">=")

Place = tuple[Variable, bool]
"""A variable now, or (True) after the transition: what a formula may mention."""


def _now(variables: Sequence[Variable]) -> list[Place]:
    return [(variable, False) for variable in variables]


def _later(variables: Sequence[Variable]) -> list[Place]:
    return [(variable, True) for variable in variables]


def random_specification(
    source: Random, integers: bool = False, bits: int = 5, many_goals: bool = False
) -> Specification:
    """A specification of at most `bits` bits; with integers it can only be written infix."""
    variables, inputs, outputs = _variables(source, integers, bits)
    env = [*_now(variables), *_later(inputs)]
    every = [*_now(variables), *_later(variables)]

    def conjuncts(places: list[Place]) -> tuple[Formula, ...]:
        return tuple(_tree(source, places, 2) for _ in range(source.choice((0, 0, 1, 2))))

    def steps(
        places: list[Place], own: list[Variable], counts: tuple[int, ...]
    ) -> tuple[Formula, ...]:
        count = source.choice(counts)
        return tuple(_step(source, places, _later(own)) for _ in range(count))

    def goals(places: list[Place], counts: tuple[int, ...]) -> tuple[Formula, ...]:
        return tuple(
            _tree(source, every if source.random() < 0.4 else places, source.choice((0, 0, 1, 2)))
            for _ in range(source.choice(counts))
        )

    return Specification(
        tuple(variables),
        env_init=conjuncts(_now(inputs)),
        sys_init=conjuncts(_now(variables)),
        env_trans=steps(env, inputs, (0, 0, 1, 1, 2)),
        sys_trans=steps(every, outputs, (0, 1, 1, 2, 2, 3)),
        env_liveness=goals(env, (3, 4, 6) if many_goals else (0, 1, 1, 2, 3, 4)),
        sys_liveness=goals(every, (6, 7, 9) if many_goals else (0, 1, 1, 2, 2, 3, 5)),
    )


def deep_formulas(source: Random, integers: bool, depth: int = 5) -> Specification:
    """Return few but deep constraints, for tests of the readers."""
    variables, inputs, _ = _variables(source, integers, 5)
    now = _now(variables)
    places = (now, [*now, *_later(inputs)], [*now, *_later(variables)], [*now, *_later(variables)])
    names = ("sys_init", "env_trans", "sys_trans", "sys_liveness")
    drawn = [(_tree(source, each, depth),) for each in places]
    return Specification(tuple(variables), **dict(zip(names, drawn, strict=True)))


def dense_game(source: Random) -> Specification:
    """A game of eleven Booleans, two to four of them inputs, for which a symbolic solver has to
    reorder, collect and regrow its tables; explicit sets do not care."""
    inputs = source.randint(2, 4)
    ins, outs = [f"v{i}" for i in range(inputs)], [f"v{i}" for i in range(inputs, 11)]
    every = ins + outs

    def goals(count: int) -> tuple[Formula, ...]:
        return tuple(_parity(source, every, every, source.choice((1, 2, 4))) for _ in range(count))

    rules: list[Formula] = [
        apply("->", _parity(source, every, ins, 6), _parity(source, [], outs, 3))
        for _ in range(source.randint(3, 5))
    ]
    rules += [
        apply("<->", Atom(name, True), _parity(source, every, ins, 5))
        for name in source.sample(outs, 2)
    ]
    moves = (
        apply("->", _parity(source, every, [], 5), _parity(source, [], ins, 2)) for _ in range(2)
    )
    return Specification(
        _shuffled(source, ins, outs),
        sys_init=(_parity(source, outs, [], 3),),
        env_trans=tuple(moves),
        sys_trans=tuple(rules),
        env_liveness=goals(source.randint(0, 3)),
        sys_liveness=goals(source.randint(1, 4)),
    )


def independent_game(source: Random) -> Specification:
    """Two parts of the environment of two bits, each with rules of its own, that a symbolic solver
    may treat one at a time; perhaps an input that belongs to none, and two or three outputs."""
    parts = [["p0", "p1"], ["q0", "q1"]]
    shared = ["s"] if source.random() < 0.5 else []
    outs = [f"o{i}" for i in range(source.randint(2, 3 - len(shared)))]
    ins, common = [*parts[0], *parts[1], *shared], shared + outs

    rules: list[Formula] = [
        apply("->", _parity(source, [*own, *common], [], 2), _parity(source, [], own, 2))
        for own in parts
        for _ in range(source.randint(0, 2))
    ]
    for own in parts:  # both bits of a part together
        first, second = (Atom(name, True) for name in own)
        rules.append(apply("|", first, apply("->", second, _parity(source, own, [], 2))))
    rules += [_parity(source, common, shared, 3) for _ in shared]
    answers: list[Formula] = [
        apply("->", _parity(source, common, ins, 2), _parity(source, common, outs, 2))
        for _ in range(source.randint(1, 3))
    ]
    answers += [  # moves that the environment should avoid
        apply("->", _parity(source, ins, ins, 3), _parity(source, [*ins, *outs], ins, 2))
        for _ in range(source.choice((0, 0, 1)))
    ]

    def goals(count: int) -> tuple[Formula, ...]:
        return tuple(_parity(source, common, ins + outs, 2) for _ in range(count))

    return Specification(
        _shuffled(source, ins, outs),
        env_init=(_parity(source, ins, [], 2),),
        sys_init=(_parity(source, [*ins, *outs], [], 2),),
        env_trans=tuple(rules),
        sys_trans=tuple(answers),
        env_liveness=goals(source.randint(0, 2)),
        sys_liveness=goals(source.randint(1, 3)),
    )


def _shuffled(source: Random, ins: list[str], outs: list[str]) -> tuple[Variable, ...]:
    variables = [*(Variable(v, "input") for v in ins), *(Variable(v, "output") for v in outs)]
    source.shuffle(variables)
    return tuple(variables)


def _parity(source: Random, now: list[str], later: list[str], count: int) -> Formula:
    """A chain of ``count`` literals, mostly exclusive-or."""
    atoms = [Atom(name) for name in now] + [Atom(name, True) for name in later]
    chain = _literal(source, source.choice(atoms))
    for _ in range(count - 1):
        operator = source.choice(("^", "^", "&", "|"))
        chain = apply(operator, chain, _literal(source, source.choice(atoms)))
    return chain


def _literal(source: Random, atom: Atom) -> Formula:
    return atom if source.random() < 0.5 else apply("!", atom)


def _variables(
    source: Random, integers: bool, bits: int
) -> tuple[list[Variable], list[Variable], list[Variable]]:
    """All, the inputs (of three bits at most, or one integer more), and the outputs."""
    variables: list[Variable] = []
    left = source.choice((bits, bits, bits - 1, source.randint(0, bits)))
    for name in source.sample(_NAMES, 6):
        owner = source.choice(("input", "output"))
        if owner == "input" and sum(len(v.bits) for v in variables if v.owner == "input") >= 3:
            continue
        limits = None
        if integers and source.random() < 0.6:
            low = source.choice((0, 0, 0, 1, 3))
            limits = (low, low + source.choice((0, 1, 2, 2, 3, 3, 4)))
        variable = Variable(name, owner, limits)
        if len(variable.bits) <= left:
            left -= len(variable.bits)
            variables.append(variable)
    if integers:  # a structuredslugs file cannot declare in another order
        variables.sort(key=lambda v: v.owner != "input")
    inputs, outputs = ([v for v in variables if v.owner == own] for own in ("input", "output"))
    return variables, inputs, outputs


def _step(source: Random, places: list[Place], own: list[Place]) -> Formula:
    """A constraint on the own next values: rarely so tight that no player can move."""
    if not own or source.random() < 0.1:
        return _tree(source, places, 2)
    if source.random() < 0.3:
        return apply("<->", _leaf(source, own), _tree(source, places, 1))
    return apply("|", apply("!", _tree(source, places, 1)), _tree(source, own, 1))


def _tree(source: Random, places: list[Place], depth: int) -> Formula:
    if depth == 0 or source.random() < 0.2:
        return _leaf(source, places)
    shape, later = source.random(), [(variable, False) for variable, primed in places if primed]
    if shape < 0.15:
        return apply("!", _tree(source, places, depth - 1))
    if shape < 0.25 and later:
        return apply("next", _tree(source, later, depth - 1))
    operands = [_tree(source, places, depth - 1) for _ in range(2)]
    return apply(source.choice(_CONNECTIVES), *operands)


def _leaf(source: Random, places: list[Place]) -> Formula:
    if not places or source.random() < 0.03:
        return Constant(source.random() < 5 / 6)
    variable, primed = source.choice(places)
    if variable.range is None:
        return _literal(source, Atom(variable.name, primed))
    numbers = [Number(v.name, primed) for v, primed in places if v.range is not None]
    sides = [[Number(variable.name, primed)], [Number(source.randint(*variable.range))]]
    if source.random() < 0.4:
        sides[1] = [source.choice(numbers)]
    if source.random() < 0.3:
        few = (Number(1), Number(source.randint(0, 3)), source.choice(numbers))
        source.choice(sides).append(source.choice(few))
    return Compare(source.choice(_RELATIONS), *map(tuple, sides))
