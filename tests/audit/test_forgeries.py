"""Completed runs cut short and relabelled: no claim that nothing could be done is accepted."""

import copy
from typing import Any

import pytest

from audit.good_traces import GOOD
from audit.proofs.test_proofs import joint_proof
from audit.trace_script import Line, text
from safenav.audit.check import check_trace
from safenav.audit.proofs.case import case_of
from safenav.audit.situation import Situation
from safenav.errors import InputError
from safenav.trace.reading import read_lines


def cut(lines: list[Line], tick: int, **claim: Any) -> list[Line]:
    """The run up to a tick, said to have ended there for want of an operator."""
    kept = [line for line in lines if line.get("tick", 0) <= tick and line["type"] != "outcome"]
    outcome = copy.deepcopy(lines[-1])
    rounds = dict.fromkeys(outcome["rounds"], 0)
    rounds |= {line["robot"]: line["round"] for line in kept if line["type"] == "goal"}
    syntheses = sum(line["type"] == "synthesis" for line in kept)
    outcome.update(
        outcome="operator_needed", tick=tick, ticks=tick, rounds=rounds, syntheses=syntheses
    )
    return [*kept, outcome | {"cause": "deadlock"} | claim]


def closure_of(lines: list[Line]) -> dict[str, Any]:
    """A true closure of where everybody gets, with the lie that nobody can go on there."""
    trace = read_lines(text(lines))
    now = Situation(trace.header, trace.records)
    for record in trace.records:
        now.apply(record)
    case = case_of(now, ())
    assert case is not None
    return {
        "kind": "closure",
        "resolved": [obstacle.name for obstacle in case.obstacles],
        "never": [],
        "robots": {
            name: {
                "poses": [list(one) for one in case.team.reach(name, frozenset([pose]), ())],
                "live": False,
            }
            for name, pose in case.at.items()
        },
    }


@pytest.mark.parametrize("tick", [1, 2, 3, 5])
@pytest.mark.parametrize("name", ["planned", "come_and_gone"])
def test_a_completed_run_that_is_relabelled_is_refused(name: str, tick: int) -> None:
    lines = GOOD[name]()
    bare = cut(lines, tick)
    trace = read_lines(text(bare))
    now = Situation(trace.header, trace.records)
    for record in trace.records:
        now.apply(record)
    about = case_of(now, ())
    assert about is not None
    here = joint_proof(about, [[*about.at.values()]])
    for claim in (
        {},
        {"cause": "never_resolvable"},
        {"cause": "unrealizable", "unrealizable": dict.fromkeys(about.at, "0" * 64)},
        {"proof": closure_of(bare)},
        {"proof": here},
        {"proof": here | {"states": 10**6}},
        {"proof": {"kind": "tree", "choices": []}},
    ):
        findings = check_trace(text(cut(lines, tick, **claim))).findings
        assert "proof" in {finding.rule for finding in findings}, claim


def test_what_is_no_proof_is_no_trace() -> None:
    with pytest.raises(InputError, match="kind is one of closure, tree, joint"):
        check_trace(text(cut(GOOD["planned"](), 1, proof={})))


def test_an_obstacle_that_can_be_resolved_is_not_given_up() -> None:
    """The door of which it is said that nobody can open it, with the pusher beside it."""
    lines = GOOD["met_on_the_way"]()
    at = next(k for k, line in enumerate(lines) if line["type"] == "request")
    forged = closure_of(cut(lines[: at + 1] + lines[-1:], 2)) | {
        "resolved": [],
        "never": ["door@9"],
    }
    blocked = {
        "type": "blocked",
        "tick": 2,
        "obstacle": "door@9",
        "robots": ["one"],
        "reason": "unresolvable",
        "proof": forged,
    }
    findings = check_trace(text([*lines[: at + 1], blocked, *lines[at + 1 :]])).findings
    assert any("can be resolved" in finding.explanation for finding in findings)
