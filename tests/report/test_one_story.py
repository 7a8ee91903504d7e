"""Every output of a run tells the same story, in the words of the scenario: names of regions,
twelve robots, an operator needed at the end."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from cli.conftest import Command, environment, safenav
from report.browser import Browser

__all__ = ["environment", "safenav"]

ROBOTS = 12
GRID = ["#" * 15, *("#" + "." * 6 + "#" + "." * 6 + "#" for _ in range(6)), "#" * 15]
GRID[4] = "#" + "." * 13 + "#"


def scenario() -> str:
    """Eleven robots stay in their layers; the last one encounters a gate that no robot can open."""
    robots = [
        f"  robot_{i}: {{model: layer_{i}, start: [{1 + i % 6}, {1 + i // 6}], "
        f"objective: {{visit: [[{1 + i % 6}, {1 + i // 6}], [{1 + i % 6}, {3 + i // 6}]]}}}}"
        for i in range(ROBOTS - 1)
    ]
    robots.append("  robot_11: {model: layer_11, start: home, objective: {patrol: [home, shelf]}}")
    models = [
        f"    layer_{i}: {{mobility: free, layer: level_{i}, capabilities: []}}"
        for i in range(ROBOTS)
    ]
    rows = "\n".join(f"    {row}" for row in GRID)
    return (
        f"safenav: 1\nname: twelve robots and a gate\nmap:\n  grid: |\n{rows}\n"
        "  names: {home: [4, 5], gate: [4, 7], shelf: [4, 13]}\n"
        "catalogue:\n  robots:\n" + "\n".join(models) + "\n"
        "  obstacles:\n    barrier: {action: lift}\n"
        "robots:\n" + "\n".join(robots) + "\nobstacles: [{type: barrier, region: gate}]\n"
    )


@pytest.fixture
def outputs(safenav: Command, tmp_path: Path) -> dict[str, str]:
    """Return each output as text."""
    (tmp_path / "s.yaml").write_text(scenario())
    run = safenav("run", "s.yaml", "--no-map", "--trace", "run.jsonl", "--html", "run.html")
    assert run.returncode == 1, run.stdout + run.stderr
    assert safenav("replay", "run.jsonl", "--svg", "last", "-o", "last.svg").returncode == 0
    batch = safenav("batch", "s.yaml", "--junit", "report.xml", "--out", "out")
    svg = ElementTree.parse(tmp_path / "last.svg")
    junit = ElementTree.parse(tmp_path / "report.xml")
    return {
        "story": run.stdout,
        "picture": " ".join(e.text or "" for e in svg.iter() if e.text),
        "batch": batch.stdout,
        "junit": " ".join([*junit.getroot().itertext(), *_attributes(junit)]),
    }


def _attributes(tree: ElementTree.ElementTree[ElementTree.Element]) -> list[str]:
    return [value for element in tree.iter() for value in element.attrib.values()]


@pytest.mark.slow
def test_all_outputs_tell_one_story(
    outputs: dict[str, str], browser: Browser, tmp_path: Path
) -> None:
    browser.open(tmp_path / "run.html", width=1400, height=900)
    page = browser.one("#app").text
    for where, text in {**outputs, "page": page}.items():
        assert re.search(r"operator[ _]needed", text), where
        assert "gate" in text, where
        assert "robot_11" in text, where
    for where in ("story", "picture"):
        assert "patrol home <-> shelf" in outputs[where], where
    assert "patrol home <-> shelf" in page
    assert "barrier@gate" in page and "barrier@gate" in outputs["story"]
    lines = [json.loads(line) for line in (tmp_path / "run.jsonl").read_text().splitlines()]
    last = lines[-1]["tick"]
    assert browser.tick == last
    assert f"tick {last} of {last}" in outputs["picture"]
    labels = [text.text for text in browser.all(".motion .letters")]
    assert len(set(labels)) == ROBOTS
    signs = zip(labels, [f"robot_{i}" for i in range(ROBOTS)], strict=True)
    told = re.findall(r"^ +(\S{1,2}) +(robot_\d+) \(", outputs["story"], re.MULTILINE)
    assert dict(told) == dict(signs)
    assert set(labels) <= set(outputs["picture"].split())
