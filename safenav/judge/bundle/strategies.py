"""Strategies as graphs, and their check against the demands of a scenario (``Task``).

A node of a strategy has a value of every variable: the inputs of the environment, and the robot's
own variables. A strategy keeps the demands if
1. each node has one edge for each next input that can occur, and each edge is allowed;
2. each infinite path meets every goal infinitely often, or from some point on never meets one of
   the assumptions. A *measure* proves this: see ``check_measure``.
"""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cache
from itertools import chain, product
from typing import Any

from safenav.judge.formulas import HEADINGS, Pose
from safenav.judge.lines import Line, Objective
from safenav.judge.state import State
from safenav.judge.world import TooLargeError, World, closure

MOST_EDGES = 500_000
BIT = re.compile(r"(?a)([A-Za-z_]\w*)(?:@(\d{1,3})(?:\.(\d{1,9})\.(\d{1,9}))?)?")
"""The pattern of a bit's name: ``x`` for a truth value; ``x@0.LEAST.MOST``, ``x@1`` etc. for a
number."""

Row = tuple[int, ...]
Edges = tuple[Sequence[int], Sequence[int]]  # the nodes before and after each edge
Met = list[bool]  # for each edge: whether it meets a goal or an assumption


class RefusedError(Exception):
    """A part of a bundle that does not prove its claim."""


def require(holds: object, reason: str) -> None:
    if not holds:
        raise RefusedError(reason)


class Strategy:
    """A strategy or counterstrategy. ``columns``: each variable's value in each node; ``next``: the
    nodes that follow; ``inputs``: the values of ``names`` in each node."""

    def __init__(self, document: Any, names: Sequence[str]) -> None:
        nodes = [document["nodes"][str(k)] for k in range(len(document["nodes"]))]
        bits = [BIT.fullmatch(bit) for bit in document["variables"]]
        self.count, self.names, self.columns = len(nodes), names, dict[str, list[int]]()
        for node, given in enumerate(nodes):
            good = len(given["state"]) == len(bits) and {*given["state"]} <= {0, 1}
            good = good and all(0 <= target < self.count for target in given["trans"])
            require(good, f"node {node} does not have {len(bits)} bits, or has a wrong successor")
        most, bit_of = dict[str, int](), dict[str, int]()
        for at, (text, bit) in enumerate(zip(document["variables"], bits, strict=True)):
            number, due = (int(bit[2] or 0), bit_of.get(bit[1], 0)) if bit else (-1, 0)
            if bit is None or (bit[2] is None or bit[3] is not None) is not (number == 0):
                raise RefusedError(f"{text} is not a bit of a variable")
            require(number == due, f"{text}: expected bit {due} of {bit[1]}")
            bit_of[bit[1]] = number + 1
            column = self.columns.setdefault(bit[1], [int(bit[3] or 0)] * self.count)
            most.setdefault(bit[1], int(bit[4] or 1))
            each = zip(column, nodes, strict=True)
            self.columns[bit[1]] = [n + (given["state"][at] << number) for n, given in each]
        for name, column in self.columns.items():
            require(max(column, default=0) <= most[name], f"a value of {name} is out of its range")
        self.inputs = self.rows(names)
        self.next = [[*given["trans"]] for given in nodes]
        if (size := sum(map(len, self.next))) > MOST_EDGES:
            raise TooLargeError(f"{size} edges; this checker accepts at most {MOST_EDGES}")

    def rows(self, names: Sequence[str]) -> list[Row]:
        """Return the values of these variables in each node. Refuse if a variable is missing."""
        missing = sorted({*names} - {*self.columns})
        require(not missing, f"variables missing in the strategy: {', '.join(missing)}")
        columns = [self.columns[name] for name in names]
        return [*zip(*columns, strict=True)] if columns else [()] * self.count

    def reach(self, begin: Iterable[int]) -> list[int]:
        """Return all nodes that are reachable from the given ones."""
        return sorted(closure(begin, self.next.__getitem__))

    def edges(self, nodes: Sequence[int]) -> Edges:
        sources = [node for node in nodes for _ in self.next[node]]
        return sources, [*chain(*(self.next[node] for node in nodes))]


def check_measure(edges: Edges, what: str, met: Met, excuses: list[Met], given: Any) -> None:
    """Refuse unless each infinite path of these edges meets the goal infinitely often, or from some
    point on never meets one of the ``excuses``.

    A measure gives each node a number n and perhaps an excuse a. On each edge that does not meet
    the goal, n decreases; or n and a stay the same, and the edge does not meet a. Once no edge
    meets the goal, n never increases, so at some point it is constant; from there on a is constant
    and never met."""
    numbers, which = given["n"], given["a"]
    whole = all(type(n) is int and n >= 0 for n in numbers)
    good = whole and all(a is None or 0 <= a < len(excuses) for a in which)
    require(good, f"{what}: the measure has a negative value or names an unknown assumption")
    for edge in (edge for edge, good in enumerate(met) if not good):
        source, target = edges[0][edge], edges[1][edge]
        excuse, stays = which[source], numbers[target] == numbers[source]
        stays = stays and excuse is not None and excuse == which[target]
        stays = stays and not excuses[excuse][edge]
        if not (stays or numbers[target] < numbers[source]):
            where = f"from node {source} to node {target}"
            raise RefusedError(f"{what}: the measure does not decrease {where}")


Done = tuple[Pose, int, Row]  # a pose, the target that a robot remembers, and its memory


def formed(objective: Objective, form: str | None) -> Objective:
    """Return the objective of a strategy that was synthesized in this form of ``objective``."""
    if not objective.strict or form != "alternation":
        return objective
    require(not objective.literal, "a patrol with 'form: literal' has no alternation form")
    return Objective(**vars(objective) | {"kind": "visit"})


class Task:
    """The scenario's demands on the strategy or counterstrategy (``graph``) of a ``synthesis``
    line. ``own``, ``heard``: the memory variables and the inputs of its formulas; ``assumptions``:
    the input values that are assumed to recur infinitely often. For each node: its pose;
    ``before``: the values before a step (pose, awaited target, memory, inputs); ``done``: the
    values after the step into the node."""

    def __init__(self, document: Any, e: Line, s: State) -> None:
        require(e.region is not None, "the synthesis states no pose")
        if e.places is not None:
            raise TooLargeError("goals that are assigned at run time ('assignable')")
        robot = s.robots[e.robot]
        self.line, self.world, self.faces = e, s.world, robot.faces
        self.others, self.objective = Others(e, s), formed(e.objective, e.form)
        self.pose: Pose = (e.region, e.heading if self.faces else None)
        self.formulas = formulas = self.objective.formulas
        names = formulas.names if formulas else []
        self.heard: list[str] = formulas.inputs if formulas else []
        again = {each.name: each.again for each in s.scenario.inputs}
        self.assumptions = [(name, value) for name in self.heard for value in again[name]]
        self.own = names[: len(names) - len(self.heard)]
        self.memory: Mapping[str, int] = e.memory or {}
        self.begins = not (s.tick or s.moves)  # `init` holds only at the start of a run
        known = [f"at_{name}" for name in self.others.first]
        self.graph = graph = Strategy(document, [*known, *self.heard])
        known = ["region", "heading"] if self.faces else ["region"]
        fixed = dict(formulas.fixed) if formulas else {}
        fixed |= {} if len(s.world.free) > 1 else {"region": e.region}
        for name, value in fixed.items():  # a variable of one value has no bits
            graph.columns.setdefault(name, [value] * graph.count)
        rows = graph.rows(known)
        self.poses = [(row[0], HEADINGS[row[1]] if self.faces else None) for row in rows]
        self.of_pose: dict[Pose, set[int]] = {}  # the reachable nodes by pose
        own, last, awaited = graph.rows(self.own), [0] * graph.count, [0] * graph.count
        # Without a memory of the next target, ``visit`` requires each target infinitely often.
        self.in_turn = self.objective.in_turn and (self.objective.settles or bool(self.memory))
        if self.in_turn:
            last = graph.columns.get(next(iter(self.memory), ""), last)
            awaited = [self._awaited(*each) for each in zip(last, self.poses, strict=True)]
        self.before = [*zip(self.poses, awaited, graph.rows(names), strict=True)]
        self.done = [*zip(self.poses, last, own, strict=True)]
        self.closed = {region for region, _ in e.closed or ()}
        every = HEADINGS if self.faces else (None,)
        given = e.forbidden or ()
        self.forbidden = {(r, h) for r, one in given for h in ((one,) if one else every)}
        heard = {name: int(on) for name, on in (e.inputs or {}).items()}
        self.opening = (*self.others.first.values(), *(heard[name] for name in self.heard))
        self.expected, self.legal = cache(self._expected), cache(self._legal)
        self.keeps, self.assumed = cache(self._keeps), cache(self._assumed)
        self.goals_met = cache(self._goals_met)

    def _awaited(self, last: int, pose: Pose) -> int:
        """Return the index of the target that a robot awaits in ``pose``, given the previously
        awaited target ``last``."""
        targets = self.objective.targets
        turn, count = last + (pose[0] in targets[last]), len(targets)
        return min(turn, count - 1) if self.objective.settles else turn % count

    def _heard(self, row: Row) -> Row:
        """Return the values of the inputs ``heard``, which are the last ones of a row."""
        return row[len(self.others.first) :]

    def observes(self, node: int, s: State) -> bool:
        """Return whether a node has the inputs that the robot observes now."""
        row = self.graph.inputs[node]
        same = self._heard(row) == tuple(s.inputs[name] for name in self.heard)
        return same and self.others.agree(row, s)

    def _expected(self, pose: Pose, row: Row) -> set[Row]:
        """Return the inputs that a robot in ``pose`` may receive after the inputs ``row``."""
        known = self.others.expected(pose[0], row)
        return {*product(*known, *([(0, 1)] * len(self.heard)))}

    def _legal(self, pose: Pose, awaited: int) -> set[Pose]:
        """Return the poses to which a robot that awaits a target may go from ``pose``."""
        own = self.objective
        due = not own.in_turn or awaited == len(own.targets) - 1
        held = own.settles and due and pose[0] in own.last
        moves = {pose} if held else {pose, *self.world.steps(self.faces, pose)}
        left = {pose[0]} & {self.pose[0]}  # the robot may leave a closed start, but not return
        shut = {*(self.closed - left)}
        if own.strict:  # no target out of turn
            shut = shut.union(*(t for k, t in enumerate(own.targets) if k != awaited))
        free = self.world.free
        return {to for to in moves - self.forbidden if to[0] not in shut and to[0] in free}

    def _keeps(self, before: tuple[Pose, Row], after: tuple[Pose, Row]) -> bool:
        """Return whether a step satisfies the safety formulas with the given memory and inputs."""
        return self.formulas is None or all(self.formulas.holds("safety", *before, *after))

    def allows(self, node: int, target: int) -> bool:
        """Return whether the scenario allows an edge."""
        (pose, awaited, row), (after, _, new) = self.before[node], self.before[target]
        moves = self.done[target][1] == awaited and after in self.legal(pose, awaited)
        return moves and self.keeps((pose, row), (after, new))

    def _memories(self) -> set[Row]:
        if not self.own:
            return {()}
        if not self.formulas.whole:
            raise TooLargeError("too many memory values in formulas of a robot without a strategy")
        return {row[: len(self.own)] for row in self.formulas.values}

    def replies(self, node: int, row: Row) -> set[Done]:
        """Return the robot's possible replies to an observation, in the form of ``done``."""
        pose, awaited, before = self.before[node]
        now = self._heard(row)
        return {
            (after, awaited, new)
            for after, new in product(self.legal(pose, awaited), self._memories())
            if self.keeps((pose, before), (after, new + now))
        }

    def openings(self) -> set[Done]:
        """Return the possible initial states of the robot, in the form of ``done``."""
        if self.memory and self.own:
            return {(self.pose, 0, tuple(self.memory[name] for name in self.own))}
        heard, found = self._heard(self.opening), self._memories()
        if self.begins and self.formulas is not None:
            here = ((own, (self.pose, own + heard)) for own in found)
            found = {own for own, at in here if all(self.formulas.holds("init", *at, *at))}
        return {(self.pose, max(self.memory.values(), default=0), own) for own in found}

    def answered(self, row: Row) -> list[int]:
        """Return the nodes in which a strategy may begin when its inputs are ``row``."""
        possible, graph = self.openings(), self.graph
        nodes = (node for node in range(graph.count) if graph.inputs[node] == row)
        return [node for node in nodes if self.done[node] in possible]

    def met(self, edges: Edges) -> tuple[list[Met], list[Met]]:
        """Return two lists: the edges that meet each goal, and those that meet each assumption."""
        graph, targets = self.graph, self.objective.targets
        steps = [*zip(*edges, strict=True)]
        if self.in_turn:
            counts = range(len(targets) - 1 if self.objective.settles else 0, len(targets))
            ends = ((self.before[node][1], self.poses[after][0]) for node, after in steps)
            goals = [[region in targets[k] and k in counts for k, region in ends]]
        else:
            goals = [[self.poses[after][0] in t for _, after in steps] for t in targets]
        if self.objective.kind == "ltl":
            each = [self.goals_met(self.before[a], self.before[b]) for a, b in steps]
            goals = [[met[k] for met in each] for k in range(self.formulas.count)]
        held = [self.assumed(graph.inputs[b]) for _, b in steps]
        return goals, [list(each) for each in zip(*held, strict=True)]

    def _goals_met(self, before: Any, after: Any) -> list[bool]:
        (pose, _, old), (to, _, new) = before, after
        return list(self.formulas.holds("liveness", pose, old, to, new))

    def _assumed(self, row: Row) -> list[bool]:
        """Return, for each assumption, whether a step meets it."""
        on = dict(zip(self.heard, self._heard(row), strict=True))
        return [on[name] == value for name, value in self.assumptions]

    def check_keeps(self, start: int, measures: Any) -> None:
        """Refuse unless every run of the strategy from a node keeps the scenario's demands.
        ``measures``: one for each goal."""
        graph = self.graph
        require(start < graph.count, f"the strategy has no node {start}")
        begins = start in self.answered(self.opening)
        told = f"{self.done[start]} with the inputs {graph.inputs[start]}"
        require(begins, f"its initial values are {told}, unlike those of the run")
        nodes = graph.reach([start])
        for node in nodes:
            inputs = [graph.inputs[target] for target in graph.next[node]]
            for row in sorted(self.expected(self.poses[node], graph.inputs[node]) - {*inputs}):
                seen = ", ".join(f"{n} = {v}" for n, v in zip(graph.names, row, strict=True))
                which = f" for the inputs {seen}, which the scenario allows" if seen else ""
                raise RefusedError(f"node {node} has no successor{which}")
            require(len({*inputs}) == len(inputs), f"node {node} has two successors for one input")
        edges = graph.edges(nodes)
        for node, target in zip(*edges, strict=True):
            if not self.allows(node, target):
                edge = f"from node {node} to node {target}"
                where = f"from {self.poses[node]} to {self.poses[target]}"
                seen = f"observing {dict(zip(graph.names, graph.inputs[target], strict=True))}"
                raise RefusedError(f"the scenario forbids the edge {edge}: {where}, {seen}")
        goals, assumed = self.met(edges)
        for k, (met, measure) in enumerate(zip(goals, measures, strict=True)):
            check_measure(edges, f"goal {k} of the scenario", met, assumed, measure)
        for node in nodes:
            self.of_pose.setdefault(self.poses[node], set()).add(node)

    def check_defeats(self, proof: Mapping[str, Any]) -> None:
        """Refuse unless the counterstrategy defeats every strategy that keeps the demands. The
        environment begins with the input ``start`` and continues from node v with ``chosen[v]``.
        These inputs can occur, and each reply to one has a node. Each infinite path meets every
        assumption infinitely often (a measure for each), and from some point on never meets some
        goal (one measure, whose excuses are the goals)."""
        graph, start = self.graph, tuple(proof["start"])
        chosen = [*map(tuple, proof["chosen"])]
        require(start == self.opening, "the initial input cannot occur")
        begin = self.answered(start)
        missing = self.openings() - {self.done[node] for node in begin}
        require(not missing, f"no initial node has {missing}, which is possible")
        for node in (nodes := graph.reach(begin)):
            row, after = chosen[node], graph.next[node]
            occurs = row in self.expected(self.poses[node], graph.inputs[node])
            require(occurs, f"the input chosen in node {node} cannot occur")
            listed = {self.done[target] for target in after if graph.inputs[target] == row}
            missing = self.replies(node, row) - listed
            require(not missing, f"node {node} has no successor with {missing}, which is possible")
        edges, (*each, last) = graph.edges(nodes), proof["measures"]
        goals, assumed = self.met(edges)
        for k, (met, measure) in enumerate(zip(assumed, each, strict=bool(edges[0]))):
            check_measure(edges, f"assumption {k}, infinitely often", met, [], measure)
        never = [False] * len(edges[0])
        check_measure(edges, "a goal is missed forever", never, goals, last)


class Others:
    """A robot's knowledge, by its strategy, of the robots that it tracks. First each other robot
    stays or takes steps; then this robot observes and moves. Its knowledge of another robot is an
    integer: a region or, above all regions, a belief (a set of cells)."""

    def __init__(self, e: Line, s: State) -> None:
        self.line, self.world, self.live = e, s.world, s.live
        self.radius = s.robots[e.robot].data.vision
        self.cells, known = s.cells, e.knowledge or {}
        whole = s.world.free.issubset(frozenset().union(*s.cells))
        require(whole or not known, "the cells of beliefs leave out a free region")
        slow = not self.live and s.robots[e.robot].data.timing > 1
        require(not (known and slow), "other robots may take several steps between its turns")
        require(set(known) <= {*s.robots} - {e.robot}, "the strategy tracks unknown robots")
        self.first = {name: self.number(name, what) for name, what in known.items()}

    def number(self, name: str, known: int | Iterable[int]) -> int:
        if isinstance(known, int):
            return known
        belief, listed = frozenset(known), (self.line.beliefs or {}).get(name, ())
        require(belief in listed, f"no input value represents {name} in the cells {sorted(belief)}")
        return self.world.size + int(listed.index(belief))

    def whereabouts(self, name: str, value: int) -> frozenset[int]:
        """Return the regions where another robot may be, given the knowledge ``value``."""
        if value < self.world.size:
            return frozenset({value})
        cells = self.line.beliefs[name][value - self.world.size]
        return frozenset().union(*(self.cells[cell] for cell in cells))

    def later(self, regions: Iterable[int]) -> set[int]:
        """Return the regions where a robot in one of ``regions`` may be at the next observation: at
        most one step away. In a live run nothing bounds the number of its steps, so it may be in
        all regions that it can reach."""

        def steps(region: int) -> Iterable[int]:
            return (to for to, _ in self.world.steps(False, (region, None)))

        regions = {*regions}
        return {*closure(regions, steps)} if self.live else regions.union(*map(steps, regions))

    def after(self, name: str, region: int, value: int) -> set[int]:
        """Return the possible next knowledge of a robot in ``region`` about the robot ``name``,
        given its present knowledge ``value``."""
        reach = self.later(self.whereabouts(name, value))
        seen = {r for r in reach if self.sees(region, r)}
        hidden = [k for k, cell in enumerate(self.cells) if cell & (reach - seen)]
        return seen | ({self.number(name, hidden)} if seen != reach else set())

    def expected(self, region: int, row: Row) -> list[set[int]]:
        """Return the possible next knowledge about each tracked robot, given a row of inputs."""
        each = zip(self.first, row, strict=False)  # without the inputs of formulas
        return [self.after(name, region, known) for name, known in each]

    def agree(self, row: Row, s: State) -> bool:
        """Return whether a row of inputs is true: the region of each robot in sight, else a belief
        that contains its region (in an external world, any belief)."""
        here = s.robots[self.line.robot].pose[0]
        for name, value in zip(self.first, row, strict=False):
            there = s.robots[name].pose[0]
            in_sight, believed = self.sees(here, there), value >= self.world.size
            hidden = believed and (s.external or there in self.whereabouts(name, value))
            if not (value == there if in_sight else hidden):
                return False
        return True

    def sees(self, a: int, b: int) -> bool:
        return sees(self.world, a, b, self.radius, self.line.sight_closed or ())

    def check_known(self, s: State) -> None:
        """Refuse unless the robot's knowledge of other robots is true."""
        for name, value in self.first.items():
            where = self.whereabouts(name, value)
            later = self.later(where) if s.tick else where  # it may have moved since then
            holds = s.robots[name].holds & later
            require(holds, f"{self.line.robot} believes {name} to be where it is not")


def sees(world: World, a: int, b: int, radius: float | None, closed: Collection[int]) -> bool:
    """Return whether region b is in sight from a. The centres must be within the radius. The
    segment between them must cross no interior of a wall or closed region, and no corner where two
    of these touch."""
    (row, col), (row_b, col_b) = divmod(a, world.cols), divmod(b, world.cols)
    down, right = row_b - row, col_b - col
    if radius is not None and down * down + right * right > radius * radius:
        return False
    shut: dict[tuple[int, int], int] = {}  # distance between the segment and closed regions
    for r, c in product(*(range(min(0, far), max(0, far) + 1) for far in (down, right))):
        region = (row + r) * world.cols + col + c
        if region not in world.free or (region in closed and region not in (a, b)):
            shut[r, c] = 2 * abs(down * c - right * r) - abs(down) - abs(right)
    across = (1 if down > 0 else -1, 1 if right > 0 else -1)
    corners = ((r, c) for r, c in shut if shut.get((r + across[0], c - across[1])) == 0)
    return min(shut.values(), default=0) >= 0 and all(shut[corner] > 0 for corner in corners)
