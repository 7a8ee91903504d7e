"""The run of ``safenav check`` without hidden obstacles, and what it refuses before."""

import json
from pathlib import Path

import pytest

from cli.conftest import Command
from once import SCENARIOS
from runtime.played import play

FAR = """
safenav: 1
map: {{grid: [".......", "......."]}}
catalogue: {{robots: {{cart: {{mobility: free, layer: ground{battery}}}}}}}
robots: {{c: {{model: cart, start: 0, objective: {{visit: [6, 0]{within}}}}}}}
until: {{rounds: 2{by}}}
{chargers}
"""


def test_check_runs_a_scenario_without_its_hidden_obstacles(safenav: Command) -> None:
    study = SCENARIOS / "case_study_3.yaml"
    said = safenav("check", study)
    assert said.returncode == 0
    assert "without hidden obstacles: completed in tick 25" in said.stdout
    seen = json.loads(safenav("check", study, "--json").stdout)["without_obstacles"]
    assert (seen["outcome"], seen["ticks"], seen["late"]) == ("completed", 25, [])


def test_check_names_the_deadlines_that_this_run_misses(safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text("""
safenav: 1
map: {grid: ["......."]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: [take]}}
  obstacles: {crate: {action: take, blocks: []}, rock: {action: take}}
robots: {c: {model: cart, start: 0, objective: {visit: [1, 0]}}}
obstacles: [{type: rock, region: 1}]
orders: [{at: 1, type: crate, region: 6, resolve_within: 2}]
until: {rounds: 1}
""")
    said = safenav("check", "s.yaml")
    assert said.returncode == 0  # the order of an earlier moment may be in time
    assert "without hidden obstacles: completed in tick" in said.stdout
    assert "; late: crate@6" in said.stdout


def test_check_shows_the_limit_of_a_run_that_does_not_end(safenav: Command, tmp_path: Path) -> None:
    text = FAR.format(battery="", within="", by="", chargers="limits: {ticks: 5}")
    (tmp_path / "s.yaml").write_text(text)
    said = safenav("check", "s.yaml")
    assert (said.returncode, said.stderr) == (0, "")
    assert "without hidden obstacles: tick_limit in tick 5: " in said.stdout


EMPTY = """
safenav: 1
map: {grid: [".......", "......."]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, battery: {capacity: 12, charge: 4, stay: 1}}
robots: {c: {model: cart, start: 0, objective: {visit: [3, 0]}}}
chargers: [0]
changes: [{at: 3, robot: c, objective: {hold: 6}}]
until: {rounds: 20}
"""


def test_check_warns_of_a_battery_that_runs_empty(safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(EMPTY)
    (flat,) = play(EMPTY).all("service", cause="battery")
    warning = f"the battery of {flat['robot']} is empty in tick {flat['tick']} without hidden"
    said = safenav("check", "s.yaml")
    assert (said.returncode, safenav("check", "s.yaml", "--strict").returncode) == (0, 1)
    assert warning in " ".join(said.stderr.split())


@pytest.mark.parametrize(
    ("battery", "within", "by", "chargers", "why"),
    [
        (", battery: {capacity: 11, charge: 4}", "", "", "chargers: [0]", "reaches no other stop"),
        ("", ", within: 11", "", "", "the fastest round takes 12"),
        ("", "", ", by: 23", "", "cannot be completed before tick 24"),
    ],
    ids=["charge", "within", "by"],
)
def test_check_and_explain_refuse_deadlines_and_batteries_as_run_does(
    battery: str, within: str, by: str, chargers: str, why: str, safenav: Command, tmp_path: Path
) -> None:
    text = FAR.format(battery=battery, within=within, by=by, chargers=chargers)
    (tmp_path / "s.yaml").write_text(text)
    for name in ("run", "check", "explain"):
        done = safenav(name, "s.yaml")
        assert done.returncode == 1, (name, done.stdout)
        assert "unrealizable: " in done.stdout
        assert why in done.stdout
        apart = " realizable apart from deadlines and batteries, " in done.stdout
        assert apart is (name == "check")


def test_a_robot_that_starts_in_an_avoided_region_is_bad_input(
    safenav: Command, tmp_path: Path
) -> None:
    text = FAR.format(battery="", within=", avoid: [0]", by="", chargers="")
    (tmp_path / "s.yaml").write_text(text.replace("visit: [6, 0]", "visit: [6, 1]"))
    for name in ("check", "explain"):
        done = safenav(name, "s.yaml")
        assert (done.returncode, done.stdout) == (2, "")
        assert "it starts in 0 [0, 0], which it must avoid" in done.stderr
