"""Random games in which parts of the environment move independently of each other.

Two groups of inputs, each with rules of its own; what they are at present matters for nothing
else. A symbolic solver may treat such parts one at a time.
"""

from random import Random

from oracle.dense_games import mixed
from oracle.formula import Atom, Binary, Formula
from oracle.specification import Specification, Variable


def independent_game(source: Random) -> Specification:
    """Two parts of two bits, perhaps an input that belongs to none, and two or three outputs."""
    parts = [["p0", "p1"], ["q0", "q1"]]
    shared = ["s"] if source.random() < 0.5 else []
    outs = [f"o{i}" for i in range(source.randint(2, 3 - len(shared)))]
    ins = [*parts[0], *parts[1], *shared]
    variables = [Variable(v, "input") for v in ins] + [Variable(v, "output") for v in outs]
    source.shuffle(variables)
    common = shared + outs

    rules: list[Formula] = [
        Binary("->", mixed(source, [*own, *common], [], 2), mixed(source, [], own, 2))
        for own in parts
        for _ in range(source.randint(0, 2))
    ]
    rules += [  # both bits of a part together
        Binary("|", Atom(own[0], True), Binary("->", Atom(own[1], True), mixed(source, own, [], 2)))
        for own in parts
    ]
    rules += [mixed(source, common, shared, 3) for _ in shared]
    answers: list[Formula] = [
        Binary("->", mixed(source, common, ins, 2), mixed(source, common, outs, 2))
        for _ in range(source.randint(1, 3))
    ]
    answers += [  # moves that the environment should avoid
        Binary("->", mixed(source, ins, ins, 3), mixed(source, [*ins, *outs], ins, 2))
        for _ in range(source.choice((0, 0, 1)))
    ]

    def goals(count: int) -> tuple[Formula, ...]:
        return tuple(mixed(source, common, ins + outs, 2) for _ in range(count))

    return Specification(
        tuple(variables),
        env_init=(mixed(source, ins, [], 2),),
        sys_init=(mixed(source, [*ins, *outs], [], 2),),
        env_trans=tuple(rules),
        sys_trans=tuple(answers),
        env_liveness=goals(source.randint(0, 2)),
        sys_liveness=goals(source.randint(1, 3)),
    )
