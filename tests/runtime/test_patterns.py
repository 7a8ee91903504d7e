"""The robotic mission patterns of docs/patterns.md: each as the page writes it, judged by an
evaluator of linear temporal logic of this file's own."""

import re
from collections.abc import Callable
from functools import reduce
from pathlib import Path

import pytest

from once import from_yaml
from runtime.played import play

PAGE = (Path(__file__).parents[2] / "docs" / "patterns.md").read_text(encoding="utf-8")
SHORT = re.findall(r"^\| ([A-Z][\w ]+?) \| .+? \| `(.+)` \|$", PAGE, re.MULTILINE)
LONG = re.findall(r"^## (.+?)\n\n```yaml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
WRITTEN = {
    **{name: f"objective: {objective}" for name, objective in SHORT},
    **{name: text for names, text in LONG for name in names.split(", ")},
}
NAMES = {"a": 0, "b": 4, "c": 12, "dock": 7}
TICKS = 70


class Word:
    """Moments one after the other, each the set of what is true; after the last one comes number
    ``loop`` again, or nothing."""

    def __init__(self, moments: list[frozenset[str]], loop: int | None = None) -> None:
        self.moments, self.loop = moments, loop

    def after(self, moment: int) -> int | None:
        return moment + 1 if moment + 1 < len(self.moments) else self.loop


Formula = Callable[[Word], frozenset[int]]
"""The moments at which a formula holds."""


def atom(name: str) -> Formula:
    return lambda word: frozenset(k for k, true in enumerate(word.moments) if name in true)


def no(one: Formula) -> Formula:
    return lambda word: frozenset(range(len(word.moments))) - one(word)


def both(*formulas: Formula) -> Formula:
    return lambda word: reduce(frozenset.intersection, (f(word) for f in formulas))


def implies(one: Formula, other: Formula) -> Formula:
    return no(both(one, no(other)))


def same(one: Formula, other: Formula) -> Formula:
    return both(implies(one, other), implies(other, one))


def then(one: Formula) -> Formula:
    """X: there is a next moment, at which it holds."""
    return lambda word: frozenset(
        k for k in range(len(word.moments)) if (n := word.after(k)) is not None and n in one(word)
    )


def until(one: Formula, other: Formula) -> Formula:
    def holds(word: Word) -> frozenset[int]:
        left, found = one(word), other(word)
        while True:
            more = {k for k in left if (n := word.after(k)) is not None and n in found}
            if more <= found:
                return found
            found |= more

    return holds


TRUE: Formula = lambda word: frozenset(range(len(word.moments)))  # noqa: E731


def eventually(one: Formula) -> Formula:
    return until(TRUE, one)


def always(one: Formula) -> Formula:
    return no(eventually(no(one)))


def unless(one: Formula, other: Formula) -> Formula:
    """W: until, or forever."""
    return no(until(no(other), both(no(one), no(other))))


def then_weakly(one: Formula) -> Formula:
    """At the next moment if there is one."""
    return no(then(no(one)))


def sequence(*places: Formula) -> Formula:
    first, *rest = places
    return eventually(both(first, sequence(*rest)) if rest else first)


a, b, c, dock, p = map(atom, ("a", "b", "c", "dock", "p"))
PLACES = (a, b, c)
ROUND = ((a, b), (b, c), (c, a))
visited = both(*map(eventually, PLACES))
recurring = both(*(always(eventually(x)) for x in PLACES))
in_order = both(until(no(b), a), until(no(c), b))
fair = both(*(always(implies(x, then_weakly(unless(no(x), y)))) for x, y in ROUND))
once_each = both(*(until(no(x), both(x, then(until(no(x), y)))) for x, y in ROUND[:2]))
ordered_again = both(
    always(eventually(sequence(a, b, c))),
    in_order,
    *(always(implies(y, then(until(no(y), x)))) for x, y in ROUND),
)
strictly = both(*(always(implies(x, then(until(no(x), y)))) for x, y in ROUND))
twice = eventually(both(b, then(eventually(b))))
thrice = eventually(both(b, then(twice)))

PATTERNS: dict[str, tuple[Formula, str]] = {
    "Visit": (visited, "a dock b dock"),
    "Sequenced Visit": (sequence(a, b, c), "a c b"),
    "Ordered Visit": (both(sequence(a, b, c), in_order), "b a b c"),
    "Strict Ordered Visit": (both(sequence(a, b, c), in_order, once_each), "a dock a b c"),
    "Fair Visit": (both(visited, fair), "a dock a b c"),
    "Patrolling": (recurring, "a b c dock"),
    "Sequenced Patrolling": (always(sequence(a, b, c)), "a b c dock"),
    "Ordered Patrolling": (ordered_again, "a b c b a b c"),
    "Strict Ordered Patrolling": (both(ordered_again, strictly), "a b c a dock a b c"),
    "Fair Patrolling": (both(recurring, fair), "a b c c a b c"),
    "Past Avoidance": (until(no(b), p), "dock b p"),
    "Global Avoidance": (always(no(b)), "a c b"),
    "Future Avoidance": (always(implies(p, always(no(b)))), "b p a b"),
    "Upper Restricted Avoidance": (no(thrice), "b a b a b"),
    "Lower Restricted Avoidance": (twice, "a b a c"),
    "Exact Restriction Avoidance": (both(twice, no(thrice)), "b a b b"),
    "Instantaneous Reaction": (always(implies(p, no(b))), "a b+p a"),
    "Delayed Reaction": (always(implies(p, eventually(a))), "a p c b"),
    "Prompt Reaction": (always(implies(p, then_weakly(no(b)))), "a p b a"),
    "Bound Reaction": (always(same(p, c)), "dock c+p c"),
    "Bound Delay": (
        always(both(implies(p, then_weakly(c)), implies(no(p), then_weakly(no(c))))),
        "dock p dock",
    ),
    "Wait": (until(dock, p), "dock a dock p"),
}


def word(text: str) -> Word:
    """``a b+p``: at a; then at b, and p is on."""
    return Word([frozenset(part.split("+")) for part in text.split()])


def word_of_run(name: str) -> Word:
    """What happens in a run: the place and the inputs of each tick, as they repeat in the end where
    no input changes that."""
    told = from_yaml(WRITTEN[name])
    document = {
        "safenav": 1,
        "clock": "lockstep",
        "map": {"grid": [".....", ".....", "....."], "names": NAMES},
        "inputs": told.get("inputs", {}),
        "robots": {"bot": {"model": "quadcopter", "start": "dock", "objective": told["objective"]}},
        "until": {"rounds": 1000},
        "limits": {"ticks": TICKS},
    }
    run = play(document)
    assert run.outcome["outcome"] == "tick_limit"
    places = {region: place for place, region in NAMES.items()}
    moments, on, way = [frozenset({"dock"})], frozenset[str](), [NAMES["dock"]]
    for line in run.records:
        if line["type"] == "inputs":
            on = frozenset(name for name, value in line["values"].items() if value)
        elif line["type"] == "move":
            way.append(line["to"])
            moments.append(on | {places.get(line["to"], "elsewhere")})
    if told.get("inputs"):
        return Word(moments)
    for period in range(1, TICKS // 3):
        if way[-3 * period :] == way[-period:] * 3:
            return Word(moments, len(moments) - period)
    raise AssertionError(f"{name}: nothing repeats in {TICKS} ticks")


def test_the_page_has_every_pattern_once() -> None:
    assert len(PATTERNS) == 22
    assert len(SHORT) + sum(names.count(",") + 1 for names, _ in LONG) == 22
    assert WRITTEN.keys() == PATTERNS.keys()


@pytest.mark.parametrize("name", PATTERNS)
def test_a_run_satisfies_the_pattern_and_another_does_not(name: str) -> None:
    formula, counterexample = PATTERNS[name]
    assert 0 not in formula(word(counterexample))
    found = word_of_run(name)
    assert 0 in formula(found), [sorted(moment) for moment in found.moments]
