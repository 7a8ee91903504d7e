"""Judges a run only by the log of its world, in seconds: positions of robots and obstacles.

A robot occupies the region that it leaves and the one that it enters from the command to its end; a
lost robot occupies both until an operator puts it back. The run's outcome is compared with that,
and with an exhaustive search from the end of the log.
"""

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

from campaigns.judge import independent, joint
from campaigns.judge.mission import Mission, Robot, read_mission
from campaigns.judge.replay import rounds_done
from campaigns.judge.situation import FIRST, Answer, Situation, Stage

Line = Mapping[str, Any]
RETRIES, ACTIONS = 3, 2


class Walk:
    """A log, followed to its end. ``defects``: overlaps, entries, impossible commands."""

    def __init__(self, mission: Mission, log: Sequence[Line]) -> None:
        self.mission = mission
        self.robots: dict[str, Robot] = {robot.name: robot for robot in mission.robots}
        self.at = {name: {robot.start[0]} for name, robot in self.robots.items()}
        self.visits = {name: [robot.start[0]] for name, robot in self.robots.items()}
        self.way: dict[str, tuple[int, int]] = {}
        self.heading = {name: robot.start[1] for name, robot in self.robots.items()}
        self.stages: dict[str, Stage] = dict.fromkeys(mission.obstacles, FIRST)
        self.walls: set[str] = set()
        self.known: set[str] = set()
        self.hidden: set[str] = set()
        self.believed: set[str] = set()
        """Obstacles of which a sensor has told, whether they are there or not."""
        self.failures: dict[str, list[int]] = {name: [] for name in self.robots}
        self.actions: Counter[tuple[str, str]] = Counter()
        """Failed actions of a robot on an obstacle."""
        self.out: set[str] = set()
        self.silent: set[str] = set()
        """Robots that were asked to give up a step, and not sent anywhere since: their reports came
        so late that the run may take them for lost."""
        self.moves, self.stopped, self.over = 0, 0, 0.0
        self.busy = dict.fromkeys(self.robots, 0.0)
        self.defects: list[str] = []
        self._missed: tuple[Any, ...] = ()
        self._begun: dict[str, float] = {}
        self._acting: dict[str, set[str]] = {}
        self.log = log
        for line in log:
            self._follow(line)
            self.over = max(self.over, line["t"])

    def _follow(self, line: Line) -> None:
        name = line.get("robot", "")
        match line["log"]:
            case "start":
                self._start(line, name)
            case "end":
                self._end(line, name)
            case "act":
                self._begun[name] = line["t"]
                self._acting[name] = set(line.get("on", ()))
            case "acted":
                self._acting.pop(name, None)
                self.busy[name] += line["t"] - self._begun.pop(name, line["t"])
                self._worked(line)
            case "resolved":
                self.stages.pop(line["obstacle"])
                self.known.discard(line["obstacle"])
                self._forgive(lambda _, obstacle: obstacle == line["obstacle"])
                if not line["open"]:
                    self.walls.add(line["obstacle"])
                for other, seen in self.visits.items():
                    self.visits[other] = seen[-1:]
            case "cancel":
                self.silent.add(name)
            case "shown":
                (self.known if line["there"] else self.believed).add(line["obstacle"])
            case "hidden":
                self._missed = (line["t"], name, line["obstacle"])
                self.hidden.add(line["obstacle"])
            case "told":
                self._told(line, name)
            case "put":
                self.at[name] = {line["at"]}
                self.out.discard(name)
                self.failures[name].clear()
                self._forgive(lambda robot, _: robot == name)
                self._apart(line, name)
            case "wrong":
                self.defects.append(f"{line['t']:.2f} s: no robot can do that: {dict(line)}")

    def _start(self, line: Line, name: str) -> None:
        self.moves += 1
        self.silent.discard(name)
        # It may have decided to stay first, which counts again, and takes no time here. That it has
        # decided so is in the trace, which is checked.
        self.visits[name].append(line["from"])
        self._begun[name] = line["t"]
        self.way[name] = (line["from"], line["to"])
        self.at[name] = {line["from"], line["to"]}
        self._apart(line, name)
        stops = line["stops"]
        if stops is None:
            return
        self.stopped += 1
        told = stops in self.known or stops in self.walls
        if told or self._missed != (line["t"], name, stops):
            how = "known" if told else "before its sensor"
            self.defects.append(f"{line['t']:.2f} s: {name} is sent into {stops}, which is {how}")

    def _apart(self, line: Line, name: str) -> None:
        for other in self.mission.conflicts[name]:
            if shared := self.at[name] & self.at[other]:
                where = f"{name} and {other} have {sorted(shared)}"
                self.defects.append(f"{line['t']:.2f} s: {where} at the same time")

    def _end(self, line: Line, name: str) -> None:
        self.busy[name] += line["t"] - self._begun.pop(name)
        before, bound = self.way.pop(name)
        self.at[name] = set(line.get("within") or [line["at"]])
        if line["how"] == "elsewhere":
            self._apart(line, name)
        if line["at"] != before and "within" not in line:
            self.visits[name].append(line["at"])
            if self.robots[name].has_heading:
                self.heading[name] = self._way(before, line["at"])
        if line["how"] == "failed":
            self.failures[name].append(bound)
        elif line["how"] == "arrived":
            self.failures[name].clear()

    def _way(self, before: int, to: int) -> int:
        return (-self.mission.cols, 1, self.mission.cols, -1).index(to - before)

    def pose(self, name: str) -> tuple[int, int]:
        """Where a robot is; where it goes, if it is under way: it ends its step."""
        if name not in self.way:
            return min(self.at[name]), self.heading[name]
        turns = self.robots[name].has_heading
        return self.way[name][1], self._way(*self.way[name]) if turns else self.heading[name]

    def _told(self, event: Line, name: str) -> None:
        if event["event"] == "blocked" and event["obstacle"] in self.stages:
            self.known.add(event["obstacle"])
        if event["event"] == "lost" or event.get("fatal"):
            self.out.add(name)

    def _worked(self, line: Line) -> None:
        self.believed -= {n for n, result in line["found"].items() if result == "nothing"}
        failed = [n for n, result in line["found"].items() if result == "failed"]
        self.actions.update((line["robot"], n) for n in failed)
        self.known |= {*failed} & self.stages.keys()
        for obstacle, (index, done) in line["stages"].items():
            if obstacle in self.stages:
                self.stages[obstacle] = (index, frozenset(done))

    def _forgive(self, which: Callable[[str, str], bool]) -> None:
        self.actions = Counter({k: n for k, n in self.actions.items() if not which(*k)})

    # -- the end -----------------------------------------------------------------------------

    def unreliable(self) -> set[str]:
        """Robots that the run may have put out of service."""
        many = {n for n, failed in self.failures.items() if len(failed) >= 2 * RETRIES}
        return self.out | self.silent | many

    def unknowns(self) -> set[tuple[int, str]]:
        """Return regions that a robot has failed to enter so often that an obstacle may be there,
        with the robot's layer; and regions of lost robots."""
        found = set()
        for name, failed in self.failures.items():
            layer = self.robots[name].layer
            found |= {(r, layer) for r in failed if failed.count(r) >= RETRIES}
            if len(self.at[name]) > 1 and name in self.out:
                found |= {(r, layer) for r in self.at[name]}
        return found

    def barred(self) -> set[tuple[str, str]]:
        """Return robots with the obstacles on which they have failed so often that other robots
        take over."""
        return {pair for pair, failed in self.actions.items() if failed >= ACTIONS}


def verdict(data: Mapping[str, Any], log: Sequence[Line], said: Line, budget: int = 20_000) -> str:
    """Return the finding on a run with this ``outcome`` and the explanation ``said``; empty: none;
    ``?``: the search was too large."""
    mission = read_mission(data)
    walk = Walk(mission, log)
    if walk.defects:
        return "; ".join(walk.defects[:3])
    match said["outcome"]:
        case "completed":
            return "; ".join(_not_done(mission, walk))
        case "operator_needed":
            return _false_statement(data, walk, budget)
        case "search_limit" if walk.unreliable():
            return ""  # it claims nothing, and whether the others can go on is not decided here
        case other:
            return f"ends as {other}: {said.get('explanation')}"


def _not_done(mission: Mission, walk: Walk) -> list[str]:
    found = []
    for robot in mission.robots:
        visits = walk.visits[robot.name]
        if robot.formulas or (len(robot.targets) == 1 and robot.targets[0] & {*visits}):
            continue  # it holds, or has a single target: staying there is enough
        done = rounds_done(robot, visits)
        if done < mission.rounds:
            found.append(f"{robot.name} has done {done} rounds of {mission.rounds}")
    return found


def _false_statement(data: Mapping[str, Any], walk: Walk, budget: int) -> str:
    """A run that needs an operator is right if those in service cannot complete the mission, with
    all that sensors have shown and that failures make likely in their way."""
    if walk.unreliable():
        return ""  # a robot that is out cannot meet its own objective
    kinds = dict((data.get("catalogue") or {}).get("obstacles", {}))
    entries = list(data.get("obstacles") or ())
    shown = dict.fromkeys(walk.believed - walk.stages.keys(), FIRST)
    entries += [{"type": n.split("@")[0], "region": int(n.split("@")[1])} for n in shown]
    for region, layer in walk.unknowns():
        kinds[f"unknown_{layer}"] = {"action": "operator", "blocks": [layer]}
        entries.append({"type": f"unknown_{layer}", "region": region})
        shown[f"unknown_{layer}@{region}"] = FIRST
    catalogue = {**(data.get("catalogue") or {}), "obstacles": kinds}
    mission = read_mission({**data, "obstacles": entries, "catalogue": catalogue})
    mission = _without(mission, walk.barred())
    known = {name: walk.stages[name] for name in walk.known & walk.stages.keys()} | shown
    poses = {name: walk.pose(name) for name in walk.robots}
    begin = Situation(poses, dict.fromkeys(walk.robots, (0, 0)), known, frozenset(walk.walls))
    search = joint.can_complete if mission.crowded else independent.can_complete
    answer = search(mission, begin, budget)
    if answer is Answer.YES:
        return "it says that an operator is needed, but the mission can be completed"
    return "?" if answer is Answer.OVER_BUDGET else ""


def _without(mission: Mission, barred: Collection[tuple[str, str]]) -> Mission:
    """The mission in which these robots lack the actions of these obstacles."""
    obstacles, able = dict(mission.obstacles), {r.name: r.capabilities for r in mission.robots}
    for name in {obstacle for _, obstacle in barred}:
        it = obstacles[name]
        own = {need.action: f"{need.action} {name}" for need in it.needs}
        needs = tuple(replace(need, action=own[need.action]) for need in it.needs)
        obstacles[name] = replace(it, needs=needs)
        for robot in mission.robots:
            if (robot.name, name) not in barred:
                able[robot.name] |= {own[a] for a in own.keys() & robot.capabilities}
    robots = tuple(replace(robot, capabilities=able[robot.name]) for robot in mission.robots)
    return replace(mission, obstacles=obstacles, robots=robots)
