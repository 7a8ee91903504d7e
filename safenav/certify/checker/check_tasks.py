"""The demands of a scenario on a strategy, computed without the text of its specification: the
robot, its objective, its assumptions about other robots, and the possible inputs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterable
from functools import cache
from itertools import chain, product, repeat
from typing import Any

from safenav.audit.kinds import ALTERNATION
from safenav.audit.language import HEADINGS, Pose, Row, complete, named, primed, require
from safenav.audit.world import World
from safenav.certify.checker.check_objectives import Objective
from safenav.certify.checker.check_strategies import (
    Edges,
    Json,
    Met,
    Strategy,
    check_strategy,
    poses_of,
)

ASSUMED = {
    "none": "whatever the other robots do",
    "out_of_my_way": "if infinitely often no other robot is beside it",
    "off_my_targets": "if infinitely often the other robots are off its targets",
    "out_of_my_sight": "if infinitely often the other robots are out of its sight",
    "at_its_targets": "if infinitely often the other robots are at their own targets",
}


TOLD = ("request", "wait", "assigned")


def circumstances(line: Json) -> str:
    """Return a checksum that identifies the task of a strategy and its initial state."""
    passing = ("tick", "t", "reason", "seconds", "cached")
    kept = {key: value for key, value in line.items() if key not in passing}
    return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()


class Task:
    """The scenario's rules for a robot, and its strategy or counterstrategy (``graph``). ``robot``:
    its entry in the scenario; ``line``: the ``synthesis`` line with its circumstances; ``cells``:
    the partition of the map for beliefs."""

    name = "the scenario"

    def __init__(self, world: World, robot: Json, line: Json, cells: Any, graph: Strategy) -> None:
        self.world, self.robot, self.line, self.graph = world, robot, line, graph
        self.pose: Pose = (line["region"], line.get("heading"))
        self.objective = Objective(line["objective"]).formed(line.get("form"))
        self.targets, self.own = self.objective.targets, [*self.objective.memory]
        self.memory: dict[str, int] = dict(line.get("memory") or {})
        self.heard = self.objective.inputs
        self.inputs = {name: int(on) for name, on in (line.get("inputs") or {}).items()}
        self.closed = {region for region, _ in line.get("closed") or ()}
        self.leaves = self.closed & {line["region"]}  # its start, if closed: it never returns
        self.forbidden = poses_of(line.get("forbidden") or (), robot["mobility"])
        self.moving = list(line.get("moving") or ())
        slow = world.live and self.moving and robot["tracking"] != "nearby"
        require(not slow, "in a live run it relies on the speed of robots in conflict with it")
        self.places = line.get("places")  # its assignable regions (``assignable``), or None
        # Knowledge of another robot is a region, or a belief: a set of cells, with a number above
        # those of the regions.
        self.cells, listed = [frozenset(cell) for cell in cells or ()], line.get("beliefs") or {}
        self.beliefs = {name: [frozenset(b) for b in known] for name, known in listed.items()}
        known = (line.get("knowledge") or {}).items()
        self.knowledge = {name: self._number(name, what) for name, what in known}
        self.nearby = robot["tracking"] == "nearby"
        self.tracked = [] if self.nearby else [*self.knowledge]
        self.positions = {f"at_{name}": self.knowledge[name] for name in self.tracked}
        self.told = TOLD if self.places is not None else ()
        sides = world.sides if self.nearby and self.moving else ()
        self.busy = {f"busy_{side}": side for side in sides}
        # Values of each node: its pose, its own memory, the target that it remembers, and the
        # target that it awaits (the next one if the remembered target is reached there).
        targets, nothing, turns = self.targets, [0] * graph.count, robot["mobility"] == "heading"
        self.regions = graph.columns["region"]
        turned = [HEADINGS[h] for h in graph.columns["heading"]] if turns else repeat(None)
        self.poses: list[Pose] = [*zip(self.regions, turned, strict=False)]
        self.of_pose: dict[Pose, set[int]] = {}  # the nodes that runs reach, by their pose
        own, last, awaited = graph.rows(self.own), nothing, nothing
        if self.objective.shape.in_turn:
            last = graph.columns.get(next(iter(self.memory), ""), nothing)
            here, count = zip(last, self.regions, strict=True), len(targets)
            turns_met = [k + (region in targets[k]) for k, region in here]
            settles = self.objective.shape.settles  # from the last one on it awaits that
            awaited = [min(k, count - 1) if settles else k % count for k in turns_met]
        self.before = [*zip(self.poses, awaited, own, graph.rows(self.heard), strict=True)]
        self.done = [*zip(self.poses, last, own, strict=True)]
        names = [*self.told, *self.busy, *self.positions, *self.heard]
        inputs = graph.spec.inputs
        require(names == inputs, f"the inputs are {inputs}, but should be {names}")
        self.deciding = [*self.told, *self.own, *self.positions]
        self.asked = [*zip(self.poses, graph.rows(self.deciding), strict=True)]
        self.expected, self.replies_at = cache(self._expected), cache(self._replies_at)
        self.memories = cache(self._memories)

    def _expected(self, asked: tuple[Pose, Row]) -> set[Row]:
        """Return the possible next inputs from a pose, given commands, memory and knowledge."""
        (pose, row), groups = asked, list[Collection[Row]]()  # independent groups of inputs
        values = dict(zip(self.deciding, row, strict=True))
        if self.told:
            again = values["request"] and not values["wait"]
            places: Any = {values["assigned"]} if again else self.places
            sent = [(1, 0, place) for place in places if self.is_sent(pose, values, place)]
            idle = [(*command, self.line["neutral"]) for command in ((0, 0), (0, 1), (1, 1))]
            groups.append([*sent, *idle])
        if self.busy:
            beside = (self.world.step(pose[0], side) for side in self.busy.values())
            rows = product(*((0,) if region is None else (0, 1) for region in beside))
            many = self.robot.get("zones")  # one other robot can close several regions
            groups.append([row for row in rows if many or sum(row) <= len(self.moving)])
        for name in self.tracked:
            after = self.after(name, pose[0], values[f"at_{name}"])
            groups.append([(value,) for value in after])
        groups += [[(0,), (1,)] for _ in self.heard]
        return {tuple(chain(*rows)) for rows in product(*groups)}

    def is_sent(self, pose: Pose, values: Json, place: int) -> bool:
        """Return whether the robot may be commanded to a region from a pose with its memory."""
        ways = [way for way in self.line.get("places_from") or () if place in way["places"]]
        here = [w for w in ways if pose in poses_of(w["from"], self.robot["mobility"])]
        return not ways or any((way.get("memory") or {}).items() <= values.items() for way in here)

    def after(self, name: str, region: int, value: int) -> set[int]:
        """Return the possible next knowledge of another robot, given the present ``value``. The
        other robot stays or moves, but not onto this robot if they are in conflict; then this robot
        looks."""
        reach = self.world.later(self.whereabouts(name, value))
        reach -= {region} if name in self.moving else set()
        seen = {r for r in reach if self.sees(region, r)}
        hidden = (k for k, cell in enumerate(self.cells) if cell & (reach - seen))
        return seen | ({self._number(name, hidden)} if seen != reach else set())

    def sees(self, here: int, there: int) -> bool:
        radius, closed = self.robot.get("vision"), self.line.get("sight_closed") or ()
        return self.robot["tracking"] == "exact" or self.world.sees(here, there, radius, closed)

    def _number(self, name: str, known: int | Iterable[int]) -> int:
        if isinstance(known, int):
            return known
        belief, listed = frozenset(known), self.beliefs.get(name, ())
        require(belief in listed, f"no input says that {name} may be in the cells {sorted(belief)}")
        return self.world.size + listed.index(belief)

    def whereabouts(self, name: str, value: int) -> frozenset[int]:
        """Return the regions where another robot may be, given the knowledge ``value`` of it."""
        if value < self.world.size:
            return frozenset({value})
        cells = self.beliefs[name][value - self.world.size]
        return frozenset().union(*(self.cells[cell] for cell in cells))

    def taken(self, region: int, seen: Json) -> set[int | None]:
        """Return the regions that the robot observes as occupied before its move."""
        if not self.nearby:
            return {seen[f"at_{name}"] for name in self.moving}
        return {self.world.step(region, side) for busy, side in self.busy.items() if seen[busy]}

    def replies(self, node: int, row: Row) -> set[Any]:
        return self.replies_at(self.before[node], row)

    def _replies_at(self, before: tuple[Pose, int, Row, Row], row: Row) -> set[Any]:
        """Return the possible replies to an observation: pose, awaited target, memory."""
        (pose, awaited, memory, heard), shape = before, self.objective.shape
        seen = dict(zip(self.graph.spec.inputs, row, strict=True))
        due = not shape.in_turn or awaited == len(self.targets) - 1
        held = shape.settles and due and pose[0] in self.targets[-1]
        held = held and not seen.get("request")
        stays = held or seen.get("wait")
        moves = {pose} if stays else self.world.moves(self.robot["mobility"], pose)
        shut = self.taken(pose[0], seen) | (self.closed - ({pose[0]} & self.leaves))
        if shape.strict:  # none of the targets whose turn it is not
            shut = shut.union(*(t for k, t in enumerate(self.targets) if k != awaited))
        legal = [after for after in moves - self.forbidden if after[0] not in shut]
        hears = (*heard, *(seen[name] for name in self.heard))
        ways = ((after, self.memories(memory, hears, pose, after)) for after in legal)
        return {(after, awaited, way) for after, some in ways for way in some}

    def _memories(self, memory: Row, hears: Row, pose: Pose, after: Pose) -> set[Row]:
        """Return the possible next memory. ``hears``: inputs, before the step and after it."""
        names = (*self.own, *self.heard, *primed(self.heard))
        known = dict(zip(names, (*memory, *hears), strict=True)) | named(pose, after)
        return complete(self.objective.ranges, primed(self.own), self.objective.safety, known)

    def starts(self) -> set[Row]:
        first = dict.fromkeys(self.graph.spec.inputs, 0) | self.positions | self.inputs
        first |= {"assigned": self.line["neutral"]} if self.told else {}
        return {tuple(first.values())}

    def openings(self, _: Row) -> set[Any]:
        if self.memory and self.own:
            return {(self.pose, 0, tuple(self.memory[name] for name in self.own))}
        ways = complete(self.objective.ranges, self.own, self.objective.init, named(self.pose))
        return {(self.pose, max(self.memory.values(), default=0), way) for way in ways}

    def allowed(self, edges: Edges) -> Met:
        before, inputs, done, replies = self.before, self.graph.inputs, self.done, self.replies_at
        steps = zip(*edges, strict=True)
        return [done[after] in replies(before[node], inputs[after]) for node, after in steps]

    def describe(self, node: int, target: int) -> str:
        observed = dict(zip(self.graph.spec.inputs, self.graph.inputs[target], strict=True))
        return f"from {self.poses[node]} to {self.poses[target]}, observing {observed}"

    def met(self, edges: Edges) -> tuple[list[Met], list[Met]]:
        """Return for each goal, and for each assumption, the edges on which it is met. The robot's
        own goals may wait while it is commanded to a region."""
        graph, regions, targets = self.graph, self.regions, self.targets
        counts = self.objective.goals
        goals = [[regions[node] in target for node in edges[1]] for target in targets]
        if self.objective.shape.in_turn:
            steps = zip(*edges, strict=True)
            ends = [(self.before[node][1], after) for node, after in steps]
            goals = [[regions[after] in targets[k] and k in counts for k, after in ends]]
        goals += [graph.holds([clause], edges) for clause in self.objective.liveness]
        if self.told:
            request, wait, place = (graph.columns[name] for name in TOLD)
            sent = [request[node] == 1 for node in edges[1]]
            goals = [[s or good for s, good in zip(sent, met, strict=True)] for met in goals]
            arrived = (wait[node] == 1 or place[node] == regions[node] for node in edges[1])
            goals.append([not s or there for s, there in zip(sent, arrived, strict=True)])
        assumed, steps = cache(self.assumed), zip(*edges, strict=True)
        held = [assumed(regions[node], graph.inputs[after]) for node, after in steps]
        return goals, [list(each) for each in zip(*held, strict=True)]

    def assumed(self, region: int, row: Row) -> list[bool]:
        """Return for each assumption whether it is met at a step from a region. A belief meets an
        assumption that it allows. While the robot is commanded to wait (assumed to end), no
        assumption is met."""
        seen = dict(zip(self.graph.spec.inputs, row, strict=True))
        found, fairness = [True] if self.told else [], self.line["fairness"]
        if fairness == "out_of_my_way":
            found.append(not self.world.around([region]) & self.taken(region, seen))
        for name in () if self.nearby or fairness == "none" else self.moving:
            where = self.whereabouts(name, seen[f"at_{name}"])
            if fairness == "out_of_my_sight" and self.beliefs.get(name):
                found.append(seen[f"at_{name}"] >= self.world.size)
            elif fairness == "off_my_targets":
                found += [bool(where - target) for target in self.targets]
            elif fairness == "at_its_targets":
                aims = Objective({ALTERNATION: self.line["others_targets"][name]}).targets
                found += [bool(where & aim) for aim in aims]
        for name in self.heard:
            found += [seen[name] == value for value in (self.line.get("again") or {}).get(name, ())]
        return [held and not seen.get("wait") for held in found]

    def begin(self, start: int) -> list[int]:
        """Return the initial nodes; with assignable goals also those with a command to wait."""
        return [start, *(self.graph.begin if self.told else ())]

    def check_keeps(self, start: int, measures: Any) -> None:
        """Refuse unless every run of the strategy from ``start`` keeps the scenario's rules."""
        known = named(self.pose) | self.memory | self.positions | self.inputs
        given = {name: self.graph.columns[name][start] for name in known}
        require(given == known, f"its initial inputs are {given}, not {known}")
        begun = self.done[start] in self.openings(self.graph.inputs[start])
        require(begun, "its initial state violates the objective")
        nodes = self.graph.reach(self.begin(start))
        check_strategy(self, self.graph, nodes, measures)
        for node in nodes:
            self.of_pose.setdefault(self.poses[node], set()).add(node)
        del self.before, self.done, self.asked, self.expected, self.replies_at, self.memories

    def answers(self, robot: Any, robots: Json, shown: Iterable[int], lenient: bool) -> set[int]:
        """Return the successors of the robot's nodes for its present observation in a run, and
        update its knowledge. ``shown``: regions that it observes as occupied although no robot is
        there; ``lenient``: accept a robot outside every possible belief."""
        here, seen = robot.pose[0], {name: int(robot.signal[name]) for name in self.told}
        taken = {*shown}.union(*(robots[name].near(robot) for name in self.moving))
        for busy, side in self.busy.items():
            seen[busy] = int(self.world.step(here, side) in taken)
        seen |= {name: robot.heard[name] for name in self.heard}
        for name in self.tracked:
            there = robots[name].pose[0]
            if not self.sees(here, there):
                found = self.after(name, here, robot.knowledge[name])
                hidden = {value for value in found if there in self.whereabouts(name, value)}
                require(hidden or lenient, f"{name} is outside every possible belief")
                there = max(hidden or found)
            seen[f"at_{name}"] = robot.knowledge[name] = there
        robot.row = tuple(seen[name] for name in self.graph.spec.inputs)
        return self.following(robot.nodes, robot.row)

    def following(self, nodes: Iterable[int], row: Row) -> set[int]:
        """Return the successors of some nodes for an input."""
        graph = self.graph
        return {n for n in chain(*map(graph.next.__getitem__, nodes)) if graph.inputs[n] == row}

    def alike(self, nodes: Iterable[int]) -> set[int]:
        """Return the reachable nodes with the same values as some of these: a robot with assignable
        goals may continue from any of them."""
        there = set[int]().union(*(self.of_pose.get(self.poses[node], ()) for node in nodes))
        columns = [*self.graph.columns.values()]
        values = {node: tuple(column[node] for column in columns) for node in there.union(nodes)}
        same = {values[node] for node in nodes}
        return {node for node in there if values[node] in same}

    def knows(self, node: int, values: Json) -> bool:
        columns = self.graph.columns
        return all(columns[name][node] == value for name, value in values.items())

    def meets(self, goal: int, before: Iterable[int], after: Collection[int]) -> bool:
        """Return whether a step may meet a goal of the objective's formulas: True also if no edge
        for the step is known."""
        steps = [(node, a) for node in before for a in self.graph.next[node] if a in after]
        edges = [node for node, _ in steps], [node for _, node in steps]
        return not steps or any(self.graph.holds([self.objective.liveness[goal]], edges))
