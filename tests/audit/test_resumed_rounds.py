"""Progress of an objective that a robot resumes after an input, or from the run before."""

import pytest

from audit.good_traces import GOOD
from audit.trace_script import Line, text
from runtime.played import play
from safenav.audit.check import check_trace

SCENARIO = """
safenav: 1
map: {grid: [".......", ".......", "......."]}
robots:
  r: {model: quadcopter, start: 3, objective: {visit: [6, 10, 14], within: 16},
      when: {alarm: {visit: [20]}}}
inputs: {alarm: {at: ["8-11"]}}
until: {rounds: 3}
limits: {ticks: 120}
"""


def test_a_round_is_lost_by_the_target_with_which_it_continues() -> None:
    """The robot has met its first target before the input; the bound counts from the second."""
    run = play(SCENARIO)
    assert run.all("deadline", verdict="lost")
    assert not run.findings


@pytest.mark.parametrize(
    ("begun", "stranger"),
    [
        ({"robots": {"mule": {"rounds": 1}}}, "mule"),
        ({"asked": {"door@9": {"mule": 7}}}, "mule"),
        ({"asked": {"gate@9": {"quad": 7}}}, "gate@9"),
        ({"met": {"gate@9": [["quad"]]}}, "gate@9"),
        ({"stays": ["gate@9"]}, "gate@9"),
    ],
)
def test_the_run_before_has_no_robots_and_obstacles_of_its_own(begun: Line, stranger: str) -> None:
    lines = GOOD["door"]()
    lines[0]["scenario"]["begun"] = begun
    (finding,) = check_trace(text(lines)).findings
    told = f"'{stranger}' is not in the scenario"
    assert (finding.rule, finding.line, finding.explanation) == ("names", 1, told)
