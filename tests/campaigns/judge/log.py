"""Judges a live run only by the log of its world, in seconds: positions, obstacles and charges.

A robot occupies the region that it leaves and the one that it enters from the command to its end; a
lost robot occupies both until an operator puts it back. Where the mission can be read, the outcome
is compared with that, and with an exhaustive search from the end of the log.
"""

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from campaigns.judge.mission import FIRST, Data, Mission, Pose, Stage
from campaigns.judge.search import Situation, can_complete
from campaigns.judge.trace import rounds_done

Line = Mapping[str, Any]
NEVER = re.compile(r"region = (\d+) -> region' != (\d+)")
RETRIES, ACTIONS = 3, 2
"""Failures after which a region, or a robot's action on an obstacle, may be given up."""
BUDGET = 20_000
"""States of a search."""
CLOSE = 1e-5
"""Tolerance of a charge: seconds of a log are not rounded."""


class Battery:
    """The charge of a robot along a log without new batteries: a step takes ``move`` when it ends,
    a second without one ``stay``, or gives ``charge`` on a charger. A robot stands from the moment
    on at which the team is told of the end of its step."""

    def __init__(self, battery: Data, chargers: Collection[int], region: int) -> None:
        self.battery, self.chargers, self.region = battery, chargers, region
        self.charge = float(battery.get("start", battery["capacity"]))
        self.move = battery.get("move", 1)
        self.since: float | None = 0.0
        """When it began to stand."""
        self.under_way: int | None = None

    def starts(self, t: float, command: int) -> str:
        """Return what is wrong with a step that begins."""
        self._stood(t)
        self.since, self.under_way = None, command
        short = self.charge < self.move - CLOSE
        return f"departs with a charge of {self.charge:g}" if short else ""

    def ends(self, region: int) -> None:
        self.charge, self.region = max(0.0, self.charge - self.move), region

    def told(self, t: float, command: int) -> None:
        if command == self.under_way:
            self.since, self.under_way = t, None

    def put(self, t: float, region: int) -> None:
        self._stood(t)
        self.region = region

    def _stood(self, t: float) -> None:
        if self.since is not None:
            on = self.region in self.chargers
            rate = self.battery["charge"] if on else -self.battery.get("stay", 0)
            charge = self.charge + rate * (t - self.since)
            self.charge, self.since = min(self.battery["capacity"], max(0.0, charge)), t


class Walk:
    """A log, followed to its end. ``given``: words of an operator; ``defects``: violated
    requirements."""

    def __init__(self, data: Data, log: Sequence[Line], given: Sequence[str] = ()) -> None:
        words, changes = [word.split() for word in given], data.get("changes", ())
        back = {change["robot"] for change in changes if change.get("service") == "back"}
        self.back = back | {word[1] for word in words if word[0] == "service"}
        told = {name for name, robot in data["robots"].items() if "when" in robot}
        told |= {word[1] for word in words if word[0] == "objective"}
        self.free_of_rules = told | {change["robot"] for change in changes}
        """Robots whose objective others change, so that its rules are not those of the data."""
        self.mission, self.data = Mission(data), data
        self.rivals, self.defects = self.mission.conflicts, list[str]()
        starts = {name: self.mission.start(name) for name in data["robots"]}
        self.heading = {name: heading for name, (_, heading) in starts.items()}
        self.at = {name: {region} for name, (region, _) in starts.items()}
        self.visits = {name: [region] for name, (region, _) in starts.items()}
        self.way: dict[str, tuple[int, int]] = {}
        self.came: dict[str, int] = {}
        self.stages: dict[str, Stage] = {}
        self.walls, self.known = set[str](), set[str]()
        self.believed: set[str] = set()
        """Absent obstacles that a sensor has reported."""
        self.failures: dict[str, list[int]] = {name: [] for name in self.at}
        self.actions: Counter[tuple[str, str]] = Counter()
        """Failed actions of a robot on an obstacle."""
        self.out: set[str] = set()
        self.silent: set[str] = set()
        """Robots that were asked to give up a step, and not sent anywhere since: their reports came
        so late that the run may take them for lost."""
        self.given: set[tuple[str, int | None]] = set()
        self.settled: set[tuple[str, int | None]] = set()
        """Commands given before their robot was put down: reports of them mean nothing."""
        self.acting: set[str] = set()
        self.hidden: tuple[Any, ...] = ()
        self.slid: set[str] = set()
        self.batteries = self._batteries()
        for line in log:
            self._follow(line, line.get("robot", ""))

    def _batteries(self) -> dict[str, Battery]:
        models = (self.data.get("catalogue") or {}).get("robots") or {}
        chargers, robots = {*self.data.get("chargers", ())}, self.data["robots"].items()
        own = {name: models.get(robot["model"], {}).get("battery") for name, robot in robots}
        return {
            name: Battery(battery, chargers, *self.visits[name])
            for name, battery in own.items()
            if battery and "flat" not in self.data
        }

    def _found(self, line: Line, said: str) -> None:
        self.defects.append(f"{line['t']:.2f} s: {said}")

    def _follow(self, line: Line, name: str) -> None:
        battery = self.batteries.get(name)
        match line["log"]:
            case "start":
                self._start(line, name)
                if battery and (said := battery.starts(line["t"], line["command"])):
                    self._found(line, f"{name} {said}")
            case "end":
                self._end(line, name)
                if battery:
                    battery.ends(line["at"])
            case "act":
                if line["busy"] or name in self.out:
                    self._found(line, f"{name} is to act, and cannot: {dict(line)}")
                self.acting.add(name)
            case "acted":
                self.acting.discard(name)
                self._acted(line, name)
            case "there":
                self.stages[line["obstacle"]] = FIRST
                self.came.clear()  # it may have appeared around a robot
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
                if battery:
                    battery.told(line["t"], line["command"])
            case "put":
                self.at[name] = {line["at"]}
                self.came.pop(name, None)
                self.out.discard(name)
                self.settled |= {told for told in self.given if told[0] == name}
                self.failures[name].clear()
                self._forgive(robot=name)
                self._apart(line, name)
                if battery:
                    battery.put(line["t"], line["at"])

    def _start(self, line: Line, name: str) -> None:
        to, origin, stops = line["to"], line["origin"], line["stops"]
        self.silent.discard(name)
        if line["busy"] or name in self.acting:
            self._found(line, f"{name} has a command already")
        if name in self.out:
            self._found(line, f"{name}, which is lost or broken, is sent to {to}")
        if not self.at[name] <= {origin} or abs(to - origin) not in (0, 1, self.mission.cols):
            have = sorted(self.at[name])
            self._found(line, f"{name} departs from {origin} to {to}, and has {have}")
        # It may have decided to stay first, which counts again, and takes no time here. That it has
        # decided so is in the trace, which is checked.
        self.visits[name].append(origin)
        self.at[name], self.way[name] = {origin, to}, (origin, to)
        self.came.pop(name, None)
        self.given.add((name, line["command"]))
        self._apart(line, name)
        self._rules(line, name)
        if stops is not None:
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
                self._found(line, f"{name} departs for {to}, which it avoids")
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
        to = line["at"]
        before, bound = self.way.pop(name, (to, to))
        self.at[name] = {*(line["within"] or [to])}
        if line["how"] == "elsewhere" and to != bound:
            self.slid.add(name)
            self._apart(line, name)
        if to != before and not line["within"]:
            self.visits[name].append(to)
            self.heading[name] = self.mission.turned(self.heading[name], before, to)
        if line["how"] == "failed":
            self.failures[name].append(bound)
        elif line["how"] == "arrived":
            self.failures[name].clear()
            self.came |= {name: before} if to != before else {}

    def _acted(self, line: Line, name: str) -> None:
        nothing = {n for n, result in line["found"].items() if result == "nothing"}
        self.believed, self.known = self.believed - nothing, self.known - nothing
        failed = {n for n, result in line["found"].items() if result == "failed"}
        self.actions.update((name, n) for n in failed)
        self.known |= failed
        self.stages |= {n: (need, frozenset(done)) for n, (need, done) in line["stages"].items()}

    def _gone(self, line: Line, obstacle: str) -> None:
        if not line.get("open", True):
            self.walls.add(obstacle)
        elif not line.get("untold"):  # else the team still takes it to be there
            self.known.discard(obstacle)
        self.stages.pop(obstacle, None)
        self._forgive(obstacle=obstacle)
        if line["log"] == "resolved":  # rounds count from the last resolution
            self.visits = {other: seen[-1:] for other, seen in self.visits.items()}

    def _told(self, line: Line, name: str) -> None:
        if line["event"] == "blocked":
            self.known.add(line["obstacle"])
        command = name, line["command"]
        self.given.add(command)
        lost = line["event"] == "lost" and len(self.at[name]) > 1  # until it is put down
        if command not in self.settled and (lost or (line["fatal"] and name not in self.back)):
            self.out.add(name)

    def _forgive(self, robot: str = "", obstacle: str = "") -> None:
        for pair in [*self.actions]:
            if robot in pair or obstacle in pair:
                del self.actions[pair]

    # -- the end -----------------------------------------------------------------------------

    def pose(self, name: str) -> Pose:
        """Where a robot is; where it goes, if it is under way: it ends its step."""
        if name not in self.way:
            return min(self.at[name]), self.heading[name]
        return self.way[name][1], self.mission.turned(self.heading[name], *self.way[name])

    def unreliable(self) -> set[str]:
        """Robots that the run may have put out of service."""
        many = {n for n, failed in self.failures.items() if len(failed) >= 2 * RETRIES}
        return self.out | self.silent | many

    def given_up(self) -> set[tuple[str, str]]:
        """Robots, each with an obstacle that may be given up since its actions have failed."""
        return {pair for pair, count in self.actions.items() if count >= ACTIONS}

    def unknowns(self) -> set[tuple[int, str]]:
        """Regions that a robot has failed to enter so often that an obstacle may be there, with the
        robot's layer."""
        return {
            (region, self.mission.layers[name])
            for name, failed in self.failures.items()
            for region in failed
            if failed.count(region) >= RETRIES
        }


def judge_log(walk: Walk, outcome: str) -> str:
    """Return the finding on a run with this outcome; empty if there is none, ``?`` if the search
    was too large."""
    if walk.defects:
        return "; ".join(walk.defects[:3])
    if outcome == "completed":
        return "; ".join(_not_done(walk))
    if outcome == "operator_needed" and not walk.unreliable():
        possible = can_complete(*_known_at_the_end(walk), BUDGET)
        told = "it says that an operator is needed, but the mission can be completed"
        return "?" if possible is None else told if possible else ""
    return ""


def _not_done(walk: Walk) -> list[str]:
    found = []
    for name, robot in walk.mission.robots.items():
        visits = walk.visits[name]
        single = len(robot.targets) == 1 and robot.targets[0] & {*visits}
        if robot.formulas or single or (robot.stays and visits[-1] in robot.targets[-1]):
            continue  # staying at a single or last target is enough
        done = rounds_done(robot, visits)
        if done < walk.mission.rounds:
            found.append(f"{name} has done {done} rounds of {walk.mission.rounds}")
    return found


def _known_at_the_end(walk: Walk) -> tuple[Mission, Situation]:
    """The mission of the robots in service, with all that sensors have shown and that failures make
    likely in their way."""
    data, kinds = walk.data, dict((walk.data.get("catalogue") or {}).get("obstacles", {}))
    entries = list(data.get("obstacles") or ())
    shown = dict.fromkeys(walk.believed - walk.mission.obstacles.keys(), FIRST)
    entries += [{"type": n.split("@")[0], "region": int(n.split("@")[1])} for n in shown]
    for region, layer in walk.unknowns():
        kinds[f"unknown_{layer}"] = {"action": "operator", "blocks": [layer]}
        entries.append({"type": f"unknown_{layer}", "region": region})
        shown[f"unknown_{layer}@{region}"] = FIRST
    catalogue = {**(data.get("catalogue") or {}), "obstacles": kinds}
    data = {**data, "obstacles": entries, "catalogue": catalogue}
    mission = Mission(data, walk.given_up())
    there = walk.known & mission.obstacles.keys() - walk.walls
    known = {name: walk.stages.get(name, FIRST) for name in there} | shown
    poses = {name: walk.pose(name) for name in walk.at}
    begun = dict.fromkeys(poses, (0, 0))
    return mission, Situation(poses, begun, known, frozenset(walk.walls), walk.came)
