"""A trace becomes a replay: places, knowledge, objectives and stack at every tick."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from once import beside
from report import made_traces
from safenav.errors import InputError
from safenav.run.reading import RunReader, read_run
from safenav.scenario.model import Clock
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.file import unstarted
from safenav.trace.records import Operator
from safenav.trace.vocabulary import OperatorIntervention
from support.damage import team

Line = dict[str, Any]


@pytest.mark.parametrize(("until", "kind"), [(None, "waiting"), (30.0, "paused")])
def test_waiting_for_an_operator_differs_from_waiting_for_a_change(
    tmp_path: Path, until: float | None, kind: str
) -> None:
    lines = made_traces.door()
    wait = {"outcome": "operator_needed", "explanation": "no robot helps", "until": until}
    lines.insert(-1, {"type": "waiting", "tick": lines[-1]["tick"], **wait})
    events = read_run(made_traces.write(lines, tmp_path / "t.jsonl")).events
    assert [e.kind for e in events if "waits for" in e.text] == [kind]


def test_a_request_leaves_the_stack_wherever_it_stands_in_it(tmp_path: Path) -> None:
    """The first one is over before the second."""
    lines = made_traces.chain()
    pushes = [line for line in lines if line["type"] == "push"]
    pops = [line for line in lines if line["type"] == "pop"]
    keys = ("obstacle", "requester", "helpers")
    for pop, push in zip(pops, pushes, strict=True):
        pop.update({key: push[key] for key in keys})
    replay = read_run(made_traces.write(lines, tmp_path / "t.jsonl"))
    (left,) = replay.stack.at(pops[0]["tick"])
    assert left.obstacle == pushes[1]["obstacle"] and left.requester == pushes[1]["requester"]
    assert replay.stack.at(pops[1]["tick"]) == ()


def test_a_cut_off_trace_ends_with_its_last_complete_tick(
    traces: dict[str, Path], tmp_path: Path
) -> None:
    whole = traces["door"].read_text()
    for size in range(len(whole) // 3, len(whole) - 1, 4999):
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


def test_a_robot_that_an_operator_puts_back_is_there() -> None:
    """Pages drew it where it was lost until its next step."""
    scenario = load_scenario_text(beside(__file__, "scenarios/room.yaml"))
    reader = RunReader(unstarted(replace(scenario, clock=Clock.LIVE)).header)
    put = OperatorIntervention.PUT_BACK
    reader.append(Operator(1, put, robot="quad", region=10, t=2.0))
    assert reader.run.track("quad").regions == [7, 10]
    assert reader.run.events[-1].text == "an operator intervenes: put back quad at 10"


def test_found_obstacles_block_the_view_until_they_are_resolved(tmp_path: Path) -> None:
    lines = made_traces.door()
    team(lines[0])["quad"]["model"]["vision"] = 4
    replay = read_run(made_traces.write(lines, tmp_path / "t.jsonl"))
    quad = replay.track("quad")
    assert quad.regions[10] == quad.regions[11] == 46
    before, found, after = (replay.sight(quad, tick) or [] for tick in (10, 11, 16))
    assert 48 in before and 48 not in found and 48 in after
    assert 47 in found, "the closed doorway itself is seen"
