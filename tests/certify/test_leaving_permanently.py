"""Unrealizable tasks with assignable goals: the proof also defeats a robot that leaves the poses to
which it must be able to return. Its specification forbids that, the scenario does not."""

import json
from copy import deepcopy
from pathlib import Path

import pytest

from certify.tasks import Circumstances, scenario_of, verdict_of
from safenav.certify import bundle
from safenav.judge.bundle.evidence import Evidence
from safenav.judge.engine import judge
from safenav.scenario.model import Scenario

REMEMBERS = (
    scenario_of(
        "#..\n...\n#..\n...",
        "r0: {model: walker, start: [3, 1], heading: west, objective: {ltl: {memory: {seen: bool}, "
        "init: '!seen', safety: \"seen' <-> seen | region = 1\", "
        'liveness: ["bell\'"]}}}',
        "inputs: {bell: {}}\nobstacles: [{type: door, region: 5}]\n",
    ),
    Circumstances(closed=(5,), assignable=True),
)
CASES = pytest.mark.parametrize(("scenario", "about"), [REMEMBERS])


@CASES
def test_the_checker_accepts_a_proof_that_also_defeats_leaving_permanently(
    scenario: Scenario, about: Circumstances, tmp_path: Path
) -> None:
    assert verdict_of(scenario, tmp_path, about) == ""


def test_a_proof_without_such_a_reply_is_refused(tmp_path: Path) -> None:
    """A reply that only the scenario allows, or any other one."""
    assert verdict_of(REMEMBERS[0], tmp_path, REMEMBERS[1]) == ""
    trace = (tmp_path / "trace.jsonl").read_bytes().splitlines(keepends=True)
    files = {p.relative_to(tmp_path).as_posix(): p for p in tmp_path.rglob("*") if p.is_file()}
    (path,) = (tmp_path / "proofs").iterdir()
    proof = json.loads(path.read_text())
    tried = 0
    for number, node in proof["automaton"]["nodes"].items():
        for target in node["trans"]:
            mutant = deepcopy(proof)
            mutant["automaton"]["nodes"][number]["trans"].remove(target)
            path.write_text(json.dumps(mutant))
            found = judge(trace, Evidence(files).rules()).findings
            tried += 1
            assert "the robot could continue to" in found[0].explanation
    assert tried


@CASES
def test_a_proof_of_the_specification_alone_is_refused(
    scenario: Scenario, about: Circumstances, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bundle, "may_leave", lambda spec: spec)
    assert verdict_of(scenario, tmp_path, about) == "nothing was established: []"
