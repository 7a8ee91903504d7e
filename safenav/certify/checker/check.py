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
  or it stays, steps back from an obstacle, or follows a joint plan in its order (``Run``);
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
from copy import copy
from dataclasses import asdict, dataclass, field
from importlib import import_module
from itertools import chain, combinations, product, repeat
from math import prod
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    sys.dont_write_bytecode = True  # a bundle stays as it is
    sys.path.insert(0, str(Path(__file__).resolve().parent))
elif __package__:  # the maker of bundles has these two files in a package
    sys.modules["check_strategies"] = import_module(f"{__package__}.check_strategies")

from check_strategies import (
    TOLD,
    Clause,
    Json,
    Pose,
    RefusedError,
    Strategy,
    Task,
    TooLargeError,
    World,
    check_beaten,
    check_counterstrategy,
    check_measure,
    check_strategy,
    complete,
    coordinates,
    formulas_of,
    in_words,
    is_ordered,
    poses_of,
    read_specification,
    read_variable,
    require,
    same_objective,
    targets_of,
)

MOST_STATES = 200_000
MOST_MEMORY = 64
Stage = tuple[int, frozenset[str]]  # which need of an obstacle is next, and who has met part of it

# ---------------------------------------------------------------- what the team can never do


def worked(needs: Sequence[Json], stage: Stage, here: set[str] | frozenset[str]) -> Stage:
    """The stage of an obstacle after these robots have acted on its next need."""
    number, done = stage
    need, group = needs[number], done | here
    if len(group) >= need["robots"]:
        return number + 1, frozenset()
    return number, frozenset() if need["together"] else group


Stages = tuple[Stage, ...]
Option = tuple[str, int, tuple[str, ...]]  # an obstacle, the number of its need, those who meet it


class Team:
    """What the team can still do at a moment of the run. Obstacles that it does not know are
    taken to be absent. ``refute`` lets robots pass through each other, ``exhaust`` does not.
    ``out``: robots out of service, which stand still and want nothing else."""

    def __init__(self, run: Run, out: Collection[str] = ()) -> None:
        self.run, self.world, self.data, self.names = run, run.world, run.data, list(run.data)
        self.start = tuple(robot.destination for robot in run.robots.values())
        self.open = sorted(o for o in run.known & run.present if o not in run.sealed)
        self.given_up = {o for o, (_, why) in run.sealed.items() if why != "untraversable"}
        self.stages: Stages = tuple(run.stages[obstacle] for obstacle in self.open)
        self.shut: dict[str, set[int]] = {}
        self.aims: dict[str, list[frozenset[Pose]]] = {}
        self.allowed: dict[str, set[tuple[Pose, Pose]]] = {}  # by the formulas of an objective
        self._steps: dict[Any, list[Pose]] = {}
        for name, data in run.data.items():
            sealed = run.sealed.items()
            self.shut[name] = {run.obstacles[o]["region"] for o, (who, _) in sealed if name in who}
            places = [[(r, None) for r in aim] for aim in targets_of(data["objective"])]
            self.aims[name] = [poses_of(aim, data["mobility"]) for aim in places]
            if "ltl" in data["objective"]:
                self._read_formulas(name)
            if name in out:
                self.allowed[name] = set()
                self.aims[name] = [frozenset({run.robots[name].destination})]

    def _read_formulas(self, name: str) -> None:
        """Of an objective in formulas: the poses in which each goal may be met, by staying or else
        by a step into them; and the steps that the safety lines allow. Both with some memory;
        lines about more than MOST_MEMORY values of it say nothing here."""
        own, mobility = self.data[name]["objective"], self.data[name]["mobility"]
        memory = own["ltl"].get("memory", {}).items()
        place = ["region", "heading"][: 1 + (mobility == "heading")]
        lines = [f"region:0...{self.world.size - 1}", "heading:0...3"][: len(place)]
        lines += [
            n if bounds == "bool" else "{}:{}...{}".format(n, *bounds) for n, bounds in memory
        ]
        variables = [read_variable(line) for line in lines]
        few = prod(v.most - v.least + 1 for v in variables[len(place) :]) <= MOST_MEMORY
        spec, keys = {v.name: v for v in variables}, [*place, *(f"{p}'" for p in place)]
        poses = poses_of(((region, None) for region in self.world.free), mobility)
        pairs = [(pose, after) for pose in poses for after in self.world.moves(mobility, pose)]
        rows = {(*coordinates(a), *coordinates(b)): (a, b) for a, b in pairs}

        def met(lines: Iterable[Clause]) -> set[tuple[Pose, Pose]]:
            clauses = [clause for clause in lines if few or clause.reads <= {*keys}]
            wanted = sorted(set().union(*(clause.reads for clause in clauses)) - {*keys})
            return {rows[row] for row, _ in complete(spec, wanted, clauses, keys, list(rows))}

        allowed = {(a, b) for a, b in met(formulas_of(own, "safety")) if a != b}
        self.allowed[name], self.aims[name] = allowed, []
        for goal in map(met, ([line] for line in formulas_of(own, "liveness"))):
            staying = {a for a, b in goal if a == b}
            entered = {b for a, b in goal & allowed if not {a, b} & staying}
            self.aims[name].append(frozenset(staying | entered))

    def need(self, k: int, stages: Stages) -> Json | None:
        """The need of an obstacle that is next; None if it is resolved."""
        needs = self.run.needs(self.open[k])
        return needs[stages[k][0]] if stages[k][0] < len(needs) else None

    def unmet(self, stages: Stages) -> set[str]:
        return {obstacle for k, obstacle in enumerate(self.open) if self.need(k, stages)}

    def steps(self, name: str, pose: Pose, stages: Stages) -> list[Pose]:
        """The poses after one step or none, while open obstacles are walls for whom they block."""
        key = (name, pose, stages)
        if key not in self._steps:
            pairs = zip(self.open, stages, strict=True)
            walls = [o for o, (stage, _) in pairs if self.run.blocks(o, name, stage)]
            shut = self.shut[name] | {self.run.obstacles[o]["region"] for o in walls}
            moves = self.world.moves(self.data[name]["mobility"], pose)
            allowed = self.allowed.get(name, {(pose, after) for after in moves})
            moves = {after for after in moves if after == pose or (pose, after) in allowed}
            self._steps[key] = [after for after in moves if after[0] not in shut]
        return self._steps[key]

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
        alive, before = self.reach(name, poses, stages), set[Pose]()
        while alive != before:
            before = set(alive)
            for aim in self.aims[name]:
                found = fresh = alive & aim
                while fresh:
                    rest = alive - found
                    fresh = {p for p in rest if fresh & {*self.steps(name, p, stages)}}
                    found = found | fresh
                alive = found
        return bool(alive)

    def stuck(self, sets: Mapping[str, set[Pose]], stages: Stages) -> set[str]:
        return {n for n, poses in sets.items() if not self.can_go_on(n, poses, stages)}

    def able(self, k: int, sets: Mapping[str, set[Pose]], stages: Stages) -> dict[str, set[Pose]]:
        """The robots that can get to where an obstacle's next need is met, and in which poses."""
        need = self.need(k, stages)
        found: dict[str, set[Pose]] = {}
        for name, poses in sets.items():
            out = (name, self.open[k]) in self.run.barred or name in stages[k][1]
            if need and not out and need["action"] in self.data[name]["capabilities"]:
                there = {p for p in self.reach(name, poses, stages) if p[0] in need["regions"]}
                found |= {name: there} if there else {}
        return found

    def advanced(self, k: int, stages: Stages) -> Stages:
        return (*stages[:k], (stages[k][0] + 1, frozenset()), *stages[k + 1 :])

    def never(self, proof: Json) -> set[str]:
        """Refuse unless the proof is true now. Returns the obstacles that are never resolved, and
        the robots that can never go on."""
        start = {n: {pose} for n, pose in zip(self.names, self.start, strict=True)}
        return self.refute(proof, start, self.stages)

    def refute(self, proof: Json, sets: Mapping[str, set[Pose]], stages: Stages) -> set[str]:
        """The same when robots choose to be in ``sets``, at some stages. A ``closure``: all is
        resolved that ever can be. A ``tree``: whatever is done next, a proof follows."""
        if proof["kind"] == "closure":
            return self._closure(proof, sets, stages)
        require(self.stuck(sets, stages), "everybody can go on as it is")
        options, listed = dict(self._options(sets, stages)), set[Option]()
        for choice in proof["choices"]:
            option = choice["option"]
            key = (option["obstacle"], option["need"], tuple(option["robots"]))
            there = key in options and (options[key][2] or not option["lossless"])
            require(there, f"the proof lists {key}, which is no choice here")
            listed |= set(options) if option["lossless"] else {key}
            gone = self.refute(choice["proof"], *options[key][:2]) & {*self.names}
            require(gone, f"after {key} everybody can go on")
        complete = listed and listed == set(options)
        require(complete, "the proof does not list all choices")
        return set(self.names)

    def _options(
        self, sets: Mapping[str, set[Pose]], stages: Stages
    ) -> Iterator[tuple[Option, Any]]:
        """What can be done next: who meets which need; where everybody is after it, the stages
        then, and whether all of them get back to all that they could get to."""
        for k, obstacle in enumerate(self.open):
            able, need = self.able(k, sets, stages), self.need(k, stages)
            size = max(1, need["robots"] - len(stages[k][1])) if need else 1
            for group in combinations(able, size):
                crowd = [n for n in group if {*self.data[n].get("conflicts", ())} & {*group}]
                ways = product(*({pose[0] for pose in able[name]} for name in crowd))
                if need and need["together"] and not any(len({*way}) == len(way) for way in ways):
                    continue  # they cannot all stand there at once
                after = {n: able[n] if n in group else poses for n, poses in sets.items()}
                lossless = all(
                    self.reach(n, sets[n], stages) <= self.reach(n, after[n], stages) for n in group
                )
                key = (obstacle, stages[k][0], group)
                yield key, (after, self.advanced(k, stages), lossless)

    def _closure(self, proof: Json, sets: Mapping[str, set[Pose]], stages: Stages) -> set[str]:
        given, before = stages, None
        while stages != before:
            before = stages
            for k in range(len(self.open)):
                need = self.need(k, stages)
                missing = need["robots"] - len(stages[k][1]) if need else 0
                if 0 < missing <= len(self.able(k, sets, stages)):
                    stages = self.advanced(k, stages)
        never, stuck = self.unmet(stages) | self.given_up, self.stuck(sets, stages)
        resolved = self.unmet(given) - never
        same = (set(proof["resolved"]), set(proof["never"])) == (resolved, never)
        require(same, f"the closure never resolves {sorted(never)}, unlike the proof")
        table = {}
        for name, poses in sets.items():
            reach = sorted(self.reach(name, poses, stages), key=lambda p: (p[0], p[1] or ""))
            table[name] = {"poses": [[*pose] for pose in reach], "live": name not in stuck}
        same = proof["robots"] == table
        require(same, "the closure of what the team can do is not that of the proof")
        return never | stuck

    def exhaust(self, proof: Json) -> int:
        """Refuse unless no order of moves completes the mission. Returns the number of joint
        states, each robot's step being one transition. Of a few robots of the team the rest, and
        all that may yet be resolved, only stands in their way."""
        open_ = {*proof["stages"]} - self.given_up
        if {*proof["robots"]} < {*self.names} and proof["robots"] and not open_:
            few = copy(self)
            few.names = [name for name in self.names if name in proof["robots"]]
            few.start = tuple(self.run.robots[name].destination for name in few.names)
            few.open, few.stages, few._steps = [], (), {}
            return few.exhaust(proof)
        rounds, total = proof["goal"]["rounds"], self.run.scenario["until"]["rounds"]
        stages = {o: need for o, (need, _) in zip(self.open, self.stages, strict=True)}
        start = {name: [*pose] for name, pose in zip(self.names, self.start, strict=True)}
        given = {o: need for o, need in proof["stages"].items() if o not in self.given_up}
        now = proof["start"] == start and given == stages and rounds <= total
        require(now, "the proof of a deadlock is about another moment")
        counts = tuple(self.run.robots[name].progress(self._number(name)) for name in self.names)
        first = self._settled(self.start, counts, self.stages, rounds)
        seen, queue = {first}, [first]
        for poses, done, stage in queue:
            ended = self._completed(poses, done, stage, rounds)
            require(not ended, "the mission can be completed from here")
            for k, name in enumerate(self.names):
                rivals = self.data[name].get("conflicts", ())
                here = [self.names.index(other) for other in rivals if other in self.names]
                taken = {poses[i][0] for i in here}
                for pose in self.steps(name, poses[k], stage):
                    moved = (*poses[:k], pose, *poses[k + 1 :])
                    if pose[0] not in taken:
                        after = self._settled(moved, done, stage, rounds)
                        queue += [] if after in seen else [after]
                        seen.add(after)
            if len(seen) > MOST_STATES:
                raise TooLargeError(f"more than {MOST_STATES} joint states; not certified")
        told = {json.dumps([[*p] for p in poses], separators=(",", ":")) for poses, _, _ in seen}
        text = "".join(f"{line}\n" for line in sorted(told)).encode()
        same = (len(told), hashlib.sha256(text).hexdigest()) == (proof["states"], proof["sha256"])
        require(same, f"there are {len(told)} joint places, and not those of the proof")
        return len(told)

    def _number(self, name: str) -> int:
        return len(self.aims[name])

    def _is_done(self, name: str, count: Progress, rounds: int) -> bool:
        objective = self.data[name]["objective"]
        enough = min(1, rounds) if "hold" in objective else rounds
        return count[2] >= enough * (self._number(name) if is_ordered(objective) else 1)

    def _completed(self, poses: Any, counts: Any, stages: Stages, rounds: int) -> bool:
        done = map(self._is_done, self.names, counts, repeat(rounds))
        there = zip(self.names, poses, strict=True)
        return all(done) and all(self.can_go_on(n, [pose], stages) for n, pose in there)

    def _settled(self, poses: Any, counts: Any, stages: Stages, rounds: int) -> Any:
        """The joint state after everybody has acted where it stands, and what is met is counted."""
        before, given = None, stages
        while stages != before:
            before = stages
            for k, obstacle in enumerate(self.open):
                if need := self.need(k, stages):
                    pairs = zip(self.names, poses, strict=True)
                    here = {n for n, pose in pairs if self.run.serves(n, need, pose)}
                    here -= {name for name in here if (name, obstacle) in self.run.barred}
                    stage = worked(self.run.needs(obstacle), stages[k], here)
                    stages = (*stages[:k], stage, *stages[k + 1 :])
        if self.unmet(stages) != self.unmet(given):
            counts = tuple((index, frozenset(), 0) for index, _, _ in counts)
        return poses, tuple(map(self._counted, self.names, poses, counts, repeat(rounds))), stages

    def _counted(self, name: str, pose: Pose, count: Progress, rounds: int) -> Progress:
        """What a robot has met after it has come to a pose, until it has met enough."""
        aims, (index, seen, met) = self.aims[name], count
        ordered = is_ordered(self.data[name]["objective"])
        while not self._is_done(name, (index, seen, met), rounds):
            fresh = {k for k, aim in enumerate(aims) if pose in aim} - seen
            if not (index in fresh if ordered else fresh):
                break
            if ordered:
                index, met = (index + 1) % len(aims), met + 1
            else:
                seen = seen | fresh
                seen, met = (frozenset(), met + 1) if len(seen) == len(aims) else (seen, met)
        return index, seen, met


# ---------------------------------------------------------------- strategy -> moves


@dataclass
class Claim:
    """Something that the checker has established, and the files and lines that show it."""

    id: str
    kind: str
    text: str
    evidence: list[tuple[str, int | None]]


# How far a robot is: whose turn it is, what it has met in this round, and how many targets (where
# they have an order) or rounds (where they have none) are met.
Progress = tuple[int, frozenset[int], int]


@dataclass
class Robot:
    """One robot at some line of the trace."""

    pose: Pose
    objective: Json
    destination: Pose  # where it is, or where its step ends
    toward: int | None = None  # the region that it is on its way to, and takes up, too
    task: Task | None = None
    nodes: set[int] | None = None  # where it may be in its strategy; None: in any node of its pose
    after: set[int] | None = None  # the same at the end of a step under way
    came_from: set[int] = field(default_factory=set)  # the nodes before its last step
    knowledge: dict[str, int] = field(default_factory=dict)
    signal: Json = field(default_factory=dict)
    refused: int | None = None  # where an obstacle stands that it was about to enter in this turn
    back: Json | None = None  # its ``backtrack`` line in this turn
    silent: bool = False  # whether its strategy had no answer in its last turn
    active: bool = True  # whether it is in service
    goals: list[int] = field(default_factory=list)  # those met since the last resolution
    awaited: int = 0  # the target of its own objective whose turn it is
    held: int = -1  # the last turn that counts for what it holds

    @property
    def places(self) -> set[int]:
        return {self.pose[0]} if self.toward is None else {self.pose[0], self.toward}

    def may_be(self) -> set[int]:
        """The nodes in which it may be: one, or after a joint plan all of its pose, for from each
        of them the strategy keeps what it promises."""
        known: Mapping[Pose, set[int]] = self.task.of_pose if self.task is not None else {}
        return known.get(self.pose, set()) if self.nodes is None else self.nodes

    def progress(self, number: int) -> Progress:
        if is_ordered(self.objective):
            return self.awaited, frozenset(), len(self.goals)
        rounds = len(self.goals) // (number or 1)
        return 0, frozenset(self.goals[rounds * number :]), rounds


class Run:
    """The trace, line by line, against the strategies, the map and the obstacles."""

    def __init__(self, bundle: Bundle) -> None:
        self.bundle, self.scenario = bundle, bundle.header["scenario"]
        self.external = self.scenario.get("world") == "external"
        self.world = World(self.scenario["map"])
        self.data: dict[str, Json] = dict(self.scenario["robots"])  # in the order of their turns
        self.robots = {
            name: Robot(pose := (data["start"], data.get("heading")), data["objective"], pose)
            for name, data in self.data.items()
        }
        self.obstacles: dict[str, Json] = {}
        self.stages: dict[str, Stage] = {}
        self.present: set[str] = set()
        self.known: set[str] = set()
        self.sealed: dict[str, tuple[set[str], str]] = {}  # for whom an obstacle stays, and why
        self.untraversable: set[str] = set()
        self.barred: set[tuple[str, str]] = set()  # robots with no strategy to serve an obstacle
        self.stack: list[Json] = []
        self.plan: dict[str, list[Pose]] = {}
        self.taken: dict[str, int] = {}  # how many steps of the plan a robot has taken
        self.orders: list[Any] = []
        self.refuted: Any = None  # the tick and turn of the last proof, the proof, and who never
        self.told: Any = None  # the tick and turn of the last line about the stack
        self.met: Any = None  # the turn in which an obstacle was last met, who met it, and which
        self.claims: list[Claim] = []
        self.moves = self.answers = self.tick = self.turn = self.line = self.strayed = 0
        self.outcome: Json | None = None
        self._realized: dict[tuple[str, str], tuple[Strategy, list[int]]] = {}
        self._kept: dict[str, Task] = {}
        self._beaten: set[str] = set()
        for obstacle in self.scenario["obstacles"]:
            self._stands_from_now(obstacle, known=not obstacle.get("from"))
        self._check_scenario()

    def _check_scenario(self) -> None:
        for name, data in self.data.items():
            turning = data["mobility"] == "heading"
            fits = data["mobility"] in ("free", "heading") and turning == bool(data.get("heading"))
            require(fits, f"{name} has no known mobility, or no heading for it")
            for other in data.get("conflicts", ()):
                mutual = other != name and name in self.data[other].get("conflicts", ())
                require(mutual, f"{name} must avoid {other}, but not the other way round")
                apart = self.data[other]["start"] != data["start"]
                require(apart, f"{name} and {other} start in one region")
            free = {data["start"]}.union(*targets_of(data["objective"])) <= self.world.free
            require(free, f"{name} starts in a wall, or has a target in one")

    def replay(self) -> None:
        """Refuse unless all lines are true; ``claims`` is what is established."""
        for line, record in enumerate(self.bundle.trace, 2):
            self.line = line
            require(self.outcome is None, "a line follows the outcome")
            if record["tick"] != self.tick:
                whole = record["tick"] == self.tick + 1 and not self.turn % len(self.robots)
                require(whole, "a tick is left out, or a robot has not moved in it")
                self.tick += 1
            getattr(self, "_" + record["type"], lambda _: None)(record)
        self.line = 0
        self._check_names_of_motion()
        count = f"All {self.moves} moves"
        if self.strayed:
            count = f"Of {self.moves} moves all but {self.strayed}, which went elsewhere than told,"
        what = f"{count} are legal: {self.answers} are the answers of these strategies to what the "
        what += "robots could observe, the others stay, step back or follow a joint plan. No wall, "
        what += "no standing obstacle, no collision."
        self.claim("moves", what, [("trace.jsonl", None)])

    def claim(self, kind: str, text: str, evidence: Any = None) -> None:
        found = evidence or [("trace.jsonl", self.line)]
        self.claims.append(Claim(f"{kind}-{len(self.claims) + 1}", kind, text, found))

    def _check_names_of_motion(self) -> None:
        """The run in metres, if it is there, names this trace. It is not checked any further."""
        if self.bundle.has("motion.jsonl"):
            header = json.loads(self.bundle.text("motion.jsonl").splitlines()[0])
            named = header["trace"] == self.bundle.files["trace.jsonl"]["sha256"]
            require(named, "motion.jsonl is the motion of another trace")
            what = "motion.jsonl says that it is the motion of this trace (by its sha256)"
            note = "`safenav check-motion` checks what is in it, this program does not"
            self.claim("motion", f"{what}; {note}.", [("motion.jsonl", None)])

    # synthesis

    def _synthesis(self, record: Json) -> None:
        name, spec, strategy = record["robot"], record["spec"], str(record.get("strategy") or "")
        said = f"{name}, tick {self.tick}, for '{in_words(record['objective'])}'"
        files = [("trace.jsonl", self.line), (f"specs/{spec}.structuredslugs", None)]
        for tried in record.get("tried") or ():
            self._check_weaker(name, tried)
        proof, path = f"counterstrategies/{spec}.json", f"rules/{circumstances(record)}.json"
        if record["verdict"] == "unrealizable" and self.bundle.has(proof):
            task = self._task(record, self._beat(spec))
            self._check_circumstances(record, task)
            there, wishes, assumptions = task.explore_counterstrategy(self.bundle.json(proof))
            check_beaten(task.graph, assumptions, wishes, there, self.bundle.json(path))
            files += [(proof, None), (path, None)]
            self.claim("unrealizable", f"No strategy exists for {said}.", files)
            for obstacle in self.known & self.present:
                if frozenset(self.next_need(obstacle)["regions"]) in task.targets:
                    self.barred.add((name, obstacle))
        if record["verdict"] != "realizable" or record.get("node") is None:
            return
        require(strategy, "its strategy was never listed: nothing is proven about its moves")
        measures = f"measures/{spec}-{strategy}.json"
        files += [(f"strategies/{strategy}.json", None), (measures, None)]
        if (spec, strategy) not in self._realized:
            text = read_specification(self.bundle.text(files[1][0]))
            graph = Strategy(self.bundle.json(files[2][0]), text)
            initial = check_strategy(text, graph, self.bundle.json(measures))
            self._realized[spec, strategy] = graph, initial
            size = f"{graph.count} nodes, {sum(map(len, graph.next))} edges"
            what = f"The strategy of {said} realizes the text of its specification: {size}."
            self.claim("realizes", what, files[1:])
        graph, initial = self._realized[spec, strategy]
        node = record["node"]
        require(node in initial, f"node {node} is not one with which the strategy may begin")
        task = self._kept.get(path) or self._task(record, graph)
        self._check_circumstances(record, task)
        if path not in self._kept:
            _, wishes, assumptions = task.explore_strategy(node)
            aims = list(zip(task.wishes, wishes, strict=True))
            for (wish, met), measure in zip(aims, self.bundle.json(path), strict=True):
                missed = f"it is not shown that no run misses {wish} for ever"
                check_measure(graph, missed, met, assumptions, measure)
            self._kept[path] = task
            assumed = {"none": "whatever the others do"}.get(record["fairness"], record["fairness"])
            what = (
                f"The strategy of {said} keeps the rules of the scenario and does what it is for "
            )
            self.claim("keeps", f"{what}again and again ({assumed}).", [*files, (path, None)])
        robot = self.robots[name]
        robot.task, robot.nodes, robot.after = task, {node}, None
        robot.knowledge = dict(task.knowledge)
        nothing = {"request": False, "assigned": record.get("neutral"), "wait": False}
        robot.signal = robot.signal or nothing  # told when it changes
        if same_objective(task.objective, self.data[name]["objective"]):
            robot.awaited = next(iter(task.memory.values()), 0)

    def _task(self, record: Json, graph: Strategy) -> Task:
        cells = self.scenario.get("partition")
        return Task(self.world, self.data[record["robot"]], record, cells, graph)

    def _beat(self, spec: str) -> Strategy:
        """The counterstrategy that beats every robot within a specification."""
        document = self.bundle.json(f"counterstrategies/{spec}.json")
        text = read_specification(self.bundle.text(f"specs/{spec}.structuredslugs"))
        graph = Strategy(document["automaton"], text)
        if spec not in self._beaten:
            check_counterstrategy(text, graph, document)
        self._beaten.add(spec)
        return graph

    def _check_weaker(self, name: str, tried: Json) -> None:
        """What was tried before with weaker assumptions, or another form, had no strategy."""
        spec, line = tried["spec"], ("trace.jsonl", self.line)
        proof = f"counterstrategies/{spec}.json"
        if spec not in self._beaten and self.bundle.has(proof):
            self._beat(spec)
            files = [line, (f"specs/{spec}.structuredslugs", None), (proof, None)]
            what = f"{name}, tick {self.tick}: no strategy with fairness {tried['fairness']}"
            self.claim("weakest", f"{what}, which was tried before.", files)

    def _check_circumstances(self, record: Json, task: Task) -> None:
        """The circumstances for which a robot is synthesized are those of the run."""
        name, robot = record["robot"], self.robots[record["robot"]]
        same = task.pose == robot.destination
        require(same, f"{name} is at {robot.destination}, but synthesized for {task.pose}")
        tried = record["verdict"] == "unrealizable" and self.tick  # for an objective not in force
        own = same_objective(task.objective, self.data[name]["objective"])
        meant = own if task.places is not None else same_objective(task.objective, robot.objective)
        if not tried and not meant:  # with assignable goals it is always about its own
            free = self.stack and self.told != (self.tick, self.turn)  # a line of this turn holds
            free = free and self._may_do(name, task.objective)
            require(free, f"{name} is synthesized for another objective than is in force")
            robot.objective = task.objective
        closed = {why.removeprefix("obstacles."): r for r, why in record.get("closed") or ()}
        for other in self.data[name].get("conflicts", ()):
            parked = closed.get(f"robots.{other}") in self.robots[other].places
            require(other in task.moving or parked, f"{name} does not know of {other}")
        for why, region in closed.items():
            if why.startswith("robots."):
                stands = region in self.robots[why[7:]].places
            else:
                stands = why in self.known and self.stands(why, name)
                stands = stands and self.obstacles[why]["region"] == region
            require(stands, f"{name} takes {region} to be closed by {why}, which is not so")
        for obstacle, (robots, _) in self.sealed.items():
            require(name not in robots or obstacle in closed, f"{name} does not know of {obstacle}")
        for other, value in task.knowledge.items():
            where = set(task.whereabouts(other, value))
            if self.tick and record["tracking"] == "belief":  # it may have moved on since the look
                where = self.world.around(where)
            there = where & self.robots[other].places
            require(there, f"{name} believes {other} to be where it is not")

    def _may_do(self, name: str, objective: Json) -> bool:
        """Whether a robot may do this while requests are open: its own objective, go where a need
        of an obstacle is met, wait, keep formulas."""
        needs = chain(*(self.needs(obstacle) for obstacle in self.known & self.present))
        wanted = [frozenset(need["regions"]) for need in needs]
        own = same_objective(objective, self.data[name]["objective"])
        pairs = product(targets_of(objective), wanted)
        there = "visit" not in objective or any(frozenset() < aim <= want for aim, want in pairs)
        return own or (bool(self.stack) and there)

    # obstacles

    def _stands_from_now(self, data: Json, *, known: bool = True) -> None:
        """Keep an obstacle, with all its needs in one form, and whether it stands."""
        plain = {"action": data["action"], "regions": data["resolution_regions"]}
        needs = [{"robots": 1, "together": False, **n} for n in data.get("needs") or [plain]]
        self.obstacles[data["name"]] = {**data, "needs": needs}
        self.stages[data["name"]] = (0, frozenset())
        self.present |= {data["name"]} if known else set()

    def needs(self, obstacle: str) -> list[Json]:
        found: list[Json] = self.obstacles[obstacle]["needs"]
        return found

    def next_need(self, obstacle: str) -> Json:
        return self.needs(obstacle)[self.stages[obstacle][0]]

    def serves(self, name: str, need: Json, pose: Pose) -> bool:
        return need["action"] in self.data[name]["capabilities"] and pose[0] in need["regions"]

    def blocks(self, obstacle: str, name: str, stage: int) -> bool:
        """Whether an obstacle is in a robot's way while its needs from ``stage`` on are left."""
        left = {need["action"] for need in self.needs(obstacle)[stage:]}
        blocked = name in self.obstacles[obstacle]["blocks"]
        return blocked and not left <= {*self.data[name]["capabilities"]}

    def stands(self, obstacle: str, name: str) -> bool:
        """Whether an obstacle is in a robot's way now."""
        here = obstacle in self.present and self.blocks(obstacle, name, self.stages[obstacle][0])
        return here or name in self.sealed.get(obstacle, ((),))[0]

    def capable(self, obstacle: str, name: str) -> bool:
        """Whether a robot can do something about an obstacle."""
        actions = {need["action"] for need in self.needs(obstacle)}
        return bool(actions & {*self.data[name]["capabilities"]})

    def _discovered(self, record: Json) -> None:
        self._stands_from_now(record["obstacle"])

    def _appeared(self, record: Json) -> None:
        data = self.obstacles[record["obstacle"]]
        nobody = all(data["region"] not in robot.places for robot in self.robots.values())
        require(nobody, f"{data['name']} appears where a robot is")
        self._stands_from_now(data)

    def _truth(self, record: Json) -> None:
        told = {**self.obstacles[record["obstacle"]], "traversable": record["traversable"]}
        self.obstacles[record["obstacle"]] = told

    def _gone(self, record: Json) -> None:
        for kept in (self.present, self.known):
            kept.discard(record["obstacle"])
        self.sealed.pop(record["obstacle"], None)

    def _violation(self, record: Json) -> None:
        name, obstacle, at = record["robot"], record["obstacle"], record["proposed"]
        blocked = self.obstacles[obstacle]["region"] == at and self.stands(obstacle, name)
        require(blocked, f"{obstacle} does not block {name} at {at}")
        self.robots[name].refused = at
        self.met = self.turn, name, obstacle
        self.known.add(obstacle)

    def _perform(self, name: str) -> None:
        """A robot does what it can where it stands, whether or not it was asked."""
        for obstacle in self.present - self._finished():
            before, needs = None, self.needs(obstacle)
            while before != self.stages[obstacle] and self.stages[obstacle][0] < len(needs):
                before, need = self.stages[obstacle], self.next_need(obstacle)
                there = {n for n, r in self.robots.items() if self.serves(n, need, r.pose)}
                group = (there if need["together"] else {name}) if name in there else set()
                self.stages[obstacle] = worked(needs, before, group)

    def _finished(self) -> set[str]:
        """The obstacles that stand as far as lines say, but are resolved by what robots did."""
        return {o for o in self.present if self.stages[o][0] == len(self.needs(o))}

    def _resolved(self, record: Json) -> None:
        obstacle = record["obstacle"]
        done = obstacle in self.present and (self.external or obstacle in self._finished())
        require(done, f"{obstacle} does not stand, or not all that it needs was done")
        for name in record.get("robots") or [record["robot"]]:
            able = self.capable(obstacle, name)
            require(able, f"{name} can do nothing about {obstacle}")
        same = self.external or record["traversable"] == self.obstacles[obstacle]["traversable"]
        require(same, f"{obstacle} turns out to be something else than it is")
        self.present.discard(obstacle)
        self.known.discard(obstacle)
        self.untraversable |= {obstacle} if record["traversable"] is False else set()
        for robot in self.robots.values():
            robot.goals = [0] if robot.held == self.turn else []

    def _blocked(self, record: Json) -> None:
        """An obstacle stays for good: it is untraversable, or the team can never resolve it."""
        obstacle, proof, reason = record["obstacle"], record.get("proof"), record["reason"]
        if reason == "untraversable":
            found = obstacle in self.untraversable
            require(found, f"nobody has found {obstacle} untraversable")
        else:
            require(proof, f"{obstacle} is called unresolvable without a proof")
            moment = (self.tick, self.turn, proof)  # one proof serves several obstacles
            if self.refuted is None or self.refuted[0] != moment:
                self.refuted = moment, Team(self).never(proof or {})
            never = obstacle in self.refuted[1] and obstacle in self.refuted[0][2]["never"]
            require(never, f"{obstacle} can be resolved")
            what = "whatever the robots do, too few that can resolve it get there"
            self.claim("never", f"{obstacle} can never be resolved: {what}.")
        stage = 0 if reason == "untraversable" else self.stages[obstacle][0]
        blocked = {n for n in self.data if self.blocks(obstacle, n, stage)}
        require(blocked == set(record["robots"]), f"{obstacle} blocks {sorted(blocked)}")
        self.known.add(obstacle)
        self.sealed[obstacle] = blocked, reason

    # moves

    def _look(self, robot: Robot, task: Task, other: str) -> int:
        """What a robot knows of another one after the look before its move."""
        here = robot.pose[0]
        there: int = self.robots[other].pose[0]
        if task.sees(here, there):
            return there
        found: set[int] = task.after(other, here, robot.knowledge[other])
        hidden = [value for value in found if there in task.whereabouts(other, value)]
        require(hidden or self.external, f"{other} is where nobody could believe it to be")
        return max(hidden or found)

    def _answers(self, robot: Robot, extra: Iterable[int]) -> set[int]:
        """The nodes that answer what a robot observes now."""
        task, seen = robot.task, dict[str, int]()
        if task is None:
            return set()
        if task.places is not None:
            seen = {key: int(robot.signal[key]) for key in TOLD}
        if task.nearby:
            taken = set(extra).union(*(self.robots[other].places for other in task.moving))
            for side in self.world.sides if task.moving else ():
                seen[f"busy_{side}"] = int(self.world.step(robot.pose[0], side) in taken)
        for other in task.tracked:
            seen[f"at_{other}"] = robot.knowledge[other] = self._look(robot, task, other)
        row, graph = tuple(seen[name] for name in task.inputs), task.graph
        follow = chain(*(graph.next[node] for node in robot.may_be()))
        return {node for node in follow if graph.inputs[node] == row}

    def _move(self, record: Json) -> None:
        name = list(self.robots)[self.turn % len(self.robots)]
        robot, per_tick = self.robots[name], len(self.robots)
        due = record["robot"] == name and self.turn // per_tick == self.tick - 1
        require(due, f"it is {name}'s turn, or not yet this tick's")
        missed = sorted(self._finished())
        require(not missed, f"no line tells that {', '.join(missed)} was resolved")
        asked = self.stack[-1]["obstacle"] if self.stack else None
        require(asked is None or asked in self.present, f"a request for {asked} is left open")
        if self.met and self.met[0] < self.turn:
            asks = any((p["requester"], p["obstacle"]) == self.met[1:] for p in self.stack)
            asks = asks or self.met[2] in self.sealed or self.met[2] not in self.present
            require(asks, f"{self.met[1]} met {self.met[2]}, and no request of it is on the stack")
        self.turn, self.moves = self.turn + 1, self.moves + 1
        pose, toward = (record["to"], record.get("heading")), record.get("toward")
        try:
            after = self._check_motion(name, robot, record)
            if robot.toward is None:  # else nothing was decided
                robot.came_from = robot.may_be()
                self._check_decision(name, robot, record, after)
        except RefusedError:
            if not self.external or record["to"] not in self.world.free:
                raise
            self.strayed += 1  # of an external world: it is not where it was told to go
            after, robot.nodes, robot.after = pose, set(), set()
        robot.refused = robot.back = None
        robot.pose, robot.toward, robot.destination = pose, toward, after
        if toward is None and robot.after is not None:
            robot.nodes, robot.after = robot.after, None
        own = robot.objective == self.data[name]["objective"] and "hold" in robot.objective
        if own and toward is None and pose[0] in targets_of(robot.objective)[0]:
            self._count(robot, 0)
        if toward is None and name in self.plan:
            way, taken = self.plan[name], self.taken[name]
            self.taken[name] += taken + 1 < len(way) and way[taken + 1] == robot.pose
        if not self.external:
            self._perform(name)

    def _check_motion(self, name: str, robot: Robot, record: Json) -> Pose:
        """The rules of the world for one move. Returns the pose in which its step ends; until
        then the robot keeps its heading."""
        start, to, before, toward = record["from"], record["to"], robot.pose, record.get("toward")
        goal = to if toward is None else toward
        require(start == before[0], f"{name} moves from {start}, but is at {before[0]}")
        same = robot.toward in (None, goal) and (toward is None or to == start)
        require(same, f"{name} leaves the step that it is in")
        moves = self.world.moves(self.data[name]["mobility"], before)
        after = next((pose for pose in moves if pose[0] == goal), None)
        faces = (before if after is None or toward is not None else after)[1]
        if after is None or faces != record.get("heading"):
            said = f"{goal}, facing {record.get('heading')}"
            raise RefusedError(f"{name} cannot go from {before} to {said}")
        for obstacle, data in self.obstacles.items():
            enters = data["region"] == goal != start and self.stands(obstacle, name)
            require(not enters, f"{name} enters {goal}, where {obstacle} stands")
        for other in self.data[name].get("conflicts", ()):
            apart = not {to, goal} & self.robots[other].places
            require(apart, f"{name} and {other} are in one region")
        return after

    def _check_decision(self, name: str, robot: Robot, record: Json, after: Pose) -> None:
        """The move is the strategy's answer, or what the trace says that it is instead."""
        by = record.get("by") or ("backtrack" if robot.back else "strategy")
        task, extra, back = robot.task, record.get("busy") or (), robot.back
        robot.signal = record.get("signal") or robot.signal
        answers = self._answers(robot, extra)
        robot.silent = not answers
        require(robot.active or by == "stay", f"{name} goes on, though it is out of service")
        stays = by == "stay" or (by == "backtrack" and back and back.get("node") is None)
        require(not stays or after == robot.pose, f"{name} moves, though it should stay")
        if by == "plan":
            self._check_planned(name, robot, after)
        elif by == "stay" and not answers:
            robot.nodes = None
        elif stays and task is not None:  # it may have been told to wait, or remember this look
            looked = {f"at_{other}": robot.knowledge[other] for other in task.tracked}
            there = task.of_pose.get(after, ()) if looked else ()
            robot.after = {n for n in there if looked.items() <= task.values[n].items()}
            robot.after |= robot.may_be()
            if by == "backtrack":
                robot.after |= {n for n in answers if task.poses[n] == after}
        elif by == "backtrack" and not stays:
            node = back["node"] if back else 0
            follows = chain(*(task.graph.next[n] for n in robot.may_be())) if task else ()
            led = task is not None and node in follows and task.poses[node] == after
            require(led, f"{name} steps back to what does not follow")
            robot.after = {node}
        elif not stays:
            poses = task.poses if task is not None else []
            require(answers, f"the strategy of {name} has no answer to what it observes")
            fits = {n for n in answers if poses[n] == after}
            said = ", ".join(str(poses[n]) for n in answers)
            require(fits, f"{name} goes to {after}, but its strategy answers {said}")
            robot.after, self.answers = fits, self.answers + 1

    def _backtrack(self, record: Json) -> None:
        name, robot = record["robot"], self.robots[record["robot"]]
        moves = self.world.moves(self.data[name]["mobility"], robot.pose)
        ahead = {region for region, _ in moves} - {robot.pose[0]}
        require(robot.refused in ahead, f"no obstacle is before {name}")
        robot.back = record

    def _service(self, record: Json) -> None:
        """A robot is to stand still, or is back and goes on from where it is."""
        robot, active = self.robots[record["robot"]], record["active"]
        changed = type(active) is bool and active != robot.active
        require(changed, f"{record['robot']} is in service or out of it, as it was before")
        robot.active = active
        if active and robot.toward is None and not self.plan:
            robot.nodes = None

    def _assumption(self, record: Json) -> None:
        """The others broke what a robot relies on: it has no answer any more."""
        name = record["robot"]
        silent = self.robots[name].silent
        require(silent, f"the strategy of {name} has an answer: no assumption failed")
        self.robots[name].nodes = set()
        what = f"Tick {self.tick}: an assumption of {name} failed ({record['name']}). What its "
        what += "strategy promises does not hold from here on, until it is synthesized again."
        self.claim("broken", what)

    # joint plans

    def _plan(self, record: Json) -> None:
        self.plan = {n: [(r, h) for r, h in way] for n, way in record["robots"].items()}
        self.taken, self.orders = dict.fromkeys(self.plan, 0), record["orders"]
        for name, way in self.plan.items():
            begins = way[:1] == [self.robots[name].destination]
            require(begins, f"{name} cannot follow the plan from where it is")

    def _check_planned(self, name: str, robot: Robot, after: Pose) -> None:
        """A step of a joint plan: the next one, when those have arrived that it waits for."""
        way, k = self.plan.get(name, []), self.taken.get(name, 0) + 1
        next_ = k < len(way) and way[k - 1] == robot.pose and way[k] == after
        require(next_, f"{name} leaves its plan")
        for first, i, then, j in self.orders:
            waits = then == name and j == k and self.taken[first] < i
            require(not waits, f"{name} does not wait for {first}")
        own, task = self.data[name]["objective"], robot.task
        follows = task is None or task.follows(own, robot.pose, way[k])
        require(follows, f"the plan leads {name} where its objective forbids")
        robot.nodes = robot.after = None

    def _plan_end(self, record: Json) -> None:
        for name, node in (record.get("nodes") or {}).items():
            robot, task = self.robots[name], self.robots[name].task
            if node is not None and robot.toward is None:
                known = task.of_pose.get(robot.pose, ()) if task is not None else ()
                there = task is not None and task.graph.first[node] in known
                require(there, f"{name} goes on in node {node}, but is not in it")
                robot.nodes = {node}
        self.plan, self.taken, self.orders = {}, {}, []

    # objectives and the outcome

    def _objective(self, record: Json) -> None:
        """A robot is given another objective of its own while the run goes on."""
        name, objective = record["robot"], record["objective"]
        robot, said = self.robots[name], f"{name} is given another objective"
        if same_objective(robot.objective, self.data[name]["objective"]):
            robot.objective = objective
        self.data[name] = {**self.data[name], "objective": objective}
        robot.goals, robot.awaited = [], 0
        self.claim("changed", f"Tick {self.tick}: {said}, '{in_words(objective)}'.")

    def _push(self, record: Json) -> None:
        obstacle, helpers = record["obstacle"], record.get("helpers") or [record["helper"]]
        if obstacle is not None:
            met = obstacle in self.known and record["requester"] in self.data
            require(met, f"nobody has met {obstacle}")
            first = self.stages[obstacle][0]
            needed = {need["action"] for need in self.needs(obstacle)[first : first + 1]}
            for name in filter(None, helpers):
                able = needed <= {*self.data[name]["capabilities"]}
                require(able, f"{name} is to help with {obstacle}, but cannot meet its next need")
        self.stack.append(record)
        self._put_in_force(record)

    def _pop(self, record: Json) -> None:
        same = ("obstacle", "requester", "helper", "helpers", "reason")
        match = [p for p in self.stack if all(p.get(k) == record.get(k) for k in same)]
        require(match, "what is dropped from the stack is not on it")
        self.stack.remove(match[-1])
        self._put_in_force(record)

    def _put_in_force(self, record: Json) -> None:
        deep = len(self.stack)
        require(record["depth"] == deep, f"the stack has {deep} entries, not {record['depth']}")
        self.told = (self.tick, self.turn)
        for name, objective in record["objectives"].items():
            self._told({"robot": name, "objective": objective})

    def _told(self, record: Json) -> None:
        name, objective = record["robot"], record["objective"]
        own = same_objective(objective, self.data[name]["objective"])
        require(self.stack or own, f"{name} does not get its own objective back")
        serves = objective == self.robots[name].objective or self._may_do(name, objective)
        require(serves, f"{name} is given what serves no request: {in_words(objective)}")
        self.robots[name].objective = objective

    def _goal(self, record: Json) -> None:
        name, goal = record["robot"], record["goal"]
        robot, own = self.robots[name], self.data[name]["objective"]
        if not same_objective(robot.objective, own):
            return  # nothing is claimed of what it meets while it waits or helps
        targets, task = targets_of(own), robot.task
        there = not targets or robot.pose[0] in targets[goal]
        if task is not None and task.kind == "ltl":
            graph, pairs = task.graph, product(robot.came_from, robot.nodes or ())
            edges = [
                graph.offset[graph.first[a]] + graph.next[a].index(b)
                for a, b in pairs
                if b in graph.next[a]
            ]
            there = not edges or any(task.recurring[goal][edge] == "1" for edge in edges)
        require(there, f"{name} is not at its goal {goal}")
        robot.awaited = (goal + 1) % (len(targets) or 1)
        self._count(robot, goal)

    def _count(self, robot: Robot, goal: int) -> None:
        """A goal is met; to hold is met in each turn that ends there."""
        if "hold" not in robot.objective or robot.held != self.turn:
            robot.goals.append(goal)
            robot.held = self.turn if "hold" in robot.objective else robot.held

    def _outcome(self, record: Json) -> None:
        self.outcome, what, limits = record, record["outcome"], self.scenario["limits"]
        ran = -(-self.turn // len(self.robots))  # it may end before anybody moves in its last tick
        require(record["ticks"] == ran, f"the run took {ran} ticks, not {record['ticks']}")
        said = f"The run ended early ({what}); nothing is claimed of its goal."
        if what == "completed":
            said = self._check_completed(self.scenario["until"].get("rounds") or 0)
        elif what == "operator_needed":
            said = f"An operator is needed: {self._check_negative(record)}."
        elif what == "unrealizable":
            said = "The mission never began: a robot has no strategy."
        elif what == "tick_limit":
            most = limits.get("ticks")
            require(self.tick == most, f"the limit is {most} ticks, not {self.tick}")
            said = f"The run ended at its limit of {self.tick} ticks."
        self.claim("outcome", said)

    def _check_completed(self, rounds: int) -> str:
        for name, robot in self.robots.items():
            own = self.data[name]["objective"]
            aims = targets_of(own)
            number = len(aims) or len(formulas_of(own, "liveness")) or 1
            met = min(robot.goals.count(k) for k in range(number))
            enough = met >= rounds and same_objective(robot.objective, own)
            require(enough, f"{name} has met its objective {met} times, not {rounds}")
        what = f"every robot has met its objective {rounds} times after the last resolution"
        return f"The mission is completed: {what}."

    def _check_negative(self, record: Json) -> str:
        """An operator is needed: the proof shows that the team cannot complete the mission."""
        proof, specs = record.get("proof"), record.get("unrealizable") or {}
        beaten = specs and set(specs.values()) <= self._beaten
        require(proof or beaten, "the outcome is a negative without a proof")
        joint, cause = proof is not None and proof["kind"] == "joint", record.get("cause")
        require(joint == (cause == "deadlock"), f"the proof is not one of the cause {cause}")
        if not proof:
            return f"there is no strategy for {' and '.join(specs)}, as shown above"
        if joint:
            count = Team(self).exhaust(proof)
            return f"no order of moves completes it from any of the {count} joint places"
        out = sorted(name for name, robot in self.robots.items() if not robot.active)
        stuck = Team(self, out).never(proof) & set(self.data)
        require(stuck, "everybody can go on, whatever can never be resolved")
        said = f"{' and '.join(sorted(stuck))} cannot go on, whatever the team does"
        said += f" while {' and '.join(out)} stands still, out of service" if out else ""
        barred = " (robots without a strategy for it do not serve an obstacle)"
        return said + barred * bool(self.barred)


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
        self.manifest = self.json("manifest.json")
        known = (self.manifest["format"], self.manifest["version"]) == ("safenav-bundle", 3)
        said = "is not of format safenav-bundle, version 3; an older bundle has its own check.py"
        require(known, f"manifest.json {said}")
        self.files = self.manifest["files"]
        different = sorted(found ^ {*self.files, "manifest.json"})
        require(not different, f"{', '.join(different)} is either missing or not in the manifest")
        for path, facts in self.files.items():
            data, (folder, _, name) = self.read(path), path.rpartition("/")
            digest = hashlib.sha256(data).hexdigest()
            same = (len(data), digest) == (facts["bytes"], facts["sha256"])
            require(same, f"{path} is not the file that the manifest names")
            named = folder not in ("specs", "strategies") or digest == name.partition(".")[0]
            require(named, f"{path} is not named by its sha256")
        lines = [json.loads(line) for line in self.text("trace.jsonl").splitlines()]
        self.header, self.trace = lines[0], lines[1:]
        same = self.header["type"] == "header"
        same = same and self.header["scenario"] == self.json("scenario.json")
        require(same, "scenario.json is not what the header of the trace says")
        self._compare_source(self.header["scenario"]["map"])

    def has(self, path: str) -> bool:
        return path in self.files

    def text(self, path: str) -> str:
        try:
            return self.read(path).decode()
        except (KeyError, OSError):
            raise RefusedError(f"{path} is missing") from None

    def json(self, path: str) -> Any:
        return json.loads(self.text(path))

    def _compare_source(self, world: Json) -> None:
        """A map that is drawn in the YAML file is the map of the scenario."""
        for path in self.files:
            if path.startswith("source/") and path.endswith((".yaml", ".yml")):
                parts = re.split(r"[\[\]{},:\n]", self.text(path))
                rows = [part.strip().strip("'\"- ") for part in parts]
                drawn = [row for row in rows if row and not set(row) - {"#", "."}]
                drawn = [row for row in drawn if len(row) > 1 or world["cols"] == 1]
                walled = "#" in "".join(row for row in drawn if "." in row)
                same = not walled or drawn == world["grid"]
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
        said = [(c["id"], c["kind"], c["text"]) for c in run.bundle.manifest["claims"]]
        same = not compare or said == [(c.id, c.kind, c.text) for c in run.claims]
        require(same, "the manifest does not claim what the evidence establishes")
        return "accepted", "", run.claims
    except RefusedError as error:
        reason = str(error)
    except TooLargeError as error:
        return "too large", str(error), run.claims if run else []
    except (LookupError, TypeError, ValueError, AttributeError, RecursionError) as error:
        reason = f"a file is not as documented: {error!r}"
    if run is not None and run.line:
        reason = f"trace.jsonl, line {run.line}: {reason}"
    return "refused", reason, run.claims if run else []


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
    if options.json:
        said = {"verdict": verdict, "reason": reason, "claims": [asdict(c) for c in claims]}
        print(json.dumps(said))
    else:
        for claim in claims:
            print(f"  {claim.id}: {claim.text}")
        print(f"{verdict}{': ' * bool(reason)}{reason}")
    return {"accepted": 0, "refused": 1, "too large": 3}[verdict]


if __name__ == "__main__":
    sys.exit(main())
