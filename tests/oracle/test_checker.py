"""The checker of explicit strategies accepts sound ones and names what is wrong with others."""

import pytest

from oracle import (
    Automaton,
    MalformedAutomatonError,
    Node,
    build_game,
    check_counterstrategy,
    check_strategy,
    from_json,
    read_slugsin,
    to_json,
)

TEXT = """
[INPUT]
a
[OUTPUT]
x
[ENV_TRANS]
| a a'
[ENV_INIT]
! a
[SYS_INIT]
! x
[SYS_TRANS]
| x ^ a' x'
[ENV_LIVENESS]
a
[SYS_LIVENESS]
x
"""
TOGGLE = read_slugsin(TEXT)
# States are a, x.  From x = 0 the answer to a' is x' = !a'; from x = 1 anything goes.
SOUND = (
    Node(0b00, 0, (1,)),  # ! a: only a' = 1 is allowed, so x' = 0
    Node(0b10, 0, (2, 1)),  # a: a' = 0 gives x' = 1, a' = 1 gives x' = 0
    Node(0b01, 0, (3,)),
    Node(0b11, 0, (2, 3)),
)
STARVING = (Node(0b00, 0, (1,)), Node(0b10, 0, (2, 1)), Node(0b01, 0, (1,)))


def _automaton(nodes: tuple[Node, ...]) -> Automaton:
    return Automaton(("a", "x"), nodes)


@pytest.mark.parametrize(
    ("nodes", "complaint"),
    [
        pytest.param((SOUND[0], SOUND[1], Node(0b01, 0, (3,)), Node(0b11, 0, (2, 1))), None),
        pytest.param((Node(0b10, 0, (0, 0)),), "no start"),
        pytest.param((Node(0b00, 0, ()), *SOUND[1:]), "no answer"),
        pytest.param((Node(0b00, 0, (3,)), *SOUND[1:]), "SYS_TRANS"),
        pytest.param((Node(0b00, 0, (1, 2)), *SOUND[1:]), "ENV_TRANS"),
        pytest.param((*SOUND[:3], Node(0b11, 0, (2, 3, 1))), "second answer"),
    ],
    ids=["another", "start", "missing", "sys_trans", "env_trans", "two answers"],
)
def test_strategy_complaints(nodes: tuple[Node, ...], complaint: str | None) -> None:
    complaints = check_strategy(build_game(TOGGLE), _automaton(nodes))
    if complaint is None:
        assert any("starve guarantee 0" in c for c in complaints), "node 1 may loop on a' = 1"
    else:
        assert any(complaint in c for c in complaints)


def test_a_loop_that_meets_the_assumptions_and_starves_a_goal_is_found() -> None:
    """While a' = 1 the toggle keeps x at 0 for ever, and a holds: the goal x starves."""
    complaints = check_strategy(build_game(TOGGLE), _automaton(SOUND))
    assert complaints == ["nodes [1] starve guarantee 0"]
    assert check_strategy(build_game(TOGGLE), _automaton(STARVING)) == complaints


def test_a_sound_strategy_has_no_complaints() -> None:
    """Assuming that a is false again and again, too, the same automaton is sound."""
    weaker = read_slugsin(_with_assumption("! a"))
    assert check_strategy(build_game(weaker), _automaton(SOUND)) == []


def test_counterstrategy_for_the_toggle() -> None:
    """The environment holds a' = 1 for ever from a state with x = 0."""
    game = build_game(TOGGLE)
    held = (Node(0b00, 0, (1,)), Node(0b10, 0, (1,)))
    assert check_counterstrategy(game, _automaton(held)) == []


@pytest.mark.parametrize(
    ("nodes", "complaint"),
    [
        pytest.param((Node(0b10, 0, (0,)),), "initial", id="no start"),
        pytest.param((Node(0b00, 0, ()),), "way out", id="false dead end"),
        pytest.param((Node(0b00, 0, (1,)), Node(0b01, 0, (1,))), "ENV_TRANS", id="illegal input"),
        pytest.param(
            (Node(0b00, 0, (1,)), Node(0b11, 0, (1,))), "exactly", id="an output is not covered"
        ),
        pytest.param(
            (
                Node(0b00, 0, (1,)),
                Node(0b10, 0, (2,)),
                Node(0b01, 0, (3, 1)),
                Node(0b11, 0, (2, 2)),
            ),
            "twice",
            id="an output is covered twice",
        ),
        pytest.param(
            (
                Node(0b00, 0, (1,)),
                Node(0b10, 0, (2,)),
                Node(0b01, 0, (3, 1)),
                Node(0b11, 0, (1, 3)),
            ),
            "can satisfy all guarantees",
            id="the system can win",
        ),
    ],
)
def test_counterstrategy_complaints(nodes: tuple[Node, ...], complaint: str) -> None:
    complaints = check_counterstrategy(build_game(TOGGLE), _automaton(nodes))
    assert any(complaint in c for c in complaints), complaints


def test_a_counterstrategy_must_meet_the_assumptions() -> None:
    """Holding a' = 1 starves the assumption that a is false again and again."""
    game = build_game(read_slugsin(_with_assumption("! a")))
    held = (Node(0b00, 0, (1,)), Node(0b10, 0, (1,)))
    assert check_counterstrategy(game, _automaton(held)) == ["nodes [1] starve assumption 1"]


def _with_assumption(assumption: str) -> str:
    return f"{TEXT}[ENV_LIVENESS]\n{assumption}\n"


def test_json_is_read_back() -> None:
    automaton = _automaton(SOUND)
    assert from_json(TOGGLE, to_json(TOGGLE, automaton)) == automaton


@pytest.mark.parametrize(
    "text",
    [
        '{"variables": ["x", "a"], "nodes": {}}',
        '{"variables": ["a", "x"], "nodes": {"0": {"rank": 0, "state": [0, 2], "trans": []}}}',
        '{"variables": ["a", "x"], "nodes": {"0": {"rank": 0, "state": [0, 1], "trans": [1]}}}',
        '{"variables": ["a", "x"], "nodes": {"1": {"rank": 0, "state": [0, 1], "trans": []}}}',
        '{"variables": ["a", "x"], "nodes": {"0": ',
    ],
    ids=["other order", "not a bit", "no such node", "gap in the ids", "cut off"],
)
def test_what_is_no_automaton_is_refused(text: str) -> None:
    with pytest.raises(MalformedAutomatonError):
        from_json(TOGGLE, text)
