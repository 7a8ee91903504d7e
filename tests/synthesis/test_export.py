"""Strategies as DOT, GraphML and figures."""

import io
import re

import networkx
import pytest

from safenav.spec.specification import Specification
from safenav.synthesis.export import to_dot, to_graphml
from safenav.synthesis.strategy import Strategy


@pytest.fixture
def strategy(patrol: Specification, patrol_json: bytes) -> Strategy:
    return Strategy.parse(patrol_json, patrol)


def test_graphml_loads_again_with_every_value(strategy: Strategy) -> None:
    graph = networkx.read_graphml(io.BytesIO(to_graphml(strategy).encode()), node_type=int)
    assert sorted(graph.nodes) == list(range(9))
    assert graph.number_of_edges() == strategy.edges
    for node, rank in enumerate(strategy.ranks):
        data, values = graph.nodes[node], strategy.values(node)
        assert data["value_region"] == values["region"]
        assert data["value_request"] == values["request"]
        assert data["goal"] == rank
        assert data["initial"] == (node == 0)
        assert set(graph.adj[node]) == set(strategy.transitions[node])
    assert graph.nodes[3]["label"] == "region=5 !request"
    assert graph.edges[1, 4]["inputs"] == "request"


def test_dot_names_every_node_and_edge_in_words(strategy: Strategy) -> None:
    dot = to_dot(strategy)
    nodes = re.findall(r"^  (\d+) \[label=\"(.*?)\"(, peripheries=2)?\];$", dot, re.MULTILINE)
    assert [int(number) for number, _, _ in nodes] == list(range(9))
    assert nodes[0] == ("0", r"0: goal 0\nregion=3\n!request", ", peripheries=2")
    assert nodes[3] == ("3", r"3: goal 0\nregion=5\n!request", "")
    edges = re.findall(r"^  (\d+) -> (\d+);$", dot, re.MULTILINE)
    expected = [(n, s) for n, successors in enumerate(strategy.transitions) for s in successors]
    assert [(int(a), int(b)) for a, b in edges] == expected


def test_strange_titles_do_no_harm(patrol: Specification, patrol_json: bytes) -> None:
    title = 'a "quoted" \\ title\nin <two> lines & \x00 \x1b'
    spec = Specification("r", title, patrol.variables, patrol.constraints)
    strategy = Strategy.parse(patrol_json, spec)
    networkx.read_graphml(io.BytesIO(to_graphml(strategy).encode()))
    assert r'label="a \"quoted\" \\ title\nin <two> lines' in to_dot(strategy)
