"""Valid scenarios: the loader's result for each item of the format."""

import re
from pathlib import Path

import pytest

from safenav.errors import InputError
from safenav.scenario.objective import Hold, Ltl
from safenav.scenario.reading.loader import load_scenario, load_scenario_text
from scenario.rooms import ROOMS, load


def objective(told: str, robot: str = "model: quadcopter, start: 8") -> object:
    return load(f"robots:\n  ann: {{{robot}, objective: {told}}}\n").robots[0].objective


def test_raw_guarantees_are_kept_in_canonical_form() -> None:
    found = objective(
        """{ltl: {memory: {done: bool, laps: [0, 3]},
        init: "!done /\\\\ laps = 0",
        safety: ["done' <--> (done || region=dock)", 'heading = north -> !X((heading = west))'],
        liveness: [region = gate]}}""",
        "model: digit, start: 8, heading: east",
    )
    assert found == Ltl(
        init=("!done & laps = 0",),
        safety=("done' <-> done | region = 9", "heading = 0 -> !next(heading = 3)"),
        liveness=("region = 17",),
        memory={"done": None, "laps": (0, 3)},
    )


def test_a_target_may_be_out_of_reach_if_another_of_its_set_is_not() -> None:
    text = "safenav: 1\nmap: {grid: ['.#.']}\n"
    robots = "robots: {ann: {model: quadcopter, start: 0, objective: {hold: {any: [0, 2]}}}}"
    assert load_scenario_text(text + robots).robots[0].objective == Hold((frozenset({0, 2}),))


def test_a_key_of_another_tool_is_reported_with_the_key_of_scenarios() -> None:
    """Nor is the key that was meant reported as missing."""
    text = "safenav: 1\nmap: {grid: ['..'], regions: {a: 1}}\n"
    robots = "robots: {ann: {type: quadcopter, position: 0, goal: {hold: 0}}}"
    with pytest.raises(InputError) as raised:
        load_scenario_text(text + robots)
    meant = [re.findall("did you mean '(.*?)'", d.hint or "") for d in raised.value.diagnostics]
    assert meant == [["names"], ["model"], ["start"], ["objective"]]


def test_line_ends_and_byte_order_marks_of_other_systems(tmp_path: Path) -> None:
    body = ROOMS + "robots: {ann: {model: quadcopter, start: 8, objective: {hold: 9}}}\n"
    file = tmp_path / "with space and ü.yaml"
    file.write_bytes(b"\xef\xbb\xbf" + body.replace("\n", "\r\n").encode())
    assert load_scenario(file).map == load_scenario_text(body).map


def test_a_map_that_is_too_large() -> None:
    rows = "".join(f"    {'.' * 600}\n" for _ in range(500))
    robots = "robots: {ann: {model: quadcopter, start: 0, objective: {hold: 1}}}"
    with pytest.raises(InputError, match="a map of 500 x 600 regions; the maximum is 262144"):
        load_scenario_text(f"safenav: 1\nmap:\n  grid: |\n{rows}{robots}")
