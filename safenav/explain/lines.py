"""Whole explanation of a specification from a file, line by line."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from safenav.errors import SafenavError
from safenav.explain.core import find_line_core
from safenav.explain.explanation import Core
from safenav.explain.play import LosingPlay, losing_play
from safenav.explain.realizability import Questions
from safenav.outcome import Verdict
from safenav.spec.specification import (
    Constraint,
    Origin,
    Owner,
    Section,
    Specification,
)
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.strategy import Strategy

MOST_ASSUMPTIONS = 32


class LineExplanation(Struct, frozen=True):
    """Explanation of an unrealizable specification.

    ``fairness``: the lines of ENV_LIVENESS, which it may assume. ``play``: in the environment's
    strategy ``counterstrategy``; both None where the limits did not allow it. ``assumptions``:
    lines of ENV_LIVENESS, each of which makes it realizable."""

    core: Core
    fairness: tuple[Constraint, ...]
    counterstrategy: Strategy | None
    play: LosingPlay | None
    assumptions: tuple[str, ...]


def explain_lines(spec: Specification, synthesizer: Synthesizer) -> LineExplanation:
    """Explain why a specification is unrealizable. The synthesizer's limits hold for each single
    query."""
    ask = Questions(synthesizer)
    core = find_line_core(spec, ask)
    assumptions = () if core.alone else tuple(_helpful(spec, ask))
    try:
        strategy = synthesizer.counterstrategy(spec).strategy
    except SafenavError:
        strategy = None
    play = None if strategy is None else losing_play(spec, strategy)
    fairness = spec.section(Section.ENV_LIVENESS)
    return LineExplanation(core, fairness, strategy, play, assumptions)


def _helpful(spec: Specification, ask: Questions) -> Iterator[str]:
    """Yield assumptions that one Boolean input is on, or off, infinitely often, where this makes
    the specification realizable and does not let the system win by breaking it."""
    inputs = [v.name for v in spec.owned(Owner.INPUT) if v.bounds is None]
    lines = [line for name in inputs for line in (f"{name}'", f"!{name}'")][:MOST_ASSUMPTIONS]
    fair = {line: Constraint(Section.ENV_LIVENESS, line, _TRIED) for line in lines}
    tried = {line: spec.with_more(constraint) for line, constraint in fair.items()}
    ask.prepare(list(tried.values()))
    for line, stronger in tried.items():
        if ask.verdict(stronger) is Verdict.REALIZABLE:
            goals = spec.section(Section.SYS_LIVENESS)
            never = Constraint(Section.SYS_LIVENESS, "FALSE", _TRIED)
            if ask.verdict(stronger.without(goals).with_more(never)) is not Verdict.REALIZABLE:
                yield line


_TRIED = Origin("explanation", "tried")
