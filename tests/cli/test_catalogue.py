"""``safenav new --catalogue``: what scenarios can use, and where it comes from."""

import json
from pathlib import Path

from cli.conftest import Command
from safenav.scenario.beginning import template_text

PARTS = """\
robots:
  rover: {mobility: free, layer: ground, capabilities: [clear, push], vision: 4, timing: 3}
  digit: {mobility: heading, layer: ground, size: 0.7}
obstacles:
  debris: {action: clear, resolve_at: [3, 4], blocks: [ground]}
"""


def test_the_built_in_catalogue(safenav: Command) -> None:
    found = safenav("new", "--catalogue")
    assert found.returncode == 0
    for word in ("digit", "quadcopter", "door", "uncertainty", "push", "sense", "built in"):
        assert word in found.stdout
    data = json.loads(safenav("new", "--catalogue", "--json").stdout)
    assert data["robots"]["digit"] == {
        "mobility": "heading",
        "layer": "ground",
        "capabilities": ["push"],
        "vision": None,
        "size": 0.6,
        "speed": 0.45,
        "motion": "walker",
        "timing": 1,
        "source": "built in",
    }
    assert "quadcopter" in data["capabilities"]["sense"]["robots"]
    assert data["capabilities"]["sense"]["resolves"] == ["uncertainty"]
    assert data["capabilities"]["unlock"]["resolves"] == ["gate"]
    assert data["obstacles"]["door"]["resolve_at"] == "self"
    assert data["obstacles"]["uncertainty"]["has_truth"] is True
    assert data["obstacles"]["uncertainty"]["blocks"] == ["ground"]
    quadcopter = data["robots"]["quadcopter"]
    assert (quadcopter["mobility"], quadcopter["layer"]) == ("free", "air")


def test_what_a_scenario_adds_has_it_as_its_source(safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "team.yaml").write_text(template_text("team"), encoding="utf-8")
    data = json.loads(safenav("new", "--catalogue", "team.yaml", "--json").stdout)
    assert data["robots"]["cart"]["source"] == "team.yaml"
    assert data["robots"]["digit"]["source"] == "built in"
    assert data["obstacles"]["debris"]["blocks"] == ["ground"]
    assert data["capabilities"]["clear"]["resolves"] == ["debris"]
    assert "sweeper" in data["capabilities"]["clear"]["robots"]


def test_a_catalogue_file_adds_and_replaces(safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "parts.yaml").write_text(PARTS, encoding="utf-8")
    data = json.loads(safenav("new", "--catalogue", "parts.yaml", "--json").stdout)
    assert data["robots"]["rover"]["timing"] == 3
    assert data["robots"]["digit"]["source"] == "parts.yaml"
    assert data["robots"]["digit"]["size"] == 0.7
    assert data["obstacles"]["debris"]["resolve_at"] == [3, 4]
    told = safenav("new", "--catalogue", "parts.yaml").stdout
    assert "clear at regions 3, 4" in told
    assert "lift beside it by 2 robots together" in told
    assert "unlock beside it, then push at it" in told


def test_a_catalogue_beside_a_scenario_is_the_source(safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "parts.yaml").write_text(PARTS, encoding="utf-8")
    (tmp_path / "s.yaml").write_text(
        "safenav: 1\nmap: {grid: ['.....']}\ncatalogue: parts.yaml\n"
        "robots: {ann: {model: rover, start: 0, objective: {hold: 1}}}\n",
        encoding="utf-8",
    )
    data = json.loads(safenav("new", "--catalogue", "s.yaml", "--json").stdout)
    assert data["robots"]["rover"]["source"] == "parts.yaml"


def test_what_is_wrong_with_the_file_is_told(safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_text(
        "robots:\n  rover: {layer: rail, mobility: fre}\n", encoding="utf-8"
    )
    refused = safenav("new", "--catalogue", "bad.yaml")
    assert refused.returncode == 2
    assert "bad.yaml:2:34: 'mobility' of robot model rover: unknown word 'fre'" in refused.stderr
    assert safenav("new", "--catalogue", "missing.yaml").returncode == 2
    (tmp_path / "list.yaml").write_text("- 1\n", encoding="utf-8")
    assert (
        "found a list of 1, expected a mapping" in safenav("new", "--catalogue", "list.yaml").stderr
    )
