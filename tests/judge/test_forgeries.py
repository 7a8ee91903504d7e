"""No forgery of an honest trace is accepted unless it is harmless, as a plain oracle sees it.

``JUDGE_FORGERIES``: how many of each kind (default 6)."""

import copy
import os
import random

import pytest

from judge.forgeries import FORGERIES
from judge.oracle import Facts
from safenav.judge.engine import judge
from safenav.judge.lines import NotATraceError
from support.damage import GOOD, Line, live, text

MANY = int(os.environ.get("JUDGE_FORGERIES", "6"))
NEGATIVE = {"a negative", "completed"}


def accepted(lines: list[Line]) -> bool:
    try:
        found = judge(text(lines))
    except NotATraceError:
        return False
    return found.ok and found.outcome is not None and not found.notes


def harm(lines: list[Line], *, negative: bool) -> str:
    found = [one for one in Facts(lines).harms() if negative or "can be completed" not in one]
    return found[0] if found else ""


HONEST = {name: read() for name, read in GOOD.items()}
HONEST = {
    name: lines
    for name, lines in HONEST.items()
    if len(lines) > 9 and not live(lines) and accepted(lines)
}


@pytest.mark.parametrize("name", HONEST)
def test_the_oracle_sees_no_harm_in_an_honest_trace(name: str) -> None:
    assert harm(HONEST[name], negative=False) == ""


@pytest.mark.parametrize("kind", FORGERIES)
def test_a_forgery_that_is_accepted_is_harmless(kind: str) -> None:
    chance, refused, made = random.Random(kind), 0, 0
    for _ in range(40 * MANY):
        if made == MANY:
            break
        name = chance.choice([*HONEST])
        lines = copy.deepcopy(HONEST[name])
        if not FORGERIES[kind](lines, chance) or lines == HONEST[name]:
            continue
        made += 1
        believed = accepted(lines)
        refused += not believed
        if believed:
            seen = harm(lines, negative=kind in NEGATIVE)
            assert seen == "", f"{name}: {seen}"
    assert made == MANY
    assert refused, "no forgery of this kind is refused"
