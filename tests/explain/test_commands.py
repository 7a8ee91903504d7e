"""What ``safenav explain``, ``synth`` and ``verify`` print (``transcripts``); shipped scenarios,
explained and repaired; limits. Cores and plays of random ones: ``test_claims``."""

import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import pytest

from explain.conftest import invoke
from once import SCENARIOS
from safenav import Mission, Synthesizer, Verdict, explain_team, first_failure, load_scenario
from safenav.explain.explanation import NoStrategyCause, RepairKind
from safenav.explain.play import Questions
from safenav.report.terminal.explanation_text import explanation_lines
from safenav.runtime.run.mission import default_synthesizer, first_results
from support.transcripts import check

TRANSCRIPTS = Path(__file__).with_name("transcripts")
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


@pytest.mark.parametrize("file", sorted(TRANSCRIPTS.glob("*.txt")), ids=lambda file: file.stem)
def test_commands_print_their_transcript(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("safenav.review.postmortem.explain_run.__defaults__", (600.0,))

    def run(words: list[str], _: Mapping[str, str]) -> tuple[int, str]:
        status, output, error = invoke(*words[1:])
        return status, output + (error and f"{error.rstrip()}\n")

    check(file, tmp_path, run)


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


def test_without_time_only_proven_results_are_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("safenav.explain.play.BUDGET_SECONDS", 0.0)
    status, output, _ = invoke("explain", FOLDER / "forbidden_way.yaml")
    assert status == 1 and "because its guarantees conflict\n" in output
    assert "What happens" not in output and "cooperated" not in output


@pytest.mark.parametrize("first", [1, 99])
def test_checks_without_a_verdict_are_reported(
    first: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left, known = iter([Verdict.TIMEOUT] * first), Questions.verdict
    monkeypatch.setattr(Questions, "verdict", lambda *spec: next(left, None) or known(*spec))
    (file := tmp_path / "s").write_text("[OUTPUT]\na\n[SYS_TRANS]\na'\n!a'\n")
    status, output, _ = invoke("explain", file)
    assert status == 1
    assert output.splitlines()[1:5] == [
        "These guarantees conflict:",
        "  - line 4 [SYS_TRANS] a'",
        "  - line 5 [SYS_TRANS] !a'",
        "  (some checks timed out: the core may not be minimal)",
    ]


@pytest.mark.parametrize(
    ("owner", "status", "said"),
    [
        ("INPUT", 3, "realizable, but its strategy is too large to list (the strategy of large"),
        ("OUTPUT", 1, "unrealizable, but the environment's strategy is too large to list"),
    ],
)
def test_a_verdict_is_given_where_the_strategy_is_too_large(
    owner: str, status: int, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was "nothing is proven" for the larger specifications of the literature."""
    monkeypatch.setattr("safenav.cli.synth.Synthesizer", partial(Synthesizer, memory_mb=40))
    lines = [f"[{owner}]", *(f"x{k}" for k in range(22))]
    lines += ["[INPUT]", "i", "[OUTPUT]", "o", "[SYS_LIVENESS]", "o" if owner == "INPUT" else "i"]
    (file := tmp_path / "large.structuredslugs").write_text("\n".join([*lines, ""]))
    found, output, error = invoke("synth", file)
    assert (found, said in error + output) == (status, True)
    assert invoke("explain", file)[0] == (0 if status == 3 else 1)
