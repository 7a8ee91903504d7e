"""Runs of robots with batteries: stops, refusals, flat robots; the audit follows each charge."""

import json
import os
from random import Random

import click
import pytest

from campaigns.generate.build import walled
from certify.making import certified
from once import SCENARIOS
from runtime.played import Run, completed, loaded, play, whole
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


COMPLETED = {
    "a target that it may not cross": """
        map: {grid: ["...", "...", "..."]}
        catalogue: {robots: {cart: {mobility: free, layer: ground,
                                    battery: {capacity: 6, charge: 1}}}}
        robots: {c: {model: cart, start: 5, objective: {circuit: [4, 8, 1], form: literal}}}
        chargers: [7]
        until: {rounds: 1}
        """,
    "a step that no strategy takes": """
        # it cannot turn to the west of 9
        map: {grid: ["######", "#....#", "######"]}
        catalogue: {robots: {rover: {mobility: heading, layer: ground,
                                     battery: {capacity: 22, charge: 1}}}}
        robots:
          r: {model: rover, start: 10, heading: south, objective: {visit: [9, {any: [8, 9, 10]}]}}
        chargers: [7, 8, 9]
        until: {rounds: 1}
        """,
    "a charger that it has left for a target": """
        # its strategy would go round, which the charge for the direct way does not suffice for
        map: {grid: ["#########", "#......##", "##..#...#", "#.......#", "#.#.....#", "#########"]}
        catalogue: {robots: {cart: {mobility: heading, layer: ground,
                                    battery: {capacity: 20, charge: 1}}}}
        robots: {cart: {model: cart, start: 25, heading: east, objective: {visit: [13, 12]}}}
        chargers: [33, 10, 30]
        until: {rounds: 3}
        """,
    "a duty farther from its target than the charger": """
        # it turned back beside the box with every charge
        map: {grid: ["...........", ".##########", ".##########", ".##########"]}
        catalogue:
          robots:
            cart: {mobility: free, layer: ground, capabilities: [lift], speed: 1,
                   battery: {capacity: 18, charge: 5}}
          obstacles: {box: {needs: [{action: lift, at: [9]}], blocks: []}}
        robots: {cart: {model: cart, start: 0, objective: {visit: [33, 1]}}}
        chargers: [0]
        orders: [{at: 1, type: box, region: 9}]
        until: {rounds: 1}
        """,
    "a duty in each of its stops": """
        # what its own next target takes brings it back to the charger again and again
        map: {grid: [".......", ".......", "......."]}
        catalogue:
          robots: {cart: {mobility: free, layer: ground, capabilities: [carry], speed: 0.5,
                          battery: {capacity: 20, charge: 1}}}
          obstacles: {parcel: {needs: [{action: carry, at: [6]}], blocks: []}}
        chargers: [7]
        robots: {d: {model: cart, start: 14, objective: {visit: [20, 0]}}}
        orders: [{at: 5, type: parcel, region: 6}, {at: 9, type: parcel, region: 6}]
        """,
}
CHANGED = [
    *((each, "", "") for each in COMPLETED),
    ("a target that it may not cross", ", form: literal", ""),
    ("a duty farther from its target than the charger", "capacity: 18", "capacity: 20"),
    ("a duty in each of its stops", "charge: 1", "charge: 5"),
]


@pytest.mark.parametrize(("why", "was", "now"), CHANGED)
def test_nothing_keeps_it_at_its_charger(why: str, was: str, now: str, clock: str) -> None:
    text = whole(COMPLETED[why]).replace(was, now)
    completed(f"{text}clock: {clock}\n")


ROVER = """
map: {grid: %s}
catalogue: {robots: {rover: {mobility: free, layer: ground, capabilities: [], battery: %s}}}
robots: {r: {model: rover, start: %d, objective: {visit: %s}}}
chargers: %s
clock: %s
"""
LANE = ["######", "#....#", "######"]
WHICHEVER = {
    "at its charger": (LANE, (9, 1, 3), 10, "[9, {any: [7, 9, 10]}]", [9]),
    "where it ends with no charge to spare": (
        ["#######", "#.....#", "#..#..#", "#######"],
        *((15, 2, 1), 11, "[19, {any: [9, 10, 12, 19]}]", [8, 10]),
    ),
    "at one of two chargers": (
        *(["#####", "#..##", "#..##", "#####"], (15, 5, 1), 11),
        *("[7, {any: [6, 7, 11, 12]}]", [6, 11]),
    ),
}


@pytest.mark.parametrize("where", WHICHEVER)
def test_it_has_charge_for_whichever_region_its_strategy_may_choose(where: str, clock: str) -> None:
    """Its next target is met by staying there, but it may go to another region for that."""
    grid, (capacity, start, charge), at, visit, chargers = WHICHEVER[where]
    battery = json.dumps({"capacity": capacity, "start": start, "charge": charge})
    made = ROVER % (json.dumps(grid), battery, at, visit, chargers, clock)
    assert play(made).outcome["outcome"] == "completed"


@pytest.mark.parametrize("clock", ["lockstep", "live"])
def test_it_has_charge_where_it_leaves_a_target_to_meet_it_on_its_way(clock: str) -> None:
    """Staying at 13 would meet its last target, but to turn it has to pass 8, which does, too."""
    grid, visit = ["######", "#....#", "#..#.#", "######"], [[14, 16], [9, 10, 13, 14], [8, 13]]
    battery = json.dumps({"capacity": 12, "start": 4, "charge": 3})
    targets = json.dumps([{"any": regions} for regions in visit])
    made = ROVER % (json.dumps(grid), battery, 9, targets, [13, 8, 14], clock)
    made = made.replace("free", "heading").replace("start: 9,", "start: 9, heading: north,")
    assert play(made).outcome["outcome"] == "completed"


CARRIES = """
map: {grid: ["........."]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [lift],
      battery: {capacity: 16, start: 5, charge: 4}}
  obstacles: {box: {needs: [{action: lift}, {action: lift, at: [8], same: true}], blocks: []}}
robots: {r: {model: cart, start: 3, objective: {once: [5]}}}
chargers: [0]
orders: [{at: 1, type: box, region: 5}]
until: {rounds: 1}
"""


def test_a_helper_can_get_to_a_charger_after_its_duty(clock: str) -> None:
    """Its own objective needs no charge any more where it takes the box, which is to go on."""
    completed(f"{CARRIES}clock: {clock}\n")


def test_a_charge_for_a_stay_alone_is_refused() -> None:
    """Its strategy may go from 8 to 7, from where it reaches no charger with the rest."""
    battery = "{capacity: 9, start: 1, charge: 3}"
    made = ROVER % (json.dumps(LANE), battery, 8, "[{any: [7, 8]}, {any: [7, 8]}]", [10], "live")
    assert play(made).outcome["explanation"].startswith("r needs a charge of 2 at 8")


SHARED = """
map: {grid: ["#######", "#.....#", "#.....#", "#######"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [],
           battery: {capacity: 12, move: 1, charge: 1}}
robots:
  a: {model: cart, start: [1, 2], objective: {visit: [[1, 5], [1, 2]]}}
  b: {model: cart, start: [2, 2], objective: {visit: [[2, 5], [2, 2]]}}
chargers: [[1, 1]]
"""


def test_a_robot_waits_until_another_one_has_charged(clock: str) -> None:
    """A joint plan would let them change places at the only charger until both are empty."""
    played = completed(f"{SHARED}clock: {clock}\n")
    assert not played.all("service")
    charging = {line["robot"] for line in played.all("synthesis", reason="charge")}
    assert charging == {"a", "b"} and not played.all("plan")


LAST = """
map: {grid: ["#########", "#.......#", "#########"]}
catalogue:
  robots:
    courier: {mobility: free, layer: air, capabilities: [push],
              battery: {capacity: 13, charge: 4}}
    cart: {mobility: free, layer: ground}
robots:
  carla: {model: courier, start: [1, 1], objective: {visit: [[1, 7], [1, 5]]}}
  bob: {model: cart, start: [1, 2], objective: {visit: [[1, 1], [1, 2]]}}
chargers: [[1, 1]]
until: {rounds: 1}
"""


ASIDE = """
map:
  grid: |
    ######
    #....#
    ###.##
    ######
  names: {dock: [1, 2], shelf: [1, 1]}
catalogue:
  robots:
    cart:
      {mobility: free, layer: ground, capabilities: [load],
       battery: {capacity: 6, charge: 1, stay: 0}}
    guard: {mobility: free, layer: ground, capabilities: []}
  obstacles: {job: {action: load, resolve_at: self, blocks: []}}
robots:
  cart: {model: cart, start: dock, objective: {hold: dock}}
  guard: {model: guard, start: shelf, objective: {hold: shelf}}
orders: [{at: 2, type: job, region: shelf}]
chargers: [dock]
until: {rounds: 1}
"""


@pytest.mark.parametrize("capacity", [6, 4])
def test_a_plan_takes_no_more_than_the_charge_and_a_robot_keeps_to_it(
    capacity: int, clock: str
) -> None:
    """The cart lets the guard out and goes to the shelf: five steps and one back, or four to the
    dock, where it charges. By its strategy it would keep two more steps in reserve."""
    run = completed(
        f"safenav: 1{ASIDE}clock: {clock}\n".replace("capacity: 6", f"capacity: {capacity}")
    )
    assert len(run.all("plan")) == 2  # there and back


def test_no_robot_is_sent_to_charge_when_the_mission_is_complete(clock: str) -> None:
    """Unless a robot whose turn comes later in that tick meets an obstacle."""
    run = completed(f"{LAST}clock: {clock}\n")
    assert not run.all("synthesis", reason="charge")
    if clock == "lockstep":
        run = completed(LAST + "obstacles: [{type: door, region: [1, 2], from: 8}]\n")
        first = run.all("synthesis", robot="carla", reason="charge")[0]
        assert (run.one("violation")["tick"], first["tick"]) == (8, 11)


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


SENT_ON = """
clock: live
map: {grid: ["#####", "#..##", "#...#", "#####"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [lift],
           battery: {capacity: 11, charge: 1, stay: 0}}
    slow: {mobility: free, layer: ground, capabilities: [clear], timing: {least: 1, most: 3}}
  obstacles:
    crate: {needs: [{action: clear, at: [11, 12]}, {action: lift}], blocks: [cart]}
    leaf: {action: clear, resolve_at: [6, 12], blocks: [ground], sweeps: neighbours}
robots:
  cart: {model: cart, start: 13, objective: {once: [{any: [6, 11]}]}}
  slow: {model: slow, start: 7, objective: {visit: [6, 12, 13]}}
obstacles: [{type: crate, region: 11}, {type: leaf, region: 6}]
until: {rounds: 1}
seed: 115652
chargers: [12, 13, 7]
"""
"""A robot that stays gets another stop after its turn, which no line tells."""


@pytest.mark.parametrize(
    "text", [STOPS, CORRIDOR + "clock: live\n", FLAT + "clock: live\n", SENT_ON]
)
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


WAITS = """
map: {grid: ["##########", "#........#", "##########"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, speed: 1,
           battery: {capacity: 16, move: 1, stay: 1, charge: 4}}
    opener: {mobility: free, layer: air, capabilities: [open], timing: 4, speed: 0.3}
  obstacles:
    gate: {needs: [{action: open, at: neighbours}], blocks: [ground]}
robots:
  cart: {model: cart, start: [1, 1], objective: {visit: [[1, 7], [1, 1]]}}
  opener: {model: opener, start: [1, 8], objective: {hold: [1, 8]}}
obstacles: [{type: gate, region: [1, 4]}]
chargers: [[1, 1]]
until: {rounds: 1}
"""


def test_a_robot_that_waits_for_help_returns_to_a_charger_in_time(clock: str) -> None:
    """It would wait in front of the gate until its battery is empty, two steps from the charger."""
    played = completed(f"{WAITS}clock: {clock}\n")
    assert not played.all("deadline")
    (opened,) = played.all("resolved")
    charges = [line["tick"] for line in played.all("synthesis", robot="cart", reason="charge")]
    assert min(charges) <= opened["tick"]
    assert not played.all("service")


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


DUE = """
map: {grid: ["######################", "#....................#", "#....................#",
             "######################"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [lift],
           battery: {capacity: 45, charge: 5, start: 8}}
    cat: {mobility: free, layer: ground}
  obstacles:
    parcel: {action: lift, blocks: []}
robots:
  cart: {model: cart, start: [1, 1], objective: {visit: [[1, 1], [1, 3]]}}
  cat: {model: cat, start: [2, 10], objective: {visit: [[2, 10], [2, 12]]}}
chargers: [[1, 3]]
orders: [{at: 3, type: parcel, region: [1, 20], resolve_within: 60}]
until: {rounds: 1}
"""


def test_a_plan_for_a_deadline_leaves_a_helper_the_charge_to_continue() -> None:
    """It led the helper straight to its duty, past its charger, with too little charge."""
    played = play(DUE)
    assert played.outcome["outcome"] == "completed"
    assert played.one("resolved")["obstacle"] == "parcel@42"


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


def test_a_lone_robot_that_nothing_charges_ends_the_run(clock: str) -> None:
    """It waits for what the scenario removes, until its charge is used up."""
    outcome = play(f"""
        map: {{grid: ["########", "#......#", "###.####", "########"]}}
        catalogue:
          robots:
            cart: {{mobility: free, layer: ground,
                    battery: {{capacity: 12, move: 1, stay: 1, charge: 5}}}}
          obstacles: {{rubble: {{action: tow}}}}
        chargers: [[1, 6]]
        robots: {{a: {{model: cart, start: [1, 1], objective: {{patrol: [[1, 1], [1, 6]]}}}}}}
        obstacles: [{{type: rubble, region: [1, 4], until: 60}}]
        clock: {clock}
        """).outcome
    assert (outcome["outcome"], outcome["cause"]) == ("operator_needed", "out_of_service")
    assert "a out of service (battery of a empty)" in outcome["explanation"]


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


def test_a_robot_charges_while_the_team_waits(clock: str) -> None:
    """The guard waits until the gate of nobody is gone; the rover goes on meanwhile, and needs its
    charger for that."""
    run = completed(f"""
        map: {{grid: ["######", "#...##", "####.#", "####.#", "######"]}}
        catalogue:
          robots:
            rover: {{mobility: free, layer: ground, battery: {{capacity: 6, charge: 3}}}}
            guard: {{mobility: free, layer: ground}}
          obstacles: {{gate: {{action: none}}}}
        robots:
          rover: {{model: rover, start: 7, objective: {{visit: [9, 7]}}}}
          guard: {{model: guard, start: 16, objective: {{visit: [22, 16]}}}}
        obstacles: [{{type: gate, region: 22, until: 30}}]
        chargers: [7]
        until: {{rounds: 1}}
        clock: {clock}
        """)
    assert run.all("waiting") and not run.all("service")
    assert run.all("synthesis", robot="rover", reason="charge")


def test_a_helper_gets_past_another_one_before_it_charges_again(clock: str) -> None:
    """The first of two stands in the nearest region of their need; the other one is to wait for the
    plan for it, next to its charger, no longer than its charge lasts."""
    completed(f"""
        map: {{grid: ["#######", "#..#..#", "#.....#", "#.....#", "#######"]}}
        catalogue:
          robots:
            cart: {{mobility: free, layer: ground, capabilities: [lift]}}
            rover:
              {{mobility: free, layer: ground, capabilities: [lift],
                battery: {{capacity: 12, charge: 3, stay: 1}}}}
          obstacles:
            crate:
              needs:
                - {{action: lift, robots: 2, at: [8, 9, 23], together: true}}
                - {{action: lift, at: [17, 18], together: true, same: true}}
              blocks: []
        robots:
          cart: {{model: cart, start: 23, objective: {{hold: 23}}}}
          rover: {{model: rover, start: 17, objective: {{hold: 17}}}}
        orders: [{{at: 5, type: crate, region: 25}}]
        chargers: [12, 15]
        until: {{rounds: 1}}
        limits: {{ticks: 60}}
        clock: {clock}
        """)


def test_a_robot_that_is_hemmed_in_elsewhere_keeps_its_stop() -> None:
    """The proof that no moves bring the rover to its stop is of the pose that it left since."""
    completed("""
        map: {grid: ["#######", "#.....#", "#..#..#", "#######"]}
        catalogue:
          robots:
            rover: {mobility: heading, layer: ground, battery: {capacity: 15, charge: 1}}
            guard: {mobility: free, layer: ground, timing: 2}
          obstacles: {gate: {action: none}}
        robots:
          rover: {model: rover, start: 12, heading: east, objective: {patrol: [16, 8]}}
          guard: {model: guard, start: 8, objective: {hold: {any: [10, 16]}}}
        obstacles: [{type: gate, region: 9, until: 15}]
        chargers: [10, 12, 19]
        changes: [{at: 8, robot: guard, service: out}, {at: 53, robot: guard, service: back}]
        until: {rounds: 1}
        """)


def test_a_robot_leaves_its_charger_when_an_obstacle_becomes_permanent(clock: str) -> None:
    """It went on waiting at the charger, until the run reached its limit."""
    played = play(f"""
        map: {{grid: ["#..", "..."]}}
        catalogue:
          robots:
            cart: {{mobility: free, layer: ground, battery: {{capacity: 13, charge: 1, stay: 1}}}}
        robots:
          a: {{model: cart, start: 4, objective: {{once: [2, 5]}}, while_waiting: {{hold: 5}}}}
        obstacles: [{{type: crate, region: 2}}]
        inputs: {{alarm: {{at: 7-15}}}}
        chargers: [5]
        limits: {{ticks: 60}}
        clock: {clock}
        """)
    assert played.all("synthesis", reason="charge", objective={"hold": 5})
    assert played.outcome["outcome"] == "operator_needed"
