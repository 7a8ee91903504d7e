"""The demands of a specification on a strategy, and the checks of one against any demands.

A specification is a text in structured slugs: variables of the environment (INPUT) and of the robot
(OUTPUT), and for each side formulas about its beginning (INIT), about each step (TRANS, x' is the
next value of x), and about what happens infinitely often (LIVENESS). A strategy is a graph whose
nodes hold a value of every variable. It keeps rules, those of the text (``Strategy``) or those of
the scenario, computed without the text (``check_tasks.Task``), if
1. each way in which the environment may begin has a node;
2. from each node there is one edge for each next input that can occur, and each edge is allowed;
3. each infinite path meets every goal infinitely often, or misses an assumption forever from some
   point on. A *measure* shows that: see ``check_measure``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from itertools import chain, repeat
from typing import Any

from safenav.audit.language import (
    HEADINGS,
    MOST_STATES,
    Clause,
    Key,
    Pose,
    RefusedError,
    Row,
    TooLargeError,
    closure,
    complete,
    function_of,
    primed,
    read_clause,
    require,
)

MOST_EDGES = 500_000
PASSING = re.compile(r"busy_\w+")  # inputs without effect on the next observations
# Programs disagree on whether these end a line: a comment to one program is a formula to another.
FOREIGN = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029]|\r(?!\n|\Z)")
SECTIONS = ("ENV_INIT", "SYS_INIT", "ENV_TRANS", "SYS_TRANS", "ENV_LIVENESS", "SYS_LIVENESS")

Json = Mapping[str, Any]
Edges = tuple[Sequence[int], Sequence[int]]  # the node before each edge, and the one after it
Met = list[bool]  # for each edge


class Specification:
    """A parsed specification. ``ranges``: the values of each variable, now and next."""

    def __init__(self, text: str) -> None:
        lines: dict[str, list[str]] = {section: [] for section in ("INPUT", "OUTPUT", *SECTIONS)}
        section = ""
        require(not FOREIGN.search(text), "a character in the text may or may not end a line")
        for line in (line.strip(" \t\r") for line in text.split("\n")):
            if line.startswith("["):
                section = line.strip("[]")
            elif line and not line.startswith("#"):
                lines[section].append(line)
        self.ranges: dict[Key, range] = {}
        for line in (*lines["INPUT"], *lines["OUTPUT"]):
            match = re.fullmatch(r"(?a)([A-Za-z_]\w*)(?::(\d+)\.\.\.(\d+))?", line)
            if match is None or match[1] in self.ranges:
                raise RefusedError(f"'{line}' declares no variable, or one that exists")
            self.ranges[match[1]] = range(int(match[2] or 0), int(match[3] or 1) + 1)
        every = (*lines["INPUT"], *lines["OUTPUT"])
        truths = frozenset(line for line in every if line in self.ranges)
        self.names, count = [*self.ranges], len(lines["INPUT"])
        self.inputs, self.outputs = self.names[:count], self.names[count:]
        self.ranges |= {f"{name}'": values for name, values in self.ranges.items()}
        parts = (tuple(read_clause(line, truths) for line in lines[s]) for s in SECTIONS)
        self.env_init, self.sys_init, self.env_trans, self.sys_trans, *liveness = parts
        self.assumptions, self.goals = liveness


class Strategy:
    """A strategy or counterstrategy, and the rules of its text. ``columns``: each variable's value
    in each node; ``next``: the nodes that follow; ``inputs``, ``done``: values that a node holds.

    *Equivalent nodes* are followed by the same nodes, and differ only in passing inputs whose
    present value no formula reads. Whatever holds for the edges of one holds for those of the
    other. So only the ``first`` is examined, and edges lead to the first of the equivalent nodes
    there."""

    name = "the text"

    def __init__(self, document: Any, text: str) -> None:
        self.spec = spec = Specification(text)
        nodes = [document["nodes"][str(k)] for k in range(len(document["nodes"]))]
        bits = [bit.partition("@")[0] for bit in document["variables"]]
        self.count, self.columns = len(nodes), dict[str, list[int]]()
        every = [*range(self.count)]  # so that equal numbers are one object
        for node, given in enumerate(nodes):
            good = len(given["state"]) == len(bits) and {*given["state"]} <= {0, 1}
            good = good and all(0 <= target < self.count for target in given["trans"])
            require(good, f"node {node} does not hold {len(bits)} bits, or leads nowhere")
        states = [*zip(*(given["state"] for given in nodes), strict=True)]
        for name in spec.names:  # its bits, the lowest first, hold value - least
            numbers, each = [0] * self.count, zip(bits, states, strict=False)
            for k, state in enumerate(state for bit, state in each if bit == name):
                numbers = [number + (bit << k) for number, bit in zip(numbers, state, strict=True)]
            self.columns[name] = [spec.ranges[name][number] for number in numbers]
        self.inputs, self.done = self.rows(spec.inputs), self.rows(spec.outputs)
        steps = (*spec.env_trans, *spec.sys_trans, *spec.assumptions, *spec.goals)
        reads = {*spec.outputs}.union(*(clause.reads for clause in steps))
        kept = self.rows(n for n in spec.names if n in reads or not PASSING.fullmatch(n))
        known: dict[Any, int] = {}
        keys = ((row, *given["trans"]) for row, given in zip(kept, nodes, strict=True))
        self.first = [known.setdefault(key, node) for node, key in enumerate(keys)]
        own = {node: [*map(every.__getitem__, nodes[node]["trans"])] for node in known.values()}
        self.next = [own[node] for node in self.first]
        self.size = sum(map(len, self.next))
        if (size := sum(map(len, own.values()))) > MOST_EDGES:
            raise TooLargeError(f"{size} edges; this checker accepts {MOST_EDGES}")
        holds = function_of((*spec.names,), (*spec.env_init, *spec.sys_init))
        self.begin = [node for node, row in enumerate(self.rows(spec.names)) if holds(*row)]
        self.deciding = [n for n in spec.names if any(n in c.reads for c in spec.env_trans)]
        self.asked, self.expected = self.rows(self.deciding), cache(self._expected)

    def rows(self, names: Iterable[str]) -> list[Row]:
        """Return each node's values of some variables."""
        columns = [self.columns[name] for name in names]
        return [*zip(*columns, strict=True)] if columns else [()] * self.count

    def reach(self, begin: Iterable[int]) -> list[int]:
        """Return the nodes that are reachable from some nodes."""
        firsts, next_ = {self.first[node] for node in begin}, self.next
        return closure(firsts, lambda k: {self.first[target] for target in next_[k]}, MOST_STATES)

    def holds(self, clauses: Sequence[Clause], edges: Edges) -> Met:
        """Return for each edge whether all clauses hold, for the values before it and (primed)
        after it. Clauses that read the same variables are evaluated together, once for equal
        values."""
        alike: dict[frozenset[Key], list[Clause]] = {}
        for clause in clauses:
            alike.setdefault(clause.reads, []).append(clause)
        met = [True] * len(edges[0])
        for reads, group in alike.items():
            function = cache(function_of(keys := (*sorted(reads),), (*group,)))
            columns = ((self.columns[key.rstrip("'")], edges[key.endswith("'")]) for key in keys)
            values = [map(column.__getitem__, ends) for column, ends in columns]
            cases = zip(*values, strict=True) if keys else repeat((), len(met))
            met = [good and bool(function(*case)) for good, case in zip(met, cases, strict=True)]
        return met

    def edges(self, nodes: Sequence[int]) -> Edges:
        sources = [node for node in nodes for _ in self.next[node]]
        return sources, [*chain(*(self.next[node] for node in nodes))]

    def starts(self) -> set[Row]:
        """Return the possible initial inputs."""
        return complete(self.spec.ranges, self.spec.inputs, self.spec.env_init, {})

    def openings(self, row: Row) -> set[Any]:
        """Return the robot's possible initial values, in the form of ``done``."""
        known = dict(zip(self.spec.inputs, row, strict=True))
        return complete(self.spec.ranges, self.spec.outputs, self.spec.sys_init, known)

    def _expected(self, row: Row) -> set[Row]:
        """Return the possible next inputs. ``row``: a node's entry in ``asked``."""
        spec, known = self.spec, dict(zip(self.deciding, row, strict=True))
        return complete(spec.ranges, primed(spec.inputs), spec.env_trans, known)

    def replies(self, node: int, row: Row) -> set[Any]:
        """Return the robot's possible replies to an input, in the form of ``done``."""
        now = {name: column[node] for name, column in self.columns.items()}
        known = now | dict(zip(primed(self.spec.inputs), row, strict=True))
        return complete(self.spec.ranges, primed(self.spec.outputs), self.spec.sys_trans, known)

    def allowed(self, edges: Edges) -> Met:
        """Return for each edge whether ENV_TRANS and SYS_TRANS allow it."""
        return self.holds((*self.spec.env_trans, *self.spec.sys_trans), edges)

    def describe(self, node: int, target: int) -> str:
        """Return the first formula that forbids an edge."""
        steps, edge = (*self.spec.env_trans, *self.spec.sys_trans), ([node], [target])
        return next(clause.text for clause in steps if self.holds([clause], edge) == [False])

    def met(self, edges: Edges) -> tuple[list[Met], list[Met]]:
        """Return for each goal, and for each assumption, the edges on which it is met."""
        goals = [self.holds([goal], edges) for goal in self.spec.goals]
        return goals, [self.holds([clause], edges) for clause in self.spec.assumptions]


def check_strategy(rules: Any, graph: Strategy, nodes: Sequence[int], measures: Any) -> None:
    """Refuse unless the strategy keeps the rules in these nodes. ``measures``: one for each
    goal."""
    for node in nodes:
        inputs = [graph.inputs[target] for target in graph.next[node]]
        missing = sorted(rules.expected(rules.asked[node]) - {*inputs})[:1]
        message = f"node {node} has no successor for {missing} of {graph.spec.inputs}"
        require(not missing, f"{message}, which can occur by {rules.name}")
        require(len({*inputs}) == len(inputs), f"node {node} has two successors for one input")
    edges = graph.edges(nodes)
    if not all(allowed := rules.allowed(edges)):
        node, target = (ends[allowed.index(False)] for ends in edges)
        message = f"{rules.name} forbids the edge from node {node} to node {target}"
        raise RefusedError(f"{message}: {rules.describe(node, target)}")
    goals, assumed = rules.met(edges)
    for k, (met, measure) in enumerate(zip(goals, measures, strict=True)):
        check_measure(graph, edges, f"goal {k} of {rules.name}", met, assumed, measure)


def check_counterstrategy(rules: Any, graph: Strategy, proof: Json, measures: Any) -> None:
    """Refuse unless the counterstrategy defeats every strategy that keeps the rules. The
    environment begins with the input ``start`` and continues from node v with ``chosen[v]``: that
    can occur, and each reply to it has a node. Each infinite path meets every assumption infinitely
    often (a measure for each), and misses a goal forever from some point on (one measure, whose
    excuses are the goals)."""
    start, chosen = tuple(proof["start"]), [*map(tuple, proof["chosen"])]
    require(start in rules.starts(), "the initial input cannot occur")
    begin = [node for node in graph.begin if graph.inputs[node] == start]
    begin = [node for node in begin if rules.done[node] in rules.openings(start)]
    missing = rules.openings(start) - {rules.done[node] for node in begin}
    require(not missing, f"the robot could begin with {missing}")
    for node in (nodes := graph.reach(begin)):
        row, after = chosen[node], graph.next[node]
        occurs = row in rules.expected(rules.asked[node])
        require(occurs, f"the input chosen in node {node} cannot occur")
        listed = {rules.done[target] for target in after if graph.inputs[target] == row}
        missing = rules.replies(node, row) - listed
        require(not missing, f"in node {node} the robot could continue to {missing}")
    edges, (*each, last) = graph.edges(nodes), measures
    goals, assumed = rules.met(edges)
    for k, (met, measure) in enumerate(zip(assumed, each, strict=bool(edges[0]))):
        check_measure(graph, edges, f"assumption {k}, infinitely often", met, [], measure)
    never = [False] * len(edges[0])
    check_measure(graph, edges, "a goal is missed forever", never, goals, last)


def check_measure(
    graph: Strategy, edges: Edges, what: str, met: Met, excuses: list[Met], given: Any
) -> None:
    """Refuse unless each infinite path of these edges meets the goal infinitely often, or one of
    the ``excuses`` never again from some point on.

    A measure gives each node a number n and perhaps an excuse a. On each edge that does not meet
    the goal n falls; or n and a stay the same, and a is not met. Once the goal is no longer met n
    never rises, so at some point it stays; from there on a stays as well, and is not met."""
    numbers, which = given["n"], given["a"]
    good = min(numbers, default=0) >= 0 and all(a is None or 0 <= a < len(excuses) for a in which)
    require(good, f"{what}: the measure has a negative value or names an unknown assumption")
    for edge in (edge for edge, good in enumerate(met) if not good):
        source, target = edges[0][edge], graph.first[edges[1][edge]]
        excuse, stays = which[source], numbers[target] == numbers[source]
        stays = stays and excuse is not None and excuse == which[target]
        stays = stays and not excuses[excuse][edge]
        if not (stays or numbers[target] < numbers[source]):
            raise RefusedError(
                f"{what}: the measure does not decrease from node {source} to node {target}"
            )


def check_realizes(graph: Strategy, measures: Any) -> None:
    """Refuse unless a strategy realizes the text of its specification."""
    begun = {graph.inputs[node] for node in graph.begin}
    require(graph.starts(), "no initial input is possible, so nothing is shown")
    require(graph.starts() <= begun, "not every possible initial input has a node")
    check_strategy(graph, graph, [*dict.fromkeys(graph.first)], measures)
    del graph.done, graph.asked, graph.expected  # a run has no use for them


def poses_of(listed: Iterable[Sequence[Any]], mobility: str) -> frozenset[Pose]:
    """Return the poses of a list of ``[region, heading]``; null stands for any heading."""
    every = HEADINGS if mobility == "heading" else (None,)
    return frozenset((r, h) for r, given in listed for h in ((given,) if given else every))
