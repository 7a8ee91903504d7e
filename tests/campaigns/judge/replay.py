"""The situation at the end of a trace, computed from its moves by the rules of docs/scenario.md.

Reads lines as plain data. Robots know the obstacles that they have encountered; their progress
follows from their goal lines since the last resolution; the stage of an obstacle follows from the
poses of robots.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from campaigns.judge import joint
from campaigns.judge.mission import (
    FIRST,
    HEADINGS,
    NO_HEADING,
    Answer,
    Mission,
    Need,
    Pose,
    Progress,
    Robot,
    Situation,
    Stage,
    at_start,
)

Line = Mapping[str, Any]


class Replay:
    """A trace, followed to its last line. ``visits``: regions of each robot since the last
    resolution; ``problems``: contradictions between a trace and its moves, and robots in regions
    whose obstacle blocks them."""

    def __init__(self, mission: Mission, trace: Sequence[Line]) -> None:
        self.mission = mission
        self.robots: dict[str, Robot] = {robot.name: robot for robot in mission.robots}
        self.poses: dict[str, Pose] = {name: robot.start for name, robot in self.robots.items()}
        self.toward: dict[str, int | None] = dict.fromkeys(self.robots)
        self.there: dict[str, Stage] = {
            name: FIRST for name, one in mission.obstacles.items() if not one.since
        }
        self.met: set[str] = set()
        self.sealed: set[str] = set()
        self.given_up: set[str] = set()
        self.goals: dict[str, list[tuple[int, int]]] = {name: [] for name in self.robots}
        self.visits = {name: [robot.start[0]] for name, robot in self.robots.items()}
        self.problems: list[str] = []
        for line in trace:
            self._follow(line)
        for name, (index, _) in self.there.items():
            needs = mission.obstacles[name].needs
            if index >= len(needs) and not any(need.together for need in needs):
                self.problems.append(f"{name} has all it needs and is not resolved")

    def _follow(self, line: Line) -> None:
        match line["type"]:
            case "move":
                self._moved(line)
            case "depart":
                self._check_entries(line, self.robots[line["robot"]])
                self.toward[line["robot"]] = line["to"]
            case "arrive":
                self._moved({**line, "to": line["at"]})
            case "acted":  # at its start, where it has not arrived
                self._acts(line["robot"])
            case "violation":
                self.met.add(line["obstacle"])
            case "blocked":
                self.given_up.add(line["obstacle"])
            case "goal":
                robot = self.robots[line["robot"]]
                targets = robot.targets[line["goal"] : line["goal"] + 1]
                if robot.formulas or any(line["region"] in target for target in targets):
                    self.goals[robot.name].append((line["goal"], line["round"]))
            case "appeared":
                self._forget(line["obstacle"])
                self.there[line["obstacle"]] = FIRST
                self.met.discard(line["obstacle"])
            case "gone":
                self._forget(line["obstacle"])
            case "resolved":
                self._resolved(line)
            case _:
                pass

    def _forget(self, obstacle: str) -> None:
        self.there.pop(obstacle, None)
        self.sealed.discard(obstacle)
        self.given_up.discard(obstacle)

    @property
    def standing(self) -> dict[str, Stage]:
        """The obstacles whose needs are not all met, with their stages."""
        needs = {name: one.needs for name, one in self.mission.obstacles.items()}
        return {name: stage for name, stage in self.there.items() if stage[0] < len(needs[name])}

    @property
    def situation(self) -> Situation:
        """The situation at the end, as known to the robots."""
        poses = {name: self.pose(name) for name in self.robots}
        progress = {name: self._progress(robot) for name, robot in self.robots.items()}
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

    def _moved(self, line: Line) -> None:
        name, region = line["robot"], line["to"]
        self._check_entries(line, self.robots[name])
        turns = line["heading"] and self.robots[name].has_heading
        self.poses[name] = region, HEADINGS.index(line["heading"]) if turns else NO_HEADING
        self.toward[name] = line.get("toward")
        self.visits[name].append(region)
        self._acts(name)

    def _check_entries(self, line: Line, robot: Robot) -> None:
        standing = self.standing
        for name, one in self.mission.obstacles.items():
            if one.region not in (line["to"], line.get("toward")):
                continue
            if name in self.given_up:
                inside = robot.name in one.blocks and one.region != self.poses[robot.name][0]
            else:
                inside = name in standing and self.mission.blocked(robot, one, standing[name][0])
            if inside:
                self.problems.append(f"tick {line['tick']}: {robot.name} is in {name}")

    def _acts(self, name: str) -> None:
        for obstacle, stage in self.there.items():
            while (after := self._performed(obstacle, stage, name)) != stage:
                stage = after  # a robot continues where it stands with the next need
            self.there[obstacle] = stage

    def _performed(self, obstacle: str, stage: Stage, mover: str) -> Stage:
        """The stage after the mover's turn; a need that is met goes over to the next."""
        index, done = stage
        needs = self.mission.obstacles[obstacle].needs
        if index >= len(needs) or not self._stands(mover, needs[index]):
            return stage
        if needs[index].together:
            group = {name for name in self.robots if self._stands(name, needs[index])}
            done = frozenset(group) if len(group) >= needs[index].robots else done
        else:
            done |= {mover}
        if len(done) >= needs[index].robots:
            return index + 1, FIRST[1]
        return index, done

    def _stands(self, name: str, need: Need) -> bool:
        return need.action in self.robots[name].capabilities and self.poses[name][0] in need.at

    def _resolved(self, line: Line) -> None:
        """A need is met; with the last one (traces may tell no others) the obstacle is gone."""
        name = line["obstacle"]
        needs = self.mission.obstacles[name].needs
        met = len(needs) if line.get("need") is None else line["need"] + 1
        stage = self.there.get(name)
        if stage is None:
            self.problems.append(f"{name} is resolved, but it is not there")
        elif stage[0] < met:
            self.problems.append(f"{name} is resolved at {stage}, before that is done")
        if met < len(needs):
            return
        self._forget(name)
        if line.get("traversable") is False:
            self.sealed.add(name)
        self.met.discard(name)
        for name, robot in self.robots.items():
            self.goals[name].clear()
            # A goal in formulas is met by the step that leaves its region.
            self.visits[name] = self.visits[name][-2 if robot.formulas else -1 :]

    def pose(self, name: str) -> Pose:
        """Where the robot stands, or its step under way ends."""
        bound, (region, heading) = self.toward[name], self.poses[name]
        if bound is None:
            return region, heading
        if not self.robots[name].has_heading:
            return bound, NO_HEADING
        way = next(w for w in range(4) if self.mission.neighbour(region, w) == bound)
        return bound, way

    def _progress(self, robot: Robot) -> Progress:
        """The rounds that are surely done; of a round in progress nothing counts but what is
        next, so that what the judge finds possible is. Goals that a robot meets while it waits
        or helps are told as well: a round has each target once."""
        goals = self.goals[robot.name]
        count = len(robot.targets)
        if robot.stays:  # its next goal is known if it has no duties
            met = 0 if self.mission.obstacles else sum(goal < count - 1 for goal, _ in goals)
            return (min(met, count - 1), 0)
        each = (sum(goal == k for goal, _ in goals) for k in range(count))
        rounds = min(goals[-1][1], *each) if goals else 0
        if not robot.in_order or robot.formulas:
            return (0, rounds if not robot.in_order else rounds * count)
        next_ = (goals[-1][0] + 1) % count if goals and goals[-1][0] < count else 0
        return (next_, rounds * count)


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
                rounds += 1
                covered = set()
        return rounds
    best = 0
    for first in range(count):
        met = 0
        for region in visits:
            for _ in range(count):  # a region may count for several targets, each once
                met += region in robot.targets[(first + met) % count]
        # A round ends at the last target, wherever it began.
        best = max(best, (met + first) // count)
    return best


# Judges the end of a run without faults, from the moves of its trace.
#
# ``completed`` must follow from the moves alone; after ``operator_needed`` the judge's own search
# must find the mission infeasible from the run's end and (if nothing was hidden) from its start.


Line = Mapping[str, Any]
BUDGET = 40_000
"""States of a search."""


def judge_outcome(mission: Mission, ending: Replay, outcome: Line) -> str:
    """Return what is wrong; empty if nothing is, ``?`` if the search was too large."""
    if ending.problems:
        return "inconsistent: " + "; ".join(ending.problems)
    match outcome["outcome"]:
        case "completed":  # live, a robot that stays makes no moves
            return _completed(mission, ending, 1 if "t" in outcome else mission.rounds)
        case "operator_needed":
            return _operator_needed(mission, ending, outcome)
        case other:
            answer = joint.can_complete(mission, ending.situation, BUDGET)
            return f"{other}; the judge: {answer.value}; {outcome['explanation']}"


def told_by_signals(lines: Sequence[Line]) -> list[str]:
    """With signals a team is synthesized once, and robots for which the known map has changed."""
    blocked: set[str] = set()  # with a new permanent obstacle since their last strategy
    found = []
    for line in lines:
        if line["type"] == "blocked":
            blocked.update(line["robots"])
        if line["type"] != "synthesis" or line["reason"] == "initial":
            continue
        if line["robot"] not in blocked:
            found.append(f"tick {line['tick']}: {line['robot']} again: {line['reason']}")
        blocked -= {line["robot"]}
    return found[:1]


def _completed(mission: Mission, ending: Replay, rounds: int) -> str:
    """``rounds``: those that the moves must show."""
    for robot in mission.robots:
        done = rounds_done(robot, ending.visits[robot.name])
        if done < rounds:
            return f"{robot.name} has done {done} rounds of {rounds}"
    return f"{' and '.join(ending.away)} not at the last target" if ending.away else ""


def _operator_needed(mission: Mission, ending: Replay, outcome: Line) -> str:
    begins = [("from its end", ending.situation)]
    if not mission.obstacles:
        begins.append(("from its start", at_start(mission)))
    for where, begin in begins:
        answer = joint.can_complete(mission, begin, BUDGET)
        if answer is Answer.YES:
            return f"given up ({outcome.get('cause')}), and can be completed {where}"
        if answer is Answer.OVER_BUDGET:
            return "?"
    return ""
