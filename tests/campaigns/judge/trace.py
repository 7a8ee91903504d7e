"""Judges the end of a run without faults by the moves of its trace, which is read as plain data.

``completed`` must follow from the moves alone; after ``operator_needed`` the search must find the
mission infeasible from the run's end and (if nothing was hidden) from its start.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from campaigns.judge.mission import FIRST, HEADINGS, NO_HEADING, Mission, Pose, Robot
from campaigns.judge.search import Progress, Situation, at_start, can_complete

Line = Mapping[str, Any]
BUDGET = 40_000
"""States of a search."""


def rounds_done(robot: Robot, visits: Sequence[int]) -> int:
    """The most rounds that these visits can be, wherever counting began."""
    count = len(robot.targets)
    if robot.stays:
        return sum(region in robot.targets[-1] for region in visits)
    if not robot.in_order or robot.formulas:
        rounds, covered = 0, set[int]()
        for region in visits:
            covered |= {k for k, target in enumerate(robot.targets) if region in target}
            if len(covered) == count:
                rounds, covered = rounds + 1, set()
        return rounds
    best = 0
    for first in range(count):
        met = first  # a round ends at the last target, wherever it began
        for region in visits:
            for _ in range(count):  # a region may count for several targets, each once
                met += region in robot.targets[met % count]
        best = max(best, met // count)
    return best


class Replay:
    """A trace, followed to its last line. Robots know the obstacles that they have encountered;
    the stage of an obstacle follows from the poses of robots. ``visits``: regions of each robot
    since the last resolution; ``problems``: contradictions between a trace and its moves, and
    robots in regions whose obstacle blocks them."""

    def __init__(self, mission: Mission, trace: Sequence[Line]) -> None:
        self.mission, self.robots, self.obstacles = mission, mission.robots, mission.obstacles
        self.poses = {name: robot.start for name, robot in self.robots.items()}
        self.toward: dict[str, int | None] = dict.fromkeys(self.robots)
        self.there = {name: FIRST for name, one in self.obstacles.items() if not one.since}
        self.groups: dict[str, tuple[list[str], set[str]]] = {}
        """By each robot that acts: those that act, and those that were idle when it began."""
        self.met, self.sealed, self.given_up = set[str](), set[str](), set[str]()
        self.goals: dict[str, list[tuple[int, int]]] = {name: [] for name in self.robots}
        self.visits = {name: [region] for name, (region, _) in self.poses.items()}
        self.problems: list[str] = []
        for line in trace:
            self._follow(line)
        for name, (index, _) in self.there.items():
            needs = self.obstacles[name].needs
            if index >= len(needs) and not any(need.together for need in needs):
                self.problems.append(f"{name} has all it needs and is not resolved")

    def _follow(self, line: Line) -> None:
        match line["type"]:
            case "move":
                self._moved(line, line["to"])
            case "depart":
                self._enters(line, line["robot"], line["to"])
                self.toward[line["robot"]] = line["to"]
            case "arrive":
                self._moved(line, line["at"])
            case "act":
                busy = {name for group, _ in self.groups.values() for name in group}
                idle = {n for n, to in self.toward.items() if to is None} - busy
                self.groups[line["robot"]] = line["robots"], idle
            case "acted":
                _, there = self.groups.pop(line["robot"])
                self._acts(line["robot"], there)
            case "violation":
                self.met.add(line["obstacle"])
            case "blocked":
                self.given_up.add(line["obstacle"])
            case "reopened":
                self.given_up.discard(line["obstacle"])
            case "goal":
                robot = self.robots[line["robot"]]
                targets = robot.targets[line["goal"] : line["goal"] + 1]
                if robot.formulas or any(line["region"] in target for target in targets):
                    self.goals[robot.name].append((line["goal"], line["round"]))
            case "appeared":
                self._forget(line["obstacle"])
                self.there[line["obstacle"]] = FIRST
            case "gone":
                self._forget(line["obstacle"])
            case "resolved":
                self._resolved(line, line["obstacle"])

    def _forget(self, obstacle: str) -> None:
        self.there.pop(obstacle, None)
        for known in (self.met, self.sealed, self.given_up):
            known.discard(obstacle)

    def _moved(self, line: Line, region: int) -> None:
        name = line["robot"]
        self._enters(line, name, region, line.get("toward"))
        turns = line["heading"] and self.robots[name].has_heading
        self.poses[name] = region, HEADINGS.index(line["heading"]) if turns else NO_HEADING
        self.toward[name] = line.get("toward")
        self.visits[name].append(region)
        if line["type"] == "move":
            self._acts(name, {*self.poses})

    def _enters(self, line: Line, robot: str, *regions: int | None) -> None:
        for name, one in self.obstacles.items():
            if one.region not in regions:
                continue
            if name in self.given_up:
                inside = robot in one.blocks and one.region != self.poses[robot][0]
            else:
                stage = self.there.get(name, (len(one.needs), FIRST[1]))
                stands = stage[0] < len(one.needs)
                inside = stands and self.mission.blocked(robot, one, stage)
            if inside:
                self.problems.append(f"tick {line['tick']}: {robot} is in {name}")

    def _acts(self, name: str, among: Collection[str]) -> None:
        at = {robot: region for robot, (region, _) in self.poses.items() if robot in among}
        for obstacle, stage in self.there.items():
            done = self.mission.performed(self.obstacles[obstacle], stage, at, [name])
            self.there[obstacle] = done

    def _resolved(self, line: Line, name: str) -> None:
        """A need is met; with the last one (traces may tell no others) the obstacle is gone."""
        count, need, stage = len(self.obstacles[name].needs), line.get("need"), self.there.get(name)
        met = count if need is None else need + 1
        if stage is None:
            self.problems.append(f"{name} is resolved, but it is not there")
        elif stage[0] < met:
            self.problems.append(f"{name} is resolved at {stage}, before that is done")
        if met < count:
            return
        self._forget(name)
        if line.get("traversable") is False:
            self.sealed.add(name)
        for robot in self.robots.values():
            self.goals[robot.name].clear()
            # A goal in formulas is met by the step that leaves its region.
            self.visits[robot.name] = self.visits[robot.name][-2 if robot.formulas else -1 :]

    def pose(self, name: str) -> Pose:
        """Where the robot stands, or its step under way ends."""
        bound, (region, heading) = self.toward[name], self.poses[name]
        if bound is None:
            return region, heading
        return bound, self.mission.turned(heading, region, bound)

    def progress(self, robot: Robot) -> Progress:
        """The rounds that are surely done; of a round in progress nothing counts but what is
        next, so that what the judge finds possible is. Goals that a robot meets while it waits
        or helps are told as well: a round has each target once."""
        goals, count = self.goals[robot.name], len(robot.targets)
        if robot.stays:  # its next goal is known if it has no duties
            met = 0 if self.obstacles else sum(goal < count - 1 for goal, _ in goals)
            return min(met, count - 1), 0
        each = (sum(goal == k for goal, _ in goals) for k in range(count))
        rounds = min(goals[-1][1], *each) if goals else 0
        if not robot.in_order:
            return 0, rounds
        next_ = goals[-1][0] + 1 if goals and not robot.formulas else 0
        return next_ % count if next_ <= count else 0, rounds * count

    @property
    def situation(self) -> Situation:
        """The situation at the end, as known to the robots."""
        poses = {name: self.pose(name) for name in self.robots}
        progress = {name: self.progress(robot) for name, robot in self.robots.items()}
        known = {name: stage for name, stage in self.there.items() if name in self.met}
        return Situation(poses, progress, known, frozenset(self.sealed))

    @property
    def away(self) -> list[str]:
        """The robots that are to stay at their last target, and do not stand there."""
        staying = ((name, robot.targets[-1]) for name, robot in self.robots.items() if robot.stays)
        return [
            name
            for name, last in staying
            if self.toward[name] is not None or self.poses[name][0] not in last
        ]


def judge_trace(mission: Mission, trace: Sequence[Line]) -> str:
    """Return what is wrong with the end of a run; empty if nothing is, ``?`` if the search was too
    large."""
    ending, outcome = Replay(mission, trace), trace[-1]
    if ending.problems:
        return "inconsistent: " + "; ".join(ending.problems)
    if outcome["outcome"] == "completed":
        rounds = 1 if "t" in outcome else mission.rounds  # live, a robot that stays does not move
        for robot in mission.robots.values():
            done = rounds_done(robot, ending.visits[robot.name])
            if done < rounds:
                return f"{robot.name} has done {done} rounds of {rounds}"
        return f"{' and '.join(ending.away)} not at the last target" if ending.away else ""
    begins = {"from its end": ending.situation}
    if not mission.obstacles:
        begins["from its start"] = at_start(mission)
    for where, begin in begins.items():
        possible = can_complete(mission, begin, BUDGET)
        if outcome["outcome"] != "operator_needed":
            return f"{outcome['outcome']}; the judge: {possible}; {outcome['explanation']}"
        if possible is not False:
            told = f"given up ({outcome.get('cause')}), and can be completed {where}"
            return told if possible else "?"
    return ""


def told_by_signals(trace: Sequence[Line]) -> list[str]:
    """With signals a team is synthesized once; and robots for which the known map has changed, or
    that are elsewhere than their strategies say."""
    blocked, found = set[str](), list[str]()  # robots whose strategies no longer suffice
    for line in trace:
        if line["type"] == "blocked":
            blocked.update(line["robots"])
        elif line["type"] == "violation" or line.get("result", "arrived") != "arrived":
            blocked.add(line["robot"])  # its next target may be behind the obstacle
        elif line.get("by") == "stay":
            blocked.add(line["robot"])  # it has left its strategy to act
        elif line["type"] == "resumed":  # robots may have been interrupted in their steps
            blocked.update(robot["name"] for robot in trace[0]["scenario"]["robots"])
        if line["type"] != "synthesis" or line["tick"] == 0 or line["verdict"] != "realizable":
            continue
        if line["robot"] not in blocked:
            found.append(f"tick {line['tick']}: {line['robot']} again")
        blocked -= {line["robot"]}
    return found[:1]


def broken_promises(trace: Sequence[Line]) -> list[str]:
    """Plans that the robots have followed to their end, whereupon they need another one although
    nothing else has happened (a battery loses charge while its robot waits): a plan completes the
    mission, or all that it serves, if it is not for a part. Only rounds that are due continue."""
    scenario, rounds = trace[0]["scenario"], Counter[str]()
    due = any(robot.get("within") for robot in scenario["robots"])
    kinds = {r["name"]: next(iter(r["objective"].items())) for r in scenario["robots"]}
    told = {
        n for n, (kind, to) in kinds.items() if kind != "once" and isinstance(to, list) and to[1:]
    }
    """Robots that meet a goal as soon as they are there, and do not complete rounds by standing."""
    ended, part, found = False, False, list[str]()
    for line in trace:
        match line["type"]:
            case "plan_end":
                ended = line["reason"] == "reached" and not part
            case "plan":
                part = line["reason"] == "a part of the mission"
                wanted, those = scenario["until"]["rounds"], told & line["robots"].keys()
                if ended and (not due or any(rounds[name] < wanted for name in those)):
                    found.append(f"plan: it ends in tick {line['tick']} without what it promises")
            case "goal":
                rounds[line["robot"]] = line["round"]
            case "objective":
                ended, told = False, told - {line["robot"]}
            case "move" | "depart" | "arrive":
                pass
            case kind:
                ended = ended and bool(line.get("note")) and kind != "charge"
                if kind == "resolved":
                    rounds.clear()
    return found[:1]
