"""``safenav explain``: what it prints and how it ends."""

import json
from pathlib import Path

import pytest

from explain.conftest import Invoke
from once import SCENARIOS, beside
from safenav.cli.synth import explain as command


def test_a_realizable_scenario_needs_no_explanation(invoke: Invoke) -> None:
    answer = invoke(command, SCENARIOS / "hello.yaml")
    assert answer.status == 0
    assert "nothing to explain" in answer.output


@pytest.mark.parametrize(
    "file", sorted((SCENARIOS / "unrealizable").glob("*.yaml")), ids=lambda file: file.stem
)
def test_every_unrealizable_scenario_is_explained_in_full(file: Path, invoke: Invoke) -> None:
    answer = invoke(command, file)
    assert answer.status == 1
    for part in ("because", "These guarantees conflict", "What happens", "Any one of these"):
        assert part in answer.output
    assert "busy_" not in answer.output.split("Any one of these")[0].split("What happens")[1]


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
    answer = invoke(command, SCENARIOS / "unrealizable" / "crossing_a_target.yaml", "--json")
    assert answer.status == 1
    (found,) = json.loads(answer.output)["unrealizable"]
    assert (found["robot"], found["cause"]) == ("rover", "crossing")
    assert all(m["origin"]["item"] and m["constraints"] for m in found["core"]["members"])
    assert found["witness"]["ending"]
    assert {"kind", "change", "helpers", "action", "says"} <= set(found["repairs"][0])


def test_explain_accepts_one_robot(invoke: Invoke) -> None:
    file = SCENARIOS / "unrealizable" / "separate_rooms.yaml"
    assert invoke(command, file, "--robot", "quad").status == 0
    assert invoke(command, file, "--robot", "digit").status == 1
    unknown = invoke(command, file, "--robot", "nobody")
    assert unknown.status == 2
    assert "digit, quad" in unknown.error


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


def test_a_wall_is_replaced_by_a_type_as_the_scenario_defines_it(
    tmp_path: Path, invoke: Invoke
) -> None:
    text = (SCENARIOS / "unrealizable" / "separate_rooms.yaml").read_text()
    file = tmp_path / "rooms.yaml"
    file.write_text(text + "catalogue: {obstacles: {door: {action: unlock}}}\n")
    answer = invoke(command, file)
    assert answer.status == 1
    assert "{type: uncertainty, region: 47" in answer.output
    assert "type: door" not in answer.output
