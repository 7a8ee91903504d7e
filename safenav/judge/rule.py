"""The table of rules, and their messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from safenav.judge.lines import Line
from safenav.judge.state import State


class NotJudged(str):
    """A part that a rule cannot judge, and why."""


Judge = Callable[[Line, State], Iterator[str]]


class Rule(NamedTuple):
    """``kinds``: the types of lines that it judges. ``text``: what it requires, for people."""

    name: str
    kinds: tuple[str, ...]
    judge: Judge
    text: str


RULES: list[Rule] = []
STEPS = ("move", "depart", "arrive")


def rule(*kinds: str) -> Callable[[Judge], Judge]:
    """Add a function to the table; its docstring is the documentation of the rule."""

    def add(judge: Judge) -> Judge:
        name = judge.__name__.replace("_", "-")
        RULES.append(Rule(name, kinds, judge, " ".join((judge.__doc__ or "").split())))
        return judge

    return add
