"""The robotic mission patterns of docs/patterns.md: each as the page writes it, judged by an
evaluator of linear temporal logic of this file's own (formulas: ``patterns.yaml``)."""

import re
from pathlib import Path
from typing import Any

import pytest

from once import beside, from_yaml
from runtime.played import play

PAGE = (Path(__file__).parents[2] / "docs" / "patterns.md").read_text(encoding="utf-8")
SHORT = re.findall(r"^\| ([A-Z][\w ]+?) \| .+? \| `(.+)` \|$", PAGE, re.MULTILINE)
LONG = re.findall(r"^## (.+?)\n\n```yaml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
WRITTEN = {
    **{name: f"objective: {objective}" for name, objective in SHORT},
    **{name: text for names, text in LONG for name in names.split(", ")},
}
PATTERNS = from_yaml(beside(__file__, "patterns.yaml"))
NAMES = {"a": 0, "b": 4, "c": 12, "dock": 7}
TICKS = 90


class Word:
    """Moments one after the other, each the set of what is true; after the last one comes number
    ``loop`` again, or nothing."""

    def __init__(self, moments: list[set[str]], loop: int | None = None) -> None:
        self.moments, self.all = moments, frozenset(range(len(moments)))
        self.after = {k: k + 1 for k in range(len(moments) - 1)}
        if loop is not None:
            self.after[len(moments) - 1] = loop

    def satisfies(self, formula: str) -> bool:
        names = {
            name: Holds(self, {k for k, true in enumerate(self.moments) if name in true})
            for name in (*NAMES, "p")
        }
        operators = {"X": Holds.next, "U": Holds.until, "F": Holds.eventually, "G": Holds.always}
        return 0 in eval(formula, {**operators, **names}).at


class Holds:
    """A formula: the moments ``at`` which it holds."""

    def __init__(self, word: Word, at: Any) -> None:
        self.word, self.at = word, frozenset(at)

    def __and__(self, other: "Holds") -> "Holds":
        return Holds(self.word, self.at & other.at)

    def __invert__(self) -> "Holds":
        return Holds(self.word, self.word.all - self.at)

    def __rshift__(self, other: "Holds") -> "Holds":
        return ~(self & ~other)

    def __eq__(self, other: Any) -> Any:
        return (self >> other) & (other >> self)

    def next(self) -> "Holds":
        """There is a next moment, at which it holds."""
        return Holds(self.word, {k for k, after in self.word.after.items() if after in self.at})

    def until(self, other: "Holds") -> "Holds":
        found = other
        while (more := (self & found.next()).at | found.at) != found.at:
            found = Holds(self.word, more)
        return found

    def eventually(self) -> "Holds":
        return Holds(self.word, self.word.all).until(self)

    def always(self) -> "Holds":
        return ~(~self).eventually()


def word_of_run(name: str) -> Word:
    """What happens in a run: the place and the inputs of each tick, as they repeat in the end where
    no input changes that."""
    told = from_yaml(WRITTEN[name])
    run = play(
        {
            "safenav": 1,
            "clock": "lockstep",
            "map": {"grid": [".....", ".....", "....."], "names": NAMES},
            "inputs": told.get("inputs", {}),
            "robots": {
                "bot": {"model": "quadcopter", "start": "dock", "objective": told["objective"]}
            },
            "until": {"rounds": 1000},
            "limits": {"ticks": TICKS},
        }
    )
    assert run.outcome["outcome"] == "tick_limit"
    places = {region: place for place, region in NAMES.items()}
    moments, on, way = [{"dock"}], set[str](), [NAMES["dock"]]
    for line in run.records:
        if line["type"] == "inputs":
            on = {name for name, value in line["values"].items() if value}
        elif line["type"] == "move":
            way.append(line["to"])
            moments.append(on | {places.get(line["to"], "elsewhere")})
    if told.get("inputs"):
        return Word(moments)
    for period in range(1, TICKS // 3):
        if way[-3 * period :] == way[-period:] * 3:
            return Word(moments, len(moments) - period)
    raise AssertionError(f"{name}: nothing repeats in {TICKS} ticks")


def test_the_page_of_patterns_shows_each_pattern_once() -> None:
    assert len(PATTERNS) == len(SHORT) + sum(names.count(",") + 1 for names, _ in LONG) == 22
    assert WRITTEN.keys() == PATTERNS.keys()


@pytest.mark.parametrize("name", PATTERNS)
def test_a_run_satisfies_its_pattern_and_a_counterexample_does_not(name: str) -> None:
    formula, counterexample = PATTERNS[name]
    assert not Word([{*part.split("+")} for part in counterexample.split()]).satisfies(formula)
    found = word_of_run(name)
    assert found.satisfies(formula), found.moments
