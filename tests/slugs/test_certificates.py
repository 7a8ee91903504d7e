"""`--check` accepts sound certificates and rejects unsound ones with the reason.

Certificates damaged by hand, one for each condition; test_broken_certificates.py damages them at
random.
"""

import json
from pathlib import Path

import pytest

from once import beside
from slugs import commands

SERVICE = beside(__file__, "specifications/service.structuredslugs")
VARIABLES = ["r", "s", "level@0.0.2", "level@1"]
# Node 2 follows a request; the strategy serves then and only then.
SOUND: dict[str, tuple[list[int], list[int]]] = {
    "0": ([0, 0, 0, 0], [1, 0]),
    "1": ([1, 0, 0, 0], [2]),
    "2": ([0, 1, 0, 0], [1, 0]),
}

HOPELESS = beside(__file__, "specifications/hopeless.structuredslugs")


def run(binary: Path, folder: Path, specification: str, strategy: str, *options: str) -> str:
    """The exit status and what was said."""
    (folder / "game.structuredslugs").write_text(specification)
    (folder / "strategy.json").write_text(strategy)
    files = ("strategy.json", "game.structuredslugs")
    process = commands.run(binary, folder, *options, "--check", *files)
    assert process.returncode in (0, 1, 2), process.stderr
    assert (process.returncode == 2) == (process.stdout == "")
    return f"{process.returncode} {process.stdout}{process.stderr}"


def document(nodes: dict[str, tuple[list[int], list[int]]], names: list[str] = VARIABLES) -> str:
    """A strategy as JSON."""
    parts = {n: {"rank": 0, "state": s, "trans": t} for n, (s, t) in nodes.items()}
    return json.dumps({"version": 0, "slugs": "0.0.1", "variables": names, "nodes": parts})


def damaged(**nodes: tuple[list[int], list[int]] | None) -> str:
    """The sound strategy with some nodes (`n0`, `n1`, ...) replaced, added or taken out."""
    changed: dict[str, tuple[list[int], list[int]] | None] = {**SOUND}
    changed.update({name[1:]: node for name, node in nodes.items()})
    return document({name: node for name, node in changed.items() if node is not None})


def test_a_sound_strategy_is_accepted(own_slugs: Path, tmp_path: Path) -> None:
    """Numbers of nodes and edges are those of the file."""
    said = run(own_slugs, tmp_path, SERVICE, document(SOUND))
    assert said == "0 strategy accepted: 3 nodes, 5 edges\n"


@pytest.mark.parametrize(
    ("strategy", "reason"),
    [
        pytest.param(
            damaged(n1=([1, 0, 1, 0], [2])),
            "node 0: the step to node 1 violates SYS_TRANS, line 16: level' = level",
            id="a wrong bit",
        ),
        pytest.param(
            damaged(n2=([0, 1, 0, 0], [0])),
            "node 2: no successor for the next input that ENV_TRANS allows: r=1",
            id="a missing successor",
        ),
        pytest.param(
            damaged(n1=([1, 0, 0, 0], [2, 1])),
            "node 1: the step to node 1 violates ENV_TRANS, line 13: r -> ! r'",
            id="a successor for a forbidden input",
        ),
        pytest.param(
            damaged(n0=([0, 0, 0, 0], [1, 0, 2])),
            "node 0: its successors 0 and 2 answer the same next input, r=0",
            id="two successors for one input",
        ),
        pytest.param(
            damaged(n1=([1, 0, 0, 0], [0])),
            "node 1: the step to node 0 violates SYS_TRANS, line 15: r -> s'",
            id="an edge that breaks a guarantee",
        ),
        pytest.param(
            damaged(n0=([0, 1, 0, 0], [1, 0])),
            "node 0: it should be initial, but violates SYS_INIT, line 10: ! s",
            id="a wrong initial node",
        ),
        pytest.param(
            damaged(n0=([0, 0, 1, 1], [1, 0])),
            "node 0: it should be initial, but violates SYS_INIT, line 11: level = 0",
            id="an initial node outside of its range",
        ),
        pytest.param(
            document({}),
            "no initial node for the input that ENV_INIT allows: r=0",
            id="no initial node",
        ),
        pytest.param(
            damaged(n7=([0, 1, 0, 0], [1, 0])),
            "node 7: it is neither initial nor reachable from an initial node",
            id="a node from nowhere",
        ),
        pytest.param(
            damaged(n1=([1, 0, 0, 0], [3])),
            "node 1: its successor 3 does not exist",
            id="a successor that does not exist",
        ),
        pytest.param(
            damaged(n1=([1, 0, 0], [2])),
            "node 1: its state has 3 bits, expected 4",
            id="a state that is too short",
        ),
        pytest.param(
            document(SOUND, ["r", "s", "level@1", "level@0.0.2"]),
            "variable 2 of the strategy is 'level@1', expected 'level@0.0.2'",
            id="variables in another order",
        ),
        pytest.param(
            document(SOUND, ["r", "s"]),
            "the strategy has 2 variables, the specification 4",
            id="too few variables",
        ),
    ],
)
def test_a_broken_strategy_is_rejected(
    own_slugs: Path, tmp_path: Path, strategy: str, reason: str
) -> None:
    """Exit status 1, and the reason names the node and the constraint."""
    said = run(own_slugs, tmp_path, SERVICE, strategy)
    assert said == f"1 strategy rejected: {reason}\n"


def test_a_starved_guarantee_is_found(own_slugs: Path, tmp_path: Path) -> None:
    """The system may wait with its service only if it need not answer at once."""
    lazy = SERVICE.replace("r -> s'\n", "")
    strategy = document({"0": ([0, 0, 0, 0], [1, 0]), "1": ([1, 0, 0, 0], [0])})
    said = run(own_slugs, tmp_path, lazy, strategy)
    assert "meets all assumptions but never the guarantee SYS_LIVENESS, line 19: s'" in said
    # Without the assumption's requests nobody is starved on that cycle.
    fair = lazy.replace("[ENV_LIVENESS]\nr'", "[ENV_LIVENESS]\nr' & s'")
    assert run(own_slugs, tmp_path, fair, strategy).startswith("0 ")


def test_robotics_semantics_wants_every_initial_state(own_slugs: Path, tmp_path: Path) -> None:
    """With the level left open there are three initial states, and one node is not enough."""
    loose = SERVICE.replace("level = 0\n", "")
    assert run(own_slugs, tmp_path, loose, document(SOUND)).startswith("0 ")
    said = run(own_slugs, tmp_path, loose, document(SOUND), "--sysInitRoboticsSemantics")
    assert "no node for the initial state r=0, level=1, s=0" in said


@pytest.mark.parametrize(
    ("nodes", "verdict"),
    [
        pytest.param(
            {"0": ([0, 0], [1, 2]), "1": ([1, 0], [2]), "2": ([1, 1], [])},
            "0 counterstrategy accepted: 3 nodes, 3 edges\n",
            id="sound: requests without end lead to a dead end",
        ),
        pytest.param(
            {"0": ([0, 0], [1, 2]), "1": ([1, 0], []), "2": ([1, 1], [])},
            "1 counterstrategy rejected: node 1: it has no successors, but the system has an "
            "output for every next input that ENV_TRANS allows\n",
            id="one of the dead ends is none",
        ),
        pytest.param(
            {"0": ([0, 0], [1]), "1": ([1, 0], [2]), "2": ([1, 1], [])},
            "1 counterstrategy rejected: node 0: no successor for the output that SYS_TRANS "
            "allows: s=1\n",
            id="an output is not covered",
        ),
        pytest.param(
            {"0": ([0, 0], [])},
            "1 counterstrategy rejected: node 0: it has no successors, but the system has an "
            "output for every next input that ENV_TRANS allows\n",
            id="no dead end",
        ),
        pytest.param(
            {"0": ([0, 0], [0, 1]), "1": ([0, 1], [0, 1])},
            "1 counterstrategy rejected: node 0: it is on a cycle that never meets the assumption "
            "ENV_LIVENESS, line 14: r'\n",
            id="an assumption is starved",
        ),
        pytest.param(
            {"0": ([0, 0], [1, 3]), "1": ([1, 0], []), "3": ([0, 1], [])},
            "1 counterstrategy rejected: node 0: its successors 1 and 3 have different inputs\n",
            id="two inputs at once",
        ),
    ],
)
def test_counterstrategies(
    own_slugs: Path,
    tmp_path: Path,
    nodes: dict[str, tuple[list[int], list[int]]],
    verdict: str,
) -> None:
    """The environment keeps its assumptions, and the system is stuck after a request."""
    said = run(own_slugs, tmp_path, HOPELESS, document(nodes, ["r", "s"]), "--counterStrategy")
    assert said == verdict


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "1:1: error: found the end of the file, expected '{'"),
        ('{"variables": ["a"]}', 'the strategy has no "nodes"'),
        ('{"variables": [], "nodes": {"x": {}}}', 'found node "x", expected a number in quotes'),
        ('{"variables": [], "nodes": {"0": {"rank": 0}}}', 'node 0 has no "state"'),
        (document(SOUND)[:-1], "found the end of the file, expected '}'"),
        (document(SOUND) + "x", "found 'x', expected the end of the file"),
        (document(SOUND).replace("[1, 0, 0, 0]", "[1, 0, 2, 0]"), "found 2 in a state"),
        (document(SOUND).replace('"1": {', '"0": {'), "duplicate node 0"),
        ('{"version": 1}', "unknown version of the format, expected 0"),
        ("[" * 100_000, "found '[', expected '{'"),
        ('{"more": ' + "[" * 100_000, "found the end of the file, expected a value"),
        ('{"version": 99999999999999999999}', "the number is too large"),
        ('{"a\\q": 0}', "found an unknown escape in a string"),
    ],
)
def test_malformed_strategies_are_bad_input(
    own_slugs: Path, tmp_path: Path, text: str, said: str
) -> None:
    """Exit status 2 and the place in the file."""
    answer = run(own_slugs, tmp_path, SERVICE, text)
    assert answer.startswith("2 strategy.json:")
    assert said in answer
