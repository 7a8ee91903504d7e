"""`--check` accepts what is sound and rejects what is not, with the reason.

Damaged certificates by hand, one for each condition, and by chance, judged by the oracle.
"""

import json
import subprocess
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest
from oracle import (
    Automaton,
    Game,
    Node,
    build_game,
    check_counterstrategy,
    check_strategy,
    counterstrategy_from_parity,
    extract,
    inputs_first,
    is_realizable,
    losing_inputs,
    random_specification,
    solve,
    solve_parity,
    to_json,
    to_structuredslugs,
)

BATCHES = 20
BATCH = 25

# The system must answer a request in the next step, and serve again and again.
SERVICE = """
[INPUT]
r
[OUTPUT]
s
level: 0...2
[ENV_INIT]
! r
[SYS_INIT]
! s
level = 0
[ENV_TRANS]
r -> ! r'
[SYS_TRANS]
r -> s'
level' = level
[ENV_LIVENESS]
r'
[SYS_LIVENESS]
s'
"""
VARIABLES = ["r", "s", "level@0.0.2", "level@1"]
# Node 2 follows a request; the strategy serves then and only then.
SOUND: dict[str, tuple[list[int], list[int]]] = {
    "0": ([0, 0, 0, 0], [1, 0]),
    "1": ([1, 0, 0, 0], [2]),
    "2": ([0, 1, 0, 0], [1, 0]),
}

# The environment may ask at any time; the system can never answer.
HOPELESS = """
[INPUT]
r
[OUTPUT]
s
[ENV_INIT]
! r
[SYS_INIT]
! s
[SYS_TRANS]
! (s & r')
r -> s'
[ENV_LIVENESS]
r'
[SYS_LIVENESS]
r & s
"""


def run(binary: Path, folder: Path, specification: str, strategy: str, *options: str) -> str:
    """The exit status and what was said."""
    (folder / "game.structuredslugs").write_text(specification)
    (folder / "strategy.json").write_text(strategy)
    process = subprocess.run(
        [binary, *options, "--check", "strategy.json", "game.structuredslugs"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        cwd=folder,
    )
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


def test_a_sound_strategy_is_accepted(slugs_binary: Path, tmp_path: Path) -> None:
    """Numbers of nodes and edges are those of the file."""
    said = run(slugs_binary, tmp_path, SERVICE, document(SOUND))
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
    slugs_binary: Path, tmp_path: Path, strategy: str, reason: str
) -> None:
    """Exit status 1, and the reason names the node and the constraint."""
    said = run(slugs_binary, tmp_path, SERVICE, strategy)
    assert said == f"1 strategy rejected: {reason}\n"


def test_a_starved_guarantee_is_found(slugs_binary: Path, tmp_path: Path) -> None:
    """The system may wait with its service only if it need not answer at once."""
    lazy = SERVICE.replace("r -> s'\n", "")
    strategy = document({"0": ([0, 0, 0, 0], [1, 0]), "1": ([1, 0, 0, 0], [0])})
    said = run(slugs_binary, tmp_path, lazy, strategy)
    assert "meets all assumptions but never the guarantee SYS_LIVENESS, line 19: s'" in said
    # Without the assumption's requests nobody is starved on that cycle.
    fair = lazy.replace("[ENV_LIVENESS]\nr'", "[ENV_LIVENESS]\nr' & s'")
    assert run(slugs_binary, tmp_path, fair, strategy).startswith("0 ")


def test_robotics_semantics_wants_every_initial_state(slugs_binary: Path, tmp_path: Path) -> None:
    """With the level left open there are three initial states, and one node is not enough."""
    loose = SERVICE.replace("level = 0\n", "")
    assert run(slugs_binary, tmp_path, loose, document(SOUND)).startswith("0 ")
    said = run(slugs_binary, tmp_path, loose, document(SOUND), "--sysInitRoboticsSemantics")
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
    slugs_binary: Path,
    tmp_path: Path,
    nodes: dict[str, tuple[list[int], list[int]]],
    verdict: str,
) -> None:
    """The environment keeps its assumptions, and the system is stuck after a request."""
    said = run(slugs_binary, tmp_path, HOPELESS, document(nodes, ["r", "s"]), "--counterStrategy")
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
        (document(SOUND).replace('"1": {', '"0": {'), "node 0 is there twice"),
        ('{"version": 1}', "unknown version of the format, expected 0"),
        ("[" * 100_000, "found '[', expected '{'"),
        ('{"more": ' + "[" * 100_000, "found the end of the file, expected a value"),
        ('{"version": 99999999999999999999}', "the number is too large"),
        ('{"a\\q": 0}', "found an unknown escape in a string"),
    ],
)
def test_what_is_no_strategy_is_bad_input(
    slugs_binary: Path, tmp_path: Path, text: str, said: str
) -> None:
    """Exit status 2 and the place in the file."""
    answer = run(slugs_binary, tmp_path, SERVICE, text)
    assert answer.startswith("2 strategy.json:")
    assert said in answer


@pytest.mark.parametrize("batch", range(BATCHES))
def test_damage_by_chance_is_judged_as_by_the_oracle(
    slugs_binary: Path, tmp_path: Path, batch: int
) -> None:
    """Strategies and counterstrategies of random games, intact and damaged."""
    accepted = rejected = 0
    for seed in range(batch * BATCH, (batch + 1) * BATCH):
        source = Random(seed)
        specification = inputs_first(
            random_specification(source, integers=seed % 2 == 0, bits=3 + seed % 3)
        )
        game = build_game(specification)
        solution = solve(game)
        realizable = is_realizable(game, solution.winning)
        if realizable:
            intact = extract(solution)
        else:
            parity = solve_parity(game)
            losing = losing_inputs(game, solution.winning)[0]
            starts = losing & game.env_init & game.sys_init
            intact = counterstrategy_from_parity(parity, starts)
        text = to_structuredslugs(specification, source)
        for certificate in (intact, *(damage(intact, source) for _ in range(3))):
            sound = is_sound(game, certificate, realizable)
            said = run(
                slugs_binary,
                tmp_path,
                text,
                to_json(specification, certificate),
                *([] if realizable else ["--counterStrategy"]),
            )
            assert said[0] == ("0" if sound else "1"), f"seed {seed}: {said}"
            accepted += sound
            rejected += not sound
    assert accepted > BATCH / 2
    assert rejected > BATCH / 2


def damage(automaton: Automaton, source: Random) -> Automaton:
    """One node changed: a bit, a successor too few, too many, or elsewhere."""
    nodes = list(automaton.nodes)
    if not nodes or not automaton.variables:
        return automaton
    number = source.randrange(len(nodes))
    node = nodes[number]
    successors = list(node.successors)
    kind = source.randrange(4)
    if kind == 0:
        nodes[number] = replace(
            node, state=node.state ^ 1 << source.randrange(len(automaton.variables))
        )
        return Automaton(automaton.variables, tuple(nodes))
    if kind != 3 and successors:
        del successors[source.randrange(len(successors))]
    if kind >= 2:
        successors.append(source.randrange(len(nodes)))
    nodes[number] = Node(node.state, node.rank, tuple(successors))
    return Automaton(automaton.variables, tuple(nodes))


def is_sound(game: Game, automaton: Automaton, realizable: bool) -> bool:
    """The oracle's verdict, and the two conditions of form that only `--check` has."""
    judge = check_strategy if realizable else check_counterstrategy
    starts = game.env_init & game.sys_init
    initial = [i for i, node in enumerate(automaton.nodes) if starts >> node.state & 1]
    reached, frontier = set(initial), initial
    while frontier:
        after = {s for number in frontier for s in automaton.nodes[number].successors} - reached
        reached |= after
        frontier = list(after)
    if len(reached) < len(automaton.nodes) or (automaton.nodes and 0 not in initial):
        return False
    # The oracle starts in nodes of rank 0 only; here every node that may be initial is one.
    ranked = tuple(replace(node, rank=0) for node in automaton.nodes)
    return not judge(game, Automaton(automaton.variables, ranked))
