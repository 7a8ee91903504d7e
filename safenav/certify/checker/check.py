"""Check a bundle: the proof that a run of robots did what it should, by strategies that had to.

    python3 -I -S check.py BUNDLE [--json]

BUNDLE is a folder or a .zip. Exit status 0: accepted; 1: refused, with the first reason; 2: no
bundle; 3: larger than this checker takes on. Only Python's standard library is needed.

check_strategies.py shows which rules strategies keep, or that there is no strategy. ``Run`` follows
the trace: each move is legal, and its strategy's answer, a stay, a step back from an obstacle or a
step of a joint plan; obstacles are resolved by robots that can; the outcome is what happened. Each
claim of an unresolvable obstacle, a robot that cannot continue or a deadlock is recomputed
(``Team``). These stay trusted: this program and Python; the step from the YAML file to
scenario.json (its grid is compared); that the trace records what happened, and that robots move as
their mobility states."""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from html import escape
from importlib import import_module
from itertools import chain, combinations, product
from pathlib import Path
from typing import Any, NamedTuple

if __name__ == "__main__":
    sys.dont_write_bytecode = True  # a bundle stays as it is
    sys.path.insert(0, str(Path(__file__).resolve().parent))
elif __package__:  # safenav has these two files in a package
    sys.modules["check_strategies"] = import_module(f"{__package__}.check_strategies")

import check_strategies as base
from check_strategies import Json, Objective, Pose, RefusedError, Strategy, Task, World, require

SOMEBODY = "any robot"
VAIN = ("failed", "nothing")
Poses = frozenset[Pose]


class Need(NamedTuple):
    """A need of an obstacle: able robots, regions, their number, simultaneously or in turn, whether
    they are among those of the need before it."""

    able: frozenset[str]
    regions: frozenset[int]
    robots: int
    together: bool
    same: bool


class Obstacle(NamedTuple):
    """An obstacle at some moment."""

    name: str
    region: int
    blocks: frozenset[str]
    needs: tuple[Need, ...]
    left: tuple[Need, ...]  # needs that are not met yet, the next one first
    present: bool
    truth: bool | None  # revealed by resolving it: whether it is then traversable
    known: bool = False  # whether a robot has encountered it
    done: frozenset[str] = frozenset()  # robots that met a part of the next need
    sealed: tuple[str, ...] | None = None  # robots that it blocks permanently, as a line states
    barred: frozenset[str] = frozenset()  # robots with no strategy to serve it

    def stands(self, name: str) -> bool:
        """Return whether a robot must keep out: the obstacle stops it and entering does not resolve
        it, or it stays permanently for that robot."""
        last = self.left[-1] if len(self.left) == 1 else None
        enters = (
            last
            and last.robots == 1
            and not last.same
            and self.region in last.regions
            and name in last.able
        )
        open_ = enters or not self.left
        return (self.present and name in self.blocks and not open_) or name in (self.sealed or ())

    def advanced(self, group: frozenset[str]) -> Obstacle:
        """Return the obstacle after its next need is met; ``same`` robots must meet the one after
        it."""
        left = self.left[1:]
        if left and left[0].same:
            left = (left[0]._replace(able=left[0].able & group), *left[1:])
        return self._replace(left=left, done=frozenset())

    def worked(self, at: Mapping[str, Pose], acting: set[str]) -> Obstacle:
        """Return the obstacle after the robots' actions where they stand, requested or not."""
        if not self.present or not self.left:
            return self
        need = self.left[0]
        there = {name for name in need.able & {*at} if at[name][0] in need.regions}
        group = self.done | (there if need.together and there & acting else there & acting)
        if len(group) < need.robots:
            return self if need.together else self._replace(done=group)
        return self.advanced(group).worked(at, acting)


class Robot:
    """A robot at some moment; ``data``: as the header has it; ``rivals``: robots in conflict."""

    def __init__(self, name: str, data: Json, rivals: list[str]) -> None:
        self.name, self.data, self.rivals = name, data, rivals
        self.pose: Pose = (data["start"], data.get("heading"))
        self.destination = self.pose  # end of its step, if it is in transit
        self.places = {data["start"]}  # the regions that it occupies: two in transit
        self.own = self.objective = Objective(data["objective"])  # its own, and the one in force
        self.goals = list[int]()  # goals of its own met since the last resolution
        self.turn = 0  # the number (modulo theirs) of the next one, if they are in order
        self.task: Any = None
        self.nodes, self.came_from = set[int](), set[int]()  # where its strategy may be, and was
        self.answers: set[int] | None = None  # of its strategy, in its last turn
        self.knowledge, self.signal = dict[str, int](), dict[str, Any]()  # its last inputs
        self.back: dict[str, Any] = {}  # this turn: region of an encounter, and its ``node``
        self.heard = dict[str, int]()  # the inputs of the environment
        self.active, self.way = True, list[Pose]()  # in service; its part of a joint plan
        self.begun = 0  # the tick in which its step began
        self.battery = data.get("battery")
        self.charge = self.battery["start"] if self.battery else None
        self.forms = set[str]()  # in which its own objective was proven, "plan" if it was moved

    def near(self, other: Robot) -> set[int]:
        """Return the regions that another robot must not enter because of this one."""
        zones = [{*regions} for robots, regions in self.data["zones"] if other.name in robots]
        own = self.places if other.name in self.rivals else set[int]()
        return own.union(*(zone for zone in zones if zone & self.places))

    def held(self) -> list[int]:
        """Return the goals that are met by ending a turn here: for an objective that holds, its
        target."""
        holds = self.own.settles and self.objective == self.own
        last = len(self.own.targets) - 1
        due = not self.own.ordered or self.turn >= last
        return [last] if holds and due and self.places <= self.own.targets[last] else []


def freedom(world: World, robot: Robot) -> tuple[dict[Pose, set[Pose]], list[Poses]]:
    """Return a robot's moves, and for each goal the poses in which it may be met. For formulas: the
    moves that they allow, and the poses where staying meets a goal, or else a step does, with some
    memory."""
    own, mobility, moves = robot.own, robot.data["mobility"], dict[Pose, set[Pose]]()
    for a in base.poses_of(product(world.free, [None]), mobility):
        moves[a] = {b for b in world.moves(mobility, a) if a == b or own.permits(a, b)}
    aims = [base.poses_of(product(aim, [None]), mobility) for aim in own.targets]
    for line in own.liveness:
        met = [(a, b) for a in moves for b in moves[a] if own.allows([line], a, b)]
        staying = {a for a, b in met if a == b}
        aims.append(frozenset(staying) | {b for a, b in met if not {a, b} & staying})
    return moves, aims or [frozenset(moves)]


class Team:
    """The team's remaining possibilities, ignoring unencountered obstacles. ``names``: restrict to
    these robots, without the other robots and all obstacles that may yet be resolved. ``out``:
    robots out of service."""

    def __init__(self, run: Run, names: Iterable[str] = (), out: Iterable[str] = ()) -> None:
        self.robots = {n: r for n, r in run.robots.items() if n in (names or run.robots)}
        met = run.met_obstacles() if len(self.robots) == len(run.robots) else []
        sealed = [o._replace(left=()) for o in run.obstacles.values() if o.sealed]
        self.obstacles = (*(o for o in met if o.sealed is None), *sealed)
        self.at = {name: robot.destination for name, robot in self.robots.items()}
        self.free = {name: freedom(run.world, robot) for name, robot in self.robots.items()}
        self.free |= {n: ({self.at[n]: {self.at[n]}}, [frozenset([self.at[n]])]) for n in out}
        self.reach = cache(self._reach)

    def steps(self, name: str, pose: Pose, obstacles: tuple[Obstacle, ...]) -> list[Pose]:
        walls = {obstacle.region for obstacle in obstacles if obstacle.stands(name)}
        return [after for after in self.free[name][0][pose] if after[0] not in walls]

    def _reach(self, name: str, poses: Poses, obstacles: tuple[Obstacle, ...]) -> set[Pose]:
        """Return the poses that a robot can reach from some poses."""
        return {*base.closure(poses, lambda pose: self.steps(name, pose, obstacles))}

    def can_go_on(self, name: str, poses: Poses, obstacles: tuple[Obstacle, ...]) -> bool:
        """Return whether, from some pose that a robot can reach, it can meet every goal infinitely
        often."""
        first, *others = self.free[name][1][-1 if self.robots[name].own.settles else 0 :]
        for pose in self.reach(name, poses, obstacles) & first:
            ahead = self.reach(name, frozenset([pose]), obstacles).intersection(chain(*others))
            back = {p for p in ahead if pose in self.reach(name, frozenset([p]), obstacles)}
            if all(aim & back for aim in others):
                return True
        return False

    def serve(self, state: Any) -> Iterator[Any]:
        """Yield the states after robots go to meet the next need of an obstacle, each to any pose
        there."""
        sets, obstacles = dict(state[0]), state[1]
        for k, obstacle in [(k, o) for k, o in enumerate(obstacles) if o.left]:
            need = obstacle.left[0]
            fit = need.able - obstacle.barred - obstacle.done
            ahead = {name: self.reach(name, sets[name], obstacles) for name in sorted(fit)}
            at = {n: frozenset(p for p in ahead[n] if p[0] in need.regions) for n in ahead}
            for group in combinations(filter(at.get, at), need.robots - len(obstacle.done)):
                crowd = [name for name in group if {*self.robots[name].rivals} & {*group}]
                ways = product(*({pose[0] for pose in at[name]} for name in crowd))
                if need.together and all(len({*way}) < len(way) for way in ways):
                    continue  # they cannot all stand there simultaneously
                now = sets | {name: at[name] for name in group}
                then = obstacle.advanced(obstacle.done.union(group))
                yield tuple(now.items()), (*obstacles[:k], then, *obstacles[k + 1 :])
                chosen = obstacle.left[1:] and obstacle.left[1].same  # for another need
                if not chosen and all(ahead[n] == self.reach(n, at[n], obstacles) for n in group):
                    return  # nothing is lost: all can return to all that they could reach

    def never(self) -> set[str]:
        """Return the obstacles that stay, the robots that cannot continue, and SOMEBODY if in each
        case some robot cannot, even if robots overlap."""
        start, lost = tuple((n, frozenset([pose])) for n, pose in self.at.items()), list[set[str]]()
        for sets, obstacles in base.closure([(start, self.obstacles)], self.serve):
            stuck = {n for n, poses in sets if not self.can_go_on(n, poses, obstacles)}
            stays = {obstacle.name for obstacle in obstacles if obstacle.left}
            lost.append(stuck | stays | ({SOMEBODY} if stuck else set()))
        return set.intersection(*lost)

    def exhaust(self, rounds: int) -> None:
        """Refuse unless no order of moves completes some rounds."""

        def after(state: Any) -> Iterator[Any]:  # all act where they stand, then one steps
            places, counts, before = state
            at, now, live = dict(zip(self.robots, places, strict=True)), list[Any](), True
            obstacles = tuple(o.worked({n: at[n] for n in {*at} - o.barred}, {*at}) for o in before)
            anew = any(was.left and not o.left for was, o in zip(before, obstacles, strict=True))
            for (name, pose), (turn, *met) in zip(at.items(), counts, strict=True):
                times = [0] * len(met) if anew else met
                here = [goal for goal, aim in enumerate(self.free[name][1]) if pose in aim]
                own, last = self.robots[name].own, len(self.free[name][1]) - 1
                for goal in here * (own.settles and own.ordered):
                    turn += goal == turn < last
                    times = [rounds] if goal == last <= turn else times
                for goal in here * (0 if own.settles and own.ordered else rounds):
                    due = turn % len(times) == goal or not own.ordered
                    if due and times[goal] == min(times) < rounds:
                        turn, times[goal] = turn + 1, times[goal] + 1
                now.append((turn, *times))
                live = live and min(times) >= rounds
                live = live and self.can_go_on(name, frozenset([pose]), obstacles)
            require(not live, "the mission can be completed from here")
            for k, (name, robot) in enumerate(self.robots.items()):
                taken = {at[other][0] for other in robot.rivals if other in at}
                for group, zone in robot.data["zones"]:
                    if any(n != name and n in group and at[n][0] in zone for n in at):
                        taken |= {*zone}
                for pose in self.steps(name, at[name], obstacles):
                    if pose[0] not in taken:
                        yield (*places[:k], pose, *places[k + 1 :]), tuple(now), obstacles

        team = self.robots.values()
        counts = tuple((r.turn, *map(r.goals.count, sorted(r.own.goals))) for r in team)
        base.closure([(tuple(self.at.values()), counts, self.obstacles)], after)


class Passes:
    """A live run, expanded: each pass has the move that each robot would have in lockstep. Refuses
    steps that do not begin or end as they should, and robots in conflict that have a region at the
    same time, in seconds: a robot has both regions of a step, and all where it may be if lost."""

    def __init__(self, robots: Mapping[str, Robot]) -> None:
        self.robots, self.names, self.tick, self.due = robots, [*robots], 0, len(robots)
        self.pose = {name: robot.pose for name, robot in robots.items()}
        self.has = {name: (0.0, robot.places) for name, robot in robots.items()}
        self.under_way, self.by = dict[str, Json](), dict.fromkeys(robots, "stay")
        self.busy = dict[str, Any]()  # regions that its strategy was shown when it stayed last
        self.open = dict[str, Any]()  # the move of this turn, as far as its lines have shown
        self.begun = set[str]()  # robots with a new strategy in this turn

    def expand(self, lines: Iterable[Json]) -> Iterator[Json]:
        last, every = 0.0, len(self.names)
        for line in lines:
            kind, name, tick = line["type"], line.get("robot"), line["tick"]
            require(line["t"] >= last, f"{line['t']} s come after {last} s")
            last = line["t"]
            while self.tick < tick:
                yield from self.until(every)
                self.tick, self.due = self.tick + 1, 0
            after_turns = kind == "plan" or (kind, line.get("reason")) == ("plan_end", "reached")
            if after_turns or line.get("outcome") == "completed":
                yield from self.until(every)
            if kind in ("act", "depart"):  # what held it before does so no more
                self.by[str(name)] = "stay"
            decides = kind in ("violation", "backtrack", "depart", "arrive")
            own = decides or kind in ("hold", "act", "acted", "met", "resolved", "belief")
            own = own or (kind == "goal" and name not in self.begun)
            self.by |= {name: "stay"} if kind == "act" else {}
            if tick and own and self.open.get("robot") != name:
                index = self.names.index(str(name))
                require(index >= self.due or not decides, f"{name} has a second turn in a pass")
                if index >= self.due:
                    yield from self.until(index)
                    self.open = self.stay()
            if not decides and kind not in ("hold", "discovered", "late", "plan_end"):
                yield from self.until(0)
            yield line
            self.take(line, kind, str(name))
        yield from self.until(0)
        for name in self.names:
            self.have(name, float("inf"), set())

    def until(self, due: int) -> Iterator[Json]:
        """Yield the move of this turn, and those of the robots whose turns come before one."""
        while self.open or self.due < due:
            move, self.open = self.open or self.stay(), {}
            self.pose[move["robot"]] = move["to"], move["heading"]
            self.due = self.names.index(move["robot"]) + 1
            yield move

    def stay(self) -> dict[str, Any]:
        name = self.names[self.due]
        self.begun.clear()
        (here, heading), depart = self.pose[name], self.under_way.get(name)
        more = {"by": self.by[name], "busy": self.busy.get(name, ())}
        more = {"toward": depart["to"]} if depart else more
        base = {"type": "move", "tick": self.tick, "robot": name, "expanded": True}
        return {**base, "from": here, "to": here, "heading": heading, **more}

    def take(self, line: Json, kind: str, name: str) -> None:
        """Note what a line shows of the robot's move, and of the regions that it has."""
        move, told = self.open, {"signal": line["signal"]} if "signal" in line else {}
        if kind == "depart":
            require(name not in self.under_way, f"{name} departs before its last step has ended")
            require(line["from"] == self.pose[name][0], f"{name} departs from where it is not")
            self.under_way[name] = line
            move |= {"toward": line["to"], "by": line["by"], "busy": line.get("shown", ())} | told
            self.have(name, line["t"], {line["from"], line["to"]})
        elif kind == "arrive":
            depart = self.under_way.pop(name, {"command": None})
            require(depart["command"] == line["command"], f"{name} ends what it has not begun")
            there = line["result"] != "arrived" or line["at"] == depart["to"]
            require(there, f"{name} has not arrived where it was to go")
            move |= {"to": line["at"], "heading": line["heading"]}
            move |= {"failed": True} if line["result"] != "arrived" else {}
            move |= {"by": "plan"} if depart["by"] == "plan" else {}
            del move["toward"]
            self.have(name, line["t"], {*line.get("regions", [line["at"]])})
        elif kind == "hold":
            self.by[name] = "strategy" if line["why"] == "strategy" else "stay"
            self.busy[name] = line.get("shown", ())
            if move and "toward" not in move and move.get("by") != "backtrack":
                move |= {"by": self.by[name], "busy": self.busy[name], **told}
        elif kind == "backtrack":
            move |= {"by": "backtrack"}
        elif kind in ("synthesis", "objective"):
            self.begun.add(name)
        elif kind == "goal":
            self.begun.discard(name)
        elif kind == "operator" and line.get("region") is not None:
            self.pose[name] = line["region"], line.get("heading")
            self.have(name, line["t"], {line["region"]})

    def have(self, name: str, t: float, regions: set[int]) -> None:
        """Let a robot have these regions instead, from ``t`` seconds on."""
        since, former = self.has[name]
        for other in self.robots[name].rivals:
            later, taken = self.has[other]
            apart = t <= max(since, later) or not former & taken
            require(apart, f"{name} and {other} have a region both until {t} s")
        self.has[name] = t, regions


class Run:
    """The trace, line by line, against the strategies, the map and the obstacles."""

    def __init__(self, files: Mapping[str, Any]) -> None:
        self.files, self.claims, self.line = files, list[Json](), 1
        header, *self.trace = map(json.loads, files["trace.jsonl"].read_bytes().splitlines())
        self.scenario, robots = header["scenario"], header["scenario"]["robots"]
        same = header["type"] == "header" and self.scenario == self.json("scenario.json")
        require(same, "scenario.json is not what the header of the trace says")
        self.world = World(self.scenario["map"])
        self.chargers = frozenset(self.scenario.get("chargers") or ())
        self.external = self.scenario.get("world") == "external"
        self.live = header.get("clock") == "live"
        self.robots, self.obstacles = dict[str, Robot](), dict[str, Obstacle]()
        self.tick = self.turn = self.answered = self.strayed = 0
        self.stack = list[tuple[Any, ...]]()  # of requests
        self.permanent = set[str]()  # obstacles that stay, as an operator says
        self.passing = set[str]()  # obstacles that go by themselves
        self.ordered = set[str]()  # obstacles that were requested by no robot
        self.met: Any = None  # the obstacle encountered last, its robot and tick
        self.shown: dict[Any, Any] = {}  # what files show, each once
        self.hopeless: set[tuple[str, str]] = set()  # robots that have no strategy, and for what
        apart = {(a, b) for a in robots for b in robots[a].get("conflicts", ())}
        for name, data in robots.items():
            rivals = [n for n in robots if n != name and {(name, n), (n, name)} & apart]
            listed = self.scenario.get("never_together") or ()
            zones = [(z["robots"], z["regions"]) for z in listed if name in z["robots"]]
            self.robots[name] = robot = Robot(name, {**data, "zones": zones}, rivals)
            robot.heard = {each["name"]: 0 for each in self.scenario.get("inputs") or ()}
            alone = all(robots[n]["start"] != data["start"] for n in rivals)
            turning = {"free": False, "heading": True}.get(data["mobility"]) is bool(robot.pose[1])
            alone = alone and data["start"] not in robot.own.avoid
            fits = alone and turning and robot.places.union(*robot.own.targets) <= self.world.free
            require(fits, f"{name} cannot move or start like that, or has a target in a wall")
        for data in self.scenario["obstacles"]:
            first = self.obstacles.pop(data["name"], None)  # it reappears
            self.discover(data, present=not data.get("from"))
            if first:
                again = self.obstacles[first.name]
                there = first._replace(present=first.present or again.present)
                same = again._replace(present=there.present, truth=there.truth) == there
                require(same, f"{first.name} is another when it comes back")
                self.obstacles[first.name] = there
            self.clear(self.obstacles[data["name"]])

        if self.live:
            self.trace = [*Passes(self.robots).expand(self.trace)]

    def text(self, path: str) -> str:
        return str(self.files[path].read_bytes().decode())

    def json(self, path: str) -> Any:
        return read_json(self.files[path]) if path in self.files else None

    def claim(self, kind: str, text: str, *files: str | None) -> None:
        """Record a claim that some files establish (None: this line of the trace)."""
        shown = [[path or "trace.jsonl", None if path else self.line] for path in files or [None]]
        name, when = f"{kind}-{len(self.claims) + 1}", f"Tick {self.tick}: " if self.line else ""
        self.claims.append({"id": name, "kind": kind, "text": when + text, "evidence": shown})

    def replay(self) -> None:
        """Refuse unless all lines are true; ``claims`` holds what is established."""
        for record in self.trace:
            self.line += "expanded" not in record
            next_one = self.tick + (self.turn == self.tick * len(self.robots))
            require(record["tick"] in (self.tick, next_one), "a tick or a move is left out")
            self.tick = record["tick"]
            obstacle = self.obstacles.get(str(record.get("obstacle")))
            self.follow(record, self.robots.get(record.get("robot")), obstacle)
        self.line = 0
        for robot in self.robots.values():
            self.state_form(robot)
        if "motion.jsonl" in self.files:
            trace, motion = (self.files[f"{n}.jsonl"].read_bytes() for n in ("trace", "motion"))
            same = json.loads(motion.splitlines()[0])["trace"] == hashlib.sha256(trace).hexdigest()
            require(same, "motion.jsonl is the motion of another trace")
            said = "motion.jsonl names this trace"
            self.claim("motion", f"{said}; `safenav check-motion` checks it.", "motion.jsonl")
        but = f" but {self.strayed}, which ended elsewhere than commanded," if self.strayed else ""
        said = f"All {self.turn} moves{but} are legal: no wall, unresolved obstacle or collision"
        what = f"{self.answered} follow strategies"
        timed = "; in seconds, robots in conflict never have a region both" if self.live else ""
        what = f"{said}{timed}. {what}; the others stay, back up or follow a joint plan."
        self.claim("moves", what, "trace.jsonl")

    def state_form(self, robot: Robot) -> None:
        """Note the form in which a robot's own objective was proven: the weakest that is in
        force."""
        if robot.forms:
            form = min(robot.forms)  # alternation before literal
            self.claim("form", f"{robot.name}: {robot.own.words(self.world, form)}.", "trace.jsonl")
            robot.forms.clear()

    def check_page(self) -> None:
        """Refuse unless the page and its facts state what is established, and nothing else."""
        facts, shown = self.json("assurance.json"), self.text("index.html")
        require(facts["claims"] == self.claims, "assurance.json states other claims")
        texts, asked = [claim["text"] for claim in self.claims], list[str]()
        untimed = [re.sub(r"^Tick \d+: ", "", text) for text in texts]
        for name, robot in self.robots.items():
            own = Objective(robot.data["objective"])
            stated = [own.words(self.world, each) + "." for each in ("literal", "alternation", "")]
            first = (t for t in untimed if t in [f"{name}: {words}" for words in stated])
            asked.append(next(first, f"{name}: {stated[2]}").removeprefix(f"{name}: ")[:-1])
        same = [robot["objective"] for robot in facts["asked"]] == asked
        require(same, "assurance.json states another form of an objective than was proven")
        listed = sorted(re.findall(r'<li id="[^"]*">(.*?)<br>', shown))
        cells = re.findall(r'<td class="must">(.*?)</td>', shown)
        same = listed == sorted(map(escape, texts)) and cells == [*map(escape, asked)]
        for text in sorted((*texts, *asked), key=len, reverse=True):
            shown = shown.replace(escape(text), "")
        same = same and base.STRICTLY not in shown
        require(same, "index.html states something else than is established")

    def follow(self, record: Json, robot: Any, obstacle: Any) -> None:
        """Follow a line of the trace, with the robot and the obstacle that it names."""
        match record["type"]:
            case "synthesis":
                self.synthesis(record, robot)
            case "move":
                self.move(record, robot)
            case "acted":
                at = {n: r.pose for n, r in self.robots.items() if r.pose == r.destination}
                vain = [n for n, found in record["results"].items() if found in VAIN]
                for one in [o for n, o in self.obstacles.items() if n not in vain]:
                    self.obstacles[one.name] = one.worked(at, {robot.name})
            case "discovered":
                self.discover(record["obstacle"], present=True)
            case "appeared":
                known = record["cause"] == "battery"  # the robot there asks for it
                self.alter(
                    obstacle, present=True, left=obstacle.needs, done=frozenset(), known=known
                )
                self.met = self.met if self.met and self.met[0] != obstacle.name else None
                self.clear(self.obstacles[obstacle.name])
            case "order":
                require(
                    obstacle.present and not obstacle.blocks, f"{obstacle.name} cannot be ordered"
                )
                self.alter(obstacle, known=True)
                self.ordered.add(obstacle.name)
            case "gone":
                self.alter(obstacle, present=False, known=False, sealed=None)
            case "truth":
                self.alter(obstacle, truth=record["traversable"])
            case "violation":
                there = obstacle.region == record["proposed"] and obstacle.stands(robot.name)
                require(there, f"{obstacle.name} does not block {robot.name} there")
                self.alter(obstacle, known=True)
                self.met = obstacle.name, robot.name, self.turn
                robot.back = {"region": obstacle.region}
            case "backtrack":
                beside = robot.back.get("region") in self.world.around([robot.pose[0]])
                require(beside, f"no obstacle is before {robot.name}")
                robot.back["node"] = record.get("node")
            case "resolved":
                truth = record["traversable"]
                fits = self.external or (not obstacle.left and truth == obstacle.truth)
                require(obstacle.present and fits, f"{obstacle.name} is absent or different")
                sealed = tuple(sorted(obstacle.blocks)) if truth is False else None
                self.alter(obstacle, present=False, known=False, left=(), sealed=sealed)
                for each in self.robots.values():
                    each.goals = each.held()
            case "waiting":
                self.met = None  # the last one met is requested after the operator's action
            case "operator" if record["deed"] == "put_back":
                put: Pose = record["region"], record.get("heading")
                free = record["region"] in self.world.free
                free = free and not any(
                    record["region"] in self.robots[rival].places for rival in robot.rivals
                )
                require(free, f"{robot.name} is put where it cannot be")
                robot.pose = robot.destination = put
                robot.places, robot.way = {record["region"]}, []
                robot.nodes = robot.task.of_pose.get(put, set()) if robot.task else set()
            case "operator" if record["deed"] == "permanent":
                self.permanent.add(record["obstacle"])
            case "reopened":
                self.alter(obstacle, sealed=None)
            case "blocked" if record["reason"] == "operator":
                require(obstacle.name in self.permanent, f"no operator closed {obstacle.name}")
                self.claim("operator", f"An operator says that {obstacle.name} stays.")
                self.alter(obstacle, known=True, sealed=tuple(sorted(obstacle.blocks)))
            case "blocked":
                if obstacle.sealed is None:  # else it was found untraversable
                    require(obstacle.name in Team(self).never(), f"{obstacle.name} can be resolved")
                    kind, _, _ = obstacle.name.rpartition("@")
                    what = f"{kind}@{self.world.word([obstacle.region])}"
                    self.claim("never", f"No robot can ever resolve {what}.")
                self.alter(obstacle, known=True, sealed=tuple(sorted(obstacle.blocks)))
            case "push" | "pop":
                self.ask(record, obstacle)
            case "told":
                self.tell(robot, Objective(record["objective"]))
            case "objective":
                given = Objective(record["objective"])
                when = robot.data.get("when") or ()
                on = next((w for w in when if robot.heard.get(w["input"])), robot.data)
                same = not when or (record["cause"] == "input" and given.data == on["objective"])
                require(same, f"{robot.name} is given what its inputs do not say")
                self.state_form(robot)
                robot.objective = given if robot.objective.serves(robot.own) else robot.objective
                robot.own, robot.goals = given, []
                words = given.words(self.world)
                self.claim("changed", f"{robot.name} receives another objective: {words}.")
            case "inputs":
                names = {each["name"] for each in self.scenario.get("inputs") or ()}
                require({*record["values"]} == names, "the inputs are not those of the scenario")
                for each in self.robots.values():
                    each.heard = {name: int(on) for name, on in record["values"].items()}
            case "service":
                require(robot.active != record["active"], f"{robot.name} serves as it was before")
                robot.active = record["active"]
                if robot.active and record["cause"] == "battery":
                    robot.charge = robot.battery["capacity"]
                if robot.active and robot.pose == robot.destination and not robot.way:
                    robot.nodes = robot.task.of_pose.get(robot.pose, set()) if robot.task else set()
            case "assumption":
                require(robot.answers == set(), f"{robot.name} has an answer: no assumption failed")
                robot.nodes = set()
                said = f"An assumption of {robot.name} failed ({record['name']}); its guarantees"
                self.claim("broken", f"{said} resume at its next synthesis.")
            case "plan" | "plan_end":
                for name, each in self.robots.items():
                    each.way = [(r, h) for r, h in record.get("robots", {}).get(name, ())]
                    if each.way[1:2] == [each.destination]:  # its first step is under way
                        del each.way[0]
                    require(each.way[:1] in ([], [each.destination]), f"{name} begins elsewhere")
                    node = (record.get("nodes") or {}).get(name)  # in which it continues
                    if node is not None and each.task and each.pose == each.destination:
                        there = each.task.of_pose.get(each.pose, set())
                        require(each.task.graph.first[node] in there, f"{name} is not in {node}")
                        each.nodes = {node}
            case "goal" if robot.objective.serves(robot.own):  # else it only helps
                goal, own, task = record["goal"], robot.own, robot.task
                there = not own.targets or robot.pose[0] in own.targets[goal]
                if task and task.objective.kind == "ltl":
                    there = task.meets(goal, robot.came_from, robot.nodes)
                require(there, f"{robot.name} is not at its goal {goal}")
                robot.goals += [goal] if not own.settles or goal not in robot.goals else []
                robot.turn += 1
            case "deadline" if record["of"] in self.obstacles:
                if record["verdict"] in ("set", "lost"):
                    self.foretell(record)
            case "outcome":
                require(record is self.trace[-1], "a line follows the outcome")
                ran = -(-self.turn // len(self.robots))  # it may end before any move of a tick
                require(record["ticks"] == ran, f"the run took {ran} ticks, not {record['ticks']}")
                self.claim("outcome", self.outcome(record))

    def ask(self, record: Json, obstacle: Obstacle | None) -> None:
        """Note that a request is open from now on, or no longer."""
        entry = tuple(map(record.get, ("obstacle", "requester", "helper", "helpers", "reason")))
        if record["type"] == "pop":
            require(entry in self.stack, "the dropped entry is not on the stack")
            self.stack.remove(entry)
        else:
            known = record["obstacle"] is None or (obstacle and obstacle.known)
            made = record["requester"] in self.robots
            made = made or (record["requester"] is None and record["obstacle"] in self.ordered)
            require(known and made, "no robot has met its obstacle")
            able = obstacle.left[0].able if obstacle and obstacle.left else self.robots
            unable = {*(record.get("helpers") or [record["helper"]])} - {None, *able}
            require(not unable, f"{', '.join(unable)} cannot meet the next need of {entry[0]}")
            self.stack.append(entry)
        require(record["depth"] == len(self.stack), f"the stack has {len(self.stack)} entries")
        for name, objective in record["objectives"].items():
            self.tell(self.robots[name], Objective(objective))

    def tell(self, robot: Robot, objective: Objective) -> None:
        """Refuse unless a robot gets its own objective, the same as before, or one that serves an
        open request."""
        wanted = [need.regions for o in self.met_obstacles() for need in o.needs]
        serves = any(aim <= there for aim in objective.targets for there in wanted)
        fits = self.stack and (objective.kind != "visit" or serves)
        while_waiting = robot.data.get("while_waiting")
        fits = fits or objective == robot.objective or objective.serves(robot.own)
        fits = fits or (while_waiting is not None and objective == Objective(while_waiting))
        fits = fits or self.charges(robot, objective)
        require(fits, f"{robot.name} receives an objective that serves no request")
        robot.objective = objective

    def synthesis(self, record: Json, robot: Robot) -> None:
        """Check a strategy, or that no strategy exists, for a ``synthesis`` line."""
        spec, name, node = record["spec"], record.get("strategy"), record.get("node")
        rules = f"rules/{base.circumstances(record)}.json"
        asked = Objective(record["objective"])
        words = asked.formed(record.get("form")).words(self.world)
        said = f"{robot.name} for '{words}'"
        for tried in (*(record.get("tried") or ()), record):
            text = f"specs/{tried['spec']}.structuredslugs"
            path = f"counterstrategies/{tried['spec']}.json"
            if path in self.files and path not in self.shown:
                proof = self.json(path)
                self.shown[path] = graph = Strategy(proof["automaton"], self.text(text))
                base.check_counterstrategy(graph, graph, proof, proof["measures"])
                if tried is not record:
                    what = f"'{asked.formed(tried['form']).words(self.world)}'"
                    what = f"No strategy of {robot.name} for {what} works"
                    what = f"{what} {base.ASSUMED[tried['fairness']]}."
                    self.claim("weakest", what, None, text, path)
        if record["verdict"] == "unrealizable" and path in self.shown:
            task = self.task(record, robot, self.shown[path], rules)
            base.check_counterstrategy(task, task.graph, self.json(path), self.json(rules))
            self.claim("unrealizable", f"No strategy exists for {said}.", None, text, path, rules)
            self.hopeless.add((robot.name, spec))
            for o in self.met_obstacles():
                if o.left and o.left[0].regions in task.objective.targets:
                    self.alter(o, barred=o.barred | {robot.name})
        if record["verdict"] != "realizable" or node is None:
            return
        require(name, "its strategy is not listed: no proof of its moves")
        files = text, f"strategies/{name}.json", f"measures/{spec}-{name}.json"
        if files not in self.shown:
            self.shown[files] = graph = Strategy(self.json(files[1]), self.text(text))
            base.check_realizes(graph, self.json(files[2]))
            what = f"satisfies its specification: {graph.count} nodes, {graph.size} edges"
            self.claim("realizes", f"The strategy of {said} {what}.", *files)
        graph = self.shown[files]
        require(node in graph.begin, f"node {node} is not one with which the strategy may begin")
        robot.task = task = self.task(record, robot, graph, rules)
        if rules not in self.shown:
            task.check_keeps(node, self.json(rules))
            self.shown[rules] = task
            what = "obeys the scenario's rules and meets that objective"
            what = f"The strategy of {said} {what}, {base.ASSUMED[record['fairness']]}."
            self.claim("keeps", what, None, *files, rules)
        if task.objective.serves(robot.own):
            robot.forms.add("literal" if task.objective == robot.own else "alternation")
            robot.turn = max(task.memory.values(), default=0)
        robot.nodes, robot.knowledge = {node}, dict(task.knowledge)
        robot.signal = robot.signal or {"request": 0, "wait": 0, "assigned": record.get("neutral")}

    def task(self, record: Json, robot: Robot, graph: Any, rules: str) -> Task:
        """Return the task that a robot is synthesized for: its circumstances are those of the
        run."""
        about = self.world, robot.data, record, self.scenario.get("partition"), graph
        task = self.shown.get(rules) or Task(*about)
        require(task.pose == robot.destination, f"it is not synthesized for {robot.destination}")
        tried = record["verdict"] == "unrealizable" and self.tick  # for an objective not in force
        if not tried and (task.places is None or not task.objective.serves(robot.own)):
            self.tell(robot, task.objective)
        standing = [o for o in self.obstacles.values() if o.known and o.stands(robot.name)]
        at = {f"robots.{name}": other.places for name, other in self.robots.items()}
        at |= {o.name: {o.region} for o in standing}
        at[f"robots.{robot.name}.objective.avoid"] = {*robot.own.avoid}
        listed = {each["name"]: each["again"] for each in self.scenario.get("inputs") or ()}
        again = {name: listed[name] for name in task.heard if listed[name]}
        same = again == (record.get("again") or {}) and task.inputs.items() <= robot.heard.items()
        require(same, f"{robot.name} assumes other inputs than there are")
        same = task.objective.rules() == robot.own.rules()
        require(same, f"{robot.name} is synthesized for other rules than its own")
        closed = [(name.removeprefix("obstacles."), r) for r, name in record.get("closed") or ()]
        wrong = [name for name, region in closed if region not in at.get(name, ())]
        require(not wrong, f"{', '.join(wrong)} is not where it should close a region")
        shut = {o.name for o in standing if robot.name in (o.sealed or ())}
        shut |= {f"robots.{name}" for name in robot.rivals if name not in task.moving}
        shut -= {name for name, _ in closed}
        shut |= {str(r) for r in robot.own.avoid - {region for _, region in closed}}
        require(not shut, f"{robot.name} does not know of {', '.join(sorted(shut))}")
        for name, value in task.knowledge.items():
            where = task.whereabouts(name, value)
            later = self.tick and record["tracking"] == "belief"  # it may have moved since the look
            there = self.robots[name].places & (self.world.around(where) if later else where)
            require(there, f"{robot.name} believes {name} to be where it is not")
        return task

    def met_obstacles(self) -> list[Obstacle]:
        """Return the obstacles that some robot has encountered, and that still stand."""
        return [o for o in self.obstacles.values() if o.known and o.present]

    def alter(self, obstacle: Obstacle, **changes: Any) -> None:
        self.obstacles[obstacle.name] = obstacle._replace(**changes)

    def discover(self, data: Json, *, present: bool) -> None:
        needs, robots = list[Need](), self.robots.values()
        for need in data.get("needs") or [{**data, "regions": data["resolution_regions"]}]:
            able = frozenset(r.name for r in robots if need["action"] in r.data["capabilities"])
            how = need.get("robots", 1), need.get("together", False), need.get("same", False)
            needs.append(Need(able, frozenset(need["regions"]), *how))
        for k in range(len(needs) - 1, 0, -1):
            if needs[k].same:  # whoever cannot do both does neither
                needs[k - 1] = needs[k - 1]._replace(able=needs[k - 1].able & needs[k].able)
        names = {SOMEBODY, *self.robots, *(f"robots.{name}" for name in self.robots)}
        require(data["name"] not in names, "an obstacle has the name of a robot")
        require(data["name"] not in self.obstacles, f"{data['name']} already exists")
        if data.get("until") is not None:
            self.passing.add(data["name"])
        about = data["name"], data["region"], frozenset(data["blocks"]), (*needs,), (*needs,)
        self.obstacles[data["name"]] = Obstacle(*about, present, data["traversable"])

    def foretell(self, record: Json) -> None:
        """Refuse unless the bound on a resolution is what is found here."""
        of, due, least = record["of"], record["due"], self.earliest(record["of"])
        require(least == record.get("earliest"), f"{of} can be resolved from tick {least} on")
        if record["verdict"] == "lost":
            require(least is None or least > due, f"{of} can be resolved by tick {due}")
            when = "ever" if least is None else f"before tick {least}"
            said = f"{of} cannot be resolved {when}, whatever the robots do"
            self.claim("lost", f"{said}; it is due at tick {due}.")

    def earliest(self, wanted: str) -> int | None:
        """Return the earliest tick in which an open obstacle can be resolved, if robots do not
        collide and are never busy, and all open obstacles are gone when they can be; None: never.
        Turn ``tick * n + k`` is that of robot k of n."""
        names, count = [*self.robots], len(self.robots)
        had, never = self.turn - (self.tick - 1) * count, 1 << 40
        now = self.tick * count + had - 1
        start = dict[str, tuple[Pose, int]]()
        for k, (name, robot) in enumerate(self.robots.items()):
            ready = self.tick - (k >= had)
            if robot.pose != robot.destination:
                least = robot.data.get("timing", {}).get("least", 1)
                ready = max(ready + 1, robot.begun + least - 1)
            start[name] = robot.destination, ready
        stays = [o for o in self.obstacles.values() if o.name not in self.passing]
        opens = [o for o in stays if o.known and o.present and o.sealed is None and o.left]
        met = {o.name: [never] * len(o.left) for o in opens}

        def until(name: str, region: int) -> int:
            """The turn after which a robot may enter a region."""
            if any(name in (o.sealed or ()) and o.region == region for o in stays):
                return never
            turns = [-1]
            for o in opens:
                if o.region == region and name in o.blocks:
                    last = o._replace(left=o.left[-1:])
                    ends = met[o.name] if last.stands(name) else [-1, *met[o.name][:-1]]
                    turns.append(ends[-1])
            return max(turns)

        def ways(name: str, seeds: dict[Pose, int]) -> dict[Pose, int]:
            """The earliest tick at whose end a robot is in each pose."""
            data, k, best, queue = self.robots[name].data, names.index(name), dict(seeds), [*seeds]
            takes = (data.get("timing") or {}).get("least", 1)
            for pose in queue:
                for to in self.world.moves(data["mobility"], pose) - {pose}:
                    after = until(name, to[0])
                    ends = max(best[pose] + 1, (after - k) // count + 1) + takes - 1
                    if after < never and ends < best.get(to, never):
                        best[to] = ends
                        queue.append(to)
            return best

        def turns_of(o: Obstacle) -> list[int]:
            found, before, fields = list[int](), now + 1, dict[str, dict[Pose, int]]()
            for number, need in enumerate(o.left):
                former, fields, there = fields, {}, list[int]()
                for k, name in enumerate(names):
                    done = not number and name in o.done
                    if name not in need.able and not done:
                        continue
                    seeds = dict([start[name]])
                    if need.same and number and not (number == 1 and name in o.done):
                        had_part = former.get(name, {}).items()
                        at, since = o.left[number - 1].regions, before // count
                        seeds = {p: max(t, since) for p, t in had_part if p[0] in at}
                    fields[name] = ways(name, seeds)
                    ticks = [t for p, t in fields[name].items() if p[0] in need.regions]
                    if ticks and not done:
                        turn = max(min(ticks) * count + k, before)
                        there.append(turn if need.together else turn + (k - turn) % count)
                missing = need.robots - (0 if number else len(o.done))
                before = [*sorted(there), *[never] * missing][missing - 1]
                found.append(before)
            return found

        while (after := {o.name: turns_of(o) for o in opens}) != met:
            met = after
        if wanted not in met:
            return self.tick
        return None if met[wanted][-1] >= never else met[wanted][-1] // count

    def clear(self, obstacle: Obstacle) -> None:
        """Refuse if an obstacle appears where a robot is that must not be there."""
        inside = [n for n, r in self.robots.items() if obstacle.region in r.places]
        there = self.external or not any(map(obstacle.stands, inside))
        require(there, f"{obstacle.name} stands where {' and '.join(inside)} is")

    def charges(self, robot: Robot, objective: Objective) -> bool:
        """Return whether an objective is to charge the robot's battery."""
        stays = objective.kind == "hold" or (
            objective.kind == "visit" and len(objective.targets) < 2
        )
        return robot.charge is not None and stays and objective.targets[0] <= self.chargers

    def discharge(self, record: Json, robot: Robot) -> None:
        """Refuse if a charge does not suffice for a step."""
        battery, charge = robot.battery, robot.charge
        if charge is None or record.get("toward") is not None:
            return
        if record["to"] != record["from"]:
            require(charge >= battery["move"], f"{robot.name} has no charge for a step")
            robot.charge = charge - battery["move"]
        elif record["to"] in self.chargers:
            robot.charge = min(battery["capacity"], charge + battery["charge"])
        else:
            robot.charge = max(0, charge - battery["stay"])

    def move(self, record: Json, robot: Robot) -> None:
        due = self.tick - 1, [*self.robots].index(robot.name)
        require(divmod(self.turn, len(self.robots)) == due, f"it is not {robot.name}'s turn")
        done = [o.name for o in self.obstacles.values() if o.present and not o.left]
        require(not done, f"the resolution of {', '.join(done)} is not recorded")
        asked = self.stack[-1][0] if self.stack else None
        require(not asked or self.obstacles[asked].present, f"a request for {asked} is left open")
        what, who, turn = self.met or ("", "", self.turn)
        if turn < self.turn and (what, who) not in [entry[:2] for entry in self.stack]:
            left = self.obstacles[what].present and self.obstacles[what].sealed is None
            require(not left, f"{who} met {what}, and no request of it is on the stack")
        self.turn += 1
        pose = (record["to"], record.get("heading"))
        if robot.pose == robot.destination:
            robot.begun = self.tick
        self.discharge(record, robot)
        try:
            require("failed" not in record, "its step has failed")
            after = self.step(record, robot, pose)
        except RefusedError:
            failed = self.external or "failed" in record
            if not failed or pose[0] not in self.world.free:
                raise
            self.strayed += 1  # of an external world: it is not where it was sent
            after, robot.nodes = pose, set()
            if "failed" in record and robot.task:  # it continues from there
                robot.nodes = robot.task.of_pose.get(pose, set())
        robot.pose, robot.destination, robot.back = pose, after, {}
        robot.places = {pose[0], after[0]}
        robot.goals += robot.held()
        if not self.external and not self.live:
            at = {name: other.pose for name, other in self.robots.items()}
            self.obstacles = {n: o.worked(at, {robot.name}) for n, o in self.obstacles.items()}

    def step(self, record: Json, robot: Robot, to: Pose) -> Any:
        """Refuse unless a move is legal and agrees with the trace. Returns where it ends. If the
        node is unknown, all nodes in its pose are possible: from each the strategy keeps its
        guarantees."""
        name, task, before, by = robot.name, robot.task, robot.pose, record.get("by") or "strategy"
        toward, moves = record.get("toward"), self.world.moves(robot.data["mobility"], before)
        after: Any = to if toward is None else next((p for p in moves if p[0] == toward), None)
        legal = after in moves and robot.destination in (before, after)
        legal = legal and record["from"] == before[0] and (toward is None or to == before)
        require(legal, f"{name} cannot go from {before} to {toward or to}")
        shut = {o.region for o in self.obstacles.values() if o.stands(name)} - {before[0]}
        shut = shut.union(*(o.near(robot) for o in self.robots.values() if o is not robot))
        require(not shut & {to[0], after[0]}, f"{name} goes to {after[0]}, where something stands")
        robot.signal = record.get("signal") or robot.signal
        if robot.destination != before:
            return after  # it was decided before
        require(task, f"{name} has no strategy")
        kept = after == before or robot.own.permits(before, after)
        require(kept, f"{name} goes to {after[0]}, against its objective")
        robot.answers = task.answers(robot, self.robots, record.get("busy", ()), self.external)
        require(robot.active or by == "stay", f"{name} moves, though it is out of service")
        there, answers = task.of_pose.get(after, set()), robot.answers
        node = robot.back["node"] if by == "backtrack" else None
        if node is not None:
            answers = {node} & {*chain(*(task.graph.next[n] for n in robot.nodes))}
        fits = {n for n in answers if task.poses[n] == after}
        if by == "plan":
            require(robot.way[:2] == [before, after], f"{name} leaves its plan")
            robot.way, fits = robot.way[1:], there
            robot.forms.add("alternation")  # a plan crosses what it must
        elif by == "stay" or (by == "backtrack" and node is None):
            require(after == before, f"{name} moves, though it should stay")
            seen = {f"at_{other}": robot.knowledge[other] for other in task.tracked}
            seen |= {name: robot.heard[name] for name in task.heard}
            kept = {n for n in there if seen and task.knows(n, seen)} | robot.nodes
            fits = (kept if by == "stay" else kept | fits) if answers else there
        else:
            said = sorted({str(task.poses[n]) for n in answers})
            require(fits, f"{name} goes to {after}, but its strategy answers {said}")
            self.answered += by != "backtrack"
        robot.came_from, robot.nodes = robot.nodes, fits
        return after

    def outcome(self, record: Json) -> str:
        """Return what is established of how the run ended."""
        what, rounds = record["outcome"], self.scenario["until"].get("rounds") or 0
        if what == "completed":
            for name, robot in self.robots.items():
                own = robot.own.data == robot.data["objective"] or not robot.data.get("when")
                require(own, f"an input keeps {name} from its objective")
                met = min(map(robot.goals.count, robot.own.goals))
                its_own = robot.objective.serves(robot.own) or self.charges(robot, robot.objective)
                require(met >= rounds and its_own, f"{name} has met it {met} times")
            often = "once" if rounds == 1 else f"{rounds} times"
            said = f"every robot has met its objective {often} after the last resolution"
            return f"The mission is completed: {said}."
        if what == "tick_limit":
            most = self.scenario["limits"]["ticks"]
            require(self.tick == most, f"the limit is {most} ticks, not {self.tick}")
            return f"The run ended at its limit of {most} ticks."
        if what == "unrealizable" and self.hopeless and not self.turn:
            return "The mission never began: a robot has no strategy."
        if what != "operator_needed":
            what = what.replace("_", " ")
            return f"The run ended early ({what}); no claim about its goal."
        proof, specs = record.get("proof"), record.get("unrealizable") or {}
        if record.get("cause") == "out_of_service":
            out = [name for name, robot in self.robots.items() if not robot.active]
            require(out, "no robot is out of service")
            return f"An operator is needed: {' and '.join(out)} out of service."
        if proof is None:
            require(specs and specs.items() <= self.hopeless, "a negative without a proof")
            said = f"there is no strategy for {' and '.join(specs)}"
        elif record.get("cause") == "deadlock":  # the proof holds only robots and number of rounds
            (team := Team(self, proof["robots"])).exhaust(min(proof["goal"]["rounds"], rounds))
            said = f"no order of moves of {' and '.join(team.robots)} completes the mission"
        else:
            never = Team(self, out=[n for n, r in self.robots.items() if not r.active]).never()
            require(SOMEBODY in never, "every robot can continue, whatever can never be resolved")
            stuck = " and ".join(sorted(never & {*self.robots})) or "in each case some robot"
            said = f"{stuck} cannot continue, whatever the robots in service with strategies do"
        return f"An operator is needed: {said}."


def read_json(file: Any) -> Any:
    try:
        return json.loads(file.read_bytes())
    except ValueError as error:
        raise RefusedError(f"{file.name} is not valid JSON: {error}") from error


def open_bundle(place: Path) -> tuple[dict[str, Any], Json]:
    """Return the files of a bundle, each as its manifest states, and the manifest."""
    if place.is_dir():
        found = [path for path in place.rglob("*") if path.is_file()]
        files: dict[str, Any] = {path.relative_to(place).as_posix(): path for path in found}
    else:
        archive = zipfile.ZipFile(place)
        names = [name for name in archive.namelist() if name[-1] != "/"]
        files = {name: zipfile.Path(archive, name) for name in names}
    manifest = read_json(files.pop("manifest.json"))
    known = (manifest["format"], manifest["version"]) == ("safenav-bundle", 4)
    require(known, "not a bundle of version 4; an older one has its own check.py")
    different = sorted({*files} ^ {*manifest["files"]})
    require(not different, f"{', '.join(different)} is either missing or not in the manifest")
    for path, file in files.items():
        data = file.read_bytes()
        facts = {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        require(facts == manifest["files"][path], f"{path} is not the file that the manifest names")
        own = re.match(r"(?:specs|strategies)/(.*?)\.", path)
        require(not own or own[1] == facts["sha256"], f"{path} is not named by its sha256")
        if re.fullmatch(r"source/.*\.ya?ml", path):  # the map, if it is drawn there
            world = read_json(files["scenario.json"])["map"]
            parts = re.split(r"[\[\]{},:\n]", data.decode())
            rows = [r for p in parts for r in re.findall(r"^[\s'\"-]*([#.]+)[\s'\"-]*$", p)]
            drawn = [row for row in rows if len(row) > 1 or world["cols"] == 1]
            same = drawn == world["grid"] or {*"#."} not in map(set, drawn)
            require(same, f"the map in {path} is not that of scenario.json")
    return files, manifest


def check(place: Path, *, compare: bool = True) -> tuple[str, str, list[Json]]:
    """Return the verdict, the reason, the claims that are established (``compare``: the
    manifest's)."""
    run, verdict, reason = None, "refused", ""
    try:
        files, manifest = open_bundle(place)
        run = Run(files)
        run.replay()
        same = not compare or manifest["claims"] == run.claims
        require(same, "the manifest does not claim what the evidence establishes")
        if "assurance.json" in files or "index.html" in files:
            run.check_page()
        verdict = "accepted"
    except base.TooLargeError as error:
        verdict, reason = "too large", str(error)
    except RefusedError as error:
        reason = str(error)
    except Exception as error:
        reason = f"a file is not as documented: {error!r}"
    where = f"trace.jsonl, line {run.line}: " if run and run.line else ""
    return verdict, where + reason, run.claims if run else []


def main() -> int:
    parser = argparse.ArgumentParser(description="Check a bundle of safenav.")
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--json", action="store_true", help="print what is established as JSON")
    parser.add_argument("--any-claims", action="store_true", help="whatever the manifest claims")
    options = parser.parse_args()
    if not (options.bundle / "manifest.json").is_file() and not zipfile.is_zipfile(options.bundle):
        print(f"{options.bundle} is not a bundle: a folder with a manifest.json, or a .zip of one")
        return 2
    verdict, reason, claims = check(options.bundle, compare=not options.any_claims)
    if options.json:
        print(json.dumps({"verdict": verdict, "reason": reason, "claims": claims}))
    else:
        said = [f"  {claim['id']}: {claim['text']}" for claim in claims]
        print("\n".join([*said, f"{verdict}: {reason}" if reason else verdict]))
    return {"accepted": 0, "refused": 1, "too large": 3}[verdict]


if __name__ == "__main__":
    sys.exit(main())
