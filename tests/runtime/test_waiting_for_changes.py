"""A run whose scenario still has changes waits instead of ending, on both clocks."""

from collections.abc import Callable

import click
import pytest

from certify.making import certified
from runtime.played import Run, completed, loaded, play
from safenav.report.terminal.story import Story
from safenav.runtime.analysis.resuming import resumed
from safenav.runtime.mission import Mission
from safenav.runtime.worlds.protocol import Sensed, WorldEvent
from safenav.runtime.worlds.simulation import LiveSimulation
from safenav.scenario.model import Scenario
from safenav.scenario.settings import Clock
from safenav.trace.reading import read_lines

CART = """
map: {grid: ["########", "#......#", "###.####", "########"]}
catalogue:
  robots:
    tug: {mobility: free, layer: air, capabilities: [tow]}
  obstacles:
    cart: {action: tow}
    leaf: {action: sweep, blocks: []}
robots:
  a: {model: quadcopter, start: [1, 1], objective: {patrol: [[1, 1], [1, 6]]}}
TUG
obstacles:
  - {type: cart, region: [1, 4]UNTIL}
CHANGES
"""
TUG = "  t: {model: tug, start: [2, 3], objective: {hold: [2, 3]}}"


def cart(clock: Clock, *, until: str = "", tug: str = "", changes: str = "") -> str:
    text = CART.replace("TUG", tug).replace("UNTIL", until).replace("CHANGES", changes)
    return f"{text}clock: {clock.value}\n"


@pytest.mark.parametrize(
    ("scenario", "outcome"),
    [
        ({"until": ", until: 30"}, "completed"),
        ({"changes": "orders: [{at: 30, type: leaf, region: [1, 2]}]"}, "operator_needed"),
        ({"changes": "changes: [{robot: a, at: 30, objective: {hold: [1, 1]}}]"}, "completed"),
        ({"until": ", until: 2000"}, "operator_needed"),
    ],
    ids=["it goes by itself", "an order", "another objective", "beyond the limit"],
)
def test_a_run_waits_for_what_the_scenario_changes(
    clock: Clock, scenario: dict[str, str], outcome: str
) -> None:
    limit = "limits: {ticks: 1000}\n" if clock is Clock.LOCKSTEP else "limits: {seconds: 1000}\n"
    played = play(cart(clock, **scenario) + limit)
    assert played.outcome["outcome"] == outcome
    waits = [line["until"] for line in played.all("waiting")]
    assert waits == ([] if scenario.get("until", "").endswith("2000") else [30])
    ends = played.outcome["ticks"] if clock is Clock.LOCKSTEP else played.records[-1]["t"]
    assert not waits or ends >= 29  # no robot moves in tick 30
    assert ("proof" in played.outcome) == (outcome == "operator_needed")
    assert next(line.get("for_now") for line in played.all("blocked")) == (bool(waits) or None)


def test_another_robot_continues_while_the_team_waits() -> None:
    tug = "  t: {model: quadcopter, start: [2, 3], objective: {patrol: [[2, 3], [1, 3]]}}"
    completed(cart(Clock.LOCKSTEP, until=", until: 30", tug=tug.replace("quadcopter", "tug")))


MEANWHILE = ("[1, 6]]}}", "[1, 6]]}, while_waiting: {visit: [[1, 2], [1, 1]]}}")


def test_a_robot_pursues_its_objective_for_that_time(clock: Clock) -> None:
    played = completed(cart(clock, until=", until: 30").replace(*MEANWHILE))
    (wait,) = played.all("waiting")
    (began,) = played.all("synthesis", tick=wait["tick"])
    assert began["objective"] == {"visit": [10, 9]}
    assert [line for line in played.all("goal", region=10) if line["tick"] > wait["tick"]]
    del played.records[0]["scenario"]["robots"]["a"]["while_waiting"]
    assert "a gets a command while the team waits" in played.findings


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


def test_a_sensor_ends_a_wait_before_its_time() -> None:
    scenario = loaded(cart(Clock.LIVE, changes="changes: [{robot: a, at: 200, service: back}]"))
    played = completed(scenario, world=Opened(scenario))
    assert [line["until"] for line in played.all("waiting")] == [200]
    assert played.one("gone")["t"] == 60 and played.records[-1]["t"] < 150


def test_an_input_ends_a_wait_before_its_time(clock: Clock) -> None:
    text = cart(clock, changes="changes: [{robot: a, at: 200, service: back}]")
    when = "[1, 6]]}, when: {home: {hold: [1, 1]}}}"
    text = text.replace("[1, 6]]}}", when) + "inputs: {home: {probability: 0.2}}\n"
    played = play(text)
    wait = played.all("waiting")[0]
    told = next(line for line in played.all("objective") if line["tick"] > wait["tick"])
    assert told["tick"] < 50 and wait["until"] == 200
    assert played.all("synthesis", tick=told["tick"])


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda run: run.one("waiting").update(until=2), "the team waits, but no change is due"),
        (lambda run: run.one("waiting").pop("until"), "the team waits, but no change is due"),
        (lambda run: run.one("gone").update(type="truth", traversable=True), "permanent"),
        (
            lambda run: run.all("move", tick=20)[0].update(to=10),
            "a gets a command while the team waits",
        ),
    ],
)
def test_the_audit_judges_a_wait(damage: Callable[[Run], object], said: str) -> None:
    run = play(cart(Clock.LOCKSTEP, until=", until: 30"))
    damage(run)
    assert said in run.findings


def test_a_bundle_of_a_run_that_waited() -> None:
    certified(cart(Clock.LOCKSTEP, until=", until: 30"))


UNDONE = """
map: {grid: ["########", "#......#", "########"], resolution: 1}
catalogue:
  robots:
    lifter: {mobility: free, layer: ground, capabilities: [lift], motion: disc, speed: 1}
    idler: {mobility: free, layer: air, capabilities: [], motion: disc, speed: 1}
  obstacles: {p0: {action: lift, resolve_at: [14], blocks: []}}
inputs: {alarm: {at: [40]}}
robots:
  r0: {model: lifter, start: 9, objective: {visit: [9, 11]}, when: {alarm: {hold: 9}}}
  r1: {model: idler, start: 13, objective: {hold: 13}}
obstacles: [{type: door, region: 12}]
orders: [{at: 3, type: p0, region: 14}]
until: {rounds: 1}
"""
QUIET = {"inputs: {alarm: {at: [40]}}": "", ", when: {alarm: {hold: 9}}": ""}
DOOR, GOES = "region: 12", "region: 12, until: 60"
SERVICE = "[{robot: r1, at: 2, service: out}, {robot: r1, at: 60, service: back}]"
OTHER = "changes: [{robot: r0, at: 60, objective: {hold: 9}}]"


@pytest.mark.parametrize(
    ("changed", "limit", "done", "last"),
    [
        ({DOOR: GOES}, 400, True, 60),
        ({"model: idler": "model: lifter", "until:": f"changes: {SERVICE}\nuntil:"}, 400, True, 60),
        ({}, 400, False, 41),
        (QUIET | {"until:": f"{OTHER}\nuntil:"}, 400, False, 60),
        (QUIET | {DOOR: GOES}, 55, False, 0),
    ],
    ids=["an obstacle goes", "service", "an input", "an objective", "nothing in time"],
)
def test_an_order_is_undone_only_when_nothing_is_to_come(
    clock: Clock, changed: dict[str, str], limit: int, done: bool, last: int
) -> None:
    text, lockstep = UNDONE, clock is Clock.LOCKSTEP
    for old, new in changed.items():
        text = text.replace(old, new)
    text += f"limits: {{{'ticks' if lockstep else 'seconds'}: {limit}}}\nclock: {clock.value}\n"
    played = play(text)
    ended = played.outcome
    assert ended["outcome"] == "completed"
    assert ("still open: p0@14" in ended["explanation"]) is not done
    assert len(played.all("resolved", obstacle="p0@14")) == done
    at = ended["tick"] if lockstep else ended["t"]
    assert at >= last if last else at < 40


def test_the_audit_judges_when_orders_are_left_undone(clock: Clock) -> None:
    run = play(f"{UNDONE}clock: {clock.value}\n")
    scenario = run.records[0]["scenario"]
    scenario["obstacles"][0]["until"] = 300
    assert "p0@14 is not done, and the scenario changes something at 300" in run.findings
    del scenario["obstacles"][0]["until"]
    assert not run.findings
    scenario["inputs"][0]["spans"] = [[4, 4]]
    assert "every robot has completed 1 round, but the run continues" in run.findings


LAST = """
map: {grid: ["#####", "#...#", "#####"], resolution: 1}
catalogue: {obstacles: {p0: {action: lift, blocks: []}}}
robots: {r0: {model: quadcopter, start: 6, objective: {hold: 6}}}
orders: [{at: 30, type: p0, region: 8}]
until: {rounds: 1}
clock: live
"""


def test_the_last_order_may_come_a_little_later_on_a_real_clock() -> None:
    """A drive hears the time of an order at the next message, and ends in that pass."""
    run = completed(LAST)
    assert run.still_open == ["p0@8"]
    for record in run.records:
        if record.get("t", 0.0) >= 30:
            record["t"] += 0.0003
    assert not run.findings


AFTER = """
map: {grid: ["#####", "#...#", "#..##", "#...#", "#####"], resolution: 1}
catalogue:
  robots: {m0: {mobility: free, layer: ground, capabilities: [clear], motion: disc, speed: 1}}
  obstacles: {t0: {action: look}, p2: {action: clear, blocks: []}}
robots: {r0: {model: m0, start: 16, objective: {visit: [18]}}}
obstacles: [{type: t0, region: 17, until: 30}]
orders: [{at: 2, type: p2, region: 18}]
"""


def test_an_order_is_requested_again_after_the_wait(clock: Clock) -> None:
    run = completed(f"{AFTER}clock: {clock.value}\n")
    assert [line["until"] for line in run.all("waiting")] == [2, 30]
    *_, again = run.all("synthesis", reason="service")
    (gone,) = run.all("gone")
    assert again["tick"] == gone["tick"]
    run.records[:] = [line for line in run.records if line["type"] != "waiting"]
    assert "a synthesis for the reason service, which no line records" in run.findings


def test_a_strategy_suffices_again_when_the_obstacle_is_away(clock: Clock) -> None:
    run = completed(f"""
        clock: {clock.value}
        map: {{grid: ["######", "#....#", "######"], resolution: 1}}
        robots:
          r0: {{model: quadcopter, start: 7, objective: {{once: [10, 8]}}}}
        obstacles: [{{type: door, region: 9, until: 30}}]
        until: {{rounds: 1}}
        """)
    verdicts = [line["verdict"] for line in run.all("synthesis", robot="r0")]
    assert verdicts == ["realizable", "unrealizable"]
    gone = run.one("gone")
    run.records.remove(gone)
    assert "strategy" in run.broken


BEHIND = """
map: {grid: ["#########", "#.......#", "#########"]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: [press]}}
  obstacles:
    gate: {action: press, resolve_at: [[1, 5]]}
    beam: {needs: [{action: lift}]}
robots: {cart: {model: cart, start: [1, 3], objective: {visit: [[1, 1], [1, 5]]}}}
obstacles: [{type: gate, region: [1, 2]}, {type: beam, region: [1, 4], until: 8}]
until: {rounds: 1}
"""


def test_what_is_impossible_for_now_is_not_called_impossible_forever() -> None:
    """The button of the gate is behind the beam, which disappears in tick 8."""
    run = completed(BEHIND)
    waits = [line["explanation"] for line in run.all("waiting")]
    assert waits and not any("ever" in said for said in waits)
    assert any("no robot can resolve gate@11" in said for said in waits)


def test_a_proof_that_ignores_what_has_disappeared_is_refused() -> None:
    run = play(BEHIND)
    gone = run.records.index(run.one("gone", obstacle="beam@13"))
    poses = [[region, None] for region in (12, 13, 14, 15)]
    robots = {"cart": {"poses": poses, "live": False}}
    proof = {"kind": "closure", "resolved": [], "never": [], "robots": robots}
    said = {"outcome": "operator_needed", "cause": "unrealizable", "proof": proof}
    forged = Run([*run.records[: gone + 1], {**run.outcome, **said, "tick": 8, "ticks": 7}])
    assert "gate@11 is still given up, though an obstacle has disappeared since" in forged.findings


CLOSED = """
clock: live
map: {grid: ["#######", "#.....#", "#######", "#.....#", "#######"]}
catalogue:
  robots: {rover: {mobility: free, layer: ground, capabilities: [sense]}}
  obstacles: {load: {needs: [{action: lift}], blocks: []}}
robots:
  a: {model: rover, start: [1, 1], objective: {visit: [[1, 5], [1, 1]]}}
  b: {model: rover, start: [3, 1], objective: {visit: [[3, 5], [3, 1]]}}
obstacles: [{type: uncertainty, region: [1, 3], traversable: false}]
orders: [{at: 90, type: load, region: [3, 3]}]
changes: [{at: 40, robot: b, service: out}]
until: {rounds: 1}
"""


def test_a_wait_is_resumed_although_the_first_tick_changes_something_first() -> None:
    run = play(CLOSED)
    assert run.outcome["outcome"] == "operator_needed"
    scenario, said = resumed(read_lines(run.lines[:-1]), loaded(CLOSED)), list[str]()
    rest = play(scenario)
    assert [line["tick"] for line in rest.all("service")] == [1]
    assert rest.outcome["outcome"] == "operator_needed"
    story = Story(scenario, lambda line: said.append(click.unstyle(str(line))), maps=False)
    Mission(scenario, listeners=[story]).run()
    assert any("a: hold" in line for line in said)
    assert not any("a reaches" in line for line in said)  # it stays where it is


UNTRAVERSABLE = """
map: {grid: ["#######", "#.....#", "#######"]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: [sense]}}
robots: {cart: {model: cart, start: [1, 1], objective: {visit: [[1, 5], [1, 1]]}}}
obstacles: [{type: uncertainty, region: [1, 3], traversable: false, until: 11}]
until: {rounds: 1}
"""


def test_what_was_found_untraversable_disappears_at_its_time(clock: Clock) -> None:
    text = f"{UNTRAVERSABLE}clock: {clock}\n"
    run = completed(text)
    assert run.one("blocked")["for_now"]
    gone = run.one("gone", obstacle="uncertainty@10")
    assert gone.get("t", gone["tick"]) == 11
    waits = run.records.index(run.one("waiting"))
    end = {"type": "outcome", "outcome": "operator_needed"}
    ended = Run([*run.records[:waits], {**run.outcome, **run.records[waits], **end}])
    assert "the run ends, but the scenario changes something at 11" in ended.findings
    completed(resumed(read_lines(run.lines[: waits + 2]), loaded(text)))
