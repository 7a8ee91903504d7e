"""Games small enough to solve on paper; the oracle must find the same."""

import pytest

from oracle import (
    Specification,
    build_game,
    check_strategy,
    extract,
    is_realizable,
    members,
    read_slugsin,
    solve,
    solve_parity,
    to_json,
)
from oracle.formula import Compare, Number
from oracle.specification import Variable

ARBITER = """
[INPUT]
r1
r2
[OUTPUT]
g1
g2
[SYS_TRANS]
! & g1' g2'
[SYS_LIVENESS]
| ! r1 g1
| ! r2 g2
"""

ONLY_ON_REQUEST = """
[INPUT]
r
[OUTPUT]
g
[SYS_TRANS]
| ! g' r'
[SYS_LIVENESS]
g
"""

WAITER = """
[INPUT]
order
[OUTPUT]
deliver
[SYS_TRANS]
| ! order ! deliver'
[ENV_LIVENESS]
order'
[SYS_LIVENESS]
! deliver'
deliver
"""

ENVIRONMENT_CAN_BE_STUCK = """
[INPUT]
a
[OUTPUT]
b
[ENV_TRANS]
! b
[SYS_LIVENESS]
0
"""

ONE_WAY = """
[OUTPUT]
x
y
[SYS_TRANS]
| ! x x'
| ! x ! y'
[SYS_LIVENESS]
y
"""

DEAD_END = """
[OUTPUT]
x
[SYS_TRANS]
& ! x ! x'
"""

EVERY_STATE = tuple(range(16))


@pytest.mark.parametrize(
    ("text", "winning"),
    [
        pytest.param(ARBITER, EVERY_STATE, id="requests in turn can be granted"),
        pytest.param(ONLY_ON_REQUEST, (), id="nobody has to request"),
        pytest.param(
            ONLY_ON_REQUEST + "[ENV_LIVENESS]\nr\n", EVERY_STATE[:4], id="somebody requests again"
        ),
        pytest.param(WAITER, (), id="orders without pause forbid delivery"),
        pytest.param(
            ENVIRONMENT_CAN_BE_STUCK, EVERY_STATE[:4], id="an environment without moves loses"
        ),
        pytest.param(ONE_WAY, (0b00, 0b01), id="once x holds, y never comes back"),
        pytest.param(DEAD_END, (0b0,), id="a system without moves loses"),
    ],
)
def test_winning_states_are_those_found_on_paper(text: str, winning: tuple[int, ...]) -> None:
    game = build_game(read_slugsin(text))
    assert tuple(members(solve(game).winning)) == winning
    assert tuple(members(solve_parity(game).winning_states())) == winning


def test_initial_conditions_are_read_in_two_ways() -> None:
    """x = 1 loses: a system that may choose takes x = 0, the robotics reading starts in both."""
    game = build_game(read_slugsin(DEAD_END))
    winning = solve(game).winning
    assert is_realizable(game, winning)
    assert not is_realizable(game, winning, robotics_init=True)
    chosen = build_game(read_slugsin(DEAD_END + "[SYS_INIT]\n! x\n"))
    assert is_realizable(chosen, winning, robotics_init=True)
    nobody = build_game(read_slugsin(DEAD_END + "[SYS_INIT]\n0\n"))
    assert not is_realizable(nobody, winning)
    assert is_realizable(nobody, winning, robotics_init=True), "there is no start to lose from"


def test_an_environment_that_cannot_start_loses() -> None:
    game = build_game(read_slugsin(ONLY_ON_REQUEST + "[ENV_INIT]\n0\n"))
    solution = solve(game)
    assert is_realizable(game, solution.winning)
    assert extract(solution).nodes == ()


COUNTER = Specification(
    (Variable("c", "output", (1, 4)),),
    sys_init=(Compare("=", (Number("c"),), (Number(1),)),),
    sys_trans=(Compare("<=", (Number("c", True),), (Number("c"), Number(1))),),
    sys_liveness=(
        Compare("=", (Number("c"),), (Number(4),)),
        Compare("=", (Number("c"),), (Number(1),)),
    ),
)


def test_strategy_of_a_counter_is_the_one_found_on_paper() -> None:
    """Up one by one; at the top the smallest next value is the bottom, where both goals turn."""
    solution = solve(build_game(COUNTER))
    automaton = extract(solution)
    assert check_strategy(solution.game, automaton) == []
    assert to_json(COUNTER, automaton) == (
        '{"version": 0,\n "slugs": "0.0.1",\n\n "variables": ["c@0.1.4", "c@1"],\n\n "nodes": {\n'
        '"0": {\n\t"rank": 0,\n\t"state": [0, 0],\n\t"trans": [1]\n},\n\n'
        '"1": {\n\t"rank": 0,\n\t"state": [1, 0],\n\t"trans": [2]\n},\n\n'
        '"2": {\n\t"rank": 0,\n\t"state": [0, 1],\n\t"trans": [3]\n},\n\n'
        '"3": {\n\t"rank": 0,\n\t"state": [1, 1],\n\t"trans": [4]\n},\n\n'
        '"4": {\n\t"rank": 1,\n\t"state": [0, 0],\n\t"trans": [0]\n}\n\n}}\n'
    )


def test_sums_do_not_wrap_around() -> None:
    """With c' = c + 1 a counter of two bits is stuck at its top."""
    specification = Specification(
        (Variable("c", "output", (0, 3)),),
        sys_trans=(Compare("=", (Number("c", True),), (Number("c"), Number(1))),),
    )
    assert solve(build_game(specification)).winning == 0


BIASED = """
[INPUT]
a
[OUTPUT]
x
[ENV_LIVENESS]
a
[SYS_LIVENESS]
x
"""


def test_bias_for_action_prefers_progress_to_waiting() -> None:
    """Waiting for a (x stays 0) comes first by default, and last with the bias."""
    game = build_game(read_slugsin(BIASED))
    waiting = extract(solve(game)).nodes[0]
    acting = extract(solve(game, bias_for_action=True))
    assert acting.nodes != extract(solve(game)).nodes
    assert waiting.state == 0b00
    assert all(acting.nodes[s].state & 1 for s in acting.nodes[0].successors)
