"""Full floors: what nobody can undo is seen at once, and a plan is found leg by leg."""

from runtime.played import completed
from safenav.plan.immobile import Immobile
from safenav.scenario.reading.loader import load_scenario_text
from safenav.team.apply import initial
from safenav.team.floor import Floor, floor_now
from safenav.team.team import team_of
from support.missions import mission

FACING = """
safenav: 1
name: facing
map: {grid: ["#######", "#.....#", "#.###.#", "#.....#", "#######"]}
robots:
  a: {model: digit, start: 8, heading: east, objective: {visit: [8, 12]}}
  b: {model: digit, start: 12, heading: west, objective: {visit: [12, 8]}}
"""


def facing() -> Floor:
    team = team_of(load_scenario_text(FACING))
    return floor_now(team, initial(team))


def test_robots_that_face_each_other_never_move_again() -> None:
    floor = facing()
    immobile = Immobile(floor, floor.floors)
    east, west = (floor.graphs[0].size * heading for heading in (1, 3))
    assert immobile.robots((east + 9, west + 10)) == {0, 1}
    assert immobile.hopeless(floor.begun((east + 9, west + 10), ((0, 0), (0, 0)), ()))
    assert not immobile.robots((east + 9, west + 11)), "one region is between them"
    assert not immobile.robots((west + 9, west + 10)), "one follows the other"


def test_eight_robots_on_thirteen_regions_complete() -> None:
    completed(mission("crowd_hidden", 203))


def test_a_mission_of_many_rounds_is_planned_part_by_part() -> None:
    """Neither robot can turn round where the other one comes towards it."""
    run = completed(FACING + "until: {rounds: 60}\nlimits: {ticks: 1000}\n")
    assert len(run.all("plan")) > 10
