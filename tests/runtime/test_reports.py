"""Live: a world that reports more than was commanded, or that something is gone meanwhile."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from msgspec.structs import replace

from once import beside
from runtime.facts import case
from runtime.played import Run, completed, loaded, play
from runtime.worlds import Clocked
from safenav import Mission, Synthesizer
from safenav.runtime.control.answers import Answers
from safenav.runtime.worlds.protocol import Acted, Sensed, WorldEvent
from safenav.runtime.worlds.simulation import LiveSimulation
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.synthesis.cache import Cache
from safenav.synthesis.program import find_binary
from safenav.trace.vocabulary import ActResult


class Hasty(Clocked):
    """A world outside that reports each action on a load as done, taking it as well."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        self.asked: dict[str, Sequence[Obstacle]] = {}

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        self.asked[robot.name] = obstacles
        return self.simulation.act(robot, obstacles, command)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        return [
            replace(event, found=[(load, ActResult.DONE) for load in self.asked[event.robot]])
            if isinstance(event, Acted)
            else event
            for event in self.simulation.wait(timeout)
        ]


def test_a_world_that_reports_more_than_was_commanded_delivers_no_load() -> None:
    """The run said that all was done when a robot had taken the load."""
    run = completed(case("loads/one_after_the_other") + "clock: live\n", world=Hasty)
    assert [line["at"] for line in run.all("resolved")] == [11, 11]
    late = [line["reason"] for line in run.all("late")]
    assert {*late} == {f"other needs are still open (pallet@16{n}: done)" for n in ("", "#2")}


HALL = """
name: gone
clock: live
map: {grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}
robots:
  spot: {model: fetch, start: [3, 7], objective: {visit: [[1, 5], [3, 7]]}}
  quad: {model: quadcopter, start: [2, 1], objective: {visit: [[2, 7], [2, 1]]}}
obstacles: [{type: sliding_door, region: [2, 4]}]
until: {rounds: 1}
"""


class Early(LiveSimulation):
    """A sensor sees that the door opens before the robot that opens it has answered."""

    def __init__(self) -> None:
        self.scenario = loaded(HALL)
        super().__init__(self.scenario)
        self.seen: list[Obstacle] = []
        self.told = 0

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        self.seen += obstacles
        return super().act(robot, obstacles, command)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        if self.seen and not self.told:
            self.told += 1
            self.truth.take_away(self.seen[0].name)
            self.truth.changes(0, ())
            return [Sensed(self.now(), self.seen[0], "quad", there=False)]
        done = [(obstacle, ActResult.DONE) for obstacle in self.seen]
        events = super().wait(timeout)
        return [replace(e, found=done) if isinstance(e, Acted) else e for e in events]


def test_an_obstacle_reported_gone_during_its_action_is_not_resolved() -> None:
    world = Early()
    run = play(world.scenario, world=world)
    types = [line["type"] for line in run.records]
    assert run.outcome["outcome"] == "completed" and world.told == 1
    assert types.count("gone") == 1 and types.count("acted") == 1 and "resolved" not in types


OBSOLETE = beside(__file__, "scenarios/obsolete_syntheses_hall.yaml")


class Opened(Clocked):
    """A person opens the door 20 s after a robot has seen it. From then on the synthesizer does not
    answer (``flag``)."""

    pauses = False

    def __init__(self, scenario: Scenario, flag: Path) -> None:
        super().__init__(scenario)
        self.flag, self.door = flag, scenario.obstacles[0]
        self.due: float | None = None

    def sense(self, robot: Robot, region: int) -> Obstacle | None:
        found: Obstacle | None = self.simulation.sense(robot, region)
        if found is not None and self.due is None:
            self.due = self.simulation.now() + 20.0
            self.flag.touch()
        return found

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        events = list(self.simulation.wait(timeout))
        if self.due is not None and self.simulation.now() >= self.due:
            self.due = float("inf")
            self.simulation.truth.remove(self.door.name)
            events.append(Sensed(self.simulation.now(), self.door, there=False))
        return events


def test_a_run_continues_although_an_obsolete_synthesis_never_ends(tmp_path: Path) -> None:
    flag, slow = tmp_path / "flag", tmp_path / "slugs"
    slow.write_text(
        f'#!/bin/sh\n[ -e "{flag}" ] && exec sleep 1000\nexec "{find_binary().path}" "$@"\n'
    )
    slow.chmod(0o755)
    scenario, run = loaded(OBSOLETE), Run()
    synthesizer = Synthesizer(slow, seconds=None, cache=Cache(None))
    Mission(scenario, synthesizer, world=Opened(scenario, flag), listeners=[run]).run()
    assert flag.exists() and run.one("gone")
    assert run.outcome["outcome"] == "completed" and not run.findings


def test_a_result_that_arrives_during_the_look_up_is_not_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A question is answered between two looks: the run is told of it the next time."""
    looks = iter([False, *[True] * 9])
    monkeypatch.setattr(Answers, "ready", property(lambda _: next(looks)))
    answers = Answers(Synthesizer())
    answers._awaited = True
    assert [answers.fresh(), answers.fresh(), answers.fresh()] == [False, True, False]
