"""Robots with rivals: a joint plan is their controller, found leg by leg, also on full floors."""

import pytest

from runtime.played import completed
from safenav.errors import UsageError
from safenav.plan.charged import ChargedSearch
from safenav.plan.search import STATIC, Exhausted, Immobile, Search
from safenav.scenario.reading.loader import load_scenario_text
from safenav.team.apply import initial
from safenav.team.floor import Floor, floor_now
from safenav.team.team import team_of

SCENARIO = """
safenav: 1
name: two
map: {{grid: ["#######", "#.....#", "#.###.#", "#.....#", "#######"]}}
robots:
  a: {{model: digit, start: 8, heading: east, objective: {{{0}: [12, 22]}}}}
  b: {{model: {1}, start: 26, {2}objective: {{{0}: [26, 8]}}}}
until: {{rounds: 1}}
"""


@pytest.mark.parametrize(
    ("objective", "model", "heading", "synthesized"),
    [
        ("visit", "digit", "heading: west, ", []),
        ("patrol", "digit", "heading: west, ", ["a", "b"]),  # it has a weaker form to find
        ("visit", "quadcopter", "", ["a", "b"]),  # in another layer: no rivals
    ],
)
def test_a_plan_is_the_controller_of_robots_with_rivals(
    objective: str, model: str, heading: str, synthesized: list[str]
) -> None:
    run = completed(SCENARIO.format(objective, model, heading))
    assert [line["robot"] for line in run.all("synthesis")] == synthesized


def test_robots_that_share_only_a_zone_may_wait_for_each_other() -> None:
    robot = "{model: quadcopter, start: %d, objective: {hold: %d}, avoids: []}"
    team = "\n".join(f"  {name}: {robot % (k, k)}" for k, name in enumerate("abc"))
    zone = "never_together: [{robots: [a, b], in: [3]}]"
    scenario = load_scenario_text(f'safenav: 1\nmap: {{grid: ["...."]}}\nrobots:\n{team}\n{zone}\n')
    assert [member.planned for member in team_of(scenario).members] == [True, True, False]


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


def test_a_search_that_ends_without_a_plan_is_not_taken_for_another_plan(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    floor = facing()
    start = floor.begun((8, 12), ((0, 0), (0, 0)), ())
    for name in ("deep", "singles"):
        monkeypatch.setattr(Search, name, lambda *_: Exhausted([start, start]))
    search = Search(floor, frozenset(), lambda *_: (None, None), start, 1, 1000)
    assert [*search.others()] == []


CHARGED = """
safenav: 1
name: charged
map: {grid: ["....", ".##."]}
chargers: [4]
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [],
           battery: {capacity: 30, start: 30, move: 1, stay: 0, charge: 5}}
robots:
  a: {model: cart, start: 0, objective: {visit: [0, 3]}}
  b: {model: cart, start: 2, objective: {visit: [2, 0]}}
  c: {model: cart, start: 3, objective: {visit: [3, 7]}}
"""


def test_charged_robots_never_step_into_one_region_nor_exchange_theirs() -> None:
    team = team_of(load_scenario_text(CHARGED))
    floor = floor_now(team, initial(team))
    start = floor.begun((0, 2, 3), ((0, 0),) * 3, ())._replace(charges=(30.0,) * 3)
    how = (False, False)
    search = ChargedSearch(floor, frozenset(), lambda *_: (None,) * 3, start, 1, 1000, how)
    found, left = {start.poses}, [start]
    while left:
        joint = left.pop()
        for after in search._next(joint, STATIC, [0, 1, 2]):
            assert len({*after.poses}) == 3, after.poses
            pairs = zip(joint.poses, after.poses, strict=True)
            steps = {pair for pair in pairs if pair[0] != pair[1]}
            assert not steps & {(q, p) for p, q in steps}, steps
            if after.poses not in found:
                found.add(after.poses)
                left.append(after)
    assert len(found) > 9


def test_a_mission_of_many_rounds_is_planned_part_by_part() -> None:
    """Neither robot can turn round where the other one comes towards it."""
    run = completed(FACING + "until: {rounds: 60}\nlimits: {ticks: 1000}\n")
    assert len(run.all("plan")) > 10


MEMORY = """
safenav: 1
map: {grid: ["######", "#....#", "######"]}
robots:
  a:
    model: quadcopter
    start: 7
    avoids: []
    objective: {ltl: {memory: {n: [0, 2000]}, liveness: [region = 9]}}
  b: {model: quadcopter, start: 10, objective: {hold: 10}, avoids: %s}
"""


def test_formulas_with_too_many_states_for_a_joint_plan_are_refused() -> None:
    team_of(load_scenario_text(MEMORY % "[]"))
    with pytest.raises(UsageError, match=r"robots\.a\.objective: .* more than 4000 states"):
        team_of(load_scenario_text(MEMORY % "[a]"))
