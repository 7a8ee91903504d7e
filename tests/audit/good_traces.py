"""Traces written by hand, each of a run in which all went as the design says."""

from __future__ import annotations

from collections.abc import Callable

from audit.good_plans import GOOD_PLANS
from audit.trace_script import Line, Script, obstacle, robot

ROOM = """
######
#....#
#....#
######
"""
"""Free regions: 7 to 10 above 13 to 16."""

HALL = """
#########
#.......#
#.......#
#########
"""
"""Free regions: 10 to 16 above 19 to 25."""

CORRIDOR = """
#######
#.....#
#######
"""
"""Free regions: 8 to 12."""


def door() -> list[Line]:
    """The quadcopter meets a door; Digit opens it; both go on."""
    s = Script(
        ROOM,
        {
            "quad": robot("air", ["sense"], 7, {"patrol": [7, 10]}),
            "digit": robot("ground", ["push"], 13, {"visit": [13, 8]}, heading="north"),
        },
        [obstacle("door", 9, "push", [9], ["quad"])],
    )
    s.next_tick().move("quad", 8).move("digit", 7)
    s.next_tick().meet("quad", "door@9").request("quad", "door@9", {"digit": 2}, "digit")
    s.push("quad", "door@9", "digit", quad={"hold": 8}, digit={"visit": [13, 9]})
    s.synthesize("request", "quad", "digit").move("digit", 8)
    s.next_tick().move("quad").goal("quad", 0, 1).move("digit", 9)
    s.resolve("digit", "door@9").pop().synthesize("resolved", "quad", "digit")
    s.next_tick().move("quad", 9).move("digit", 15)
    s.next_tick().move("quad", 10).goal("quad", 1, 0).move("digit", 14)
    s.next_tick().move("quad", 9).move("digit", 13).goal("digit", 0, 0)
    s.next_tick().move("quad", 8).move("digit", 7)
    s.next_tick().move("quad", 7).goal("quad", 0, 1).move("digit", 8).goal("digit", 1, 1)
    return s.end("completed", {"quad": 1, "digit": 1})


def untraversable() -> list[Line]:
    """What Digit was not sure about turns out untraversable; it goes round."""
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
    s.push("digit", "uncertainty@9", "quad", digit={"hold": 14}, quad={"visit": [16, [8, 10, 15]]})
    s.synthesize("request", "digit", "quad").move("quad", 15)
    s.resolve("quad", "uncertainty@9").block("uncertainty@9", "untraversable", "digit")
    s.pop().synthesize("resolved", "digit", "quad")
    s.next_tick().move("digit", 15).move("quad", 14)
    s.next_tick().move("digit", 16).move("quad", 13).goal("quad", 1, 1)
    s.next_tick().move("digit", 10).goal("digit", 1, 1).move("quad", 14)
    return s.end("completed", {"digit": 1, "quad": 1})


def nested() -> list[Line]:
    """A helper needs help itself; meanwhile a third robot resolves what was asked for first."""
    s = Script(
        HALL,
        {
            "rover": robot("ground", ["push"], 10, {"visit": [10, 13]}),
            "drone": robot("air", ["sense"], 16, {"visit": [16, 22]}),
            "scout": robot("high", ["sense"], 25, {"visit": [25, 22]}),
        },
        [
            obstacle("uncertainty", 12, "sense", [11, 13, 21], ["rover"], traversable=True),
            obstacle("door", 14, "push", [14], ["drone", "scout"]),
        ],
    )
    s.next_tick().move("rover", 11).move("drone").move("scout")
    s.next_tick().meet("rover", "uncertainty@12")
    s.request("rover", "uncertainty@12", {"drone": 3, "scout": 4}, "drone")
    sensing = {"visit": [16, [11, 13, 21]]}
    s.push("rover", "uncertainty@12", "drone", rover={"hold": 11}, drone=sensing)
    s.synthesize("request", "rover", "drone").move("drone", 15).move("scout", 24)
    s.next_tick().move("rover").meet("drone", "door@14")
    s.request("drone", "door@14", {"rover": 5}, "rover")
    s.push("drone", "door@14", "rover", rover={"visit": [11, 14]}, drone={"hold": 15})
    s.synthesize("request", "rover", "drone").move("scout", 23)
    s.next_tick().move("rover", 20).move("drone").move("scout", 22).goal("scout", 1, 1)
    s.next_tick().move("rover", 21).move("drone").move("scout", 21).resolve(
        "scout", "uncertainty@12"
    )
    s.next_tick().move("rover", 22).move("drone").move("scout", 22)
    s.next_tick().move("rover", 23).move("drone").move("scout", 23)
    s.next_tick().move("rover", 14).resolve("rover", "door@14").pop().pop()
    s.synthesize("resolved", "rover", "drone").move("drone", 16).goal("drone", 0, 0).move(
        "scout", 24
    )
    s.next_tick().move("rover", 13).goal("rover", 1, 1).move("drone", 25)
    s.move("scout", 25).goal("scout", 0, 0)
    s.next_tick().move("rover").move("drone", 24).move("scout", 24)
    s.next_tick().move("rover").move("drone", 23).move("scout", 23)
    s.next_tick().move("rover").move("drone", 22).goal("drone", 1, 1)
    s.move("scout", 22).goal("scout", 1, 1)
    return s.end("completed", {"rover": 1, "drone": 1, "scout": 1})


def unrequested() -> list[Line]:
    """Digit opens a door on its way that nobody has asked for; no stack is touched."""
    s = Script(
        ROOM,
        {
            "digit": robot("ground", ["push"], 7, {"visit": [7, 10]}, heading="east"),
            "quad": robot("air", ["sense"], 13, {"cover": [14, 15]}),
        },
        [obstacle("door", 9, "push", [9], ["quad"])],
    )
    s.next_tick().move("digit", 8).move("quad", 14).goal("quad", 0, 0)
    s.next_tick().move("digit", 9).resolve("digit", "door@9", requested=False).move("quad", 8)
    s.next_tick().move("digit", 10).goal("digit", 1, 1).move("quad", 9)
    s.next_tick().move("digit", 16).move("quad", 15).goal("quad", 1, 1)
    s.next_tick().move("digit", 15).move("quad", 14).goal("quad", 0, 1)
    s.next_tick().move("digit", 14).move("quad", 15).goal("quad", 1, 2)
    return s.end("completed", {"digit": 1, "quad": 2})


def detour() -> list[Line]:
    """Nobody can clear the debris: it joins the obstacles, and the rover goes round."""
    s = Script(
        ROOM,
        {"rover": robot("ground", [], 7, {"visit": [10, 7]})},
        [obstacle("debris", 8, "clear", [8], ["rover"])],
    )
    s.next_tick().meet("rover", "debris@8").request("rover", "debris@8", {}, None)
    s.block("debris@8", "no_capable_robot", "rover").synthesize("blocked", "rover")
    for to in (13, 14, 15, 16, 10):
        s.next_tick().move("rover", to)
    s.goal("rover", 0, 0)
    for to in (16, 15, 14, 13, 7):
        s.next_tick().move("rover", to)
    s.goal("rover", 1, 1)
    return s.end("completed", {"rover": 1})


def operator() -> list[Line]:
    """Nobody can clear the only way, and there is no way round."""
    s = Script(
        CORRIDOR,
        {"rover": robot("ground", [], 8, {"visit": [8, 12]})},
        [obstacle("debris", 10, "clear", [10], ["rover"])],
    )
    s.next_tick().move("rover", 9)
    s.next_tick().meet("rover", "debris@10").request("rover", "debris@10", {}, None)
    s.block("debris@10", "no_capable_robot", "rover")
    s.synthesize("blocked", "rover", verdict="unrealizable")
    return s.end("operator_needed", {"rover": 0}, cause="unrealizable")


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
    s.synthesize("request", "near", verdict="unrealizable", objective={"visit": [13, 12]})
    s.request("quad", "door@12", {"near": 1, "far": 4}, "far")
    s.push("quad", "door@12", "far", quad={"hold": 11}, far={"visit": [16, 12]})
    s.synthesize("request", "quad", "far").move("near").move("far", 15)
    s.next_tick().move("quad").move("near", 14).goal("near", 1, 1).move("far", 24)
    s.next_tick().move("quad").move("near", 13).goal("near", 0, 1).move("far", 23)
    return s.end("tick_limit", {"quad": 0, "near": 1, "far": 0})


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


def giving_way() -> list[Line]:
    """Two robots meet in a corridor; one stands aside, then both go on."""
    s = Script(
        ROOM,
        {
            "one": robot("ground", [], 7, {"visit": [10, 7]}),
            "two": robot("ground", [], 9, {"visit": [7, 10]}),
        },
        [],
        ticks=5,
        rounds=9,
    )
    s.next_tick().move("one", 8).move("two")
    s.push("one", None, "two", two={"hold": 15}).synthesize("yield", "two")
    s.next_tick().move("one").move("two", 15).goal("two", 0, 1)
    s.next_tick().move("one", 9).move("two")
    s.next_tick().move("one", 10).goal("one", 0, 0).move("two")
    s.pop().synthesize("yield", "two")
    s.next_tick().move("one").move("two", 14)
    return s.end("tick_limit", {"one": 0, "two": 0})


def unrealizable() -> list[Line]:
    """One robot cannot do what it is asked to do: nothing begins."""
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
    s.push("digit", "uncertainty@9", "quad", digit={"hold": 8}, quad={"visit": [12, 10]})
    s.synthesize("request", "digit", "quad").meet("quad", "door@11")
    s.request("quad", "door@11", {"digit": 2}, None)
    return s.end("operator_needed", {"digit": 0, "quad": 0}, cause="cyclic_requests")


GOOD: dict[str, Callable[[], list[Line]]] = GOOD_PLANS | {
    builder.__name__: builder
    for builder in (
        door,
        untraversable,
        nested,
        unrequested,
        detour,
        operator,
        second_bidder,
        shared_floor,
        slow_steps,
        beliefs,
        giving_way,
        unrealizable,
        cycle,
    )
}
