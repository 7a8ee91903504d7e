"""Live: robots do not wait for a synthesis that no decision needs any more."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from once import beside
from runtime.played import Run, loaded
from runtime.worlds import Clocked
from safenav import Mission, Synthesizer
from safenav.runtime.control.answers import Answers
from safenav.runtime.worlds.protocol import Sensed, WorldEvent
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.synthesis.binary import find_binary
from safenav.synthesis.cache import Cache

HALL = beside(__file__, "scenarios/obsolete_syntheses_hall.yaml")


class Opened(Clocked):
    """A person opens the door 20 s after a robot has seen it. From then on the synthesizer does not
    answer (``flag``)."""

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
    scenario, run = loaded(HALL), Run()
    synthesizer = Synthesizer(slow, seconds=None, cache=Cache(None))
    Mission(scenario, synthesizer, world=Opened(scenario, flag), listeners=[run]).run()
    assert run.all("hold", why="synthesis") and run.one("gone")
    assert run.outcome["outcome"] == "completed" and not run.findings


def test_an_answer_that_comes_while_it_is_looked_for_is_not_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A question is answered between two looks: the run is told of it the next time."""
    looks = iter([False, *[True] * 9])
    monkeypatch.setattr(Answers, "ready", property(lambda _: next(looks)))
    answers = Answers(Synthesizer())
    answers._awaited = True
    assert [answers.fresh(), answers.fresh(), answers.fresh()] == [False, True, False]
