"""Warnings about a valid scenario that is probably mistaken."""

from pathlib import Path
from typing import Any

import pytest

import warm
from once import beside, from_yaml
from safenav.scenario.lint import imprecise, lint
from safenav.scenario.reading.loader import load_scenario, load_scenario_text

SCENARIO = """
safenav: 1
map: {{grid: ["########", "#......#", "#......#", "########"], names: {names}}}
catalogue:
  robots:
    porter: {{mobility: free, layer: {layer}, capabilities: [{can}]}}
  obstacles:
    beam: {{needs: [{{action: lift, robots: {robots}, at: neighbours}}]}}
    leak: {{action: lift, blocks: []}}
robots:
  a: {{model: porter, start: 9, objective: {{visit: [14, 9]}}}}
  b: {{model: {other}, start: 17, objective: {{visit: [22, 17]}}, avoids: {avoids}}}
obstacles: {obstacles}
"""
PLAIN = {
    "can": "lift",
    "layer": "ground",
    "robots": "1",
    "other": "quadcopter",
    "avoids": "[]",
    "obstacles": "[{type: beam, region: 11}]",
    "names": "{}",
}


WARNINGS = from_yaml(beside(__file__, "lint.yaml"))


@pytest.mark.parametrize("row", WARNINGS, ids=[row["what"] for row in WARNINGS])
def test_warnings(row: dict[str, Any], tmp_path: Path) -> None:
    file = tmp_path / "s.yaml"
    file.write_text(SCENARIO.format(**PLAIN | row["changes"]))
    assert list(lint(load_scenario(file))) == row["said"]


@pytest.mark.parametrize(("model", "side"), [("digit", 1.79), ("husky", 1.3)])
def test_lint_and_motion_refuse_the_same_bodies(model: str, side: float, tmp_path: Path) -> None:
    scenario, trace = tmp_path / "s.yaml", tmp_path / "t.jsonl"
    scenario.write_text(
        f'safenav: 1\nmap: {{resolution: {side}, grid: ["####", "#..#", "#..#", "####"]}}\n'
        f"robots: {{a: {{model: {model}, start: 5, heading: east, objective: {{hold: 6}}}}}}\n"
        "until: {rounds: 1}\n"
    )
    assert warm.safenav("run", scenario, "--trace", trace).returncode == 0
    done = warm.safenav("export", trace, "--motion", tmp_path / "m.jsonl")
    assert (done.returncode == 2) == any(
        "has no room" in told for told in lint(load_scenario(scenario))
    )
    assert (done.returncode == 2) == (side == 1.79)


@pytest.mark.parametrize(
    ("side", "off", "said"),
    [
        (2.0, 0.7, None),
        (1.0, 0.3, "reaches 0.10 m into the next one, where other robots may be; set its"),
        (0.6, 0.3, "reaches 0.30 m into the next one, where other robots may be; give the map"),
        (0.5, 0.3, None),  # larger than a region, which is reported
    ],
)
def test_a_robot_that_arrives_beside_the_middle_reaches_into_the_next_region(
    side: float, off: float, said: str | None
) -> None:
    text = f"""
safenav: 1
map: {{resolution: {side}, grid: ["####", "#..#", "####"]}}
catalogue: {{robots: {{cart: {{mobility: free, layer: ground, size: 0.6, speed: 1}}}}}}
robots: {{a: {{model: cart, start: 5, objective: {{visit: [6, 5]}}}}}}
"""
    found = list(imprecise(load_scenario_text(text), {"a": off}))
    assert (said in found[0]) if said else not found
