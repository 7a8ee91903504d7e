"""The facts that fix the bytes of a strategy: what upstream prints for the same file.

Each is a game so small that the whole output stands here; the oracle must say the same, so that
it can judge random games.
"""

from pathlib import Path

import pytest

from oracle import build_game, extract, read_slugsin, solve, to_json, to_text
from slugs.commands import run

HEAD = '{"version": 0,\n "slugs": "0.0.1",\n\n "variables": '

NO_START = """
[INPUT]
a
[OUTPUT]
b
[ENV_INIT]
0
"""

OUTPUT_FIRST = """
[OUTPUT]
q
[INPUT]
k
[SYS_INIT]
! q
[ENV_INIT]
k
[ENV_TRANS]
k'
[SYS_TRANS]
! q'
"""

DEAD_END = """
[INPUT]
a
[OUTPUT]
b
[ENV_INIT]
a
[SYS_INIT]
b
[ENV_TRANS]
! a
"""

# Waiting may use the targets with which a round began, not what plain steps have just added.
TWO_ASSUMPTIONS = """
[INPUT]
e
[OUTPUT]
a
[ENV_LIVENESS]
! & e' a'
a'
[SYS_LIVENESS]
! e
"""

ONE_ASSUMPTION = """
[INPUT]
d
g
[OUTPUT]
out
[ENV_TRANS]
d
[ENV_LIVENESS]
! | out d'
[SYS_LIVENESS]
! g'
"""


def _printed(binary: Path, folder: Path, text: str, *options: str) -> str:
    file = folder / "game.slugsin"
    file.write_text(text)
    process = run(binary, folder, "--explicitStrategy", *options, file)
    assert "RESULT: Specification is realizable." in process.stderr
    return process.stdout


def _oracle(text: str, bias: bool = False) -> str:
    specification = read_slugsin(text)
    return to_json(specification, extract(solve(build_game(specification), bias)))


def test_a_strategy_without_nodes_has_no_blank_lines(slugs_binary: Path, tmp_path: Path) -> None:
    expected = HEAD + '["a", "b"],\n\n "nodes": {\n}}\n'
    assert _printed(slugs_binary, tmp_path, NO_START, "--jsonOutput") == expected
    assert _oracle(NO_START) == expected
    assert _printed(slugs_binary, tmp_path, NO_START) == ""


def test_variables_are_printed_in_the_order_of_a_slugsin_file(
    slugs_binary: Path, tmp_path: Path
) -> None:
    node = '"0": {\n\t"rank": 0,\n\t"state": [0, 1],\n\t"trans": [0]\n}'
    expected = f'{HEAD}["q", "k"],\n\n "nodes": {{\n{node}\n\n}}}}\n'
    assert _printed(slugs_binary, tmp_path, OUTPUT_FIRST, "--jsonOutput") == expected
    assert _oracle(OUTPUT_FIRST) == expected
    text = "State 0 with rank 0 -> <q:0, k:1>\n\tWith successors : 0\n"
    assert _printed(slugs_binary, tmp_path, OUTPUT_FIRST) == text


def test_inputs_come_first_in_a_structured_file(slugs_binary: Path, tmp_path: Path) -> None:
    structured = OUTPUT_FIRST.replace("! q'", "!(q')")
    printed = _printed(slugs_binary, tmp_path, structured, "--jsonOutput")
    assert printed.startswith(HEAD + '["k", "q"],')
    assert '"state": [1, 0]' in printed


def test_a_node_without_successors_ends_its_line_after_the_colon(
    slugs_binary: Path, tmp_path: Path
) -> None:
    expected = "State 0 with rank 0 -> <a:1, b:1>\n\tWith successors : \n"
    assert _printed(slugs_binary, tmp_path, DEAD_END) == expected
    specification = read_slugsin(DEAD_END)
    assert to_text(specification, extract(solve(build_game(specification)))) == expected


@pytest.mark.parametrize(
    ("text", "states", "successors"),
    [
        pytest.param(TWO_ASSUMPTIONS, (2, 3), (0, 2), id="two assumptions"),
        pytest.param(ONE_ASSUMPTION, (4, 5, 6, 7), (0, 2, 4, 7), id="one assumption"),
    ],
)
def test_waiting_does_not_use_the_plain_steps_of_its_own_round(
    slugs_binary: Path,
    tmp_path: Path,
    text: str,
    states: tuple[int, ...],
    successors: tuple[int, ...],
) -> None:
    expected = _oracle(text, bias=True)
    assert _printed(slugs_binary, tmp_path, text, "--jsonOutput", "--biasForAction") == expected
    nodes = extract(solve(build_game(read_slugsin(text)), bias_for_action=True)).nodes
    assert {nodes[state].successors for state in states} == {successors}
