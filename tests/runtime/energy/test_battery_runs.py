"""Runs of robots with batteries: stops, refusals, flat robots; the audit follows each charge."""

import json
import os
from random import Random

import click
import pytest

from campaigns.generate.build import walled
from certify.making import certified
from once import SCENARIOS
from runtime.played import Run, completed, loaded, play
from safenav.errors import InputError
from safenav.report.terminal.story import Story
from safenav.runtime.analysis.resuming import resumed
from safenav.runtime.mission import Mission
from safenav.trace.reading import read_lines

COUNT = (int(os.environ.get("SAFENAV_FUZZ", "0")) or 24) // 3

CORRIDOR = """
map: {grid: ["#############", "#...........#", "#############"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [],
           battery: {capacity: 10, move: 1, charge: 3}}
    drone: {mobility: free, layer: air, capabilities: [bring]}
  obstacles:
    empty: {needs: [{action: bring, at: neighbours}], blocks: []}
robots:
  cart: {model: cart, start: [1, 1], objective: {visit: [[1, 11], [1, 1]]}}
  drone: {model: drone, start: [1, 6], objective: {hold: [1, 6]}}
chargers: [[1, 1], [1, 7]]
"""

STOPS = CORRIDOR.replace("[1, 11], [1, 1]", "[1, 11], {any: [[1, 2], [1, 3]]}")
"""It makes for a single region of a target where it can go on from that one only."""

FLAT = CORRIDOR.replace("chargers: [[1, 1], [1, 7]]", "chargers: []\nflat: empty").replace(
    "capacity: 10, move: 1, charge: 3", "capacity: 60, charge: 3, start: 4"
)


def test_it_goes_by_the_second_charger() -> None:
    played = completed(CORRIDOR)
    stops = [s["objective"] for s in played.all("synthesis", robot="cart", reason="charge")]
    assert {"hold": 20} in stops


@pytest.mark.parametrize("text", [CORRIDOR, STOPS])
def test_the_story_tells_charging_from_rounds(text: str) -> None:
    said: list[str] = []
    scenario = loaded(text)
    story = Story(scenario, lambda line: said.append(click.unstyle(str(line))), maps=False)
    Mission(scenario, listeners=[story]).run()
    assert any(line.endswith("cart: hold 20, to charge") for line in said)
    rounds = [line for line in said if "cart reaches" in line]
    assert len(rounds) == 2 and all("20" not in line for line in rounds), rounds


def test_a_charge_that_does_not_suffice_is_refused() -> None:
    run = play(CORRIDOR.replace("capacity: 10", "capacity: 5"))
    outcome = run.outcome
    assert outcome["outcome"] == "unrealizable"
    assert outcome["refused"] == {"cart.battery": None}
    said, _, enough = outcome["explanation"].partition("; a capacity of ")
    assert said.endswith("reaches no other stop from which it can continue")
    least = int(enough.removesuffix(" suffices"))
    for capacity, ends in ((least - 1, "unrealizable"), (least, "completed")):
        text = CORRIDOR.replace("capacity: 10", f"capacity: {capacity}")
        assert play(text).outcome["outcome"] == ends
    outcome["refused"]["cart.battery"] = 4
    assert run.findings


def test_a_flat_robot_waits_for_a_battery_and_goes_on(clock: str) -> None:
    played = completed(f"{FLAT}clock: {clock}\n")
    assert [line["obstacle"] for line in played.all("appeared", cause="battery")] == ["empty@18"]
    (brought,) = played.all("resolved", robot="drone")
    out, back = played.all("service", robot="cart")
    assert (out["active"], back["active"]) == (False, True)
    if clock == "lockstep":
        assert (out["tick"], back["tick"]) == (4, brought["tick"] + 1)


def test_a_robot_may_need_a_battery_in_each_of_its_rounds(clock: str) -> None:
    """A round takes 20 steps; a battery lasts 7."""
    text = FLAT.replace("capacity: 60, charge: 3, start: 4", "capacity: 7, charge: 3")
    text += f"clock: {clock}\n"
    played = completed(text)
    assert len(played.all("appeared", cause="battery")) == 5
    assert [line["round"] for line in played.all("goal", robot="cart")] == [0, 1, 1, 2]
    rest = completed(resumed(read_lines(played.upto("resolved")), loaded(text)))
    assert rest.outcome["rounds"]["cart"] == 2


def test_a_robot_without_charge_for_its_first_step_is_flat_from_the_start() -> None:
    played = completed(FLAT.replace("start: 4", "start: 0"))
    assert [line["tick"] for line in played.all("appeared", cause="battery")] == [1]


FLAT_BESIDE_A_REQUEST = """
map: {grid: ["#############", "#...........#", "######.######", "#...........#", "#############"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [],
           battery: {capacity: 20, charge: 3, start: 3}}
    walker: {mobility: free, layer: ground, capabilities: []}
    pusher: {mobility: free, layer: ground, capabilities: [push]}
    drone: {mobility: free, layer: air, capabilities: [bring]}
  obstacles:
    empty: {needs: [{action: bring, at: neighbours}], blocks: []}
robots:
  cart: {model: cart, start: [1, 1], objective: {visit: [[1, 4], [1, 1]]}}
  walker: {model: walker, start: [1, 7], objective: {visit: [[3, 8], [1, 7]]}}
  pusher: {model: pusher, start: [3, 1], objective: {hold: [3, 1]}}
  drone: {model: drone, start: [1, 11], objective: {hold: [1, 11]}}
flat: empty
obstacles: [{type: door, region: [2, 6]}]
until: {rounds: 1}
"""


def test_a_resumed_run_decides_about_open_requests_and_empty_batteries_together() -> None:
    played = play(FLAT_BESIDE_A_REQUEST)
    upto = played.upto("appeared", cause="battery")
    rest = play(resumed(read_lines(upto[:-2]), loaded(FLAT_BESIDE_A_REQUEST)))
    assert rest.outcome["outcome"] == played.outcome["outcome"] == "completed"
    assert [line["tick"] for line in rest.all("request")] == [1, 1]


@pytest.mark.parametrize(
    ("text", "charges", "said"),
    [
        (FLAT, {"start": 3, "move": 2, "capacity": 9}, "charge"),
        (FLAT, {"start": 5}, "no charge is used up"),
        (CORRIDOR + "clock: live\n", {"start": 5, "move": 2, "charge": 1}, "with a charge of"),
    ],
)
def test_the_audit_refuses_other_charges(text: str, charges: dict[str, int], said: str) -> None:
    run = play(text)
    battery = run.records[0]["scenario"]["robots"]["cart"]["battery"]
    for key, value in charges.items():
        was, battery[key] = battery[key], value
        assert said in run.findings, key
        battery[key] = was


@pytest.mark.parametrize("text", [STOPS, CORRIDOR + "clock: live\n", FLAT + "clock: live\n"])
def test_bundles_of_robots_with_batteries_are_accepted(text: str) -> None:
    certified(text)


def stop(seed: int, *, once: bool = False) -> str:
    """A robot with a battery, alone on its floor, among rooms with doors that it opens itself."""
    random = Random(seed)
    grid = walled(random, 4, 7, 0.15)
    free = [k for k, cell in enumerate("".join(grid)) if cell == "."]
    random.shuffle(free)
    turns = random.random() < 0.5
    goals = f"once: {free[5:8]}" if once else f"visit: {free[5:7]}"
    battery = f"{{capacity: {random.randint(8, 24)}, charge: {random.choice((1, 4))}, stay: 0}}"
    chargers = free[: random.randint(1, 3)]
    text = [
        "safenav: 1",
        f"map: {{grid: {json.dumps(grid)}}}",
        "catalogue:",
        "  robots:",
        f"    cart: {{mobility: {'heading' if turns else 'free'}, layer: ground,",
        f"           capabilities: [], battery: {battery}}}",
        "robots:",
        f"  cart: {{model: cart, start: {free[4]}, heading: east,",
        f"         objective: {{{goals}}}}}",
        f"chargers: {chargers}",
        "until: {rounds: 3}",
        "limits: {ticks: 600}",
    ]
    return "\n".join(text) + "\n"


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_lone_robot_always_gets_there(seed: int) -> None:
    text = stop(seed, once=seed % 3 == 0)
    try:
        loaded(text)
    except InputError:
        return
    assert play(text).outcome["outcome"] in ("completed", "unrealizable")


def test_a_robot_that_no_charge_suffices_for_charges_to_the_full_before_it_runs_flat() -> None:
    text = FLAT.replace("chargers: []", "chargers: [[1, 2]]")
    played = play(text.replace("capacity: 60, charge: 3, start: 4", "capacity: 7, charge: 3"))
    (first, *_) = played.all("appeared", cause="battery")
    assert (first["tick"], first["obstacle"]) == (9, "empty@22")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (CORRIDOR.replace("capacity: 10", "capacity: 2, move: 3"), "it holds 2"),
        (CORRIDOR.replace("charge: 3", "charge: 0"), "must be at least 1"),
        (CORRIDOR.replace("charge: 3", "charge: 3, start: 11"), "is 11, and it holds 10"),
        (CORRIDOR.replace("chargers: [[1, 1], [1, 7]]", ""), "has no charger"),
        (CORRIDOR.replace("chargers: [[1, 1]", "flat: door\nchargers: [[1, 1]"), "blocks: \\[\\]"),
        (CORRIDOR.replace("visit: [[1, 11]", "cover: [[1, 11]"), "order of its targets"),
    ],
)
def test_errors(text: str, found: str) -> None:
    with pytest.raises(InputError, match=found):
        loaded(text)


CUT_OFF = """
map: {grid: ["##############", "#............#", "##############"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [],
           battery: {capacity: 30, move: 1, stay: 1, charge: 5, start: 16}}
    opener: {mobility: free, layer: air, capabilities: [open]}
  obstacles:
    gate: {needs: [{action: open, at: neighbours}], blocks: [ground]}
robots:
  cart: {model: cart, start: [1, 2], objective: {visit: [[1, 12], [1, 3]]}}
  opener: {model: opener, start: [1, 12], objective: {hold: [1, 12]}}
obstacles: [{type: gate, region: [1, 6]}]
chargers: [[1, 11]]
until: {rounds: 1}
"""


def test_an_obstacle_on_the_way_to_a_charger_is_requested() -> None:
    played = play(CUT_OFF.replace("start: 16", "start: 9"))
    assert played.all("synthesis", reason="charge")
    assert [line["obstacle"] for line in played.all("resolved")] == ["gate@20"]


@pytest.mark.parametrize(("start", "due", "end"), [(16, 10, "kept"), (12, 6, "late")])
def test_a_charger_that_is_cut_off_is_a_deadline(start: int, due: int, end: str) -> None:
    """The cart waits at 5 from tick 4 on; the charger is 6 steps behind the gate."""
    played = play(CUT_OFF.replace("start: 16", f"start: {start}"))
    lines = played.all("deadline", cause="battery")
    assert [(line["due"], line["verdict"]) for line in lines] == [(due, "set"), (due, end)]
    out = played.all("service", active=False, cause="battery")
    assert bool(out) is (end == "late")


ONE_CHARGER = """
map: {grid: ["###############", "#......#......#", "#.............#", "###############"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, battery: {capacity: 55, move: 1, stay: 1, charge: 6}}
    key: {mobility: free, layer: air, capabilities: [unlock], timing: 8}
  obstacles:
    gate: {action: unlock, resolve_at: [[1, 13]], blocks: [ground]}
robots:
  a: {model: cart, start: [2, 4], objective: {visit: [[2, 4], [1, 10]]}}
  b: {model: cart, start: [1, 5], objective: {visit: [[1, 5], [1, 11]]}}
  k: {model: key, start: [1, 1], objective: {hold: [1, 1]}}
obstacles: [{type: gate, region: [2, 7]}]
chargers: [[1, 4]OTHER]
until: {rounds: 1}
"""


@pytest.mark.parametrize("other", ["", ", [2, 11]"], ids=["one", "another beyond the gate"])
def test_robots_that_wait_take_turns_at_the_charger_in_reach(other: str, clock: str) -> None:
    """Whichever came first stayed there, and the other one waited until its battery was empty; so
    it did while a charger that no robot can reach was free."""
    played = completed(f"{ONE_CHARGER.replace('OTHER', other)}clock: {clock}\n")
    (opened,) = played.all("resolved")
    waited = Run(played.records[: played.records.index(opened)])
    assert not waited.all("service", active=False)
    charged = [r["robot"] for r in waited.all("synthesis", reason="charge", objective={"hold": 19})]
    assert {*charged} == {"a", "b"}


LIVE = CORRIDOR + "clock: live\n"


def test_live_a_step_takes_the_same_however_long() -> None:
    faster = LIVE.replace("capabilities: [],\n", "capabilities: [], speed: 2, motion: disc,\n", 1)
    assert faster != LIVE
    ways = []
    for text in (LIVE, faster):
        played = completed(text)
        ways.append([line["to"] for line in played.all("depart", robot="cart")])
    assert ways[0] == ways[1]


def test_live_the_battery_of_the_paper_is_brought() -> None:
    text = (SCENARIOS / "battery_delivery.yaml").read_text()
    played = completed(text.replace("clock: lockstep", "clock: live"))
    told = {line["robot"] for line in (*played.all("met"), played.one("resolved"))}
    assert len(told) == 1  # the one that took it from the depot swaps it


def test_live_a_robot_that_waits_too_long_runs_flat() -> None:
    played = play(CUT_OFF + "clock: live\n")
    (out,) = played.all("service", active=False, cause="battery")
    assert out["t"] == pytest.approx(15.5, abs=0.6)  # 3 steps of a second, then a unit a second
    assert "late" not in played.outcome


def test_a_battery_that_is_brought_at_once_brings_its_robot_back() -> None:
    """The robot is in service in the tick after: until then the run does not end without it."""
    trace = completed(FLAT.replace("[1, 11]", "[1, 7]") + "until: {rounds: 1}\n")
    assert [line["active"] for line in trace.all("service", robot="cart")] == [False, True]


CHARGES_AT_THE_END = """
map: {grid: ["#######", "##..###", "#...#.#", "#######"]}
catalogue:
  robots:
    cart: {mobility: heading, layer: ground, capabilities: [],
           battery: {capacity: 9, move: 1, stay: 1, charge: 3, start: 4}}
robots:
  r: {model: cart, start: 10, heading: west, objective: {once: [16, 10]}}
chargers: [19, 17]
until: {rounds: 3}
"""


def test_rounds_at_a_last_target_go_on_after_a_charge() -> None:
    """Rounds count in the ticks in which the robot ends a stop to charge there, too; the audit
    counts them itself (``play``)."""
    run = play(CHARGES_AT_THE_END)
    assert (run.outcome["outcome"], run.outcome["rounds"]) == ("completed", {"r": 3})
    own = {"once": [16, 10]}
    assert [line["tick"] for line in run.all("synthesis", objective=own)] == [0, 2, 5, 11]
    run.records[0]["scenario"]["until"]["rounds"] = run.outcome["rounds"]["r"] = 4
    assert "completed" in run.broken
