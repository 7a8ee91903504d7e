"""Each trace that is unsafe, untrue, or claims a negative without proof, is refused by its rule;
any bytes give a verdict, or an error with a position; large maps are judged within limits.

``good/`` has traces of correct runs, ``broken.yaml`` damages of each: the rule (``no-trace``: no
reader reads it), tick and robot (``-``: none) of the first finding, or of another one that has the
words after a colon, and the edits.
"""

import copy
import json
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from once import from_yaml
from runtime.played import play
from safenav import InputError, check_trace
from support.damage import GOOD, Edit, Line, damage, text
from support.examples import CHARACTERS
from support.judged import believed

BROKEN = from_yaml((Path(__file__).parent / "broken.yaml").read_text())
CASES = [
    pytest.param(name, told, edits, id=f"{name} {number}: {told}")
    for name, each in BROKEN.items()
    for number, (told, *edits) in enumerate(each)
]


@pytest.mark.parametrize("name", GOOD)
def test_a_good_trace_is_accepted(name: str) -> None:
    found = check_trace(text(GOOD[name]()))
    assert found.ok and found.complete


@pytest.mark.parametrize(("name", "told", "edits"), CASES)
def test_a_broken_rule_is_named_with_tick_and_robot(
    name: str, told: str, edits: list[Edit]
) -> None:
    about, _, words = told.partition(": ")
    lines = text(damage(GOOD[name](), edits))
    if about.startswith("no-trace"):
        with pytest.raises(InputError):
            check_trace(lines)
        assert not believed(lines)
        return
    found = check_trace(lines)
    said = [
        (f"{one.rule} {one.tick} {one.robot or '-'}", one.explanation)
        for one in (*found.findings, *found.notes)
    ]
    said = said if words else said[:1]
    assert any(about == rule and words in explanation for rule, explanation in said), said


TRACES = st.sampled_from(sorted(GOOD))
VALUES = st.one_of(
    *(st.none(), st.booleans(), st.integers(-3, 60), st.integers(), st.floats()),
    st.text(CHARACTERS, max_size=8),
    st.sampled_from(["quad", "digit", "rover", "door@9", "north", "realizable", "hold"]),
    st.lists(st.integers(-1, 60), max_size=3),
    st.dictionaries(st.sampled_from(["quad", "hold", "x"]), st.integers(-1, 60), max_size=2),
)


def content(lines: list[Line]) -> bytes:
    return "".join(line + "\n" for line in text(lines)).encode()


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("traces") / "t.jsonl"


def judged(data: bytes, file: Path) -> Any:
    """The verdict, with short proofs, or None if the trace was refused with a place that exists."""
    file.write_bytes(data)
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("safenav.judge.world.MOST_STATES", 20_000)
            return check_trace(file)
    except InputError as error:
        lines = data.count(b"\n") + 1
        assert error.diagnostics and all(0 <= each.line <= lines for each in error.diagnostics)
        return None


@given(name=TRACES, data=st.data())
def test_flipped_bytes_never_crash_the_judge(file: Path, name: str, data: st.DataObject) -> None:
    raw = bytearray(content(GOOD[name]()))
    for _ in range(data.draw(st.integers(1, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    judged(bytes(raw), file)


@given(name=TRACES, rng=st.integers(0, 2**32 - 1).map(Random))
def test_shuffled_dropped_and_doubled_lines_never_crash_the_judge(
    file: Path, name: str, rng: Random
) -> None:
    header, *lines = GOOD[name]()
    judged(content([header, *rng.choices(lines, k=rng.randint(0, 2 * len(lines)))]), file)


@given(name=TRACES, data=st.data())
def test_any_value_in_any_field_never_crashes_the_judge(
    file: Path, name: str, data: st.DataObject
) -> None:
    lines = GOOD[name]()
    place: Line = data.draw(st.sampled_from(lines))
    while True:
        key = data.draw(st.sampled_from(sorted(place)))
        inner = place[key]
        if not isinstance(inner, dict) or not inner or data.draw(st.booleans()):
            break
        place = inner
    place[key] = data.draw(VALUES)
    judged(content(lines), file)


@given(name=TRACES, data=st.data())
def test_a_trace_cut_at_any_byte_breaks_no_rule(file: Path, name: str, data: st.DataObject) -> None:
    """A crash loses the end of the trace; what is there is still right."""
    raw = content(GOOD[name]())
    found = judged(raw[: data.draw(st.integers(raw.index(b"\n") + 1, len(raw) - 2))], file)
    assert found is not None and found.findings == () and not found.complete


LARGE = f"""
map: {{grid: {["#" * 300, "#..." + "#" * 296, *["#" * 300] * 298]}}}
robots: {{scout: {{model: quadcopter, start: [1, 1], objective: {{visit: [[1, 1], [1, 3]]}}}}}}
until: {{rounds: 1}}
"""


def test_a_run_on_a_large_map_is_judged() -> None:
    lines = play(LARGE).lines
    assert check_trace(lines).notes == ()
    moved = [line.replace('"to":302', '"to":303') for line in lines]
    assert moved != lines and check_trace(moved).findings


def test_a_proof_that_visits_too_many_states_is_reported_as_not_judged() -> None:
    """What counts is the free regions."""
    lines = play(LARGE + "obstacles: [{type: door, region: [1, 2]}]\n").lines
    assert check_trace(lines).notes == ()
    data = json.loads(lines[0])
    data["scenario"]["map"] |= {"rows": 512, "cols": 512, "walls": []}
    found = check_trace([json.dumps(data), *lines[1:]])
    assert any("proofs visit more than 1,000,000 states" in one.explanation for one in found.notes)


def test_lossless_choices_are_not_tried_in_every_order() -> None:
    """Nine orders beside a one-way choice: no limit is exceeded."""
    header, *lines = GOOD["one_way"]()
    team, obstacles = header["scenario"]["robots"], header["scenario"]["obstacles"]
    carrier = copy.deepcopy(team[1]) | {"name": "c", "avoids": [], "start": {"region": 12}}
    carrier["model"]["capabilities"], carrier["objective"] = ["lift"], {"hold": 12}
    team.append(carrier)
    need = {"action": "lift", "robots": 1, "at": "self", "together": False, "same": False}
    kind = {"name": "crate", "needs": [need], "blocks": []}
    new = []
    for number in range(1, 10):
        one = {"type": kind, "region": 8, "ordered": True, "number": number, "appears": 1}
        obstacles.append(one)
        told = {"obstacle": "crate@8" + f"#{number}" * (number > 1), "cause": "scenario", "tick": 1}
        new += [told | {"type": "appeared"}, told | {"type": "order"}]
    lines[-1]["rounds"]["c"] = 0
    found = check_trace(text([header, *lines[:2], *new, *lines[2:]]))
    assert (found.findings, found.notes) == ((), ())


def test_lines_before_the_outcome_do_not_use_up_the_limit_of_its_proof(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lines = text(GOOD["lost_deadline"]())
    lost = next(k for k, line in enumerate(lines) if '"lost"' in line)
    end = json.loads(lines[-1]) | {"tick": 3, "late": [], "rounds": {"a": 0}, "cause": "deadlock"}
    end |= {"outcome": "operator_needed", "proof": {"robots": ["a"]}}
    monkeypatch.setattr("safenav.judge.world.MOST_STATES", 500)
    found = check_trace([*lines[:lost], *[lines[lost]] * 50, json.dumps(end)])
    assert any("visit more than" in one.explanation for one in found.notes)
    assert any("can be completed" in one.explanation for one in found.findings)
