"""The times of motions, in lockstep and with a clock; their files, columns, waypoints and
requirements."""

import csv
import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import polynomial

from fleet.drives import lines_of
from motion.runs import findings, live_trace, motion, moved, played, written
from once import SCENARIOS, beside, from_yaml, trace_of_shipped
from report.runs import data_of, paged
from safenav import InputError, UsageError, check_motion, load_scenario_text, motion_of, read_trace
from support.transcripts import golden, rounded
from warm import safenav

Line = dict[str, Any]


def trace_of(text: str, folder: Path) -> Path:
    """The trace of a scenario that is given as text."""
    (trace := folder / "t.jsonl").write_bytes(played(text))
    return trace


def accepted(trace: Path) -> list[Line]:
    """The lines of the motion of a trace, which breaks no rule."""
    file = moved(trace, trace.parent)
    (said,) = findings(trace, file)
    assert said["findings"] == []
    return lines_of(file)


def exported(trace: Path, *words: object, form: str = "npz") -> Any:
    """What the motion of a trace is for other programs: columns of numbers, or rows of a table."""
    file = trace.parent / f"{trace.stem}.exported.{form}"
    done = safenav("export", trace, *words, "-o", file)
    assert done.returncode == 0, done.stderr
    if form == "npz":
        return np.load(file)
    with file.open() as table:
        return list(csv.DictReader(table))


def of(lines: list[Line], kind: str, robot: str | None = None) -> list[Line]:
    return [one for one in lines if one["type"] == kind and robot in (None, one["robot"])]


def steps(lines: list[Line], robot: str) -> list[Line]:
    moves = [*of(lines, "segment", robot), *of(lines, "flight", robot)]
    return [move for move in moves if move["from"] != move["to"]]


def test_a_robot_without_charge_stands_until_its_battery_is_replaced(tmp_path: Path) -> None:
    trace, lines = trace_of_shipped("battery_delivery"), lines_of(motion("battery_delivery"))
    replaced = max(line["t1"] for line in of(lines, "action"))
    walked = steps(lines, "digit")
    flat = max(move["t1"] for move in walked if move["t0"] < replaced)
    assert flat < replaced <= min(move["t0"] for move in walked if move["t0"] >= flat)
    page = paged(trace, tmp_path, "--3d", "--motion", str(motion("battery_delivery")))
    data = data_of(page)
    told = {text: data["times"][at] for at, _, text, *_ in data["events"]}
    assert told["digit is out of service"] == pytest.approx(flat, abs=1e-3)
    assert told["digit is back in service"] == pytest.approx(replaced, abs=1e-3)
    # A decision after it would hide that it waits.
    kept = [line for line in lines_of(trace) if line["type"] not in ("synthesis", "plan")]
    run = read_trace(written(kept, tmp_path / "undecided.jsonl"))
    assert check_motion(motion_of(run), run) == []


@pytest.mark.parametrize("clock", ["lockstep", "live"])
@pytest.mark.parametrize("kind", ["disc", "rover"])
def test_a_robot_acts_on_one_obstacle_after_the_other(
    kind: str, clock: str, tmp_path: Path
) -> None:
    """On two in front of the centre of its region, then from there on one beside it. With a clock
    it did all in front of it, and had no time for its next step: the run was refused."""
    text = beside(__file__, "scenarios/tidying.yaml").replace("speed:", f"motion: {kind}, speed:")
    trace = trace_of(f"{text}clock: {clock}\n", tmp_path)
    acts = of(accepted(trace), "action")
    assert [act["obstacle"] for act in acts] == ["door@7", "parcel@7", "rubble@8"]
    columns = exported(trace, tmp_path / "t.motion.jsonl")
    x = np.interp([(act["t0"] + act["t1"]) / 2 for act in acts], columns["t"], columns["cart.x"])
    assert x == pytest.approx([5.7, 5.7, 6.75])
    assert [act["t1"] - act["t0"] for act in acts] == pytest.approx([2.0] * 3)


def test_an_obstacle_appears_and_disappears_at_the_instants_of_its_ticks(tmp_path: Path) -> None:
    """In 3D a door of tick 5 is neither there nor gone at the beginning."""
    trace = trace_of(beside(__file__, "scenarios/closing.yaml"), tmp_path)
    lines, page = accepted(trace), paged(trace, tmp_path, "--3d")
    walked = [move for robot in lines[0]["robots"] for move in steps(lines, robot)]
    ends = [max(move["t1"] for move in walked if move["tick"] < tick) for tick in (5, 12)]
    (door,) = (data := data_of(page))["obstacles"]
    assert [data["times"][at] for at, _ in door["status"][1:]] == pytest.approx(ends, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "delayed"),
    [("beam", 0.4), ("case_study_2", 0.0), ("parked_robot", 0.4), ("case_study_1", 0.4)],
)
def test_motion_starts_at_departures_and_ends_at_arrivals(name: str, delayed: float) -> None:
    trace = read_trace(live_trace(name, delayed))
    assert check_motion(motion_of(trace), trace) == []


def changed(change: Callable[[list[Line]], None], folder: Path) -> Path:
    """A live trace of case study 1 with other lines."""
    lines = lines_of(live_trace("case_study_1", 0.4))
    change(lines)
    return written(lines, folder / "t.jsonl")


def first(lines: list[Line], **wanted: object) -> Line:
    return next(line for line in lines if wanted.items() <= line.items())


def test_a_robot_whose_step_failed_stays_where_it_began(tmp_path: Path) -> None:
    def fail(lines: list[Line]) -> None:
        """The first step of the quadcopter fails, and is tried again."""
        arrive = first(lines, type="arrive", robot="quad")
        for line in lines[1:]:
            if line["t"] >= arrive["t"] and line is not arrive:
                line["t"] += 20.0
        depart = first(lines, type="depart", robot="quad")
        again = {**arrive, "t": arrive["t"] + 10.0, "command": 901, "tick": depart["tick"]}
        lines[lines.index(arrive)] = {**arrive, "at": depart["from"], "result": "failed"}
        place = next(i for i, line in enumerate(lines) if i and line["t"] > again["t"])
        new = {**depart, "t": arrive["t"] + 1.0, "command": 901}
        lines[place:place] = [new, again]

    trace = read_trace(changed(fail, tmp_path))
    made = motion_of(trace)
    assert check_motion(made, trace) == []
    first_move = next(line for line in made.lines if line.robot == "quad" and hasattr(line, "to"))
    assert first_move.origin == first_move.to and first_move.t1 > 5.0


@pytest.mark.parametrize(
    ("line", "wrong", "found"),
    [
        ({"type": "arrive", "robot": "digit"}, {"t": 3.54}, "digit takes 3.54 s"),
        ({"type": "arrive", "robot": "quad"}, {"at": 54}, "but arrives in region 54: no motion"),
        ({"type": "depart", "robot": "quad"}, {"from": 40}, "departs from region 40, but was in"),
        ({"type": "acted", "robot": "digit"}, {"t": 92.0}, "acts until 92.00 s, but comes to rest"),
    ],
)
def test_a_live_trace_that_no_motion_can_follow_is_refused(
    line: Line, wrong: Line, found: str, tmp_path: Path
) -> None:
    def change(lines: list[Line]) -> None:
        first(lines, **line).update(wrong)

    with pytest.raises(InputError, match=found):
        motion_of(read_trace(changed(change, tmp_path)))


def test_the_motion_of_each_kind_of_robot_stays_the_same(tmp_path: Path) -> None:
    """The file, the waypoints, the columns and a simulated flight stay."""
    trace = trace_of(beside(__file__, "scenarios/kinds.yaml"), tmp_path)
    header, *lines = accepted(trace)
    told = [{key: header[key] for key in header.keys() - {"trace", "safenav"}}, *lines]
    told = [json.dumps(rounded(line), sort_keys=True) for line in told]
    motion = tmp_path / "t.motion.jsonl"
    told += [",".join(row.values()) for row in exported(trace, motion, form="csv")]
    columns = exported(trace, motion, "--rate", "10")
    told += [f"{name}: {rounded(columns[name][::33].tolist())}" for name in columns]
    (track,) = of(lines_of(moved(trace, tmp_path, "--track")), "track")
    told += [str(rounded(row, 3)) for row in track["rows"][::100]]
    text = "\n".join(told).replace("-3.14159", "3.14159")  # the same direction
    golden(text + "\n", Path(__file__).with_name("kinds.txt"))


def test_unknown_lines_and_fields_of_a_motion_are_ignored(tmp_path: Path) -> None:
    trace, file = trace_of_shipped("team_of_six"), motion("team_of_six")
    first, second, *rest = lines_of(file)
    weather = {"type": "weather", "rain": True}
    more = written([first, second | {"colour": "red"}, weather, *rest], tmp_path / "more.jsonl")
    assert findings(trace, more) == [findings(trace, file)[0] | {"file": str(more)}]


@pytest.mark.parametrize("to", [b"90", b"71"], ids=["a jump", "backwards"])
def test_a_trace_with_impossible_moves_has_no_motion(to: bytes, tmp_path: Path) -> None:
    """The error is a UsageError, not KeyError, StopIteration or ZeroDivisionError."""
    content, old = trace_of_shipped("case_study_1").read_bytes(), b'"from":58,"to":57'
    assert old in content
    (trace := tmp_path / "moved.jsonl").write_bytes(content.replace(old, old[:-2] + to, 1))
    with pytest.raises(UsageError, match=r"moved\.jsonl breaks a rule"):
        motion_of(read_trace(trace))


def test_velocity_columns_are_derivatives_of_positions_in_the_world_frame(tmp_path: Path) -> None:
    (trace := tmp_path / "plain.jsonl").write_bytes(trace_of_shipped("case_study_1").read_bytes())
    columns = {**exported(trace, motion("case_study_1"), "--rate", "500")}
    for robot in ("digit", "quad"):
        for axis in "xy":
            speed = np.gradient(columns[f"{robot}.{axis}"], 2e-3)
            assert np.abs(speed - columns[f"{robot}.vel_{axis}"])[1:-1].max() < 0.01
        assert np.ptp(turns := np.unwrap(columns[f"{robot}.yaw"])) > 1.0
        assert np.abs(np.diff(turns, 2)).max() < 1e-4  # it begins and ends its turns at rest
    text = (SCENARIOS / "case_study_1.yaml").read_text()
    placed = f"map:\n  resolution: 2.7\n  origin: [10.0, 20.0, {np.pi / 2}]\n"
    turned = trace_of(text.replace("map:\n", placed), tmp_path)
    turned = exported(turned, "--motion", tmp_path / "m.jsonl", "--rate", "10")
    for robot in ("digit", "quad"):
        mine, theirs = (
            {name: found[f"{robot}.{name}"][::each] for name in ("x", "y", "vel_x", "vel_y", "yaw")}
            for found, each in ((turned, 1), (columns, 50))
        )
        np.testing.assert_allclose(mine["x"], 10 - theirs["y"], atol=1e-9)
        np.testing.assert_allclose(mine["y"], 20 + theirs["x"], atol=1e-9)
        np.testing.assert_allclose(mine["vel_x"], -theirs["vel_y"], atol=1e-9)
        np.testing.assert_allclose(mine["yaw"], theirs["yaw"] + np.pi / 2, atol=1e-9)


def test_waypoints_of_a_live_run_are_the_poses_of_each_robot(tmp_path: Path) -> None:
    """A robot has no waypoints at events of other robots."""
    (trace := tmp_path / "t.jsonl").write_bytes(live_trace("case_study_2").read_bytes())
    rows = exported(trace, "--side", "1", form="csv")
    assert all(row["t"] and not row["z"] and not row["speed"] for row in rows)
    poses = [[row[key] for key in ("robot", "x", "y", "yaw")] for row in rows]
    assert all(one != other for one, other in pairwise(poses))


@pytest.mark.parametrize("name", ["case_study_1", "case_study_3", "search_and_rescue"])
def test_a_flyer_passes_centres_without_a_halt_where_its_next_step_follows(name: str) -> None:
    header, *lines = lines_of(motion(name))
    passed, stopped = 0, 0
    flyers = [robot for robot, own in header["robots"].items() if own["kind"] == "flyer"]
    for one, other in (pair for robot in flyers for pair in pairwise(of(lines, "flight", robot))):
        seconds, x, y, *_ = one["curves"][-1]
        paths = [polynomial.polyder(path) for path in (x, y)]
        speed = np.hypot(*(polynomial.polyval(seconds - 1e-6, path) for path in paths))
        flies = one["primitive"] == other["primitive"] == "fly" and one["from"] != other["to"]
        assert bool(speed > 0.2) is flies, (one["robot"], one["t1"])
        passed, stopped = passed + flies, stopped + (not flies)
    assert passed > 5 and stopped > 1


def test_a_run_without_moves_still_has_all_poses(tmp_path: Path) -> None:
    still = trace_of(beside(__file__, "scenarios/still.yaml"), tmp_path)
    found = exported(still, "--motion", tmp_path / "m.jsonl")
    assert {*found["a.x"]} == {1.5 * 2.7} and {*found["a.vel_x"]} == {0.0}


CASES = from_yaml(beside(__file__, "requirements.yaml"))


@pytest.mark.parametrize("wrong", CASES["wrong"], ids=lambda wrong: wrong["text"][:20])
def test_an_error_names_the_column_and_the_fix(wrong: Line) -> None:
    hello, text = (SCENARIOS / "hello.yaml").read_text(), wrong["text"] * wrong.get("times", 1)
    with pytest.raises(InputError) as caught:
        load_scenario_text(f"{hello}requirements:\n  r: {json.dumps(text)}\n")
    (found,) = caught.value.diagnostics
    assert found.column == wrong["column"] + 6 - (not text)  # after ``  r: "``
    assert wrong["words"] in f"{found.found} {found.hint}"


@pytest.mark.parametrize("wrong", CASES["refused"], ids=lambda wrong: wrong["text"])
def test_a_formula_that_cannot_be_evaluated_is_refused(wrong: Line) -> None:
    more = ("--require", wrong["text"], "--rate", wrong.get("rate", 50))
    done = safenav("check", trace_of_shipped("case_study_1"), motion("case_study_1"), *more)
    assert done.returncode == 2 and wrong["words"] in done.stderr


def test_case_study_1_is_judged_on_its_motion() -> None:
    """The door is resolved 32.3 s after the request, and the quadcopter passes above Digit."""
    trace, verdicts = trace_of_shipped("case_study_1"), CASES["verdicts"]
    more = [word for text in verdicts for word in ("--require", text)]
    done = safenav("check", "--json", trace, motion("case_study_1"), *more)
    (_, said) = json.loads(done.stdout)
    assert {one["name"]: one["verdict"] for one in said["requirements"]} == verdicts
    advice = {one["name"]: one.get("advice", "") for one in said["requirements"]}
    assert "past the end" in advice["always[0,400](height(quad) > 2)"]
    assert "raise the sampling rate: --rate" in advice["always(distance(quad, digit) >= 1.4)"]
