"""Moves that are given on demand, checked against the specification's text: each lie is found."""

import pytest

from safenav.errors import SynthesizerError
from safenav.spec.parsing import read_specification
from safenav.synthesis.serving.served import Position, ServedMove
from safenav.verify.moves import MoveCheck

FERRY = """\
[INPUT]
calm
fog
[OUTPUT]
at:0...5
[ENV_INIT]
!fog
[SYS_INIT]
at = 0
[ENV_TRANS]
fog -> !fog'
[SYS_TRANS]
at' <= at + 1
at <= at' + 1
fog' -> at' = at
[ENV_LIVENESS]
calm'
[SYS_LIVENESS]
at' = 5
at' = 0
"""
CHECK = MoveCheck(read_specification(FERRY, "ferry", "ferry"))
CALM, STORM, FOG = {"calm": 1, "fog": 0}, {"calm": 0, "fog": 0}, {"calm": 0, "fog": 1}
UNMET = "goal .* as met, which it is not"


def position(
    at: int, distance: int, goal: int = 0, assumption: int | None = 0, fog: int = 0, calm: int = 0
) -> Position:
    return Position({"calm": calm, "fog": fog, "at": at}, goal, distance, assumption)


HERE, FREE, LATE = (position(2, 6, assumption=number) for number in (0, None, 3))


@pytest.mark.parametrize(
    ("here", "inputs", "move"),
    [
        (HERE, CALM, ServedMove(position(3, 4, calm=1), 0)),
        (HERE, STORM, ServedMove(position(2, 6), 0)),
        (position(4, 2), CALM, ServedMove(position(5, 9, goal=1, calm=1), 1)),
    ],
    ids=["closer", "waits as long as it is not calm", "meets its goal"],
)
def test_what_the_strategy_may_do(here: Position, inputs: dict[str, int], move: ServedMove) -> None:
    CHECK.move(here, inputs, move)


@pytest.mark.parametrize(
    ("here", "inputs", "move", "why"),
    [
        (HERE, CALM, ServedMove(position(4, 4, calm=1), 0), "a move that violates .*at' <= at"),
        (HERE, FOG, ServedMove(position(3, 4, fog=1), 0), "a move that violates .*fog'"),
        (position(5, 1), CALM, ServedMove(position(6, 0, calm=1), 0), "a value outside its range"),
        (HERE, CALM, ServedMove(position(3, 4), 0), "a move for other inputs"),
        (position(2, 6, fog=1), FOG, ServedMove(position(2, 4, fog=1), 0), "although .* violated"),
        (HERE, CALM, ServedMove(position(2, 6, calm=1), 0), "makes no progress .*from 6 to 6"),
        (HERE, STORM, ServedMove(position(2, 7), 0), "makes no progress .*from 6 to 7"),
        (HERE, STORM, ServedMove(FREE, 0), "makes no progress"),
        (FREE, STORM, ServedMove(FREE, 0), "makes no progress"),
        (HERE, CALM, ServedMove(position(3, -1, calm=1), 0), "makes no progress"),
        (HERE, CALM, ServedMove(position(3, 9, goal=1, calm=1), 1), UNMET),
        (position(4, 2), CALM, ServedMove(position(5, 9, goal=0, calm=1), 2), UNMET),
        (HERE, CALM, ServedMove(position(3, 4, goal=1, calm=1), 0), "goal 1 after goal 0"),
        (position(2, 6, 2), CALM, ServedMove(position(3, 4, 2, calm=1), 0), "goal 2 after"),
        (LATE, STORM, ServedMove(LATE, 0), "waiting for assumption 3, of 1"),
    ],
)
def test_what_it_may_not_do(
    here: Position, inputs: dict[str, int], move: ServedMove, why: str
) -> None:
    with pytest.raises(SynthesizerError, match=f"a wrong move for ferry: .*{why}"):
        CHECK.move(here, inputs, move)


def test_where_it_may_begin() -> None:
    CHECK.start(position(0, 9))
    for wrong in (position(1, 9), position(0, 9, fog=1), position(-1, 9)):
        with pytest.raises(SynthesizerError, match=r"a start that violates|outside its range"):
            CHECK.start(wrong)


def test_only_what_the_assumptions_exclude_may_be_refused() -> None:
    CHECK.refusal(position(2, 6, fog=1), FOG)
    with pytest.raises(SynthesizerError, match="no move, though every assumption holds"):
        CHECK.refusal(HERE, CALM)
