"""Random games as specifications in structured slugs."""

from random import Random

from oracle import Specification, inputs_first, random_specification
from oracle.rendering import infix
from oracle.specification import SECTIONS


def random_game(seed: int) -> Specification:
    source = Random(seed)
    return inputs_first(random_specification(source, integers=seed % 3 == 0, bits=3 + seed % 4))


def text_of(specification: Specification, source: Random) -> str:
    """A specification as structured slugs, in infix notation."""
    lines = []
    for owner in ("input", "output"):
        lines.append(f"[{owner.upper()}]")
        for variable in specification.variables:
            bounds = "" if variable.range is None else ":{}...{}".format(*variable.range)
            lines += [f"{variable.name}{bounds}"] * (variable.owner == owner)
    for section in SECTIONS:
        lines.append(f"[{section.upper()}]")
        lines += [infix(formula, source) for formula in specification.section(section)]
    return "\n".join(lines) + "\n"
