"""Any bytes give a verdict, or an error with the position in the trace."""

import json
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from safenav.errors import InputError
from safenav.run.checked import CheckedTrace, check_trace, checked
from safenav.trace.file import read_bytes
from support.damage import GOOD, Line, team, text

NAMES = sorted(GOOD)
VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 60),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(["quad", "digit", "rover", "door@9", "north", "realizable", "hold"]),
    st.lists(st.integers(-1, 60), max_size=3),
    st.dictionaries(st.sampled_from(["quad", "hold", "x"]), st.integers(-1, 60), max_size=2),
)


def content(lines: list[Line]) -> bytes:
    return "".join(line + "\n" for line in text(lines)).encode()


def judged(data: bytes) -> CheckedTrace | None:
    """The verdict, or None if the trace was refused with a place that exists."""
    try:
        return checked(data, read_bytes(data, "t.jsonl"))
    except InputError as error:
        assert error.diagnostics
        lines = data.count(b"\n") + 1
        assert all(0 <= diagnostic.line <= lines for diagnostic in error.diagnostics)
        return None


@given(st.sampled_from(NAMES), st.data())
def test_flipped_bytes_never_crash(name: str, data: st.DataObject) -> None:
    raw = bytearray(content(GOOD[name]()))
    for _ in range(data.draw(st.integers(1, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    judged(bytes(raw))


@given(st.sampled_from(NAMES), st.integers(0, 2**32 - 1).map(Random))
def test_shuffled_dropped_and_doubled_lines_never_crash(name: str, rng: Random) -> None:
    header, *lines = GOOD[name]()
    chosen = rng.choices(lines, k=rng.randint(0, 2 * len(lines)))
    judged(content([header, *chosen]))


@given(st.sampled_from(NAMES), st.data())
def test_any_value_in_any_field_never_crashes(name: str, data: st.DataObject) -> None:
    lines = GOOD[name]()
    place: Line = data.draw(st.sampled_from(lines))
    while True:
        key = data.draw(st.sampled_from(sorted(place)))
        inner = place[key]
        if not isinstance(inner, dict) or not inner or data.draw(st.booleans()):
            break
        place = inner
    place[key] = data.draw(VALUES)
    judged(content(lines))


@given(st.sampled_from(NAMES), st.data())
def test_a_trace_cut_at_any_byte_breaks_no_rule(name: str, data: st.DataObject) -> None:
    """A crash loses the end of the trace; what is there is still right."""
    raw = content(GOOD[name]())
    first = raw.index(b"\n") + 1
    cut = data.draw(st.integers(first, len(raw) - 2))
    found = judged(raw[:cut])
    assert found is not None
    assert found.findings == ()
    assert not found.complete


def test_a_deeply_nested_line_is_reported() -> None:
    header = content(GOOD["door"]()[:1])
    with pytest.raises(InputError) as error:
        read_bytes(header + b"[" * 200_000 + b"\n")
    assert error.value.diagnostics[0].line == 2


def test_a_plan_without_poses_for_a_robot_is_reported() -> None:
    lines = GOOD["planned"]()
    plan = next(line for line in lines if line["type"] == "plan")
    plan["robots"]["one"] = []
    with pytest.raises(InputError) as error:
        read_bytes(content(lines))
    assert "must be a list of length >= 1" in str(error.value)


def test_a_huge_number_is_reported() -> None:
    lines = GOOD["door"]()
    raw = json.dumps(lines[-1]).replace('"ticks": 8', '"ticks": ' + "9" * 6000)
    with pytest.raises(InputError):
        read_bytes(content(lines[:-1]) + raw.encode() + b"\n")


@pytest.mark.parametrize(
    "formula",
    ["garbage(", "foo = 3", "(" * 3000, "!" * 3000 + "TRUE", " -> ".join(["TRUE"] * 400)],
    ids=["open", "unknown", "brackets", "negations", "implications"],
)
def test_an_unreadable_formula_is_reported(formula: str) -> None:
    lines = GOOD["door"]()
    team(lines[0])["quad"]["objective"]["always"] = [formula]
    with pytest.raises(InputError, match=r"line 1: .*formula"):
        check_trace(text(lines))
