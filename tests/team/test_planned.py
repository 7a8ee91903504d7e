"""Who is synthesized: a joint plan is the controller of robots with rivals."""

import pytest

from runtime.played import completed
from safenav.scenario.reading.loader import load_scenario_text
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
    a, b, c = scenario.robots
    assert scenario.interfere(a, b) and not scenario.interfere(a, c)
    assert [member.planned for member in team_of(scenario).members] == [True, True, False]
