"""The simulation in metres: contacts, and robots that act on obstacles."""

from math import pi
from typing import Any

import pytest
from msgspec.structs import replace

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from fleet.lab import watched
from once import beside
from safenav.fleet.lab.physics import Physics, straight
from safenav.fleet.transport import Places
from safenav.scenario.model import Need, Obstacle, ObstacleType
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.reading.loader import load_scenario_text
from safenav.world.map import Heading
from safenav.world.poses import Pose

HALL = """\
safenav: 1
name: hall
map:
  resolution: 2.0
  origin: [3.0, -4.0]
  grid: |
    #######
    #.....#
    #######
robots:
  {{digit: {{model: digit, start: {begins}, heading: east, objective: {{hold: {begins}}}}},
   quad: {{model: quadcopter, start: 12, objective: {{visit: [8, 12]}}}}}}
obstacles: {obstacles}
catalogue: {{obstacles: {{crate: {{action: push, resolve_at: neighbours}},
  rubble: {{action: clear, resolve_at: neighbours}}}}}}
"""
FREE = HALL.format(obstacles="[]", begins=8)


def hall(obstacles: str = "[]", begins: int = 8) -> tuple[Physics, Places]:
    text = HALL.format(obstacles=obstacles, begins=begins)
    scenario = load_scenario_text(text, "hall.yaml")
    assert scenario.map.frame is not None
    places = Places(scenario.map, scenario.map.frame)
    return watched(Physics(places, scenario.robots, scenario.obstacles)), places


def gone(physics: Physics, places: Places, name: str, region: int, limit: float = 30.0) -> Any:
    """Send a robot to a region; how that ended."""
    physics.send(name, *places.centre(region), 0.0 if name == "digit" else None)
    return ended(physics, name, "end", limit)


def ended(physics: Physics, name: str, key: str, limit: float = 30.0) -> Any:
    until = physics.now + limit
    while physics.now < until:
        physics.step(0.1)
        state = physics.state(name)
        if state[key] is not None:
            return state[key]
    return None


def test_a_drone_is_stopped_by_a_closed_door_and_a_walker_opens_it() -> None:
    """By entering its region: not from beside it."""
    physics, places = hall("[{type: door, region: 10}]")
    assert gone(physics, places, "quad", 11) == "succeeded"
    assert gone(physics, places, "quad", 10) == "aborted"
    assert gone(physics, places, "quad", 12) == "succeeded"
    assert gone(physics, places, "digit", 9) == "succeeded"
    _, ranges = physics.scan("digit")
    assert ranges[0] < 2.0  # the door, straight ahead
    physics.perform("digit", "push")
    assert ended(physics, "digit", "acted") == "failed"
    assert gone(physics, places, "digit", 10) == "succeeded"
    physics.perform("digit", "push")
    assert ended(physics, "digit", "acted") == "done"
    assert set(physics.log()["contacts"]) == {"door@10 quad"}
    assert gone(physics, places, "digit", 9) == "succeeded"
    _, ranges = physics.scan("digit")
    assert ranges[0] > 4.0
    for region in (11, 10):
        assert gone(physics, places, "quad", region) == "succeeded"


@pytest.mark.parametrize(("heading", "yaw"), [(Heading.NORTH, pi / 2), (Heading.WEST, pi)])
def test_regions_and_headings_follow_a_turned_map(heading: Heading, yaw: float) -> None:
    text = FREE.replace("origin: [3.0, -4.0]", "origin: [3.0, -4.0, 0.3]")
    scenario = load_scenario_text(text, "hall.yaml")
    assert scenario.map.frame is not None
    places = Places(scenario.map, scenario.map.frame)
    for region in range(scenario.map.size):
        assert places.region(*places.centre(region)) == region
    assert places.yaw(Pose(8, heading)) == pytest.approx(yaw + 0.3)
    assert places.heading(yaw + 0.3 + 0.5) is heading and places.region(-50.0, 0.0) is None


YARD = beside(__file__, "scenarios/two_lifters.yaml")
CRATE = Obstacle(built_in().obstacles["crate"], 10)
GATE = Obstacle(built_in().obstacles["gate"], 10)


def yard(*obstacles: Obstacle, text: str = YARD) -> Physics:
    scenario = load_scenario_text(text, "yard.yaml")
    assert scenario.map.frame is not None
    return watched(Physics(Places(scenario.map, scenario.map.frame), scenario.robots, obstacles))


def test_a_gate_stops_its_robot_until_it_is_unlocked() -> None:
    physics = yard(GATE, text=YARD.replace("mir250", "fetch", 1).replace("mir250", "spot"))
    there = (*physics._places.centre(10), None)
    physics.perform("right", "push")
    assert ended(physics, "right", "acted") == "failed"
    physics.send("right", *there)
    assert ended(physics, "right", "end") == "aborted"
    physics.perform("left", "unlock")
    assert ended(physics, "left", "acted") == "done"
    physics.send("right", *there)
    assert ended(physics, "right", "end") == "succeeded"
    physics.perform("right", "push")
    assert ended(physics, "right", "acted") == "done" and not physics.standing


def test_a_crate_is_lifted_by_two_robots_at_once() -> None:
    """One alone fails. References that come meanwhile do not move it away."""
    physics = yard(CRATE, Obstacle(built_in().obstacles["elevator"], 12))
    physics.perform("left", "lift")
    physics.perform("right", "call")
    x, y = physics._places.centre(9)
    physics.follow("left", straight(physics.now, (x, y, 0.0), (x - 0.5, y, 0.0), 1.0))
    assert ended(physics, "left", "acted") == "failed"
    assert physics.state("left")["x"] == pytest.approx(x, abs=0.01)
    for name in ("left", "right"):
        physics.perform(name, "lift")
    assert [ended(physics, name, "acted") for name in ("left", "right")] == ["done"] * 2
    assert not physics.standing


@pytest.mark.parametrize(("truth", "word"), [("true", "done"), ("false", "untraversable")])
def test_a_robot_senses_whether_a_region_is_traversable(truth: str, word: str) -> None:
    physics, places = hall(f"[{{type: uncertainty, region: 10, traversable: {truth}}}]")
    assert gone(physics, places, "quad", 11) == "succeeded"
    assert physics.noticed("quad")[10] == "uncertainty@10"
    physics.perform("quad", "sense")
    assert ended(physics, "quad", "acted") == word
    assert physics.noticed("quad")[10] is None


def test_there_is_nothing_to_do_about_an_obstacle_that_has_disappeared() -> None:
    physics = yard(replace(CRATE, goes=1))
    physics.perform("left", "lift")
    assert ended(physics, "left", "acted") == "nothing"


def ahead(physics: Physics) -> float:
    """Metres from the left robot to what is in its east."""
    return float(physics.scan("left")[1][0])


def test_obstacles_appear_and_disappear_at_their_times() -> None:
    """One that appears where an equal one has been is another one; none appears around a robot."""
    physics = yard(replace(CRATE, goes=2), replace(CRATE, appears=4))
    assert ahead(physics) < 1.5
    physics.step(3.0)
    assert ahead(physics) > 2.0
    physics.send("left", *physics._places.centre(10), None)
    assert ended(physics, "left", "end") == "succeeded" and physics.now > 4.0
    physics.step(1.0)
    assert ahead(physics) > 1.0  # the other robot
    x, y = physics._places.centre(9)
    physics.send("left", x + 0.95, y, None)  # it still reaches into region 10
    assert ended(physics, "left", "end") == "succeeded"
    assert physics.log()["regions"]["left"] == 9
    physics.step(0.5)
    assert not physics.standing
    physics.send("left", x, y, None)
    assert ended(physics, "left", "end") == "succeeded"
    assert ahead(physics) < 1.5


@pytest.mark.parametrize(
    ("blocks", "stops"),
    [
        (None, True),
        (frozenset({"left"}), True),
        (frozenset({"right"}), False),
        (frozenset(), False),
    ],
)
def test_an_obstacle_stops_those_that_it_blocks(blocks: frozenset[str] | None, stops: bool) -> None:
    physics = yard(replace(CRATE, type=replace(CRATE.type, blocks=blocks)))
    assert (ahead(physics) < 1.5) is (blocks != frozenset())
    physics.send("left", *physics._places.centre(10), None)
    assert ended(physics, "left", "end") == ("aborted" if stops else "succeeded")


def test_a_load_is_fetched_and_put_down_elsewhere() -> None:
    """An order stops no robot, so it has no body, and what is done there counts for it."""
    parcel = ObstacleType(
        "parcel",
        "lift",
        frozenset({9}),
        blocks=frozenset(),
        listed=(Need("lift", at=frozenset({9})), Need("lift", at=frozenset({11}), same=True)),
    )
    orders = Obstacle(parcel, 9, ordered=True), Obstacle(parcel, 9, ordered=True, number=2)
    physics = yard(*orders)
    for name in ("left", "right"):  # it takes two, and puts down two; a third one finds nothing
        for done in ("done", "done", "nothing"):
            physics.bring(orders[0])  # as the team names it; a fulfilled one stays fulfilled
            physics.perform(name, "lift")
            assert ended(physics, name, "acted") == done
    assert not physics.standing
