"""Obstacles that are resolved elsewhere, or by several robots. A robot that can act keeps out until
that is done, and goes there itself if it is the best helper."""

import click
import pytest

from runtime.played import Run, completed, loaded, play
from safenav.errors import InputError
from safenav.report.terminal.story import Story
from safenav.runtime.mission import Mission
from safenav.runtime.worlds.world import SimulatedWorld
from safenav.scenario.model import Obstacle, Robot

DOOR, BUTTON = 22, 10
PIA = """
name: a door with a button elsewhere
map:
  grid: |
    #########
    #...#...#
    #.......#
    #...#...#
    #########
  names: {button: [1, 1], door: [2, 4]}
catalogue:
  robots:
    presser: {mobility: free, layer: ground, capabilities: [press], size: 0.5, speed: 0.6}
  obstacles:
    slide_door: {action: press, resolve_at: [button], blocks: [ground]}
robots:
  pia: {model: presser, start: [2, 2], objective: {visit: [[2, 2], [2, 6]]}}
obstacles:
  - {type: slide_door, region: door}
"""
PIP = "robots:\n  pip: {model: presser, start: [1, 2], objective: {visit: [[1, 2], [1, 3]]}}\n"


def inside(trace: Run, region: int, robots: set[str]) -> list[int]:
    """The ticks in which one of these robots is in a region, or on its way there."""
    return [
        move["tick"]
        for move in trace.all("move")
        if move["robot"] in robots and region in (move["to"], move.get("toward"))
    ]


def test_a_robot_that_can_press_a_button_elsewhere_presses_it_before_it_passes() -> None:
    trace = completed(PIA)
    violation, request, resolved = (
        trace.one("violation"),
        trace.one("request"),
        trace.one("resolved"),
    )
    assert (violation["at"], violation["proposed"], violation["action"]) == (21, DOOR, "press")
    assert request["requester"] == request["helper"] == "pia"
    assert request["bids"] == {"pia": 3}
    assert resolved["at"] == BUTTON and resolved["requested"]
    assert trace.order("push", "pop") == [("push", "slide_door@22"), ("pop", "slide_door@22")]
    assert min(inside(trace, DOOR, {"pia"})) > resolved["tick"]


def test_the_story_says_that_it_goes_itself() -> None:
    lines: list[str] = []
    scenario = loaded(PIA)
    Mission(scenario, listeners=[Story(scenario, lines.append, maps=False)]).run()
    told = click.unstyle("\n".join(lines))
    assert "pia goes to press it itself" in told and "requests help" not in told
    assert "keeps out until 'press' is done" in told and "cannot press" not in told


def test_a_second_presser_nearer_to_the_button_helps() -> None:
    trace = completed(PIA.replace("robots:\n  pia", PIP + "  pia"))
    request = trace.one("request")
    assert (request["requester"], request["helper"]) == ("pia", "pip")
    assert request["bids"]["pip"] < request["bids"]["pia"]
    assert trace.one("resolved")["robot"] == "pip"


def test_a_button_inside_the_room_behind_the_door_needs_an_operator() -> None:
    trace = play(PIA.replace("button: [1, 1]", "button: [1, 6]"))
    assert trace.outcome["outcome"] == "operator_needed"
    assert trace.outcome["proof"]["never"] == ["slide_door@22"]
    assert trace.one("blocked")["robots"] == ["pia"]
    assert not inside(trace, DOOR, {"pia"})


def test_what_turns_out_untraversable_from_inside_is_left_and_not_entered_again() -> None:
    """A robot that can tell only by entering; it is inside when it learns, and goes back."""
    trace = completed("""
        map: {grid: ["#######", "#.....#", "#.###.#", "#.....#", "#######"]}
        catalogue:
          robots: {tester: {mobility: free, layer: ground, capabilities: [test]}}
          obstacles: {ice: {action: test, has_truth: true}}
        robots: {tess: {model: tester, start: [1, 1], objective: {visit: [[1, 5], [1, 1]]}}}
        obstacles: [{type: ice, region: [1, 3], traversable: false}]
        until: {rounds: 1}
        """)
    found = trace.one("resolved")
    assert found["traversable"] is False and found["at"] == 10
    assert inside(trace, 10, {"tess"}) == [found["tick"]]
    assert trace.one("blocked")["robots"] == ["tess"]


class Flickering(SimulatedWorld):
    """A camera that sees the door once, and then not any more while it is closed."""

    looks = 0

    def sense(self, robot: Robot, region: int) -> Obstacle | None:
        found = super().sense(robot, region)
        self.looks += found is not None
        return found if self.looks < 2 else None


def test_what_is_known_stays_closed_whatever_a_sensor_finds_now() -> None:
    scenario = loaded(PIA.replace("visit: [[2, 2], [2, 6]]", "visit: [[2, 6], [2, 2]]"))
    completed(scenario, world=Flickering(scenario))


STARTS = """
map: {grid: ["#######", "#.....#", "#######"]}
catalogue:
  robots: {presser: {mobility: free, layer: ground, capabilities: [press]}}
  obstacles:
    button_door: {action: press, resolve_at: [[1, 1]], blocks: BLOCKS}
    plate: {action: press}
robots:
  a: {model: presser, start: [1, 3], objective: {visit: [[1, 5], [1, 1]]}, avoids: AVOIDS}
  b: {model: presser, start: START, objective: {visit: [[1, 1], [1, 5]]}, avoids: AVOIDS}
obstacles: [{type: TYPE, region: [1, 3]}]
until: {rounds: 1}
"""


def starts(type_: str, start: str = "[1, 4]", avoids: str = "[]", blocks: str = "[ground]") -> str:
    given = {"TYPE": type_, "START": start, "AVOIDS": avoids, "BLOCKS": blocks}
    text = STARTS
    for word, value in given.items():
        text = text.replace(word, value)
    return text


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (starts("plate"), None),
        (starts("button_door"), "button_door@10 is where a starts, and blocks it"),
        (starts("button_door", blocks="[b]"), None),
        (starts("button_door", blocks="[a]"), "button_door@10 is where a starts, and blocks it"),
        (starts("plate", start="[1, 3]"), None),
        (starts("plate", start="[1, 3]", avoids="[a]").replace("[a]", "[b]", 1), "also starts"),
        (starts("plate", blocks="[c]"), "'c' is not a layer, a robot model or a robot"),
    ],
)
def test_who_may_start_where(text: str, found: str | None) -> None:
    """Inside an obstacle only a robot that resolves it by entering; together those that do not
    avoid each other. What the loader accepts runs, and its trace breaks no rule."""
    if found is None:
        completed(text)
        return
    with pytest.raises(InputError, match=found):
        loaded(text)
