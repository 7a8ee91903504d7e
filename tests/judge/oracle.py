"""What a judged trace must not hide, read from its moves alone and in the plainest way.

It follows positions, obstacles, charges and targets of runs in ticks, and knows nothing of goal
lines, requests or strategies. It shares no code with the judge.
"""

import re
from collections.abc import Iterator
from typing import Any

from support.damage import Line

BESIDE = ((-1, 0), (1, 0), (0, 1), (0, -1))


class Facts:
    """``harms`` collects what is unsafe or untrue."""

    def __init__(self, lines: list[Line]) -> None:
        self.scenario = scenario = lines[0]["scenario"]
        self.lines, world = lines[1:], scenario["map"]
        self.cols = world["cols"]
        self.free = {*range(world["rows"] * self.cols)} - {*world["walls"]}
        self.robots = {each["name"]: each["model"] | each for each in scenario["robots"]}
        self.here = {n: r["start"]["region"] for n, r in self.robots.items()}
        self.at = {n: {region} for n, region in self.here.items()}
        self.came: dict[str, int | None] = dict.fromkeys(self.robots)
        self.own = {n: r["objective"] for n, r in self.robots.items()}
        self.seen: dict[str, list[int]] = {n: [region] for n, region in self.here.items()}
        self.held = dict.fromkeys(self.robots, 1)
        self.tick = dict.fromkeys(self.robots, 0)
        self.began: dict[str, int] = {}
        self.out: set[str] = set()
        self.charge = {n: r["battery"]["start"] for n, r in self.robots.items() if r.get("battery")}
        every = scenario["obstacles"] + [x["obstacle"] for x in lines if x["type"] == "discovered"]
        self.all = {one["name"]: one for one in map(self.obstacle, every)}
        self.open = {n: 0 for n, one in self.all.items() if one.get("appears") is None}
        """Obstacles that are present, with the number of their needs that are met."""
        self.shut: set[str] = set()

    def obstacle(self, one: Line) -> Line:
        """An obstacle with its name, the robots that it stops, and the regions of its needs."""
        kind, region = one["type"], one["region"]
        beside = {region + d for d in (-self.cols, -1, 1, self.cols)} & self.free
        at = {"self": [region], "neighbours": beside}
        needs = [
            need | {"regions": need["at"] if isinstance(need["at"], list) else at[need["at"]]}
            for need in kind["needs"]
        ]
        listed = kind.get("blocks")
        blocks = [n for n, r in self.robots.items() if listed is None or {*listed} & {
            n, r["layer"], r["model"]["name"]}]  # fmt: skip
        number = f"#{one['number']}" if one["number"] > 1 else ""
        name = f"{kind['name']}@{region}{number}"
        return one | {"name": name, "kind": kind["name"], "needs": needs, "blocks": blocks}

    def harms(self) -> Iterator[str]:
        for line in self.lines:
            match line["type"]:
                case "move":
                    yield from self.moved(line)
                case "resolved":
                    yield from self.resolved(line)
                    flat = (self.scenario.get("flat") or {}).get("name")
                    restarts = self.all[line["obstacle"]]["kind"] != flat
                    for name in self.seen if restarts else ():
                        kept = self.own[name] if "once" in self.own[name] else None
                        self.seen[name] = self.seen[name] if kept else [self.here[name]]
                        self.held[name] = 1
                case "part":
                    done = self.open.get(line["obstacle"], 0) + (not line.get("missing"))
                    self.open[line["obstacle"]] = done
                case "appeared":
                    yield from self.appeared(line)
                case "gone":
                    self.open.pop(line["obstacle"], None)
                    self.shut.discard(line["obstacle"])
                    until = [x.get("goes") for x in self.scenario["obstacles"]]
                    due = any(u and u <= line["tick"] for u in until)
                    if line["cause"] == "scenario" and not due:
                        yield f"{line['obstacle']} is gone before its time"
                    if line["cause"] == "world":
                        yield "a simulated world opens a door"
                case "blocked":
                    self.shut.add(line["obstacle"])
                case "reopened":
                    self.shut.discard(line["obstacle"])
                case "objective":
                    self.own[line["robot"]] = line["objective"]
                    self.seen[line["robot"]] = [self.here[line["robot"]]]
                case "service":
                    (self.out.discard if line["active"] else self.out.add)(line["robot"])
                    if line["cause"] == "battery" and line["active"]:
                        battery = self.robots[line["robot"]]["battery"]
                        self.charge[line["robot"]] = battery["capacity"]
                case "outcome":
                    yield from self.ended(line)

    def moved(self, line: Line) -> Iterator[str]:
        name, to, toward = line["robot"], line["to"], line.get("toward")
        before, robot = self.here[name], self.robots[line["robot"]]
        holds = {to} if toward is None else {to, toward}
        if line["from"] != before:
            yield f"{name} is at {before}"
        if line["tick"] != self.tick[name] + 1:
            yield f"{name} has no move, or two, in a tick"
        end = to if toward is None else toward
        (row, col), (row2, col2) = divmod(before, self.cols), divmod(end, self.cols)
        step = row2 - row, col2 - col
        if end not in self.free:
            yield f"{name} is in a wall"
        elif end != before and step not in BESIDE:
            yield f"{name} jumps"
        if toward is not None:
            self.began.setdefault(name, line["tick"])
        elif to != before:
            took = line["tick"] - self.began.pop(name, line["tick"]) + 1
            if took < (robot.get("timing") or 1):
                yield f"{name} is too fast"
        if end != before and name in self.out and len(self.at[name]) == 1:
            yield f"{name} drives out of service"
        yield from self.entered(name, holds, before)
        yield from self.used(name, before, to, toward)
        self.here[name], self.at[name], self.tick[name] = to, holds, line["tick"]
        if to != before:
            self.came[name] = before
        self.seen[name] += [to] if toward is None and to != self.seen[name][-1] else []
        self.held[name] += 1

    def entered(self, name: str, holds: set[int], before: int) -> Iterator[str]:
        fresh = holds - self.at[name]
        for other, theirs in self.at.items():
            if other != name and holds & theirs and self.conflict(name, other):
                yield f"{name} and {other} collide"
            for zone in self.scenario.get("never_together") or ():
                regions = {*zone["regions"]}
                both = other != name and {name, other} <= {*zone["robots"]}
                if both and holds & regions and theirs & regions:
                    yield f"{name} and {other} are together"
        for one in self.all.values():
            known = one["name"] in self.open or one["name"] in self.shut
            if not known or name not in one["blocks"]:
                continue
            if one["region"] in fresh and (one["name"] in self.shut or not self.enters(name, one)):
                yield f"{name} enters {one['name']}"
            if one["region"] == before and fresh - {self.came[name]}:
                yield f"{name} passes {one['name']}"
        if fresh & {*self.own[name].get("avoid", ())}:
            yield f"{name} enters what it avoids"
        for rule in self.own[name].get("always", ()):
            found = re.fullmatch(r"region = (\d+) -> region' != (\d+)", rule)
            if found and before == int(found[1]) and fresh == {int(found[2])}:
                yield f"{name} takes a forbidden step"

    def used(self, name: str, before: int, to: int, toward: int | None) -> Iterator[str]:
        if name not in self.charge:
            return
        battery = self.robots[name]["battery"]
        if to != before:
            if self.charge[name] < battery["move"]:
                yield f"{name} drives with an empty battery"
            self.charge[name] -= battery["move"]
        elif toward is None and to in (self.scenario.get("chargers") or ()):
            self.charge[name] = min(battery["capacity"], self.charge[name] + battery["charge"])
        elif toward is None:
            self.charge[name] = max(0, self.charge[name] - battery["stay"])

    def conflict(self, one: str, other: str) -> bool:
        a, b = self.robots[one], self.robots[other]
        same = [one, other] if a["layer"] == b["layer"] else []
        mine, theirs = a.get("avoids"), b.get("avoids")
        return other in (same if mine is None else mine) or one in (
            same if theirs is None else theirs
        )

    def enters(self, name: str, one: Line) -> bool:
        needs = one["needs"]
        last = needs[-1]
        left = len(needs) - self.open.get(one["name"], 0)
        able = last["action"] in self.robots[name]["capabilities"]
        alone = (last.get("robots") or 1) == 1 and not last.get("same")
        return left <= 1 and alone and able and one["region"] in last["regions"]

    def resolved(self, line: Line) -> Iterator[str]:
        one, name = self.all[line["obstacle"]], line["robot"]
        last, met = one["needs"][-1], self.open.get(line["obstacle"], 0)
        if line["obstacle"] not in self.open:
            yield f"{one['name']} is not there"
        if last["action"] not in self.robots[name]["capabilities"]:
            yield f"{name} cannot do that"
        told_later = met == len(one["needs"])  # its last need has a line of its own
        if self.here[name] not in last["regions"] and not told_later:
            yield f"{name} is not where that is done"
        if met < len(one["needs"]) - 1:
            yield f"a need of {one['name']} is not met"
        if line["traversable"] is not one.get("traversable"):
            yield f"{one['name']} has another truth"
        self.open.pop(line["obstacle"], None)

    def appeared(self, line: Line) -> Iterator[str]:
        one = self.all[line["obstacle"]]
        if line["cause"] == "scenario" and not (one.get("appears") or 0) <= line["tick"]:
            yield f"{one['name']} appears before its time"
        if line["cause"] == "scenario" and one.get("appears") is None:
            yield f"{one['name']} appears, but the scenario does not say so"
        self.open[line["obstacle"]] = 0

    def rounds(self, name: str) -> float:
        """The most rounds that the regions visited since the last resolution allow."""
        own, seen = self.own[name], self.seen[name]
        kind, body = next((k, v) for k, v in own.items() if k not in ("avoid", "always", "form"))
        if kind == "ltl":
            return 99
        if kind == "hold":
            return self.held[name]
        targets = [{*t} if isinstance(t, list) else {t} for t in body]
        if kind == "cover":
            return min(sum(region in target for region in seen) for target in targets)
        best = 0.0
        for first in range(1 if kind == "once" else len(targets)):
            turn, done = first, 0
            for region in seen:
                while region in targets[turn % len(targets)] and done < 99 * len(targets):
                    turn, done = turn + 1, done + 1
                    if region not in targets[turn % len(targets)]:
                        break
            best = max(best, done // len(targets))
        return 99 if kind == "once" and best else best

    def ended(self, line: Line) -> Iterator[str]:
        completed = line["outcome"] == "completed"
        for change in self.scenario.get("changes") or ():
            applied = {"service": change.get("active"), "objective": change.get("objective")}
            told = [x for x in self.lines if x["type"] in applied and x["robot"] == change["robot"]]
            if change["at"] < line["tick"] and not told and completed:
                yield f"a change of {change['robot']} is missing"
        for one in map(self.obstacle, self.scenario["obstacles"]):
            told = any(x.get("obstacle") == one["name"] for x in self.lines)
            due = one.get("appears") is not None and one["appears"] < line["tick"]
            if due and not told and completed and not self.stood(one["region"]):
                yield f"{one['name']} never appears"
        if completed:
            wanted = self.scenario["until"].get("rounds") or 0
            for name in self.robots:
                if self.rounds(name) < wanted:
                    yield f"{name} has not been where its targets are {wanted} times"
                last: Any = self.own[name].get("hold") or (self.own[name].get("once") or [None])[-1]
                if last is not None and self.here[name] not in (
                    [last] if type(last) is int else last
                ):
                    yield f"{name} is not at its last target"
        by = self.scenario["until"].get("by")
        if by is not None and line["tick"] > by and "mission" not in (line.get("late") or ()):
            yield "the mission was late"
        if line["outcome"] == "operator_needed":
            yield "the mission can be completed, as the honest run shows"

    def stood(self, region: int) -> bool:
        return any(region in (line.get("to"), line.get("from")) for line in self.lines)
