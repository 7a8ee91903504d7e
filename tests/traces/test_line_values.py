"""What a line of a trace may hold: its fields, words and names, for the reader and the judge."""

import json

import pytest

from safenav.errors import InputError
from safenav.judge.lines import NotATraceError, Reader
from safenav.strict_json import flaws
from safenav.trace.file import read_lines
from support.damage import GOOD, damage, find, text


@pytest.mark.parametrize("name", sorted(GOOD))
def test_a_good_trace_has_no_findings(name: str) -> None:
    assert [flaw for line in GOOD[name]() for flaw in flaws(line, line["type"])] == []


@pytest.mark.parametrize("name", ["line", "data", "from_", "late", "outcome", "region", "__a"])
def test_a_robot_may_be_named_as_a_field(name: str) -> None:
    lines = [json.loads(line.replace("quad", name)) for line in text(GOOD["door"]())]
    assert read_lines(text(lines)).robots.keys() == {name, "digit"}


HOSTILE: dict[str, tuple[str, dict[str, object], str]] = {
    "a word": ("move", {"by": "either"}, "`by` has an invalid enum value"),
    "a robot": ("goal", {"robot": "quad is proven safe"}, "`robot` must be a name"),
    "code": ("request", {"bids": {"x: open('f')": 1}}, "neither a field nor a name"),
    "a truth": ("move", {"toward": True}, "`toward` must be"),
    "a number": ("outcome", {"ticks": "never"}, "`ticks` must be"),
    "a target": ("push", {"objectives": {"quad": {"visit": ["all"]}}}, "`objectives[...]` must"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_value_is_refused_with_its_line(name: str) -> None:
    kind, changes, words = HOSTILE[name]
    lines = damage(GOOD["door"](), [{"line": [kind], "fields": changes}])
    with pytest.raises(InputError) as error:
        read_lines(text(lines))
    (problem,) = error.value.diagnostics
    assert words in problem.found
    assert problem.line == find(lines, kind) + 1
    with pytest.raises(NotATraceError, match=f"^line {problem.line}: "):
        list(Reader().lines(text(lines)))


NESTED: list[object] = []
for _ in range(250):
    NESTED = [NESTED]
MANY = [{"name": f"r{k}"} for k in range(2000)]
HEADERS: dict[str, tuple[dict[str, object], str]] = {
    "robot": ({"robots": [{"name": "a.b"}]}, "'a.b' cannot name a robot"),
    "robots": ({"robots": MANY}, "at most 1000"),
    "obstacle": ({"obstacles": [{"type": {"name": "a.b"}}]}, "'a.b' cannot name an obstacle"),
    "rows": ({"map": {"rows": 10**9, "cols": 10**9}}, "1 to 262144"),
    "cols": ({"map": {"rows": 2, "cols": 0}}, "a map of 2 x 0 regions"),
    "nesting": ({"name": [[[]]], "tiles": NESTED}, "nested more than"),
}


@pytest.mark.parametrize("name", HEADERS)
def test_a_hostile_header_is_refused(name: str) -> None:
    changes, words = HEADERS[name]
    header = GOOD["door"]()[0]
    header["scenario"] |= changes
    assert words in " ".join(flaws(header, "header"))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('{"type": "goal", "tick": 1, "tick": 2}', "'tick' appears twice"),
        ('{"type": "goal", "tick": NaN}', "NaN is not a number"),
        ('{"type": "goal", "tick": 1e999}', "is beyond"),
        ('{"type": "goal", "tick": 9007199254740993}', "beyond 9007199254740991"),
        ('{"type": "goal", "tick": ' + "9" * 6000 + "}", "beyond 9007199254740991"),
    ],
)
def test_json_that_programs_read_differently_is_refused(line: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_lines([*text(GOOD["door"]()[:1]), line])
