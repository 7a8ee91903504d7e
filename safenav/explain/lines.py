"""Whole explanation of a specification from a file, line by line."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from safenav.explain.core import find_line_core
from safenav.explain.explanation import Core, LosingPlay, with_guarantees
from safenav.explain.play import losing_play
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

MOST_ASSUMPTIONS = 32
PLAY_SHARE = 0.85
"""Share of the budget by which the play ends."""


class LineExplanation(Struct, frozen=True):
    """Explanation of an unrealizable specification.

    ``fairness``: the lines of ENV_LIVENESS, which it may assume. ``play``: of the core; None where
    the limits did not allow it. ``assumptions``: lines of ENV_LIVENESS, each of which makes it
    realizable."""

    core: Core
    fairness: tuple[Constraint, ...]
    play: LosingPlay | None
    assumptions: tuple[str, ...]


def explain_lines(spec: Specification, synthesizer: Synthesizer) -> LineExplanation:
    """Explain why a specification is unrealizable, as far as the budget allows."""
    ask = Questions(synthesizer)
    core = find_line_core(spec, ask)
    ask.spend(PLAY_SHARE)
    play = losing_play(spec, with_guarantees(spec, core.constraints), ask)
    ask.spend(1.0)
    assumptions = () if core.alone else tuple(_helpful(spec, ask))
    fairness = spec.section(Section.ENV_LIVENESS)
    return LineExplanation(core, fairness, play, assumptions)


def _helpful(spec: Specification, ask: Questions) -> Iterator[str]:
    """Yield assumptions that one Boolean input is on, or off, infinitely often, where this makes
    the specification realizable and does not let the system win by breaking it."""
    inputs = [v.name for v in spec.owned(Owner.INPUT) if v.bounds is None]
    lines = [line for name in inputs for line in (f"{name}'", f"!{name}'")][:MOST_ASSUMPTIONS]
    fair = {line: Constraint(Section.ENV_LIVENESS, line, _TRIED) for line in lines}
    tried = {line: spec.with_more(constraint) for line, constraint in fair.items()}
    ask.prepare(list(tried.values()))
    never = Constraint(Section.SYS_LIVENESS, "FALSE", _TRIED)
    for line, stronger in tried.items():
        if ask.verdict(stronger) is Verdict.REALIZABLE:
            hopeless = stronger.without(spec.section(Section.SYS_LIVENESS)).with_more(never)
            if ask.verdict(hopeless) is Verdict.UNREALIZABLE:
                yield line


_TRIED = Origin("explanation", "tried")
