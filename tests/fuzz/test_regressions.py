"""What the campaigns found, shrunk, each with its story."""

import pytest
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

FOUND: dict[str, tuple[str, tuple[Outcome, ...]]] = {
    "a robot that is resynthesized on its way arrives with its past": (
        """\
# While the cart was between two regions, a door that another robot had met joined the known
# obstacles, and the cart got a new strategy. Where it arrived, its new planner knew no values
# from before the step, and the goal of its formulas could not be judged: KeyError.
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
""",
        (),
    ),
    "a helper with formulas keeps formulas": (
        """\
# A robot with an ``ltl`` objective helps by another goal in formulas. The audit looked for a
# target among the resolution regions, of which an ``ltl`` objective has none.
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
""",
        (),
    ),
    "a requester with formulas waits by formulas": (
        """\
safenav: 1
map: {grid: ["#######", "#.....#", "#######"]}
robots:
  asker: {model: quadcopter, start: 8, objective: {ltl: {liveness: ["region = 12"]}}}
  opener: {model: rover, start: 11, objective: {visit: [11]}}
obstacles: [{type: door, region: 10}]
until: {rounds: 1}
limits: {ticks: 60}
""",
        (Outcome.COMPLETED,),
    ),
    "a robot that waits is believed where it waits": (
        """\
# Once ``holder`` had come to its place, ``watcher`` was synthesized with it as an obstacle
# and kept track of it no longer: the trace went on saying where it was last seen.
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
""",
        (),
    ),
    "who makes way again and again has done no round": (
        """\
# ``patroller`` comes to its second target, makes way, and begins there anew, until the limit.
# The audit took every goal line for progress, also those of what it did meanwhile, and said
# that the run was completed.
safenav: 1
map: {grid: ["######", "#....#", "#....#", "######"]}
robots:
  patroller:
    {model: digit, start: 15, heading: north, tracking: exact, objective: {patrol: [10, 13]}}
  visitor: {model: digit, start: 10, heading: north, objective: {visit: [9, 14]}}
until: {rounds: 1}
limits: {ticks: 60}
""",
        (Outcome.TICK_LIMIT, Outcome.COMPLETED),
    ),
    "a helper that is asked twice may be waiting itself": (
        """\
# ``clearer`` was asked for the debris, met a door on its way, and waited for help; then
# somebody else met the debris. It was right to go on waiting; the audit wanted it to move.
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
""",
        (),
    ),
    "a helper is replaced in the turn in which it meets something itself": (
        """\
# The digit, on its way to the door, met debris that nobody can clear and that left it no way;
# the rover was asked in the same turn, and the digit went back to its own objective. The
# audit took the request for the debris for the one that the push answers, and did not expect
# a helper to be given its own objective back.
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
""",
        (Outcome.TICK_LIMIT,),
    ),
    "a run may end before help is asked for": (
        """\
# The quadcopter met a door, and found in the same turn, where it stood, that another robot
# has no way any more: the run ended there. The audit missed the request for the door.
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
""",
        (Outcome.OPERATOR_NEEDED,),
    ),
}


@pytest.mark.parametrize("name", FOUND)
def test_former_finding(name: str) -> None:
    text, outcomes = FOUND[name]
    played = play(yaml.safe_load(text + CATALOGUE))  # audits the trace
    assert played is not None
    assert played[2] in (outcomes or [o for o in Outcome if o is not Outcome.INTERRUPTED])
