"""Real traces with one thing put wrong: each is refused, with the reason."""

import json
from collections.abc import Callable
from typing import Any

import pytest

from safenav.audit.check import check_trace
from traces.real import real_trace

Line = dict[str, Any]


def all_cached(lines: list[Line]) -> None:
    for line in lines:
        if line["type"] == "synthesis":
            line["cached"] = True
    lines[-1]["syntheses"] = 0


def completed_before(lines: list[Line]) -> None:
    lines[0]["scenario"]["until"]["rounds"] = 1


def belief_in_a_wall(lines: list[Line]) -> None:
    belief = next(line for line in lines if line["type"] == "belief" and not line["seen"])
    belief["regions"].append(0)


GOES_ON = "every robot has completed 1 round, but the run continues"


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("case_study_2", all_cached, "it reports 0 syntheses; the trace has 10"),
        ("case_study_2", completed_before, GOES_ON),
        ("case_study_3", completed_before, GOES_ON),
        ("corridor_swap", completed_before, GOES_ON),
        ("two_digits", completed_before, GOES_ON),
        ("case_study_1_beliefs", belief_in_a_wall, "quad at 0 (0, 0), which is not free"),
    ],
)
def test_a_real_trace_that_cannot_have_been(
    name: str, change: Callable[[list[Line]], None], said: str
) -> None:
    lines = [json.loads(line) for line in real_trace(name).splitlines()]
    change(lines)
    assert any(said in one.explanation for one in check_trace(map(json.dumps, lines)).findings)


def test_belief_lines_that_were_dropped() -> None:
    lines = real_trace("case_study_1_beliefs").splitlines()
    told = [k for k, line in enumerate(lines) if json.loads(line)["type"] == "belief"]
    assert len(told) > 30
    for k in told:
        assert check_trace([*lines[:k], *lines[k + 1 :]]).findings
