"""Runs that wait for changes of their scenario: sensors, forged ends, rests; ``cases/waiting``."""

from runtime.facts import case
from runtime.played import Run, completed, loaded
from safenav.runtime.worlds.protocol import Sensed, WorldEvent
from safenav.runtime.worlds.simulation import LiveSimulation
from safenav.scenario.model import Scenario


class Opened(LiveSimulation):
    """A sensor reports after 60 s that the cart has been taken away."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        (self.cart,) = scenario.obstacles

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        left = 60 - self.now()
        within = left if timeout is None else min(left, timeout)
        events = super().wait(timeout if left <= 0 else within)
        if left <= 0 or self.now() < 60:
            return events
        self.truth.take_away(self.cart.name)
        self.truth.changes(0, ())
        return [*events, Sensed(60.0, self.cart, there=False)]


def test_a_sensor_report_ends_a_wait_early() -> None:
    text = case("waiting/for_a_change_of_the_scenario").replace(", until: 30", "")
    scenario = loaded(f"{text}changes: [{{robot: a, at: 200, service: back}}]\nclock: live\n")
    played = completed(scenario, world=Opened(scenario))
    assert [line["until"] for line in played.all("waiting")] == [200]
    assert played.one("gone")["t"] == 60 and played.records[-1]["t"] < 150


LAST = """
map: {grid: ["#####", "#...#", "#####"], resolution: 1}
catalogue: {obstacles: {p0: {action: lift, blocks: []}}}
robots: {r0: {model: quadcopter, start: 6, objective: {hold: 6}}}
orders: [{at: 30, type: p0, region: 8}]
until: {rounds: 1}
clock: live
"""


def test_the_judge_accepts_a_last_order_that_a_real_clock_delays_a_little() -> None:
    """A drive hears the time of an order at the next message, and ends in that pass."""
    run = completed(LAST)
    assert run.still_open == ["p0@8"]
    for record in run.records:
        if record.get("t", 0.0) >= 30:
            record["t"] += 0.0003
    assert not run.findings


def test_a_run_may_not_end_instead_of_waiting(clock: str) -> None:
    run = completed(f"{case('waiting/untraversable_until_its_time')}clock: {clock}\n")
    waits = run.records.index(run.one("waiting"))
    end = {"type": "outcome", "outcome": "operator_needed"}
    ended = Run([*run.records[:waits], {**run.outcome, **run.records[waits], **end}])
    assert "the run ends, but the scenario changes something at 11" in ended.findings
