"""Traces written by hand, each of a correct run."""

from collections.abc import Callable

from judge.good_plans import GOOD_PLANS
from judge.trace_script import CORRIDOR, ROOM, Line, Script, closure, obstacle, robot

HALL = """
#########
#.......#
#.......#
#########
"""
"""Free regions: 10 to 16 above 19 to 25."""

RING = """
#########
#.......#
#.#####.#
#.#####.#
#.#####.#
#########
"""
"""Free regions: 10 to 16, from there 19, 28, 37 and 25, 34, 43 to the south."""

HOUSE = """
#########
#...#...#
#.......#
#...#...#
#########
"""
"""Free regions: 10 to 12 and 14 to 16 above 19 to 25 above 28 to 30 and 32 to 34."""


def door() -> list[Line]:
    """The quadcopter encounters a door; Digit opens it; both continue."""
    s = Script(
        ROOM,
        {
            "quad": robot("air", ["sense"], 7, {"patrol": [7, 10]}),
            "digit": robot("ground", ["push"], 13, {"visit": [13, 8]}, heading="north"),
        },
        [obstacle("door", 9, "push", [9], ["digit", "quad"])],
    )
    s.next_tick().move("quad", 8).move("digit", 7)
    s.next_tick().meet("quad", "door@9").request("quad", "door@9", {"digit": 2}, "digit")
    s.push("quad", "door@9", "digit", quad={"hold": 8}, digit={"visit": [9, 13]})
    s.synthesize("request", "quad", "digit").move("digit", 8)
    s.next_tick().move("quad").goal("quad", 0, 1).move("digit", 9)
    s.resolve("digit", "door@9").pop().synthesize("resolved", "quad", "digit")
    s.next_tick().move("quad", 9).move("digit", 15)
    s.next_tick().move("quad", 10).goal("quad", 1, 0).move("digit", 14)
    s.next_tick().move("quad", 9).move("digit", 13).goal("digit", 0, 0)
    s.next_tick().move("quad", 8).move("digit", 7)
    s.next_tick().move("quad", 7).goal("quad", 0, 1).move("digit", 8).goal("digit", 1, 1)
    return s.end("completed", {"quad": 1, "digit": 1})


def pressed() -> list[Line]:
    """A robot opens the door in its way by a button elsewhere: it is requester and helper."""
    s = Script(
        HOUSE,
        {"pia": robot("ground", ["press"], 20, {"visit": [20, 24]})},
        [obstacle("door", 22, "press", [10], ["pia"])],
    )
    s.next_tick().move("pia", 21)
    s.next_tick().meet("pia", "door@22").request("pia", "door@22", {"pia": 3}, "pia")
    s.push("pia", "door@22", "pia", pia={"visit": [10, 21]}).synthesize("request", "pia")
    s.next_tick().move("pia", 12).next_tick().move("pia", 11)
    s.next_tick().move("pia", 10).resolve("pia", "door@22").pop().synthesize("resolved", "pia")
    for to in (11, 12, 21, 22, 23, 24):
        s.next_tick().move("pia", to)
    s.goal("pia", 1, 1)
    return s.end("interrupted", {"pia": 0})


def untraversable() -> list[Line]:
    """A region that Digit senses turns out untraversable; Digit takes a detour."""
    s = Script(
        ROOM,
        {
            "digit": robot("ground", ["push"], 7, {"patrol": [7, 10]}, heading="east"),
            "quad": robot("air", ["sense"], 16, {"visit": [16, 13]}),
        },
        [obstacle("uncertainty", 9, "sense", [8, 10, 15], ["digit"], traversable=False)],
    )
    s.next_tick().move("digit", 8).move("quad")
    s.next_tick().meet("digit", "uncertainty@9", instead=14)
    s.request("digit", "uncertainty@9", {"quad": 1}, "quad")
    s.push("digit", "uncertainty@9", "quad", digit={"hold": 14}, quad={"visit": [[8, 10, 15], 16]})
    s.synthesize("request", "digit", "quad").move("quad", 15)
    s.resolve("quad", "uncertainty@9").block("uncertainty@9", "untraversable", None, "digit")
    s.pop().synthesize("resolved", "digit", "quad")
    s.next_tick().move("digit", 15).move("quad", 14)
    s.next_tick().move("digit", 16).move("quad", 13).goal("quad", 1, 1)
    s.next_tick().move("digit", 10).goal("digit", 1, 1).move("quad", 14)
    return s.end("interrupted", {"digit": 0, "quad": 0})


def nested() -> list[Line]:
    """A robot that waits for help helps another one meanwhile."""
    s = Script(
        RING,
        {
            "rover": robot("ground", ["push"], 10, {"visit": [10, 13]}),
            "drone": robot("air", [], 16, {"visit": [25, 13]}),
            "scout": robot("high", ["sense"], 25, {"visit": [25, 16]}),
        },
        [
            obstacle("uncertainty", 11, "sense", [12, 13], ["rover"], traversable=True),
            obstacle("door", 14, "push", [37], ["drone"]),
        ],
    )
    sensed, own = {"visit": [[12, 13], 25]}, dict(s.objectives)
    s.next_tick().meet("rover", "uncertainty@11")
    s.request("rover", "uncertainty@11", {"scout": 4}, "scout")
    s.push("rover", "uncertainty@11", "scout", rover={"hold": 10}, scout=sensed)
    s.synthesize("request", "rover", "scout").move("drone", 15).move("scout", 16)
    s.next_tick().move("rover").meet("drone", "door@14")
    s.request("drone", "door@14", {"rover": 3}, "rover")
    s.push("drone", "door@14", "rover", rover={"visit": [37, 10]}, drone={"hold": 15})
    s.synthesize("request", "rover", "drone").move("scout", 15)
    s.next_tick().move("rover", 19).move("drone").move("scout", 14)
    s.next_tick().move("rover", 28).move("drone").move("scout", 13)
    s.resolve("scout", "uncertainty@11").pop("uncertainty@11", scout=own["scout"])
    s.synthesize("resolved", "scout")
    s.next_tick().move("rover", 37).resolve("rover", "door@14")
    s.pop("door@14", rover=own["rover"], drone=own["drone"])
    s.synthesize("resolved", "rover", "drone").move("drone").move("scout", 14)
    s.next_tick().move("rover", 28).move("drone", 14).move("scout", 15)
    s.next_tick().move("rover", 19).move("drone", 13).goal("drone", 1, 0)
    s.move("scout", 16).goal("scout", 1, 0)
    s.next_tick().move("rover", 10).goal("rover", 0, 0).move("drone", 14).move("scout", 25)
    s.goal("scout", 0, 1)
    for to, drone in ((11, 15), (12, 16), (13, 25)):
        s.next_tick().move("rover", to)
        if to == 13:
            s.goal("rover", 1, 1)
        s.move("drone", drone)
        if drone == 25:
            s.goal("drone", 0, 1)
        s.move("scout")
    return s.end("completed", {"rover": 1, "drone": 1, "scout": 1})


def unrequested() -> list[Line]:
    """Digit opens a door on its path without a request; the stack is unchanged."""
    s = Script(
        ROOM,
        {
            "digit": robot("ground", ["push"], 7, {"visit": [7, 10]}, heading="east"),
            "quad": robot("air", ["sense"], 13, {"cover": [14, 15]}),
        },
        [obstacle("door", 9, "push", [9], ["digit", "quad"])],
    )
    s.next_tick().move("digit", 8).move("quad", 14).goal("quad", 0, 0)
    s.next_tick().move("digit", 9).resolve("digit", "door@9", requested=False).move("quad", 8)
    s.next_tick().move("digit", 10).goal("digit", 1, 1).move("quad", 9)
    s.next_tick().move("digit", 16).move("quad", 15).goal("quad", 1, 1)
    s.next_tick().move("digit", 15).move("quad", 14).goal("quad", 0, 1)
    s.next_tick().move("digit", 14).move("quad", 15).goal("quad", 1, 2)
    return s.end("interrupted", {"digit": 0, "quad": 1})


def _around(s: Script) -> list[Line]:
    """The rover goes around region 8, and back."""
    for to in (13, 14, 15, 16, 10):
        s.next_tick().move("rover", to)
    s.goal("rover", 0, 0)
    for to in (16, 15, 14, 13, 7):
        s.next_tick().move("rover", to)
    s.goal("rover", 1, 1)
    return s.end("completed", {"rover": 1})


def detour() -> list[Line]:
    """No robot can clear the debris: it becomes permanent, and the rover takes a detour."""
    s = Script(
        ROOM,
        {"rover": robot("ground", [], 7, {"visit": [10, 7]})},
        [obstacle("debris", 8, "clear", [8], ["rover"])],
    )
    s.next_tick().meet("rover", "debris@8").request("rover", "debris@8", {}, None)
    proof = closure(["debris@8"], rover=([7, 9, 10, 13, 14, 15, 16], True))
    s.block("debris@8", "no_capable_robot", proof, "rover").synthesize("blocked", "rover")
    return _around(s)


def avoiding() -> list[Line]:
    """The rover never enters region 8, and leaves 10 to the south only."""
    own = {"visit": [10, 7], "avoid": [8], "always": ["region = 10 -> region' = 16"]}
    s = Script(ROOM, {"rover": robot("ground", [], 7, own)}, [])
    return _around(s)


def operator() -> list[Line]:
    """No robot can clear the only path."""
    s = Script(
        CORRIDOR,
        {"rover": robot("ground", [], 8, {"visit": [8, 12]})},
        [obstacle("debris", 10, "clear", [10], ["rover"])],
    )
    s.next_tick().move("rover", 9)
    s.next_tick().meet("rover", "debris@10").request("rover", "debris@10", {}, None)
    proof = closure(["debris@10"], rover=([8, 9], False))
    s.block("debris@10", "no_capable_robot", proof, "rover")
    return s.end("operator_needed", {"rover": 0}, cause="no_capable_robot", proof=proof)


def second_bidder() -> list[Line]:
    """The nearest bidder's task is unrealizable, so the next one helps."""
    s = Script(
        HALL,
        {
            "quad": robot("air", [], 11, {"hold": 12}),
            "near": robot("ground", ["push"], 13, {"visit": [13, 14]}),
            "far": robot("ground", ["push"], 16, {"visit": [16, 25]}),
        },
        [obstacle("door", 12, "push", [12], ["quad"])],
        ticks=3,
    )
    s.next_tick().meet("quad", "door@12")
    s.request("quad", "door@12", {"near": 1, "far": 4}, "far")
    s.synthesize("request", "near", verdict="unrealizable", objective={"visit": [12, 13]})
    s.push("quad", "door@12", "far", quad={"hold": 11}, far={"visit": [12, 16]})
    s.synthesize("request", "quad", "far").move("near").move("far", 15)
    s.next_tick().move("quad").move("near", 14).goal("near", 1, 1).move("far", 24)
    s.next_tick().move("quad").move("near", 13).goal("near", 0, 1).move("far", 23)
    return s.end("tick_limit", {"quad": 0, "near": 1, "far": 0})


def refused_again() -> list[Line]:
    """A robot has no strategy for the newer order, in no decision: so it serves the older one."""
    orders = [
        obstacle(kind, region, "lift", [region], []) | {"from": tick, "ordered": True}
        for kind, region, tick in (("box", 14, 1), ("parcel", 13, 2))
    ]
    s = Script(ROOM, {"cart": robot("ground", ["lift"], 7, {"visit": [7, 10]})}, orders, ticks=3)

    def ordered(obstacle: str) -> None:
        s.next_tick().add("appeared", obstacle=obstacle, cause="scenario")
        s.add("order", obstacle=obstacle, cause="scenario")

    def refused(bid: int) -> None:
        s.request(None, "parcel@13", {"cart": bid}, None)
        s.synthesize("request", "cart", verdict="unrealizable", objective={"visit": [13, 10]})

    ordered("box@14")
    s.request(None, "box@14", {"cart": 2}, "cart")
    s.push(None, "box@14", "cart", cart={"visit": [14, 10]}).synthesize("request", "cart")
    s.move("cart")
    ordered("parcel@13")
    refused(1)
    s.push(None, "parcel@13", None)
    s.move("cart", 8).next_tick().move("cart", 14).resolve("cart", "box@14").pop("box@14")
    refused(1)
    s.synthesize("resolved", "cart")
    return s.end("tick_limit", {"cart": 0})


def shared_floor() -> list[Line]:
    """Two robots of one layer pass each other in a wide hall."""
    s = Script(
        ROOM,
        {
            "one": robot("ground", [], 7, {"visit": [7, 10]}),
            "two": robot("ground", [], 10, {"ltl": {"liveness": ["region = 7"]}}),
        },
        [],
        ticks=4,
        rounds=9,
    )
    s.next_tick().move("one", 8).move("two", 9)
    s.next_tick().move("one", 14).move("two", 8)
    s.next_tick().move("one", 15).move("two", 7).goal("two", 0, 1)
    s.next_tick().move("one", 9).move("two")
    return s.end("tick_limit", {"one": 0, "two": 1})


def slow_steps() -> list[Line]:
    """Steps that take several ticks, past a robot of another layer that keeps its distance."""
    s = Script(
        ROOM,
        {
            "slow": robot("ground", [], 7, {"ltl": {"liveness": ["region = 8"]}}),
            "flyer": robot("air", [], 16, {"ltl": {"liveness": ["region = 9"]}}),
        },
        [],
        ticks=4,
        rounds=9,
    )
    header = s.lines[0]["scenario"]["robots"]
    header["slow"]["conflicts"], header["flyer"]["conflicts"] = ["flyer"], ["slow"]
    s.next_tick().set_out("slow", 8).move("flyer", 10)
    s.next_tick().set_out("slow", 8).move("flyer", 9)
    s.next_tick().move("slow", 8).move("flyer")
    s.next_tick().set_out("slow", 14).move("flyer")
    return s.end("tick_limit", {"slow": 0, "flyer": 0})


def beliefs() -> list[Line]:
    """One robot sees another one, loses sight of it, and sees it again."""
    s = Script(
        ROOM,
        {
            "watcher": {
                **robot("ground", [], 7, {"ltl": {"liveness": ["region = 8"]}}),
                "vision": 2,
            },
            "flyer": robot("air", [], 9, {"ltl": {"liveness": ["region = 9"]}}),
        },
        [],
        ticks=4,
        rounds=9,
    )
    s.next_tick().move("watcher").believe("watcher", "flyer", True, 9).move("flyer", 10)
    s.lines[0]["scenario"]["partition"] = [[7, 8, 13, 14], [9], [10, 15, 16]]
    s.next_tick().move("watcher").believe("watcher", "flyer", False, 10, 15, 16)
    s.move("flyer", 16)
    s.next_tick().move("watcher", 8).move("flyer", 15)
    s.next_tick().move("watcher").believe("watcher", "flyer", True, 15).move("flyer")
    return s.end("tick_limit", {"watcher": 0, "flyer": 0})


def unrealizable() -> list[Line]:
    """One robot is unrealizable: the run does not begin."""
    s = Script(CORRIDOR, {"rover": robot("ground", [], 8, {"visit": [8, 12]})}, [])
    s.lines.pop()
    s.synthesize("initial", "rover", verdict="unrealizable")
    return s.end("unrealizable", {"rover": 0})


def cycle() -> list[Line]:
    """Two robots need each other's help to reach each other: an operator is needed."""
    s = Script(
        CORRIDOR,
        {
            "digit": robot("ground", ["push"], 8, {"visit": [8, 12]}),
            "quad": robot("air", ["sense"], 12, {"visit": [12, 8]}),
        },
        [
            obstacle("uncertainty", 9, "sense", [10], ["digit"], traversable=True),
            obstacle("door", 11, "push", [10], ["quad"]),
        ],
    )
    s.next_tick().meet("digit", "uncertainty@9")
    s.request("digit", "uncertainty@9", {"quad": 2}, "quad")
    s.push("digit", "uncertainty@9", "quad", digit={"hold": 8}, quad={"visit": [10, 12]})
    s.synthesize("request", "digit", "quad").meet("quad", "door@11")
    proof = closure(["uncertainty@9", "door@11"], digit=([8], False), quad=([12], False))
    s.block("uncertainty@9", "unresolvable", proof, "digit")
    s.request("quad", "door@11", {"digit": None}, None)
    s.block("door@11", "unresolvable", proof, "quad")
    why = {"cause": "cyclic_requests", "proof": proof}
    return s.end("operator_needed", {"digit": 0, "quad": 0}, **why)


GOOD: dict[str, Callable[[], list[Line]]] = GOOD_PLANS | {
    builder.__name__: builder
    for builder in (
        *(door, pressed, untraversable, nested, unrequested, detour, avoiding, operator),
        *(second_bidder, refused_again, shared_floor, slow_steps, beliefs, unrealizable, cycle),
    )
}
