"""Random specifications, small enough for brute force, and unusual enough to find errors.

Some have no inputs, no outputs, no goals or contradictions; most have a few constraints that
leave both players some freedom, so that both verdicts are frequent and strategies have loops. Games
of parities have large decision diagrams for their few bits: no order of their variables is good.
"""

from dataclasses import dataclass
from random import Random

from oracle import formula
from oracle.specification import Specification, Variable

_NAMES = ("a", "b", "c", "go", "x_1", "y2", "Done", "in_put")
_CONNECTIVES: tuple[formula.Connective, ...] = ("&", "|", "|", "^", "->", "<->")
_RELATIONS: tuple[formula.Relation, ...] = ("=", "!=", "<", "<=", ">", ">=")


@dataclass(frozen=True)
class Vocabulary:
    """What a formula may mention: variables now, and variables after the transition."""

    now: tuple[Variable, ...]
    later: tuple[Variable, ...]


def random_specification(
    source: Random, integers: bool = False, bits: int = 5, many_goals: bool = False
) -> Specification:
    """A specification of at most `bits` bits; with integers it can only be written infix."""
    assumptions = (3, 4, 6) if many_goals else (0, 1, 1, 2, 3, 4)
    guarantees = (6, 7, 9) if many_goals else (0, 1, 1, 2, 2, 3, 5)
    variables = _variables(source, integers, bits)
    inputs = tuple(v for v in variables if v.owner == "input")
    outputs = tuple(v for v in variables if v.owner == "output")
    env = Vocabulary(variables, inputs)
    system = Vocabulary(variables, variables)
    return Specification(
        variables,
        env_init=_conjuncts(source, Vocabulary(inputs, ()), (0, 0, 1, 2)),
        sys_init=_conjuncts(source, Vocabulary(variables, ()), (0, 0, 1, 2)),
        env_trans=_steps(source, env, inputs, (0, 0, 1, 1, 2)),
        sys_trans=_steps(source, system, outputs, (0, 1, 1, 2, 2, 3)),
        env_liveness=_goals(source, env, system, assumptions),
        sys_liveness=_goals(source, system, system, guarantees),
    )


def deep_formulas(source: Random, integers: bool, depth: int = 5) -> Specification:
    """Return few but deep constraints, for tests of the readers."""
    variables = _variables(source, integers, 5)
    everything = Vocabulary(variables, variables)
    inputs = tuple(v for v in variables if v.owner == "input")
    return Specification(
        variables,
        sys_init=(_tree(source, Vocabulary(variables, ()), depth),),
        env_trans=(_tree(source, Vocabulary(variables, inputs), depth),),
        sys_trans=(_tree(source, everything, depth),),
        sys_liveness=(_tree(source, everything, depth),),
    )


def dense_game(source: Random) -> Specification:
    """A game of eleven Booleans, two to four of them inputs, for which a symbolic solver has to
    reorder, collect and regrow its tables; explicit sets do not care."""
    inputs = source.randint(2, 4)
    ins, outs = [f"v{i}" for i in range(inputs)], [f"v{i}" for i in range(inputs, 11)]
    every = ins + outs

    def goals(count: int) -> tuple[formula.Formula, ...]:
        return tuple(_parity(source, every, every, source.choice((1, 2, 4))) for _ in range(count))

    rules: list[formula.Formula] = [
        _implies(_parity(source, every, ins, 6), _parity(source, [], outs, 3))
        for _ in range(source.randint(3, 5))
    ]
    rules += [
        formula.Binary("<->", formula.Atom(name, True), _parity(source, every, ins, 5))
        for name in source.sample(outs, 2)
    ]
    return Specification(
        _shuffled(source, ins, outs),
        sys_init=(_parity(source, outs, [], 3),),
        env_trans=tuple(
            _implies(_parity(source, every, [], 5), _parity(source, [], ins, 2)) for _ in range(2)
        ),
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

    rules: list[formula.Formula] = [
        _implies(_parity(source, [*own, *common], [], 2), _parity(source, [], own, 2))
        for own in parts
        for _ in range(source.randint(0, 2))
    ]
    for own in parts:  # both bits of a part together
        first, second = (formula.Atom(name, True) for name in own)
        rules.append(formula.Binary("|", first, _implies(second, _parity(source, own, [], 2))))
    rules += [_parity(source, common, shared, 3) for _ in shared]
    answers: list[formula.Formula] = [
        _implies(_parity(source, common, ins, 2), _parity(source, common, outs, 2))
        for _ in range(source.randint(1, 3))
    ]
    answers += [  # moves that the environment should avoid
        _implies(_parity(source, ins, ins, 3), _parity(source, [*ins, *outs], ins, 2))
        for _ in range(source.choice((0, 0, 1)))
    ]

    def goals(count: int) -> tuple[formula.Formula, ...]:
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


def _implies(left: formula.Formula, right: formula.Formula) -> formula.Formula:
    return formula.Binary("->", left, right)


def _shuffled(source: Random, ins: list[str], outs: list[str]) -> tuple[Variable, ...]:
    variables = [*(Variable(v, "input") for v in ins), *(Variable(v, "output") for v in outs)]
    source.shuffle(variables)
    return tuple(variables)


def _parity(source: Random, now: list[str], later: list[str], count: int) -> formula.Formula:
    """A chain of ``count`` literals, mostly exclusive-or."""
    atoms = [formula.Atom(name) for name in now] + [formula.Atom(name, True) for name in later]

    def literal() -> formula.Formula:
        atom = source.choice(atoms)
        return atom if source.random() < 0.5 else formula.Not(atom)

    chain = literal()
    for _ in range(count - 1):
        chain = formula.Binary(source.choice(("^", "^", "&", "|")), chain, literal())
    return chain


def _variables(source: Random, integers: bool, bits: int) -> tuple[Variable, ...]:
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
        variable = Variable(name, "input" if owner == "input" else "output", limits)
        if len(variable.bits) <= left:
            left -= len(variable.bits)
            variables.append(variable)
    if integers:  # a structuredslugs file cannot declare in another order
        variables.sort(key=lambda v: v.owner != "input")
    return tuple(variables)


def _conjuncts(
    source: Random, vocabulary: Vocabulary, counts: tuple[int, ...]
) -> tuple[formula.Formula, ...]:
    return tuple(_tree(source, vocabulary, 2) for _ in range(source.choice(counts)))


def _steps(
    source: Random,
    vocabulary: Vocabulary,
    own: tuple[Variable, ...],
    counts: tuple[int, ...],
) -> tuple[formula.Formula, ...]:
    """Constraints on the own next values: rarely so tight that no player can move."""
    steps = []
    for _ in range(source.choice(counts)):
        target = Vocabulary((), own)
        if not own or source.random() < 0.1:
            steps.append(_tree(source, vocabulary, 2))
        elif source.random() < 0.3:
            steps.append(formula.Binary("<->", _leaf(source, target), _tree(source, vocabulary, 1)))
        else:
            guard = _tree(source, vocabulary, 1)
            steps.append(formula.Binary("|", formula.Not(guard), _tree(source, target, 1)))
    return tuple(steps)


def _goals(
    source: Random, vocabulary: Vocabulary, wider: Vocabulary, counts: tuple[int, ...]
) -> tuple[formula.Formula, ...]:
    return tuple(
        _tree(source, wider if source.random() < 0.4 else vocabulary, source.choice((0, 0, 1, 2)))
        for _ in range(source.choice(counts))
    )


def _tree(source: Random, vocabulary: Vocabulary, depth: int) -> formula.Formula:
    if depth == 0 or source.random() < 0.2:
        return _leaf(source, vocabulary)
    shape = source.random()
    if shape < 0.15:
        return formula.Not(_tree(source, vocabulary, depth - 1))
    if shape < 0.25 and vocabulary.later:
        return formula.Next(_tree(source, Vocabulary(vocabulary.later, ()), depth - 1))
    return formula.Binary(
        source.choice(_CONNECTIVES),
        _tree(source, vocabulary, depth - 1),
        _tree(source, vocabulary, depth - 1),
    )


def _leaf(source: Random, vocabulary: Vocabulary) -> formula.Formula:
    choices = [(v, False) for v in vocabulary.now] + [(v, True) for v in vocabulary.later]
    if not choices or source.random() < 0.03:
        return source.choice(
            (formula.TRUE, formula.TRUE, formula.TRUE, formula.TRUE, formula.TRUE, formula.FALSE)
        )
    variable, primed = source.choice(choices)
    if variable.range is not None:
        return _comparison(source, choices, formula.Number(variable.name, primed), variable.range)
    atom = formula.Atom(variable.name, primed)
    return formula.Not(atom) if source.random() < 0.5 else atom


def _comparison(
    source: Random,
    choices: list[tuple[Variable, bool]],
    number: formula.Number,
    limits: tuple[int, int],
) -> formula.Compare:
    numbers = [formula.Number(v.name, primed) for v, primed in choices if v.range is not None]
    left: tuple[formula.Number, ...] = (number,)
    right: tuple[formula.Number, ...] = (formula.Number(source.randint(*limits)),)
    if source.random() < 0.4:
        right = (source.choice(numbers),)
    if source.random() < 0.3:
        extra = source.choice(
            (formula.Number(1), formula.Number(source.randint(0, 3)), source.choice(numbers))
        )
        if source.random() < 0.5:
            left = (*left, extra)
        else:
            right = (*right, extra)
    return formula.Compare(source.choice(_RELATIONS), left, right)
