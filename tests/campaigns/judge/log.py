"""Judges a live run only by the log of its world, in seconds: positions, obstacles and charges.

A robot occupies the region that it leaves and the one that it enters from the command to its end; a
lost robot occupies both until an operator puts it back. Where the mission can be read, the outcome
is compared with that, and with an exhaustive search from the end of the log.
"""

import re
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

from campaigns.judge import joint
from campaigns.judge.mission import (
    FIRST,
    NO_HEADING,
    Answer,
    Mission,
    Reader,
    Situation,
    Stage,
    read_mission,
)
from campaigns.judge.replay import rounds_done

Data = Mapping[str, Any]
Line = Mapping[str, Any]
NEVER = re.compile(r"region = (\d+) -> region' != (\d+)")
RETRIES, ACTIONS = 3, 2
"""Failures after which a region, or a robot's action on an obstacle, may be given up."""


class Walk:
    """A log, followed to its end. ``defects``: violated requirements; ``told``: robots whose
    objective a user changes, so that its rules are not those of the data; ``back``: robots that a
    user puts back in service."""

    def __init__(
        self,
        data: Data,
        log: Sequence[Line],
        told: Collection[str] = (),
        back: Collection[str] = (),
    ) -> None:
        reader = Reader(data)
        self.data, self.defects, self.back = data, list[str](), {*back}
        self.cols, self.layers, self.rivals = reader.cols, reader.layers, reader.conflicts
        poses = {name: reader.start(name) for name in reader.robots}
        start = {name: region for name, (region, _) in poses.items()}
        self.heading = {name: heading for name, (_, heading) in poses.items()}
        self.at = {name: {region} for name, region in start.items()}
        self.visits = {name: [region] for name, region in start.items()}
        self.way: dict[str, tuple[int, int]] = {}
        self.stages: dict[str, Stage] = {}
        self.walls: set[str] = set()
        self.known: set[str] = set()
        self.believed: set[str] = set()
        """Obstacles of which a sensor has told although they are not there."""
        self.failures: dict[str, list[int]] = {name: [] for name in start}
        self.actions: Counter[tuple[str, str]] = Counter()
        """Failed actions of a robot on an obstacle."""
        self.out: set[str] = set()
        self.silent: set[str] = set()
        """Robots that were asked to give up a step, and not sent anywhere since: their reports came
        so late that the run may take them for lost."""
        self.heard: set[tuple[str, int | None]] = set()
        self.settled: set[tuple[str, int | None]] = set()
        """Commands that ended before their robot was put down: told again they mean nothing."""
        self.acting: set[str] = set()
        self.hidden: tuple[Any, ...] = ()
        self.free_of_rules, self.slid = {*told}, set[str]()
        for line in log:
            self._follow(line, line.get("robot", ""))
        self.defects += Charges(data, start, log).defects

    def _found(self, line: Line, said: str) -> None:
        self.defects.append(f"{line['t']:.2f} s: {said}")

    def _follow(self, line: Line, name: str) -> None:
        match line["log"]:
            case "start":
                self._start(line, name)
            case "end":
                self._end(line, name)
            case "act":
                if line["busy"] or name in self.out:
                    self._found(line, f"{name} is to act, and cannot: {dict(line)}")
                self.acting.add(name)
            case "acted":
                self.acting.discard(name)
                self._acted(line, name)
            case "there":
                self.stages[line["obstacle"]] = FIRST
            case "resolved" | "gone":
                self._gone(line, line["obstacle"])
            case "cancel":
                self.silent.add(name)
            case "shown":
                self.known.add(line["obstacle"])
                if not line["there"]:
                    self.believed.add(line["obstacle"])
            case "hidden":
                self.hidden = line["t"], name, line["obstacle"]
            case "told":
                self._told(line, name)
            case "put":
                self.at[name] = {line["at"]}
                self.out.discard(name)
                self.settled |= {told for told in self.heard if told[0] == name}
                self.failures[name].clear()
                self._forgive(lambda robot, _: robot == name)
                self._apart(line, name)

    def _start(self, line: Line, name: str) -> None:
        to, origin = line["to"], line["origin"]
        self.silent.discard(name)
        if line["busy"] or name in self.acting:
            self._found(line, f"{name} has a command already")
        if name in self.out:
            self._found(line, f"{name}, which is lost or broken, is sent to {to}")
        if not self.at[name] <= {origin} or abs(to - origin) not in (0, 1, self.cols):
            have = sorted(self.at[name])
            self._found(line, f"{name} sets out from {origin} to {to}, and has {have}")
        # It may have decided to stay first, which counts again, and takes no time here. That it has
        # decided so is in the trace, which is checked.
        self.visits[name].append(origin)
        self.at[name], self.way[name] = {origin, to}, (origin, to)
        self._apart(line, name)
        self._rules(line, name)
        stops = line["stops"]
        if stops is None:
            return
        told = stops in self.known or stops in self.walls
        if told or self.hidden != (line["t"], name, stops):
            how = "known" if told else "before its sensor"
            self._found(line, f"{name} is sent into {stops}, which is {how}")

    def _apart(self, line: Line, name: str) -> None:
        for other in self.rivals[name]:
            if shared := self.at[name] & self.at[other]:
                self._found(line, f"{name} and {other} have {sorted(shared)} at the same time")

    def _rules(self, line: Line, name: str) -> None:
        """The rules beside an objective, and the zones in which robots never are together."""
        to, origin = line["to"], line["origin"]
        objective = self.data["robots"][name]["objective"]
        if name not in self.free_of_rules | self.slid:
            if to in objective.get("avoid", ()):
                self._found(line, f"{name} sets out for {to}, which it avoids")
            never = NEVER.match(objective.get("always", ""))
            if never and (origin, to) == (int(never[1]), int(never[2])):
                self._found(line, f"{name} goes from {origin} to {to}, which its rule forbids")
        for zone in self.data.get("never_together", ()):
            inside = {*zone["in"]}
            if name not in zone["robots"] or to not in inside or origin in inside:
                continue
            for other in {*zone["robots"]} - {name} - self.slid:
                if self.at[other] & inside:
                    self._found(line, f"{name} enters the zone where {other} is")

    def _end(self, line: Line, name: str) -> None:
        before, bound = self.way.pop(name, (line["at"], line["at"]))
        self.at[name] = {*(line["within"] or [line["at"]])}
        if line["how"] == "elsewhere" and line["at"] != bound:
            self.slid.add(name)
            self._apart(line, name)
        if line["at"] != before and not line["within"]:
            self.visits[name].append(line["at"])
            if self.heading[name] != NO_HEADING:
                self.heading[name] = self._way(before, line["at"])
        if line["how"] == "failed":
            self.failures[name].append(bound)
        elif line["how"] == "arrived":
            self.failures[name].clear()

    def _acted(self, line: Line, name: str) -> None:
        self.believed -= {n for n, result in line["found"].items() if result == "nothing"}
        failed = {n for n, result in line["found"].items() if result == "failed"}
        self.actions.update((name, n) for n in failed)
        self.known |= failed
        self.stages |= {n: (need, frozenset(done)) for n, (need, done) in line["stages"].items()}

    def _gone(self, line: Line, obstacle: str) -> None:
        if not line.get("open", True):
            self.walls.add(obstacle)
        else:
            self.known.discard(obstacle)
        self.stages.pop(obstacle, None)
        self._forgive(lambda _, other: other == obstacle)
        if line["log"] == "resolved":  # rounds count from the last resolution
            self.visits = {other: seen[-1:] for other, seen in self.visits.items()}

    def _told(self, line: Line, name: str) -> None:
        if line["event"] == "blocked":
            self.known.add(line["obstacle"])
        command = name, line["command"]
        self.heard.add(command)
        lost = line["event"] == "lost" and len(self.at[name]) > 1  # until it is put down
        if command not in self.settled and (lost or (line["fatal"] and name not in self.back)):
            self.out.add(name)

    def _forgive(self, which: Callable[[str, str], bool]) -> None:
        self.actions = Counter({k: n for k, n in self.actions.items() if not which(*k)})

    def _way(self, before: int, to: int) -> int:
        return (-self.cols, 1, self.cols, -1).index(to - before)

    # -- the end -----------------------------------------------------------------------------

    def pose(self, name: str) -> tuple[int, int]:
        """Where a robot is; where it goes, if it is under way: it ends its step."""
        if name not in self.way:
            return min(self.at[name]), self.heading[name]
        turns = self.heading[name] != NO_HEADING
        return self.way[name][1], self._way(*self.way[name]) if turns else NO_HEADING

    def unreliable(self) -> set[str]:
        """Robots that the run may have put out of service."""
        many = {n for n, failed in self.failures.items() if len(failed) >= 2 * RETRIES}
        return self.out | self.silent | many

    def unknowns(self) -> set[tuple[int, str]]:
        """Regions that a robot has failed to enter so often that an obstacle may be there, with the
        robot's layer."""
        found = set()
        for name, failed in self.failures.items():
            found |= {(r, self.layers[name]) for r in failed if failed.count(r) >= RETRIES}
        return found


def verdict(data: Data, mission: Mission, walk: Walk, outcome: str, budget: int = 20_000) -> str:
    """Return the finding on a run with this outcome; empty if there is none, ``?`` if the search
    was too large."""
    if walk.defects:
        return "; ".join(walk.defects[:3])
    match outcome:
        case "completed":
            return "; ".join(_not_done(mission, walk))
        case "operator_needed" if not walk.unreliable():
            return _false_statement(data, {*mission.obstacles}, walk, budget)
    return ""


def _not_done(mission: Mission, walk: Walk) -> list[str]:
    found = []
    for robot in mission.robots:
        visits = walk.visits[robot.name]
        single = len(robot.targets) == 1 and robot.targets[0] & {*visits}
        if robot.formulas or single or (robot.stays and visits[-1] in robot.targets[-1]):
            continue  # staying at a single or last target is enough
        done = rounds_done(robot, visits)
        if done < mission.rounds:
            found.append(f"{robot.name} has done {done} rounds of {mission.rounds}")
    return found


def _false_statement(data: Data, listed: set[str], walk: Walk, budget: int) -> str:
    """A run that needs an operator is right if those in service cannot complete the mission, with
    all that sensors have shown and that failures make likely in their way."""
    kinds = dict((data.get("catalogue") or {}).get("obstacles", {}))
    entries = list(data.get("obstacles") or ())
    shown = dict.fromkeys(walk.believed - listed, FIRST)
    entries += [{"type": n.split("@")[0], "region": int(n.split("@")[1])} for n in shown]
    for region, layer in walk.unknowns():
        kinds[f"unknown_{layer}"] = {"action": "operator", "blocks": [layer]}
        entries.append({"type": f"unknown_{layer}", "region": region})
        shown[f"unknown_{layer}@{region}"] = FIRST
    catalogue = {**(data.get("catalogue") or {}), "obstacles": kinds}
    mission = read_mission({**data, "obstacles": entries, "catalogue": catalogue})
    mission = _without(mission, {pair for pair, n in walk.actions.items() if n >= ACTIONS})
    there = walk.known & mission.obstacles.keys() - walk.walls
    known = {name: walk.stages.get(name, FIRST) for name in there} | shown
    poses = {name: walk.pose(name) for name in walk.at}
    begin = Situation(poses, dict.fromkeys(walk.at, (0, 0)), known, frozenset(walk.walls))
    answer = joint.can_complete(mission, begin, budget)
    if answer is Answer.YES:
        return "it says that an operator is needed, but the mission can be completed"
    return "?" if answer is Answer.OVER_BUDGET else ""


def _without(mission: Mission, barred: Collection[tuple[str, str]]) -> Mission:
    """The mission in which these robots lack the actions of these obstacles."""
    obstacles, able = dict(mission.obstacles), {r.name: r.capabilities for r in mission.robots}
    for name in {obstacle for _, obstacle in barred} & obstacles.keys():
        it = obstacles[name]
        own = {need.action: f"{need.action} {name}" for need in it.needs}
        needs = tuple(replace(need, action=own[need.action]) for need in it.needs)
        obstacles[name] = replace(it, needs=needs)
        for robot in mission.robots:
            if (robot.name, name) not in barred:
                able[robot.name] |= {own[a] for a in own.keys() & robot.capabilities}
    robots = tuple(replace(robot, capabilities=able[robot.name]) for robot in mission.robots)
    return replace(mission, obstacles=obstacles, robots=robots)


# The charges of robots along the log of a world.


Line = Mapping[str, Any]
CLOSE = 1e-5
"""Of a charge: seconds of a log are not rounded."""


class Charges:
    """The charges of robots along a log without new batteries: a step takes ``move`` when it
    ends, a second without one ``stay``, or gives ``charge`` on a charger. A robot stands from the
    moment on at which the team is told of the end of its step. ``starts``: regions; ``defects``:
    steps without charge."""

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
        for line in log:
            if line.get("robot") in self.batteries:
                self._follow(line, line["robot"])

    def _pass(self, name: str, t: float) -> None:
        """Let a robot that stands have stood until then."""
        battery, since = self.batteries[name], self.since[name]
        if since is None:
            return
        on = self.at[name] in self.chargers
        rate = battery["charge"] if on else -battery.get("stay", 0)
        charge = self.charge[name] + rate * (t - since)
        self.charge[name] = min(battery["capacity"], max(0.0, charge))
        self.since[name] = t

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
