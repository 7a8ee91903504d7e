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
  or it stays, steps back from an obstacle, or follows a joint plan (``Run``);
- *moves -> outcome*: nobody enters a wall or a standing obstacle, nobody collides, obstacles are
  resolved by those who can, and the outcome is what happened.

What stays trusted: this program and Python; the step from the YAML file to scenario.json (its
grid is compared); that the trace tells what happened, and that robots move as their mobility says.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import chain, combinations, product
from pathlib import Path
from typing import Any

sys.dont_write_bytecode = True  # a bundle stays as it is
sys.path.insert(0, str(Path(__file__).resolve().parent))

from check_strategies import (  # noqa: E402
    Clause,
    Formula,
    RefusedError,
    Row,
    Strategy,
    TooLargeError,
    check_counterstrategy,
    check_strategy,
    complete,
    parse,
    read_specification,
    reads,
)

# ---------------------------------------------------------------- the world

HEADINGS = ("north", "east", "south", "west")
Pose = tuple[int, str | None]
"""A region, and the heading of robots that have one."""


class World:
    """The map of the scenario: which regions are free, and which lie next to each other."""

    def __init__(self, data: Any) -> None:
        grid = data["grid"]
        self.rows, self.cols = data["rows"], data["cols"]
        if len(grid) != self.rows or any(len(line) != self.cols for line in grid):
            raise RefusedError("the map is not as large as it says")
        cells = "".join(grid)
        if set(cells) - {"#", "."}:
            raise RefusedError("the map has other cells than '#' and '.'")
        self.free = frozenset(region for region, cell in enumerate(cells) if cell == ".")
        self.size = len(cells)
        tall, wide = self.rows > 1, self.cols > 1
        self.sides = [h for h in HEADINGS if (tall if h in ("north", "south") else wide)]
        self._sight: dict[tuple[int, int, frozenset[int]], bool] = {}

    def step(self, region: int, heading: str) -> int | None:
        """The free region on that side, or None."""
        row, col = divmod(region, self.cols)
        row += {"north": -1, "south": 1}.get(heading, 0)
        col += {"west": -1, "east": 1}.get(heading, 0)
        inside = 0 <= row < self.rows and 0 <= col < self.cols
        beyond = row * self.cols + col
        return beyond if inside and beyond in self.free else None

    def around(self, region: int) -> set[int]:
        """The region and its free neighbours."""
        return {region, *(r for h in HEADINGS if (r := self.step(region, h)) is not None)}

    def moves(self, mobility: str, pose: Pose) -> set[Pose]:
        """The poses after one step or none. With heading mobility a robot never goes backwards,
        faces the way of its step, and keeps its heading while it stays."""
        region, facing = pose
        found = {pose}
        for heading in HEADINGS:
            beyond = self.step(region, heading)
            if beyond is None:
                continue
            if mobility == "free":
                found.add((beyond, None))
            elif (HEADINGS.index(heading) - HEADINGS.index(str(facing))) % 4 != 2:
                found.add((beyond, heading))
        return found

    def sees(self, a: int, b: int, radius: float | None, closed: frozenset[int]) -> bool:
        """Whether region b is in sight from a. The distance of the centres is at most the
        radius; the segment between them passes through the interior of no wall or closed region,
        and not between two of them that touch at a corner."""
        (row, col), (row_b, col_b) = divmod(a, self.cols), divmod(b, self.cols)
        down, right = row_b - row, col_b - col
        if radius is not None and down * down + right * right > radius * radius:
            return False
        key = (min(a, b), max(a, b), closed)
        if key not in self._sight:
            self._sight[key] = self._line(row, col, down, right, {a, b}, closed)
        return self._sight[key]

    def _line(
        self, row: int, col: int, down: int, right: int, ends: set[int], closed: frozenset[int]
    ) -> bool:
        width = abs(down) + abs(right)
        touched = set()
        for r in range(min(0, down), max(0, down) + 1):
            for c in range(min(0, right), max(0, right) + 1):
                region = (row + r) * self.cols + col + c
                if region in ends or (region in self.free and region not in closed):
                    continue
                apart = 2 * abs(down * c - right * r)  # twice the distance, times the length
                if apart < width:
                    return False
                if apart == width:
                    touched.add((r, c))
        across = (1 if down > 0 else -1, 1 if right > 0 else -1)
        return not any((r + across[0], c - across[1]) in touched for r, c in touched)


def targets_of(objective: Mapping[str, Any]) -> list[frozenset[int]]:
    """The targets of an objective: sets of regions of which any one counts."""
    ((kind, value),) = objective.items()
    if kind == "ltl":
        return []
    if kind == "hold":
        value = [value]
    return [frozenset([t] if isinstance(t, int) else t) for t in value]


# ---------------------------------------------------------------- scenario -> strategy


@dataclass(frozen=True)
class Task:
    """What one robot was synthesized for: a line of the trace with type ``synthesis``."""

    name: str
    robot: Mapping[str, Any]
    """Its entry in the scenario."""
    pose: Pose
    objective: Mapping[str, Any]
    memory: Mapping[str, int]
    """Variables that remember how far the objective is, and their values at the start."""
    closed: frozenset[int]
    """Regions that are shut to it: obstacles known by then, robots that wait."""
    moving: tuple[str, ...]
    """The robots that it must not run into."""
    tracked: tuple[str, ...]
    """All robots whose place its inputs tell."""
    fairness: str
    knowledge: Mapping[str, int]
    beliefs: Mapping[str, Sequence[frozenset[int]]]
    cells: Sequence[frozenset[int]]
    sight_closed: frozenset[int] = frozenset()
    places: frozenset[int] | None = None
    """Where it can be sent (coordination ``assignable``), or None."""
    neutral: int = 0
    others_targets: Mapping[str, Sequence[frozenset[int]]] = field(default_factory=dict)
    forbidden: frozenset[Pose] = frozenset()
    """Poses from which the team could not go on."""

    @property
    def kind(self) -> str:
        return next(iter(self.objective))


def whereabouts(world: World, task: Task, name: str, value: int) -> frozenset[int]:
    """The regions where another robot may be if that is known of it."""
    if value < world.size:
        return frozenset({value})
    belief = task.beliefs[name][value - world.size]
    return frozenset().union(*(task.cells[k] for k in belief))


class Validation:
    """A strategy or a counterstrategy against the scenario itself, without the formulas of its
    specification (an objective in formulas brings its own)."""

    def __init__(self, world: World, task: Task, strategy: Strategy) -> None:
        self.world, self.task, self.strategy = world, task, strategy
        self.inputs = [variable.name for variable in strategy.spec.inputs]
        self.values = [strategy.values(node) for node in range(strategy.count)]
        self.poses = [self._pose(values) for values in self.values]
        self.targets = targets_of(task.objective)
        self.ordered = task.kind in ("patrol", "visit")
        self.of_pose: dict[Pose, set[int]] = {}
        """The nodes that a run can come to, by their pose."""
        self._expected: dict[Any, frozenset[Row]] = {}
        self._read_formulas()

    def _pose(self, values: Mapping[str, int]) -> Pose:
        turns = self.task.robot["mobility"] == "heading"
        return values["region"], HEADINGS[values["heading"]] if turns else None

    def _read_formulas(self) -> None:
        """The objective's own formulas: on edges, those that are to hold always and the digits of
        those that are to hold again and again."""
        own = self.task.objective.get("ltl", {})
        lines = {part: [_named(parse(text)) for text in own.get(part, ())] for part in _PARTS}
        declared = {
            name: (0, 1) if d == "bool" else tuple(d) for name, d in own.get("memory", {}).items()
        }
        known = {v.name: (v.least, v.most) for v in self.strategy.spec.outputs}
        if any(known.get(name) != bounds for name, bounds in declared.items()):
            raise RefusedError("the memory of the objective is not that of the strategy")
        self.memory = list(declared)
        cases = self.strategy.edge_cases() if own else None
        self.lines, self.recurring, self.always = lines, [], ""
        if cases is not None:
            holds = cases.all
            for formula in lines["safety"]:
                holds &= cases.where(formula)
            self.always = cases.digits(holds)
            self.recurring = [cases.digits(cases.where(f)) for f in lines["liveness"]]

    # what can be observed

    def expected(self, node: int) -> frozenset[Row]:
        """All inputs that can occur after a node."""
        region, values = self.poses[node][0], self.values[node]
        key: Any = (region, self.strategy.inputs[node]) if self.task.tracked else region
        if self.task.places is not None:
            key = (key, values["request"], values["assigned"])
        if key not in self._expected:
            groups = list(self._groups(region, values))
            names = list(chain.from_iterable(group[0] for group in groups))
            if sorted(names) != sorted(self.inputs):
                raise RefusedError(f"the inputs are {self.inputs}, but should be {names}")
            order = [names.index(name) for name in self.inputs]
            rows = (tuple(chain(*row)) for row in product(*(group[1] for group in groups)))
            self._expected[key] = frozenset(tuple(row[i] for i in order) for row in rows)
        return self._expected[key]

    def _groups(
        self, region: int, values: Mapping[str, int]
    ) -> Iterator[tuple[list[str], Iterable[Row]]]:
        """Inputs that do not depend on each other, with the values that can occur."""
        task, world = self.task, self.world
        if task.places is not None:
            again = {values["assigned"]} if values["request"] else task.places
            rows = [(1, wait, place) for wait in (0, 1) for place in again]
            rows += [(0, wait, task.neutral) for wait in (0, 1)]
            yield ["request", "wait", "assigned"], rows
        if task.robot["tracking"] == "nearby":
            if task.moving:
                sides = world.sides
                open_ = [h for h in sides if world.step(region, h) is not None]
                most = min(len(open_), len(task.moving))
                some = chain(*(combinations(open_, count) for count in range(most + 1)))
                busy = [tuple(int(h in taken) for h in sides) for taken in some]
                yield [f"busy_{h}" for h in sides], busy
            return
        for name in task.tracked:
            after = self._after(name, region, values[f"at_{name}"])
            yield [f"at_{name}"], [(value,) for value in after]

    def _after(self, name: str, region: int, value: int) -> Iterator[int]:
        """What may be known of another robot next, if ``value`` is known of it now. The other one
        stays or steps, not onto this robot if they are in conflict; then this robot looks."""
        task, world = self.task, self.world
        reach = set().union(*(world.around(r) for r in self.whereabouts(name, value)))
        if name in task.moving:
            reach.discard(region)
        if task.robot["tracking"] == "exact":
            yield from reach
            return
        seen = {
            r for r in reach if world.sees(region, r, task.robot.get("vision"), task.sight_closed)
        }
        yield from seen
        if hidden := reach - seen:
            yield self.believed(name, hidden)

    def believed(self, name: str, hidden: Iterable[int]) -> int:
        """The value for: out of sight, in one of these regions, as far as cells can tell."""
        belief = frozenset(k for k, cell in enumerate(self.task.cells) if cell & set(hidden))
        for k, known in enumerate(self.task.beliefs[name]):
            if known == belief:
                return self.world.size + k
        raise RefusedError(
            f"{name} may be in the cells {sorted(belief)}, for which there is no input"
        )

    def whereabouts(self, name: str, value: int) -> frozenset[int]:
        return whereabouts(self.world, self.task, name, value)

    def taken(self, source: int, values: Mapping[str, int]) -> set[int]:
        """The regions observed as taken, from where the robot stands before its move."""
        if self.task.robot["tracking"] == "nearby":
            region, sides = self.poses[source][0], self.world.sides if self.task.moving else ()
            busy = (self.world.step(region, h) for h in sides if values[f"busy_{h}"])
            return {beyond for beyond in busy if beyond is not None}
        return {values[f"at_{name}"] for name in self.task.moving}

    # what is to be done

    def legal(self, source: int, awaited: int, values: Mapping[str, int]) -> set[Pose]:
        """The poses that the rules leave after an observation, while a target is awaited."""
        here = self.poses[source]
        moves = self.world.moves(self.task.robot["mobility"], here)
        if self.task.kind == "hold" and here[0] in self.targets[0]:
            moves = {here}
        if self.task.places is not None and values["wait"]:
            moves &= {here}
        shut = self.taken(source, values) | self.task.closed
        if self.task.kind == "patrol":
            shut |= self.targets[1 - awaited]  # the one whose turn it is not
        return {pose for pose in moves if pose[0] not in shut} - self.task.forbidden

    @property
    def wishes(self) -> list[str]:
        """What is to happen again and again."""
        count = len(self.recurring) or len(self.targets)
        own = ["the next target"] if self.ordered else [f"goal {k}" for k in range(count)]
        return own if self.task.places is None else [*own, "the place that it is sent to"]

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
        if self.task.places is not None:
            values, last = self.values[node], 1 << len(self.wishes) - 1
            if values["request"]:
                met = last - 1 if values["assigned"] != region else 2 * last - 1
            else:
                met |= last
        return awaited, met

    def assumptions(self) -> list[tuple[str, str, frozenset[int]]]:
        """What is assumed to happen again and again: what, of whom, and where."""
        task, nowhere = self.task, frozenset[int]()
        found = [("no wait", "", nowhere)] if task.places is not None else []
        if task.fairness == "out_of_my_way":
            found.append(("free", "", nowhere))
        for name in task.moving:
            if task.fairness == "out_of_my_sight" and task.beliefs[name]:
                found.append(("unseen", name, nowhere))
            if task.fairness == "off_my_targets":
                found += [("off", name, goal) for goal in self.targets]
            if task.fairness == "at_its_targets":
                found += [("at", name, goal) for goal in task.others_targets[name]]
        return found

    def _holds(self, assumption: tuple[str, str, frozenset[int]], source: int, target: int) -> bool:
        """Whether an edge meets an assumption. What is only believed counts if it may be so."""
        kind, about, goal = assumption
        values = self.values[target]
        if kind == "no wait":
            return bool(not values["wait"])
        if kind == "free":
            here, taken = self.poses[source][0], self.taken(source, values)
            return all(self.world.step(here, side) not in taken for side in self.world.sides)
        value = values[f"at_{about}"]
        if kind == "unseen":
            return bool(value >= self.world.size)
        where = self.whereabouts(about, value)
        return bool(where - goal if kind == "off" else where & goal)

    def _unfold(self, starts: Iterable[int], visit: Any) -> list[tuple[int, int, int]]:
        """All steps of all runs from the start nodes: from, to, and a bit for each wish and then
        for each assumption that is met. ``visit`` judges each node and its awaited target."""
        assumptions, shift = self.assumptions(), len(self.wishes)
        known: dict[tuple[int, Row], int] = {}
        offsets = [0]
        for targets in self.strategy.next:
            offsets.append(offsets[-1] + len(targets))
        first = (
            self.task.memory.get("scout", self.task.memory.get("goal", 0)) if self.ordered else 0
        )
        number: dict[tuple[int, int], int] = {}
        for node in starts:
            number.setdefault((node, self._arrive(node, first, None)[0]), len(number))
        queue, steps = list(number), []
        for source, awaited in queue:
            visit(source, awaited)
            for edge, target in enumerate(self.strategy.next[source], offsets[source]):
                after, met = self._arrive(target, awaited, edge)
                key = (self.poses[source][0], self.strategy.inputs[target])
                if key not in known:
                    bits = (
                        self._holds(a, source, target) << k
                        for k, a in enumerate(assumptions, shift)
                    )
                    known[key] = sum(bits)
                met |= known[key]
                if (target, after) not in number:
                    number[target, after] = len(number)
                    queue.append((target, after))
                steps.append((number[source, awaited], number[target, after], met))
                if self.always and self.always[edge] == "0":
                    raise RefusedError(
                        f"the edge from node {source} to {target} breaks the objective"
                    )
        self.reached = queue
        return steps

    def check_strategy(self, start: int) -> None:
        """Refuse unless every run of the strategy from ``start`` keeps the scenario's rules."""
        self._check_start(start)
        allowed: dict[tuple[Pose, int, Row], set[Pose]] = {}

        def visit(node: int, awaited: int) -> None:
            targets = self.strategy.next[node]
            missing = self.expected(node) - {self.strategy.inputs[t] for t in targets}
            if missing:
                row = dict(zip(self.inputs, min(missing), strict=True))
                raise RefusedError(f"node {node} has no answer to {row}, which can occur")
            for target in targets:
                key = (self.poses[node], awaited, self.strategy.inputs[target])
                if key not in allowed:
                    allowed[key] = self.legal(node, awaited, self.values[target])
                if self.poses[target] not in allowed[key]:
                    way = f"{self.poses[node]} to {self.poses[target]}"
                    raise RefusedError(
                        f"the edge from node {node} to {target}, {way}, is no legal move"
                    )

        steps = self._unfold([start], visit)
        for node, _ in self.reached:
            self.of_pose.setdefault(self.poses[node], set()).add(node)
        all_assumptions = (1 << len(self.assumptions())) - 1 << len(self.wishes)
        for k, wish in enumerate(self.wishes):
            if has_cycle([s for s in steps if not s[2] >> k & 1], all_assumptions):
                raise RefusedError(f"a run misses {wish} for ever, though it meets all assumptions")

    def _check_start(self, node: int) -> None:
        task, values = self.task, self.values[node]
        if self.poses[node] != task.pose:
            raise RefusedError(f"it begins at {self.poses[node]}, but the robot is at {task.pose}")
        first = {
            **task.memory,
            **{f"at_{name}": task.knowledge[name] for name in self._positions()},
        }
        for name, value in first.items():
            if values.get(name) != value:
                raise RefusedError(f"it begins with {name} = {values.get(name)}, not {value}")
        if not task.memory and self.memory and not self._begins(values):
            raise RefusedError("it begins as the objective forbids")

    def _positions(self) -> tuple[str, ...]:
        return () if self.task.robot["tracking"] == "nearby" else self.task.tracked

    def _begins(self, values: Mapping[str, int]) -> bool:
        """Whether the objective's own formulas allow these values to begin with."""
        return bool(self._completed("init", (), values))

    def _completed(self, part: str, wanted: Sequence[str], values: Mapping[str, int]) -> set[Row]:
        """The values of ``wanted`` (primed for the part ``safety``) under the own formulas."""
        primed = part == "safety"
        clauses = [Clause(0, "", f, frozenset(reads(f))) for f in self.lines[part]]
        known = [(name, False) for name in values if primed or name not in wanted]
        row = tuple(values[name] for name, _ in known)
        keys = [(name, primed) for name in wanted]
        variables = self.strategy.spec.variables
        return {after for _, after in complete(variables, keys, clauses, known, [row])}

    def check_counterstrategy(self, start: Row, chosen: Sequence[Sequence[int]]) -> None:
        """Refuse unless no way to keep the scenario's rules can be kept against it: each chosen
        input can occur, each move that the rules leave has a successor, and each endless run
        meets every assumption again and again, but misses a wish for ever."""
        task = self.task
        first = {name: 0 for name in self.inputs if name not in ("assigned",)}
        first.update({f"at_{name}": task.knowledge[name] for name in self._positions()})
        first.update({"assigned": task.neutral} if task.places is not None else {})
        if dict(zip(self.inputs, start, strict=True)) != first:
            raise RefusedError("the initial input is not what the robot knows at the start")
        begin = [
            node
            for node in self.strategy.initial()
            if self.strategy.inputs[node] == start and self.poses[node] == task.pose
        ]
        values = {**first, **self._pose_values(task.pose)}
        if self.memory and not task.memory:
            wanted = self._completed(
                "init", self.memory, {**values, **dict.fromkeys(self.memory, 0)}
            )
            begun = {tuple(self.values[n][name] for name in self.memory) for n in begin}
            if not wanted <= begun:
                raise RefusedError("not all ways to begin have a node")
        elif not begin and not self._begins(values):
            return
        elif not begin:
            raise RefusedError("the way to begin has no node")

        def visit(node: int, awaited: int) -> None:
            row = tuple(chosen[node])
            if row not in self.expected(node):
                raise RefusedError(f"the input chosen in node {node} cannot occur")
            after = self.strategy.next[node]
            seen = dict(zip(self.inputs, row, strict=True))
            poses = self.legal(node, awaited, seen)
            names = ["region", "heading"][: 1 + (task.robot["mobility"] == "heading")]
            if task.kind != "ltl":
                missing = poses - {self.poses[t] for t in after}
            else:
                names += self.memory
                own = {name: self.values[node][name] for name in names}
                answers = self._completed("safety", names, own)
                legal = {tuple(self._pose_values(pose).values()) for pose in poses}
                answers = {a for a in answers if a[: len(names) - len(self.memory)] in legal}
                missing = answers - {tuple(self.values[t][name] for name in names) for t in after}
            if missing:
                raise RefusedError(f"in node {node} the robot could go on to {min(missing)}")

        steps = self._unfold(begin, visit)
        for k in range(len(self.assumptions())):
            if has_cycle([s for s in steps if not s[2] >> len(self.wishes) + k & 1], 0):
                raise RefusedError(f"a run misses assumption {k} for ever")
        if has_cycle(steps, (1 << len(self.wishes)) - 1):
            raise RefusedError("the robot can meet all its wishes")

    def _pose_values(self, pose: Pose) -> dict[str, int]:
        values = {"region": pose[0]}
        return values if pose[1] is None else {**values, "heading": HEADINGS.index(pose[1])}


_PARTS = ("init", "safety", "liveness")


def _named(formula: Formula) -> Formula:
    """The formula with headings as numbers."""
    if formula[0] == "var" and formula[1] in HEADINGS:
        return ("num", HEADINGS.index(formula[1]))
    return tuple(_named(part) if isinstance(part, tuple) else part for part in formula)


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
            node, targets = work[-1]
            fresh = next((t for t in targets if t not in seen), None)
            if fresh is None:
                order.append(work.pop()[0])
            else:
                seen.add(fresh)
                work.append((fresh, iter(after.get(fresh, ()))))
    component: dict[int, int] = {}
    for root in reversed(order):
        queue = [] if root in component else [root]
        component.setdefault(root, root)
        for node in queue:
            fresh_nodes = [n for n in before.get(node, ()) if n not in component]
            component.update(dict.fromkeys(fresh_nodes, root))
            queue += dict.fromkeys(fresh_nodes)
    met: dict[int, int] = {}
    for source, target, bits in steps:
        if component[source] == component[target]:
            met[component[source]] = met.get(component[source], 0) | bits
    return any(bits & needed == needed for bits in met.values())


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
    objective: Mapping[str, Any]
    toward: int | None = None
    """The region that it is on its way to, and takes up, too."""
    validation: Validation | None = None
    nodes: set[int] | None = None
    """Where it may be in its strategy; None: in any node of its pose."""
    after: set[int] | None = None
    """The same at the end of a step under way."""
    knowledge: dict[str, int] = field(default_factory=dict)
    signal: Mapping[str, Any] = field(default_factory=dict)
    refused: int | None = None
    """The region that it was about to enter in this turn, where an obstacle stands."""
    back: tuple[int, int | None] | None = None
    goals: list[int] = field(default_factory=list)
    """The goals met since the last resolution."""

    @property
    def places(self) -> set[int]:
        return {self.pose[0]} if self.toward is None else {self.pose[0], self.toward}


class Run:
    """The trace, line by line, against the strategies, the map and the obstacles."""

    def __init__(self, bundle: Bundle) -> None:
        self.bundle = bundle
        self.scenario = bundle.header["scenario"]  # its robots are in the order of their turns
        self.world = World(self.scenario["map"])
        self.data = self.scenario["robots"]
        self.robots = {
            name: Robot((data["start"], data.get("heading")), data["objective"])
            for name, data in self.data.items()
        }
        self.obstacles = {o["name"]: o for o in self.scenario["obstacles"]}
        self.present = {n for n, o in self.obstacles.items() if not o.get("from")}
        self.known: set[str] = set()
        self.sealed: dict[str, set[str]] = {}
        self.done: dict[str, int] = {}
        self.stack: list[Any] = []
        self.plan: dict[str, list[Pose]] = {}
        self.claims: list[Claim] = []
        self.moves = self.answers = self.tick = self.turn = self.line = 0
        self.outcome: Any = None
        self._realized: dict[tuple[str, str], tuple[Strategy, list[int]]] = {}
        self._kept: dict[str, Validation] = {}
        self._check_scenario()

    def _check_scenario(self) -> None:
        for name, data in self.data.items():
            if data["start"] not in self.world.free:
                raise RefusedError(f"{name} starts in a wall")
            turning = data["mobility"] == "heading"
            if data["mobility"] not in ("free", "heading") or turning != (
                data.get("heading") in HEADINGS
            ):
                raise RefusedError(f"{name} has no known mobility, or no heading for it")
            for other in data.get("conflicts", ()):
                if other == name or name not in self.data[other].get("conflicts", ()):
                    raise RefusedError(f"{name} must avoid {other}, but not the other way round")
                if self.data[other]["start"] == data["start"]:
                    raise RefusedError(f"{name} and {other} start in one region")
            for goal in targets_of(data["objective"]):
                if not goal <= self.world.free:
                    raise RefusedError(f"a target of {name} lies in a wall")

    def replay(self) -> list[Claim]:
        """Refuse unless all lines are true; returns what is established."""
        for line, record in enumerate(self.bundle.trace, 2):
            self.line = line
            if record["tick"] != self.tick:
                if record["tick"] != self.tick + 1 or self.turn % len(self.robots):
                    raise RefusedError("a tick is left out, or a robot has not moved in it")
                self.tick += 1
            judge = getattr(self, "_" + record["type"], None)
            if self.outcome is not None:
                raise RefusedError("a line follows the outcome")
            if judge is not None:
                judge(record)
        self.line = 0
        where: list[tuple[str, int | None]] = [("trace.jsonl", None)]
        self._claim(
            "moves",
            f"All {self.moves} moves are legal: {self.answers} are the answers of "
            "these strategies to what the robots could observe, the others stay, step back "
            "or follow a joint plan. No wall, no standing obstacle, no collision.",
            where,
        )
        return self.claims

    def _claim(self, kind: str, text: str, evidence: list[tuple[str, int | None]]) -> None:
        self.claims.append(Claim(f"{kind}-{len(self.claims) + 1}", kind, text, evidence))

    # synthesis

    def _synthesis(self, record: Any) -> None:
        name = record["robot"]
        robot = self.robots[name]
        spec = record["spec"]
        task = self._task(record)
        said = f"{name}, tick {self.tick}, for '{in_words(record['objective'])}'"
        files: list[tuple[str, int | None]] = [("trace.jsonl", self.line)]
        files.append((f"specs/{spec}.structuredslugs", None))
        if record["verdict"] == "unrealizable":
            proof = f"counterstrategies/{spec}.json"
            if self.bundle.has(proof):
                self._check_task(record, robot, task)
                document = self.bundle.json(proof)
                text = read_specification(self.bundle.text(files[1][0]))
                strategy = Strategy(document["automaton"], text)
                start, chosen = tuple(document["start"]), document["chosen"]
                check_counterstrategy(text, strategy, list(start), chosen, document["measures"])
                Validation(self.world, task, strategy).check_counterstrategy(start, chosen)
                files.append((proof, None))
                self._claim("unrealizable", f"No strategy exists for {said}.", files)
            return
        if record["verdict"] != "realizable" or record.get("node") is None:
            return
        self._check_task(record, robot, task)
        digest, node = record["strategy"], record["node"]
        if digest is None:
            raise RefusedError("its strategy was never listed: nothing is proven about its moves")
        pair, key = (spec, digest), json.dumps([name, digest, node, repr(task)])
        files.append((f"strategies/{digest}.json", None))
        files.append((f"measures/{spec}-{digest}.json", None))
        if pair not in self._realized:
            text = read_specification(self.bundle.text(files[1][0]))
            strategy = Strategy(self.bundle.json(str(files[2][0])), text)
            measures = self.bundle.json(str(files[3][0]))
            self._realized[pair] = strategy, check_strategy(text, strategy, measures)
            what = f"The strategy of {said} realizes the text of its specification: "
            self._claim(
                "realizes", f"{what}{strategy.count} nodes, {strategy.edges} edges.", files[1:]
            )
        strategy, initial = self._realized[pair]
        if node not in initial:
            raise RefusedError(f"node {node} is not one with which the strategy may begin")
        if key not in self._kept:
            validation = Validation(self.world, task, strategy)
            validation.check_strategy(node)
            self._kept[key] = validation
            assumed = {"none": "whatever the others do"}.get(task.fairness, task.fairness)
            self._claim(
                "keeps",
                f"The strategy of {said} keeps the rules of the scenario and does "
                f"what it is for again and again ({assumed}).",
                files,
            )
        robot.validation, robot.nodes, robot.after = self._kept[key], {node}, None
        robot.knowledge = dict(task.knowledge)
        robot.signal = {"request": False, "assigned": task.neutral, "wait": False}

    def _task(self, record: Any) -> Task:
        cells = [frozenset(cell) for cell in self.scenario.get("partition") or ()]
        beliefs = {
            name: [frozenset(b) for b in known]
            for name, known in (record.get("beliefs") or {}).items()
        }
        knowledge = {}
        for name, known in (record.get("knowledge") or {}).items():
            if isinstance(known, list):
                known = self.world.size + beliefs[name].index(frozenset(known))
            knowledge[name] = known
        robot, objective = self.data[record["robot"]], record["objective"]
        if record.get("form") == "alternation" and "patrol" in objective:
            objective = {"visit": objective["patrol"]}
        exact = robot["tracking"] != "nearby"
        places, aims = record.get("places"), record.get("others_targets") or {}
        return Task(
            record["robot"],
            robot,
            (record["region"], record.get("heading")),
            objective,
            record.get("memory") or {},
            frozenset(region for region, _ in record.get("closed") or ()),
            tuple(record.get("moving") or ()),
            tuple(name for name in self.data if name in knowledge and exact),
            record["fairness"],
            knowledge,
            beliefs,
            cells,
            frozenset(record.get("sight_closed") or ()),
            None if places is None else frozenset(places),
            record.get("neutral") or 0,
            {name: targets_of({"visit": targets}) for name, targets in aims.items()},
            frozenset((region, heading) for region, heading in record.get("forbidden") or ()),
        )

    def _check_task(self, record: Any, robot: Robot, task: Task) -> None:
        """The circumstances for which a robot is synthesized are those of the run."""
        name = task.name
        region = robot.pose[0] if robot.toward is None else robot.toward
        if task.pose[0] != region or (robot.toward is None and task.pose != robot.pose):
            raise RefusedError(f"{name} is at {robot.pose}, but synthesized for {task.pose}")
        tried = record["verdict"] == "unrealizable" and self.tick  # for an objective not in force
        if not tried and not same_objective(task.objective, robot.objective):
            raise RefusedError(f"{name} is synthesized for another objective than the one in force")
        closed = {
            why.removeprefix("obstacles."): region for region, why in record.get("closed") or ()
        }
        for other in self.data[name].get("conflicts", ()):
            parked = closed.get(f"robots.{other}") in self.robots[other].places
            if other not in task.moving and not parked:
                raise RefusedError(f"{name} does not know of {other}")
        for why, region in closed.items():
            stands = why in self.known and self._stands(why, name)
            if why.startswith("robots."):
                stands = region in self.robots[why[7:]].places
            elif stands:
                stands = self.obstacles[why]["region"] == region
            if not stands:
                raise RefusedError(f"{name} takes {region} to be closed by {why}, which is not so")
        for obstacle, robots in self.sealed.items():
            if name in robots and obstacle not in closed:
                raise RefusedError(f"{name} does not know of {obstacle}")
        for other, value in task.knowledge.items():
            looked = whereabouts(self.world, task, other, value)  # it may have moved on since
            where = set().union(*(self.world.around(region) for region in looked))
            if not where & self.robots[other].places:
                raise RefusedError(f"{name} believes {other} to be where it is not")

    def _stands(self, obstacle: str, name: str) -> bool:
        """Whether an obstacle is in a robot's way now."""
        data = self.obstacles[obstacle]
        if name in self.sealed.get(obstacle, ()):
            return True
        if obstacle not in self.present or name not in data["blocks"]:
            return False
        left = self._needs(obstacle)[self.done.get(obstacle, 0) :]
        return not {need["action"] for need in left} <= set(self.data[name]["capabilities"])

    # moves

    def _observe(self, robot: Robot, extra: Iterable[int]) -> Row:
        """The inputs of a robot's strategy for what there is to observe now."""
        assert robot.validation is not None
        task, world, here = robot.validation.task, self.world, robot.pose[0]
        seen: dict[str, int] = {}
        if task.places is not None:
            seen = {key: int(robot.signal[key]) for key in ("request", "wait", "assigned")}
        if task.robot["tracking"] == "nearby":
            taken = set(extra).union(*(self.robots[other].places for other in task.moving))
            for heading in world.sides if task.moving else ():
                seen[f"busy_{heading}"] = int(world.step(here, heading) in taken)
        for other in task.tracked:
            seen[f"at_{other}"] = robot.knowledge[other] = self._look(robot, task, other)
        return tuple(seen[name] for name in robot.validation.inputs)

    def _look(self, robot: Robot, task: Task, other: str) -> int:
        """What a robot knows of another one after the look before its move."""
        there, here = self.robots[other].pose[0], robot.pose[0]
        assert robot.validation is not None
        if task.robot["tracking"] == "exact":
            return there
        radius, closed = task.robot.get("vision"), task.sight_closed
        if self.world.sees(here, there, radius, closed):
            return there
        before = robot.validation.whereabouts(other, robot.knowledge[other])
        reach = set().union(*(self.world.around(r) for r in before))
        hidden = {r for r in reach if not self.world.sees(here, r, radius, closed)}
        if there not in hidden:
            raise RefusedError(f"{other} is where nobody could believe it to be")
        return robot.validation.believed(other, hidden)

    def _move(self, record: Any) -> None:
        name = list(self.robots)[self.turn % len(self.robots)]
        robot = self.robots[name]
        if record["robot"] != name or (self.turn % len(self.robots) == 0) != (
            self.turn == len(self.robots) * (self.tick - 1)
        ):
            raise RefusedError(f"it is {name}'s turn")
        self.turn, self.moves = self.turn + 1, self.moves + 1
        self._check_motion(name, robot, record)
        target = record["to"] if record.get("toward") is None else record["toward"]
        after = (target, record.get("heading"))
        if robot.toward is not None:  # on its way: nothing was decided
            pass
        else:
            self._check_decision(name, robot, record, after)
        robot.refused, robot.back = None, None
        robot.pose = (record["to"], record.get("heading"))
        robot.toward = record.get("toward")
        if robot.toward is None and robot.after is not None:
            robot.nodes, robot.after = robot.after, None

    def _check_motion(self, name: str, robot: Robot, record: Any) -> None:
        """The rules of the world for one move."""
        start, to, toward = record["from"], record["to"], record.get("toward")
        if start != robot.pose[0]:
            raise RefusedError(f"{name} moves from {start}, but is at {robot.pose[0]}")
        goal = to if toward is None else toward
        if robot.toward is not None and (
            goal != robot.toward or (toward is not None and to != start)
        ):
            raise RefusedError(f"{name} leaves the step that it is in")
        if toward is not None and to != start:
            raise RefusedError(f"{name} moves and is still on its way")
        before = robot.pose
        options = self.world.moves(self.data[name]["mobility"], before)
        fits = {p for p in options if p[0] == goal}
        if robot.toward is not None and record.get("heading") == before[1]:
            fits.add((goal, before[1]))  # it turned when it set out
        if (toward is None and (goal, record.get("heading")) not in fits) or not fits:
            raise RefusedError(
                f"{name} cannot go from {before} to {goal} facing {record['heading']}"
            )
        if goal != start or robot.toward is not None:
            for obstacle, data in self.obstacles.items():
                if data["region"] == goal and self._stands(obstacle, name) and goal != start:
                    raise RefusedError(f"{name} enters {goal}, where {obstacle} stands")
        for other in self.data[name].get("conflicts", ()):
            if {to, goal} & self.robots[other].places:
                raise RefusedError(f"{name} and {other} are in one region")

    def _check_decision(self, name: str, robot: Robot, record: Any, after: Pose) -> None:
        """The move is the strategy's answer, or what the trace says that it is instead."""
        by = record.get("by") or ("backtrack" if robot.back else "strategy")
        busy = record.get("busy") or ()
        known = robot.validation
        if robot.refused is not None and not self.plan:
            looked = dict(robot.knowledge)
            answers = self._answers(robot, busy)  # to what it was told before
            robot.knowledge = looked
            if known is None or robot.refused not in {known.poses[n][0] for n in answers}:
                raise RefusedError(f"{name} steps back from where its strategy does not lead")
        if record.get("signal") is not None:
            robot.signal = record["signal"]
        answers = self._answers(robot, busy)
        if by == "plan":
            way = self.plan.get(name, [])
            if after[0] != robot.pose[0]:
                if len(way) < 2 or way[0] != robot.pose or way[1][0] != after[0]:
                    raise RefusedError(f"{name} leaves its plan")
                del way[0]
            robot.nodes = None
        elif by == "stay" or (by == "backtrack" and robot.back and robot.back[1] is None):
            if after != robot.pose:
                raise RefusedError(f"{name} moves, though it should stay")
            if not answers and by == "stay":
                robot.nodes = None
            elif by == "backtrack" and known is not None:  # it may have been told to wait
                waiting = {n for n in answers if known.poses[n] == after}
                robot.after = self._nodes(robot) | waiting
        elif by == "backtrack":
            node = (robot.back and robot.back[1]) or 0
            if robot.validation is None or node not in chain(
                *(robot.validation.strategy.next[n] for n in self._nodes(robot))
            ):
                raise RefusedError(f"{name} steps back to a node that does not follow")
            if robot.validation.poses[node] != after:
                raise RefusedError(f"{name} steps back to another pose than its node's")
            robot.after = {node}
        else:
            poses = {n: robot.validation.poses[n] for n in answers if robot.validation}
            if not poses:
                raise RefusedError(f"the strategy of {name} has no answer to what it observes")
            turned = record.get("toward") is None
            robot.after = {
                n for n, p in poses.items() if p == after or (p[0] == after[0] and not turned)
            }
            if not robot.after:
                said = ", ".join(map(str, set(poses.values())))
                raise RefusedError(f"{name} goes to {after}, but its strategy answers {said}")
            self.answers += 1

    def _nodes(self, robot: Robot) -> set[int]:
        """The nodes in which a robot may be: one, or after a joint plan all of its pose, for from
        each of them the strategy keeps what it promises."""
        if robot.nodes is None and robot.validation is not None:
            return robot.validation.of_pose.get(robot.pose, set())
        return robot.nodes or set()

    def _answers(self, robot: Robot, extra: Iterable[int]) -> set[int]:
        """The nodes that answer what a robot observes."""
        if robot.validation is None:
            return set()
        seen, strategy = self._observe(robot, extra), robot.validation.strategy
        nodes = chain(*(strategy.next[node] for node in self._nodes(robot)))
        return {node for node in nodes if strategy.inputs[node] == seen}

    def _violation(self, record: Any) -> None:
        name, data = record["robot"], self.obstacles[record["obstacle"]]
        robot = self.robots[name]
        if data["region"] != record["proposed"] or not self._stands(record["obstacle"], name):
            raise RefusedError(
                f"{record['obstacle']} does not block {name} at {record['proposed']}"
            )
        robot.refused = record["proposed"]
        self.known.add(record["obstacle"])

    def _backtrack(self, record: Any) -> None:
        robot = self.robots[record["robot"]]
        if robot.refused is None:
            raise RefusedError("nothing was refused")
        robot.back = record["to"], record.get("node")

    def _plan(self, record: Any) -> None:
        self.plan = {n: [(r, h) for r, h in way] for n, way in record["robots"].items()}

    def _plan_end(self, record: Any) -> None:
        del record
        self.plan = {}

    # obstacles, objectives, outcome

    def _needs(self, obstacle: str) -> list[Any]:
        data = self.obstacles[obstacle]
        plain = {"action": data["action"], "regions": data["resolution_regions"]}
        return data.get("needs") or [plain]

    def _discovered(self, record: Any) -> None:
        data = record["obstacle"]
        self.obstacles[data["name"]] = data
        self.present.add(data["name"])

    def _appeared(self, record: Any) -> None:
        self.present.add(record["obstacle"])
        self.done.pop(record["obstacle"], None)

    def _gone(self, record: Any) -> None:
        self.present.discard(record["obstacle"])
        self.known.discard(record["obstacle"])

    def _resolved(self, record: Any) -> None:
        obstacle = record["obstacle"]
        stage = self.done.get(obstacle, 0)
        need = self._needs(obstacle)[stage]
        for name in record.get("robots") or [record["robot"]]:
            if need["action"] not in self.data[name]["capabilities"]:
                raise RefusedError(f"{name} cannot {need['action']}")
            if not self.robots[name].places & set(need["regions"]):
                raise RefusedError(f"{name} is not where {obstacle} can be resolved")
        if obstacle not in self.present:
            raise RefusedError(f"{obstacle} is resolved, but does not stand")
        self.done[obstacle] = stage + 1
        if stage + 1 == len(self._needs(obstacle)):
            self.present.discard(obstacle)
            self.known.discard(obstacle)
            for robot in self.robots.values():
                robot.goals = []

    def _blocked(self, record: Any) -> None:
        self.known.add(record["obstacle"])
        self.sealed.setdefault(record["obstacle"], set()).update(record["robots"])

    def _push(self, record: Any) -> None:
        self.stack.append(record)
        self._in_force(record)

    def _pop(self, record: Any) -> None:
        same = ("obstacle", "requester", "helper", "reason")
        match = [p for p in self.stack if all(p.get(k) == record.get(k) for k in same)]
        if not match:
            raise RefusedError("what is dropped from the stack is not on it")
        self.stack.remove(match[-1])
        self._in_force(record)

    def _in_force(self, record: Any) -> None:
        if record["depth"] != len(self.stack):
            raise RefusedError(f"the stack has {len(self.stack)} entries, not {record['depth']}")
        if not self.stack:
            for name, objective in record["objectives"].items():
                if not same_objective(objective, self.data[name]["objective"]):
                    raise RefusedError(f"{name} does not get its own objective back")
        for name, objective in record["objectives"].items():
            self.robots[name].objective = objective

    def _goal(self, record: Any) -> None:
        robot = self.robots[record["robot"]]
        targets = targets_of(robot.objective)
        if targets and robot.pose[0] not in targets[record["goal"]]:
            raise RefusedError(f"{record['robot']} is not at its goal {record['goal']}")
        robot.goals.append(record["goal"])

    def _outcome(self, record: Any) -> None:
        self.outcome = record
        what = record["outcome"]
        where: list[tuple[str, int | None]] = [("trace.jsonl", self.line)]
        if what == "completed":
            rounds = self.scenario["until"].get("rounds") or 0
            for name, robot in self.robots.items():
                aims = targets_of(self.data[name]["objective"])
                met = min(robot.goals.count(k) for k in range(len(aims) or 1))
                if "hold" in robot.objective and robot.pose[0] in aims[0]:
                    met = rounds
                if met < rounds or not same_objective(
                    robot.objective, self.data[name]["objective"]
                ):
                    raise RefusedError(f"{name} has met its objective {met} times, not {rounds}")
            if self.stack:
                raise RefusedError("requests are still open")
            self._claim(
                "outcome",
                f"The mission is completed: every robot has met its objective "
                f"{rounds} times after the last resolution.",
                where,
            )


def same_objective(given: Mapping[str, Any], wanted: Mapping[str, Any]) -> bool:
    """Whether an objective is the wanted one, or asks for its targets in turn."""
    return given == wanted or ("patrol" in wanted and given == {"visit": wanted["patrol"]})


def in_words(objective: Mapping[str, Any]) -> str:
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
        if self.manifest.get("format") != "safenav-bundle" or self.manifest.get("version") != 1:
            raise RefusedError("manifest.json is not of format safenav-bundle, version 1")
        self.files = self.manifest["files"]
        if different := found ^ {*self.files, "manifest.json"}:
            raise RefusedError(f"{min(different)} is either missing or not in the manifest")
        for path, facts in self.files.items():
            data = self.read(path)
            if len(data) != facts["bytes"] or hashlib.sha256(data).hexdigest() != facts["sha256"]:
                raise RefusedError(f"{path} is not the file that the manifest names")
        for path in self.files:
            folder, _, name = path.rpartition("/")
            named = name.partition(".")[0]
            if folder in ("specs", "strategies") and self.files[path]["sha256"] != named:
                raise RefusedError(f"{path} is not named by its sha256")
        lines = [json.loads(line) for line in self.text("trace.jsonl").splitlines()]
        self.header, self.trace = lines[0], lines[1:]
        if self.header["type"] != "header" or self.header["scenario"] != self.json("scenario.json"):
            raise RefusedError("scenario.json is not what the header of the trace says")
        self._compare_source()

    def has(self, path: str) -> bool:
        return path in self.files

    def text(self, path: str) -> str:
        try:
            return self.read(path).decode()
        except (KeyError, OSError):
            raise RefusedError(f"{path} is missing") from None

    def json(self, path: str) -> Any:
        return json.loads(self.text(path))

    def _compare_source(self) -> None:
        """A map that is drawn in the YAML file is the map of the scenario."""
        for path in self.files:
            if path.startswith("source/") and path.endswith((".yaml", ".yml")):
                rows = [line.strip().strip("'\"- ") for line in self.text(path).splitlines()]
                drawn = [row for row in rows if row and not set(row) - {"#", "."}]
                if "#" in "".join(r for r in drawn if len(r) > 1 and "." in r):
                    drawn = [
                        row
                        for row in drawn
                        if len(row) > 1 or self.header["scenario"]["map"]["cols"] == 1
                    ]
                    if drawn != self.header["scenario"]["map"]["grid"]:
                        raise RefusedError(f"the map in {path} is not that of scenario.json")


def check(place: Path, *, compare: bool = True) -> tuple[str, str, list[Claim]]:
    """``accepted``, ``refused`` or ``too large``; the first reason; and what is established (of a
    bundle that is refused: until then). ``compare``: the manifest has to claim just that."""
    run = None
    try:
        bundle = Bundle(place)
        run = Run(bundle)
        run.replay()
        said = [(c["id"], c["kind"], c["text"]) for c in bundle.manifest["claims"]]
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
