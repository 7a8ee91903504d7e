"""Traces of runs in time, written by hand."""

from collections.abc import Callable
from typing import Any, Self

from judge.good_plans import given_up
from judge.living import living
from judge.trace_script import (
    ROOM,
    Line,
    Script,
    closure,
    obstacle,
    robot,
)


class Live(Script):
    """Each line has the time ``now``; commands are counted."""

    def __init__(self, robots: dict[str, Line], obstacles: list[Line], world: str) -> None:
        self.now, self.commands = 0.0, 0
        self.open: dict[str, Line] = {}
        super().__init__(ROOM, robots, obstacles)
        self.lines[0]["clock"] = "live"
        self.lines[0]["scenario"]["world"] = world

    def add(self, kind: str, **fields: Any) -> Self:
        return super().add(kind, t=self.now, **fields)

    def at(self, now: float) -> Self:
        """The next pass."""
        self.now = now
        self.next_tick()
        return self

    def command(self, kind: str, name: str, **fields: Any) -> Self:
        self.commands += 1
        self.open[name] = {"command": self.commands, **fields}
        return self.add(kind, robot=name, command=self.commands, **fields)

    def depart(self, name: str, to: int, **more: Any) -> Self:
        way = {"from": self.position[name], "to": to, "heading": None, "by": "strategy"}
        return self.command("depart", name, **way, **more)

    def arrive(self, name: str, result: str = "arrived", **more: Any) -> Self:
        step = self.open.pop(name)
        at = more.pop("at", step["to"] if result == "arrived" else step["from"])
        self.position[name] = at
        end = {"at": at, "heading": None, "result": result, **more}
        return self.add("arrive", robot=name, command=step["command"], **end)

    def act(self, *names: str, on: str) -> Self:
        return self.command("act", names[0], robots=list(names), obstacles=[on])

    def acted(self, name: str, **results: str) -> Self:
        results = {what.replace("_", "@"): result for what, result in results.items()}
        number = self.open.pop(name)["command"]
        return self.add("acted", robot=name, command=number, results=results)

    def hold(self, name: str, why: str) -> Self:
        return self.add("hold", robot=name, why=why)


def delayed() -> list[Line]:
    """Two robots at their own speeds; a step fails and is made again, another ends elsewhere."""
    a = robot("ground", [], 7, {"visit": [10]})
    s = Live({"a": a, "b": robot("ground", [], 16, {"visit": [15, 16]})}, [], "external")
    s.at(0).depart("a", 8).depart("b", 15)
    s.at(1).arrive("b").goal("b", 0, 0).at(1).depart("b", 16)
    s.at(2.5).arrive("a").at(2.5).depart("a", 9)
    s.at(3).arrive("b").goal("b", 1, 1).at(3).hold("b", "strategy")
    s.at(3.5).arrive("a", "failed", reason="the wheels slip").at(3.5).depart("a", 9)
    s.at(4).arrive("a", "elsewhere", at=14).at(4).depart("a", 8)
    s.at(5).arrive("a").at(5).depart("a", 9)
    s.at(6).arrive("a").at(6).depart("a", 10)
    s.at(7).arrive("a").goal("a", 0, 1)
    return s.end("completed", {"a": 1, "b": 1})


def opened() -> list[Line]:
    """A robot finds a door that no sensor has shown; another opens it at the second try."""
    quad = robot("air", ["sense"], 8, {"visit": [10]})
    digit = robot("ground", ["push"], 15, {"visit": [15]})
    door = obstacle("door", 9, "push", [9], ["digit", "quad"])
    s = Live({"quad": quad, "digit": digit}, [door], "external")
    s.at(0).depart("quad", 9).hold("digit", "strategy").goal("digit", 0, 1)
    s.at(0.6).arrive("quad", "blocked")
    why = {"proposed": 9, "obstacle": "door@9", "action": "push"}
    s.add("violation", robot="quad", at=8, **why).add("backtrack", robot="quad", to=8)
    s.request("quad", "door@9", {"digit": 1}, "digit")
    s.push("quad", "door@9", "digit", quad={"hold": 8}, digit={"visit": [9, 15]})
    s.synthesize("request", "quad", "digit")
    s.at(0.6).depart("digit", 9)
    s.at(2).arrive("digit").at(2).act("digit", on="door@9").hold("digit", "acting")
    s.at(3).hold("quad", "strategy").acted("digit", door_9="failed")
    s.at(3).act("digit", on="door@9").at(4).acted("digit", door_9="done")
    s.resolve("digit", "door@9").pop().synthesize("resolved", "quad", "digit")
    s.at(4).depart("digit", 15)
    late = {"event": "Sensed", "reason": "the door was opened since", "at": 3.0}
    s.at(5).add("late", obstacle="door@9", **late).arrive("digit").goal("digit", 0, 1)
    s.at(5).depart("quad", 9).at(6).arrive("quad").at(6).depart("quad", 10)
    s.at(7).arrive("quad").goal("quad", 0, 1)
    return s.end("completed", {"quad": 1, "digit": 1})


def lost() -> list[Line]:
    """A robot is lost between two regions, until an operator puts it back."""
    a = robot("ground", [], 7, {"visit": [8]})
    s = Live({"a": a, "b": robot("ground", [], 10, {"visit": [9]})}, [], "external")
    s.at(0).depart("a", 8).hold("b", "strategy")
    s.at(4).add("service", robot="a", active=False, cause="world")
    s.arrive("a", "lost", at=7, regions=[7, 8]).hold("a", "service").depart("b", 9)
    s.at(5).arrive("b").goal("b", 0, 1)
    s.at(5).add("waiting", outcome="search_limit", explanation="a is out of service")
    s.hold("b", "operator")
    s.at(9).add("operator", intervention="put_back", robot="a", region=7, heading=None)
    s.add("service", robot="a", active=True, cause="user").at(9).depart("a", 8)
    s.position["a"] = 7
    s.at(10).arrive("a").goal("a", 0, 1)
    return s.end("completed", {"a": 1, "b": 1})


def put_on_target() -> list[Line]:
    """An operator puts a robot on its target; that counts in any turn, here in the last one."""
    a = robot("ground", [], 7, {"visit": [8]})
    s = Live({"a": a, "b": robot("ground", [], 10, {"visit": [10]})}, [], "external")
    s.at(0).hold("a", "strategy").hold("b", "strategy").goal("b", 0, 1)
    s.at(1).add("waiting", outcome="search_limit", explanation="nobody can say why")
    s.at(2).add("operator", intervention="put_back", robot="a", region=8, heading=None)
    s.position["a"] = 8
    s.synthesize("service", "b").goal("a", 0, 1)
    return s.end("completed", {"a": 1, "b": 1})


def lost_around() -> list[Line]:
    """A lost robot may be in three regions: two of them are closed to it in one turn."""
    a = robot("ground", [], 7, {"visit": [7]})
    s = Live({"a": a, "b": robot("air", [], 10, {"visit": [9]})}, [], "external")
    s.at(0).depart("a", 8).depart("b", 9)
    s.at(4).arrive("a", "lost", at=7, regions=[7, 8, 13])
    names = [f"lost_a@{region}" for region in (8, 13)]
    for name, region in zip(names, (8, 13), strict=True):
        about = obstacle("lost_a", region, "operator", [region], ["a"])
        s.obstacles[name] = about
        s.add("discovered", obstacle=about)
        why = {"proposed": region, "obstacle": name, "action": "operator"}
        s.add("violation", robot="a", at=7, **why).add("backtrack", robot="a", to=7)
    s.add("service", robot="a", active=False, cause="world")
    anywhere = [7, 8, 9, 10, 13, 14, 15, 16]
    proof = closure(names, a=([7], True), b=(anywhere, True))
    for name in names:
        s.request("a", name, {}, None).block(name, "no_capable_robot", proof, "a")
    s.at(5).arrive("b").goal("b", 0, 1)
    return s.end("operator_needed", {"a": 0, "b": 1}, cause="out_of_service")


def waits() -> list[Line]:
    """No robot can open a gate; an operator marks it as open; the run is then given up."""
    lines = living(given_up())
    outcome = lines[-1]
    told = ("tick", "t", "outcome", "explanation", "cause", "proof")
    waiting = {"type": "waiting", **{key: outcome[key] for key in told}}
    later = {"tick": outcome["tick"] + 1, "t": 9.0}
    given = {"type": "operator", **later, "intervention": "resolved", "obstacle": "gate@10"}
    reopened = {"type": "reopened", **later, "obstacle": "gate@10"}
    for key in ("cause", "proof"):
        del outcome[key]
    outcome |= later | {"outcome": "interrupted", "ticks": later["tick"]}
    return [*lines[:-1], waiting, given, reopened, outcome]


def simulated() -> list[Line]:
    """A robot that can open the door acts on it before it departs."""
    a = robot("ground", ["push"], 7, {"visit": [9]})
    s = Live({"a": a}, [obstacle("door", 8, "push", [8], ["a"])], "simulated")
    s.at(0).depart("a", 8).at(1).arrive("a").at(1).act("a", on="door@8")
    s.at(3).acted("a", door_8="done").resolve("a", "door@8", requested=False)
    s.synthesize("resolved", "a").at(3).depart("a", 9).at(4).arrive("a").goal("a", 0, 1)
    return s.end("completed", {"a": 1})


def released() -> list[Line]:
    """A robot that has made its part of a plan continues by its strategy; others make theirs."""
    a, b = robot("ground", [], 7, {"visit": [13]}), robot("ground", [], 10, {"visit": [16]})
    s = Live({"a": a, "b": b}, [], "external")
    ways = {"a": [[7, None], [8, None]], "b": [[10, None], [9, None], [15, None], [16, None]]}
    s.at(0).add("plan", reason="starvation", robots=ways, orders=[])
    s.depart("a", 8).lines[-1]["by"] = "plan"
    s.depart("b", 9).lines[-1]["by"] = "plan"
    s.at(1).arrive("a").at(1).depart("a", 14).at(2).arrive("a").at(2).depart("a", 13)
    s.at(3).arrive("a").goal("a", 0, 1).arrive("b")
    s.at(3).hold("a", "strategy").depart("b", 15).lines[-1]["by"] = "plan"
    s.at(4).arrive("b").at(4).depart("b", 16).lines[-1]["by"] = "plan"
    s.at(5).arrive("b").goal("b", 0, 1)
    s.add("plan_end", reason="reached")
    return s.end("completed", {"a": 1, "b": 1})


def _second_step_of_a_plan() -> Live:
    """A live run up to the second step of a plan for one of two robots."""
    a, b = robot("ground", [], 7, {"visit": [9]}), robot("ground", [], 10, {"visit": [16]})
    s = Live({"a": a, "b": b}, [], "external")
    ways = {"a": [[7, None], [8, None], [9, None]], "b": [[10, None]]}
    s.at(0).add("plan", reason="starvation", robots=ways, orders=[])
    s.depart("a", 8).lines[-1]["by"] = "plan"
    s.at(1).arrive("a").at(1).depart("a", 9).lines[-1]["by"] = "plan"
    return s


def ended_early() -> list[Line]:
    """The run ends in the pass in which a robot has begun a step of a plan."""
    s = _second_step_of_a_plan()
    s.add("plan_end", reason="changed")
    return s.end("interrupted", {"a": 0, "b": 0})


def fails_at_once() -> list[Line]:
    """A step of a plan fails as it is commanded, and with it the plan."""
    s = _second_step_of_a_plan()
    s.arrive("a", "failed", at=8, reason="no route").add("plan_end", reason="changed")
    return s.end("interrupted", {"a": 0, "b": 0})


def lost_at_once() -> list[Line]:
    """A robot is lost as a step of a plan is commanded; only the lines after the plan tell."""
    s = _second_step_of_a_plan()
    s.arrive("a", "lost", at=8, regions=[8]).add("plan_end", reason="violation")
    s.add("service", robot="a", active=False, cause="world")
    return s.end("interrupted", {"a": 0, "b": 0})


def entered() -> list[Line]:
    """A robot departs into a region in the moment in which an action resolves what is there; its
    turn comes before that of the robot that acts."""
    a, b = robot("ground", [], 7, {"visit": [8]}), robot("ground", ["push"], 9, {"visit": [9]})
    s = Live({"a": a, "b": b}, [obstacle("door", 8, "push", [9], ["a", "b"])], "simulated")
    s.at(0).command("act", "b", robots=["b"], obstacles=[]).hold("b", "acting")
    s.at(2).depart("a", 8).acted("b", door_8="done").resolve("b", "door@8", requested=False)
    s.synthesize("resolved", "a", "b").hold("b", "strategy").goal("b", 0, 1)
    s.at(3).arrive("a").goal("a", 0, 1)
    return s.end("completed", {"a": 1, "b": 1})


def _meets(s: Live, name: str, at: int) -> None:
    """A robot finds the door."""
    why = {"proposed": 9, "obstacle": "door@9", "action": "push"}
    s.add("violation", robot=name, at=at, **why).add("backtrack", robot=name, to=at)


def _before_a_door() -> Live:
    """Two robots before a door that a third one opens."""
    robots = {
        "cart": robot("ground", [], 15, {"visit": [10]}),
        "digit": robot("ground", ["push"], 13, {"visit": [13]}),
        "quad": robot("air", [], 8, {"visit": [10]}),
    }
    door = obstacle("door", 9, "push", [9], ["cart", "digit", "quad"])
    s = Live(robots, [door], "external")
    s.at(0).hold("digit", "strategy").goal("digit", 0, 1)
    return s.depart("quad", 9)


def met_meanwhile() -> list[Line]:
    """A second robot meets an obstacle in the pass in which the request of the first follows."""
    s = _before_a_door().at(1).arrive("quad", "blocked")
    _meets(s, "quad", 8)
    s.at(2).hold("quad", "synthesis").at(3).request("quad", "door@9", {"digit": 3}, "digit")
    s.push("quad", "door@9", "digit", digit={"visit": [9, 13]}, quad={"hold": 8})
    s.synthesize("request", "digit", "quad")
    _meets(s, "cart", 15)
    s.hold("cart", "held").depart("digit", 7).hold("quad", "strategy")
    s.at(4).hold("cart", "synthesis").at(5).arrive("digit")
    return s.end("interrupted", {"cart": 0, "digit": 0, "quad": 0})


def met_while_waiting() -> list[Line]:
    """A robot meets an obstacle while the team waits; the request follows what an operator does."""
    s = _before_a_door().depart("cart", 14).at(1)
    s.add("waiting", outcome="search_limit", explanation="nobody can say why")
    s.hold("digit", "operator").at(2).arrive("quad", "blocked")
    _meets(s, "quad", 8)
    s.hold("quad", "operator").at(3).at(4).arrive("cart").at(5).hold("cart", "operator")
    return s.end("interrupted", {"cart": 0, "digit": 1, "quad": 0})


def reopened_meanwhile() -> list[Line]:
    """A request is given up and reopened in one turn, by what an operator does; its decision is
    owed when the run is interrupted."""
    *lines, outcome = living(given_up())
    here = {"tick": outcome["tick"], "t": outcome["t"]}
    served = {"type": "operator", **here, "intervention": "added", "robot": "digit"}
    reopened = {"type": "reopened", **here, "obstacle": "gate@10"}
    later = {"tick": here["tick"] + 1, "t": 9.0}
    holds = {"type": "hold", **later, "robot": "drone", "why": "synthesis"}
    for key in ("cause", "proof"):
        del outcome[key]
    outcome |= {"tick": later["tick"] + 1, "t": 10.0, "outcome": "interrupted"}
    outcome["ticks"] = outcome["tick"]
    return [*lines, served, reopened, holds, outcome]


def _helps_a_ghost(*others: Line, rounds: int = 1) -> Live:
    """A duty for an absent obstacle reads as its own objective; the robot has done some rounds."""
    quad = robot("air", ["sense"], 8, {"visit": [10]})
    digit = robot("ground", ["push"], 15, {"visit": [9, 15]})
    s = Live({"quad": quad, "digit": digit}, [*others], "external")
    s.at(0).depart("digit", 9).hold("quad", "strategy")
    for done in range(rounds):
        t = 0.6 * done
        if done:
            s.at(t).depart("digit", 9)
        s.at(t + 0.3).arrive("digit").goal("digit", 0, done).at(t + 0.3).depart("digit", 15)
        s.at(t + 0.6).arrive("digit").goal("digit", 1, done + 1)
    s.at(2).depart("quad", 9)
    s.at(2.6).arrive("quad", "blocked")
    door = obstacle("door", 9, "push", [9], ["digit", "quad"])
    s.obstacles["door@9"] = door
    s.add("discovered", obstacle=door)
    _meets(s, "quad", 8)
    s.request("quad", "door@9", {"digit": 1}, "digit")
    s.push("quad", "door@9", "digit", quad={"hold": 8}, digit={"visit": [9, 15]})
    return s.synthesize("request", "quad", "digit")


def meets_a_ghost() -> list[Line]:
    """A robot's duty reads as its own objective, and its rounds restart; with the pop of an
    obstacle that was never there, the rounds before continue."""
    s = _helps_a_ghost()
    s.at(2.6).depart("digit", 9).hold("quad", "strategy")
    s.at(4).arrive("digit").goal("digit", 0, 0).add("gone", obstacle="door@9", cause="world")
    s.pop().synthesize("gone", "quad", "digit")
    s.at(4).depart("digit", 15).depart("quad", 9)
    s.at(5).arrive("digit").goal("digit", 1, 2).arrive("quad")
    s.at(5).depart("quad", 10).at(6).arrive("quad").goal("quad", 0, 1)
    return s.end("completed", {"quad": 1, "digit": 2})


def gone_in_transit() -> list[Line]:
    """An obstacle is gone while its helper is in transit: the pop awaits a strategy for it, which
    shows only when it has arrived."""
    s = _helps_a_ghost().at(2.6).depart("digit", 9).hold("quad", "strategy")
    s.at(3).add("gone", obstacle="door@9", cause="world").at(4).at(5).arrive("digit")
    s.goal("digit", 0, 0).at(5).hold("digit", "synthesis").at(6).pop()
    s.synthesize("gone", "quad", "digit").at(6).depart("digit", 15).depart("quad", 9)
    s.at(7).arrive("digit").goal("digit", 1, 2)
    return s.end("interrupted", {"quad": 0, "digit": 2})


def resolved_before_pop() -> list[Line]:
    """Rounds restart with a resolution between the push and the pop of another obstacle."""
    s = _helps_a_ghost(obstacle("crate", 14, "push", [15], ["digit"]), rounds=3)
    s.at(2.6).act("digit", on="crate@14").hold("digit", "acting").hold("quad", "strategy")
    s.at(3).acted("digit", crate_14="done").resolve("digit", "crate@14", requested=False)
    s.at(3).depart("digit", 9).at(4).arrive("digit").goal("digit", 0, 0)
    s.at(4).depart("digit", 15).at(5).arrive("digit").goal("digit", 1, 1)
    s.at(5).depart("digit", 9).at(6).arrive("digit").goal("digit", 0, 1)
    s.add("gone", obstacle="door@9", cause="world").pop().synthesize("gone", "quad", "digit")
    s.at(6).depart("digit", 15).at(7).arrive("digit").goal("digit", 1, 2)
    return s.end("interrupted", {"quad": 0, "digit": 2})


GOOD_LIVE: dict[str, Callable[[], list[Line]]] = {
    builder.__name__: builder
    for builder in (
        *(delayed, opened, lost, put_on_target, lost_around, waits, simulated, released),
        *(ended_early, fails_at_once, lost_at_once, entered, meets_a_ghost, gone_in_transit),
        *(resolved_before_pop, met_meanwhile, met_while_waiting, reopened_meanwhile),
    )
}
