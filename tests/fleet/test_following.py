"""Robots that follow references: the references sent, and the end of their goals."""

from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

pytest.importorskip("numpy", reason="references need the extra 'motion'")

import numpy as np

from once import beside
from safenav import ActResult, InputError, load_scenario_text
from safenav.fleet.file import FollowUse, Station, load_fleet
from safenav.fleet.following import Follower, Following
from safenav.fleet.setpoints import HORIZON, PERIOD, Setpoints
from safenav.fleet.transport import GoalEnd, GoalEnded, GoalPoint, Located, Performed, Places

TEXT = beside(__file__, "scenarios/four_robots.yaml")
SOUTH = 15
"""The region south of quad."""


class Hall:
    """Robots that are exactly where their references have them, plus ``off`` metres (x); time
    passes when the test says so. ``told``: what the layer has said; spot and digit get goals."""

    def __init__(self) -> None:
        self.time, self.inner = 100.0, Mock(step=None)
        self.inner.now = lambda: self.time
        self.scenario = load_scenario_text(TEXT, "hall.yaml")
        self.off = {robot.name: 0.0 for robot in self.scenario.robots}
        self.places = Places(self.scenario.map, self.scenario.map.frame)  # type: ignore[arg-type]
        stations = {name: Station(f"/{name}", follow=FollowUse()) for name in self.off}
        stations |= {name: Station(f"/{name}") for name in ("spot", "digit")}
        self.layer = Following(self.inner, self.scenario.robots, self.places, stations)
        self.told: list[Any] = []
        self.layer.open(self.told.append)
        self.post = self.inner.open.call_args.args[0]
        for robot in self.scenario.robots:
            x, y = self.places.centre(robot.start.region)
            self.post(Located(robot.name, self.time, x, y, 0.0))

    def goes(self, robot: str, region: int, number: int = 1) -> None:
        self.layer.navigate(robot, GoalPoint(number, *self.places.centre(region), None))

    def follower(self, robot: str) -> Follower:
        return self.layer.followers[robot]

    def reference(self, robot: str) -> Setpoints:
        """The reference that was sent to a robot last."""
        sent = [call.args for call in self.inner.follow.call_args_list]
        return next(reference for name, reference in reversed(sent) if name == robot)

    def passes(self, robot: str, seconds: float, off: float | None = None) -> list[Any]:
        """Let time pass; return the reported ends."""
        self.off[robot] = self.off[robot] if off is None else off
        self.told.clear()
        for _ in range(round(seconds / PERIOD)):
            self.time += PERIOD
            row = self.reference(robot).at(self.time)
            self.post(Located(robot, self.time, row[0] + self.off[robot], row[1], row[9]))
        return [message for message in self.told if not isinstance(message, Located)]


@pytest.fixture
def hall() -> Hall:
    return Hall()


def test_the_stream_covers_the_next_second(hall: Hall) -> None:
    hall.goes("quad", SOUTH)
    reference = hall.reference("quad")
    for now in np.arange(reference.begin, reference.end, 0.5):
        part = reference.ahead(now)
        assert part.rows.shape == (HORIZON, 10) and part.begin == now and part.step == PERIOD
        assert np.allclose(part.rows[0], reference.at(now))
    assert np.allclose(reference.at(reference.end + 1.0)[3:9], 0.0)
    x, y = hall.places.centre(SOUTH)
    assert reference.at(reference.end)[:2] == pytest.approx((x, y))


def test_a_step_across_two_regions_is_refused(hall: Hall) -> None:
    hall.goes("quad", 10)
    reason = "no motion leads from region 8 to 10"
    assert hall.told[-1] == GoalEnded("quad", 1, GoalEnd.ABORTED, reason)


@pytest.mark.parametrize(("robot", "to"), [("quad", SOUTH), ("jackal", 11)])
def test_a_robot_off_its_reference_stops_and_can_return(hall: Hall, robot: str, to: int) -> None:
    start = next(r.start.region for r in hall.scenario.robots if r.name == robot)
    hall.goes(robot, to)
    assert hall.passes(robot, 1.5) == []
    (ended,) = hall.passes(robot, PERIOD, off=0.4)
    assert ended == GoalEnded(robot, 1, GoalEnd.ABORTED, "0.40 m off its reference")
    last, held = hall.told[-2], hall.reference(robot).at(hall.time + 1.0)
    assert isinstance(last, Located) and held[:2] == pytest.approx((last.x, last.y))
    hall.off[robot] = 0.0
    hall.goes(robot, start, 2)
    assert hall.passes(robot, 9.0)[0] == GoalEnded(robot, 2, GoalEnd.SUCCEEDED)
    row = hall.reference(robot).at(hall.time)
    assert hall.places.distance(start, row[0], row[1]) < 1e-6


def test_a_step_begins_where_the_robot_rests(hall: Hall) -> None:
    x, y = hall.places.centre(8)
    hall.post(Located("quad", hall.time, x + 0.4, y, 0.0))
    hall.goes("quad", SOUTH)
    assert hall.reference("quad").rows[0][0] == pytest.approx(x + 0.4)


@pytest.mark.parametrize(("robot", "to"), [("jackal", 11), ("quad", 9)])
def test_a_robot_that_rests_is_not_drawn_back_from_another_region(
    hall: Hall, robot: str, to: int
) -> None:
    """A robot that a person has carried away must not return by itself. One that is carried off the
    map gets no stream."""
    hall.goes(robot, to)
    hall.passes(robot, 15.0)
    assert hall.passes(robot, PERIOD, off=-3.0) == []
    hall.inner.cancel.assert_not_called()
    (last,) = hall.told
    off = np.hypot(*(hall.reference(robot).at(hall.time + 1)[:2] - (last.x, last.y)))
    assert off == pytest.approx(0.0)
    hall.passes(robot, PERIOD, off=-30.0)
    hall.inner.cancel.assert_called_once_with(robot)
    hall.goes(robot, to, 2)
    assert "outside every free region" in hall.told[-1].reason


@pytest.mark.parametrize("obstacle", ["uncertainty@19", "parcel@19#2"])
def test_a_robots_own_controller_moves_it_during_an_action(hall: Hall, obstacle: str) -> None:
    hall.goes("jackal", 11)
    hall.passes("jackal", 15.0)
    hall.layer.perform("jackal", "sense", obstacle, 7)
    hall.inner.perform.assert_called_once_with("jackal", "sense", obstacle, 7)
    assert hall.passes("jackal", 1.0, off=1.5) == []
    hall.post(done := Performed("jackal", 7, ActResult.DONE))
    assert hall.told[-1] == done
    rests = hall.reference("jackal")
    hall.passes("jackal", PERIOD)
    held = hall.reference("jackal").rows[0] - rests.rows[-1]
    assert held[:2] == pytest.approx((1.5, 0.0))


def test_a_robot_that_is_to_resolve_an_obstacle_stops_before_the_centre_of_its_region(
    hall: Hall,
) -> None:
    x, y = hall.places.centre(11)
    hall.layer.navigate("jackal", GoalPoint(1, x, y, None, short=True))
    row = hall.reference("jackal").rows[-1]
    assert 0.3 < hall.places.distance(11, row[0], row[1]) < 1.0 == hall.places.frame.resolution / 2


def test_a_new_goal_ends_an_action_without_a_reply(hall: Hall) -> None:
    """Its service has died: the world has given up the action, and sends the robot on."""
    hall.layer.perform("jackal", "sense", "uncertainty@19", 7)
    hall.goes("jackal", 11, 8)
    hall.passes("jackal", 1.5)
    (ended,) = hall.passes("jackal", PERIOD, off=0.4)
    assert (ended.end, ended.number) == (GoalEnd.ABORTED, 8)


def test_a_cancelled_follower_ends_its_step_and_others_get_goals(hall: Hall) -> None:
    hall.goes("spot", 18)
    hall.layer.cancel("spot")
    hall.goes("quad", SOUTH, 2)
    hall.layer.cancel("quad")
    assert [sent.args[0] for sent in hall.inner.navigate.call_args_list] == ["spot"]
    hall.inner.cancel.assert_called_once_with("spot")
    hall.post(ended := GoalEnded("spot", 1, GoalEnd.CANCELED))
    assert hall.told[-1] == ended
    assert 3.0 < hall.layer.left("quad") < 6.0 and hall.layer.left("spot") == 0.0
    assert hall.passes("quad", 6.0) == [GoalEnded("quad", 2, GoalEnd.SUCCEEDED)]


def test_a_robot_without_motion_cannot_follow_references(tmp_path: Path) -> None:
    box = "catalogue: {robots: {box: {mobility: free, layer: ground, capabilities: []}}}\n"
    scenario = load_scenario_text(TEXT.replace("model: spot", "model: box") + box, "hall.yaml")
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("safenav-fleet: 1\ntransport: simulation\ndefaults: {follow: {}}\n")
    with pytest.raises(InputError, match="'box' has no motion"):
        load_fleet(fleet, scenario)
