"""More good traces: joint plans, obstacles that come and go, several needs, proofs."""

import hashlib
import json
from collections.abc import Callable
from typing import Any

from judge.trace_script import CORRIDOR, ROOM, Line, Script, closure, obstacle, robot


def script(
    grid: str, robots: dict[str, Line], obstacles: list[Line] | None = None, **more: Any
) -> Script:
    return Script(grid, robots, obstacles or [], **more)


def way(*regions: int) -> list[Any]:
    return [[region, None] for region in regions]


def planned() -> list[Line]:
    """Two robots exchange places by a plan: one by the northern wall, one by the southern."""
    s = script(
        ROOM,
        {
            "one": robot("ground", [], 7, {"visit": [10]}),
            "two": robot("ground", [], 10, {"visit": [7]}),
        },
    )
    s.next_tick().move("one").move("two")
    s.next_tick().add(
        "plan",
        reason="starved",
        robots={"one": way(7, 8, 9, 10), "two": way(10, 16, 15, 14, 13, 7)},
        orders=[["two", 1, "one", 3], ["one", 1, "two", 5]],
    )
    s.step("one", 8).step("two", 16)
    s.next_tick().step("one", 9).step("two", 15)
    s.next_tick().step("one", 10).goal("one", 0, 1).step("two", 14)
    s.next_tick().step("one").set_out("two", 13)
    s.lines[-1]["by"] = "plan"
    s.next_tick().step("one").step("two", 13)
    s.next_tick().step("one").step("two", 7).goal("two", 0, 1)
    s.add("plan_end", reason="reached", nodes={"one": 0, "two": 0})
    return s.end("completed", {"one": 1, "two": 1})


def met_on_the_way() -> list[Line]:
    """A plan ends where a robot encounters an obstacle; a third robot, in the air, has no part."""
    s = script(
        ROOM,
        {
            "one": robot("ground", [], 7, {"visit": [10]}),
            "two": robot("ground", ["push"], 16, {"visit": [16]}),
            "quad": robot("air", [], 8, {"visit": [8]}),
        },
        [obstacle("door", 9, "push", [9, 15], ["one"])],
    )
    s.next_tick().add(
        "plan", reason="starved", robots={"one": way(7, 8, 9, 10), "two": way(16)}, orders=[]
    )
    s.step("one", 8).step("two").goal("two", 0, 1).move("quad").goal("quad", 0, 1)
    s.next_tick().meet("one", "door@9")
    s.add("plan_end", reason="violation").request("one", "door@9", {"two": 1}, "two")
    s.push("one", "door@9", "two", one={"hold": 8}, two={"visit": [[9, 15]]})
    s.synthesize("request", "one", "two").move("two", 15).resolve("two", "door@9").pop()
    s.synthesize("resolved", "one", "two").move("quad")
    s.next_tick().move("one", 9).move("two", 16).goal("two", 0, 1).move("quad")
    s.goal("quad", 0, 1)
    s.next_tick().move("one", 10).goal("one", 0, 1).move("two").move("quad")
    return s.end("completed", {"one": 1, "two": 1, "quad": 1})


def come_and_gone() -> list[Line]:
    """Debris falls behind the cart, goes by itself, and falls again where the cart is not."""
    entry = obstacle("debris", 10, "clear", [10], ["cart"]) | {"from": 3, "until": 5}
    s = script(CORRIDOR, {"cart": robot("ground", [], 8, {"visit": [12]})}, [entry])
    s.next_tick().move("cart", 9)
    s.next_tick().move("cart", 10)
    s.next_tick().move("cart", 11)
    s.add("appeared", obstacle="debris@10", cause="scenario")
    s.next_tick().move("cart")
    s.next_tick().add("gone", obstacle="debris@10", cause="scenario")
    s.move("cart", 12).goal("cart", 0, 1)
    return s.end("completed", {"cart": 1})


def told() -> list[Line]:
    """The cart is told to turn back, and stands still for two ticks."""
    s = script(CORRIDOR, {"cart": robot("ground", [], 8, {"visit": [12]})}, [])
    s.lines[0]["scenario"]["changes"] = [
        {"at": 2, "robot": "cart", "objective": {"visit": [8]}, "active": None},
        {"at": 3, "robot": "cart", "objective": None, "active": False},
        {"at": 5, "robot": "cart", "objective": None, "active": True},
    ]
    change = {"robot": "cart", "cause": "scenario"}
    s.next_tick().move("cart", 9)
    s.next_tick().add("objective", objective={"visit": [8]}, at_once=True, **change)
    s.synthesize("objective", "cart", objective={"visit": [8]}).move("cart", 10)
    s.next_tick().add("service", active=False, **change).move("cart")
    s.next_tick().move("cart")
    s.next_tick().add("service", active=True, **change).move("cart", 9)
    s.next_tick().move("cart", 8).goal("cart", 0, 1)
    return s.end("completed", {"cart": 1})


def lifted() -> list[Line]:
    """Two robots lift a beam together, after a third has sensed it."""
    beam = obstacle("beam", 10, "sense", [9], ["cart", "left", "right"]) | {
        "needs": [
            {"action": "sense", "regions": [9]},
            {"action": "lift", "regions": [9, 11], "robots": 2, "together": True},
        ]
    }
    s = script(
        CORRIDOR,
        {
            "cart": robot("ground", ["sense"], 8, {"visit": [8]}),
            "left": robot("air", ["lift"], 8, {"visit": [8]}),
            "right": robot("high", ["lift"], 12, {"visit": [12]}),
        },
        [beam],
    )
    first = {"need": 0, "action": "sense", "robot": "cart", "at": 9}
    then = {"need": 1, "action": "lift", "robot": "right", "at": 11, "robots": ["left", "right"]}
    s.next_tick().move("cart", 9).add("met", obstacle="beam@10", **first)
    s.move("left", 9).move("right")
    s.next_tick().move("cart", 8).move("left").move("right", 11)
    s.add("met", obstacle="beam@10", **then).resolve("right", "beam@10", requested=False)
    s.lines[-1]["robots"] = ["cart", "left", "right"]
    s.next_tick().move("cart").goal("cart", 0, 1).move("left", 8).goal("left", 0, 1)
    s.move("right", 12).goal("right", 0, 1)
    return s.end("completed", {"cart": 1, "left": 1, "right": 1})


def given_up() -> list[Line]:
    """Nobody can open the door between the drone and its target: the closure shows it."""
    s = script(
        CORRIDOR,
        {
            "drone": robot("air", [], 8, {"visit": [12]}),
            "digit": robot("ground", ["push"], 9, {"visit": [9]}),
        },
        [obstacle("gate", 10, "clear", [10], ["drone", "digit"])],
    )
    s.next_tick().move("drone", 9).move("digit").goal("digit", 0, 1)
    s.next_tick().meet("drone", "gate@10").request("drone", "gate@10", {}, None)
    proof = closure(["gate@10"], drone=([8, 9], False), digit=([8, 9], True))
    s.block("gate@10", "no_capable_robot", proof, "drone", "digit")
    rounds = {"drone": 0, "digit": 1}
    return s.end("operator_needed", rounds, cause="no_capable_robot", proof=proof)


def stuck() -> list[Line]:
    """Two robots in a corridor that would have to pass each other: the joint search is done."""
    s = script(
        CORRIDOR,
        {
            "one": robot("ground", [], 8, {"visit": [12]}),
            "two": robot("ground", [], 11, {"visit": [8]}),
        },
    )
    s.next_tick().move("one", 9).move("two")
    poses = [way(a, b) for a in range(8, 13) for b in range(a + 1, 13)]
    lines = sorted(json.dumps(one, separators=(",", ":")) + "\n" for one in poses)
    proof = {
        "kind": "joint",
        "robots": ["one", "two"],
        "start": {"one": [9, None], "two": [11, None]},
        "stages": {},
        "goal": {"rounds": 1},
        "states": len(poses),
        "sha256": hashlib.sha256("".join(lines).encode()).hexdigest(),
    }
    return s.end("operator_needed", {"one": 0, "two": 0}, cause="deadlock", proof=proof)


def parked() -> list[Line]:
    """A robot that holds makes way for another one, and the run ends when it is back."""
    s = script(
        ROOM,
        {
            "one": robot("ground", [], 14, {"hold": 8}),
            "two": robot("ground", [], 7, {"hold": 9}),
        },
    )
    s.next_tick().move("one", 8).goal("one", 0, 1).move("two")
    s.next_tick().add(
        "plan",
        reason="starved",
        robots={"one": way(8, 14), "two": way(7, 8, 9)},
        orders=[["one", 1, "two", 1]],
    )
    s.step("one", 14).step("two", 8)
    s.next_tick().step("one").step("two", 9).goal("two", 0, 1)
    s.add("plan_end", reason="reached", nodes={"one": 0, "two": 0})
    s.next_tick().move("one", 8).goal("one", 0, 2).move("two")
    return s.end("completed", {"one": 2, "two": 2})


def no_room() -> list[Line]:
    """Two robots end at one region: that needs no search."""
    s = script(
        CORRIDOR,
        {
            "one": robot("ground", [], 8, {"hold": 10}),
            "two": robot("ground", [], 11, {"once": [12, 10]}),
        },
    )
    s.next_tick().move("one", 9).move("two", 12).goal("two", 0, 0)
    proof = {"kind": "room", "robots": ["one", "two"]}
    return s.end("operator_needed", {"one": 0, "two": 0}, cause="deadlock", proof=proof)


GOOD_PLANS: dict[str, Callable[[], list[Line]]] = {
    "planned": planned,
    "met_on_the_way": met_on_the_way,
    "come_and_gone": come_and_gone,
    "told": told,
    "lifted": lifted,
    "given_up": given_up,
    "stuck": stuck,
    "parked": parked,
    "no_room": no_room,
}
