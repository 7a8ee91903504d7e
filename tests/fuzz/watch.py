"""Judges a run by the log of its world (``troubles``) and the scenario's data alone, in seconds.

A robot occupies the region that it leaves and the one that it enters from the command to its end; a
lost robot occupies both until an operator puts it back. It knows the scenarios of ``mixed`` only,
and shares nothing with safenav.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

Line = Mapping[str, Any]
NEVER = re.compile(r"region = (\d+) -> region' != (\d+)")
CLOSE = 1e-5
"""Of a charge: seconds of a log are not rounded."""


class Watch:
    """A log, followed to its end. ``defects``: violated requirements; ``told``: robots whose
    objective a user changes, so that its rules are not those of the data; ``back``: robots that a
    user puts back in service."""

    def __init__(
        self,
        data: Mapping[str, Any],
        log: Sequence[Line],
        told: Collection[str] = (),
        back: Collection[str] = (),
    ) -> None:
        self.back = {*back}
        self.data, self.defects = data, list[str]()
        robots, models = data["robots"], data["catalogue"]["robots"]
        self.layers = {n: models[r["model"]]["layer"] for n, r in robots.items()}
        self.can = {n: {*models[r["model"]]["capabilities"]} for n, r in robots.items()}
        self.at = {name: {robot["start"]} for name, robot in robots.items()}
        self.visits = {name: {robot["start"]} for name, robot in robots.items()}
        self.bound: dict[str, int] = {}
        self.out: set[str] = set()
        self.heard: set[tuple[str, int | None]] = set()
        self.settled: set[tuple[str, int | None]] = set()
        """Commands that ended before their robot was put down: told again they mean nothing."""
        self.acting: dict[str, Collection[str]] = {}
        self.known: set[str] = set()
        self.hidden: tuple[Any, ...] = ()
        self.free_of_rules = {*told}
        self.slid: set[str] = set()
        for line in log:
            self._follow(line)
        starts = {name: robot["start"] for name, robot in robots.items()}
        self.defects += Charges(data, starts, log).defects

    def _found(self, line: Line, said: str) -> None:
        self.defects.append(f"{line['t']:.2f} s: {said}")

    def _rivals(self, name: str) -> set[str]:
        robots = self.data["robots"]

        def avoids(one: str, other: str) -> bool:
            listed = robots[one].get("avoids")
            return self.layers[one] == self.layers[other] if listed is None else other in listed

        return {o for o in robots if o != name and (avoids(name, o) or avoids(o, name))}

    def _follow(self, line: Line) -> None:
        name = line.get("robot", "")
        match line["log"]:
            case "start":
                self._start(line, name)
            case "end":
                bound = self.bound.pop(name, line["at"])
                self.at[name] = {*(line["within"] or [line["at"]])}
                if line["how"] == "elsewhere" and line["at"] != bound:
                    self.slid.add(name)
                    self._apart(line, name)
                if line["how"] in ("arrived", "elsewhere"):
                    self.visits[name].add(line["at"])
            case "act":
                if line["busy"] or name in self.out:
                    self._found(line, f"{name} is to act, and cannot: {dict(line)}")
                self.acting[name] = line["on"]
            case "acted":
                self.acting.pop(name, None)
            case "shown":
                self.known.add(line["obstacle"])
            case "hidden":
                self.hidden = line["t"], name, line["obstacle"]
            case "resolved" | "gone":
                if line.get("open", True):
                    self.known.discard(line["obstacle"])
            case "told":
                if line["event"] == "blocked":
                    self.known.add(line["obstacle"])
                self.heard.add((name, line.get("command")))
                lost = line["event"] == "lost" and len(self.at[name]) > 1  # until it is put down
                if (name, line.get("command")) in self.settled:
                    return
                if lost or (line["fatal"] and name not in self.back):
                    self.out.add(name)
            case "put":
                self.at[name] = {line["at"]}
                self.out.discard(name)
                self.settled |= {told for told in self.heard if told[0] == name}
                self._apart(line, name)

    def _start(self, line: Line, name: str) -> None:
        to, origin = line["to"], line["origin"]
        if line["busy"] or name in self.acting:
            self._found(line, f"{name} has a command already")
        if name in self.out:
            self._found(line, f"{name}, which is lost or broken, is sent to {to}")
        if not self.at[name] <= {origin}:
            self._found(line, f"{name} sets out from {origin}, and has {sorted(self.at[name])}")
        self.at[name], self.bound[name] = {origin, to}, to
        self._apart(line, name)
        self._zones(line, name)
        objective = self.data["robots"][name]["objective"]
        if name not in self.free_of_rules and name not in self.slid:
            if to in objective.get("avoid", ()):
                self._found(line, f"{name} sets out for {to}, which it avoids")
            never = NEVER.match(objective.get("always", ""))
            if never and (origin, to) == (int(never[1]), int(never[2])):
                self._found(line, f"{name} goes from {origin} to {to}, which its rule forbids")
        stops = line["stops"]
        if stops is not None and (stops in self.known or self.hidden != (line["t"], name, stops)):
            how = "known" if stops in self.known else "before its sensor"
            self._found(line, f"{name} is sent into {stops}, which is {how}")

    def _apart(self, line: Line, name: str) -> None:
        for other in self._rivals(name):
            if shared := self.at[name] & self.at[other]:
                self._found(line, f"{name} and {other} have {sorted(shared)} at the same time")

    def _zones(self, line: Line, name: str) -> None:
        for zone in self.data.get("never_together", ()):
            inside = {*zone["in"]}
            if name not in zone["robots"] or line["to"] not in inside or line["origin"] in inside:
                continue
            for other in {*zone["robots"]} - {name} - self.slid:
                if self.at[other] & inside:
                    self._found(line, f"{name} enters the zone where {other} is")


class Charges:
    """The charges of robots along a log, if nobody brings batteries: a step takes ``move`` when it
    ends, a second without one ``stay``, or gives ``charge`` on a charger. A robot stands from the
    moment on at which the team is told of the end of its step. ``starts``: regions; ``defects``:
    steps without charge; ``flat``: robots that could take no step at some time."""

    def __init__(
        self, data: Mapping[str, Any], starts: Mapping[str, int], log: Sequence[Line]
    ) -> None:
        models = (data.get("catalogue") or {}).get("robots") or {}
        robots = data["robots"].items()
        self.batteries = {n: models.get(r["model"], {}).get("battery") for n, r in robots}
        self.batteries = {n: b for n, b in self.batteries.items() if b and "flat" not in data}
        self.chargers = {*data.get("chargers", ())}
        self.charge = {n: float(b.get("start", b["capacity"])) for n, b in self.batteries.items()}
        self.at = {**starts}
        self.since: dict[str, float | None] = dict.fromkeys(self.batteries, 0.0)
        self.under_way: dict[str, int] = {}
        self.defects: list[str] = []
        self.flat: set[str] = set()
        self.charged = 0
        for line in log:
            if line.get("robot") in self.batteries:
                self._follow(line, line["robot"])
        for name in self.batteries:
            self._pass(name, log[-1]["t"] if log else 0.0)

    def _pass(self, name: str, t: float) -> None:
        """Let a robot that stands have stood until then."""
        battery, since = self.batteries[name], self.since[name]
        if since is None:
            return
        there = self.at[name] in self.chargers
        rate = battery["charge"] if there else -battery.get("stay", 0)
        charge = self.charge[name] + rate * (t - since)
        self.charged += there and self.charge[name] < battery["capacity"] and t > since
        self.charge[name] = min(battery["capacity"], max(0.0, charge))
        self.since[name] = t
        if self.charge[name] < battery.get("move", 1) - CLOSE and not there:
            self.flat.add(name)

    def _follow(self, line: Line, name: str) -> None:
        move = self.batteries[name].get("move", 1)
        match line["log"]:
            case "start":
                self._pass(name, line["t"])
                self.since[name], self.under_way[name] = None, line["command"]
                if self.charge[name] < move - CLOSE:
                    told = f"{name} sets out with a charge of {self.charge[name]:g}"
                    self.defects.append(f"{line['t']:.2f} s: {told}")
            case "end":
                self.charge[name] = max(0.0, self.charge[name] - move)
                self.at[name] = line["at"]
            case "told" if line["command"] == self.under_way.get(name):
                del self.under_way[name]
                self.since[name] = line["t"]
                self._pass(name, line["t"])
            case "put":
                self._pass(name, line["t"])
                self.at[name] = line["at"]
            case _:
                pass
