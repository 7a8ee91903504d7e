"""Files of strategies and specifications, and progress measures, as the checker of bundles reads
them."""

from typing import Any

import pytest

from safenav import InputError, read_specification
from safenav.judge.bundle import strategies as checker

FALLS = "the measure does not decrease from node"
UNKNOWN = "a negative value or names an unknown assumption"


@pytest.mark.parametrize(
    ("numbers", "excuses", "told"),
    [
        ([1, 0, 0], [None, 0, 0], None),
        ([9, 7, 7], [1, 0, 0], None),
        ([0, 0, 0], [0, 0, 0], None),
        ([0, 0, 0], [None, 0, 0], f"{FALLS} 0 to node 1"),
        ([1, 2, 2], [None, 0, 0], f"{FALLS} 0 to node 1"),
        ([9, 1, 0], [None, 0, 0], f"{FALLS} 2 to node 1"),
        ([1, 0, 0], [None, 0, None], f"{FALLS} 1 to node 2"),
        ([1, 0, 0], [None, 1, 1], f"{FALLS} 1 to node 2"),
        ([0, -1, -1], [None, 0, 0], UNKNOWN),
        ([0.5, 0, 0], [None, 0, 0], UNKNOWN),
        ([1, 0, 0], [None, 2, 2], UNKNOWN),
        ([1, 0], [None, 0], "list index out of range"),
    ],
)
def test_any_progress_measure_that_decreases_or_has_a_violated_assumption_is_a_proof(
    numbers: list[int], excuses: list[int | None], told: str | None
) -> None:
    """The robot arrives (node 0) unless the input keeps it (nodes 1 and 2 in turn); one assumption
    is that the input is off infinitely often, the other that it is on."""
    edges = [0, 0, 1, 1, 2, 2], [0, 1, 0, 2, 0, 1]
    arrives = [target == 0 for target in edges[1]]
    assumed = [arrives, [not there for there in arrives]]
    given: Any = edges, "goal 0", arrives, assumed, {"n": numbers, "a": excuses}
    if told is None:
        checker.check_measure(*given)
        return
    with pytest.raises((checker.RefusedError, LookupError), match=told):
        checker.check_measure(*given)


def strategy(bits: list[str], *nodes: tuple[list[int], list[int]]) -> checker.Strategy:
    given = {str(k): {"state": state, "trans": trans} for k, (state, trans) in enumerate(nodes)}
    return checker.Strategy({"variables": bits, "nodes": given}, [])


def test_a_strategy_with_too_many_edges_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    given: Any = ["y", "x"], ([0, 0], [1, 2]), ([1, 0], [1, 2]), ([0, 1], [0])
    assert strategy(*given).reach([1]) == [0, 1, 2]
    monkeypatch.setattr(checker, "MOST_EDGES", 4)
    with pytest.raises(checker.TooLargeError, match="5 edges"):
        strategy(*given)


def test_the_bits_of_a_number_have_its_range_in_their_names() -> None:
    graph = strategy(["n@0.5.7", "n@1"], ([0, 0], []), ([0, 1], []))
    assert graph.columns == {"n": [5, 7]}


@pytest.mark.parametrize(
    ("bits", "state", "trans", "told"),
    [
        (["x", "x"], [1, 1], [0], "expected bit 1 of x"),
        (["n@0.0.3", "n@2"], [1, 1], [0], "expected bit 1 of n"),
        (["n@1", "n@0.0.3"], [1, 1], [0], "expected bit 0 of n"),
        (["n@0", "n@1"], [1, 1], [0], "not a bit of a variable"),
        (["n@0.0.3", "n@1.0.3"], [1, 1], [0], "not a bit of a variable"),
        (["n@0.0.2", "n@1"], [1, 1], [0], "out of its range"),
        (["lambda x", "x"], [1, 1], [0], "not a bit of a variable"),
        # To Python the same name as x.
        (["\uff58", "x"], [1, 1], [0], "not a bit of a variable"),
        (["x"], [1, 1], [0], "does not have 1 bits"),
        (["x"], [2], [0], "or has a wrong successor"),
        (["x"], [1], [1], "or has a wrong successor"),
        (["x"], [1], [-1], "or has a wrong successor"),
    ],
)
def test_unreadable_nodes_and_bits_are_refused(
    bits: list[str], state: list[int], trans: list[int], told: str
) -> None:
    with pytest.raises(checker.RefusedError, match=told):
        strategy(bits, (state, trans))


SPECIFICATION = """# a light
[INPUT]
somebody
[OUTPUT]
light
[ENV_TRANS]
# an assumption: none{}!somebody'
[SYS_TRANS]
light' <-> somebody'
"""


@pytest.mark.parametrize("separator", ["\r", "\f", "\x85", "\u2028"], ids=ascii)
def test_every_reader_ends_lines_at_line_feeds_only(separator: str) -> None:
    """Behind other characters, what is a comment to one program would be a formula to another."""
    code = rf"U\+{ord(separator):04X}"
    with pytest.raises(InputError, match=f"spec:7:22: not text: .*{code}"):
        read_specification(SPECIFICATION.format(separator), "spec")
    assert read_specification(SPECIFICATION.format("\t").replace("\n", "\r\n"))
