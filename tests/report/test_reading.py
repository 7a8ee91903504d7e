"""A trace becomes a run, at once or while it is written: what the lines say, and which are refused.

`test_transcripts.py` has whole runs."""

from pathlib import Path
from typing import Any

import click
import pytest
from msgspec.structs import replace

from report.runs import changed, own, trace_of
from safenav import Clock, InputError, Obstacle, ObstacleType, Verdict, load_scenario_text, read_run
from safenav.report.terminal import story
from safenav.report.terminal.story import Story, syntheses_words
from safenav.run.reading import RunReader
from safenav.scenario.model import OPERATOR_ACTION
from safenav.trace import records, vocabulary
from safenav.trace.fields import objective_of
from safenav.trace.file import unstarted

ROOM = own("room")


@pytest.mark.parametrize(("until", "kind"), [(None, "waiting"), (30.0, "paused")])
def test_waiting_for_an_operator_differs_from_waiting_for_a_change(
    tmp_path: Path, until: float | None, kind: str
) -> None:
    wait = {"outcome": "operator_needed", "explanation": "no robot helps", "until": until}
    line = {"line": ["move", {"tick": 46}, -1], "insert": {"type": "waiting", **wait}}
    events = read_run(changed("door", [line], tmp_path)).events
    assert [e.kind for e in events if "waits for" in e.text] == [kind]


@pytest.mark.parametrize("same", [False, True], ids=["of two obstacles", "of one obstacle"])
def test_a_request_leaves_the_stack_wherever_it_stands_in_it(same: bool, tmp_path: Path) -> None:
    """The first one is over before the second."""
    first = {"obstacle": "uncertainty@43", "requester": "digit", "helpers": ["quad"]}
    second = {"obstacle": "door@47", "requester": "quad", "helpers": ["digit"]}
    second |= {"obstacle": first["obstacle"]} if same else {}
    lines = ((["push", {}, 1], second), (["pop", {}, 0], first), (["pop", {}, 1], second))
    edits = [{"line": line, "fields": fields} for line, fields in lines]
    stack = read_run(changed("chain", edits, tmp_path)).stack
    (left,) = stack[-2][1]
    assert (left.obstacle, left.requester) == (second["obstacle"], "quad")
    assert stack.now == ()


def test_a_cut_off_trace_ends_with_its_last_complete_tick(tmp_path: Path) -> None:
    """Events of an incomplete tick belong to it."""
    lines, cut = trace_of("door").read_text().splitlines(True), tmp_path / "cut.jsonl"
    events = [n for n, line in enumerate(lines) if '"violation"' in line or '"request"' in line]
    for size in (*events, *(n + 1 for n in events), len(lines) - 1):
        cut.write_text("".join(lines[:size]) + lines[size][:9])
        run = read_run(cut)
        assert run.ending is None
        assert all(len(track.regions) == run.last + 1 for track in run.robots)
        assert all(event.tick <= run.last for event in run.events)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ({"line": ["move"], "fields": {"to": 91}}, "91 is not a region of the map"),
        ({"line": ["move"], "fields": {"robot": "nobody"}}, "no robot nobody"),
        ({"line": ["move"]}, "the next move of quad is that of tick 1, not of tick 2"),
        ({"line": ["violation"], "fields": {"obstacle": "door@48"}}, "no obstacle door@48"),
        ({"line": ["move"], "fields": {"tick": "soon"}}, "`tick`"),
        ({"line": 1}, "header"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_broken_traces_are_refused_with_file_and_line(
    edit: dict[str, Any], message: str, tmp_path: Path
) -> None:
    path = changed("door", [edit], tmp_path)
    with pytest.raises(InputError) as caught:
        read_run(path)
    first = caught.value.diagnostics[0]
    assert message in first.found
    assert first.file == str(path) and first.line >= 1


def test_a_robot_that_an_operator_puts_back_is_there() -> None:
    """Pages drew it where it was lost until its next step."""
    reader = RunReader(unstarted(replace(load_scenario_text(ROOM), clock=Clock.LIVE)).header)
    put = vocabulary.OperatorIntervention.PUT_BACK
    reader.append(records.Operator(1, put, robot="quad", region=10, t=2.0))
    assert reader.run.track("quad").regions == [7, 10]
    assert reader.run.events[-1].text == "an operator intervenes: put back quad at 10"


def test_found_obstacles_block_the_view_until_they_are_resolved(tmp_path: Path) -> None:
    seeing = {"line": 1, "fields": {"scenario.robots.quad.model.vision": 4}}
    run = read_run(changed("door", [seeing], tmp_path))
    quad = run.track("quad")
    assert quad.regions[10] == quad.regions[11] == 46
    before, found, after = (run.sight(quad, tick) or [] for tick in (10, 11, 16))
    assert 48 in before and 48 not in found and 48 in after
    assert 47 in found, "the closed doorway itself is seen"


def told(*lines: records.Record, text: str = ROOM, maps: bool = False) -> list[str]:
    """What the story says of these lines, with colours."""
    said: list[str] = []
    tell = Story(load_scenario_text(text), lambda line: said.append(str(line)), maps=maps)
    for line in lines:
        tell(line)
    return said


def test_names_are_marked_wherever_they_stand() -> None:
    (said,) = told(records.Request(3, "door@9", "quad", {"digit": 1}, ("digit",)))
    quad, digit = click.style("quad", fg="cyan"), click.style("digit", fg="yellow")
    door = click.style("door@gate", bold=True)
    assert said.endswith(f"  {quad} requests help with {door}: {digit} needs 1 tick; {digit} helps")


@pytest.mark.parametrize(("most", "drawn"), [(24, 2), (23, 1)])
def test_a_large_map_is_drawn_once(most: int, drawn: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run on 256 x 256 regions printed 256 kB at each request."""
    monkeypatch.setattr(story, "LARGE", most)
    gone = records.Gone(1, "door@9", vocabulary.ChangeCause.WORLD)
    header = unstarted(load_scenario_text(ROOM)).header
    said = told(header, records.Move(1, "quad", 7, 8, None), gone, maps=True)
    assert sum("██" in line for line in said) == drawn * 4


def failure(obstacle: str) -> list[records.Record]:
    """Lines of a robot that is lost, or cannot go on."""
    about = Obstacle(ObstacleType(obstacle.partition("@")[0], OPERATOR_ACTION), 9)
    met = records.Violation(2, "quad", 8, 9, obstacle, OPERATOR_ACTION)
    return [records.Discovered(2, about), met]


def ended(reason: str) -> list[records.Record]:
    failed = {"door@9": vocabulary.ActResult.FAILED}
    return [records.ActionEnd(4, 1, "quad", failed, None, reason)]


def lost(earliest: int | None) -> list[records.Record]:
    return [records.Deadline(4, "door@9", 15, vocabulary.DeadlineVerdict.LOST, earliest)]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (
            failure("unknown_air@9"),
            "quad at 8 [1, 2] cannot enter gate 9 [1, 3], which counts as unknown_air@gate: only "
            "an operator can resolve it",
        ),
        (failure("lost_quad@9"), "quad at 8 [1, 2] is lost: it may also be at gate 9 [1, 3]"),
        (ended("failed"), "the action of quad ends (door@gate: failed)"),
        (ended("it jams"), "the action of quad ends (door@gate: failed, it jams)"),
        (lost(16), "door@gate cannot be resolved before tick 16, and is due at tick 15"),
        (lost(None), "door@gate can never be resolved, and is due at tick 15"),
    ],
)
def test_failures_name_their_reason_once(lines: list[records.Record], said: str) -> None:
    """And no lacking capability."""
    assert [click.unstyle(line)[11:] for line in told(*lines)] == [said]


@pytest.mark.parametrize("restarts", [True, False], ids=["a door", "a battery"])
def test_restarting_rounds_are_reported_once(restarts: bool) -> None:
    """Rounds are counted from the last resolution on, but a flat battery interrupts them only."""
    battery = "catalogue: {obstacles: {cell: {action: push, blocks: []}}}\nflat: cell\n"
    kind = "door" if restarts else "cell"
    first, second = (records.Goal(tick, "quad", 0, 7, 1) for tick in (4, 9))
    opened = records.Resolved(5, f"{kind}@9", "digit", 8, False, True)
    gone = records.Gone(6, f"{kind}@9", vocabulary.ChangeCause.WORLD)
    lines = (first, opened, opened, gone, second)
    said = [
        click.unstyle(line)[11:] for line in told(*lines, text=ROOM.replace("door", kind) + battery)
    ]
    done = "quad reaches 7 [1, 1], round 1 done"
    kept = [line for line in said if "round" in line]
    assert kept == ([done, "rounds restart", done] if restarts else [done])


@pytest.mark.parametrize(
    ("count", "cached", "verified", "told"),
    [
        (13, 2, True, "13 strategies (1 to 13 states, 2 from the cache, verified)"),
        (13, 13, True, "13 strategies (1 to 13 states, all from the cache, verified)"),
        (13, 0, False, None),
        (8, 0, True, None),
    ],
)
def test_many_strategies_share_one_sentence(
    count: int, cached: int, verified: bool, told: str | None
) -> None:
    why, won, own = vocabulary.Reason.INITIAL, Verdict.REALIZABLE, objective_of({"hold": 4})
    found = [
        records.Synthesis(0, "q", why, won, 0.1, k + 1, k < cached, verified, "ab" * 32, None, own)
        for k in range(count)
    ]
    assert syntheses_words(found) == told
