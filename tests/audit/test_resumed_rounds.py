"""Rounds of an objective that a robot resumes after an input."""

from runtime.played import play

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
