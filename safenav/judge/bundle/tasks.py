"""The demands of a scenario on a strategy: the robot, its objective, the possible inputs (also what
it observes of other robots), and the assumptions about them. No specification is read."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from functools import cache
from itertools import chain, product
from typing import Any

from safenav.judge.bundle.strategies import (
    BundleTooLargeError,
    Edges,
    Met,
    Row,
    Strategy,
    check_counterstrategy,
    check_strategy,
    require,
)
from safenav.judge.formulas import HEADINGS, Pose
from safenav.judge.lines import Line, Objective
from safenav.judge.state import State
from safenav.judge.world import World, closure

TOLD = ("request", "wait", "assigned")
Seen = Mapping[str, int]
Done = tuple[Pose, int, Row]  # a pose, the target that a robot remembers, and its memory


def formed(objective: Objective, form: str | None) -> Objective:
    """Return the objective that a strategy synthesized in this form pursues."""
    if not objective.strict or form != "alternation":
        return objective
    require(not objective.literal, "a patrol with 'form: literal' is made an alternation")
    return objective.alternating()


class Task:
    """The scenario's demands on the strategy or counterstrategy (``graph``) of a ``synthesis``
    line. ``own``, ``heard``: the memory and the inputs of its formulas; ``told``: its command
    inputs. For each node: its pose; ``before``: the pose, the target that the robot awaits, memory
    and inputs; ``asked``: what the next inputs depend on; ``done``: what a step leads to."""

    def __init__(self, document: Any, e: Line, s: State) -> None:
        require(e.region is not None, "its circumstances are missing")
        robot = s.robots[e.robot]
        self.line, self.world, self.faces = e, s.world, robot.faces
        self.others, self.objective = Others(e, s), formed(e.objective, e.form)
        self.pose: Pose = (e.region, e.heading if self.faces else None)
        self.formulas = formulas = self.objective.formulas
        names = formulas.names if formulas and self.objective.kind == "ltl" else []
        self.heard: list[str] = formulas.inputs if formulas and names else []
        self.own = names[: len(names) - len(self.heard)]
        self.memory: Mapping[str, int] = e.memory or {}
        self.told = TOLD if e.places is not None else ()
        others = [*self.others.names.values()]
        inputs = [*self.told, *others, *self.heard]
        self.graph = graph = Strategy(document, inputs)
        known = ["region", "heading"] if self.faces else ["region"]
        missing = {*known, *names} - {*graph.columns}
        require(not missing, f"the strategy has no variable {', '.join(sorted(missing))}")
        rows = graph.rows(known)
        self.poses = [(row[0], HEADINGS[row[1]] if self.faces else None) for row in rows]
        self.of_pose: dict[Pose, set[int]] = {}  # the nodes that runs reach, by their pose
        own, last, awaited = graph.rows(self.own), [0] * graph.count, [0] * graph.count
        # Without a memory of the next target, ``visit`` is infinitely often at each.
        self.in_turn = self.objective.in_turn and (self.objective.settles or bool(self.memory))
        if self.in_turn:
            last = graph.columns.get(next(iter(self.memory), ""), last)
            awaited = [self._awaited(*each) for each in zip(last, self.poses, strict=True)]
        self.before = [*zip(self.poses, awaited, own, graph.rows(self.heard), strict=True)]
        self.done = [*zip(self.poses, last, own, strict=True)]
        self.deciding = [*self.told, *self.own, *others]
        self.asked = [*zip(self.poses, graph.rows(self.deciding), strict=True)]
        self.closed = {region for region, _ in e.closed or ()}
        every = HEADINGS if self.faces else (None,)
        given = e.forbidden or ()
        self.forbidden = {(r, h) for r, one in given for h in ((one,) if one else every)}
        heard = {name: int(on) for name, on in (e.inputs or {}).items()}
        self.given = self.others.values | {name: heard[name] for name in self.heard}
        idle = {"assigned": e.neutral} if self.told else {}
        first = dict.fromkeys(inputs, 0) | self.given | idle
        self.opening = tuple(first[name] for name in inputs)
        self.expected, self.legal = cache(self._expected), cache(self._legal)
        self.keeps, self.assumed = cache(self._keeps), cache(self._assumed)
        self.goals_met = cache(self._goals_met)

    def _awaited(self, last: int, pose: Pose) -> int:
        """Return the target that a robot awaits, given the one that it remembers: the next one if
        it is there."""
        targets = self.objective.targets
        turn, count = last + (pose[0] in targets[last]), len(targets)
        return min(turn, count - 1) if self.objective.settles else turn % count

    def _seen(self, row: Row) -> dict[str, int]:
        return dict(zip(self.graph.names, row, strict=True))

    def _expected(self, asked: tuple[Pose, Row]) -> set[Row]:
        """Return the possible next inputs from a pose, given commands, memory and knowledge."""
        (pose, row), groups = asked, list[Collection[Row]]()  # independent groups of inputs
        values = dict(zip(self.deciding, row, strict=True))
        if self.told:
            again = values["request"] and not values["wait"]
            places: Iterable[int] = {values["assigned"]} if again else self.line.places
            sent = [(1, 0, place) for place in places if self._is_sent(pose, values, place)]
            idle = [(*command, self.line.neutral) for command in ((0, 0), (0, 1), (1, 1))]
            groups.append([*sent, *idle])
        groups += self.others.expected(pose[0], values)
        groups += [[(0,), (1,)] for _ in self.heard]
        return {tuple(chain(*rows)) for rows in product(*groups)}

    def _is_sent(self, pose: Pose, values: Mapping[str, int], place: int) -> bool:
        """Return whether the robot may be commanded to a region from a pose with its memory."""
        ways = [way for way in self.line.places_from or () if place in way.places]
        here = [way for way in ways if pose in way.start or (pose[0], None) in way.start]
        return not ways or any((way.memory or {}).items() <= values.items() for way in here)

    def _legal(self, pose: Pose, awaited: int, row: Row) -> set[Pose]:
        """Return the poses that a robot may go to from a pose after an observation."""
        seen, own = self._seen(row), self.objective
        due = not own.in_turn or awaited == len(own.targets) - 1
        held = own.settles and due and pose[0] in own.last and not seen.get("request")
        stays = held or seen.get("wait")
        moves = {pose} if stays else {pose, *self.world.steps(self.faces, pose)}
        left = {pose[0]} & {self.pose[0]}  # its start, if closed: it never returns
        shut = {*(self.closed - left)}
        if own.strict:  # none of the targets whose turn it is not
            shut = shut.union(*(t for k, t in enumerate(own.targets) if k != awaited))
        free = self.world.free
        return {to for to in moves - self.forbidden if to[0] not in shut and to[0] in free}

    def _keeps(self, before: tuple[Pose, Row], after: tuple[Pose, Row]) -> bool:
        """Return whether a step keeps the safety formulas, with memory and inputs."""
        return self.formulas is None or all(self.formulas.holds("safety", *before, *after))

    def allows(self, node: int, target: int) -> bool:
        """Return whether the scenario allows an edge."""
        (pose, awaited, own, heard), (after, last, new) = self.before[node], self.done[target]
        if last != awaited or after not in self.legal(pose, awaited, self.graph.inputs[target]):
            return False
        return self.keeps((pose, own + heard), (after, new + self.before[target][3]))

    def _memories(self) -> set[Row]:
        if self.formulas is None or not self.own:
            return {()}
        if not self.formulas.whole:
            raise BundleTooLargeError("formulas with many memories, of a robot without a strategy")
        return {row[: len(self.own)] for row in self.formulas.values}

    def replies(self, node: int, row: Row) -> set[Done]:
        """Return the possible replies to an observation, in the form of ``done``."""
        pose, awaited, own, heard = self.before[node]
        seen, memories = self._seen(row), self._memories()
        now = tuple(seen[name] for name in self.heard)
        return {
            (after, awaited, new)
            for after, new in product(self.legal(pose, awaited, row), memories)
            if self.keeps((pose, own + heard), (after, new + now))
        }

    def openings(self) -> set[Done]:
        """Return the possible initial states of the robot, in the form of ``done``."""
        if self.memory and self.own:
            return {(self.pose, 0, tuple(self.memory[name] for name in self.own))}
        heard = tuple(self.given[name] for name in self.heard)
        last, found = max(self.memory.values(), default=0), set()
        for own in self._memories():
            here, own_rules = (self.pose, own + heard), self.formulas
            init = () if own_rules is None else own_rules.holds("init", *here, *here)
            found |= {(self.pose, last, own)} if all(init) else set()
        return found

    def answered(self, row: Row) -> list[int]:
        """Return the nodes in which a robot may begin with these inputs."""
        possible, graph = self.openings(), self.graph
        nodes = (node for node in range(graph.count) if graph.inputs[node] == row)
        return [node for node in nodes if self.done[node] in possible]

    def begin(self, start: int) -> list[int]:
        """Return the initial nodes; with assignable goals also those with another command."""
        given, graph = {n: v for n, v in self.given.items() if n not in self.told}, self.graph
        alike = (
            n for n in range(graph.count if self.told else 0) if self.done[n] == self.done[start]
        )
        return [start, *(node for node in alike if graph.values(node, given) == given)]

    def met(self, edges: Edges) -> tuple[list[Met], list[Met]]:
        """Return for each goal, and for each assumption, the edges on which it is met. The robot's
        own goals may wait while it is commanded to a region."""
        graph, targets = self.graph, self.objective.targets
        steps = [*zip(*edges, strict=True)]
        if self.in_turn:
            counts = range(len(targets) - 1 if self.objective.settles else 0, len(targets))
            ends = ((self.before[node][1], self.poses[after][0]) for node, after in steps)
            goals = [[region in targets[k] and k in counts for k, region in ends]]
        else:
            goals = [[self.poses[after][0] in t for _, after in steps] for t in targets]
        if self.objective.kind == "ltl" and self.formulas:
            each = [self.goals_met(self.before[a], self.before[b]) for a, b in steps]
            goals = [[met[k] for met in each] for k in range(self.formulas.count)]
        if self.told:
            request, wait, place = (graph.columns[name] for name in TOLD)
            sent = [request[after] == 1 for _, after in steps]
            goals = [[s or good for s, good in zip(sent, met, strict=True)] for met in goals]
            here = (wait[b] == 1 or place[b] == self.poses[b][0] for _, b in steps)
            goals.append([not s or there for s, there in zip(sent, here, strict=True)])
        held = [self.assumed(graph.inputs[b]) for _, b in steps]
        return goals, [list(each) for each in zip(*held, strict=True)]

    def _goals_met(self, before: Any, after: Any) -> list[bool]:
        (pose, _, own, heard), (to, _, new, now) = before, after
        given = pose, own + heard, to, new + now
        return [] if self.formulas is None else self.formulas.holds("liveness", *given)

    def _assumed(self, row: Row) -> list[bool]:
        """Return for each assumption whether it is met at a step. While the robot is
        commanded to wait (assumed to end), no assumption is met."""
        seen, found = self._seen(row), [True] if self.told else []
        for name in self.heard:
            found += [seen[name] == value for value in (self.line.again or {}).get(name, ())]
        return [held and not seen.get("wait") for held in found]

    def check_keeps(self, start: int, measures: Any) -> None:
        """Refuse unless every run of the strategy from a node keeps the scenario's demands."""
        require(start < self.graph.count, f"the strategy has no node {start}")
        turns = {"heading": HEADINGS.index(str(self.pose[1]))} if self.faces else {}
        known: dict[str, int | None] = {
            "region": self.pose[0],
            **turns,
            **self.memory,
            **self.given,
        }
        given = self.graph.values(start, known)
        require(given == known, f"its initial values are {given}, not {known}")
        require(self.done[start] in self.openings(), "its initial state violates the objective")
        nodes = self.graph.reach(self.begin(start))
        check_strategy(self, nodes, measures)
        for node in nodes:
            self.of_pose.setdefault(self.poses[node], set()).add(node)

    def check_defeats(self, proof: Any) -> None:
        """Refuse unless the counterstrategy defeats every strategy."""
        check_counterstrategy(self, proof)


class Others:
    """The robots that a robot tracks, as its strategy knows them. One stays or takes steps; then
    this one looks, and moves. Knowledge of a robot is a region, or a belief: a set of cells, with a
    number above those of the regions."""

    def __init__(self, e: Line, s: State) -> None:
        self.line, self.world, self.live = e, s.world, s.live
        self.radius = s.robots[e.robot].data.vision
        self.cells = s.scenario.partition or ()
        known = e.knowledge or {}
        require(set(known) <= {*s.robots} - {e.robot}, "it knows of robots that do not exist")
        self.first = {name: self.number(name, what) for name, what in known.items()}
        self.names = {name: f"at_{name}" for name in self.first}
        self.values = {self.names[name]: value for name, value in self.first.items()}

    def number(self, name: str, known: int | Iterable[int]) -> int:
        if isinstance(known, int):
            return known
        belief, listed = frozenset(known), (self.line.beliefs or {}).get(name, ())
        require(belief in listed, f"no input says that {name} may be in the cells {sorted(belief)}")
        return self.world.size + int(listed.index(belief))

    def whereabouts(self, name: str, value: int) -> frozenset[int]:
        """Return the regions where another robot may be, given the knowledge ``value`` of it."""
        if value < self.world.size:
            return frozenset({value})
        cells = self.line.beliefs[name][value - self.world.size]
        return frozenset().union(*(self.cells[cell] for cell in cells))

    def later(self, regions: Iterable[int]) -> set[int]:
        """Return where a robot in one of the regions may be at the next look: at most one step
        away; in a live run, where nothing bounds the number of its steps, wherever it can go."""

        def steps(region: int) -> Iterable[int]:
            return (to for to, _ in self.world.steps(False, (region, None)))

        regions = {*regions}
        return closure(regions, steps) if self.live else regions.union(*map(steps, regions))

    def after(self, name: str, region: int, value: int) -> set[int]:
        """Return the possible next knowledge of another robot, given the present one, for a robot
        in a region."""
        reach = self.later(self.whereabouts(name, value))
        seen = {r for r in reach if self.sees(region, r)}
        hidden = [k for k, cell in enumerate(self.cells) if cell & (reach - seen)]
        return seen | ({self.number(name, hidden)} if seen != reach else set())

    def expected(self, region: int, values: Seen) -> Iterable[Collection[Row]]:
        """Yield the possible next values of each input."""
        for name, key in self.names.items():
            yield [(value,) for value in self.after(name, region, values[key])]

    def look(self, s: State, known: dict[str, int]) -> dict[str, int]:
        """Return the inputs of a robot now, and update what is ``known``."""
        here, found = s.robots[self.line.robot].pose[0], dict[str, int]()
        for name, key in self.names.items():
            there = s.robots[name].pose[0]
            if not self.sees(here, there):
                hidden = self.after(name, here, known[name])
                possible = {v for v in hidden if there in self.whereabouts(name, v)}
                require(possible or s.external, f"{name} is outside every possible belief")
                there = max(possible or hidden)
            found[key] = known[name] = there
        return found

    def sees(self, a: int, b: int) -> bool:
        return sees(self.world, a, b, self.radius, self.line.sight_closed or ())

    def check_known(self, s: State) -> None:
        """Refuse unless what the robot knows of others is so."""
        for name, value in self.first.items():
            where = self.whereabouts(name, value)
            later = self.later(where) if s.tick else where  # it may have moved since the look
            holds = s.robots[name].holds & later
            require(holds, f"{self.line.robot} believes {name} to be where it is not")


def sees(world: World, a: int, b: int, radius: float | None, closed: Collection[int]) -> bool:
    """Return whether region b is in sight from a. The distance of the centres is at most the
    radius; the segment between them passes through the interior of no wall or closed region, and
    not between two of them that touch at a corner."""
    (row, col), (row_b, col_b) = divmod(a, world.cols), divmod(b, world.cols)
    down, right = row_b - row, col_b - col
    if radius is not None and down * down + right * right > radius * radius:
        return False
    shut: dict[tuple[int, int], int] = {}  # distance of the segment from closed regions
    for r, c in product(*(range(min(0, far), max(0, far) + 1) for far in (down, right))):
        region = (row + r) * world.cols + col + c
        if region not in world.free or (region in closed and region not in (a, b)):
            shut[r, c] = 2 * abs(down * c - right * r) - abs(down) - abs(right)
    across = (1 if down > 0 else -1, 1 if right > 0 else -1)
    corners = ((r, c) for r, c in shut if shut.get((r + across[0], c - across[1])) == 0)
    return min(shut.values(), default=0) >= 0 and all(shut[corner] > 0 for corner in corners)
