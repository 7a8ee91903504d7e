"""The moment from which deadlines are bounded: what of a run's state goes into it."""

from msgspec.structs import replace

from safenav.scenario.reading.loader import load_scenario_text
from safenav.team.apply import initial
from safenav.team.bound import earliest, moment_of
from safenav.team.state import Is, ObstacleNow, Stage
from safenav.team.team import team_of

TEXT = """
safenav: 1
map: {grid: ["......", "......"]}
catalogue:
  robots:
    slow: {mobility: free, layer: ground, capabilities: [lift], timing: 3}
    fast: {mobility: free, layer: ground, capabilities: [push]}
  obstacles:
    beam: {needs: [{action: lift, at: neighbours}, {action: push, at: neighbours}]}
    wall: {action: press}
    mist: {action: press}
robots:
  a: {model: slow, start: 0, objective: {visit: [5]}}
  b: {model: fast, start: 6, objective: {visit: [11]}}
obstacles:
  - {type: beam, region: 3}
  - {type: wall, region: 9}
  - {type: mist, region: 8, until: 50}
until: {rounds: 1}
"""


def test_a_moment_has_the_steps_the_turns_and_the_needs_of_a_state() -> None:
    team = team_of(load_scenario_text(TEXT))
    state = initial(team)
    a, b = state.robots
    stage = Stage(1)
    there = (ObstacleNow(Is.OPEN, stage), ObstacleNow(Is.SEALED), ObstacleNow(Is.SEALED))
    state = replace(
        state,
        time=7,
        robots=(replace(a, to=1, due=8), b),
        obstacles=there,
        requests=(0,),
    )
    moment = moment_of(team, state, 1)
    first, second = moment.walkers
    # ``a`` set out in tick 6 and takes three ticks; ``b`` has not had its turn of tick 7.
    assert (first.pose, first.leaves, first.ready, first.until) == (1, 0, 8, 8)
    assert (second.pose, second.leaves, second.ready, second.until) == (6, None, 6, 0)
    assert (first.ticks, second.ticks) == (3, 1)
    assert [walker.walls for walker in moment.walkers] == [1 << 9, 1 << 9]  # the mist goes
    assert [(one.gate.name, one.stage) for one in moment.opens] == [("beam@3", stage)]
    assert moment.now == 7 * 2 + 1 - 1
    ((met, open_),) = earliest(moment)
    assert met == moment.now  # the need that was met before
    assert open_ > met
    # One that has had its turn when it is due, and has not arrived, arrives in the next tick.
    late = replace(state, robots=(replace(a, to=1, due=6), b))
    assert moment_of(team, late, 1).walkers[0].ready == 8
