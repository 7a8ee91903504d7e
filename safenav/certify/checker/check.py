"""Check a bundle: the proof that a run of robots did what it should, by strategies that had to.

    python3 -I -S check.py BUNDLE [--json]

BUNDLE is a folder or a .zip. Exit status 0: accepted; 1: refused, with the first reason; 2: no
bundle; 3: larger than this checker takes on. Only Python's standard library is needed.

What it establishes, from the files of the bundle alone. In check_strategies.py:
- *specification -> strategy*: each strategy realizes the text of its specification, and each
  counterstrategy shows that none does;
- *scenario -> strategy*: the same strategies keep the scenario's own rules, read from its data and
  not from formulas: the map, the mobility, known obstacles, regions observed as taken, and the
  objective again and again unless a named assumption fails (``Task``). Counterstrategies
  beat a robot that has all the freedom which the scenario leaves.
In this file:
- *strategy -> moves*: each move of the trace is the strategy's answer to what the robot observed,
  or it stays, steps back from an obstacle, or takes its next step of a joint plan (``Run``);
- *moves -> outcome*: nobody enters a wall or a standing obstacle, nobody collides, obstacles are
  resolved by those who can, and the outcome is what happened. What is called unresolvable, stuck
  or a deadlock is worked out again (``Team``).

What stays trusted: this program and Python; the step from the YAML file to scenario.json (its
grid is compared); that the trace tells what happened, and that robots move as their mobility says.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
import zipfile
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache
from importlib import import_module
from itertools import chain, combinations, product
from math import prod
from pathlib import Path
from typing import Any, NamedTuple

if __name__ == "__main__":
    sys.dont_write_bytecode = True  # a bundle stays as it is
    sys.path.insert(0, str(Path(__file__).resolve().parent))
elif __package__:  # the maker of bundles has these two files in a package
    sys.modules["check_strategies"] = import_module(f"{__package__}.check_strategies")

import check_strategies as base
from check_strategies import Json, Pose, RefusedError, Strategy, Task, World, require

MOST_STATES = 200_000
MOST_MEMORY = 64
SOMEBODY = "somebody"
ASKED = ("obstacle", "requester", "helper", "helpers", "reason")  # what an entry of the stack says

# ---------------------------------------------------------------- obstacles and robots


class Need(NamedTuple):
    """Something that an obstacle takes: who is able to do it, where, how many of them have to, and
    whether ``together`` or one after the other."""

    able: frozenset[str]
    regions: frozenset[int]
    robots: int
    together: bool


class Obstacle:
    """An obstacle at some line of the trace; ``data`` as in its header. All needs get one form."""

    def __init__(self, data: Json, robots: Json, *, present: bool) -> None:
        self.name, self.region, self.blocks = data["name"], data["region"], {*data["blocks"]}
        self.traversable, self.present, self.known = data["traversable"], present, False
        self.sealed: set[str] | None = None  # for whom it stays for good, once a line said so
        self.barred: set[str] = set()  # robots with no strategy to serve it
        self.needs: list[Need] = []
        for need in data.get("needs") or [{**data, "regions": data["resolution_regions"]}]:
            able = frozenset(n for n in robots if need["action"] in robots[n]["capabilities"])
            size, together = need.get("robots", 1), need.get("together", False)
            self.needs.append(Need(able, frozenset(need["regions"]), size, together))
        self.stage = Stage(self)

    def stands(self, name: str) -> bool:
        """Whether it is in a robot's way now."""
        return (self.present and self.stage.is_wall(name)) or name in (self.sealed or ())


class Stage(NamedTuple):
    """How far an obstacle is: which of its needs is next, and who has met part of it."""

    obstacle: Obstacle
    number: int = 0
    done: frozenset[str] = frozenset()

    @property
    def need(self) -> Need | None:
        """The need that is next; None if all are met."""
        return next(iter(self.obstacle.needs[self.number :]), None)

    def is_wall(self, name: str) -> bool:
        """Whether it is in a robot's way: one that could meet all that is left passes."""
        left = self.obstacle.needs[self.number :]
        return name in self.obstacle.blocks and any(name not in need.able for need in left)

    def worked(self, at: Mapping[str, Pose], acting: Iterable[str]) -> Stage:
        """The stage after some robots have done what they can where they stand, asked or not."""
        stage, before = self, None
        while stage != before and (need := stage.need):
            before = stage
            there = need.able & {name for name, pose in at.items() if pose[0] in need.regions}
            now = there.intersection(acting)
            group = stage.done | (there if need.together and now else now)
            if len(group) >= need.robots:
                stage = Stage(self.obstacle, stage.number + 1)
            elif not need.together:
                stage = stage._replace(done=group)
        return stage


class Progress(NamedTuple):
    """How far a robot is with its objective since the last resolution: the goals of which any one
    counts next, and how many were met. A round is each goal once, in order or in any order."""

    next: frozenset[int]
    met: int = 0

    def after(self, objective: Json, goal: int) -> Progress:
        """When a goal is met that counts."""
        every = goals_of(objective)
        rest = self.next - {goal} or every
        following = frozenset([(goal + 1) % len(every)])
        return Progress(following if base.is_ordered(objective) else rest, self.met + 1)

    def again(self, objective: Json) -> Progress:
        """When the count begins anew: whose turn it is does not change."""
        return Progress(self.next if base.is_ordered(objective) else goals_of(objective))


def goals_of(objective: Json) -> frozenset[int]:
    """The numbers of an objective's goals. Where they have an order, any may be the first."""
    number = len(base.targets_of(objective)) or len(base.formulas_of(objective, "liveness"))
    return frozenset(range(number or 1))


class Robot:
    """One robot at some line of the trace. ``data``: as its header has it; ``rivals``: whom it must
    not share a region with."""

    def __init__(self, name: str, data: Json, rivals: list[str]) -> None:
        self.name, self.data, self.rivals = name, data, rivals
        self.own: Json = data["objective"]  # what it is there for
        self.objective = self.own  # what it does now
        self.progress = Progress(goals_of(self.own))
        self.goals: list[int] = []  # those met since the last resolution
        self.pose: Pose = (data["start"], data.get("heading"))
        self.destination = self.pose  # where its step ends, if it is on its way
        self.task: Task | None = None
        self.nodes: set[int] | None = None  # of its strategy, at its destination; None: any there
        self.came_from: set[int] = set()  # the nodes before its last step
        self.knowledge: dict[str, int] = {}
        self.signal: Json = {}
        self.back: Json | None = None  # its ``backtrack`` line in this turn
        self.silent = False  # whether its strategy had no answer in its last turn
        self.active = True  # whether it is in service
        self.way: list[Pose] = []  # its part of a joint plan, from where it is

    @property
    def places(self) -> set[int]:
        """The regions that it takes up: on its way two."""
        return {self.pose[0], self.destination[0]}

    @property
    def moves_on(self) -> bool:
        """Whether it is on its way."""
        return bool(self.pose != self.destination)

    @property
    def on_its_own(self) -> bool:
        """Whether it pursues its own objective."""
        return bool(base.same_objective(self.objective, self.own))

    def may_be(self) -> set[int]:
        """The nodes in which it may be: one, or after a joint plan all of its pose, for from each
        of them the strategy keeps what it promises."""
        known: Mapping[Pose, set[int]] = self.task.of_pose if self.task is not None else {}
        return known.get(self.pose, set()) if self.nodes is None else self.nodes

    def meet(self, goal: int) -> None:
        self.goals.append(goal)
        self.progress = self.progress.after(self.own, goal)

    def hold(self) -> None:
        """To hold is met in each turn that ends there."""
        if "hold" in self.own and self.on_its_own and self.places <= base.targets_of(self.own)[0]:
            self.meet(0)


# ---------------------------------------------------------------- what the team can never do

Stages = tuple[Stage, ...]
Moves = dict[Pose, set[Pose]]
Sets = Mapping[str, set[Pose]]  # where robots choose to be
Counts = tuple[Progress, ...]
Joint = tuple[tuple[Pose, ...], Counts, Stages]


class Team:
    """What the team can still do at a moment of the run. Obstacles that it does not know are taken
    to be absent. ``never`` lets robots pass through each other, ``exhaust`` does not.

    ``names``: whom it is about. If that is not the whole team, the others and all that may yet be
    resolved only stand in their way. ``standing``: who stands still and wants nothing else."""

    def __init__(self, run: Run, names: Collection[str], standing: Collection[str] = ()) -> None:
        self.robots = {name: robot for name, robot in run.robots.items() if name in names}
        everybody = len(self.robots) == len(run.robots)
        open_ = [o.stage for o in run.met_obstacles() if o.sealed is None and everybody]
        self.stages, self.start = tuple(open_), {n: {r.destination} for n, r in self.robots.items()}
        self.sealed = [o for o in run.obstacles.values() if o.sealed]
        self.looked, self.enough = 0, dict[str, int]()
        self.moves: dict[str, Moves] = {}
        self.aims: dict[str, list[frozenset[Pose]]] = {}
        for name, robot in self.robots.items():
            mobility, own, here = robot.data["mobility"], robot.own, robot.destination
            poses = base.poses_of(((region, None) for region in run.world.free), mobility)
            moves = {pose: run.world.moves(mobility, pose) for pose in poses}
            aims = [base.poses_of(product(a, [None]), mobility) for a in base.targets_of(own)]
            if name in standing:
                moves, aims = {here: {here}}, [frozenset([here])]
            elif "ltl" in own:
                moves, aims = by_formulas(own, moves)
            self.moves[name], self.aims[name] = moves, aims
        self.steps = cache(self._steps)

    def _steps(self, name: str, pose: Pose, stages: Stages) -> list[Pose]:
        """The poses after one step or none, while obstacles are walls for whom they block."""
        walls = {stage.obstacle.region for stage in stages if stage.is_wall(name)}
        walls |= {obstacle.region for obstacle in self.sealed if obstacle.stands(name)}
        return [after for after in self.moves[name][pose] if after[0] not in walls]

    def reach(self, name: str, poses: Iterable[Pose], stages: Stages) -> set[Pose]:
        """Where a robot can get from some poses."""
        found = set(poses)
        queue = list(found)
        for pose in queue:
            fresh = {*self.steps(name, pose, stages)} - found
            found |= fresh
            queue += fresh
        return found

    def can_go_on(self, name: str, poses: Iterable[Pose], stages: Stages) -> bool:
        """Whether, from some pose that a robot can get to, it can meet every target for ever."""
        first, *others = self.aims[name]
        for pose in self.reach(name, poses, stages) & first:
            ahead = self.reach(name, [pose], stages)
            there = ((self.reach(name, [p], stages) for p in aim & ahead) for aim in others)
            if all(any(pose in back for back in ways) for ways in there):
                return True
        return False

    def never(self, sets: Sets, stages: Stages) -> set[str]:
        """The names of obstacles that stay, and of robots that are stuck, whatever is done from
        here on, where robots choose to be in ``sets``; and SOMEBODY if always one of them is."""
        self.looked += 1
        if self.looked > MOST_STATES:
            raise base.TooLargeError(f"more than {MOST_STATES} choices; not certified")
        lost = {name for name, at in sets.items() if not self.can_go_on(name, at, stages)}
        lost |= {SOMEBODY} if lost else set()
        lost |= {stage.obstacle.name for stage in stages if stage.need}
        options = list(self._options(sets, stages))
        for after, advanced, _ in [option for option in options if option[2]][:1] or options:
            lost &= self.never(after, advanced)
        return lost

    def _options(self, sets: Sets, stages: Stages) -> Iterator[tuple[Sets, Stages, bool]]:
        """What can be done next, by groups of robots that meet a need: where everybody is after
        it, the stages then, and whether nothing is lost: all get back to all that they could get
        to."""
        for k, stage in enumerate(stages):
            if (need := stage.need) is None:
                continue
            at = {name: set[Pose]() for name in need.able - stage.obstacle.barred - stage.done}
            for name in at:
                at[name] = {p for p in self.reach(name, sets[name], stages) if p[0] in need.regions}
            advanced = (*stages[:k], Stage(stage.obstacle, stage.number + 1), *stages[k + 1 :])
            for group in combinations(filter(at.get, sorted(at)), need.robots - len(stage.done)):
                crowd = [name for name in group if {*self.robots[name].rivals} & {*group}]
                ways = product(*({pose[0] for pose in at[name]} for name in crowd))
                if need.together and all(len({*way}) < len(way) for way in ways):
                    continue  # they cannot all stand there at once
                pairs = ((self.reach(n, p, stages) for p in (sets[n], at[n])) for n in group)
                lossless = all(before <= after for before, after in pairs)
                yield {**sets, **{name: at[name] for name in group}}, advanced, lossless

    def exhaust(self, rounds: int) -> int:
        """Refuse unless no order of moves completes some rounds, each robot's step being one
        transition. Returns the number of joint places."""
        for name, robot in self.robots.items():
            times = min(1, rounds) if "hold" in robot.own else rounds
            self.enough[name] = times * len(goals_of(robot.own))
        start = tuple(robot.destination for robot in self.robots.values())
        counts = tuple(robot.progress for robot in self.robots.values())
        seen = {self._settled(start, counts, self.stages)}
        queue = list(seen)
        for poses, counts, stages in queue:
            at = dict(zip(self.robots, poses, strict=True))
            done = all(count.met >= self.enough[n] for n, count in zip(at, counts, strict=True))
            lost = not done or not all(self.can_go_on(n, [p], stages) for n, p in at.items())
            require(lost, "the mission can be completed from here")
            for k, (name, robot) in enumerate(self.robots.items()):
                taken = {at[other][0] for other in robot.rivals if other in at}
                free = (p for p in self.steps(name, at[name], stages) if p[0] not in taken)
                moved = ((*poses[:k], pose, *poses[k + 1 :]) for pose in free)
                fresh = {self._settled(after, counts, stages) for after in moved} - seen
                seen |= fresh
                queue += fresh
            if len(seen) > MOST_STATES:
                raise base.TooLargeError(f"more than {MOST_STATES} joint states; not certified")
        return len({poses for poses, _, _ in seen})

    def _settled(self, poses: tuple[Pose, ...], counts: Counts, before: Stages) -> Joint:
        """The joint state after everybody has acted where it stands, and what is met is counted."""
        at, found = dict(zip(self.robots, poses, strict=True)), []
        fit = ({n: at[n] for n in {*at} - stage.obstacle.barred} for stage in before)
        stages = tuple(stage.worked(who, at) for stage, who in zip(before, fit, strict=True))
        anew = any(was.need and not is_.need for was, is_ in zip(before, stages, strict=True))
        for name, count in zip(at, counts, strict=True):
            own = self.robots[name].own
            here = {goal for goal, aim in enumerate(self.aims[name]) if at[name] in aim}
            progress = count.again(own) if anew else count
            while progress.met < self.enough[name] and (met := progress.next & here):
                progress = progress.after(own, min(met))
            found.append(progress)
        return poses, tuple(found), stages


def by_formulas(own: Json, moves: Moves) -> tuple[Moves, list[frozenset[Pose]]]:
    """Of an objective in formulas: the moves that its safety lines allow, and for each goal the
    poses in which it may be met, by staying or else by a step into them. Both with some memory;
    lines about more than MOST_MEMORY values of it say nothing here."""
    place = ["region", "heading"][: len(base.coordinates(next(iter(moves))))]
    bounds: dict[str, Any] = {"region": (0, max(region for region, _ in moves)), "heading": (0, 3)}
    bounds |= own["ltl"].get("memory", {})
    ranges = {n: "" if b == "bool" else f":{b[0]}...{b[1]}" for n, b in bounds.items()}
    variables = [base.read_variable(name + values) for name, values in ranges.items()]
    few = prod(v.most - v.least + 1 for v in variables[2:]) <= MOST_MEMORY
    spec, keys = {v.name: v for v in variables}, [*place, *(f"{p}'" for p in place)]
    rows = {(*base.coordinates(a), *base.coordinates(b)): (a, b) for a in moves for b in moves[a]}

    def met(lines: Iterable[base.Clause]) -> set[tuple[Pose, Pose]]:
        clauses = [clause for clause in lines if few or clause.reads <= {*keys}]
        wanted = sorted(set().union(*(clause.reads for clause in clauses)) - {*keys})
        return {rows[row] for row, _ in base.complete(spec, wanted, clauses, keys, list(rows))}

    allowed, aims = met(base.formulas_of(own, "safety")), []
    for goal in (met([line]) for line in base.formulas_of(own, "liveness")):
        staying = {a for a, b in goal if a == b}
        entered = {b for a, b in goal & allowed if not {a, b} & staying}
        aims.append(frozenset(staying | entered))
    kept = {a: {b for b in moves[a] if a == b or (a, b) in allowed} for a in moves}
    return kept, aims or [frozenset(moves)]


# ---------------------------------------------------------------- strategy -> moves


SAYS = {  # the claims, by their kinds and, after a colon, their variants
    "realizes": "The strategy of {who} realizes the text of its specification: {size}.",
    "keeps": "The strategy of {who} keeps the rules of the scenario and does what it is for again "
    "and again ({assumed}).",
    "unrealizable": "No strategy exists for {who}.",
    "weakest": "{who}: no strategy with fairness {fairness}, which was tried before.",
    "never": "{name} can never be resolved: whatever the robots do, too few that can resolve it "
    "get there.",
    "broken": "Tick {tick}: an assumption of {robot} failed ({name}). What its strategy promises "
    "does not hold from here on, until it is synthesized again.",
    "changed": "Tick {tick}: {robot} is given another objective, '{objective}'.",
    "motion": "motion.jsonl says that it is the motion of this trace (by its sha256); "
    "`safenav check-motion` checks what is in it, this program does not.",
    "moves": "{which} are legal: {answers} are the answers of these strategies to what the robots "
    "could observe, the others stay, step back or follow a joint plan. No wall, no standing "
    "obstacle, no collision.",
    "outcome:completed": "The mission is completed: every robot has met its objective {rounds} "
    "times after the last resolution.",
    "outcome:unrealizable": "The mission never began: a robot has no strategy.",
    "outcome:tick_limit": "The run ended at its limit of {ticks} ticks.",
    "outcome:ended": "The run ended early ({what}); nothing is claimed of its goal.",
    "outcome:no strategy": "An operator is needed: there is no strategy for {who}, as shown above.",
    "outcome:deadlock": "An operator is needed: no order of moves completes it from any of the "
    "{count} joint places.",
    "outcome:stuck": "An operator is needed: {who} cannot go on, whatever the team does{also}.",
}


class Claim(NamedTuple):
    """Something that the checker has established, and the files and lines that show it."""

    id: str
    kind: str
    text: str
    evidence: Sequence[tuple[str, int | None]]


class Run:
    """The trace, line by line, against the strategies, the map and the obstacles. Each type of
    line that matters has a method ``on_TYPE``, which gets the line and the robot and the obstacle
    that it names. (A refusal tells which line it is about.)"""

    def __init__(self, bundle: Bundle) -> None:
        self.bundle, self.scenario = bundle, bundle.header["scenario"]
        self.external = self.scenario.get("world") == "external"
        self.world, self.line = World(self.scenario["map"]), 1
        self.obstacles: dict[str, Obstacle] = {}
        self.robots: dict[str, Robot] = {}  # in the order of their turns
        self.stack: list[Json] = []
        self.met: Any = None  # the turn in which an obstacle was met last, by whom, and which
        self.claims: list[Claim] = []
        self.answers = self.tick = self.turn = self.strayed = 0
        self.realized: dict[str, Any] = {}  # by measures: a strategy, and where it may begin
        self.kept: dict[str, Task] = {}  # by measures under the scenario's rules
        self.beaten: dict[str, Any] = {}  # by specifications: see ``_beaten``
        self.hopeless: set[tuple[str, str]] = set()  # robots that have no strategy, and for what
        robots = self.scenario["robots"]
        apart = {(a, b) for a in robots for b in robots[a].get("conflicts", ()) if a != b}
        for name, data in robots.items():
            rivals = [other for other in robots if {(name, other), (other, name)} & apart]
            self.robots[name] = Robot(name, data, rivals)
        for data in self.scenario["obstacles"]:
            self.on_discovered({"obstacle": data}, present=not data.get("from"))
        for robot in self.robots.values():
            turning = {"free": False, "heading": True}.get(robot.data["mobility"])
            require(turning is bool(robot.pose[1]), f"{robot.name} has no such mobility")
            free = robot.places.union(*base.targets_of(robot.own)) <= self.world.free
            require(free, f"{robot.name} starts in a wall, or has a target in one")
            self._check_apart(robot, robot.places)

    def _check_apart(self, robot: Robot, regions: set[int]) -> None:
        for other in robot.rivals:
            require(not regions & self.robots[other].places, f"{other} is in the same region")

    def replay(self) -> None:
        """Refuse unless all lines are true; ``claims`` is what is established."""
        for record in self.bundle.trace:
            self.line += 1
            if record["tick"] != self.tick:
                whole = record["tick"] == self.tick + 1 and not self.turn % len(self.robots)
                require(whole, "a tick is left out, or a robot has not moved in it")
                self.tick += 1
            robot = self.robots.get(record.get("robot"))
            obstacle = self.obstacles.get(str(record.get("obstacle")))
            getattr(self, f"on_{record['type']}", lambda *_: None)(record, robot, obstacle)
        self.line = 0
        if "motion.jsonl" in self.bundle.files:
            header = json.loads(self.bundle.read("motion.jsonl").splitlines()[0])
            named = header["trace"] == self.bundle.files["trace.jsonl"]["sha256"]
            require(named, "motion.jsonl is the motion of another trace")
            self.claim("motion", "motion.jsonl")
        which = f"All {self.turn} moves"
        if self.strayed:
            which = f"Of {self.turn} moves all but {self.strayed}, which went elsewhere than told,"
        self.claim("moves", "trace.jsonl", which=which, answers=self.answers)

    def claim(self, says: str, *files: str | None, **about: Any) -> None:
        """Something is established by some files (None: by this line of the trace)."""
        kind, text = says.partition(":")[0], SAYS[says].format(**about)
        evidence = [(f, None) if f else ("trace.jsonl", self.line) for f in files or [None]]
        self.claims.append(Claim(f"{kind}-{len(self.claims) + 1}", kind, text, evidence))

    # synthesis

    def on_synthesis(self, record: Json, robot: Robot, _: Any) -> None:
        now = f"{robot.name}, tick {self.tick}"
        said = f"{now}, for '{base.in_words(record['objective'])}'"
        for tried in record.get("tried") or ():
            if tried["spec"] not in self.beaten and (proof := self._beaten(tried["spec"])):
                self.claim("weakest", None, *proof[0], who=now, fairness=tried["fairness"])
        if record["verdict"] == "unrealizable" and (proof := self._beaten(record["spec"])):
            files, graph, given = proof
            task, rules = self._task(record, graph), f"rules/{circumstances(record)}.json"
            there, wishes, assumptions = task.explore_counterstrategy(given)
            base.check_beaten(graph, assumptions, wishes, there, self.bundle.json(rules))
            self.claim("unrealizable", None, *files, rules, who=said)
            self.hopeless.add((robot.name, record["spec"]))
            for obstacle in self.met_obstacles():
                if obstacle.stage.need and obstacle.stage.need.regions in task.targets:
                    obstacle.barred.add(robot.name)
        if record["verdict"] == "realizable" and record.get("node") is not None:
            self._install(record, robot, said)

    def _beaten(self, spec: str) -> Any:
        """The files that show that a specification has no strategy, its counterstrategy, and what
        is said about that; None if they are not there."""
        text, path = f"specs/{spec}.structuredslugs", f"counterstrategies/{spec}.json"
        if spec not in self.beaten and path in self.bundle.files:
            read = base.read_specification(self.bundle.text(text))
            given = self.bundle.json(path)
            graph = Strategy(given["automaton"], read)
            base.check_counterstrategy(read, graph, given)
            self.beaten[spec] = (text, path), graph, given
        return self.beaten.get(spec)

    def _install(self, record: Json, robot: Robot, said: str) -> None:
        """From here on a robot follows a strategy, which is shown to be what it should."""
        spec, name = record["spec"], record.get("strategy")
        require(name, "its strategy was never listed: nothing is proven about its moves")
        text, path = f"specs/{spec}.structuredslugs", f"strategies/{name}.json"
        measures, rules = f"measures/{spec}-{name}.json", f"rules/{circumstances(record)}.json"
        if measures not in self.realized:
            read = base.read_specification(self.bundle.text(text))
            graph = Strategy(self.bundle.json(path), read)
            initial = base.check_strategy(read, graph, self.bundle.json(measures))
            self.realized[measures] = graph, initial
            size = f"{graph.count} nodes, {sum(map(len, graph.next))} edges"
            self.claim("realizes", text, path, measures, who=said, size=size)
        graph, initial = self.realized[measures]
        node = record["node"]
        require(node in initial, f"node {node} is not one with which the strategy may begin")
        task = self._task(record, graph, self.kept.get(rules))
        if rules not in self.kept:
            _, wishes, assumptions = task.explore_strategy(node)
            given = self.bundle.json(rules)
            for wish, met, measure in zip(task.wishes, wishes, given, strict=True):
                missed = f"it is not shown that no run misses {wish} for ever"
                base.check_measure(graph, missed, met, assumptions, measure)
            self.kept[rules] = task
            assumed = record["fairness"].replace("none", "whatever the others do")
            self.claim("keeps", None, text, path, measures, rules, who=said, assumed=assumed)
        robot.task, robot.nodes, robot.knowledge = task, {node}, dict(task.knowledge)
        nothing = {"request": False, "assigned": record.get("neutral"), "wait": False}
        robot.signal = robot.signal or nothing  # told when it changes
        if base.is_ordered(robot.own) and base.same_objective(task.objective, robot.own):
            first = frozenset([next(iter(task.memory.values()), 0)])
            robot.progress = robot.progress._replace(next=first)

    def _task(self, record: Json, graph: Strategy, known: Task | None = None) -> Task:
        """What a robot is synthesized for: the circumstances are those of the run."""
        robot, cells = self.robots[record["robot"]], self.scenario.get("partition")
        task = known or Task(self.world, robot.data, record, cells, graph)
        require(task.pose == robot.destination, f"it is not synthesized for {robot.destination}")
        tried = record["verdict"] == "unrealizable" and self.tick  # for an objective not in force
        wanted = robot.objective if task.places is None else robot.own
        if not tried and not base.same_objective(task.objective, wanted):
            require(self._may_do(robot, task.objective), "it is synthesized for something else")
            robot.objective = task.objective
        takes = {f"robots.{name}": other.places for name, other in self.robots.items()}
        due = {f"robots.{name}" for name in {*robot.rivals} - {*task.moving}}
        for obstacle in self.obstacles.values():
            if obstacle.known and obstacle.stands(robot.name):
                takes[obstacle.name] = {obstacle.region}
            due |= {obstacle.name} if robot.name in (obstacle.sealed or ()) else set()
        for region, name in record.get("closed") or ():
            why = name.removeprefix("obstacles.")
            require(region in takes.get(why, ()), f"{why} does not close {region}")
            due.discard(why)
        require(not due, f"{robot.name} does not know of {', '.join(sorted(due))}")
        for name, value in task.knowledge.items():
            where = set(task.whereabouts(name, value))
            if self.tick and record["tracking"] == "belief":  # it may have moved on since the look
                where = self.world.around(where)
            there = where & self.robots[name].places
            require(there, f"{robot.name} believes {name} to be where it is not")
        return task

    # obstacles

    def met_obstacles(self) -> list[Obstacle]:
        """Those that somebody has met, and that still stand."""
        return [o for o in self.obstacles.values() if o.known and o.present]

    def on_discovered(self, record: Json, *_: Any, present: bool = True) -> None:
        obstacle = Obstacle(record["obstacle"], self.scenario["robots"], present=present)
        names = {SOMEBODY, *self.robots, *(f"robots.{name}" for name in self.robots)}
        require(obstacle.name not in names, "an obstacle has the name of a robot")
        self.obstacles[obstacle.name] = obstacle

    def on_appeared(self, _record: Json, _: Any, obstacle: Obstacle) -> None:
        obstacle.present, obstacle.stage = True, Stage(obstacle)

    def on_truth(self, record: Json, _: Any, obstacle: Obstacle) -> None:
        obstacle.traversable = record["traversable"]

    def on_gone(self, _record: Json, _: Any, obstacle: Obstacle) -> None:
        obstacle.present, obstacle.known, obstacle.sealed = False, False, None

    def on_violation(self, record: Json, robot: Robot, obstacle: Obstacle) -> None:
        there = obstacle.region == record["proposed"] and obstacle.stands(robot.name)
        require(there, f"{obstacle.name} does not block {robot.name} there")
        self.met, obstacle.known = (self.turn, robot, obstacle), True

    def on_backtrack(self, record: Json, robot: Robot, _: Any) -> None:
        moves = self.world.moves(robot.data["mobility"], robot.pose) - {robot.pose}
        here = self.met and self.met[:2] == (self.turn, robot)
        here = here and self.met[2].region in {region for region, _ in moves}
        require(here, f"no obstacle is before {robot.name}")
        robot.back = record

    def on_resolved(self, record: Json, _: Any, obstacle: Obstacle) -> None:
        truth = record["traversable"]
        require(self.external or truth == obstacle.traversable, f"{obstacle.name} is not like that")
        done = obstacle.present and (self.external or not obstacle.stage.need)
        require(done, f"{obstacle.name} does not stand, or not all that it needs was done")
        able = set().union(*(need.able for need in obstacle.needs))
        unable = {*(record.get("robots") or [record["robot"]])} - able
        require(not unable, f"{', '.join(unable)} can do nothing about {obstacle.name}")
        obstacle.present, obstacle.known, obstacle.traversable = False, False, truth
        obstacle.stage = Stage(obstacle, len(obstacle.needs))
        for robot in self.robots.values():
            robot.progress, robot.goals = robot.progress.again(robot.own), []
            robot.hold()

    def on_blocked(self, record: Json, _: Any, obstacle: Obstacle) -> None:
        """An obstacle stays for good: it is untraversable, or the team can never resolve it."""
        name, stage = obstacle.name, obstacle.stage
        if record["reason"] == "untraversable":
            found = not obstacle.present and not stage.need and obstacle.traversable is False
            require(found, f"nobody has found {name} untraversable")
            stage = Stage(obstacle)
        else:
            team = Team(self, self.robots)
            require(name in team.never(team.start, team.stages), f"{name} can be resolved")
            self.claim("never", name=name)
        obstacle.known, obstacle.sealed = True, {*filter(stage.is_wall, self.robots)}
        require(obstacle.sealed == {*record["robots"]}, f"{name} blocks {obstacle.sealed}")

    # moves

    def on_move(self, record: Json, robot: Robot, _: Any) -> None:
        tick, number = divmod(self.turn, len(self.robots))
        due = tick == self.tick - 1 and robot is list(self.robots.values())[number]
        require(due, f"it is not the turn of {record['robot']}, or not in this tick")
        self._check_requests()
        self.turn += 1
        pose = (record["to"], record.get("heading"))
        try:
            after = self._check_motion(robot, record)
            if not robot.moves_on:  # else nothing is decided
                nodes = self._check_decision(robot, record, after)
                robot.came_from, robot.nodes = robot.may_be(), nodes
        except RefusedError:
            if not self.external or pose[0] not in self.world.free:
                raise
            self.strayed += 1  # of an external world: it is not where it was told to go
            after, robot.nodes = pose, set()
        robot.pose, robot.destination, robot.back = pose, after, None
        robot.hold()
        if pose == after and robot.way[1:2] == [pose]:
            robot.way = robot.way[1:]
        at = {other.name: other.pose for other in self.robots.values()}
        for obstacle in self.obstacles.values():
            if obstacle.present and not self.external:
                obstacle.stage = obstacle.stage.worked(at, [robot.name])

    def _check_requests(self) -> None:
        """Before the next move what was resolved is told, and who met an obstacle asks for help."""
        done = [o.name for o in self.obstacles.values() if o.present and not o.stage.need]
        require(not done, f"no line tells that {', '.join(done)} was resolved")
        open_ = [(entry["requester"], entry["obstacle"]) for entry in self.stack]
        left = [name for _, name in open_[-1:] if name and not self.obstacles[name].present]
        require(not left, f"a request for {', '.join(left)} is left open")
        if self.met and self.met[0] < self.turn:
            _, robot, obstacle = self.met
            asks = (robot.name, obstacle.name) in open_ or obstacle.sealed is not None
            said = f"{robot.name} met {obstacle.name}, and no request of it is on the stack"
            require(asks or not obstacle.present, said)

    def _check_motion(self, robot: Robot, record: Json) -> Pose:
        """The rules of the world for one move. Returns the pose in which its step ends; until
        then the robot keeps its heading."""
        name, before, to, toward = robot.name, robot.pose, record["to"], record.get("toward")
        goal, here = to if toward is None else toward, to if toward is None else before[0]
        bound = robot.destination[0] if robot.moves_on else goal
        same = (record["from"], to, goal) == (before[0], here, bound)
        require(same, f"{name} is not there, or leaves the step that it is in")
        moves = self.world.moves(robot.data["mobility"], before)
        after = next((pose for pose in moves if pose[0] == goal), (None, None))
        facing = record.get("heading") == (after if toward is None else before)[1]
        said = f"{name} cannot go from {before} to {goal}, facing {record.get('heading')}"
        require(after[0] is not None and facing, said)
        for obstacle in self.obstacles.values():
            enters = obstacle.region == goal != before[0] and obstacle.stands(name)
            require(not enters, f"{name} enters {goal}, where {obstacle.name} stands")
        self._check_apart(robot, {to, goal})
        return after

    def _check_decision(self, robot: Robot, record: Json, after: Pose) -> set[int] | None:
        """The move is the strategy's answer, or what the trace says that it is instead. Returns
        the nodes in which the robot may be after it; None: in any node of its pose."""
        task, by = robot.task, record.get("by") or ("backtrack" if robot.back else "strategy")
        robot.signal = record.get("signal") or robot.signal
        answers = self._answers(robot, record.get("busy") or ())
        robot.silent = not answers
        require(robot.active or by == "stay", f"{robot.name} goes on, though it is out of service")
        if by == "plan":
            require(robot.way[:2] == [robot.pose, after], f"{robot.name} leaves its plan")
            follows = task is None or task.follows(robot.own, robot.pose, after)
            require(follows, f"the plan leads {robot.name} where its objective forbids")
            return None
        require(by != "backtrack" or robot.back, f"no obstacle is before {robot.name}")
        node = (robot.back or {}).get("node") if by == "backtrack" else None
        stays = node is None and by in ("stay", "backtrack")
        require(not stays or after == robot.pose, f"{robot.name} moves, though it should stay")
        if task is None or (by == "stay" and not answers):
            require(stays, f"{robot.name} has no strategy")
            return None
        fits = {n for n in answers if task.poses[n] == after}
        if stays:  # it may have been told to wait, or remember this look
            looked = {f"at_{other}": robot.knowledge[other] for other in task.tracked}
            there = task.of_pose.get(after, ()) if looked else ()
            kept = {n for n in there if looked.items() <= task.values[n].items()}
            return robot.may_be() | kept | (fits if by == "backtrack" else set())
        if node is not None:
            follows = {n for before in robot.may_be() for n in task.graph.next[before]}
            fits = {n for n in follows & {node} if task.poses[n] == after}
        said = f"{robot.name} goes to {after}, but its strategy answers"
        require(fits, f"{said} {[task.poses[n] for n in answers]}")
        self.answers += node is None
        return fits

    def _answers(self, robot: Robot, shown: Iterable[int]) -> set[int]:
        """The nodes that answer what a robot observes now. ``shown``: regions that it is shown as
        taken although nobody is there."""
        task, here, seen = robot.task, robot.pose[0], dict[str, int]()
        if task is None:
            return set()
        if task.places is not None:
            seen = {key: int(robot.signal[key]) for key in base.TOLD}
        if task.nearby:
            taken = set(shown).union(*(self.robots[name].places for name in task.moving))
            for side in self.world.sides if task.moving else ():
                seen[f"busy_{side}"] = int(self.world.step(here, side) in taken)
        for name in task.tracked:
            there, known = self.robots[name].pose[0], robot.knowledge
            if not task.sees(here, there):
                found = task.after(name, here, known[name])
                hidden = {value for value in found if there in task.whereabouts(name, value)}
                require(hidden or self.external, f"{name} is where nobody could believe it to be")
                there = max(hidden or found)
            seen[f"at_{name}"] = known[name] = there
        row, graph = tuple(seen[name] for name in task.inputs), task.graph
        follow = chain(*(graph.next[node] for node in robot.may_be()))
        return {node for node in follow if graph.inputs[node] == row}

    def on_service(self, record: Json, robot: Robot, _: Any) -> None:
        """A robot is to stand still, or is back and goes on from where it is."""
        active: bool = record["active"]
        require({robot.active, active} == {True, False}, f"{robot.name} serves as it was before")
        robot.active = active
        if active and not robot.moves_on and not robot.way:
            robot.nodes = None

    def on_assumption(self, record: Json, robot: Robot, _: Any) -> None:
        """The others broke what a robot relies on: it has no answer any more."""
        require(robot.silent, f"the strategy of {robot.name} has an answer: no assumption failed")
        robot.nodes = set()
        self.claim("broken", tick=self.tick, robot=robot.name, name=record["name"])

    # joint plans

    def on_plan(self, record: Json, *_: Any) -> None:
        for name, robot in self.robots.items():
            robot.way = [(region, heading) for region, heading in record["robots"].get(name, ())]
            begins = robot.way[:1] in ([], [robot.destination])
            require(begins, f"{name} is not where the plan begins")

    def on_plan_end(self, record: Json, *_: Any) -> None:
        for name, robot in self.robots.items():
            node, robot.way = (record.get("nodes") or {}).get(name), []
            if node is not None and robot.task is not None and not robot.moves_on:
                there = robot.task.graph.first[node] in robot.task.of_pose.get(robot.pose, ())
                require(there, f"{name} goes on in node {node}, but is not in it")
                robot.nodes = {node}

    # objectives and the outcome

    def on_objective(self, record: Json, robot: Robot, _: Any) -> None:
        """A robot is given another objective of its own while the run goes on."""
        objective = record["objective"]
        robot.objective = objective if robot.on_its_own else robot.objective
        robot.own, robot.progress, robot.goals = objective, Progress(goals_of(objective)), []
        said = base.in_words(objective)
        self.claim("changed", tick=self.tick, robot=robot.name, objective=said)

    def _may_do(self, robot: Robot, objective: Json) -> bool:
        """Whether a robot may do this: its own objective, or, while requests are open, go where a
        need of an obstacle is met, wait, keep formulas."""
        wanted = [need.regions for obstacle in self.met_obstacles() for need in obstacle.needs]
        serves = any(aim and aim <= there for aim in base.targets_of(objective) for there in wanted)
        open_ = bool(self.stack) and ("visit" not in objective or serves)
        return open_ or base.same_objective(objective, robot.own)

    def on_push(self, record: Json, _: Any, obstacle: Obstacle | None) -> None:
        known = record["obstacle"] is None or (obstacle is not None and obstacle.known)
        require(known and record["requester"] in self.robots, "nobody has met what it is about")
        need, asked = obstacle and obstacle.stage.need, record.get("helpers") or [record["helper"]]
        unable = {*asked} - {None, *(need.able if need else self.robots)}
        said = f"to help with {record['obstacle']}, but cannot meet its next need"
        require(not unable, f"{', '.join(unable)} is {said}")
        self.stack.append({key: record.get(key) for key in ASKED})
        self._put_in_force(record)

    def on_pop(self, record: Json, *_: Any) -> None:
        entry = {key: record.get(key) for key in ASKED}
        require(entry in self.stack, "what is dropped from the stack is not on it")
        self.stack.remove(entry)
        self._put_in_force(record)

    def _put_in_force(self, record: Json) -> None:
        require(record["depth"] == len(self.stack), f"the stack has {len(self.stack)} entries")
        for name, objective in record["objectives"].items():
            self.on_told({"objective": objective}, self.robots[name])

    def on_told(self, record: Json, robot: Robot, _: Any = None) -> None:
        """What a robot does from now on."""
        objective = record["objective"]
        serves = self._may_do(robot, objective) or (self.stack and objective == robot.objective)
        said = f"{robot.name} is given what serves no request: {base.in_words(objective)}"
        require(serves, said)
        robot.objective = objective

    def on_goal(self, record: Json, robot: Robot, _: Any) -> None:
        """A robot meets a goal of its own; nothing is claimed of what it meets while it helps."""
        goal, targets, task = record["goal"], base.targets_of(robot.own), robot.task
        if not robot.on_its_own:
            return
        there = not targets or robot.pose[0] in targets[goal]
        if task is not None and task.kind == "ltl":
            first, after = task.graph.first, task.graph.next
            steps = [(a, b) for a in robot.came_from for b in robot.nodes or () if b in after[a]]
            edges = [task.graph.offset[first[a]] + after[a].index(b) for a, b in steps]
            there = not edges or "1" in {task.recurring[goal][edge] for edge in edges}
        require(there, f"{robot.name} is not at its goal {goal}")
        if "hold" not in robot.own or not robot.goals:
            robot.meet(goal)

    def on_outcome(self, record: Json, *_: Any) -> None:
        what = record["outcome"]
        require(record is self.bundle.trace[-1], "a line follows the outcome")
        ran = -(-self.turn // len(self.robots))  # it may end before anybody moves in its last tick
        require(record["ticks"] == ran, f"the run took {ran} ticks, not {record['ticks']}")
        if what == "completed":
            rounds = self.scenario["until"].get("rounds") or 0
            for name, robot in self.robots.items():
                met = min(robot.goals.count(goal) for goal in goals_of(robot.own))
                require(met >= rounds and robot.on_its_own, f"{name} has met it {met} times")
            self.claim("outcome:completed", rounds=rounds)
        elif what == "tick_limit":
            most = self.scenario["limits"].get("ticks")
            require(self.tick == most, f"the limit is {most} ticks, not {self.tick}")
            self.claim("outcome:tick_limit", ticks=most)
        elif what == "unrealizable" and self.hopeless and not self.turn:
            self.claim("outcome:unrealizable")
        elif what == "operator_needed":
            self._check_negative(record)
        else:
            self.claim("outcome:ended", what=what)

    def _check_negative(self, record: Json) -> None:
        """The team cannot complete the mission. What the trace's proof says is not believed; it
        only tells whom to consider in a deadlock, and how many rounds."""
        proof, specs = record.get("proof"), record.get("unrealizable") or {}
        if proof is None:
            shown = specs and specs.items() <= self.hopeless
            require(shown, "the outcome is a negative without a proof")
            self.claim("outcome:no strategy", who=" and ".join(specs))
        elif record.get("cause") == "deadlock":
            rounds = min(proof["goal"]["rounds"], self.scenario["until"]["rounds"])
            self.claim("outcome:deadlock", count=Team(self, proof["robots"]).exhaust(rounds))
        else:
            out = sorted(name for name, robot in self.robots.items() if not robot.active)
            team = Team(self, self.robots, out)
            never = team.never(team.start, team.stages)
            require(SOMEBODY in never, "everybody can go on, whatever can never be resolved")
            said = f" while {' and '.join(out)} stands still, out of service" if out else ""
            if any(obstacle.barred for obstacle in self.obstacles.values()):
                said += " (robots without a strategy for it do not serve an obstacle)"
            stuck = " and ".join(sorted(never & {*self.robots})) or "always somebody"
            self.claim("outcome:stuck", who=stuck, also=said)


# ---------------------------------------------------------------- the bundle


class Bundle:
    """The files of a bundle, each as its manifest says."""

    def __init__(self, place: Path) -> None:
        self.read: Callable[[str], bytes]
        if place.is_dir():
            found = {p.relative_to(place).as_posix() for p in place.rglob("*") if p.is_file()}
            self.read = lambda path: (place / path).read_bytes()
        else:
            archive = zipfile.ZipFile(place)
            found = {name for name in archive.namelist() if not name.endswith("/")}
            self.read = archive.read
        manifest = self.json("manifest.json")
        known = (manifest["format"], manifest["version"]) == ("safenav-bundle", 3)
        said = "is not of format safenav-bundle, version 3; an older bundle has its own check.py"
        require(known, f"manifest.json {said}")
        self.files, self.claims = manifest["files"], manifest["claims"]
        different = sorted(found ^ {*self.files, "manifest.json"})
        require(not different, f"{', '.join(different)} is either missing or not in the manifest")
        for path, facts in self.files.items():
            data, (folder, _, name) = self.read(path), path.rpartition("/")
            digest = hashlib.sha256(data).hexdigest()
            same = (len(data), digest) == (facts["bytes"], facts["sha256"])
            require(same, f"{path} is not the file that the manifest names")
            named = folder not in ("specs", "strategies") or digest == name.partition(".")[0]
            require(named, f"{path} is not named by its sha256")
        self.header, *self.trace = map(json.loads, self.text("trace.jsonl").splitlines())
        same = self.header["type"] == "header"
        same = same and self.header["scenario"] == self.json("scenario.json")
        require(same, "scenario.json is not what the header of the trace says")
        self._compare_source(self.header["scenario"]["map"])

    def text(self, path: str) -> str:
        return self.read(path).decode()

    def json(self, path: str) -> Any:
        return json.loads(self.read(path))

    def _compare_source(self, world: Json) -> None:
        """A map that is drawn in the YAML file is the map of the scenario."""
        for path in self.files:
            if path.startswith("source/") and path.endswith((".yaml", ".yml")):
                parts = re.split(r"[\[\]{},:\n]", self.text(path))
                rows = [part.strip().strip("'\"- ") for part in parts]
                drawn = [row for row in rows if row and {*row} <= {*"#."}]
                drawn = [row for row in drawn if len(row) > 1 or world["cols"] == 1]
                same = drawn == world["grid"] or {*"#."} not in map(set, drawn)
                require(same, f"the map in {path} is not that of scenario.json")


def circumstances(record: Json) -> str:
    """A name for what a strategy was made for and where it begins."""
    passing = ("tick", "reason", "seconds", "cached")
    told = {key: value for key, value in record.items() if key not in passing}
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()


def check(place: Path, *, compare: bool = True) -> tuple[str, str, list[Claim]]:
    """``accepted``, ``refused`` or ``too large``; the first reason; and what is established (of a
    bundle that is refused: until then). ``compare``: the manifest has to claim just that."""
    run = None
    try:
        run = Run(Bundle(place))
        run.replay()
        said = [(c["id"], c["kind"], c["text"]) for c in run.bundle.claims]
        same = not compare or said == [(c.id, c.kind, c.text) for c in run.claims]
        require(same, "the manifest does not claim what the evidence establishes")
        return "accepted", "", run.claims
    except base.TooLargeError as error:
        return "too large", str(error), run.claims if run else []
    except RefusedError as error:
        reason = str(error)
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, OSError) as error:
        reason = f"a file is not as documented: {error!r}"
    except RecursionError:
        reason = "a file is nested too deeply"
    where = f"trace.jsonl, line {run.line}: " if run and run.line else ""
    return "refused", where + reason, run.claims if run else []


def main() -> int:
    parser = argparse.ArgumentParser(description="Check a bundle of safenav.")
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--json", action="store_true", help="print what is established as JSON")
    parser.add_argument("--any-claims", action="store_true", help="whatever the manifest claims")
    options = parser.parse_args()
    if not (options.bundle / "manifest.json").is_file() and not zipfile.is_zipfile(options.bundle):
        print(f"{options.bundle} is no bundle: a folder with a manifest.json, or a .zip of one")
        return 2
    verdict, reason, claims = check(options.bundle, compare=not options.any_claims)
    said = {"verdict": verdict, "reason": reason, "claims": [c._asdict() for c in claims]}
    lines = [f"  {c.id}: {c.text}" for c in claims] + [f"{verdict}{': ' * bool(reason)}{reason}"]
    print(json.dumps(said) if options.json else "\n".join(lines))
    return {"accepted": 0, "refused": 1, "too large": 3}[verdict]


if __name__ == "__main__":
    sys.exit(main())
