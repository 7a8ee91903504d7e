"""Large maps: moves are judged, proofs are said not to be."""

import json

import pytest

from safenav import Mission
from safenav.files import json_line
from safenav.run.checked import check_trace
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.file import as_data
from safenav.trace.records import Record
from support.damage import GOOD, text

ROWS = ["#" * 300, "#..." + "#" * 296, *["#" * 300] * 298]
LARGE = f"""
safenav: 1
map: {{grid: {ROWS}}}
robots: {{scout: {{model: quadcopter, start: [1, 1], objective: {{visit: [[1, 1], [1, 3]]}}}}}}
until: {{rounds: 1}}
"""


def lines_of(text: str) -> list[str]:
    records = list[Record]()
    Mission(load_scenario_text(text), listeners=[records.append]).run()
    return [json_line(as_data(record)) for record in records]


def test_a_run_on_a_large_map_is_judged() -> None:
    lines = lines_of(LARGE)
    assert (check_trace(lines).findings, check_trace(lines).notes) == ((), ())
    moved = [line.replace('"to":302', '"to":303') for line in lines]
    assert moved != lines and check_trace(moved).findings


def test_a_proof_that_visits_too_many_states_is_reported_as_not_judged() -> None:
    """What counts is the free regions."""
    header, *lines = lines_of(LARGE + "obstacles: [{type: door, region: [1, 2]}]\n")
    assert (check_trace([header, *lines]).findings, check_trace([header, *lines]).notes) == ((), ())
    data = json.loads(header)
    data["scenario"]["map"] |= {"rows": 512, "cols": 512, "walls": []}
    found = check_trace([json.dumps(data), *lines])
    assert any("proofs visit more than 1,000,000 states" in one.explanation for one in found.notes)


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
