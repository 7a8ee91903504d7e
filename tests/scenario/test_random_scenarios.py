"""Damaged scenarios end in an InputError, or load and are read back from a checkpoint."""

import json
import string
from contextlib import suppress
from copy import deepcopy
from typing import Any

import yaml
from hypothesis import given
from hypothesis import strategies as st

from safenav.errors import InputError
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.yaml.document import plain, read_document
from safenav.trace import fields
from scenario.mistakes import places
from scenario.test_schema import FULL
from support.examples import campaign

words = st.text(alphabet=string.ascii_letters + "ü -", min_size=1, max_size=8).filter(
    lambda word: word.strip() == word
)
data = st.recursive(
    st.none() | st.booleans() | st.integers(-99, 99) | words,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(words, inner, max_size=4),
    max_leaves=5,
)


@given(data.filter(lambda value: value is not None), st.booleans())
def test_dumped_data_reads_back(value: object, flow: bool) -> None:
    text = yaml.safe_dump(value, default_flow_style=flow, allow_unicode=True)
    assert plain(read_document(text).root) == value


SNIPPETS = [
    *"[]{}:,#'\"|>&*!-?%@` \n\t.~=0123456789",
    *("\n  ", "- ", ": ", "''", "!!python/object:os.system ", "&a ", "*a", "*door", "<<: *door"),
    *("true", "null", ".nan", "-.inf", "1e999", "9" * 30, "0x", "--- ", "...", "é", "\x00"),
    *("\ud800", "\u2028", "[8, 9]", "{any: 7}", "next(", "robots", "region", "\ufeff", "\r"),
]


def load_or_refuse(text: str) -> None:
    try:
        scenario = load_scenario_text(text, "mutated.yaml")
    except InputError as error:
        for diagnostic in error.diagnostics:
            assert diagnostic.found, "a refusal says why"
            assert diagnostic.line <= text.count("\n") + text.count("\r") + 3
        assert error.diagnostics
        return
    data = json.loads(json.dumps(fields.plain(scenario)))
    assert fields.convert(Scenario, data) == scenario


edits = st.lists(
    st.tuples(st.integers(0, len(FULL)), st.integers(0, 12), st.sampled_from(["", *SNIPPETS])),
    min_size=1,
    max_size=4,
)


@campaign(300)
@given(edits)
def test_any_damage_to_the_text_gives_a_scenario_or_an_input_error(
    changes: list[tuple[int, int, str]],
) -> None:
    text = FULL
    for place, removed, added in changes:
        text = text[:place] + added + text[place + removed :]
    load_or_refuse(text)


PLAIN = plain(read_document(FULL).root)


@campaign(200)
@given(st.lists(st.tuples(st.sampled_from([*places(PLAIN)]), data), min_size=1, max_size=3))
def test_any_value_of_any_key_gives_a_scenario_or_an_input_error(
    changes: list[tuple[tuple[Any, ...], Any]],
) -> None:
    scenario = deepcopy(PLAIN)
    for path, value in changes:
        parent = scenario
        with suppress(KeyError, IndexError, TypeError):  # an earlier change took the place away
            for key in path[:-1]:
                parent = parent[key]
            parent[path[-1]] = value
    load_or_refuse(json.dumps(scenario, ensure_ascii=False))


@campaign(100)
@given(st.text(max_size=200))
def test_any_text_at_all_gives_a_scenario_or_an_input_error(text: str) -> None:
    load_or_refuse(text)
