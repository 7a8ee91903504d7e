"""The simulation in metres: contacts, robots that act on obstacles; drives.yaml has the rest."""

from typing import Any

import pytest

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from fleet.lab import watched
from once import beside
from safenav import Obstacle, built_in, load_scenario_text
from safenav.fleet.lab.physics import Physics, straight
from safenav.fleet.transport import GoalEnded, Places

HALL = beside(__file__, "scenarios/hall_with_origin.yaml")
YARD = beside(__file__, "scenarios/two_lifters.yaml")
CRATE, DOOR = (Obstacle(built_in().obstacles[each], 10) for each in ("crate", "door"))


class Floor:
    """The physics of a scenario with obstacles."""

    def __init__(self, *obstacles: Obstacle, text: str = YARD) -> None:
        scenario = load_scenario_text(text, "made.yaml")
        assert scenario.map.frame is not None
        self.places = Places(scenario.map, scenario.map.frame)
        self.physics: Any = watched(Physics(scenario, self.places, obstacles))

    def ended(self, name: str) -> Any:
        """How the goal or action of a robot ends."""
        until = self.physics.now + 30.0
        while self.physics.now < until:
            self.physics.step(0.1)
            for ended in self.physics.told(name)[1]:
                return ended.end if isinstance(ended, GoalEnded) else ended.result
        return None

    def goes(self, name: str, region: int) -> Any:
        """Send a robot to a region; how that ended."""
        self.physics.send(name, *self.places.centre(region), 0.0 if name == "digit" else None)
        return self.ended(name)

    def acts(self, name: str, action: str) -> Any:
        self.physics.perform(name, action, 1)
        return self.ended(name)


def test_a_drone_is_stopped_by_a_closed_door_and_a_walker_opens_it() -> None:
    """The walker opens it by entering its region, not from beside it."""
    hall = Floor(DOOR, text=HALL)
    assert [hall.goes("quad", n) for n in (11, 10, 12)] == ["succeeded", "aborted", "succeeded"]
    assert hall.goes("digit", 9) == "succeeded"
    assert hall.physics.scan("digit")[1][0] < 2.0  # the door, straight ahead
    assert hall.acts("digit", "push") == "failed"
    assert hall.goes("digit", 10) == "succeeded"
    assert hall.acts("digit", "push") == "done"
    assert set(hall.physics.log()["contacts"]) == {"door@10 quad"}
    assert hall.goes("digit", 9) == "succeeded"
    assert hall.physics.scan("digit")[1][0] > 4.0
    assert [hall.goes("quad", region) for region in (11, 10)] == ["succeeded"] * 2
    hall.physics.send("quad", *hall.places.centre(12), None)
    hall.physics.step(1.0)
    hall.physics.cancel("quad")
    assert hall.ended("quad") == "canceled" and not hall.physics.moving()


def test_doors_stop_the_right_robots_of_a_large_team() -> None:
    """Flyers pass above the others."""
    wide = f"safenav: 1\nmap: {{resolution: 3.0, grid: ['{'.' * 70}']}}\nrobots:\n"
    kinds = {2: "quadcopter", 3: "forklift", 6: "spot"}
    for column in (2, 3, 6, *range(30, 70)):
        robot = f"{{model: {kinds.get(column, 'jackal')}, start: [0, {column}], "
        wide += f"  r{column}: {robot}objective: {{hold: [0, {column}]}}}}\n"
    lab = Floor(Obstacle(built_in().obstacles["door"], 5), text=wide)
    goals = ("r6", 5), ("r6", 6), ("r2", 4), ("r2", 3), ("r2", 5), ("r3", 4), ("r3", 5)
    ends = [str(lab.goes(*goal)) for goal in goals]
    assert ends == ["succeeded"] * 4 + ["aborted", "succeeded", "aborted"]


def test_a_robot_tracks_its_reference() -> None:
    """Accelerations are needed: corrections alone would lag by centimetres."""
    yard = Floor()
    physics, (x, y) = yard.physics, yard.places.centre(9)
    reference = straight(physics.now, (x, y, 0.0), (x + 1.0, y, 0.0), 3.0)
    physics.follow("left", reference)
    for _ in range(30):
        physics.step(0.1)
        assert physics.told("left")[0].x == pytest.approx(reference.at(physics.now)[0], abs=0.005)


def test_a_crate_is_lifted_by_two_robots_together() -> None:
    """One alone fails, and there is nothing to do when it is done. References that come meanwhile
    do not move it away."""
    yard = Floor(CRATE, Obstacle(built_in().obstacles["elevator"], 12))
    physics, (x, y) = yard.physics, yard.places.centre(9)
    physics.perform("left", "lift", 1)
    physics.perform("right", "call", 1)
    physics.follow("left", straight(physics.now, (x, y, 0.0), (x - 0.5, y, 0.0), 1.0))
    assert yard.ended("left") == "failed"
    assert physics.told("left")[0].x == pytest.approx(x, abs=0.01)
    for name in ("left", "right"):
        physics.perform(name, "lift", 1)
    assert [yard.ended(name) for name in ("left", "right")] == ["done"] * 2
    assert not physics.standing and yard.acts("left", "lift") == "nothing"
