"""The facts that fix the bytes of a strategy: what upstream prints for the same file.

Each is a game so small that the whole output stands here; the oracle must say the same, so that
it can judge random games.
"""

from pathlib import Path

import pytest

from once import beside
from oracle.automata import to_json, to_text
from oracle.game import build_game, extract, solve
from oracle.text import read_slugsin
from slugs.commands import run

HEAD = '{"version": 0,\n "slugs": "0.0.1",\n\n "variables": '

NO_START = beside(__file__, "specifications/no_start.slugsin")

OUTPUT_FIRST = beside(__file__, "specifications/output_first.slugsin")

DEAD_END = beside(__file__, "specifications/dead_end.slugsin")


def _printed(binary: Path, folder: Path, text: str, *options: str) -> str:
    file = folder / "game.slugsin"
    file.write_text(text)
    process = run(binary, folder, "--explicitStrategy", *options, file)
    assert "RESULT: Specification is realizable." in process.stderr
    return process.stdout


NODE = '"0": {\n\t"rank": 0,\n\t"state": [0, 1],\n\t"trans": [0]\n}'
PRINTED = {
    "no blank lines without nodes": (NO_START, '["a", "b"],\n\n "nodes": {\n}}\n', ""),
    "variables in the order of a slugsin file": (
        OUTPUT_FIRST,
        f'["q", "k"],\n\n "nodes": {{\n{NODE}\n\n}}}}\n',
        "State 0 with rank 0 -> <q:0, k:1>\n\tWith successors : 0\n",
    ),
    "a line that ends after the colon without successors": (
        DEAD_END,
        '["a", "b"],\n\n "nodes": {\n'
        + NODE.replace("0, 1", "1, 1").replace("[0]", "[]")
        + "\n\n}}\n",
        "State 0 with rank 0 -> <a:1, b:1>\n\tWith successors : \n",
    ),
}


@pytest.mark.parametrize(("text", "nodes", "listed"), PRINTED.values(), ids=PRINTED)
def test_a_strategy_is_printed_as_by_upstream(
    slugs_binary: Path, tmp_path: Path, text: str, nodes: str, listed: str
) -> None:
    automaton = extract(solve(build_game(read_slugsin(text))))
    assert _printed(slugs_binary, tmp_path, text, "--jsonOutput") == HEAD + nodes
    assert to_json(automaton) == HEAD + nodes
    assert _printed(slugs_binary, tmp_path, text) == listed
    assert to_text(automaton) == listed


def test_a_structured_file_prints_its_inputs_first(slugs_binary: Path, tmp_path: Path) -> None:
    structured = OUTPUT_FIRST.replace("! q'", "!(q')")
    printed = _printed(slugs_binary, tmp_path, structured, "--jsonOutput")
    assert printed.startswith(HEAD + '["k", "q"],')
    assert '"state": [1, 0]' in printed
