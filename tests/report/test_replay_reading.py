"""A trace becomes a replay: places, knowledge, objectives and stack at every tick."""

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from once import beside
from report import made_traces
from runtime.played import play
from safenav.errors import InputError
from safenav.run.reading import read_run
from safenav.run.run import Run
from safenav.run.values import ObstacleStatus, StackRow, StoryKind
from safenav.scenario.objective import Hold, Patrol, Visit

Line = dict[str, Any]


@pytest.mark.parametrize("name", ["door", "chain", "detour", "crowd"])
def test_robots_are_where_the_moves_say(traces: dict[str, Path], name: str) -> None:
    replay = read_run(traces[name])
    told = [json.loads(line) for line in traces[name].read_text().splitlines()]
    moves = [line for line in told if line["type"] == "move"]
    track = {robot.name: robot for robot in replay.robots}
    assert len(moves) == replay.last * len(track)
    for move in moves:
        assert track[move["robot"]].regions[move["tick"]] == move["to"]
        heading = track[move["robot"]].headings[move["tick"]]
        assert (heading.label if heading is not None else None) == move["heading"]


def test_a_found_obstacle_without_helper_is_not_requested(tmp_path: Path) -> None:
    lines = made_traces.door()
    _first(lines, "request")["helper"] = None
    replay = read_run(made_traces.write(lines, tmp_path / "t.jsonl"))
    assert replay.statuses["door@47"].at(11) is ObstacleStatus.FOUND


@pytest.mark.parametrize(("until", "kind"), [(None, "waiting"), (30.0, "paused")])
def test_waiting_for_an_operator_differs_from_waiting_for_a_change(
    tmp_path: Path, until: float | None, kind: str
) -> None:
    lines = made_traces.door()
    wait = {"outcome": "operator_needed", "explanation": "no robot helps", "until": until}
    lines.insert(-1, {"type": "waiting", "tick": lines[-1]["tick"], **wait})
    events = read_run(made_traces.write(lines, tmp_path / "t.jsonl")).events
    assert [e.kind for e in events if "waits for" in e.text] == [kind]


def test_the_stack_grows_and_shrinks_with_nested_requests(replays: dict[str, Run]) -> None:
    replay = replays["chain"]
    first = StackRow("uncertainty@43", "digit", ("quad",))
    second = StackRow("door@47", "quad", ("digit",))
    pushes = [e.tick for e in replay.events if e.kind is StoryKind.PUSH]
    pops = [e.tick for e in replay.events if e.kind is StoryKind.POP]
    assert replay.stack.at(pushes[0] - 1) == ()
    assert replay.stack.at(pushes[0]) == (first,)
    assert replay.stack.at(pushes[1]) == (first, second)
    assert replay.stack.at(pops[0]) == (first,)
    assert replay.stack.at(pops[1]) == ()


def test_a_request_leaves_the_stack_wherever_it_stands_in_it(tmp_path: Path) -> None:
    """The first one is over before the second."""
    lines = made_traces.chain()
    pushes = [line for line in lines if line["type"] == "push"]
    pops = [line for line in lines if line["type"] == "pop"]
    keys = ("obstacle", "requester", "helper")
    for pop, push in zip(pops, pushes, strict=True):
        pop.update({key: push[key] for key in keys})
    replay = read_run(made_traces.write(lines, tmp_path / "t.jsonl"))
    (left,) = replay.stack.at(pops[0]["tick"])
    assert left.obstacle == pushes[1]["obstacle"] and left.requester == pushes[1]["requester"]
    assert replay.stack.at(pops[1]["tick"]) == ()


def test_helpers_objectives_and_needs_follow_an_obstacle_with_two_needs(tmp_path: Path) -> None:
    """The second need has a request without a push: other robots help, the first is free again."""
    run = play(beside(__file__, "scenarios/two_needs.yaml"))
    replay = read_run(made_traces.write(run.records, tmp_path / "t.jsonl"))
    sensed, cleared = (line["tick"] for line in run.all("met"))
    first, second = (row for _, row in replay.stack if row)
    assert (first[0].helpers, second[0].helpers) == (("eye",), ("doz",))
    assert replay.stack.at(sensed) == second
    assert replay.objectives["eye"].at(sensed - 1) != Hold((frozenset({0}),))
    assert replay.objectives["eye"].at(sensed) == Hold((frozenset({0}),))
    assert replay.objectives["doz"].at(sensed) != Hold((frozenset({14}),))
    needs = [replay.met["rubble@10"].at(tick) for tick in range(cleared + 1)]
    assert [needs.index(n) for n in (0, 1, 2)] == [0, sensed, cleared]
    inputs = [(e.tick, e.text) for e in replay.events if e.kind is StoryKind.INPUTS]
    assert inputs == [(2, "inputs: fog on"), (3, "inputs: none on")]


TWICE = """\
safenav: 1
map: {grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}
robots: {quad: {model: quadcopter, start: 10, objective: {patrol: [10, 12]}}}
obstacles:
  - {type: door, region: 22, from: FIRST, until: 5}
  - {type: door, region: 22, from: 8, until: 10}
until: {rounds: 4}
"""


@pytest.mark.parametrize("first", [0, 2])
def test_an_obstacle_is_there_each_time_it_appears_and_not_between(
    first: int, tmp_path: Path
) -> None:
    """It was missing until its second time, and "resolved" when it had disappeared."""
    text = TWICE.replace("from: FIRST, ", f"from: {first}, " if first else "")
    replay = read_run(made_traces.write(play(text).records, tmp_path / "t.jsonl"))
    there = [tick for tick in range(replay.last + 1) if replay.at(tick).obstacles]
    assert there == [*range(first, 5), 8, 9]
    assert {status for tick in there for _, status, _ in replay.at(tick).obstacles} == {
        ObstacleStatus.HIDDEN
    }


def test_each_round_is_reported_once(replays: dict[str, Run]) -> None:
    """With the target that ends it, not with those of the next round."""
    goals = [event for event in replays["door"].events if event.kind is StoryKind.GOAL]
    for robot in ("quad", "digit"):
        told = [e.text.partition(", ")[2] for e in goals if e.robot == robot]
        assert "round 1 done" in told and "" in told
        assert not any(one and one == after for one, after in pairwise(told))


def test_objectives_in_force_follow_push_and_pop(replays: dict[str, Run]) -> None:
    replay = replays["door"]
    patrol = Patrol((frozenset({54}), frozenset({49})))
    assert replay.objectives["quad"].at(10) == patrol
    assert replay.objectives["quad"].at(11) == Hold((frozenset({46}),))
    assert replay.objectives["digit"].at(11) == Visit((frozenset({47}), frozenset({58})))
    assert replay.objectives["quad"].at(16) == patrol


def test_only_the_last_target_of_once_is_held(tmp_path: Path) -> None:
    scenario = """
safenav: 1
map: {grid: ["######", "#....#", "######"]}
robots: {quad: {model: quadcopter, start: 7, objective: {once: [9, 8]}}}
until: {rounds: 1}
"""
    replay = read_run(made_traces.write(play(scenario).records, tmp_path / "t.jsonl"))
    goals = [e.text for e in replay.events if e.kind is StoryKind.GOAL]
    assert goals == ["quad reaches 9", "quad holds 8"]


def test_between_two_ticks_a_robot_is_on_its_way(replays: dict[str, Run]) -> None:
    replay = replays["door"]
    digit = replay.robots[1]
    world = replay.map
    turn = next(t for t in range(replay.last) if digit.headings[t] is not digit.headings[t + 1])
    (r0, c0), (r1, c1) = (world.position(digit.regions[t]) for t in (turn, turn + 1))
    placed = replay.at(turn, 0.5).robots[1]
    assert (placed.row, placed.col) == ((r0 + r1) / 2, (c0 + c1) / 2)
    after = digit.headings[turn + 1]
    assert after is not None and placed.heading is not None
    assert placed.heading % 360 == after * 90  # it has turned before it is half way


def test_a_cut_off_trace_ends_with_its_last_complete_tick(
    traces: dict[str, Path], tmp_path: Path
) -> None:
    whole = traces["door"].read_text()
    for size in range(len(whole) // 3, len(whole) - 1, 997):
        cut = tmp_path / "cut.jsonl"
        cut.write_text(whole[:size])
        replay = read_run(cut)
        assert replay.ending is None
        assert all(len(track.regions) == replay.last + 1 for track in replay.robots)
        assert all(event.tick <= replay.last for event in replay.events)


def _first(lines: list[Line], kind: str) -> Line:
    return next(line for line in lines if line["type"] == kind)


BREAKAGES: dict[str, tuple[str, Callable[[list[Line]], object]]] = {
    "a move off the map": (
        "91 is not a region of the map",
        lambda lines: _first(lines, "move").update(to=91),
    ),
    "a move of a stranger": (
        "no robot nobody",
        lambda lines: _first(lines, "move").update(robot="nobody"),
    ),
    "a tick left out": (
        "the next move of quad is that of tick 1, not of tick 2",
        lambda lines: lines.remove(_first(lines, "move")),
    ),
    "an obstacle that is not there": (
        "no obstacle door@48",
        lambda lines: _first(lines, "violation").update(obstacle="door@48"),
    ),
    "a field of the wrong type": (
        "`tick`",
        lambda lines: _first(lines, "move").update(tick="soon"),
    ),
    "no header": ("header", lambda lines: lines.pop(0)),
}


@pytest.mark.parametrize("breakage", BREAKAGES)
def test_broken_traces_are_refused_with_file_and_line(breakage: str, tmp_path: Path) -> None:
    lines = made_traces.door()
    message, damage = BREAKAGES[breakage]
    damage(lines)
    path = made_traces.write(lines, tmp_path / "broken.jsonl")
    with pytest.raises(InputError) as caught:
        read_run(path)
    first = caught.value.diagnostics[0]
    assert message in first.found
    assert first.file == str(path) and first.line >= 1


PUSHED = beside(__file__, "scenarios/pushed.yaml")


def test_an_obstacle_on_which_a_robot_acts_is_not_hidden(tmp_path: Path) -> None:
    path = tmp_path / "pushed.jsonl"
    path.write_text(play(PUSHED).text)
    told = [status.value for _, status in read_run(path).statuses["door@10"]]
    assert told == ["hidden", "found", "resolved"]
