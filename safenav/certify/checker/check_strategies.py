"""First half of the checker: the demands of a specification and a scenario on a strategy.

A specification is a text in structured slugs: variables of the environment (INPUT) and of the robot
(OUTPUT), and for each side formulas about its beginning (INIT), about each step (TRANS, x' is the
next value of x), and about what happens infinitely often (LIVENESS). A strategy is a graph whose
nodes hold a value of every variable. It keeps rules, those of the text (``Strategy``) or those of
the scenario, computed without the text (``Task``), if
1. each way in which the environment may begin has a node;
2. from each node there is one edge for each next input that can occur, and each edge is allowed;
3. each infinite path meets every goal infinitely often, or misses an assumption forever from some
   point on. A *measure* shows that: see ``check_measure``.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cache
from itertools import chain, product, repeat
from math import prod
from typing import Any

from safenav.audit.kinds import ALTERNATION, shape_of
from safenav.audit.language import (
    HEADINGS,
    Clause,
    Key,
    Pose,
    RefusedError,
    Row,
    TooLargeError,
    closure,
    complete,
    function_of,
    named,
    primed,
    read_clause,
    require,
)
from safenav.audit.world import World

MOST_EDGES = 500_000
MOST_MEMORY = 64
# Programs disagree on whether a line ends there: a comment to one is a formula to another.
FOREIGN = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029]|\r(?!\n|\Z)")
PASSING = re.compile(r"busy_\w+")  # inputs without effect on the next observations
STRICTLY = ", without crossing the one whose turn it is not"
LOOSELY = "; it may cross the one whose turn it is not"
ASSUMED = {
    "none": "whatever the other robots do",
    "out_of_my_way": "if infinitely often no other robot is beside it",
    "off_my_targets": "if infinitely often the other robots are off its targets",
    "out_of_my_sight": "if infinitely often the other robots are out of its sight",
    "at_its_targets": "if infinitely often the other robots are at their own targets",
}
RULES = ("avoid", "always")  # what an objective forbids beside its goals
TOLD = ("request", "wait", "assigned")
SECTIONS = ("ENV_INIT", "SYS_INIT", "ENV_TRANS", "SYS_TRANS", "ENV_LIVENESS", "SYS_LIVENESS")

Json = Mapping[str, Any]
Edges = tuple[Sequence[int], Sequence[int]]  # the node before each edge, and the one after it
Met = list[bool]  # of each edge


class Specification:
    """``ranges``: the values of each variable, now and next."""

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
                raise RefusedError(f"'{line}' declares no variable, or one that there is")
            self.ranges[match[1]] = range(int(match[2] or 0), int(match[3] or 1) + 1)
        truths = {line for line in (*lines["INPUT"], *lines["OUTPUT"]) if line in self.ranges}
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
            raise TooLargeError(f"{size} edges; this checker takes {MOST_EDGES}")
        holds = function_of((*spec.names,), (*spec.env_init, *spec.sys_init))
        self.begin = [node for node, row in enumerate(self.rows(spec.names)) if holds(*row)]
        self.deciding = [n for n in spec.names if any(n in c.reads for c in spec.env_trans)]
        self.asked, self.expected = self.rows(self.deciding), cache(self._expected)

    def rows(self, names: Iterable[str]) -> list[Row]:
        """Return each node's values of some variables."""
        columns = [self.columns[name] for name in names]
        return [*zip(*columns, strict=True)] if columns else [()] * self.count

    def reach(self, begin: Iterable[int]) -> list[int]:
        """Return the nodes that paths from some nodes reach."""
        firsts = {self.first[node] for node in begin}
        return closure(firsts, lambda node: {self.first[target] for target in self.next[node]})

    def holds(self, clauses: Sequence[Clause], edges: Edges) -> Met:
        """Return on which edges all clauses hold, for the values before the edge and (primed) after
        it."""
        keys = (*sorted(set().union(*(clause.reads for clause in clauses))),)
        function = function_of(keys, (*clauses,))
        columns = ((self.columns[key.rstrip("'")], edges[key.endswith("'")]) for key in keys)
        values = [map(column.__getitem__, ends) for column, ends in columns]
        cases = zip(*values, strict=True) if keys else repeat((), len(edges[0]))
        return [bool(function(*case)) for case in cases]

    def edges(self, nodes: Sequence[int]) -> Edges:
        sources = [node for node in nodes for _ in self.next[node]]
        return sources, [*chain(*(self.next[node] for node in nodes))]

    def starts(self) -> set[Row]:
        """Return the inputs with which a run can begin."""
        return complete(self.spec.ranges, self.spec.inputs, self.spec.env_init, {})

    def openings(self, row: Row) -> set[Any]:
        """Return the robot's possible initial values, in the form of ``done``."""
        known = dict(zip(self.spec.inputs, row, strict=True))
        return complete(self.spec.ranges, self.spec.outputs, self.spec.sys_init, known)

    def _expected(self, row: Row) -> set[Row]:
        """Return the inputs that can come next, for an entry of ``asked`` of a node."""
        spec, known = self.spec, dict(zip(self.deciding, row, strict=True))
        return complete(spec.ranges, primed(spec.inputs), spec.env_trans, known)

    def replies(self, node: int, row: Row) -> set[Any]:
        """Return the robot's possible replies to an input, as ``done`` of the nodes that follow."""
        now = {name: column[node] for name, column in self.columns.items()}
        known = now | dict(zip(primed(self.spec.inputs), row, strict=True))
        return complete(self.spec.ranges, primed(self.spec.outputs), self.spec.sys_trans, known)

    def allowed(self, edges: Edges) -> Met:
        """Return which edges are such replies."""
        return self.holds((*self.spec.env_trans, *self.spec.sys_trans), edges)

    def describe(self, node: int, target: int) -> str:
        """Return why an edge is not allowed."""
        steps, edge = (*self.spec.env_trans, *self.spec.sys_trans), ([node], [target])
        return next(clause.text for clause in steps if self.holds([clause], edge) == [False])

    def met(self, edges: Edges) -> tuple[list[Met], list[Met]]:
        """Return on which edges each goal is met, and each assumption."""
        goals = [self.holds([goal], edges) for goal in self.spec.goals]
        return goals, [self.holds([clause], edges) for clause in self.spec.assumptions]


def check_strategy(rules: Any, graph: Strategy, nodes: Sequence[int], measures: Any) -> None:
    """Refuse unless the part of the strategy in these nodes keeps the rules. ``measures``: one for
    each goal."""
    for node in nodes:
        inputs = [graph.inputs[target] for target in graph.next[node]]
        missing = sorted(rules.expected(rules.asked[node]) - {*inputs})[:1]
        said = f"node {node} has no answer to {missing} of {graph.spec.inputs}"
        require(not missing, f"{said}, which can occur by {rules.name}")
        require(len({*inputs}) == len(inputs), f"node {node} has two answers to one input")
    edges = graph.edges(nodes)
    if not all(allowed := rules.allowed(edges)):
        node, target = (ends[allowed.index(False)] for ends in edges)
        said = f"{rules.name} forbids the edge from node {node} to node {target}"
        raise RefusedError(f"{said}: {rules.describe(node, target)}")
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
    require(good, f"{what}: the measure has a number below 0 or names an excuse that is not there")
    for edge in (edge for edge, good in enumerate(met) if not good):
        source, target = edges[0][edge], graph.first[edges[1][edge]]
        excuse, stays = which[source], numbers[target] == numbers[source]
        stays = stays and excuse is not None and excuse == which[target]
        stays = stays and not excuses[excuse][edge]
        if not (stays or numbers[target] < numbers[source]):
            raise RefusedError(f"{what}: no measure falls from node {source} to node {target}")


def check_realizes(graph: Strategy, measures: Any) -> None:
    """Refuse unless a strategy realizes the text of its specification."""
    begun = {graph.inputs[node] for node in graph.begin}
    require(graph.starts(), "no input can occur at first, so that nothing is shown")
    require(graph.starts() <= begun, "not all inputs that can occur at first have a node")
    check_strategy(graph, graph, [*dict.fromkeys(graph.first)], measures)
    del graph.done, graph.asked, graph.expected  # a run has no use for them


def poses_of(listed: Iterable[Sequence[Any]], mobility: str) -> frozenset[Pose]:
    """Return the poses of a list of ``[region, heading]``; null stands for any heading."""
    every = HEADINGS if mobility == "heading" else (None,)
    return frozenset((r, h) for r, given in listed for h in ((given,) if given else every))


class Objective:
    """A robot's objective: ``targets``, sets of regions of which any one counts, or formulas.
    ``goals``: their numbers. ``ranges``: the values of its memory, now and next."""

    def __init__(self, data: Json) -> None:
        rest = {key: value for key, value in data.items() if key not in (*RULES, "form")}
        ((self.kind, value),) = rest.items()
        self.avoid, self.always = frozenset(data.get("avoid", ())), tuple(data.get("always", ()))
        self.data, self.shape = data, shape_of(self.kind)
        known = self.shape.known or self.kind == "ltl"
        require(known, f"objectives of the kind {self.kind} are not known here")
        listed: Any = () if self.kind == "ltl" else (value,) if self.shape.one else value
        self.targets = [frozenset([t] if isinstance(t, int) else t) for t in listed]
        own: Json = value if self.kind == "ltl" else {}
        memory: Json = own.get("memory", {})
        self.inputs = [*own.get("inputs", ())]  # of the environment, that its formulas name
        truths = {name for name, given in memory.items() if given == "bool"} | {*self.inputs}
        texts = (own.get(part, ()) for part in ("init", "safety", "liveness"))
        listed = ([t] if isinstance(t, str) else t for t in texts)
        parts = ([read_clause(text, truths) for text in part] for part in listed)
        self.init, self.safety, self.liveness = parts
        steps = (f"region' = region | ({text})" for text in self.always)
        self.safety += [read_clause(text, truths) for text in steps]
        count = len(self.targets) or len(self.liveness) or 1
        self.goals = frozenset(range(count - 1 if self.shape.settles else 0, count))
        once = self.shape.ends and count > 1 and self.targets[-1] & self.targets[-2]
        require(not once, "the last two targets share a region")
        bounds = {name: (0, 1) if given == "bool" else given for name, given in memory.items()}
        self.memory = {name: range(least, most + 1) for name, (least, most) in bounds.items()}
        both = self.memory | dict.fromkeys(self.inputs, range(2))
        self.ranges = both | {f"{name}'": values for name, values in both.items()}

    def serves(self, wanted: Objective) -> bool:
        """Return whether it is the wanted one, or requires its targets in turn."""
        weaker = {} if "form" in wanted.data else wanted.alternating()
        return self.data in (wanted.data, weaker)

    def alternating(self) -> Json:
        """Return the data of its weaker form, about the same and under the same rules."""
        weaker = {self.kind: ALTERNATION} if self.shape.strict else {}
        return {weaker.get(key, key): value for key, value in self.data.items()}

    def rules(self) -> tuple[Any, ...]:
        """Return what holds whatever the robot does."""
        return self.avoid, self.always

    def formed(self, form: str | None) -> Objective:
        """Return the objective that a strategy for it in this form pursues."""
        if not self.shape.strict or form != "alternation":
            return self
        found = f"a {self.kind} with 'form: literal' is made an alternation"
        require("form" not in self.data, found)
        return Objective(self.alternating())

    def words(self, world: World, form: str = "literal") -> str:
        """Return it as a sentence without its subject; ``form``: the weakest one that was proven,
        empty if none was."""
        never = ", ".join(world.word([region]) for region in sorted(self.avoid))
        rest = f"; never enter {never}" if never else ""
        return self._aims(world, form) + rest + "".join(f"; always {text}" for text in self.always)

    def _aims(self, world: World, form: str) -> str:
        if self.kind == "ltl":
            return "satisfy the formulas of its own objective"
        listed = [world.word(target) for target in self.targets]
        if self.shape.one:
            return f"go to {listed[0]} and stay"
        if self.shape.ends:
            return f"be at {', '.join(listed)} once, in this order, and stay at the last"
        if self.shape.covers:
            return f"be at each of {', '.join(listed)} infinitely often, in any order"
        how = {"literal": STRICTLY, "alternation": LOOSELY}.get(form, "") * self.shape.strict
        return f"be at {' and '.join(listed)} in turn, infinitely often{how}"

    def permits(self, before: Pose, after: Pose) -> bool:
        """Return whether a step keeps its formulas and what it avoids."""
        return after[0] not in self.avoid and self.allows(self.safety, before, after)

    def allows(self, lines: Iterable[Clause], before: Pose, after: Pose) -> bool:
        """Return whether formulas hold at a step, with some memory of at most MOST_MEMORY
        values."""
        known, few = named(before, after), prod(map(len, self.memory.values())) <= MOST_MEMORY
        asked = [line for line in lines if few or line.reads <= known.keys()]
        wanted = sorted(set().union(*(line.reads for line in asked)) - known.keys())
        return bool(complete(self.ranges, wanted, asked, known))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Objective) and self.data == other.data


def circumstances(line: Json) -> str:
    """Return a name for the task of a strategy, and the state where it begins."""
    passing = ("tick", "t", "reason", "seconds", "cached")
    told = {key: value for key, value in line.items() if key not in passing}
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()


class Task:
    """The rules of the scenario for a robot, whose circumstances ``line`` (a ``synthesis`` line of
    the trace) records, and the strategy or counterstrategy for it. ``robot``: its entry in the
    scenario; ``cells``: of which beliefs are made."""

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
        avoided = {r for r, name in line.get("closed") or () if name.endswith(".objective.avoid")}
        self.leaves = avoided & {line["region"]}  # it begins where it may only leave
        self.forbidden = poses_of(line.get("forbidden") or (), robot["mobility"])
        listed = line.get("goal_places") or ()  # where a target is entered while it is next
        self.goal_places = [poses_of(places, robot["mobility"]) for places in listed]
        self.moving = list(line.get("moving") or ())
        slow = world.live and self.moving and robot["tracking"] != "nearby"
        require(not slow, "in a live run it relies on the speed of robots in conflict with it")
        self.places = line.get("places")  # its assignable regions (``assignable``), or None
        # Knowledge of another robot is a region, or a belief: a set of cells, numbered from the
        # number of regions on.
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
        # Values of each node: the pose; the own memory; the target that it remembers, and the one
        # that it awaits (the one after it if that is reached there).
        targets, nothing, turns = self.targets, [0] * graph.count, robot["mobility"] == "heading"
        self.regions = graph.columns["region"]
        turned = [HEADINGS[h] for h in graph.columns["heading"]] if turns else repeat(None)
        self.poses: list[Pose] = [*zip(self.regions, turned, strict=False)]
        self.of_pose: dict[Pose, set[int]] = {}  # the nodes that runs reach, by their pose
        own, last, awaited = graph.rows(self.own), nothing, nothing
        if self.objective.shape.in_turn:
            last = graph.columns.get(next(iter(self.memory), ""), nothing)
            here = zip(last, self.regions, strict=True)
            awaited = [(k + (region in targets[k])) % len(targets) for k, region in here]
            if self.objective.shape.settles:  # from the last one on it awaits that
                here, last_one = zip(last, self.regions, strict=True), len(targets) - 1
                awaited = [min(k + (region in targets[k]), last_one) for k, region in here]
        self.before = [*zip(self.poses, awaited, own, graph.rows(self.heard), strict=True)]
        self.done = [*zip(self.poses, last, own, strict=True)]
        names = [*self.told, *self.busy, *self.positions, *self.heard]
        inputs = graph.spec.inputs
        require(names == inputs, f"the inputs are {inputs}, but should be {names}")
        self.deciding = [*self.told, *self.own, *self.positions]
        self.asked = [*zip(self.poses, graph.rows(self.deciding), strict=True)]
        self.expected, self.replies_at = cache(self._expected), cache(self._replies_at)

    def _expected(self, asked: tuple[Pose, Row]) -> set[Row]:
        """Return the inputs that can come next, after a pose with its command inputs, memory and
        knowledge."""
        (pose, row), groups = asked, list[Collection[Row]]()  # that do not depend on each other
        values = dict(zip(self.deciding, row, strict=True))
        if self.told:
            again = values["request"] and not values["wait"]
            places: Any = {values["assigned"]} if again else self.places
            sent = [(1, 0, place) for place in places if self.is_sent(pose, values, place)]
            idle = [(*told, self.line["neutral"]) for told in ((0, 0), (0, 1), (1, 1))]
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
        """Return whether the robot may be sent to a place from a pose, with its memory."""
        ways = [way for way in self.line.get("places_from") or () if place in way["places"]]
        here = [w for w in ways if pose in poses_of(w["from"], self.robot["mobility"])]
        return not ways or any((way.get("memory") or {}).items() <= values.items() for way in here)

    def after(self, name: str, region: int, value: int) -> set[int]:
        """Return the possible next knowledge of another robot, if ``value`` is known of it now. The
        other one stays or moves, not onto this robot if they are in conflict; then this robot
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
        """Return the regions where another robot may be if ``value`` is known of it."""
        if value < self.world.size:
            return frozenset({value})
        cells = self.beliefs[name][value - self.world.size]
        return frozenset().union(*(self.cells[cell] for cell in cells))

    def taken(self, region: int, seen: Json) -> set[int | None]:
        """Return the regions observed as occupied, from where the robot stands before its move."""
        if not self.nearby:
            return {seen[f"at_{name}"] for name in self.moving}
        return {self.world.step(region, side) for busy, side in self.busy.items() if seen[busy]}

    def replies(self, node: int, row: Row) -> set[Any]:
        return self.replies_at(self.before[node], row)

    def _replies_at(self, before: tuple[Pose, int, Row, Row], row: Row) -> set[Any]:
        """Return the replies to an observation: pose, target that was awaited, memory."""
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
        if self.goal_places:
            aim, places = self.targets[awaited], self.goal_places[awaited]
            legal = [after for after in legal if after[0] not in aim or after in places]
        now = dict(zip((*self.own, *self.heard), (*memory, *heard), strict=True))
        now |= {f"{name}'": seen[name] for name in self.heard}
        about = self.objective.ranges, primed(self.own), self.objective.safety
        ways = ((after, complete(*about, now | named(pose, after))) for after in legal)
        return {(after, awaited, way) for after, some in ways for way in some}

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
        """Return where goals and assumptions are met; while the robot is sent somewhere its own
        goals can wait."""
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
        """Return which assumptions are met at a step from a region. A belief counts as meeting one
        if it allows that; while the robot is commanded to wait, which is assumed to end, none is
        met."""
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
        """Return the nodes where runs begin: with assignable goals also those where it is commanded
        to wait at first."""
        return [start, *(self.graph.begin if self.told else ())]

    def check_keeps(self, start: int, measures: Any) -> None:
        """Refuse unless every run of the strategy from ``start`` keeps the scenario's rules."""
        known = named(self.pose) | self.memory | self.positions | self.inputs
        given = {name: self.graph.columns[name][start] for name in known}
        require(given == known, f"it begins with {given}, not {known}")
        begun = self.done[start] in self.openings(self.graph.inputs[start])
        require(begun, "it begins as the objective forbids")
        nodes = self.graph.reach(self.begin(start))
        check_strategy(self, self.graph, nodes, measures)
        for node in nodes:
            self.of_pose.setdefault(self.poses[node], set()).add(node)
        del self.before, self.done, self.asked, self.expected, self.replies_at

    def answers(self, robot: Any, robots: Json, shown: Iterable[int], lenient: bool) -> set[int]:
        """Return the nodes that follow from a robot's present observation in a run; its knowledge
        is updated. ``shown``: regions that it observes as occupied although no robot is there."""
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
        row, graph = tuple(seen[name] for name in self.graph.spec.inputs), self.graph
        following = chain(*(graph.next[node] for node in robot.nodes))
        return {node for node in following if graph.inputs[node] == row}

    def knows(self, node: int, values: Json) -> bool:
        columns = self.graph.columns
        return all(columns[name][node] == value for name, value in values.items())

    def meets(self, goal: int, before: Iterable[int], after: Collection[int]) -> bool:
        """Return whether a step met one of an objective's formulas, or no such step is known."""
        steps = [(node, a) for node in before for a in self.graph.next[node] if a in after]
        edges = [node for node, _ in steps], [node for _, node in steps]
        return not steps or any(self.graph.holds([self.objective.liveness[goal]], edges))
