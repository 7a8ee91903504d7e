"""``safenav explain`` of scenarios whose robots are unrealizable. Cores and plays of random ones:
``sentences``."""

import json
import re
from pathlib import Path

import pytest

from explain.conftest import Invoke
from once import SCENARIOS, beside
from safenav.cli.synth import explain as command
from safenav.explain.explanation import NoStrategyCause, RepairKind
from safenav.report.terminal.explanation_text import explanation_lines
from safenav.review.postmortem import explain_team
from safenav.runtime.run.mission import Mission, default_synthesizer, first_results
from safenav.scenario.reading.loader import load_scenario
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure

FOLDER = SCENARIOS / "unrealizable"
CAUSES = {
    "contradictory_objective": ("rover", NoStrategyCause.CONTRADICTION, RepairKind.OBJECTIVE),
    "crossing_a_target": ("rover", NoStrategyCause.CROSSING, RepairKind.OBJECTIVE),
    "dead_end": ("digit", NoStrategyCause.ONE_WAY, RepairKind.MOBILITY),
    "facing_the_wall": ("digit", NoStrategyCause.HEADING, RepairKind.HEADING),
    "forbidden_way": ("rover", NoStrategyCause.FORBIDDEN_WAY, RepairKind.OBJECTIVE),
    "impossible_start": ("rover", NoStrategyCause.IMPOSSIBLE_START, RepairKind.START),
    "no_room_to_turn": ("digit", NoStrategyCause.ONE_WAY, RepairKind.MOBILITY),
    "separate_rooms": ("digit", NoStrategyCause.NO_WAY, RepairKind.OPEN_WALL),
}
"""The robot of each shipped file, the true cause, and a repair that works."""


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.yaml")), ids=lambda file: file.stem)
def test_a_shipped_scenario_is_explained_and_repaired(file: Path) -> None:
    robot, cause, kind = CAUSES[file.stem]
    scenario = load_scenario(file, reachable=False)
    (found,) = explain_team(scenario, default_synthesizer(scenario))
    assert (found.robot, found.cause) == (robot, cause)
    assert found.core.alone, "it does not depend on other robots"
    text = "\n".join(explanation_lines(found, scenario))
    for part in ("because", "These guarantees conflict", "What happens", "Any one of these"):
        assert part in text
    assert "busy_" not in text.split("Any one of these")[0].split("What happens")[1]
    assert kind in {repair.kind for repair in found.repairs}
    for repair in found.repairs:
        answers = first_results(repair.scenario, Synthesizer(verifier=first_failure), names=[robot])
        assert answers[robot].realizable, repair.change
    if file.stem == "separate_rooms":
        assert {21, 34, 47, 60, 73} <= set(found.core.walls) and len(found.core.walls) == 7
        assert [sorted(target) for target in found.diagnosis.lost] == [[49]]
        opened = found.repairs[0]
        assert (opened.kind, opened.action, opened.helpers) == (kind, "push", ("digit",))
        assert Mission(opened.scenario).run().outcome.value == "completed"


def test_the_documentation_explains_every_cause() -> None:
    page = (SCENARIOS.parent / "docs" / "explain.md").read_text(encoding="utf-8")
    named = re.findall(r"`(\w+)`", page.split("| cause |")[1].split("\n\n")[0])
    assert {cause.value for cause in NoStrategyCause} <= set(named)


def test_avoided_regions_are_marked_on_the_map(invoke: Invoke, tmp_path: Path) -> None:
    objective = "{patrol: [[0, 0], [0, 2]], avoid: [[0, 1]]}"
    (tmp_path / "s.yaml").write_text(
        'safenav: 1\nmap: {grid: ["..."]}\n'
        f"robots: {{r: {{model: quadcopter, start: 0, objective: {objective}}}}}\n"
    )
    answer = invoke(command, tmp_path / "s.yaml")
    assert "R XX o" in answer.output
    assert "R r, o target, XX avoided" in answer.output


def test_json_has_cause_core_witness_and_repairs(invoke: Invoke) -> None:
    answer = invoke(command, FOLDER / "crossing_a_target.yaml", "--json")
    assert answer.status == 1
    (found,) = json.loads(answer.output)["unrealizable"]
    assert (found["robot"], found["cause"]) == ("rover", "crossing")
    assert all(m["origin"]["item"] and m["constraints"] for m in found["core"]["members"])
    assert found["witness"]["ending"]
    assert {"kind", "change", "helpers", "action", "says"} <= set(found["repairs"][0])


def test_explain_accepts_one_robot(invoke: Invoke) -> None:
    file = FOLDER / "separate_rooms.yaml"
    alone = invoke(command, file, "--robot", "quad")
    assert alone.status == 0 and "nothing to explain" in alone.output
    assert invoke(command, file, "--robot", "digit").status == 1
    unknown = invoke(command, file, "--robot", "nobody")
    assert unknown.status == 2 and "digit, quad" in unknown.error


INPUTS = beside(__file__, "scenarios/explain_command_inputs.yaml")


@pytest.mark.parametrize(
    ("safety", "liveness", "parts"),
    [
        (
            "owed' <-> fire', fire -> region' != den",
            "region = den, region = porch",
            [
                "because the input fire can keep it away forever",
                "(realizable if the input fire cooperated)",
                "bot at 11 [1, 4]; fire = 1, owed = 1",  # as near as it comes
                "Never: ltl: infinitely often (region = den).",
                "- inputs.fire.always_eventually: off\n",
                "- robots.bot.objective.ltl.liveness: without region = den\n",
            ],
        ),
        (  # off in between does not help: a fire may begin on each way to the den
            "owed' <-> (owed | fire') & region' != porch, owed -> region' != den",
            "region = den",
            [
                "because the input fire can keep it away forever",
                "- robots.bot.objective.ltl.safety: without owed -> region' != den\n",
            ],
        ),
    ],
)
def test_an_input_is_the_environment(
    safety: str, liveness: str, parts: list[str], tmp_path: Path, invoke: Invoke
) -> None:
    file = tmp_path / "fire.yaml"
    file.write_text(INPUTS.replace("SAFETY", safety).replace("LIVENESS", liveness))
    answer = invoke(command, file)
    assert answer.status == 1
    for part in parts:
        assert part in answer.output
    assert "other robots" not in answer.output
    assert ("always_eventually" in answer.output) == ("always_eventually" in "".join(parts))


def test_without_time_the_cause_is_a_conflict(
    tmp_path: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("safenav.explain.play.BUDGET_SECONDS", 0.0)
    file = tmp_path / "fire.yaml"
    rule = INPUTS.replace("SAFETY", "owed' <-> fire', fire -> region' != den")
    file.write_text(rule.replace("LIVENESS", "region = den, region = porch"))
    answer = invoke(command, file)
    assert answer.status == 1 and "because its guarantees conflict\n" in answer.output
    assert "What happens" not in answer.output and "cooperated" not in answer.output


def test_a_wall_is_replaced_by_a_type_as_the_scenario_defines_it(
    tmp_path: Path, invoke: Invoke
) -> None:
    text = (FOLDER / "separate_rooms.yaml").read_text()
    file = tmp_path / "rooms.yaml"
    file.write_text(text + "catalogue: {obstacles: {door: {action: unlock}}}\n")
    answer = invoke(command, file)
    assert answer.status == 1
    assert "{type: uncertainty, region: 47" in answer.output
    assert "type: door" not in answer.output


def test_no_repair_takes_the_heading_from_a_robot_whose_formulas_read_it(
    invoke: Invoke, tmp_path: Path
) -> None:
    """A model that turns on the spot was tried, and the command ended with an internal error."""
    goals = '{ltl: {liveness: ["region = 2 & heading = west", "region = 0"]}}'
    (tmp_path / "s.yaml").write_text(
        'safenav: 1\nmap: {grid: ["..."]}\n'
        f"robots: {{r: {{model: digit, start: 0, heading: east, objective: {goals}}}}}\n"
    )
    answer = invoke(command, tmp_path / "s.yaml")
    assert answer.status == 1
    assert "robots.r.model" not in answer.output
