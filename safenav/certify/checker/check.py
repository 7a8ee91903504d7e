"""PLACEHOLDER"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, combinations, product
from typing import Any

from check_strategies import (
    Clause,
    Formula,
    Refused,
    Row,
    Strategy,
    complete,
    parse,
    reads,
)

# ------------------------------------------------------------------------------ the world

HEADINGS = ("north", "east", "south", "west")
Pose = tuple[int, str | None]
"""A region, and the heading of robots that have one."""


class World:
    """The map of the scenario: which regions are free, and which lie next to each other."""

    def __init__(self, data: Any) -> None:
        grid = data["grid"]
        self.rows, self.cols = data["rows"], data["cols"]
        if len(grid) != self.rows or any(len(line) != self.cols for line in grid):
            raise Refused("the map is not as large as it says")
        cells = "".join(grid)
        if set(cells) - {"#", "."}:
            raise Refused("the map has other cells than '#' and '.'")
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


# ------------------------------------------------------------------------------ scenario -> strategy


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
        declared = {name: (0, 1) if d == "bool" else tuple(d) for name, d in own.get("memory", {}).items()}
        known = {v.name: (v.least, v.most) for v in self.strategy.spec.outputs}
        if any(known.get(name) != bounds for name, bounds in declared.items()):
            raise Refused("the memory of the objective is not that of the strategy")
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
                raise Refused(f"the inputs are {self.inputs}, but should be {names}")
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
        seen = {r for r in reach if world.sees(region, r, task.robot["vision"], task.sight_closed)}
        yield from seen
        if hidden := reach - seen:
            yield self.believed(name, hidden)

    def believed(self, name: str, hidden: Iterable[int]) -> int:
        """The value for: out of sight, in one of these regions, as far as cells can tell."""
        belief = frozenset(k for k, cell in enumerate(self.task.cells) if cell & set(hidden))
        for k, known in enumerate(self.task.beliefs[name]):
            if known == belief:
                return self.world.size + k
        raise Refused(f"{name} may be in the cells {sorted(belief)}, for which there is no input")

    def whereabouts(self, name: str, value: int) -> frozenset[int]:
        """The regions where another robot may be if that is known of it."""
        if value < self.world.size:
            return frozenset({value})
        belief = self.task.beliefs[name][value - self.world.size]
        return frozenset().union(*(self.task.cells[k] for k in belief))

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
        if self.task.kind == "hold" and here[0] in self.targets[0]:
            return {here}
        if self.task.places is not None and values["wait"]:
            return {here}
        shut = self.taken(source, values) | self.task.closed
        if self.task.kind == "patrol":
            shut |= self.targets[1 - awaited]  # the one whose turn it is not
        moves = self.world.moves(self.task.robot["mobility"], here)
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

    def assumptions(self) -> list[Any]:
        """What is assumed to happen again and again: functions of an edge's two nodes."""
        task, values = self.task, self.values
        found: list[Any] = []
        if task.places is not None:
            found.append(lambda s, t: not values[t]["wait"])
        if task.fairness == "out_of_my_way":
            for h in self.world.sides:
                found.append(
                    lambda s, t, h=h: self.world.step(self.poses[s][0], h) not in self.taken(s, values[t])
                )
        for name in task.moving if task.fairness != "out_of_my_way" else ():
            at = f"at_{name}"
            if task.fairness == "out_of_my_sight":
                found.append(lambda s, t, at=at: values[t][at] >= self.world.size)
            aims = self.targets if task.fairness == "off_my_targets" else ()
            for goal in aims:
                found.append(
                    lambda s, t, at=at, goal=goal, name=name: bool(
                        self.whereabouts(name, values[t][at]) - goal
                    )
                )
            aims = task.others_targets[name] if task.fairness == "at_its_targets" else ()
            for goal in aims:
                found.append(
                    lambda s, t, at=at, goal=goal, name=name: bool(
                        self.whereabouts(name, values[t][at]) & goal
                    )
                )
        return found

    def _unfold(self, starts: Iterable[int], visit: Any) -> list[tuple[int, int, int]]:
        """All steps of all runs from the start nodes: from, to, and a bit for each wish and then
        for each assumption that is met. ``visit`` judges each node and its awaited target."""
        assumptions, shift = self.assumptions(), len(self.wishes)
        known: dict[tuple[int, Row], int] = {}  # by region and observation: assumptions that are met
        offsets = [0]
        for targets in self.strategy.next:
            offsets.append(offsets[-1] + len(targets))
        first = self.task.memory.get("scout", self.task.memory.get("goal", 0)) if self.ordered else 0
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
                    bits = (a(source, target) << k for k, a in enumerate(assumptions, shift))
                    known[key] = sum(bits)
                met |= known[key]
                if (target, after) not in number:
                    number[target, after] = len(number)
                    queue.append((target, after))
                steps.append((number[source, awaited], number[target, after], met))
                if self.always and self.always[edge] == "0":
                    raise Refused(f"the edge from node {source} to {target} breaks the objective")
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
                raise Refused(f"node {node} has no answer to {row}, which can occur")
            for target in targets:
                key = (self.poses[node], awaited, self.strategy.inputs[target])
                if key not in allowed:
                    allowed[key] = self.legal(node, awaited, self.values[target])
                if self.poses[target] not in allowed[key]:
                    way = f"{self.poses[node]} to {self.poses[target]}"
                    raise Refused(f"the edge from node {node} to {target}, {way}, is no legal move")

        steps = self._unfold([start], visit)
        all_assumptions = (1 << len(self.assumptions())) - 1 << len(self.wishes)
        for k, wish in enumerate(self.wishes):
            if has_cycle([s for s in steps if not s[2] >> k & 1], all_assumptions):
                raise Refused(f"a run misses {wish} for ever, though it meets all assumptions")

    def _check_start(self, node: int) -> None:
        task, values = self.task, self.values[node]
        if self.poses[node] != task.pose:
            raise Refused(f"it begins at {self.poses[node]}, but the robot is at {task.pose}")
        first = {**task.memory, **{f"at_{name}": task.knowledge[name] for name in self._positions()}}
        for name, value in first.items():
            if values.get(name) != value:
                raise Refused(f"it begins with {name} = {values.get(name)}, not {value}")
        if not task.memory and self.memory and not self._begins(values):
            raise Refused("it begins as the objective forbids")

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
            raise Refused("the initial input is not what the robot knows at the start")
        begin = [
            node
            for node in self.strategy.initial()
            if self.strategy.inputs[node] == start and self.poses[node] == task.pose
        ]
        values = {**first, **self._pose_values(task.pose)}
        if self.memory and not task.memory:
            wanted = self._completed("init", self.memory, {**values, **dict.fromkeys(self.memory, 0)})
            begun = {tuple(self.values[n][name] for name in self.memory) for n in begin}
            if not wanted <= begun:
                raise Refused("not all ways to begin have a node")
        elif not begin and not self._begins(values):
            return
        elif not begin:
            raise Refused("the way to begin has no node")

        def visit(node: int, awaited: int) -> None:
            row = tuple(chosen[node])
            if row not in self.expected(node):
                raise Refused(f"the input chosen in node {node} cannot occur")
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
                raise Refused(f"in node {node} the robot could go on to {min(missing)}")

        steps = self._unfold(begin, visit)
        for k in range(len(self.assumptions())):
            if has_cycle([s for s in steps if not s[2] >> len(self.wishes) + k & 1], 0):
                raise Refused(f"a run misses assumption {k} for ever")
        if has_cycle(steps, (1 << len(self.wishes)) - 1):
            raise Refused("the robot can meet all its wishes")

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
