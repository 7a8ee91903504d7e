"""Strategies as DOT, GraphML and figures."""

import io
import json
import re
import shutil
import subprocess

import networkx
import pytest

from safenav.outcome import Verdict
from safenav.spec.specification import Owner, Specification, Variable
from safenav.synthesis.export import in_words, statistics_of, to_dot, to_graphml, to_networkx
from safenav.synthesis.request import SynthesisResult
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


@pytest.mark.skipif(shutil.which("dot") is None, reason="Graphviz is not installed")
def test_graphviz_draws_it(strategy: Strategy) -> None:
    drawn = subprocess.run(["dot", "-Tsvg"], input=to_dot(strategy).encode(), capture_output=True)
    assert drawn.returncode == 0 and b"region=5" in drawn.stdout


def test_the_same_strategy_gives_the_same_bytes(
    strategy: Strategy, patrol: Specification, patrol_json: bytes
) -> None:
    again = Strategy.parse(patrol_json, patrol)
    assert to_dot(again) == to_dot(strategy)
    assert to_graphml(again) == to_graphml(strategy)


def test_headings_are_compass_words_and_booleans_their_names() -> None:
    variables = (
        Variable("region", Owner.OUTPUT, (0, 90)),
        Variable("heading", Owner.OUTPUT, (0, 3)),
        Variable("scout", Owner.OUTPUT),
        Variable("level", Owner.INPUT, (0, 3)),
    )
    strategy = Strategy(Specification("r", "r", variables, ()), (), [], [], [])
    values = {"region": 47, "heading": 1, "scout": 0, "level": 2}
    assert in_words(strategy, values, Owner.OUTPUT) == "region=47 heading=east !scout"
    assert in_words(strategy, {**values, "heading": 3, "scout": 1}, Owner.OUTPUT) == (
        "region=47 heading=west scout"
    )
    assert in_words(strategy, values, Owner.INPUT) == "level=2"


def test_strange_titles_do_no_harm(patrol: Specification, patrol_json: bytes) -> None:
    title = 'a "quoted" \\ title\nin <two> lines & \x00 \x1b'
    spec = Specification("r", title, patrol.variables, patrol.constraints)
    strategy = Strategy.parse(patrol_json, spec)
    networkx.read_graphml(io.BytesIO(to_graphml(strategy).encode()))
    assert r'label="a \"quoted\" \\ title\nin <two> lines' in to_dot(strategy)


def test_figures(patrol: Specification, strategy: Strategy) -> None:
    found = SynthesisResult("carrier", Verdict.REALIZABLE, 0.25, False, "0", strategy)
    figures = statistics_of(patrol, found)
    assert (figures.states, figures.edges) == (9, 18)
    assert (figures.goals, figures.variables, figures.bits) == (2, 2, 3)
    assert (figures.robot, figures.verdict, figures.seconds) == ("carrier", "realizable", 0.25)
    without = statistics_of(patrol, SynthesisResult("carrier", Verdict.TIMEOUT, 1.0, False, "0"))
    assert (without.states, without.edges, without.bits) == (None, None, 3)


def test_a_counterstrategy_without_successors_is_exported(patrol: Specification) -> None:
    names = ["request", "region@0.3.5", "region@1"]
    node = {"rank": 0, "state": [0, 0, 0], "trans": []}
    data = json.dumps({"variables": names, "nodes": {"0": node}}).encode()
    graph = to_networkx(Strategy.parse(data, patrol))
    assert (graph.number_of_nodes(), graph.number_of_edges()) == (1, 0)
