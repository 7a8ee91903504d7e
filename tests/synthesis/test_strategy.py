"""Strategies and specifications as text: read, refused with a reason, and written as DOT and
GraphML. Nodes and how they are followed: ``test_verify_random``."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import networkx
import pytest

import warm
from once import beside, from_yaml
from safenav import Specification, Strategy, SynthesizerError, read_specification


def test_a_variable_with_one_value_needs_no_bits() -> None:
    spec = read_specification("[OUTPUT]\nat:7...7\n")
    data = b'{"variables": [], "nodes": {"0": {"rank": 0, "state": [], "trans": [0]}}}'
    strategy = Strategy.parse(data, spec)
    assert strategy.values(0) == {"at": 7}
    assert strategy.find_initial({"at": 7}) == 0
    assert strategy.find_initial({"at": 8}) is None
    with pytest.raises(KeyError):
        strategy.find_initial({"nowhere": 7})


@pytest.mark.parametrize(
    ("path", "value", "complaint"), from_yaml(beside(__file__, "malformed.yaml"))
)
def test_a_malformed_strategy_is_refused_with_the_reason(
    patrol: Specification, patrol_json: bytes, path: list[Any], value: Any, complaint: str
) -> None:
    place = document = json.loads(patrol_json)
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(SynthesizerError, match=complaint):
        Strategy.parse(json.dumps(document).encode(), patrol)


@pytest.mark.parametrize("title", ["patrols", r'a "quoted" \ title <in> brackets &'])
def test_synth_writes_every_value_as_dot_and_as_graphml(
    title: str,
    patrol: Specification,
    patrol_json: bytes,
    answering: Callable[[bytes], Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("SAFENAV_SLUGS", str(answering(patrol_json)))
    file, strategy = tmp_path / "carrier.structuredslugs", Strategy.parse(patrol_json, patrol)
    file.write_text(f"# {title}\n{patrol.to_structuredslugs()}")
    assert warm.safenav("synth", file, "-o", tmp_path).returncode == 0
    assert (tmp_path / "carrier.json").read_bytes() == patrol_json
    graph = networkx.read_graphml(tmp_path / "carrier.graphml", node_type=int)
    assert sorted(graph.nodes) == list(range(9))
    for node, rank in enumerate(strategy.ranks):
        data, values = graph.nodes[node], strategy.values(node)
        assert data["value_region"] == values["region"]
        assert data["value_request"] == values["request"]
        assert (data["goal"], data["initial"]) == (rank, node == 0)
        assert set(graph.adj[node]) == set(strategy.transitions[node])
        same = tuple(other for other in range(9) if strategy.values(other) == values)
        assert strategy.nodes_with(values) == same
    assert graph.nodes[3]["label"] == "region=5 !request"
    assert graph.edges[1, 4]["inputs"] == "request"
    head, *lines = (tmp_path / "carrier.dot").read_text().split("\n  ")
    nodes, edges = lines[3:12], lines[12:]
    assert head.startswith('digraph "carrier" {')
    assert title.replace("\\", "\\\\").replace('"', r"\"") in "".join(lines[:3])
    assert nodes[0] == r'0 [label="0: goal 0\nregion=3\n!request", peripheries=2];'
    assert nodes[3] == r'3 [label="3: goal 0\nregion=5\n!request"];'
    expected = [f"{n} -> {s};" for n, after in enumerate(strategy.transitions) for s in after]
    assert "\n".join(edges) == "\n".join([*expected[:-1], expected[-1] + "\n}\n"])


def test_a_printed_specification_reads_back(patrol: Specification) -> None:
    again = read_specification(patrol.to_structuredslugs(), "again", "carrier")
    assert (again.variables, again.title) == (patrol.variables, patrol.title)
    assert [(c.section, c.formula) for c in again.constraints] == [
        (c.section, c.formula) for c in patrol.constraints
    ]
