"""Large maps: moves are judged, proofs are said not to be."""

from safenav import Mission
from safenav.files import json_line
from safenav.run.checked import check_trace
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.file import as_data
from safenav.trace.records import Record

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


def test_a_proof_on_a_large_map_is_reported_as_not_judged() -> None:
    found = check_trace(lines_of(LARGE + "obstacles: [{type: door, region: [1, 2]}]\n"))
    assert not found.findings
    assert any("the map has more than" in note.explanation for note in found.notes)
