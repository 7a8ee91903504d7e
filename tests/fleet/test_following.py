"""Robots that follow references: the references sent, and the end of their goals."""

import json
import time
from collections.abc import Callable
from itertools import pairwise
from math import hypot

import pytest

pytest.importorskip("numpy", reason="references need the extra 'motion'")

import numpy as np

from fleet.lab import driven
from once import beside
from safenav.fleet.file import FollowUse, Station
from safenav.fleet.following import Following, mover_of
from safenav.fleet.setpoints import ACCELERATION, HORIZON, MOVING, PERIOD, Setpoints
from safenav.fleet.transport import (
    GoalEnd,
    GoalEnded,
    GoalPoint,
    Located,
    Message,
    Performed,
    Places,
)
from safenav.motion.check.execution import trackings
from safenav.motion.check.walk import walked
from safenav.motion.file import Reset, Segment
from safenav.run.checked import check_trace
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.records import Arrive
from safenav.trace.vocabulary import ActResult, MoveEnd

TEXT = beside(__file__, "scenarios/four_robots.yaml")
DIGIT, EAST, QUAD, SOUTH = 15, 16, 8, 15
"""Regions: of digit, east of it; of quad, south of it."""


class Bodies:
    """A transport whose robots are exactly where their references have them, plus ``off`` metres
    (x); time passes when the test says so."""

    def __init__(self) -> None:
        self.time = 100.0
        self.off = dict.fromkeys(("digit", "quad", "jackal", "spot"), 0.0)
        self.references: dict[str, Setpoints] = {}
        self.sent: list[tuple[str, object]] = []
        self.told: list[Message] = []
        self.post: Callable[[Message], None] = print
        self.step = None

    def now(self) -> float:
        return self.time

    def open(self, post: Callable[[Message], None]) -> None:
        self.post = post

    def missing(self) -> list[str]:
        return []

    def navigate(self, robot: str, goal: GoalPoint) -> None:
        self.sent.append((robot, goal))

    def follow(self, robot: str, reference: Setpoints) -> None:
        self.references[robot] = reference

    def cancel(self, robot: str) -> None:
        self.sent.append((robot, "cancel"))

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        self.sent.append((robot, (action, obstacle, number)))

    def close(self) -> None:
        self.sent.append(("all", "close"))

    def locate(self, robot: str) -> None:
        row = self.references[robot].at(self.time)
        self.post(Located(robot, self.time, row[0] + self.off[robot], row[1], row[9]))

    def pass_by(self, robot: str, seconds: float) -> list[Message]:
        """Let time pass; the ends that were told."""
        self.told.clear()
        for _ in range(round(seconds / PERIOD)):
            self.time += PERIOD
            self.locate(robot)
        return [message for message in self.told if not isinstance(message, Located)]


def prepared() -> tuple[Following, Bodies, Places, Scenario]:
    scenario = load_scenario_text(TEXT, "hall.yaml")
    assert scenario.map.frame is not None
    places, bodies = Places(scenario.map, scenario.map.frame), Bodies()
    stations = {name: Station(f"/{name}", follow=FollowUse()) for name in bodies.off}
    stations["spot"] = Station("/spot")
    follows = Following(bodies, scenario.robots, places, stations)
    follows.open(bodies.told.append)
    for robot in scenario.robots:
        if robot.name in follows.followers:
            place = follows.begins(robot.name)
            bodies.post(Located(robot.name, bodies.time, *place))
    return follows, bodies, places, scenario


def goal(places: Places, region: int, number: int = 1) -> GoalPoint:
    return GoalPoint(number, *places.centre(region), None)


def test_the_stream_has_the_next_second_and_the_next_steps() -> None:
    """Of a walker: its mass obeys its pendulum between feet that are where the plan has them."""
    follows, bodies, places, _ = prepared()
    follows.navigate("digit", goal(places, EAST))
    reference = bodies.references["digit"]
    for now in np.arange(reference.begin, reference.end, 0.5):
        part = reference.ahead(now)
        assert part.rows.shape == (HORIZON, 10) and part.begin == now and part.step == PERIOD
        assert np.allclose(part.rows[0], reference.at(now))
        assert all(foot.up > now for foot in part.feet)
        feet = [foot for foot in part.feet if foot.down <= now]
        assert 1 <= len(feet) <= 2
        pressure = part.rows[0][:2] - part.rows[0][ACCELERATION][:2] * 0.8 / 9.81
        assert min(hypot(*(pressure - (f.x, f.y))) for f in feet) < 0.25
    assert not reference.at(reference.end + 1.0)[MOVING].any()
    segments = [piece for piece in follows.followers["digit"].plan if isinstance(piece, Segment)]
    limits = follows.followers["digit"].mover.limits()
    for segment in segments:
        path = walked(segment, limits).mass
        for t, state in zip(path.times[::9], path.states[::9], strict=True):
            row = reference.at(segment.t0 + t)
            if segment.t0 + t > reference.begin:
                assert np.allclose(places.frame.on_map(*row[:2]), state[:2], atol=1e-3)


@pytest.mark.parametrize(("robot", "to"), [("quad", SOUTH), ("jackal", 11)])
def test_a_robot_off_its_reference_is_held_and_can_return(robot: str, to: int) -> None:
    follows, bodies, places, scenario = prepared()
    start = next(r.start.region for r in scenario.robots if r.name == robot)
    follows.navigate(robot, goal(places, to))
    assert bodies.pass_by(robot, 1.5) == []
    bodies.off[robot] = 0.4
    (ended,) = bodies.pass_by(robot, PERIOD)
    assert isinstance(ended, GoalEnded) and ended.end is GoalEnd.ABORTED
    assert ended.reason == "0.40 m off its reference"
    (reset,) = follows.followers[robot].resets
    held = bodies.references[robot].at(bodies.time + 1.0)
    assert np.allclose(places.frame.on_map(*held[:2]), (reset.x, reset.y))
    bodies.off[robot] = 0.0
    follows.navigate(robot, goal(places, start, 2))
    ended = bodies.pass_by(robot, 9.0)[0]
    assert ended == GoalEnded(robot, 2, GoalEnd.SUCCEEDED)
    row = bodies.references[robot].at(bodies.time)
    assert places.distance(start, row[0], row[1]) < 1e-6
    plan = follows.followers[robot].plan
    assert all(abs(a.t1 - b.t0) < 1e-9 for a, b in pairwise(plan))


def test_a_step_begins_where_the_robot_rests() -> None:
    follows, bodies, places, _ = prepared()
    x, y, yaw = follows.begins("quad")
    bodies.post(Located("quad", bodies.time, x + 0.3, y, yaw))
    follows.navigate("quad", goal(places, SOUTH))
    assert len(follows.followers["quad"].resets) == 1
    reference = bodies.references["quad"]
    assert reference.at(reference.begin)[0] == pytest.approx(x + 0.3)


@pytest.mark.parametrize(
    ("robot", "to", "held"), [("jackal", 11, True), ("quad", 9, True), ("digit", EAST, False)]
)
def test_a_robot_that_rests_is_not_drawn_back_from_another_region(
    robot: str, to: int, held: bool
) -> None:
    """Its stream was to be where it had rested: a robot that a person had carried away came back by
    itself. A walker, whose footsteps do not begin there, gets no stream."""
    follows, bodies, places, _ = prepared()
    follows.navigate(robot, goal(places, to))
    bodies.pass_by(robot, 15.0)
    bodies.sent.clear()
    bodies.off[robot] = -3.0
    assert bodies.pass_by(robot, PERIOD) == []
    reset = follows.followers[robot].resets[-1]
    away, bodies.off[robot] = bodies.off[robot], 0.0
    assert "outside the region in which it rests" in reset.reason
    assert bodies.sent == ([] if held else [(robot, "cancel")])
    row = bodies.references[robot].at(bodies.time + 1)
    there = places.frame.on_map(row[0] if held else row[0] + away, row[1])
    assert (reset.x, reset.y) == pytest.approx(there)


def test_a_walker_does_not_turn_around_and_steps_are_single() -> None:
    follows, bodies, places, _ = prepared()
    follows.navigate("digit", goal(places, EAST))
    bodies.pass_by("digit", 9.0)
    for number, region in ((2, DIGIT), (3, 18)):
        follows.navigate("digit", goal(places, region, number))
        ended = bodies.told[-1]
        assert isinstance(ended, GoalEnded) and ended.end is GoalEnd.ABORTED
        assert ended.reason == f"no motion leads from region {EAST} to {region}"


@pytest.mark.parametrize("obstacle", ["uncertainty@19", "parcel@19#2"])
def test_the_own_controller_of_a_robot_moves_it_during_an_action(obstacle: str) -> None:
    follows, bodies, places, _ = prepared()
    follows.navigate("jackal", goal(places, 11))
    bodies.pass_by("jackal", 15.0)
    follows.perform("jackal", "sense", obstacle, 7)
    assert bodies.sent == [("jackal", ("sense", obstacle, 7))]
    bodies.off["jackal"] = 1.5
    assert bodies.pass_by("jackal", 1.0) == []
    done = Performed("jackal", 7, ActResult.DONE)
    bodies.post(done)
    assert bodies.told[-1] == done and not follows.followers["jackal"].resets
    bodies.pass_by("jackal", PERIOD)
    assert follows.followers["jackal"].resets


def test_a_goal_ends_an_action_that_was_never_answered() -> None:
    """Its service has died: the world has given up the action, and sends the robot on."""
    follows, bodies, places, _ = prepared()
    follows.perform("jackal", "sense", "uncertainty@19", 7)
    follows.navigate("jackal", goal(places, 11, 8))
    bodies.pass_by("jackal", 1.5)
    bodies.off["jackal"] = 0.4
    (ended,) = bodies.pass_by("jackal", PERIOD)
    assert isinstance(ended, GoalEnded) and ended.end is GoalEnd.ABORTED and ended.number == 8


def test_cancelled_robots_end_their_step_and_others_get_goals() -> None:
    follows, bodies, places, _ = prepared()
    follows.navigate("spot", goal(places, 18))
    assert bodies.sent[0][0] == "spot"
    follows.cancel("spot")
    assert bodies.sent[1:] == [("spot", "cancel")]
    follows.navigate("quad", goal(places, SOUTH, 2))
    follows.cancel("quad")
    assert 3.0 < follows.left("quad") < 6.0 and follows.left("spot") == 0.0
    assert bodies.pass_by("quad", 6.0) == [GoalEnded("quad", 2, GoalEnd.SUCCEEDED)]


def test_a_robot_without_a_motion_is_refused() -> None:
    text = TEXT.replace("model: spot", "model: box") + (
        "catalogue: {robots: {box: {mobility: free, layer: ground, capabilities: []}}}\n"
    )
    scenario = load_scenario_text(text, "hall.yaml")
    assert scenario.map.frame is not None
    with pytest.raises(Exception, match="'box' has no motion"):
        mover_of(scenario.robots[3], Places(scenario.map, scenario.map.frame))


def test_a_robot_that_stands_where_no_reference_begins_is_named() -> None:
    follows, bodies, _, _ = prepared()
    x, y, yaw = follows.begins("digit")
    assert follows.start_error("digit") is None
    bodies.post(Located("digit", bodies.time, x + 0.4, y, yaw))
    assert "digit is 0.40 m from" in (follows.start_error("digit") or "")


def test_a_drive_of_the_simulation_does_not_depend_on_the_machine() -> None:
    """Time stands still there while the mission thinks, however long that takes."""
    pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")
    quick = driven(BLOCKED, BLIND)
    slow = driven.__wrapped__(BLOCKED, BLIND, listeners=(lambda _: time.sleep(0.05),))
    own = {"seconds", "synthesis_seconds", "cached"}
    one, two = (
        [{k: v for k, v in json.loads(line).items() if k not in own} for line in drive.lines]
        for drive in (quick, slow)
    )
    assert one == two and quick.motion.lines == slow.motion.lines


def test_robots_of_the_simulation_track_their_references() -> None:
    """By the accelerations of the reference: corrections alone would lag by centimetres."""
    pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")
    drive = driven()
    assert all(tracked.off < 0.005 for tracked in trackings(drive.motion, drive.trace))


BLOCKED = beside(__file__, "scenarios/blocked.yaml")
BLIND = beside(__file__, "scenarios/blocked.fleet.yaml")


def test_a_walker_that_falls_is_lost_and_its_plan_ends_there() -> None:
    """It runs into debris that no sensor detects."""
    pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")
    walks = BLOCKED.replace(
        "quad: {model: quadcopter, start", "quad: {model: cassie, heading: east, start"
    )
    drive = driven(walks, BLIND.replace("type: door", "type: debris"))
    outcome = drive.trace.outcome
    assert outcome is not None and outcome.outcome == "operator_needed"
    (end,) = [r for r in drive.trace.records if isinstance(r, Arrive)]
    assert end.result is MoveEnd.LOST
    (reset,) = [line for line in drive.motion.lines if isinstance(line, Reset)]
    assert "from where its footsteps begin" in reset.reason
    ends = [line.t1 for line in drive.motion.lines if isinstance(line, Segment)]
    assert max(ends) == reset.t <= drive.motion.outcome.makespan
    assert check_trace(drive.lines).findings == ()
    assert {finding.rule for finding in drive.judged()} == {"tracking"}


@pytest.mark.parametrize(("model", "by"), [("quadcopter", "door"), ("mir250", "debris")])
def test_a_robot_stopped_by_an_unseen_obstacle_returns(model: str, by: str) -> None:
    """Its plan is held where it is stopped, and the check counts how often. One that drives
    needs more time to turn round there than to cross a region: it has that."""
    pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")
    drive = driven(BLOCKED.replace("quadcopter", model), BLIND.replace("type: door", f"type: {by}"))
    ends = [r for r in drive.trace.records if isinstance(r, Arrive)]
    assert ends and {(end.at, end.result) for end in ends} == {(7, MoveEnd.FAILED)}
    assert all("off its reference" in (end.reason or "") for end in ends)
    resets = [line for line in drive.motion.lines if isinstance(line, Reset)]
    assert len(resets) >= len(ends)
    assert all(2.0 < line.x < 4.9 for line in resets)  # before the obstacle
    assert check_trace(drive.lines).findings == ()
    assert drive.judged() == []
    (tracked,) = trackings(drive.motion, drive.trace)
    assert tracked.held == len(resets) and tracked.off > 0.2
