"""The simulation in metres: contacts, and robots that act on obstacles."""

import json
import time
from math import pi
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from fleet.lab import drive_in, watched
from once import beside
from safenav import (
    Clock,
    Heading,
    Need,
    Obstacle,
    ObstacleType,
    Pose,
    built_in,
    load_scenario_text,
)
from safenav.fleet.file import load_fleet
from safenav.fleet.lab.physics import Physics, straight
from safenav.fleet.transport import DriveRecording, Places
from safenav.fleet.world import fleet_world

HALL = beside(__file__, "scenarios/hall_with_origin.yaml")
YARD = beside(__file__, "scenarios/two_lifters.yaml")
CRATE, GATE, DOOR = (Obstacle(built_in().obstacles[each], 10) for each in ("crate", "gate", "door"))


class Floor:
    """The physics of a scenario with obstacles."""

    def __init__(self, *obstacles: Obstacle, text: str = YARD) -> None:
        scenario = load_scenario_text(text, "made.yaml")
        assert scenario.map.frame is not None
        self.places = Places(scenario.map, scenario.map.frame)
        self.physics: Any = watched(Physics(self.places, scenario.robots, obstacles))

    def ended(self, name: str, key: str) -> Any:
        until = self.physics.now + 30.0
        while self.physics.now < until:
            self.physics.step(0.1)
            if (found := self.physics.state(name)[key]) is not None:
                return found
        return None

    def goes(self, name: str, region: int, east: float = 0.0) -> Any:
        """Send a robot to a region, or metres east of its centre; how that ended."""
        x, y = self.places.centre(region)
        self.physics.send(name, x + east, y, 0.0 if name == "digit" else None)
        return self.ended(name, "end")

    def acts(self, name: str, action: str) -> Any:
        self.physics.perform(name, action)
        return self.ended(name, "acted")

    def ahead(self, name: str = "left") -> float:
        """Metres from a robot to what is in its east."""
        return float(self.physics.scan(name)[1][0])


def test_a_drone_is_stopped_by_a_closed_door_and_a_walker_opens_it() -> None:
    """By entering its region: not from beside it."""
    hall = Floor(DOOR, text=HALL)
    assert [hall.goes("quad", n) for n in (11, 10, 12)] == ["succeeded", "aborted", "succeeded"]
    assert hall.goes("digit", 9) == "succeeded"
    assert hall.ahead("digit") < 2.0  # the door, straight ahead
    assert hall.acts("digit", "push") == "failed"
    assert hall.goes("digit", 10) == "succeeded"
    assert hall.acts("digit", "push") == "done"
    assert set(hall.physics.log()["contacts"]) == {"door@10 quad"}
    assert hall.goes("digit", 9) == "succeeded"
    assert hall.ahead("digit") > 4.0
    assert [hall.goes("quad", region) for region in (11, 10)] == ["succeeded"] * 2


@pytest.mark.parametrize(("heading", "yaw"), [(Heading.NORTH, pi / 2), (Heading.WEST, pi)])
def test_regions_and_headings_follow_a_turned_map(heading: Heading, yaw: float) -> None:
    places = Floor(text=HALL.replace("-4.0]", "-4.0, 0.3]")).places
    regions = range(places.world.size)
    assert [places.region(*places.centre(region)) for region in regions] == [*regions]
    assert places.yaw(Pose(8, heading)) == pytest.approx(yaw + 0.3)
    assert places.heading(yaw + 0.3 + 0.5) is heading and places.region(-50.0, 0.0) is None


def test_a_gate_stops_its_robot_until_it_is_unlocked() -> None:
    yard = Floor(GATE, text=YARD.replace("mir250", "fetch", 1).replace("mir250", "spot"))
    assert yard.acts("right", "push") == "failed" and yard.goes("right", 10) == "aborted"
    assert yard.acts("left", "unlock") == "done" and yard.goes("right", 10) == "succeeded"
    assert yard.acts("right", "push") == "done" and not yard.physics.standing


def test_a_crate_is_lifted_by_two_robots_at_once() -> None:
    """One alone fails. References that come meanwhile do not move it away."""
    yard = Floor(CRATE, Obstacle(built_in().obstacles["elevator"], 12))
    physics, (x, y) = yard.physics, yard.places.centre(9)
    physics.perform("left", "lift")
    physics.perform("right", "call")
    physics.follow("left", straight(physics.now, (x, y, 0.0), (x - 0.5, y, 0.0), 1.0))
    assert yard.ended("left", "acted") == "failed"
    assert physics.state("left")["x"] == pytest.approx(x, abs=0.01)
    for name in ("left", "right"):
        physics.perform(name, "lift")
    assert [yard.ended(name, "acted") for name in ("left", "right")] == ["done"] * 2
    assert not physics.standing


@pytest.mark.parametrize(("truth", "word"), [(True, "done"), (False, "untraversable")])
def test_a_robot_senses_whether_a_region_is_traversable(truth: bool, word: str) -> None:
    hall = Floor(Obstacle(built_in().obstacles["uncertainty"], 10, truth), text=HALL)
    assert hall.goes("quad", 11) == "succeeded"
    assert hall.physics.noticed("quad")[10] == "uncertainty@10"
    assert hall.acts("quad", "sense") == word
    assert hall.physics.noticed("quad")[10] is None


def test_obstacles_appear_and_disappear_at_their_times() -> None:
    """One that appears where an equal one has been is another one; none appears around a robot, and
    there is nothing to do about one that has disappeared."""
    yard = Floor(replace(CRATE, goes=2), replace(CRATE, appears=4))
    assert yard.ahead() < 1.5
    yard.physics.step(1.0)
    assert yard.acts("left", "lift") == "nothing" and yard.ahead() > 2.0
    assert yard.goes("left", 10) == "succeeded" and yard.physics.now > 4.0
    yard.physics.step(1.0)
    assert yard.ahead() > 1.0  # the other robot
    assert yard.goes("left", 9, east=0.95) == "succeeded"  # it still reaches into region 10
    assert yard.physics.log()["regions"]["left"] == 9
    yard.physics.step(0.5)
    assert not yard.physics.standing
    assert yard.goes("left", 9) == "succeeded" and yard.ahead() < 1.5


@pytest.mark.parametrize(
    ("blocks", "stops"), [(None, True), ({"left"}, True), ({"right"}, False), (set(), False)]
)
def test_an_obstacle_stops_those_that_it_blocks(blocks: set[str] | None, stops: bool) -> None:
    kind = replace(CRATE.type, blocks=None if blocks is None else frozenset(blocks))
    yard = Floor(replace(CRATE, type=kind))
    assert (yard.ahead() < 1.5) is (blocks != set())
    assert yard.goes("left", 10) == ("aborted" if stops else "succeeded")


def test_a_load_is_fetched_and_put_down_elsewhere() -> None:
    """An order stops no robot, so it has no body, and what is done there counts for it."""
    needs = Need("lift", at=frozenset({9})), Need("lift", at=frozenset({11}), same=True)
    parcel = ObstacleType("parcel", "lift", frozenset({9}), blocks=frozenset(), listed=needs)
    orders = Obstacle(parcel, 9, ordered=True), Obstacle(parcel, 9, ordered=True, number=2)
    yard = Floor(*orders)
    for name in ("left", "right"):  # it takes two, and puts down two; a third one finds nothing
        for done in ("done", "done", "nothing"):
            yard.physics.bring(orders[0])  # as the team names it; a fulfilled one stays fulfilled
            assert yard.acts(name, "lift") == done
    assert not yard.physics.standing


def test_a_drive_of_the_simulation_does_not_depend_on_the_machine(tmp_path: Path) -> None:
    """Time stands still there while the mission thinks, however long that takes."""
    plan = load_scenario_text(beside(__file__, "scenarios/blocked.yaml"))
    plan = replace(plan, clock=Clock.LIVE)
    fleet = load_fleet(Path(__file__).parent / "scenarios/blocked.fleet.yaml", plan)

    def driven(*listeners: Any) -> tuple[list[dict[str, Any]], Any]:
        world = fleet_world(plan, fleet, DriveRecording())
        drive = drive_in(world, plan, fleet.stations, tmp_path / "t.jsonl", listeners)
        own = {"seconds", "synthesis_seconds", "cached"}
        lines = [json.loads(line) for line in drive.lines]
        return [{k: v for k, v in line.items() if k not in own} for line in lines], drive.motion

    quick, slow = driven(), driven(lambda _: time.sleep(0.05))
    assert quick[0] == slow[0] and quick[1].lines == slow[1].lines
