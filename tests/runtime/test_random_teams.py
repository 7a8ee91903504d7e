"""Random teams on one floor: whatever happens, the audit finds nothing and the end is explained.

Among the tests there are few; `make fuzz` plays thousands.
"""

import os
from pathlib import Path

import pytest

from runtime.teams import team_scenario
from safenav.audit.check import check_trace
from safenav.errors import InputError
from safenav.outcome import Outcome
from safenav.runtime.mission import Mission
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.writing import TraceWriter

WANTED = int(os.environ.get("SAFENAV_FUZZ", "20"))
BATCH = 10

REGRESSIONS = {
    686: "a robot on its way to where it will wait was taken to wait there already",
    4: "others gave way to one robot again and again, in the same way, to no avail",
    7: "two robots each waited for the other's region although another side was free",
}


def play(seed: int, tmp_path: Path) -> bool:
    """Run a random scenario and audit its trace; False if the scenario is refused."""
    try:
        scenario = load_scenario_text(team_scenario(seed), f"team {seed}")
    except InputError:
        return False
    path = tmp_path / f"{seed}.jsonl"
    with TraceWriter(path) as trace:
        result = Mission(scenario, listeners=[trace]).run()
    audit = check_trace(path)
    assert audit.findings == (), f"seed {seed}: " + "\n".join(map(str, audit.findings))
    assert audit.complete
    assert result.outcome in (
        Outcome.COMPLETED,
        Outcome.OPERATOR_NEEDED,
        Outcome.UNREALIZABLE,
        Outcome.TICK_LIMIT,
    ), f"seed {seed}: {result}"
    assert result.explanation
    return True


@pytest.mark.slow
@pytest.mark.parametrize("batch", range(WANTED // BATCH))
def test_no_rule_is_broken(batch: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SAFENAV_CACHE", "off")
    played, seed = 0, 10_000 * batch
    while played < BATCH:
        played += play(seed, tmp_path)
        seed += 1


@pytest.mark.parametrize("seed", REGRESSIONS, ids=str)
def test_former_finding(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SAFENAV_CACHE", "off")
    assert play(seed, tmp_path)
