"""Runs that a user changed while they ran are certified from their trace; forgeries are refused."""

from functools import lru_cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from certify.making import SCENARIOS, files_of, judged, rewrite
from certify.mutants import lines_of, with_lines
from safenav import Mission, TraceWriter, built_in, load_scenario
from safenav.certify.record import bundle_of_trace
from safenav.runtime.intervention.kinds import AddObstacle, AssignObjective, SetService
from safenav.scenario.objective import Visit

Line = dict[str, Any]
OUT, BACK = 3, 8


@lru_cache
def changed() -> Path:
    """A run in which the quadcopter is out of service for some ticks, a door closes, and the
    humanoid is given other targets."""
    scenario = load_scenario(SCENARIOS / "case_study_1.yaml")
    folder = Path(mkdtemp(prefix="safenav-changed-"))
    with TraceWriter(folder / "run.jsonl") as writer:
        mission = Mission(scenario, listeners=[writer])
        mission.start()
        while mission.result is None:
            tick = mission.tick
            if tick in (OUT, BACK):
                mission.intervene(SetService("quad", tick == BACK))
            if tick == BACK + 1:
                mission.intervene(AddObstacle(built_in().obstacles["door"], 44, None))
                targets = (frozenset({58}), frozenset({71}))
                mission.intervene(AssignObjective("digit", Visit(targets)))
            mission.step()
    bundle_of_trace(folder / "run.jsonl", folder / "bundle")
    return folder / "bundle"


def said_of(lines: list[Line], tmp_path: Path) -> tuple[int, str]:
    files = with_lines(files_of(changed()), lines)
    return judged(rewrite(changed(), files, tmp_path / "bundle"))


def test_a_run_that_was_changed_is_accepted() -> None:
    kinds = {line["type"] for line in lines_of(files_of(changed()))}
    assert kinds >= {"service", "appeared", "objective"}
    status, said = judged(changed())
    assert status == 0, said
    assert "made 4 changes" in said


def test_an_objective_that_was_not_assigned_is_refused(tmp_path: Path) -> None:
    lines = [line for line in lines_of(files_of(changed())) if line["type"] != "objective"]
    assert said_of(lines, tmp_path)[0] == 1
