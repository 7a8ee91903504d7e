"""Runs with many keys, faults of the world, and an operator who intervenes at random.

Among the tests the campaign is short; SAFENAV_FUZZ=1000 tries as many other seeds.
"""

import json
import os
from collections.abc import Callable

import pytest

from fuzz.blend import continued, play
from fuzz.mixed import Data, formula_mission, mixed_mission
from fuzz.troubles import faults_of
from fuzz.watch import Watch
from safenav.audit.check import check_trace
from safenav.errors import InputError, UsageError
from safenav.lines import json_line
from safenav.runtime import instant
from safenav.runtime.intervention.reading import read_intervention
from safenav.runtime.mission import Mission
from safenav.scenario.reading.loader import load_scenario_text
from safenav.synthesis.strategy import Strategy
from safenav.trace.writing import as_data

COUNT = int(os.environ.get("SAFENAV_FUZZ", "6"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "9000")) if "SAFENAV_FUZZ" in os.environ else 0

FAULTS = {
    "an order is to come, of which the world tells nothing": 2140,
    "who waits keeps to the rules that an input has brought": 2270,
    "what nobody has seen come is resolved": 2277,
    "what a sensor has shown while the team waits is known": 2279,
    "one out of service gives up its duty for a request that is closed": 2391,
}
OPERATOR = {
    "what is acted on is taken away": 4004,
    "an order in the first second": 4015,
    "an order that nobody can do is taken away": 4031,
    "taken out of service where it would have acted": 4083,
    "taken away twice": 4134,
    "put on an obstacle": 4339,
    "put elsewhere from where it holds": 4459,
    "put elsewhere during a plan": 4487,
    "an input ends a wait": 4506,
    "an order ends a wait": 4596,
    "two interventions, and the first makes the team wait": 7007,
    "an input that is as it was": 7119,
    "an order comes in the moment in which an action ends": 7289,
    "an input changes the objective on the way to a stop": 21263,
    "a robot that stays where it charges gets another objective": 53117,
    "an input gives the same targets in turn": 53182,
    "one is put back and an obstacle is said to stay": 53260,
    "requests are set aside one after the other": 53620,
    "an assigned goal is met where the robot stands": 53632,
    "an order comes while a robot turns on its way to a charger": 53743,
    "put on a charger with an empty battery": 57964,
    "put on its next target": 137379,
    "put beside what it can resolve": 61134,
    "put on its target, which counts while another one gets a strategy": 145643,
    "an order comes in the moment in which another intervention makes the team wait": 145645,
    "an action of two ends, and one of them has used up its charge": 62185,
    "another objective on the way to a stop, and then an order": 61262,
    "entered in the moment in which it is resolved": 117091,
}
BOTH = {
    "an order where the world knows of none": 3053,
    "an obstacle that a robot stands in is said to stay": 3105,
    "put elsewhere when all is done": 3145,
    "an action finds nothing, for a reason": 3149,
    "put on its target": 3323,
    "put elsewhere with an empty battery": 8044,
    "what was resolved is seen again": 8231,
    "lost, and said to be back": 3387,
    "put on a charger with an empty battery, on its way to another": 50632,
    "an order comes while an operator is waited for": 50640,
    "the charge no longer suffices for a stop": 56328,
    "an obstacle is said to stay before it is requested": 56470,
    "an obstacle that was given up is said to stay": 56496,
    "one is back before a request is set aside": 60790,
    "a need is met before the obstacle is known": 90059,
    "what a robot is on its way into is found untraversable by another": 90532,
    "put back while an operator is waited for": 100787,
    "said once more to be lost after it was put back": 116235,
    "carried to where it gets nowhere": 141559,
    "it helps elsewhere after what it helped with is resolved": 93596,
    "an order comes in the moment in which a robot's charge is used up": 90085,
    "a sensor misses what it has shown where a robot was held back": 161098,
    "another objective while it waits, and could not set out for a charger": 148096,
    "an action that ends in a wait resolves what was requested": 242,
    "where it charges it waits for help, and an operator takes its load": 9195,
}
LOCKSTEP = {
    "back in service, as it was": 7452,
    "another objective makes the team wait, and what follows ends that": 7529,
    "an objective under other rules is restored": 7662,
    "put somewhere, of which no line tells": 5091,
    "a stop is behind what nobody can resolve, but for its heading": 5123,
    "taken out of service while an order is awaited": 54297,
    "a helper is kept away by one out of service": 58813,
    "its battery is replaced while it starves": 58211,
    "with assignable goals a helper is due in one pose": 172141,
    "one that cannot be passed is taken out of service": 181144,
    "another objective is met before a mission is due that was lost": 184138,
}
PLAIN = {
    "an input gives an objective, and nobody passes": (73200, False),
    "it takes another load where it has put one down": (64249, True),
    "it waits for help where it might charge": (64249, False),
    "another one is done where it is to charge, and cannot leave": (51107, True),
    "a door sweeps both sides where another one is": (50395, True),
    "one that cannot turn back is where a door sweeps": (52136, True),
    "it waits where two doors sweep": (53001, False),
    "inside a door, it does not leave where that sweeps as another one acts": (5219, True),
    "the way around two that wait for help takes more charge": (100116, True),
    "two meet on the way to a charger": (135095, False),
    "a plan has brought it to a charger without charge": (103275, False),
    "it meets its target on a charger, or with a step from there": (104920, False),
    "no charge suffices for its last target forever, but it gets there": (104862, False),
    "out of service where it might charge, it helps no more": (102006, False),
    "whatever it is sent to, its strategy enters an obstacle": (158436, True),
    "it continues from a node with the same values": (163243, False),
    "it charges in a helper's way before it makes way": (146245, True),
}
CAUSES = [
    *(pytest.param(*row, False, False, id=name) for name, row in PLAIN.items()),
    *(pytest.param(seed, True, True, False, id=name) for name, seed in FAULTS.items()),
    *(pytest.param(seed, True, False, True, id=name) for name, seed in OPERATOR.items()),
    *(pytest.param(seed, True, True, True, id=name) for name, seed in BOTH.items()),
    *(pytest.param(seed, False, False, True, id=name) for name, seed in LOCKSTEP.items()),
]
"""Seeds that once ended in a finding: live, with faults, with an operator."""
WAYS = [(True, True, False), (True, False, True), (True, True, True), (False, False, True)]


@pytest.mark.parametrize(("seed", "live", "faults", "operator"), CAUSES)
def test_what_was_found_is_mended(seed: int, live: bool, faults: bool, operator: bool) -> None:
    data = mixed_mission(seed, live=live)
    one = play(data, seed, faults=faults_of(seed) if faults else None, operator=operator)
    assert not one.found


NONE = False, False
LOCK = False, *NONE
FORMULAS = {
    "left by a plan where its formulas forbid it to stay": (70200, False, False, False),
    "out of service, it is given an objective without formulas": (70212, False, False, True),
    "where nobody can be sent for an obstacle, one gets there": (74257, *LOCK),
    "it waits for help where its formulas forbid it to stay": (92689, False, False, False),
    "nobody has a strategy for a request that robots could meet": (100312, True, False, False),
    "an operator gives up while a robot has no strategy": (96487, True, False, True),
    "on the ways of their strategies robots do not serve a request": (100333, False, False, False),
    "an input forbids the next step of a plan": (73200, True, False, False),
    "a request that is set aside is needed for another one": (72181, True, False, True),
    "it charges when all is done": (96631, True, True, True),
    "a plan takes the charge that its robot needs": (104781, False, False, False),
    "it gives way where its formulas forbid it to stay": (101196, True, False, False),
    "it acts where it waits for others to leave what another act sweeps": (115236, *LOCK),
    "only memory reveals that two cannot change places": (103704, *LOCK),
    "only memory reveals a deadlock in live runs": (103704, True, False, False),
    "only memory reveals that one out of service cuts it off": (116719, False, False, True),
    "only memory reveals a deadlock of three": (100105, *LOCK),
    "a plan has taken a robot that waits for help elsewhere": (100024, True, False, False),
    "it has acted where its formulas forbid it to stay": (74257, True, False, False),
    "a round is over as a request is set aside": (97242, *LOCK),
    "an input changes the objective on the way from one target to another": (97881, True, *NONE),
    "no robot has a strategy for the first order, in no decision": (155147, *LOCK),
    "it waits where it would have helped before": (150691, True, *NONE),
    "it meets its goal in the moment in which it gets another strategy": (182374, True, *NONE),
}


ENDS = {101196: "completed", 104781: "completed", 74257: "completed"}
"""Ends that were no finding when they were others."""


@pytest.mark.parametrize(("seed", "live", "faults", "operator"), FORMULAS.values(), ids=FORMULAS)
def test_what_was_found_with_formulas_is_mended(
    seed: int, live: bool, faults: bool, operator: bool
) -> None:
    data, troubles = formula_mission(seed, live=live), faults_of(seed) if faults else None
    one = play(data, seed, faults=troubles, operator=operator)
    assert not one.found and one.outcome == ENDS.get(seed, one.outcome)


@pytest.mark.parametrize(("live", "faults", "operator"), WAYS)
@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_a_run_with_all_at_once_is_true(
    seed: int, live: bool, faults: bool, operator: bool
) -> None:
    data = mixed_mission(seed, live=live)
    try:
        one = play(data, seed, faults=faults_of(seed) if faults else None, operator=operator)
    except InputError:
        return
    assert not one.found


# 95826: a plan names an input
# 103359: it has no strategy where it was cut off, and waits for an order to come
# 101551, 103932: a joint plan is followed; 100159: robots have stood for a while
@pytest.mark.parametrize(
    ("seed", "live"),
    [(95826, True), (103359, False), (101551, False), (103932, True), (100159, False)],
)
def test_a_run_with_memories_continues(seed: int, live: bool) -> None:
    assert not continued(formula_mission(seed, live=live), seed).found


CUT = [*((seed, live) for seed in (10049, *range(FIRST, FIRST + COUNT)) for live in (True, False))]


# 22145: where it was cut off, the robot no longer had a strategy, and an order was to come
# 92279: it had had its turn in the tick in which the run was cut off, and stays on a target
# 94052: its charge is used up in the turn in which the run ends
# 72181: its objective changes while it helps
# 101831: it holds on while rounds restart
# 94188: a joint plan is followed
KILLED = [
    *CUT,
    *((seed, False) for seed in (92279, 94052, 72181, 101831, 94188)),
    (22145, True),
]


@pytest.mark.parametrize(("seed", "live"), KILLED)
def test_a_run_that_was_killed_continues(seed: int, live: bool) -> None:
    try:
        one = continued(mixed_mission(seed, live=live), seed)
    except InputError:
        return
    assert not one.found


LIVE = True, *NONE
ELSEWHERE = {
    "an input changes an objective first": (formula_mission, 131847, *LOCK, 10),
    "requests are open, and a plan is followed": (formula_mission, 131958, *LIVE, 45),
    "a strategy begins where a robot has stood": (formula_mission, 115867, *LIVE, 72),
    "what no formula remembers yet cannot be met": (formula_mission, 137973, *LOCK, 41),
    "a robot stays as rounds begin anew": (mixed_mission, 111051, *LOCK, 31),
    "an input is off before the objective is back": (mixed_mission, 114003, *LOCK, 12),
    "an operator has just said that it stays": (mixed_mission, 115004, True, False, True, 31),
    "a world that does not tell what appears": (mixed_mission, 115021, True, True, True, 72),
    "a world in which a truth was not known": (mixed_mission, 115004, True, True, True, 4),
    "a robot is stopped by what it meets": (mixed_mission, 116030, True, True, True, 19),
    "it ends at once, and a request is open": (mixed_mission, 147830, *LOCK, 39),
    "a robot waits where it holds": (mixed_mission, 148591, *LIVE, 33),
    "stopped by what it meets, it goes elsewhere": (mixed_mission, 152563, True, True, True, 38),
    "an operator has put it where it should not go": (mixed_mission, 154495, True, True, True, 23),
    "an operator has put it on an obstacle": (mixed_mission, 159479, True, True, True, 12),
    "an input is off, and its robot's round begins anew": (formula_mission, 162953, *LOCK, 16),
    "what is requested can never be resolved": (mixed_mission, 172282, True, True, True, 7),
    "a robot that waits has had its turn": (mixed_mission, 147702, *LOCK, 10),
    "a robot without a strategy, and an order is to come": (formula_mission, 171360, *LIVE, 86),
    "a robot that was charging continues": (mixed_mission, 147181, *LOCK, 60),
    "two with formulas lift together": (formula_mission, 164260, *LIVE, 64),
    "no strategy enters a region in one pose only": (mixed_mission, 172141, *LOCK, 5),
    "all is done, and a robot has no strategy": (formula_mission, 171360, *LIVE, 89),
}


@pytest.mark.parametrize(
    ("made", "seed", "live", "faults", "operator", "at"), ELSEWHERE.values(), ids=ELSEWHERE
)
def test_a_run_continues_from_one_of_its_lines(
    made: Callable[..., Data], seed: int, live: bool, faults: bool, operator: bool, at: int
) -> None:
    """Also one in which things have failed, and an operator has spoken."""
    failing = faults_of(seed) if faults else None
    one = continued(made(seed, live=live), seed, at=at, faults=failing, operator=operator)
    assert one.cuts == 1
    assert not one.found


def slow_mission(seed: int, *, live: bool) -> Data:
    """One in which each step of r1 takes two ticks, with little time."""
    made = mixed_mission(seed, live=live)
    made["catalogue"]["robots"]["m1"]["timing"] = 2
    return {**made, "until": {"rounds": 1, "by": 13}}


def hall_mission(seed: int, *, live: bool) -> Data:  # noqa: ARG001
    """Three robots that pass each other with little charge."""
    cart = {"mobility": "free", "layer": "ground", "battery": {"capacity": 10, "charge": 2}}
    ways = (21, "patrol", 16, 10), (10, "visit", 15, 16), (16, "visit", 13, 11)
    robots = {
        f"r{start}": {"model": "cart", "start": start, "objective": {kind: targets}}
        for start, kind, *targets in ways
    }
    rows = {"map": {"grid": ["#########", "#.......#", "###.#.###", "#########"]}, "robots": robots}
    more = {"catalogue": {"robots": {"cart": cart}}, "chargers": [15, 10]}
    return {"safenav": 1, "until": {"rounds": 2}, "seed": seed, **rows, **more}


EXCUSED = {
    "a flat battery beside other robots": (hall_mission, 1, False, 9),
    "late with durations that are drawn": (mixed_mission, 164376, False, 22),
    "late where a step is repeated": (slow_mission, 172321, False, 19),
    "formulas that forbid a robot to stay": (formula_mission, 149415, True, 52),
    "formulas in the middle of a joint plan": (formula_mission, 171360, True, 87),
    "a proof before something is due": (formula_mission, 174111, False, 36),
}


@pytest.mark.parametrize("excuse", EXCUSED)
def test_a_rest_may_end_otherwise_for_these_reasons(excuse: str) -> None:
    made, seed, live, at = EXCUSED[excuse]
    one = continued(made(seed, live=live), seed, at=at)
    assert not one.found
    assert {*one.excuses} == {excuse}


TWICE = {
    "before what is requested is so again": (118003, mixed_mission, 8, 2),
    "after a turn that was had before": (118010, mixed_mission, 33, 27),
    "after a robot has met the last target, and rounds begin anew": (118029, mixed_mission, 5, 27),
    "before a joint plan begins again": (118028, formula_mission, 37, 4),
    "before a robot's formulas remember anything": (118030, formula_mission, 4, 9),
    "before a load that a robot carries appears again": (175365, mixed_mission, 40, 1),
    "after a turn that was had before, and what it met is not counted": (
        *(175219, mixed_mission, 38, 5),
    ),
}


@pytest.mark.parametrize(("seed", "made", "at", "again"), TWICE.values(), ids=TWICE)
def test_a_rest_continues(seed: int, made: Callable[[int], Data], at: int, again: int) -> None:
    one = continued(made(seed), seed, at=at, again=again)
    assert one.cuts == 2
    assert not one.found


CART = """
safenav: 1
map: {grid: ["....."]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: []}}
  obstacles: {gate: {action: push}}
robots: {c: {model: cart, start: 0, objective: {visit: [4, 0]}}}
obstacles: [{type: gate, region: 2}]
until: {rounds: 1}
"""


def waiting(clock: str) -> Mission:
    """A mission that has met the gate, and waits for an operator if it is live."""
    scenario = load_scenario_text(f"{CART}clock: {clock}\n")
    mission = Mission(scenario, attended=clock == "live")
    mission.start()
    while not mission.state.knowledge.obstacles and mission.result is None:
        mission.step()
    return mission


@pytest.mark.parametrize(
    ("clock", "word", "said"),
    [
        ("live", "put_back c 2", "gate@2 is in region 2: resolve it first"),
        ("lockstep", "put_back c 1", "robots are put back only in live runs"),
        ("lockstep", "permanent gate@2", "obstacles become permanent only in live runs"),
    ],
)
def test_what_cannot_be_is_refused(clock: str, word: str, said: str) -> None:
    mission = waiting(clock)
    with pytest.raises(UsageError, match=said):
        mission.intervene(read_intervention(word, mission.state.scenario))


def test_a_robot_is_put_where_an_obstacle_is_taken_away() -> None:
    mission = waiting("live")
    for word in ("resolved gate@2", "put_back c 2", "resolved gate@2"):
        mission.intervene(read_intervention(word, mission.state.scenario))
    mission.step()
    assert mission.state.robots["c"].pose.region == 2
    while mission.result is None:
        mission.step()
    assert mission.result.outcome == "completed"


def test_the_judge_sees_what_must_not_be() -> None:
    """Two robots in one region, one in a known obstacle, and one that sets out without charge."""
    model = {"layer": "ground", "capabilities": [], "battery": {"capacity": 1, "stay": 0}}
    robots = {
        "a": {"model": "m", "start": 4, "objective": {"visit": [5], "avoid": [6]}},
        "b": {"model": "m", "start": 6, "objective": {"visit": [6]}},
    }
    data = {
        "map": {"grid": ["####", "....", "####"]},
        "catalogue": {"robots": {"m": model}},
        "robots": robots,
        "obstacles": [],
    }
    step = {"log": "start", "robot": "a", "command": 1, "busy": False, "stops": None}
    end = {"log": "end", "robot": "a", "how": "arrived", "within": None}
    told = {"log": "told", "robot": "a", "event": "arrived", "fatal": False, "command": 1}
    log = [
        {"log": "shown", "t": 0.0, "obstacle": "door@5"},
        {**step, "t": 0.0, "origin": 4, "to": 5, "stops": "door@5"},
        {**end, "t": 1.0, "at": 5},
        {**told, "t": 1.0},
        {**step, "t": 1.0, "origin": 5, "to": 6},
    ]
    assert [defect.split(": ")[1] for defect in Watch(data, log).defects] == [
        "a is sent into door@5, which is known",
        "a and b have [6] at the same time",
        "a sets out for 6, which it avoids",
        "a sets out with a charge of 0",
    ]


def test_a_robot_with_a_battery_is_given_no_objective_without_an_order() -> None:
    """It would forget at each charge which targets it has met."""
    text = CART.replace("capabilities: []", "capabilities: [], battery: {capacity: 9, charge: 3}")
    text += "chargers: [0]\nchanges: [{at: 3, robot: c, objective: {cover: [1, 0]}}]\n"
    with pytest.raises(InputError, match="without an order of its targets"):
        load_scenario_text(text)
    mission = Mission(load_scenario_text(text.replace("cover", "visit")))
    with pytest.raises(UsageError, match="without an order of its targets"):
        read_intervention("objective c {cover: [1, 0]}", mission.state.scenario)


@pytest.mark.parametrize("helped", [False, True], ids=["alone", "an operator helps"])
def test_a_run_in_which_no_time_passes_ends(monkeypatch: pytest.MonkeyPatch, helped: bool) -> None:
    """As if the robot did not continue from another node where its strategy steps aside."""
    monkeypatch.setattr(Strategy, "alike", lambda *_: ())
    monkeypatch.setattr(instant, "MOST_PASSES", (20, 5))
    lines: list[str] = []
    listener = [lambda record: lines.append(json_line(as_data(record)))]
    scenario = load_scenario_text(json.dumps(mixed_mission(158436, live=True)))
    mission = Mission(scenario, listeners=listener, attended=helped)
    mission.start()
    while mission.result is None:
        if mission.waiting is not None:
            assert mission.waiting.outcome == "search_limit"
            mission.intervene(read_intervention("resolved t1@8", scenario))
        mission.step()
    said = "no time passes in 26 passes of r0 (violation, backtrack)"
    assert (said in mission.result.explanation) is not helped
    assert mission.result.outcome == ("completed" if helped else "search_limit")
    assert not check_trace(lines).findings
