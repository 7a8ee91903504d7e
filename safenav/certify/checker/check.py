"""Check a bundle: the proof that a run of robots did what it should, by strategies that had to.

    python3 -I -S check.py BUNDLE [--json]

BUNDLE is a folder or a .zip. Exit status 0: accepted; 1: refused, with the first reason; 2: no
bundle; 3: larger than this checker takes on. Only Python's standard library is needed.

What it establishes, from the files of the bundle alone:
- *specification -> strategy*: each strategy realizes the text of its specification, and each
  counterstrategy shows that none does (check_strategies.py);
- *scenario -> strategy*: the same strategies keep the scenario's own rules, read from its data and
  not from formulas: the map, the mobility, known obstacles, regions observed as taken, and the
  objective again and again unless a named assumption fails (``Validation``). Counterstrategies
  beat a robot that has all the freedom which the scenario leaves;
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
from itertools import chain, combinations, pairwise, product, repeat
from math import prod
from pathlib import Path
from typing import Any

sys.dont_write_bytecode = True  # a bundle stays as it is
sys.path.insert(0, str(Path(__file__).resolve().parent))

from check_strategies import (  # noqa: E402
    Formula,
    RefusedError,
    Row,
    Specification,
    Strategy,
    TooLargeError,
    check_counterstrategy,
    check_strategy,
    complete,
    read_clause,
    read_specification,
    read_variable,
)

MOST_STATES = 200_000
MOST_MEMORY = 64
Json = Mapping[str, Any]

# ---------------------------------------------------------------- the world

HEADINGS = ("north", "east", "south", "west")
Pose = tuple[int, str | None]
"""A region, and the heading of robots that have one."""


Assumption = tuple[str, str, frozenset[int]]


class World:
    """The map of the scenario: which regions are free, and which lie next to each other."""

    def __init__(self, data: Json) -> None:
        cells = "".join(data["grid"])
        self.rows, self.cols, self.size = data["rows"], data["cols"], len(cells)
        if [len(line) for line in data["grid"]] != [self.cols] * self.rows or set(cells) - {*"#."}:
            raise RefusedError(
                "the map is not as large as it says, or has other cells than # and ."
            )
        self.free = frozenset(region for region, cell in enumerate(cells) if cell == ".")
        tall, wide = self.rows > 1, self.cols > 1
        self.sides = [h for h in HEADINGS if (tall if h in ("north", "south") else wide)]
        self._sight: dict[Any, bool] = {}

    def step(self, region: int, heading: str) -> int | None:
        """The free region on that side, or None."""
        row, col = divmod(region, self.cols)
        row += {"north": -1, "south": 1}.get(heading, 0)
        col += {"west": -1, "east": 1}.get(heading, 0)
        inside = 0 <= row < self.rows and 0 <= col < self.cols
        beyond = row * self.cols + col
        return beyond if inside and beyond in self.free else None

    def around(self, regions: Iterable[int]) -> set[int]:
        """The regions and their free neighbours."""
        near = {r: (r, *(self.step(r, heading) for heading in HEADINGS)) for r in regions}
        return {r for r in chain(*near.values()) if r is not None}

    def moves(self, mobility: str, pose: Pose) -> set[Pose]:
        """The poses after one step or none. With heading mobility a robot never goes backwards,
        faces the way of its step, and keeps its heading while it stays."""
        found = {pose}
        for heading in HEADINGS:
            beyond = self.step(pose[0], heading)
            if beyond is not None and mobility == "free":
                found.add((beyond, None))
            elif beyond is not None:
                turn = HEADINGS.index(heading) - HEADINGS.index(str(pose[1]))
                found |= {(beyond, heading)} if turn % 4 != 2 else set()
        return found

    def sees(self, a: int, b: int, radius: float | None, closed: frozenset[int]) -> bool:
        """Whether region b is in sight from a. The distance of the centres is at most the
        radius; the segment between them passes through the interior of no wall or closed region,
        and not between two of them that touch at a corner."""
        key = (min(a, b), max(a, b), radius, closed)
        if key not in self._sight:
            (row, col), (row_b, col_b) = divmod(a, self.cols), divmod(b, self.cols)
            down, right = row_b - row, col_b - col
            near = radius is None or down * down + right * right <= radius * radius
            self._sight[key] = near and self._line(row, col, down, right, closed - {a, b})
        return self._sight[key]

    def _line(self, row: int, col: int, down: int, right: int, closed: frozenset[int]) -> bool:
        touched = set()
        for r in range(min(0, down), max(0, down) + 1):
            for c in range(min(0, right), max(0, right) + 1):
                region = (row + r) * self.cols + col + c
                if region in self.free and region not in closed:
                    continue
                apart = 2 * abs(down * c - right * r)  # twice the distance, times the length
                if apart < abs(down) + abs(right):
                    return False
                if apart == abs(down) + abs(right):
                    touched.add((r, c))
        across = (1 if down > 0 else -1, 1 if right > 0 else -1)
        return not any((r + across[0], c - across[1]) in touched for r, c in touched)


def poses_of(listed: Iterable[Sequence[Any]], mobility: str) -> frozenset[Pose]:
    """Places ``[region, heading]``; null stands for any heading."""
    every = HEADINGS if mobility == "heading" else (None,)
    return frozenset((r, h) for r, given in listed for h in ((given,) if given else every))


def targets_of(objective: Json) -> list[frozenset[int]]:
    """The targets of an objective: sets of regions of which any one counts."""
    ((kind, value),) = objective.items()
    listed = [value] if kind == "hold" else value if kind != "ltl" else []
    return [frozenset([t] if isinstance(t, int) else t) for t in listed]


def coordinates(pose: Pose) -> Row:
    """The pose as variables have it: region, and heading if any."""
    return (pose[0],) if pose[1] is None else (pose[0], HEADINGS.index(pose[1]))


def named_coordinates(pose: Pose) -> dict[str, int]:
    return dict(zip(("region", "heading"), coordinates(pose), strict=False))


def formulas_of(objective: Json, part: str) -> list[str]:
    """The objective's own formulas: ``init``, ``safety`` or ``liveness``."""
    found = objective.get("ltl", {}).get(part, ())
    return [found] if isinstance(found, str) else list(found)


def named(formula: Formula) -> Formula:
    """The formula with headings as numbers."""
    if formula[0] == "var" and formula[1] in HEADINGS:
        return ("num", HEADINGS.index(formula[1]))
    return tuple(named(part) if isinstance(part, tuple) else part for part in formula)


# ---------------------------------------------------------------- scenario -> strategy


class Validation:
    """A strategy or a counterstrategy against the scenario itself, without the formulas of its
    specification (an objective in formulas brings its own). ``line``: the ``synthesis`` line of
    the trace; ``robot``: its entry in the scenario; ``cells``: of which beliefs are made."""

    def __init__(self, world: World, robot: Json, line: Json, cells: Any, graph: Strategy) -> None:
        self.world, self.robot, self.line, self.graph = world, robot, line, graph
        self.cells = [frozenset(cell) for cell in cells or ()]
        self.inputs = [variable.name for variable in graph.spec.inputs]
        self.values = [graph.values(node) for node in range(graph.count)]
        self.turns = robot["mobility"] == "heading"
        self.poses = [self._pose(values) for values in self.values]
        self.pose: Pose = (line["region"], line.get("heading"))
        self.objective: Json = line["objective"]
        if line.get("form") == "alternation" and "patrol" in self.objective:
            self.objective = {"visit": self.objective["patrol"]}
        self.kind = next(iter(self.objective))
        self.ordered = self.kind in ("patrol", "visit")
        self.targets = targets_of(self.objective)
        self.memory: dict[str, int] = dict(line.get("memory") or {})
        self.closed = {region for region, _ in line.get("closed") or ()}
        self.forbidden = poses_of(line.get("forbidden") or (), robot["mobility"])
        self.moving = list(line.get("moving") or ())
        self.places = line.get("places")
        """Where it can be sent (coordination ``assignable``), or None."""
        self.fairness = line["fairness"]
        self.exact = robot["tracking"] == "exact"
        self.nearby = robot["tracking"] == "nearby"
        self.sight_closed = frozenset(line.get("sight_closed") or ())
        beliefs = (line.get("beliefs") or {}).items()
        self.beliefs = {n: [self._union(belief) for belief in known] for n, known in beliefs}
        """For each robot that it keeps track of, the regions of each belief."""
        self.numbers = {n: {frozenset(b): k for k, b in enumerate(known)} for n, known in beliefs}
        self.knowledge = {
            name: self.world.size + self.numbers[name][frozenset(known)]
            if isinstance(known, list)
            else known
            for name, known in (line.get("knowledge") or {}).items()
        }
        self.tracked = [] if self.nearby else list(self.knowledge)
        self.of_pose: dict[Pose, set[int]] = {}
        """The nodes that a run can come to, by their pose."""
        self._expected: dict[Any, frozenset[Row]] = {}
        self._read_formulas()
        self.wishes = ["the next target"] if self.ordered else [f"goal {k}" for k in self._goals()]
        self.wishes += ["the place that it is sent to"] if self.places is not None else []
        self.assumptions = self._assumptions()

    def _pose(self, values: Mapping[str, int]) -> Pose:
        return values["region"], HEADINGS[values["heading"]] if self.turns else None

    def _union(self, belief: Iterable[int]) -> frozenset[int]:
        return frozenset().union(*(self.cells[cell] for cell in belief))

    def _goals(self) -> range:
        return range(len(self.recurring) or len(self.targets))

    def _read_formulas(self) -> None:
        """The objective's own formulas: on edges, those that are to hold always and the digits of
        those that are to hold again and again."""
        declared = self.objective.get("ltl", {}).get("memory", {})
        known = {v.name: [v.least, v.most] for v in self.graph.spec.outputs}
        for name, bounds in declared.items():
            if known.get(name) != ([0, 1] if bounds == "bool" else list(bounds)):
                raise RefusedError("the memory of the objective is not that of the strategy")
        self.own = list(declared)
        read = {
            part: [read_clause(text, rename=named) for text in formulas_of(self.objective, part)]
            for part in ("init", "safety", "liveness")
        }
        self.init, self.safety, self.always, self.recurring = read["init"], read["safety"], "", []
        if self.kind == "ltl":
            cases = self.graph.edge_cases()
            holds = ("&", ("const", True), *(clause.formula for clause in self.safety))
            self.always = cases.digits(holds)
            self.recurring = [cases.digits(clause.formula) for clause in read["liveness"]]

    # what can be observed

    def expected(self, node: int) -> frozenset[Row]:
        """All inputs that can occur after a node."""
        region, values = self.poses[node][0], self.values[node]
        told = (values["request"], values["assigned"]) if self.places is not None else ()
        key = (region, told, tuple(values[f"at_{name}"] for name in self.tracked))
        if key not in self._expected:
            groups = list(self._groups(region, values))
            names = [name for group, _ in groups for name in group]
            if sorted(names) != sorted(self.inputs):
                raise RefusedError(f"the inputs are {self.inputs}, but should be {names}")
            order = [names.index(name) for name in self.inputs]
            rows = (tuple(chain(*row)) for row in product(*(after for _, after in groups)))
            self._expected[key] = frozenset(tuple(row[i] for i in order) for row in rows)
        return self._expected[key]

    def _groups(
        self, region: int, values: Mapping[str, int]
    ) -> Iterator[tuple[list[str], Iterable[Row]]]:
        """Inputs that do not depend on each other, with the values that can occur."""
        if self.places is not None:
            again = {values["assigned"]} if values["request"] else set(self.places)
            told = [(1, place) for place in again] + [(0, self.line["neutral"])]
            rows = [(request, wait, place) for request, place in told for wait in (0, 1)]
            yield ["request", "wait", "assigned"], rows
        if self.nearby and self.moving:
            sides = self.world.sides
            open_ = [side for side in sides if self.world.step(region, side) is not None]
            most = min(len(open_), len(self.moving))
            some = chain(*(combinations(open_, count) for count in range(most + 1)))
            busy = [tuple(int(side in taken) for side in sides) for taken in some]
            yield [f"busy_{side}" for side in sides], busy
        for name in self.tracked:
            after = self.after(name, region, values[f"at_{name}"])
            yield [f"at_{name}"], [(value,) for value in after]

    def after(self, name: str, region: int, value: int) -> set[int]:
        """What may be known of another robot next, if ``value`` is known of it now. The other one
        stays or steps, not onto this robot if they are in conflict; then this robot looks."""
        reach = self.world.around(self.whereabouts(name, value))
        reach -= {region} if name in self.moving else set()
        radius, closed = self.robot.get("vision"), self.sight_closed
        if self.exact:
            return reach
        seen = {r for r in reach if self.world.sees(region, r, radius, closed)}
        hidden = reach - seen
        return seen | ({self.believed(name, hidden)} if hidden else set())

    def believed(self, name: str, hidden: set[int]) -> int:
        """The value for: out of sight, in one of these regions, as far as cells can tell."""
        belief = frozenset(k for k, cell in enumerate(self.cells) if cell & hidden)
        if belief not in self.numbers[name]:
            raise RefusedError(f"{name} may be in the cells {sorted(belief)}: there is no input")
        return self.world.size + self.numbers[name][belief]

    def whereabouts(self, name: str, value: int) -> frozenset[int]:
        """The regions where another robot may be if that is known of it."""
        size = self.world.size
        return frozenset({value}) if value < size else self.beliefs[name][value - size]

    def taken(self, region: int, seen: Mapping[str, int]) -> set[int | None]:
        """The regions observed as taken, from where the robot stands before its move."""
        if not self.nearby:
            return {seen[f"at_{name}"] for name in self.moving}
        sides = self.world.sides if self.moving else ()
        return {self.world.step(region, side) for side in sides if seen[f"busy_{side}"]}

    # what is to be done, and what is assumed

    def legal(self, here: Pose, awaited: int, seen: Mapping[str, int]) -> set[Pose]:
        """The poses that the rules leave after an observation, while a target is awaited."""
        moves = self.world.moves(self.robot["mobility"], here)
        if self.kind == "hold" and here[0] in self.targets[0] and not seen.get("request"):
            moves = {here}
        if self.places is not None and seen["wait"]:
            moves &= {here}
        shut = self.taken(here[0], seen) | self.closed
        if self.kind == "patrol":
            shut |= self.targets[1 - awaited]  # the one whose turn it is not
        return {pose for pose in moves if pose[0] not in shut} - self.forbidden

    def _arrive(self, node: int, awaited: int, edge: int | None) -> tuple[int, int]:
        """The awaited target after arriving at a node, and a bit for each wish that is met."""
        region, met = self.poses[node][0], 0
        if self.ordered:
            if region in self.targets[awaited]:
                met, awaited = 1, (awaited + 1) % len(self.targets)
        elif edge is None or not self.recurring:
            met = sum(1 << k for k, target in enumerate(self.targets) if region in target)
        else:
            met = sum(1 << k for k, digits in enumerate(self.recurring) if digits[edge] == "1")
        if self.places is not None:
            values, last = self.values[node], 1 << len(self.wishes) - 1
            if not values["request"]:
                met |= last
            else:  # while it is sent somewhere its own goals can wait
                met = last - 1 if values["assigned"] != region else 2 * last - 1
        return awaited, met

    def _assumptions(self) -> list[Assumption]:
        """What is assumed to happen again and again: what, of whom, and where."""
        found: list[Assumption] = []
        if self.places is not None:
            found.append(("no wait", "", frozenset()))
        if self.fairness == "out_of_my_way":
            found.append(("nobody near", "", frozenset()))
        for name in self.moving:
            if self.fairness == "out_of_my_sight" and self.beliefs[name]:
                found.append(("unseen", name, frozenset()))
            if self.fairness == "off_my_targets":
                found += [("off", name, aim) for aim in self.targets]
            if self.fairness == "at_its_targets":
                aims = targets_of({"visit": self.line["others_targets"][name]})
                found += [("at", name, aim) for aim in aims]
        return found

    def _holds(self, assumption: Assumption, region: int, seen: Mapping[str, int]) -> bool:
        """Whether it is so at a step from a region with what is observed then. What is only
        believed counts if it may be so."""
        kind, about, aim = assumption
        if self.places is not None and seen["wait"]:
            return False  # what others do while the robot must stay where it is helps nobody
        if kind == "no wait":
            return True
        if kind == "nobody near":
            return not self.world.around([region]) & self.taken(region, seen)
        value = seen[f"at_{about}"]
        if kind == "unseen":
            return value >= self.world.size
        where = self.whereabouts(about, value)
        return bool(where - aim if kind == "off" else where & aim)

    def _unfold(self, starts: Iterable[int], visit: Callable[[int, int], None]) -> list[Any]:
        """All steps of all runs from the start nodes: from, to, and a bit for each wish and then
        for each assumption that is met. ``visit`` judges each node and its awaited target."""
        known: dict[tuple[int, Row], int] = {}
        offsets = self.offsets()
        memory = self.memory.get("scout", self.memory.get("goal", 0))
        first = memory if self.ordered else 0
        begin = dict.fromkeys((node, self._arrive(node, first, None)[0]) for node in starts)
        number = {state: k for k, state in enumerate(begin)}
        queue, steps = list(number), []
        for source, awaited in queue:
            visit(source, awaited)
            region = self.poses[source][0]
            for edge, target in enumerate(self.graph.next[source], offsets[source]):
                if self.always and self.always[edge] == "0":
                    raise RefusedError(
                        f"the edge from node {source} to {target} breaks the objective"
                    )
                after, met = self._arrive(target, awaited, edge)
                key = (region, self.graph.inputs[target])
                if key not in known:
                    holds = [self._holds(a, region, self.values[target]) for a in self.assumptions]
                    known[key] = sum(
                        1 << k for k, good in enumerate(holds, len(self.wishes)) if good
                    )
                if (target, after) not in number:
                    number[target, after] = len(number)
                    queue.append((target, after))
                steps.append((number[source, awaited], number[target, after], met | known[key]))
        for node, _ in queue:
            self.of_pose.setdefault(self.poses[node], set()).add(node)
        return steps

    def offsets(self) -> list[int]:
        """The number of each node's first edge."""
        found = [0]
        for targets in self.graph.next:
            found.append(found[-1] + len(targets))
        return found

    def check_strategy(self, start: int) -> None:
        """Refuse unless every run of the strategy from ``start`` keeps the scenario's rules."""
        values = self.values[start]
        if self.poses[start] != self.pose:
            raise RefusedError(f"it begins at {self.poses[start]}, but the robot is at {self.pose}")
        for name, value in (self.memory | self._positions()).items():
            if values.get(name) != value:
                raise RefusedError(f"it begins with {name} = {values.get(name)}, not {value}")
        if self.own and not self.memory and not self.completed("init", (), values):
            raise RefusedError("it begins as the objective forbids")
        allowed: dict[Any, set[Pose]] = {}

        def visit(node: int, awaited: int) -> None:
            targets, inputs = self.graph.next[node], self.graph.inputs
            for row in sorted(self.expected(node) - {inputs[target] for target in targets}):
                said = dict(zip(self.inputs, row, strict=True))
                raise RefusedError(f"node {node} has no answer to {said}, which can occur")
            for target in targets:
                key = (here := self.poses[node], awaited, inputs[target])
                if key not in allowed:
                    allowed[key] = self.legal(here, awaited, self.values[target])
                if (to := self.poses[target]) not in allowed[key]:
                    edge = f"the edge from node {node} to {target}, {here} to {to},"
                    raise RefusedError(f"{edge} is no legal move")

        steps = self._unfold([start], visit)
        fair = (1 << len(self.assumptions)) - 1 << len(self.wishes)
        for k, wish in enumerate(self.wishes):
            if has_cycle([step for step in steps if not step[2] >> k & 1], fair):
                raise RefusedError(f"a run misses {wish} for ever, though it meets all assumptions")

    def _positions(self) -> dict[str, int]:
        return {f"at_{name}": self.knowledge[name] for name in self.tracked}

    def first(self) -> dict[str, int]:
        """The inputs with which everything begins."""
        told = {"assigned": self.line["neutral"]} if self.places is not None else {}
        return dict.fromkeys(self.inputs, 0) | self._positions() | told

    def completed(self, part: str, wanted: Sequence[str], values: Mapping[str, int]) -> set[Row]:
        """The values of ``wanted`` (primed for the part ``safety``) under the own formulas."""
        clauses = self.init if part == "init" else self.safety
        known = [name for name in values if name not in wanted]
        row = tuple(values[name] for name in known)
        return {after for _, after in complete(self.graph.spec, wanted, clauses, known, [row])}

    def follows(self, objective: Json, before: Pose, after: Pose) -> bool:
        """Whether an objective's own safety lines allow a step, for some values of the memory
        (lines about a memory that this strategy does not have are left out)."""
        after_ = {f"{name}'": value for name, value in named_coordinates(after).items()}
        values = named_coordinates(before) | after_
        wanted = [*self.own, *(f"{name}'" for name in self.own)]
        lines = [read_clause(t, rename=named) for t in formulas_of(objective, "safety")]
        clauses = [clause for clause in lines if clause.reads <= {*values, *wanted}]
        row = tuple(values.values())
        return any(complete(self.graph.spec, wanted, clauses, list(values), [row]))

    def check_counterstrategy(self, start: Row, chosen: Sequence[Sequence[int]]) -> None:
        """Refuse unless no way to keep the scenario's rules can be kept against it: each chosen
        input can occur, each move that the rules leave has a successor, and each endless run
        meets every assumption again and again, but misses a wish for ever."""
        if dict(zip(self.inputs, start, strict=True)) != self.first():
            raise RefusedError("the initial input is not what the robot knows at the start")
        nodes = [n for n in self.graph.initial() if self.graph.inputs[n] == start]
        begin = [n for n in nodes if self.poses[n] == self.pose]
        values = self.first() | named_coordinates(self.pose)
        ways = self.completed("init", [] if self.memory else self.own, values | self.memory)
        begun = {tuple(self.values[n][name] for name in self.own) for n in begin}
        if not begin and not ways:
            return
        if not begin or (self.own and not self.memory and not ways <= begun):
            raise RefusedError("not all ways to begin have a node")
        names = list(named_coordinates(self.pose)) + self.own

        def visit(node: int, awaited: int) -> None:
            if (row := tuple(chosen[node])) not in self.expected(node):
                raise RefusedError(f"the input chosen in node {node} cannot occur")
            seen = dict(zip(self.inputs, row, strict=True))
            poses = self.legal(self.poses[node], awaited, seen)
            answers = {coordinates(pose) for pose in poses}
            if self.kind == "ltl":
                own = {name: self.values[node][name] for name in names}
                allowed = self.completed("safety", [f"{name}'" for name in names], own)
                answers = {row for row in allowed if row[: len(names) - len(self.own)] in answers}
            given = self.graph.next[node]
            size = len(names) if self.kind == "ltl" else len(names) - len(self.own)
            answers -= {tuple(self.values[t][name] for name in names[:size]) for t in given}
            if answers:
                raise RefusedError(f"in node {node} the robot could go on to {min(answers)}")

        steps = self._unfold(begin, visit)
        for k in range(len(self.wishes), len(self.wishes) + len(self.assumptions)):
            if has_cycle([step for step in steps if not step[2] >> k & 1], 0):
                raise RefusedError("a run misses an assumption for ever")
        if has_cycle(steps, (1 << len(self.wishes)) - 1):
            raise RefusedError("the robot can meet all its wishes")


def has_cycle(steps: Sequence[tuple[int, int, int]], needed: int) -> bool:
    """Whether some endless run over these steps meets all ``needed`` bits again and again: they
    are met within a strongly connected component (Kosaraju's algorithm)."""
    after: dict[int, list[int]] = {}
    before: dict[int, list[int]] = {}
    for source, target, _ in steps:
        after.setdefault(source, []).append(target)
        before.setdefault(target, []).append(source)
    order: list[int] = []
    seen: set[int] = set()
    for root in after:
        work = [] if root in seen else [(root, iter(after[root]))]
        seen.add(root)
        while work:
            fresh = next((target for target in work[-1][1] if target not in seen), None)
            if fresh is None:
                order.append(work.pop()[0])
            else:
                seen.add(fresh)
                work.append((fresh, iter(after.get(fresh, ()))))
    component: dict[int, int] = {}
    for root in reversed(order):
        queue = [] if root in component else [root]
        for node in queue:
            if node not in component:
                component[node] = root
                queue += [n for n in before.get(node, ()) if n not in component]
    met: dict[int, int] = {}
    for source, target, bits in steps:
        if component[source] == component[target]:
            met[component[source]] = met.get(component[source], 0) | bits
    return any(bits & needed == needed for bits in met.values())


# ---------------------------------------------------------------- what the team can never do

Stages = tuple[tuple[int, frozenset[str]], ...]
"""Of each open obstacle: which of its needs is next, and who has met a part of that one."""


class Team:
    """What the team can still do at a moment of the run. Obstacles that it does not know are
    taken to be absent. ``refute`` lets robots pass through each other, ``exhaust`` does not.
    ``out``: robots out of service, which stand still and want nothing else."""

    def __init__(self, run: Run, out: Collection[str] = ()) -> None:
        self.run, self.world, self.data = run, run.world, run.data
        self.names = list(run.data)
        self.start = tuple(robot.destination for robot in run.robots.values())
        self.open = sorted(o for o in run.known & run.present if o not in run.sealed)
        self.given_up = {o for o, why in run.why_sealed.items() if why != "untraversable"}
        self.stages: Stages = tuple(run.stage(obstacle) for obstacle in self.open)
        self.shut: dict[str, set[int]] = {}
        self.aims: dict[str, list[frozenset[Pose]]] = {}
        self.allowed: dict[str, set[tuple[Pose, Pose]]] = {}
        """The steps that the formulas of an objective allow."""
        for name, data in run.data.items():
            sealed = run.sealed.items()
            self.shut[name] = {run.obstacles[o]["region"] for o, who in sealed if name in who}
            if "ltl" in data["objective"]:
                self.aims[name] = self._formulas(name)
            else:
                places = [[(r, None) for r in aim] for aim in targets_of(data["objective"])]
                self.aims[name] = [poses_of(aim, data["mobility"]) for aim in places]
            if name in out:
                self.aims[name] = [frozenset({run.robots[name].destination})]
        self.out = out
        self._steps: dict[Any, list[Pose]] = {}

    def _formulas(self, name: str) -> list[frozenset[Pose]]:
        """Of an objective in formulas: the poses in which each goal may be met, by staying or else
        by a step into them. Also keeps the steps that the safety lines allow. Both with some
        memory; lines about more than MOST_MEMORY values of it say nothing here."""
        own, mobility = self.data[name]["objective"], self.data[name]["mobility"]
        memory = own.get("ltl", {}).get("memory", {})
        shown = {m: "" if b == "bool" else f":{b[0]}...{b[1]}" for m, b in memory.items()}
        place = ["region", "heading"][: 1 + (mobility == "heading")]
        lines = [f"region:0...{self.world.size - 1}", "heading:0...3"][: len(place)]
        lines += [f"{variable}{bounds}" for variable, bounds in shown.items()]
        variables = [read_variable(line) for line in lines]
        few = prod(v.most - v.least + 1 for v in variables[len(place) :]) <= MOST_MEMORY
        spec, keys = Specification((), tuple(variables), {}), [*place, *(f"{p}'" for p in place)]
        poses = poses_of(((region, None) for region in self.world.free), mobility)
        stays = {(*row, *row): (pose, pose) for pose in poses for row in [coordinates(pose)]}
        steps = {
            (*coordinates(pose), *coordinates(after)): (pose, after)
            for pose in poses
            for after in self.world.moves(mobility, pose) - {pose}
        }

        def met(texts: Iterable[str], rows: Mapping[Row, Any]) -> set[tuple[Pose, Pose]]:
            clauses = [read_clause(text, rename=named) for text in texts]
            clauses = [clause for clause in clauses if few or clause.reads <= {*keys}]
            wanted = sorted(set().union(*(clause.reads for clause in clauses)) - {*keys})
            return {rows[row] for row, _ in complete(spec, wanted, clauses, keys, list(rows))}

        self.allowed[name] = met(formulas_of(own, "safety"), steps)
        open_ = {row: pair for row, pair in steps.items() if pair in self.allowed[name]}
        aims = []
        for text in formulas_of(own, "liveness"):
            staying = {pose for pose, _ in met([text], stays)}
            entered = met([text], open_)
            aims.append(frozenset(staying | {b for a, b in entered if not {a, b} & staying}))
        return aims

    def need(self, k: int, stages: Stages) -> Json | None:
        """The need of an obstacle that is next; None if it is resolved."""
        needs = self.run.needs(self.open[k])
        return needs[stages[k][0]] if stages[k][0] < len(needs) else None

    def missing(self, k: int, stages: Stages) -> int:
        need = self.need(k, stages)
        return 0 if need is None else int(need.get("robots", 1)) - len(stages[k][1])

    def steps(self, name: str, pose: Pose, stages: Stages) -> list[Pose]:
        """The poses after one step or none, while open obstacles are walls for whom they block."""
        key = (name, pose, stages)
        if key not in self._steps:
            blocked = {
                self.run.obstacles[obstacle]["region"]
                for obstacle, (stage, _) in zip(self.open, stages, strict=True)
                if self.run.blocks(obstacle, name, stage)
            }
            moves = self.world.moves(self.data[name]["mobility"], pose)
            shut = blocked | self.shut[name]
            open_ = self.allowed.get(name)
            self._steps[key] = (
                [pose]
                if name in self.out
                else [
                    after
                    for after in moves
                    if after[0] not in shut
                    if open_ is None or after == pose or (pose, after) in open_
                ]
            )
        return self._steps[key]

    def reach(self, name: str, poses: Iterable[Pose], stages: Stages) -> set[Pose]:
        """Where a robot can get from some poses."""
        found = set(poses)
        queue = list(found)
        for pose in queue:
            fresh = set(self.steps(name, pose, stages)) - found
            found |= fresh
            queue += fresh
        return found

    def live(self, name: str, poses: set[Pose], stages: Stages) -> set[Pose]:
        """Of a closed set, the poses from which the robot can meet every target for ever."""
        alive, before = set(poses), set[Pose]()
        while alive != before:
            before = set(alive)
            for aim in self.aims[name]:
                found = alive & aim
                fresh = found
                while fresh:
                    near = {p for p in alive - found if fresh & {*self.steps(name, p, stages)}}
                    fresh = near
                    found = found | near
                alive = found
        return alive

    def able(self, k: int, sets: Sequence[set[Pose]], stages: Stages) -> dict[str, set[Pose]]:
        """The robots that can get to where an obstacle's next need is met, and in which poses."""
        need = self.need(k, stages)
        found: dict[str, set[Pose]] = {}
        for name, poses in zip(self.names, sets, strict=True):
            if need is None or need["action"] not in self.data[name]["capabilities"]:
                continue
            out = (name, self.open[k]) in self.run.barred or name in stages[k][1]
            there = {p for p in self.reach(name, poses, stages) if p[0] in need["regions"]}
            if there and not out:
                found[name] = there
        return found

    def advanced(self, k: int, stages: Stages) -> Stages:
        return (*stages[:k], (stages[k][0] + 1, frozenset()), *stages[k + 1 :])

    def refute(self, proof: Json, sets: Sequence[set[Pose]], stages: Stages) -> set[str]:
        """Refuse unless the proof tells what is true when robots choose to be in ``sets``.

        A ``closure``: all is resolved that ever can be. Returns the obstacles that never are, and
        the robots that cannot go on. A ``tree``: whatever is done next, a proof follows."""
        if proof["kind"] == "closure":
            return self._closure(proof, sets, stages)
        here = zip(self.names, sets, strict=True)
        if all(self.live(n, self.reach(n, poses, stages), stages) for n, poses in here):
            raise RefusedError("everybody can go on as it is")
        options = {}
        for k, obstacle in enumerate(self.open):
            able = self.able(k, sets, stages)
            for group in combinations(able, max(1, self.missing(k, stages))):
                if not self._fits(k, group, able, stages):
                    continue
                after = [
                    able[n] if n in group else p for n, p in zip(self.names, sets, strict=True)
                ]
                pairs = zip(self.names, sets, after, strict=True)
                lossless = all(
                    self.reach(n, old, stages) <= self.reach(n, new, stages)
                    for n, old, new in pairs
                )
                key = (obstacle, stages[k][0], group)
                options[key] = after, self.advanced(k, stages), lossless
        listed = set()
        for choice in proof["choices"]:
            option = choice["option"]
            key = (option["obstacle"], option["need"], tuple(option["robots"]))
            if key not in options or (option["lossless"] and not options[key][2]):
                raise RefusedError(f"the proof lists {key}, which is no choice here")
            listed |= set(options) if option["lossless"] else {key}
            if not self.refute(choice["proof"], *options[key][:2]) & set(self.names):
                raise RefusedError(f"after {key} everybody can go on")
        if not listed or listed != set(options):
            raise RefusedError("the proof does not list all choices")
        return set(self.names)

    def _fits(self, k: int, group: Sequence[str], able: Any, stages: Stages) -> bool:
        """Whether all of a group that acts together can stand there at once."""
        need = self.need(k, stages)
        crowd = [n for n in group if set(self.data[n].get("conflicts", ())) & set(group)]
        ways = product(*({pose[0] for pose in able[name]} for name in crowd))
        return not (need and need.get("together")) or any(len({*w}) == len(w) for w in ways)

    def _closure(self, proof: Json, sets: Sequence[set[Pose]], stages: Stages) -> set[str]:
        before, given = None, stages
        while stages != before:
            before = stages
            for k in range(len(self.open)):
                if 0 < self.missing(k, stages) <= len(self.able(k, sets, stages)):
                    stages = self.advanced(k, stages)
        never = {o for k, o in enumerate(self.open) if self.need(k, stages)}
        table, stuck = {}, set()
        for name, poses in zip(self.names, sets, strict=True):
            reach = self.reach(name, poses, stages)
            stuck |= set() if self.live(name, reach, stages) else {name}
            ordered = sorted(([*pose] for pose in reach), key=lambda p: (p[0], p[1] or ""))
            table[name] = {"poses": ordered, "live": name not in stuck}
        resolved = {o for k, o in enumerate(self.open) if self.need(k, given)} - never
        never |= self.given_up
        if (set(proof["resolved"]), set(proof["never"])) != (resolved, never):
            raise RefusedError(f"the closure never resolves {sorted(never)}, unlike the proof")
        if proof["robots"] != table:
            raise RefusedError("the closure of what the team can do is not that of the proof")
        return never | stuck

    def exhaust(self, proof: Json) -> int:
        """Refuse unless no order of moves completes the mission. Returns the number of joint
        states, each robot's step being one transition. Of a few robots of the team the rest, and
        all that may yet be resolved, only stands in their way."""
        if {*proof["robots"]} < {*self.names} and proof["robots"] and not self._open_in(proof):
            few = copy(self)
            few.names = [name for name in self.names if name in proof["robots"]]
            few.start = tuple(self.run.robots[name].destination for name in few.names)
            few.open, few.stages, few._steps = [], (), {}
            return few.exhaust(proof)
        rounds, total = proof["goal"]["rounds"], self.run.scenario["until"]["rounds"]
        stages = {o: need for o, (need, _) in zip(self.open, self.stages, strict=True)}
        start = {name: [*pose] for name, pose in zip(self.names, self.start, strict=True)}
        given = {o: need for o, need in proof["stages"].items() if o not in self.given_up}
        if proof["start"] != start or given != stages or rounds > total:
            raise RefusedError("the proof of a deadlock is about another moment")
        counts = [self._progress(name) for name in self.names]
        first = self._settled(self.start, tuple(counts), self.stages, rounds)
        seen, queue = {first}, [first]
        for poses, done, stage in queue:
            if self._completed(poses, done, stage, rounds):
                raise RefusedError("the mission can be completed from here")
            for k, name in enumerate(self.names):
                rivals = self.data[name].get("conflicts", ())
                here = [self.names.index(other) for other in rivals if other in self.names]
                taken = {poses[i][0] for i in here}
                for pose in self.steps(name, poses[k], stage):
                    if pose[0] in taken:
                        continue
                    moved = (*poses[:k], pose, *poses[k + 1 :])
                    after = self._settled(moved, done, stage, rounds)
                    if after not in seen:
                        seen.add(after)
                        queue.append(after)
            if len(seen) > MOST_STATES:
                raise TooLargeError(f"more than {MOST_STATES} joint states; not certified")
        told = {json.dumps([[*p] for p in poses], separators=(",", ":")) for poses, _, _ in seen}
        text = "".join(f"{line}\n" for line in sorted(told))
        if (len(told), hashlib.sha256(text.encode()).hexdigest()) != (
            proof["states"],
            proof["sha256"],
        ):
            raise RefusedError(f"there are {len(told)} joint places, and not those of the proof")
        return len(told)

    def _open_in(self, proof: Json) -> set[str]:
        """The obstacles that a joint proof takes to be open."""
        return {*proof["stages"]} - self.given_up

    def _progress(self, name: str) -> tuple[int, frozenset[int], int]:
        """How far a robot is: whose turn it is, what it has seen in this round, goals met or,
        where targets have no order, rounds."""
        robot, number = self.run.robots[name], len(self.aims[name])
        if {"patrol", "visit"} & set(self.data[name]["objective"]):
            return robot.awaited, frozenset(), len(robot.goals)
        rounds = len(robot.goals) // (number or 1)
        return 0, frozenset(robot.goals[rounds * number :]), rounds

    def _is_done(self, name: str, count: Any, rounds: int) -> bool:
        objective = self.data[name]["objective"]
        cyclic = "patrol" in objective or "visit" in objective
        enough = min(1, rounds) if "hold" in objective else rounds
        return bool(count[2] >= enough * (len(self.aims[name]) if cyclic else 1))

    def _completed(self, poses: Any, counts: Any, stages: Stages, rounds: int) -> bool:
        done = zip(self.names, counts, strict=True)
        if not all(self._is_done(name, count, rounds) for name, count in done):
            return False
        there = zip(self.names, poses, strict=True)
        return all(self.live(n, self.reach(n, [pose], stages), stages) for n, pose in there)

    def _settled(self, poses: Any, counts: Any, stages: Stages, rounds: int) -> Any:
        """The joint state after everybody has acted where it stands, and what is met is counted."""
        before, given = None, stages
        while stages != before:
            before = stages
            for k, (_, done) in enumerate(stages):
                need = self.need(k, stages)
                here = {
                    name
                    for name, pose in zip(self.names, poses, strict=True)
                    if need and need["action"] in self.data[name]["capabilities"]
                    if pose[0] in need["regions"] and (name, self.open[k]) not in self.run.barred
                }
                enough = len(here - done) >= self.missing(k, stages)
                if need and enough:
                    stages = self.advanced(k, stages)
                elif need and not need.get("together"):
                    stages = (*stages[:k], (stages[k][0], done | here), *stages[k + 1 :])
        closed = [self.need(k, given) and not self.need(k, stages) for k in range(len(stages))]
        if any(closed):
            counts = tuple((index, frozenset(), 0) for index, _, _ in counts)
        return poses, tuple(map(self._counted, self.names, poses, counts, repeat(rounds))), stages

    def _counted(self, name: str, pose: Pose, count: Any, rounds: int) -> Any:
        aims, (index, seen, met) = self.aims[name], count
        cyclic = {"patrol", "visit"} & set(self.data[name]["objective"])
        while not self._is_done(name, (index, seen, met), rounds):
            fresh = {k for k, aim in enumerate(aims) if pose in aim} - seen
            if cyclic and index in fresh:
                index, met = (index + 1) % len(aims), met + 1
            elif fresh and not cyclic:
                seen = seen | fresh
                if len(seen) == len(aims):
                    seen, met = frozenset(), met + 1
            else:
                break
        return index, seen, met


# ---------------------------------------------------------------- strategy -> moves


@dataclass
class Claim:
    """Something that the checker has established, and the files and lines that show it."""

    id: str
    kind: str
    text: str
    evidence: list[tuple[str, int | None]]


@dataclass
class Robot:
    """One robot at some line of the trace."""

    pose: Pose
    objective: Json
    destination: Pose
    """Where it is, or where its step ends."""
    toward: int | None = None
    """The region that it is on its way to, and takes up, too."""
    validation: Validation | None = None
    nodes: set[int] | None = None
    """Where it may be in its strategy; None: in any node of its pose."""
    after: set[int] | None = None
    """The same at the end of a step under way."""
    came_from: set[int] = field(default_factory=set)
    """The nodes before its last step."""
    knowledge: dict[str, int] = field(default_factory=dict)
    signal: Json = field(default_factory=dict)
    refused: int | None = None
    """The region that it was about to enter in this turn, where an obstacle stands."""
    back: Json | None = None
    silent: bool = False
    """Whether its strategy had no answer in its last turn."""
    goals: list[int] = field(default_factory=list)
    """The goals met since the last resolution."""
    awaited: int = 0
    """The target of its own objective whose turn it is."""

    @property
    def places(self) -> set[int]:
        return {self.pose[0]} if self.toward is None else {self.pose[0], self.toward}


class Run:
    """The trace, line by line, against the strategies, the map and the obstacles."""

    def __init__(self, bundle: Bundle) -> None:
        self.bundle = bundle
        self.scenario = bundle.header["scenario"]  # its robots are in the order of their turns
        self.external = self.scenario.get("world") == "external"
        self.world = World(self.scenario["map"])
        self.data: dict[str, Json] = dict(self.scenario["robots"])
        self.robots = {
            name: Robot(pose := (data["start"], data.get("heading")), data["objective"], pose)
            for name, data in self.data.items()
        }
        self.obstacles = {o["name"]: o for o in self.scenario["obstacles"]}
        self.present = {n for n, o in self.obstacles.items() if not o.get("from")}
        self.known: set[str] = set()
        self.sealed: dict[str, set[str]] = {}
        self.why_sealed: dict[str, str] = {}
        self.untraversable: set[str] = set()
        self.done: dict[str, int] = {}
        self.part: dict[str, set[str]] = {}
        """Who has met a part of an obstacle's next need."""
        self.out: set[str] = set()
        """Robots that are out of service."""
        self.barred: set[tuple[str, str]] = set()
        """Robots that have no strategy for serving an obstacle."""
        self.stack: list[Json] = []
        self.plan: dict[str, list[Pose]] = {}
        self.taken: dict[str, int] = {}
        self.orders: list[Any] = []
        self.refuted: Any = None
        self.told: Any = None
        """The tick and turn of the last line about the stack."""
        self.claims: list[Claim] = []
        self.moves = self.answers = self.tick = self.turn = self.line = self.strayed = 0
        self.outcome: Json | None = None
        self._realized: dict[tuple[str, str], tuple[Strategy, list[int]]] = {}
        self._kept: dict[str, Validation] = {}
        self._beaten: set[str] = set()
        self._check_scenario()

    def _check_scenario(self) -> None:
        for name, data in self.data.items():
            turning = data["mobility"] == "heading"
            if data["mobility"] not in ("free", "heading") or turning != bool(data.get("heading")):
                raise RefusedError(f"{name} has no known mobility, or no heading for it")
            for other in data.get("conflicts", ()):
                if other == name or name not in self.data[other].get("conflicts", ()):
                    raise RefusedError(f"{name} must avoid {other}, but not the other way round")
                if self.data[other]["start"] == data["start"]:
                    raise RefusedError(f"{name} and {other} start in one region")
            if not {data["start"]}.union(*targets_of(data["objective"])) <= self.world.free:
                raise RefusedError(f"{name} starts in a wall, or has a target in one")

    def replay(self) -> None:
        """Refuse unless all lines are true; ``claims`` is what is established."""
        for line, record in enumerate(self.bundle.trace, 2):
            self.line = line
            if self.outcome is not None:
                raise RefusedError("a line follows the outcome")
            if record["tick"] != self.tick:
                if record["tick"] != self.tick + 1 or self.turn % len(self.robots):
                    raise RefusedError("a tick is left out, or a robot has not moved in it")
                self.tick += 1
            judge = getattr(self, "_" + record["type"], None)
            if judge is not None:
                judge(record)
        self.line = 0
        self._motion()
        count = f"All {self.moves} moves"
        if self.strayed:
            count = f"Of {self.moves} moves all but {self.strayed}, which went elsewhere than told,"
        self.claim(
            "moves",
            f"{count} are legal: {self.answers} are the answers of these strategies to what the "
            "robots could observe, the others stay, step back or follow a joint plan. No wall, no "
            "standing obstacle, no collision.",
            [("trace.jsonl", None)],
        )

    def claim(self, kind: str, text: str, evidence: Any = None) -> None:
        found = evidence or [("trace.jsonl", self.line)]
        self.claims.append(Claim(f"{kind}-{len(self.claims) + 1}", kind, text, found))

    def _motion(self) -> None:
        """The run in metres, if it is there, names this trace. It is not checked any further."""
        if self.bundle.has("motion.jsonl"):
            header = json.loads(self.bundle.text("motion.jsonl").splitlines()[0])
            if header["trace"] != self.bundle.files["trace.jsonl"]["sha256"]:
                raise RefusedError("motion.jsonl is the motion of another trace")
            what = "motion.jsonl says that it is the motion of this trace (by its sha256)"
            note = "`safenav check-motion` checks what is in it, this program does not"
            self.claim("motion", f"{what}; {note}.", [("motion.jsonl", None)])

    # synthesis

    def _synthesis(self, record: Json) -> None:
        name, spec, digest = record["robot"], record["spec"], str(record.get("strategy"))
        robot, verdict = self.robots[name], record["verdict"]
        said = f"{name}, tick {self.tick}, for '{in_words(record['objective'])}'"
        files = [("trace.jsonl", self.line), (f"specs/{spec}.structuredslugs", None)]
        for tried in record.get("tried") or ():
            self._weaker(name, tried)
        proof = f"counterstrategies/{spec}.json"
        if verdict == "unrealizable" and self.bundle.has(proof):
            graph, document = self._beat(spec)
            validation = self._validation(record, graph)
            self._check_task(record, robot, validation)
            validation.check_counterstrategy(tuple(document["start"]), document["chosen"])
            self.claim("unrealizable", f"No strategy exists for {said}.", [*files, (proof, None)])
            self._beaten.add(spec)
            aims = [*validation.targets]
            for obstacle in self.known & self.present:
                if frozenset(self.needs(obstacle)[self.stage(obstacle)[0]]["regions"]) in aims:
                    self.barred.add((name, obstacle))
        if verdict != "realizable" or record.get("node") is None:
            return
        if record.get("strategy") is None:
            raise RefusedError("its strategy was never listed: nothing is proven about its moves")
        measures = f"measures/{spec}-{digest}.json"
        files += [(f"strategies/{digest}.json", None), (measures, None)]
        if (spec, digest) not in self._realized:
            text = read_specification(self.bundle.text(files[1][0]))
            strategy = Strategy(self.bundle.json(files[2][0]), text)
            initial = check_strategy(text, strategy, self.bundle.json(measures))
            self._realized[spec, digest] = strategy, initial
            size = f"{strategy.count} nodes, {sum(map(len, strategy.next))} edges"
            what = f"The strategy of {said} realizes the text of its specification: {size}."
            self.claim("realizes", what, files[1:])
        strategy, initial = self._realized[spec, digest]
        if (node := record["node"]) not in initial:
            raise RefusedError(f"node {node} is not one with which the strategy may begin")
        told = {k: v for k, v in record.items() if k not in ("tick", "reason", "seconds", "cached")}
        key = json.dumps(told, sort_keys=True)
        validation = self._kept.get(key) or self._validation(record, strategy)
        self._check_task(record, robot, validation)
        if key not in self._kept:
            validation.check_strategy(node)
            self._kept[key] = validation
            assumed = {"none": "whatever the others do"}.get(record["fairness"], record["fairness"])
            self.claim(
                "keeps",
                f"The strategy of {said} keeps the rules of the scenario and does "
                f"what it is for again and again ({assumed}).",
                files,
            )
        robot.validation, robot.nodes, robot.after = validation, {node}, None
        robot.knowledge = dict(validation.knowledge)
        robot.signal = {"request": False, "assigned": record.get("neutral"), "wait": False}
        if same_objective(validation.objective, self.data[name]["objective"]):
            robot.awaited = next(iter(validation.memory.values()), 0)

    def _validation(self, record: Json, graph: Strategy) -> Validation:
        cells = self.scenario.get("partition")
        return Validation(self.world, self.data[record["robot"]], record, cells, graph)

    def _beat(self, spec: str) -> tuple[Strategy, Json]:
        """The counterstrategy that beats every robot within a specification."""
        document = self.bundle.json(f"counterstrategies/{spec}.json")
        text = read_specification(self.bundle.text(f"specs/{spec}.structuredslugs"))
        graph = Strategy(document["automaton"], text)
        check_counterstrategy(text, graph, document)
        return graph, document

    def _weaker(self, name: str, tried: Json) -> None:
        """What was tried before with weaker assumptions, or another form, had no strategy."""
        spec = tried["spec"]
        proof = f"counterstrategies/{spec}.json"
        if spec not in self._beaten and self.bundle.has(proof):
            self._beat(spec)
            self._beaten.add(spec)
            files = [("trace.jsonl", self.line), (f"specs/{spec}.structuredslugs", None)]
            what = f"{name}, tick {self.tick}: no strategy with fairness {tried['fairness']}"
            self.claim("weakest", f"{what}, which was tried before.", [*files, (proof, None)])

    def _check_task(self, record: Json, robot: Robot, task: Validation) -> None:
        """The circumstances for which a robot is synthesized are those of the run."""
        name = record["robot"]
        if task.pose[0] != robot.destination[0] or (
            robot.toward is None and task.pose != robot.pose
        ):
            raise RefusedError(f"{name} is at {robot.pose}, but synthesized for {task.pose}")
        tried = record["verdict"] == "unrealizable" and self.tick  # for an objective not in force
        if not tried and not same_objective(task.objective, robot.objective):
            if not self._serves(name, task.objective):
                raise RefusedError(f"{name} is synthesized for another objective than is in force")
            robot.objective = task.objective
        for target, places in zip(task.targets, record.get("goal_places") or (), strict=False):
            if not {region for region, _ in places} <= target:
                raise RefusedError(f"{name} counts places as goals that are none")
        closed = {why.removeprefix("obstacles."): r for r, why in record.get("closed") or ()}
        for other in self.data[name].get("conflicts", ()):
            parked = closed.get(f"robots.{other}") in self.robots[other].places
            if other not in task.moving and not parked:
                raise RefusedError(f"{name} does not know of {other}")
        for why, region in closed.items():
            if why.startswith("robots."):
                stands = region in self.robots[why[7:]].places
            else:
                stands = why in self.known and self.stands(why, name)
                stands = stands and self.obstacles[why]["region"] == region
            if not stands:
                raise RefusedError(f"{name} takes {region} to be closed by {why}, which is not so")
        for obstacle, robots in self.sealed.items():
            if name in robots and obstacle not in closed:
                raise RefusedError(f"{name} does not know of {obstacle}")
        for other, value in task.knowledge.items():  # it may have moved on since
            where = self.world.around(task.whereabouts(other, value))
            if not where & self.robots[other].places:
                raise RefusedError(f"{name} believes {other} to be where it is not")

    def _serves(self, name: str, objective: Json) -> bool:
        """Whether a robot may do this while requests are open: its own objective, go where a need
        of an obstacle is met, wait, keep formulas. What a line of this turn says holds."""
        needs = chain(*(self.needs(obstacle) for obstacle in self.known & self.present))
        wanted = [frozenset(need["regions"]) for need in needs]
        own = same_objective(objective, self.data[name]["objective"])
        fits = (
            own or "visit" not in objective or any(aim in wanted for aim in targets_of(objective))
        )
        return bool(self.stack) and self.told != (self.tick, self.turn) and fits

    # obstacles

    def needs(self, obstacle: str) -> list[Json]:
        data = self.obstacles[obstacle]
        plain = {"action": data["action"], "regions": data["resolution_regions"]}
        return data.get("needs") or [plain]

    def stage(self, obstacle: str) -> tuple[int, frozenset[str]]:
        return self.done.get(obstacle, 0), frozenset(self.part.get(obstacle, ()))

    def blocks(self, obstacle: str, name: str, stage: int) -> bool:
        """Whether an obstacle is in a robot's way while its needs from ``stage`` on are left."""
        left = {need["action"] for need in self.needs(obstacle)[stage:]}
        blocked = name in self.obstacles[obstacle]["blocks"]
        return blocked and not left <= set(self.data[name]["capabilities"])

    def stands(self, obstacle: str, name: str) -> bool:
        """Whether an obstacle is in a robot's way now."""
        here = obstacle in self.present and self.blocks(obstacle, name, self.done.get(obstacle, 0))
        return here or name in self.sealed.get(obstacle, ())

    def _discovered(self, record: Json) -> None:
        self.obstacles[record["obstacle"]["name"]] = record["obstacle"]
        self.present.add(record["obstacle"]["name"])

    def _appeared(self, record: Json) -> None:
        data = self.obstacles[record["obstacle"]]
        if any(data["region"] in robot.places for robot in self.robots.values()):
            raise RefusedError(f"{data['name']} appears where a robot is")
        self.present.add(data["name"])
        self.done[data["name"]], self.part[data["name"]] = 0, set()

    def _truth(self, record: Json) -> None:
        told = {**self.obstacles[record["obstacle"]], "traversable": record["traversable"]}
        self.obstacles[record["obstacle"]] = told

    def _objective(self, record: Json) -> None:
        """A robot is given another objective of its own while the run goes on."""
        name, objective = record["robot"], record["objective"]
        robot, said = self.robots[name], f"{name} is given another objective"
        if same_objective(robot.objective, self.data[name]["objective"]):
            robot.objective = objective
        self.data[name] = {**self.data[name], "objective": objective}
        robot.goals, robot.awaited = [], 0
        self.claim("changed", f"Tick {self.tick}: {said}, '{in_words(objective)}'.")

    def _service(self, record: Json) -> None:
        (self.out.discard if record["active"] else self.out.add)(record["robot"])

    def _gone(self, record: Json) -> None:
        for kept in (self.present, self.known):
            kept.discard(record["obstacle"])
        self.sealed.pop(record["obstacle"], None)
        self.why_sealed.pop(record["obstacle"], None)

    def _violation(self, record: Json) -> None:
        name, obstacle, at = record["robot"], record["obstacle"], record["proposed"]
        if self.obstacles[obstacle]["region"] != at or not self.stands(obstacle, name):
            raise RefusedError(f"{obstacle} does not block {name} at {at}")
        self.robots[name].refused = at
        self.known.add(obstacle)

    def _perform(self, name: str) -> None:
        """A robot does what it can where it stands, whether or not it was asked."""
        for obstacle in self.present:
            needs = self.needs(obstacle)
            while (stage := self.done.get(obstacle, 0)) < len(needs):
                need, alone = needs[stage], not needs[stage].get("together")
                there = {
                    other
                    for other, robot in self.robots.items()
                    if need["action"] in self.data[other]["capabilities"]
                    if robot.pose[0] in need["regions"]
                }
                group = self.part.get(obstacle, set()) | {name} if alone else there
                if name not in there:
                    break
                if len(group) < need.get("robots", 1):
                    self.part[obstacle] = group if alone else set()
                    break
                self.done[obstacle], self.part[obstacle] = stage + 1, set()

    def _finished(self) -> set[str]:
        """The obstacles that stand as far as lines say, but are resolved by what robots did."""
        return {o for o in self.present if self.done.get(o, 0) == len(self.needs(o))}

    def _met(self, record: Json) -> None:
        """A need of an obstacle is said to be met: it is, by robots that can do it."""
        obstacle, stage = record["obstacle"], record["need"]
        if obstacle not in self.present or not 0 <= stage < self.done.get(obstacle, 0):
            raise RefusedError(f"need {stage + 1} of {obstacle} is not met")
        action = self.needs(obstacle)[stage]["action"]
        for name in record.get("robots") or [record["robot"]]:
            if action != record["action"] or action not in self.data[name]["capabilities"]:
                raise RefusedError(f"{name} has no part in need {stage + 1} of {obstacle}")

    def _resolved(self, record: Json) -> None:
        obstacle, data = record["obstacle"], self.obstacles[record["obstacle"]]
        if obstacle not in self.present or (not self.external and obstacle not in self._finished()):
            raise RefusedError(f"{obstacle} does not stand, or not all that it needs was done")
        for name in record.get("robots") or [record["robot"]]:
            actions = {need["action"] for need in self.needs(obstacle)}
            if not actions & set(self.data[name]["capabilities"]):
                raise RefusedError(f"{name} can do nothing about {obstacle}")
        if not self.external and record["traversable"] != data["traversable"]:
            raise RefusedError(f"{obstacle} turns out to be something else than it is")
        self.present.discard(obstacle)
        self.known.discard(obstacle)
        self.untraversable |= {obstacle} if record["traversable"] is False else set()
        for robot in self.robots.values():
            robot.goals = []

    def _blocked(self, record: Json) -> None:
        """An obstacle stays for good: it is untraversable, or the team can never resolve it."""
        obstacle, proof = record["obstacle"], record.get("proof")
        if record["reason"] == "untraversable":
            if obstacle not in self.untraversable:
                raise RefusedError(f"nobody has found {obstacle} untraversable")
        elif self.refuted != (self.tick, self.turn, proof):  # one proof for several obstacles
            team = Team(self)
            never = team.refute(proof or {}, [{pose} for pose in team.start], team.stages)
            self.refuted = (self.tick, self.turn, proof)
            if obstacle not in never:
                raise RefusedError(f"{obstacle} can be resolved")
        if record["reason"] != "untraversable":
            if obstacle not in self.refuted[2]["never"]:
                raise RefusedError(f"{obstacle} can be resolved")
            what = "whatever the robots do, too few that can resolve it get there"
            self.claim("never", f"{obstacle} can never be resolved: {what}.")
        stage = 0 if record["reason"] == "untraversable" else self.done.get(obstacle, 0)
        blocked = {n for n in self.data if self.blocks(obstacle, n, stage)}
        if blocked != set(record["robots"]):
            raise RefusedError(f"{obstacle} blocks {sorted(blocked)}")
        self.known.add(obstacle)
        self.sealed[obstacle] = blocked
        self.why_sealed[obstacle] = record["reason"]

    # moves

    def _look(self, robot: Robot, task: Validation, other: str) -> int:
        """What a robot knows of another one after the look before its move."""
        there = self.robots[other].pose[0]
        here, radius = robot.pose[0], task.robot.get("vision")
        if task.exact or self.world.sees(here, there, radius, task.sight_closed):
            return there
        found = task.after(other, here, robot.knowledge[other])
        hidden = [value for value in found if there in task.whereabouts(other, value)]
        if not hidden and not self.external:
            raise RefusedError(f"{other} is where nobody could believe it to be")
        return max(hidden or found)

    def _answers(self, robot: Robot, extra: Iterable[int]) -> set[int]:
        """The nodes that answer what a robot observes now."""
        task = robot.validation
        if task is None:
            return set()
        seen: dict[str, int] = {}
        if task.places is not None:
            seen = {key: int(robot.signal[key]) for key in ("request", "wait", "assigned")}
        if task.nearby:
            taken = set(extra).union(*(self.robots[other].places for other in task.moving))
            for side in self.world.sides if task.moving else ():
                seen[f"busy_{side}"] = int(self.world.step(robot.pose[0], side) in taken)
        for other in task.tracked:
            seen[f"at_{other}"] = robot.knowledge[other] = self._look(robot, task, other)
        row = tuple(seen[name] for name in task.inputs)
        graph = task.graph
        nodes = chain(*(graph.next[node] for node in self._nodes(robot)))
        return {node for node in nodes if graph.inputs[node] == row}

    def _nodes(self, robot: Robot) -> set[int]:
        """The nodes in which a robot may be: one, or after a joint plan all of its pose, for from
        each of them the strategy keeps what it promises."""
        if robot.nodes is None and robot.validation is not None:
            return robot.validation.of_pose.get(robot.pose, set())
        return robot.nodes or set()

    def _move(self, record: Json) -> None:
        name = list(self.robots)[self.turn % len(self.robots)]
        robot, per_tick = self.robots[name], len(self.robots)
        if record["robot"] != name or self.turn // per_tick != self.tick - 1:
            raise RefusedError(f"it is {name}'s turn, or not yet this tick's")
        if missed := self._finished():
            raise RefusedError(f"no line tells that {min(missed)} was resolved")
        self.turn, self.moves = self.turn + 1, self.moves + 1
        toward, heading = record.get("toward"), record.get("heading")
        after = (record["to"] if toward is None else toward, heading)
        try:
            self._check_motion(name, robot, record, after)
            if robot.toward is None:  # else nothing was decided
                robot.came_from = self._nodes(robot)
                self._check_decision(name, robot, record, after)
        except RefusedError:
            if not self.external or record["to"] not in self.world.free:
                raise
            self.strayed += 1  # of an external world: it is not where it was told to go
            robot.nodes = robot.after = set()
        robot.refused, robot.back = None, None
        robot.pose, robot.toward, robot.destination = (record["to"], heading), toward, after
        if toward is None and robot.after is not None:
            robot.nodes, robot.after = robot.after, None
        if toward is None and self.plan and name in self.plan:
            way, taken = self.plan[name], self.taken[name]
            self.taken[name] += taken + 1 < len(way) and way[taken + 1] == robot.pose
        if not self.external:
            self._perform(name)

    def _check_motion(self, name: str, robot: Robot, record: Json, after: Pose) -> None:
        """The rules of the world for one move."""
        start, to, toward = record["from"], record["to"], record.get("toward")
        goal, before = after[0], robot.pose
        if start != before[0]:
            raise RefusedError(f"{name} moves from {start}, but is at {before[0]}")
        if robot.toward not in (None, goal) or (toward is not None and to != start):
            raise RefusedError(f"{name} leaves the step that it is in")
        fits = {p for p in self.world.moves(self.data[name]["mobility"], before) if p[0] == goal}
        if robot.toward is not None and after[1] == before[1]:
            fits.add(after)  # it turned when it set out
        if not fits or (toward is None and after not in fits):
            raise RefusedError(f"{name} cannot go from {before} to {after}")
        for obstacle, data in self.obstacles.items():
            if data["region"] == goal != start and self.stands(obstacle, name):
                raise RefusedError(f"{name} enters {goal}, where {obstacle} stands")
        for other in self.data[name].get("conflicts", ()):
            if {to, goal} & self.robots[other].places:
                raise RefusedError(f"{name} and {other} are in one region")

    def _check_decision(self, name: str, robot: Robot, record: Json, after: Pose) -> None:
        """The move is the strategy's answer, or what the trace says that it is instead."""
        by = record.get("by") or ("backtrack" if robot.back else "strategy")
        known, extra, back = robot.validation, record.get("busy") or (), robot.back
        if robot.refused is not None and not self.plan:
            looked = dict(robot.knowledge)
            told = self._answers(robot, extra)  # to what it was told before
            robot.knowledge = looked
            if known is None or robot.refused not in {known.poses[n][0] for n in told}:
                raise RefusedError(f"{name} steps back from where its strategy does not lead")
        robot.signal = record.get("signal") or robot.signal
        answers = self._answers(robot, extra)
        robot.silent = not answers
        if by == "plan":
            self._check_planned(name, robot, after)
        elif by == "stay" or (by == "backtrack" and back and back.get("node") is None):
            if after != robot.pose:
                raise RefusedError(f"{name} moves, though it should stay")
            if not answers and by == "stay":
                robot.nodes = None
            elif by == "backtrack" and known is not None:  # it may have been told to wait
                waiting = {n for n in answers if known.poses[n] == after}
                robot.after = self._nodes(robot) | waiting
        elif by == "backtrack":
            node = back["node"] if back else 0
            follows = chain(*(known.graph.next[n] for n in self._nodes(robot))) if known else ()
            if known is None or node not in follows or known.poses[node] != after:
                raise RefusedError(f"{name} steps back to what does not follow")
            robot.after = {node}
        else:
            if known is None or not answers:
                raise RefusedError(f"the strategy of {name} has no answer to what it observes")
            moving, poses = record.get("toward") is not None, known.poses
            fits = {n for n in answers if poses[n] == after or (moving and poses[n][0] == after[0])}
            if not fits:
                said = ", ".join(str(poses[n]) for n in answers)
                raise RefusedError(f"{name} goes to {after}, but its strategy answers {said}")
            robot.after, self.answers = fits, self.answers + 1

    def _backtrack(self, record: Json) -> None:
        if self.robots[record["robot"]].refused is None:
            raise RefusedError("nothing was refused")
        self.robots[record["robot"]].back = record

    def _assumption(self, record: Json) -> None:
        """The others broke what a robot relies on: it has no answer any more."""
        name = record["robot"]
        if not self.robots[name].silent:
            raise RefusedError(f"the strategy of {name} has an answer: no assumption failed")
        self.robots[name].nodes = set()
        self.claim(
            "broken",
            f"Tick {self.tick}: an assumption of {name} failed ({record['name']}). What its "
            "strategy promises does not hold from here on, until it is synthesized again.",
        )

    # joint plans

    def _plan(self, record: Json) -> None:
        self.plan = {n: [(r, h) for r, h in way] for n, way in record["robots"].items()}
        self.taken, self.orders = dict.fromkeys(self.plan, 0), record["orders"]
        for name, way in self.plan.items():
            mobility = self.data[name]["mobility"]
            steps = pairwise(way)
            legal = all(after in self.world.moves(mobility, before) for before, after in steps)
            if way[:1] != [self.robots[name].destination] or not legal:
                raise RefusedError(f"{name} cannot follow the plan from where it is")
        for first, i, then, j in self.orders:
            if not (0 <= i < len(self.plan[first]) and 0 < j < len(self.plan[then])):
                raise RefusedError("an order of the plan is about no place of it")

    def _check_planned(self, name: str, robot: Robot, after: Pose) -> None:
        """A step of a joint plan: the next one, when those have arrived that it waits for."""
        way, k = self.plan.get(name, []), self.taken.get(name, 0) + 1
        if k >= len(way) or way[k - 1] != robot.pose or way[k][0] != after[0]:
            raise RefusedError(f"{name} leaves its plan")
        for first, i, then, j in self.orders:
            if then == name and j == k and self.taken[first] < i:
                raise RefusedError(f"{name} does not wait for {first}")
        own, known = self.data[name]["objective"], robot.validation
        if known is not None and not known.follows(own, robot.pose, way[k]):
            raise RefusedError(f"the plan leads {name} where its objective forbids")
        robot.nodes = robot.after = None

    def _plan_end(self, record: Json) -> None:
        done = all(self.taken[name] == len(way) - 1 for name, way in self.plan.items())
        if record["reason"] == "reached" and not done:
            raise RefusedError("the plan is not at its end")
        for name, node in (record.get("nodes") or {}).items():
            robot = self.robots[name]
            if node is not None and robot.toward is None:
                known = robot.validation
                if known is None or node not in known.of_pose.get(robot.pose, ()):
                    raise RefusedError(f"{name} goes on in node {node}, but is not in it")
                robot.nodes = {node}
        self.plan, self.taken, self.orders = {}, {}, []

    # objectives and the outcome

    def _push(self, record: Json) -> None:
        obstacle, helpers = record["obstacle"], record.get("helpers") or [record["helper"]]
        if obstacle is not None:
            actions = {need["action"] for need in self.needs(obstacle)}
            able = {n for n in self.data if actions & set(self.data[n]["capabilities"])}
            if obstacle not in self.known or record["requester"] not in self.data:
                raise RefusedError(f"nobody has met {obstacle}")
            if not {name for name in helpers if name} <= able:
                raise RefusedError(f"a helper can do nothing about {obstacle}")
        self.stack.append(record)
        self._in_force(record)

    def _pop(self, record: Json) -> None:
        same = ("obstacle", "requester", "helper", "helpers", "reason")
        match = [p for p in self.stack if all(p.get(k) == record.get(k) for k in same)]
        if not match:
            raise RefusedError("what is dropped from the stack is not on it")
        self.stack.remove(match[-1])
        self._in_force(record)

    def _in_force(self, record: Json) -> None:
        if record["depth"] != len(self.stack):
            raise RefusedError(f"the stack has {len(self.stack)} entries, not {record['depth']}")
        self.told = (self.tick, self.turn)
        for name, objective in record["objectives"].items():
            own = same_objective(objective, self.data[name]["objective"])
            if not self.stack and not own:
                raise RefusedError(f"{name} does not get its own objective back")
            self.robots[name].objective = objective

    def _goal(self, record: Json) -> None:
        name, goal = record["robot"], record["goal"]
        robot = self.robots[name]
        targets, task = targets_of(robot.objective), robot.validation
        if targets and robot.pose[0] not in targets[goal]:
            raise RefusedError(f"{name} is not at its goal {goal}")
        if task is not None and task.kind == "ltl" and robot.nodes and robot.came_from:
            offsets = task.offsets()
            edges = [
                offsets[before] + task.graph.next[before].index(node)
                for before in robot.came_from
                for node in robot.nodes & set(task.graph.next[before])
            ]
            if edges and not any(task.recurring[goal][edge] == "1" for edge in edges):
                raise RefusedError(f"{name} has not met its goal {goal}")
        if same_objective(robot.objective, self.data[name]["objective"]):
            robot.goals.append(goal)
            robot.awaited = (goal + 1) % (len(targets) or 1)

    def _outcome(self, record: Json) -> None:
        self.outcome, what, limits = record, record["outcome"], self.scenario["limits"]
        ran = -(-self.turn // len(self.robots))  # it may end before anybody moves in its last tick
        if record["ticks"] != ran:
            raise RefusedError(f"the run took {ran} ticks, not {record['ticks']}")
        if what == "completed":
            self._check_completed(self.scenario["until"].get("rounds") or 0)
        elif what == "operator_needed":
            self._check_negative(record)
        elif what == "unrealizable":
            self.claim("outcome", "The mission never began: a robot has no strategy.")
        elif what == "tick_limit":
            if self.tick != limits.get("ticks"):
                raise RefusedError(f"the limit is {limits.get('ticks')} ticks, not {self.tick}")
            self.claim("outcome", f"The run ended at its limit of {self.tick} ticks.")
        else:
            self.claim("outcome", f"The run ended early ({what}); nothing is claimed of its goal.")

    def _check_completed(self, rounds: int) -> None:
        for name, robot in self.robots.items():
            own = self.data[name]["objective"]
            aims = targets_of(own)
            met = min(robot.goals.count(k) for k in self._numbers(own))
            if "hold" in own and robot.pose[0] in aims[0]:
                met = rounds
            if met < rounds or not same_objective(robot.objective, own):
                raise RefusedError(f"{name} has met its objective {met} times, not {rounds}")
        if self.stack:
            raise RefusedError("requests are still open")
        what = f"every robot has met its objective {rounds} times after the last resolution"
        self.claim("outcome", f"The mission is completed: {what}.")

    def _numbers(self, objective: Json) -> range:
        return range(len(targets_of(objective)) or len(formulas_of(objective, "liveness")) or 1)

    def _check_negative(self, record: Json) -> None:
        """An operator is needed: the proof shows that the team cannot complete the mission."""
        proof, specs = record.get("proof"), record.get("unrealizable") or {}
        if proof is None:
            if not specs or not set(specs.values()) <= self._beaten:
                raise RefusedError("the outcome is a negative without a proof")
            who = " and ".join(specs)
            said = f"there is no strategy for {who}, as shown above"
        elif proof["kind"] == "joint":
            count = Team(self).exhaust(proof)
            said = f"no order of moves completes it from any of the {count} joint places"
        else:
            team = Team(self, self.out)
            found = team.refute(proof, [{pose} for pose in team.start], team.stages)
            stuck = found & set(self.data)
            if not stuck:
                raise RefusedError("everybody can go on, whatever can never be resolved")
            said = f"{' and '.join(sorted(stuck))} cannot go on, whatever the team does"
            if self.out:
                said += f" while {' and '.join(sorted(self.out))} stands still, out of service"
            if self.barred:
                said += " (robots without a strategy for it do not serve an obstacle)"
        joint = proof is not None and proof["kind"] == "joint"
        if joint != (record.get("cause") == "deadlock"):
            raise RefusedError(f"the proof is not one of the cause {record.get('cause')}")
        self.claim("outcome", f"An operator is needed: {said}.")


def same_objective(given: Json, wanted: Json) -> bool:
    """Whether an objective is the wanted one, or asks for its targets in turn."""
    return given == wanted or ("patrol" in wanted and given == {"visit": wanted["patrol"]})


def in_words(objective: Json) -> str:
    ((kind, value),) = objective.items()
    return f"{kind} {json.dumps(value)}"


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
        if (self.manifest["format"], self.manifest["version"]) != ("safenav-bundle", 1):
            raise RefusedError("manifest.json is not of format safenav-bundle, version 1")
        self.files = self.manifest["files"]
        if different := found ^ {*self.files, "manifest.json"}:
            raise RefusedError(f"{min(different)} is either missing or not in the manifest")
        for path, facts in self.files.items():
            data, (folder, _, name) = self.read(path), path.rpartition("/")
            digest = hashlib.sha256(data).hexdigest()
            if (len(data), digest) != (facts["bytes"], facts["sha256"]):
                raise RefusedError(f"{path} is not the file that the manifest names")
            if folder in ("specs", "strategies") and digest != name.partition(".")[0]:
                raise RefusedError(f"{path} is not named by its sha256")
        lines = [json.loads(line) for line in self.text("trace.jsonl").splitlines()]
        self.header, self.trace = lines[0], lines[1:]
        if self.header["type"] != "header" or self.header["scenario"] != self.json("scenario.json"):
            raise RefusedError("scenario.json is not what the header of the trace says")
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
                if "#" in "".join(row for row in drawn if "." in row) and drawn != world["grid"]:
                    raise RefusedError(f"the map in {path} is not that of scenario.json")


def check(place: Path, *, compare: bool = True) -> tuple[str, str, list[Claim]]:
    """``accepted``, ``refused`` or ``too large``; the first reason; and what is established (of a
    bundle that is refused: until then). ``compare``: the manifest has to claim just that."""
    run = None
    try:
        run = Run(Bundle(place))
        run.replay()
        said = [(c["id"], c["kind"], c["text"]) for c in run.bundle.manifest["claims"]]
        if compare and said != [(c.id, c.kind, c.text) for c in run.claims]:
            raise RefusedError("the manifest does not claim what the evidence establishes")
    except RefusedError as error:
        reason = str(error)
    except TooLargeError as error:
        return "too large", str(error), run.claims if run else []
    except (LookupError, TypeError, ValueError, AttributeError, RecursionError) as error:
        reason = f"a file is not as documented: {error!r}"
    else:
        return "accepted", "", run.claims
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
