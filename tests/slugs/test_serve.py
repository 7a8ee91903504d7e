"""`slugs --serve`: the strategy, one move at a time."""

import os
import signal
import subprocess
from pathlib import Path
from random import Random

import pytest

from once import CORPUS, beside
from oracle import (
    Specification,
    build_game,
    dense_game,
    independent_game,
    inputs_first,
    is_realizable,
    random_specification,
    solve,
    to_slugsin,
    to_structuredslugs,
)
from oracle.serving import begin, difference
from slugs.commands import run

LIFT = beside(__file__, "specifications/lift.structuredslugs")
GAMES = int(os.environ.get("SAFENAV_RANDOM_GAMES", "500")) // 10
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
BATCH = 20


@pytest.fixture
def lift(tmp_path: Path) -> Path:
    file = tmp_path / "lift.structuredslugs"
    file.write_text(LIFT)
    return file


def test_a_move_says_what_to_do_and_how_far_it_is(own_slugs: Path, lift: Path) -> None:
    server = begin(own_slugs, lift)
    greeting = server.greeting
    assert greeting["protocol"] == 1
    assert greeting["variables"] == ["request", "floor@0.0.3", "floor@1"]
    assert (greeting["inputs"], greeting["outputs"]) == (["request"], ["floor@0.0.3", "floor@1"])
    assert (greeting["goals"], greeting["assumptions"]) == (2, 1)
    start = server.ask({"start": {"request": 1}})
    assert (start["state"], start["goal"], start["assumption"]) == ([1, 0, 0], 0, 0)
    distances = [start["distance"]]
    state = start["state"]
    for _ in range(3):
        move = server.ask({"state": state, "goal": 0, "inputs": [1]})
        state = [1, *move["outputs"]]
        assert (move["met"], move["goal"]) == (0, 0)
        distances.append(move["distance"])
    assert state == [1, 1, 1], "the third floor"
    assert sorted(distances, reverse=True) == distances
    arrived = server.ask({"state": state, "goal": 0, "inputs": [0]})
    assert (arrived["met"], arrived["goal"]) == (1, 1)
    assert server.close() == 0


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ({"start": {"floor@1": 1}}, {"state": None}),
        ({"state": [0, 0, 0], "goal": 0, "inputs": [0]}, {"refused": "inputs"}),
    ],
)
def test_a_state_outside_the_strategy_is_refused(
    own_slugs: Path, lift: Path, request_: object, answer: object
) -> None:
    server = begin(own_slugs, lift)
    assert server.ask(request_) == answer
    assert server.close() == 0


def test_a_node_is_found_as_a_list_would_have_it_first(own_slugs: Path, lift: Path) -> None:
    server = begin(own_slugs, lift)
    third = {"floor@0.0.3": 1, "floor@1": 1}
    found = server.ask({"find": third, "nodes": 13})
    assert (found["state"], found["goal"], found["distance"]) == ([1, 1, 1], 0, 0)
    move = server.ask({"state": found["state"], "goal": found["goal"], "inputs": [1]})
    assert (move["met"], move["goal"]) == (1, 1)
    first = server.ask({"start": {}})
    assert server.ask({"find": {}, "nodes": 1}) == first
    assert server.ask({"find": {**third, "request": 0}, "nodes": 13}) == {"state": None}
    assert server.close() == 0


def test_a_node_is_found_among_a_million_initial_ones(own_slugs: Path, tmp_path: Path) -> None:
    """A million of them; their numbers are the values of the outputs, the first one highest."""
    file = tmp_path / "open.slugsin"
    file.write_text("[OUTPUT]\n" + "".join(f"x{bit}\n" for bit in range(20)))
    server = begin(own_slugs, file)
    for number, most in ((5, 5), (5, 6), (3, 6), (300, 301), (300, 300), (300, 1000)):
        wanted = {f"x{bit}": number >> (19 - bit) & 1 for bit in range(20)}
        found = server.ask({"find": wanted, "nodes": most})["state"]
        assert found == (list(wanted.values()) if number < most else None)
    assert server.close() == 0


def test_a_node_is_found_among_the_given_number_only(own_slugs: Path, tmp_path: Path) -> None:
    """A counter to 999: node n is the number n."""
    file = tmp_path / "count.structuredslugs"
    file.write_text("[OUTPUT]\nx:0...999\n[SYS_INIT]\nx = 0\n[SYS_TRANS]\nx' = x + 1 | x = 999\n")
    server = begin(own_slugs, file)
    names = server.greeting["variables"]
    bits = {name: 1 for name in names if name != names[0]}
    assert len(names) == 10
    late = {name: 900 >> bit & 1 for bit, name in enumerate(names)}
    for most, state in ((0, None), (900, None), (901, list(late.values())), (900, None)):
        assert server.ask({"find": late, "nodes": most})["state"] == state
    assert server.ask({"find": bits, "nodes": 1000}) == {"state": None}
    assert server.close() == 0


def test_a_lost_state_is_refused(own_slugs: Path, tmp_path: Path) -> None:
    file = tmp_path / "trap.slugsin"
    file.write_text("[OUTPUT]\nx\n[SYS_INIT]\n! x\n[SYS_TRANS]\n| ! x x'\n[SYS_LIVENESS]\n! x\n")
    server = begin(own_slugs, file)
    assert server.ask({"state": [1], "goal": 0, "inputs": []}) == {"refused": "state"}
    assert server.ask({"state": [0], "goal": 0, "inputs": []})["outputs"] == [0]
    assert server.close() == 0


@pytest.mark.parametrize(
    ("request_", "error"),
    [
        ({}, 'expected "start", or "find" and "nodes", or "state", "goal" and "inputs"'),
        ({"find": {}}, 'expected "start", or "find" and "nodes"'),
        ({"start": {}, "nodes": 1}, 'expected "start", or "find" and "nodes"'),
        ({"state": [0, 0], "goal": 0, "inputs": [0]}, "found 2 bits"),
        ({"state": [0, 0, 2], "goal": 0, "inputs": [0]}, "found 2, expected 0 or 1"),
        ({"state": [0, 0, 0], "goal": 2, "inputs": [0]}, "goal 2 does not exist: there are 2"),
        ({"start": {"door": 1}}, "there is no variable 'door'"),
        ({"stop": 1}, 'found "stop"'),
        ("nonsense", "expected '{'"),
    ],
)
def test_an_invalid_request_gets_an_error_and_serving_continues(
    own_slugs: Path, lift: Path, request_: object, error: str
) -> None:
    server = begin(own_slugs, lift)
    assert error in server.ask(request_)["error"]
    assert server.ask({"start": {}})["state"] == [0, 0, 0]
    assert server.close() == 0


def test_an_unrealizable_specification_serves_nothing(own_slugs: Path, tmp_path: Path) -> None:
    (tmp_path / "lost.slugsin").write_text("[OUTPUT]\nx\n[SYS_LIVENESS]\n0\n")
    done = run(own_slugs, tmp_path, "--serve", "lost.slugsin")
    assert (done.returncode, done.stdout) == (10, "")
    assert "RESULT: Specification is unrealizable." in done.stderr


def test_the_time_limit_is_one_on_becoming_ready(own_slugs: Path, lift: Path) -> None:
    server = begin(own_slugs, lift, "--timeout", "2")
    try:
        server.process.wait(timeout=2.5)
    except subprocess.TimeoutExpired:
        assert server.ask({"start": {}})["state"] == [0, 0, 0]
    assert server.close() == 0


def test_an_interrupt_ends_serving(own_slugs: Path, lift: Path) -> None:
    server = begin(own_slugs, lift)
    server.process.send_signal(signal.SIGTERM)
    assert server.process.wait(timeout=300) == 3
    assert server.process.stdin is not None
    server.process.stdin.close()
    assert server.process.stdout is not None
    server.process.stdout.close()


@pytest.mark.parametrize("batch", range(max(1, GAMES // BATCH)))
def test_served_moves_are_those_of_the_listed_strategy(
    own_slugs: Path, tmp_path: Path, batch: int
) -> None:
    """Random games, with and without a bias for action: every edge, and a measure that falls."""
    played = 0
    for seed in range(FIRST + batch * BATCH, FIRST + (batch + 1) * BATCH):
        source = Random(seed)
        specification = random_specification(source, integers=seed % 3 == 0, bits=4 + seed % 3)
        played += _compare(own_slugs, tmp_path, specification, seed)
    assert played > 0


@pytest.mark.parametrize("seed", range(4))
def test_large_games_are_served_as_they_are_listed(
    own_slugs: Path, tmp_path: Path, seed: int
) -> None:
    _compare(own_slugs, tmp_path, dense_game(Random(FIRST + seed)), seed)


def test_independent_parts_are_served_as_they_are_listed(own_slugs: Path, tmp_path: Path) -> None:
    """Each part is looked at by itself; together they allow the inputs that they should."""
    seeds = range(FIRST, FIRST + 12)
    assert sum(_compare(own_slugs, tmp_path, independent_game(Random(s)), s) for s in seeds) > 0


def _compare(binary: Path, folder: Path, specification: Specification, seed: int) -> int:
    ordered = specification if specification.is_boolean() else inputs_first(specification)
    game = build_game(ordered)
    if not is_realizable(game, solve(game).winning):
        return 0
    file = folder / "game"
    printed = to_slugsin if ordered.is_boolean() else to_structuredslugs
    file.write_text(printed(ordered, Random(seed)))
    for options in ((), ("--biasForAction",)):
        found = difference(binary, file, *options, most=2000, game=game)
        assert found is None, f"seed {seed} {options}: {found}\n{file.read_text()}"
    return 1


@pytest.mark.parametrize(
    "name",
    [
        "slugs/multi_robot_scenario.structuredslugs",
        "slugs/single_robot_scenario.structuredslugs",
        "slugs/two_customer_waiter.slugsin",
        "slugs/water_reservoir.structuredslugs",
        "gr1/genbuf_2.slugsin",
        "gr1/bunny_many_goals_4.slugsin",
    ],
)
def test_published_files_are_served_as_they_are_listed(own_slugs: Path, name: str) -> None:
    file = CORPUS / name
    if not file.is_file():
        pytest.skip(f"no corpus at {CORPUS}; set SAFENAV_CORPUS to the corpus")
    assert difference(own_slugs, file) is None


def test_a_strategy_of_millions_of_states_is_served_without_listing_it(own_slugs: Path) -> None:
    file = CORPUS / "gr1" / "genbuf_20.slugsin"
    if not file.is_file():
        pytest.skip(f"no corpus at {CORPUS}; set SAFENAV_CORPUS to the corpus")
    server = begin(own_slugs, file, "--memory", "500")
    start = server.ask({"start": {}})
    inputs = [
        start["state"][server.greeting["variables"].index(n)] for n in server.greeting["inputs"]
    ]
    move = server.ask({"state": start["state"], "goal": start["goal"], "inputs": inputs})
    assert len(move["outputs"]) == len(server.greeting["outputs"])
    assert server.close() == 0
