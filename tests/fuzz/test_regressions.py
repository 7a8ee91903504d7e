"""What the campaigns found, shrunk, each with its story."""

from typing import Any

import yaml

from fuzz.test_missions import play
from safenav.outcome import Outcome

CATALOGUE = """
catalogue:
  robots:
    rover: {mobility: free, layer: ground, capabilities: [push]}
    walker: {mobility: heading, layer: ground, capabilities: [clear]}
    cart: {mobility: free, layer: ground, capabilities: [], timing: {least: 1, most: 2}}
  obstacles: {debris: {action: clear, resolve_at: neighbours, blocks: [ground]}}
"""


def _play(text: str) -> Outcome:
    data: dict[str, Any] = yaml.safe_load(text + CATALOGUE)
    played = play(data)  # audits the trace
    assert played is not None
    return played[2]


def test_a_robot_that_is_resynthesized_on_its_way_arrives_with_its_past() -> None:
    """While the cart was between two regions, a door that another robot had met joined the
    known obstacles, and the cart got a new strategy. Where it arrived, its new planner knew no
    values from before the step, and the goal of its formulas could not be judged: KeyError."""
    outcome = _play(
        """
safenav: 1
map: {grid: ["######", "#....#", "#....#", "######"]}
robots:
  r0: {model: cart, start: 7, objective: {ltl: {liveness: ["region = 7"]}}}
  r1: {model: quadcopter, start: 10, objective: {patrol: [7, 8]}}
  r2: {model: quadcopter, start: 8, objective: {patrol: [7, 8]}}
obstacles: [{type: door, region: 9}]
until: {rounds: 1}
limits: {ticks: 60}
seed: 3
deadlock: off
"""
    )
    assert outcome is not Outcome.INTERRUPTED


def test_a_helper_with_formulas_keeps_formulas() -> None:
    """A robot with an ``ltl`` objective helps by another goal in formulas. The audit looked for
    a target among the resolution regions, of which an ``ltl`` objective has none."""
    assert (
        _play(
            """
safenav: 1
map: {grid: ["#####", "#...#", "#...#", "#####"]}
robots:
  r0: {model: rover, start: 6, objective: {ltl: {liveness: ["region = 6"]}}}
  r1: {model: rover, start: 7, objective: {patrol: [6, 8]}}
  r2: {model: quadcopter, start: 8, objective: {patrol: [6, 7]}}
obstacles: [{type: door, region: 11}]
until: {rounds: 1}
limits: {ticks: 60}
deadlock: off
"""
        )
        in Outcome
    )


def test_a_requester_with_formulas_waits_by_formulas() -> None:
    outcome = _play(
        """
safenav: 1
map: {grid: ["#######", "#.....#", "#######"]}
robots:
  asker: {model: quadcopter, start: 8, objective: {ltl: {liveness: ["region = 12"]}}}
  opener: {model: rover, start: 11, objective: {visit: [11]}}
obstacles: [{type: door, region: 10}]
until: {rounds: 1}
limits: {ticks: 60}
"""
    )
    assert outcome is Outcome.COMPLETED


def test_a_robot_that_waits_is_believed_where_it_waits() -> None:
    """Once ``holder`` had come to its place, ``watcher`` was synthesized with it as an obstacle
    and kept track of it no longer: the trace went on saying where it was last seen."""
    _play(
        """
safenav: 1
map: {grid: ["#######", "#.....#", "#.....#", "#######"]}
robots:
  holder: {model: quadcopter, start: 8, objective: {hold: 19}}
  watcher: {model: quadcopter, start: 10, tracking: belief, vision: 2, objective: {visit: [8]}}
  walker: {model: walker, start: 11, heading: north, objective: {visit: [8]}}
obstacles:
  - {type: door, region: 9}
  - {type: uncertainty, region: 12, traversable: false}
until: {rounds: 1}
limits: {ticks: 60}
"""
    )


def test_who_makes_way_again_and_again_has_done_no_round() -> None:
    """``patroller`` comes to its second target, makes way, and begins there anew, until the
    limit. The audit took every goal line for progress, also those of what it did meanwhile, and
    said that the run was completed."""
    outcome = _play(
        """
safenav: 1
map: {grid: ["######", "#....#", "#....#", "######"]}
robots:
  patroller:
    {model: digit, start: 15, heading: north, tracking: exact, objective: {patrol: [10, 13]}}
  visitor: {model: digit, start: 10, heading: north, objective: {visit: [9, 14]}}
until: {rounds: 1}
limits: {ticks: 60}
"""
    )
    assert outcome in (Outcome.TICK_LIMIT, Outcome.COMPLETED)


def test_a_helper_that_is_asked_twice_may_be_waiting_itself() -> None:
    """``clearer`` was asked for the debris, met a door on its way, and waited for help; then
    somebody else met the debris. It was right to go on waiting; the audit wanted it to move."""
    _play(
        """
safenav: 1
map: {grid: ["#####", "#...#", "#...#", "#...#", "#...#", "#####"]}
robots:
  one: {model: rover, start: 17, objective: {visit: [6]}}
  two: {model: rover, start: 16, objective: {visit: [7]}}
  clearer: {model: walker, start: 18, heading: north, objective: {visit: [6]}}
obstacles: [{type: door, region: 13}, {type: debris, region: 12}]
until: {rounds: 1}
limits: {ticks: 60}
deadlock: off
"""
    )


def test_a_helper_is_replaced_in_the_turn_in_which_it_meets_something_itself() -> None:
    """The digit, on its way to the door, met debris that nobody can clear and that left it no
    way; the rover was asked in the same turn, and the digit went back to its own objective. The
    audit took the request for the debris for the one that the push answers, and did not expect
    a helper to be given its own objective back."""
    outcome = _play(
        """
safenav: 1
map: {grid: ["#######", "#.....#", "##....#", "#######"]}
robots:
  r0: {model: quadcopter, start: 16, objective: {patrol: [10, 8]}}
  r1: {model: rover, start: 8, objective: {hold: 8}}
  r2: {model: digit, start: 9, heading: north, objective: {visit: [8]}}
obstacles: [{type: door, region: 17}, {type: debris, region: 10}]
until: {rounds: 1}
limits: {ticks: 60}
deadlock: off
"""
    )
    assert outcome is Outcome.TICK_LIMIT


def test_a_run_may_end_before_help_is_asked_for() -> None:
    """The quadcopter met a door, and found in the same turn, where it stood, that another robot
    has no way any more: the run ended there. The audit missed the request for the door."""
    outcome = _play(
        """
safenav: 1
map: {grid: ["#######", "#.....#", "###...#", "#######"]}
robots:
  r0: {model: quadcopter, start: 11, objective: {patrol: [11, 17]}}
  r1: {model: rover, start: 8, objective: {ltl: {liveness: ["region = 8"]}}}
  r2: {model: rover, start: 9, objective: {ltl: {liveness: ["region = 10"]}}}
obstacles: [{type: door, region: 18}, {type: uncertainty, region: 10, traversable: false}]
until: {rounds: 1}
limits: {ticks: 60}
deadlock: off
"""
    )
    assert outcome is Outcome.OPERATOR_NEEDED
