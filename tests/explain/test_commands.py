"""What ``safenav explain``, ``synth`` and ``verify`` print (``transcripts``); shipped scenarios,
explained and repaired; limits. Cores and plays of random ones: ``test_claims``."""

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from explain.conftest import invoke
from once import SCENARIOS
from report.runs import lonely
from safenav import Mission, Synthesizer, explain_team, first_failure, load_scenario_text
from support.transcripts import check

TRANSCRIPTS = Path(__file__).with_name("transcripts")
FOLDER = SCENARIOS / "unrealizable"
CAUSES = {
    "contradictory_objective": ("rover", "contradiction", "objective"),
    "crossing_a_target": ("rover", "crossing", "objective"),
    "dead_end": ("digit", "one_way", "mobility"),
    "facing_the_wall": ("digit", "heading", "heading"),
    "forbidden_way": ("rover", "forbidden_way", "objective"),
    "impossible_start": ("rover", "impossible_start", "start"),
    "no_room_to_turn": ("digit", "one_way", "mobility"),
    "separate_rooms": ("digit", "no_way", "open_wall"),
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
    scenario = load_scenario_text(file.read_text(), str(file), reachable=False)
    synthesizer = Synthesizer(verifier=first_failure)
    (found,) = explain_team(scenario, synthesizer)
    assert (found.robot, found.cause) == (robot, cause)
    assert found.core.alone, "it does not depend on other robots"
    assert kind in {repair.kind for repair in found.repairs}
    for repair in found.repairs:
        assert not [*explain_team(repair.scenario, synthesizer, [robot])], repair.change
    if file.stem == "separate_rooms":
        assert {21, 34, 47, 60, 73} <= set(found.core.walls) and len(found.core.walls) == 7
        assert [sorted(target) for target in found.diagnosis.lost] == [[49]]
        opened = found.repairs[0]
        assert (opened.kind, opened.action, opened.helpers) == (kind, "push", ("digit",))
        assert Mission(opened.scenario).run().outcome.value == "completed"


def test_without_time_only_proven_results_are_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("safenav.explain.play.BUDGET_SECONDS", 0.0)
    monkeypatch.setattr("safenav.explain.investigation.REPAIR_SECONDS", 0.0)
    status, output, _ = invoke("explain", FOLDER / "forbidden_way.yaml")
    assert status == 1 and "because its guarantees conflict\n" in output
    assert "Consequence" not in output and "cooperated" not in output
    assert output.endswith("\nNo repair was found among the simple ones.\n")


def test_a_repair_whose_run_is_too_long_is_not_offered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    door = lonely("{patrol: [10, 16]}", "obstacles: [{type: door, region: 22}]")
    (tmp_path / "door.yaml").write_text(door)
    monkeypatch.setattr("safenav.review.postmortem.explain_run.__defaults__", (600.0,))
    for seconds, ending in ((600.0, "ticks)\n"), (-1.0, "completes a run (11 runs).\n")):
        monkeypatch.setattr("safenav.review.postmortem.RUN_SECONDS", seconds)
        status, output, _ = invoke("explain", tmp_path / "door.yaml")
        assert (status, output.endswith(ending)) == (1, True), output


@pytest.fixture
def wrapped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Lets a script stand before the synthesizer, which is "$slugs" there."""
    own = Synthesizer().binary

    def wrap(script: str) -> None:
        file = tmp_path / "wrapped"
        file.write_text(f'#!/bin/sh\nunset SLUGS_PARENT\nslugs="{own}"\n{script}\n')
        file.chmod(0o755)
        monkeypatch.setenv("SAFENAV_SLUGS", str(file))

    return wrap


@pytest.mark.parametrize("lines", [["!a'"], ["a'", "!a'"]], ids=["some checks", "all checks"])
def test_checks_that_reach_a_limit_are_reported(
    lines: list[str], tmp_path: Path, wrapped: Callable[[str], None]
) -> None:
    """A request without one of these lines reaches a limit."""
    there = " && ".join(f"""echo "$given" | grep -qx "{line}\"""" for line in lines)
    wrapped(
        f"given=$(cat)\n{there} || {{ echo time limit reached >&2; exit 3; }}\n"
        'echo "$given" | "$slugs" "$@"'
    )
    (file := tmp_path / "s").write_text("[OUTPUT]\na\n[SYS_TRANS]\na'\n!a'\n")
    status, output, _ = invoke("explain", file)
    assert status == 1
    assert output.splitlines()[1:5] == [
        "These guarantees conflict:",
        "  - line 4 [SYS_TRANS] a'",
        "  - line 5 [SYS_TRANS] !a'",
        "  (some checks timed out: the core may not be minimal)",
    ]


@pytest.mark.parametrize(("owner", "status"), [("INPUT", 0), ("OUTPUT", 1)])
def test_a_specification_whose_strategy_is_too_large_still_gets_a_verdict(
    owner: str, status: int, tmp_path: Path, wrapped: Callable[[str], None]
) -> None:
    wrapped('exec "$slugs" $(echo "$@" | sed "s/--memory [0-9]*/--memory 40/")')
    lines = [f"[{owner}]", *(f"x{k}" for k in range(22))]
    lines += ["[INPUT]", "i", "[OUTPUT]", "o", "[SYS_LIVENESS]", "o" if owner == "INPUT" else "i"]
    (file := tmp_path / "large.structuredslugs").write_text("\n".join([*lines, ""]))
    assert invoke("synth", file)[0] == 3
    assert invoke("explain", file)[0] == status
