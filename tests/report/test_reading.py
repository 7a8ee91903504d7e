"""A trace becomes a run, complete or while it is written: events of lines, and refused lines.

`test_transcripts.py` has whole runs."""

import os
import re
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from report.runs import changed, own, trace_of
from safenav import InputError, read_run, read_trace
from safenav.report.page.html import LiveRun
from safenav.run.tracks import LongStep
from safenav.run.values import labels
from support import damage
from warm import safenav, started


@pytest.mark.parametrize(("until", "kind"), [(None, "waiting"), (30.0, "paused")])
def test_waiting_for_an_operator_differs_from_waiting_for_a_change(
    tmp_path: Path, until: float | None, kind: str
) -> None:
    wait = {"outcome": "operator_needed", "explanation": "no robot helps", "until": until}
    line = {"line": ["move", {"tick": 46}, -1], "insert": {"type": "waiting", **wait}}
    events = read_run(changed("door", [line], tmp_path)).events
    assert [e.kind for e in events if "waits for" in e.text] == [kind]


@pytest.mark.parametrize("same", [False, True], ids=["of two obstacles", "of one obstacle"])
def test_a_request_leaves_the_stack_at_any_position(same: bool, tmp_path: Path) -> None:
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


def test_a_page_of_a_live_run_receives_all_entries_that_are_new() -> None:
    trace = read_trace(trace_of("door"))
    live = LiveRun(trace.header, "door")
    for number, record in enumerate(trace.records):
        live.append(record)
        if number % 9:
            continue
        new, whole = live.news(), live.whole()
        for part, every in zip(new["robots"], whole["robots"], strict=True):
            assert part["path"] == every["path"][new["since"] :]
            for key in ("tasks", "progress"):
                assert part[key] == [entry for entry in every[key] if entry[0] >= new["since"]]


STEP = {"robot": "quad", "command": 1, "tick": 1}
DEPARTED = STEP | {"type": "depart", "from": 14, "to": 15, "heading": None, "by": "plan"}


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ({"line": ["move"], "fields": {"to": 91}}, "91 is not a region of the map"),
        ({"line": ["violation"], "fields": {"proposed": -1}}, "-1 is not a region of the map"),
        ({"line": ["move"], "fields": {"robot": "nobody"}}, "no robot nobody"),
        ({"line": ["request"], "fields": {"requester": "nobody"}}, "no robot nobody"),
        ({"line": ["move"]}, "the next move of quad is that of tick 1, not of tick 2"),
        ({"line": ["move", {"robot": "digit"}], "every": True}, "digit has no move in tick 1"),
        ({"line": ["move"], "insert": DEPARTED}, "a run without a clock has no steps in seconds"),
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


def events(folder: Path, *lines: damage.Line, clock: str = "lockstep") -> list[str]:
    """Return the events of these lines in a run in a room with a door."""
    whole = damage.read(trace_of("room"))
    whole[0]["scenario"] |= {"clock": clock}
    last = whole[-1] | {"tick": lines[-1]["tick"], "ticks": lines[-1]["tick"]}
    (trace := folder / "told.jsonl").write_text("\n".join(damage.text([whole[0], *lines, last])))
    return [event.text for event in read_run(trace).events[:-1]]


PUT_BACK = {"type": "operator", "tick": 1, "intervention": "put_back", "robot": "quad", "t": 2.0}


def test_a_robot_that_an_operator_puts_back_is_shown_there(tmp_path: Path) -> None:
    """It must not be drawn where it was lost until its next step."""
    said = events(tmp_path, PUT_BACK | {"region": 10}, clock="live")
    assert said[0] == "an operator intervenes: put back quad at 10"
    assert read_run(tmp_path / "told.jsonl").track("quad").regions[:2] == [7, 10]


def test_a_step_ends_only_after_it_has_begun(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="quad arrives without a departure"):
        events(tmp_path, CAME, clock="live")


def test_a_robot_whose_step_fails_turns_back(tmp_path: Path) -> None:
    events(tmp_path, LEFT, CAME | {"at": 7, "result": "failed"}, clock="live")
    run = read_run(tmp_path / "told.jsonl")
    rows = [run.place(run.track("quad"), *run.moment(time)) for time in (1.25, 1.5, 1.75, 2.0)]
    assert [round(col - 1, 3) for _, col, _ in rows] == [0.2, 0.4, 0.2, 0.0]


def failure(obstacle: str) -> list[damage.Line]:
    """Lines of a robot that is lost, or cannot go on."""
    kind = {"name": obstacle.partition("@")[0], "needs": [{"action": "operator"}]}
    about = {"type": kind, "region": 9}
    met = {"robot": "quad", "at": 8, "proposed": 9, "obstacle": obstacle, "action": "operator"}
    return [
        {"type": "discovered", "tick": 2, "obstacle": about},
        {"type": "violation", "tick": 2} | met,
    ]


def ended(reason: str) -> list[damage.Line]:
    done = {"robot": "quad", "command": 1, "results": {"door@9": "failed"}, "reason": reason}
    return [{"type": "acted", "tick": 4} | done]


LEFT = DEPARTED | {"t": 1.0, "from": 7, "to": 8, "seconds": 1.0}
CAME = STEP | {"type": "arrive", "tick": 2, "t": 2.0, "at": 8, "heading": None, "result": "arrived"}


def lost(earliest: int | None) -> list[damage.Line]:
    due = {"of": "door@9", "due": 15, "verdict": "lost", "earliest": earliest}
    return [{"type": "deadline", "tick": 4} | due]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (
            failure("unknown_air@9"),
            "quad at 8 cannot enter gate, which counts as unknown_air@gate: only an operator can "
            "resolve it",
        ),
        (failure("lost_quad@9"), "quad at 8 is lost: it may also be at gate"),
        (ended("failed"), "the action of quad ends (door@gate: failed)"),
        (ended("it jams"), "the action of quad ends (door@gate: failed, it jams)"),
        (lost(16), "door@gate cannot be resolved before tick 16, and is due at tick 15"),
        (lost(None), "door@gate can never be resolved, and is due at tick 15"),
        ([LEFT, CAME | {"reason": "slips"}], "quad is at 8, after another attempt (slips)"),
    ],
)
def test_the_event_of_a_failure_names_its_reason_once(
    lines: list[damage.Line], said: str, tmp_path: Path
) -> None:
    """And no lacking capability."""
    clock = "live" if "t" in lines[0] else "lockstep"
    assert events(tmp_path, *lines, clock=clock) == [said]


def test_a_terminal_highlights_names(tmp_path: Path) -> None:
    (tmp_path / "room.yaml").write_text(own("room"))
    reader, terminal = os.openpty()
    started("run", tmp_path / "room.yaml", out=terminal)
    os.close(terminal)
    said = b""
    with suppress(OSError):  # no process has the terminal open any longer
        while read := os.read(reader, 1 << 16):
            said += read
    os.close(reader)
    words = " ".join(said.decode().split())
    marked = r"\x1b\[38;2;0;114;178mquad\x1b\[0m requests help with \x1b\[1mdoor@gate\x1b\[0m: "
    assert re.search(marked + r"\x1b\[38;2;230;159;0mdigit\x1b\[0m needs", words), words
    assert "Q \x1b[38;2;0;114;178mquad\x1b[0m (quadcopter) from 7 [1, 1]" in words


def test_strategies_of_many_robots_share_one_sentence(tmp_path: Path) -> None:
    cache = os.environ | {"SAFENAV_CACHE": str(tmp_path / "cache")}

    def synthesized(count: int) -> str:
        """The story of robots in rooms of their own."""
        rooms = f'map: {{grid: ["{"#" * 28}", "#{"..#" * 9}", "{"#" * 28}"]}}'
        robots = [
            f"q{k}: {{model: quadcopter, start: {at}, objective: {{ltl: {{liveness: [region = {at} "
            f"| fog]}}}}}}"
            for k, at in enumerate(range(29, 29 + 3 * count, 3))
        ]
        text = f"safenav: 1\n{rooms}\nrobots: {{{', '.join(robots)}}}\n"
        text += "inputs: {fog: {at: 2, always_eventually: off}}\nuntil: {rounds: 1}\n"
        (tmp_path / "rooms.yaml").write_text(text)
        return safenav("run", tmp_path / "rooms.yaml", "--no-map", env=cache).stdout

    named, together = synthesized(8), synthesized(9)
    assert named.count(", verified") == named.count(" assumes: infinitely often fog is off") == 8
    assert "synthesized 9 strategies, verified\n" in together and "assumes" not in together


def test_a_step_is_never_shown_past_its_end() -> None:
    """It may last longer than expected."""
    step = LongStep(0, 3, 5, 0.0, 2.0)
    assert [step.part(time) for time in (-1.0, 1.0, 9.0)] == [0.0, 0.5, 1.0]


def test_a_label_consists_of_letters_and_numbers() -> None:
    assert labels(["a_x", "a-y", "b"]) == ["Ax", "Ay", "B"]
    assert labels(["dRone", "digit", "d2", "e_11", "e_12"]) == ["Dr", "Di", "D2", "11", "12"]
