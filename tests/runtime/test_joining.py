"""A robot that the scenario does not have joins a run that needs it."""

from pathlib import Path

import pytest
from msgspec.structs import replace
from safenav.runtime.knowledge import Knowledge

import warm
from runtime.test_operator import GATE
from safenav.audit.check import check_trace
from safenav.errors import UsageError
from safenav.runtime.intervention.reading import read_intervention
from safenav.scenario.reading.joining import joined
from safenav.scenario.reading.loader import load_scenario_text
from safenav.team.failures import lost
from safenav.trace.reading import read_trace
from safenav.trace.records import Arrive, Resolved

PUSHER = "digit: {model: digit, start: [1, 2], heading: east, objective: {hold: [1, 2]}}"


def outcomes(*traces: Path) -> list[str]:
    """How the runs ended, each without a finding of the audit."""
    found = []
    for path in traces:
        assert check_trace(path).findings == ()
        end = read_trace(path).outcome
        assert end is not None
        found.append(end.outcome.value)
    return found


def test_an_operator_adds_a_robot_from_a_file(tmp_path: Path) -> None:
    """The run ends where it joins, and another goes on from there; nobody begins anew."""
    scenario, trace, rest = (tmp_path / n for n in ("gate.yaml", "run.jsonl", "run-2.jsonl"))
    scenario.write_text(GATE)
    lines = tmp_path / "operator.txt"
    lines.write_text(f"add {PUSHER.replace(':', '', 1)}\n")
    done = warm.safenav("run", scenario, "--trace", trace, "--operator", lines, "--no-map")
    assert done.returncode == 0, done.stdout + done.stderr
    assert outcomes(trace, rest) == ["interrupted", "completed"]
    first, second = read_trace(trace), read_trace(rest)
    assert "digit joins the team" in str(first.outcome)
    robots = second.header.scenario.robots
    assert [*robots] == ["cart", "bee", "digit"]
    arrived = [r for r in first.records if isinstance(r, Arrive) and r.robot == "cart"]
    assert robots["cart"].start == arrived[-1].at
    assert [r.obstacle for r in second.records if isinstance(r, Resolved)] == ["gate@27"]


def test_a_robot_joins_a_run_that_is_resumed(tmp_path: Path) -> None:
    scenario, trace, rest = (tmp_path / n for n in ("gate.yaml", "run.jsonl", "rest.jsonl"))
    scenario.write_text(GATE)
    assert warm.safenav("run", scenario, "--trace", trace, "--no-map").returncode == 1
    assert warm.safenav("resume", trace, "--trace", rest, "--no-map").returncode == 1
    done = warm.safenav("resume", trace, "--trace", rest, "--no-map", "--add", PUSHER)
    assert done.returncode == 0, done.stdout + done.stderr
    assert outcomes(trace, rest) == ["operator_needed", "completed"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (PUSHER.replace("digit:", "cart:"), "the team has a robot cart already"),
        (PUSHER.replace("[1, 2]", "[2, 1]"), "cart also starts in region 23"),
        (PUSHER.replace("start: [1, 2]", "start: [0, 0]"), "wall"),
        ("c: {model: cart, start: [2, 5], objective: {hold: [1, 2]}}", "gate@27 is where c starts"),
        (PUSHER.replace("model: digit", "model: digitt"), "digitt"),
        (PUSHER.replace("heading: east, ", ""), "heading"),
        (f"{PUSHER}\nb{PUSHER}", "one robot joins at a time|also starts"),
        ("digit", "expected a mapping"),
        ("digit: {", "flow mapping|expected"),
        ("", "is empty"),
    ],
)
def test_a_robot_that_cannot_join_is_refused(text: str, told: str) -> None:
    with pytest.raises(UsageError, match=told):
        joined(load_scenario_text(GATE), text)


BATTERY = "capabilities: [], battery: {capacity: 30, charge: 5}"
CELL = f"catalogue: {{robots: {{cell: {{mobility: free, layer: low, {BATTERY}}}}}}}\n"


@pytest.mark.parametrize(
    ("settings", "objective", "told"),
    [
        ("coordination: assignable", "hold: 9}, while_waiting: {hold: 10", "cannot keep 'while_w"),
        ("coordination: assignable", "patrol: [9, 10], form: literal", "cannot keep 'form: lit"),
        (
            "coordination: assignable\ninputs: {fire: {}}",
            "hold: 9}, when: {fire: {patrol: [9, 10], form: literal}",
            "cannot keep 'form: lit",
        ),
        ("coordination: assignable\nchargers: [8]", "visit: [9]", "a battery, which 'coordinat"),
        ("chargers: [8]", "cover: [9, 10]", "a battery, and an objective without an order"),
        ("chargers: [8]", "hold: 9}, while_waiting: {cover: [9, 10]", "without an order"),
        (
            "chargers: [8]\ninputs: {fire: {}}",
            "hold: 9}, when: {fire: {cover: [9, 10]}",
            "without an order",
        ),
        ("chargers: [12]", "visit: [9]", "reaches no charger"),
        ("seed: 1", "visit: [9]", "a battery, and the scenario has no charger"),
        ("clock: live\nchargers: [8]", "visit: [9], within: 9", "'clock: live' with deadlines"),
        ("chargers: [8]", "visit: [9], within: 9", ""),
    ],
)
def test_a_robot_that_the_settings_exclude_cannot_join(
    settings: str, objective: str, told: str
) -> None:
    """A scenario file with that robot would be refused for the same reason."""
    scenario = load_scenario_text(
        f'safenav: 1\nmap: {{grid: ["#######", "#...#.#", "#######"]}}\n{settings}\n{CELL}'
        "robots: {a: {model: quadcopter, start: 8, objective: {visit: [8]}}}\n"
    )
    text = f"b: {{model: cell, start: 9, objective: {{{objective}}}}}"
    if told:
        with pytest.raises(UsageError, match=told):
            joined(scenario, text)
    else:
        assert joined(scenario, text).robot("b").within == 9


def test_an_operator_assigns_no_form_that_the_settings_exclude() -> None:
    scenario = load_scenario_text(GATE + "coordination: assignable\n")
    assert read_intervention("objective cart {patrol: [23, 24]}", scenario)
    with pytest.raises(UsageError, match="cannot keep 'form: literal' of cart"):
        read_intervention("objective cart {patrol: [23, 24], form: literal}", scenario)


def test_regions_of_a_lost_robot_are_closed_to_a_robot_that_joins() -> None:
    scenario = load_scenario_text(GATE)
    cart, bee = scenario.robots
    places = (lost(cart, frozenset(), 14), lost(bee, frozenset(), 15))
    after = joined(replace(scenario, obstacles=places), PUSHER)
    digit = after.robot("digit")
    assert [place.closed_to(digit) for place in after.obstacles] == [True, False]


def test_an_obstacle_seen_by_a_robot_that_may_enter_it_is_closed_to_others() -> None:
    """Although their own sensors may fail to show it."""
    scenario = joined(load_scenario_text(GATE), PUSHER)
    (gate,), digit, cart = scenario.obstacles, scenario.robot("digit"), scenario.robot("cart")
    knowledge = Knowledge(scenario)
    knowledge.sight(gate)
    for known in (knowledge, knowledge.copy()):
        assert known.closing(gate.region, cart) == gate
        assert known.closing(gate.region, digit) is None and not known.knows(gate)
    knowledge.forget(gate)
    assert knowledge.closing(gate.region, cart) is None


def test_a_wrong_robot_of_an_operator_file_is_reported_with_its_line(tmp_path: Path) -> None:
    scenario, lines = tmp_path / "gate.yaml", tmp_path / "operator.txt"
    scenario.write_text(GATE)
    lines.write_text(
        "# more hands\nadd cart {model: cart, start: [1, 2], objective: {hold: [1, 2]}}"
    )
    done = warm.safenav("run", scenario, "--operator", lines, "--no-map")
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert f"{lines}:2: the team has a robot cart already" in done.stderr


@pytest.mark.parametrize(
    "later",
    [
        "service nobody out",
        "put_back digit 9999",
        "resolved gaet@27",
        "objective digit {hold: [0, 0]}",
    ],
)
def test_the_lines_after_one_that_adds_a_robot_are_read_before_the_run(
    later: str, tmp_path: Path
) -> None:
    scenario, lines, trace = (tmp_path / n for n in ("gate.yaml", "lines.txt", "run.jsonl"))
    scenario.write_text(GATE)
    lines.write_text(f"add {PUSHER}\n\n{later}\n")
    done = warm.safenav("run", scenario, "--operator", lines, "--no-map", "--trace", trace)
    assert (done.returncode, f"{lines}:3: " in done.stderr, trace.exists()) == (2, True, False)
