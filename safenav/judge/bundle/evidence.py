"""The judge's additional rules for a bundle, and the claims that they establish."""

import hashlib
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from typing import Any

from safenav.judge.bundle.strategies import RefusedError, Task, formed, require
from safenav.judge.formulas import Pose
from safenav.judge.lines import Line, Objective
from safenav.judge.proofs.closures import case_of
from safenav.judge.proofs.negatives import may_have
from safenav.judge.rules import Rule
from safenav.judge.state import EXTERNAL, State
from safenav.judge.world import TooLargeError, closure
from safenav.strict_json import read_json

MOST_VALUES = 6_000_000
Order = tuple[str, int, str, int]
"""``first, i, then, j``: ``then`` departs for its waypoint ``j`` only once ``first`` is at its
waypoint ``i``."""


@dataclass
class Plan:
    """A plan in force. ``at``: the index of each robot's present waypoint."""

    ways: Mapping[str, tuple[Pose, ...]]
    orders: tuple[Order, ...]
    at: dict[str, int]

    def step(self, robot: str, after: Pose, s: State) -> None:
        """Refuse unless the robot's next waypoint is ``after`` and the orders allow the step."""
        require(robot in self.ways, f"{robot} moves by a plan that does not include it")
        index, way = self.at[robot] + 1, self.ways[robot]
        require(index < len(way), f"{robot} has no further waypoint in its plan")
        require(way[index] == after, f"{robot} goes to {after}, not to {way[index]} as planned")
        for first, i, then, j in self.orders:
            if (then, j) == (robot, index):
                to = s.robots[first].bound  # a strategy may drive the other robot after its plan
                there = self.at[first] - (to == self.ways[first][self.at[first]][0])
                require(there >= i, f"{robot} does not wait until {first} is at its waypoint {i}")
        self.at[robot] = index


def plan_of(e: Line, s: State) -> Plan:
    """Return the plan of a trace line. Refuse unless each path begins at its robot's pose and has
    only possible steps, and the orders keep rivals apart."""
    at = dict.fromkeys(e.robots, 0)
    for robot, way in e.robots.items():
        here, there = s.robots[robot].pose, s.destination(robot)
        require(way[:1] in ((here,), (there,)), f"the plan does not begin where {robot} is")
        at[robot] = int(here != there and way[0] == here)  # the robot already takes its first step
        require(not at[robot] or there in way[1:2], f"{robot} takes a step off its plan")
        for one, to in pairwise(way):
            legal = to in s.world.steps(s.robots[robot].faces, one)
            require(legal, f"{robot} cannot step from {one} to {to}")
    for first, i, then, j in e.orders:
        for robot, k in ((first, i), (then, j)):
            exists = k < len(e.robots.get(robot, ()))
            require(exists, f"an order names waypoint {k} of {robot}, which does not exist")
        require(j > at[then], f"an order delays a step that {then} has begun")
    plan = Plan(e.robots, e.orders, at)
    _check_apart(plan, s)
    return plan


def _check_apart(plan: Plan, s: State) -> None:
    """Refuse a plan that lets rivals into one region or two robots of a zone into that zone."""
    leaves = _precedence(plan)
    each = [((robot, i), at[0]) for robot, way in plan.ways.items() for i, at in enumerate(way)]
    for (robot, i), region in each:
        for other in s.mates[robot]:
            shut = s.kept_out(other, robot, frozenset([region]))
            bound, holds = s.robots[other].bound, s.robots[other].holds
            held = holds if bound is None else {bound}  # a robot in transit will arrive
            apart = other in plan.ways or not shut & held
            require(apart, f"{robot} would enter {s.show(region)}, which {other} closes to it")
            for j, (there, _) in enumerate(plan.ways.get(other, ())):
                one, two = (robot, i), (other, j)
                apart = there not in shut or leaves(one, two) or leaves(two, one)
                require(apart, f"the plan lets {robot} and {other} share a region or zone")


Place = tuple[str, int]


def _precedence(plan: Plan) -> Callable[[Place, Place], bool]:
    """Return a function of two waypoints ``one`` and ``other``. It returns whether the robot of
    ``one`` has certainly left ``one`` when the robot of ``other`` departs for ``other``."""
    places = [(robot, k) for robot, way in plan.ways.items() for k in range(len(way))]
    after: dict[Place, list[Place]] = {place: [] for place in places}
    for robot, k in places:
        after.get((robot, k - 1), []).append((robot, k))
    for first, i, then, j in plan.orders:
        after[first, i].append((then, j))
    bits = {place: 1 << number for number, place in enumerate(places)}
    later = dict.fromkeys(places, 0)  # for each place, the certainly later ones
    try:
        for place in TopologicalSorter(after).static_order():  # latest first
            for other in after[place]:
                later[place] |= later[other] | bits[other]
    except CycleError:
        raise RefusedError("the steps of the plan wait for each other in a circle") from None

    def leaves(one: Place, other: Place) -> bool:
        robot, k = one
        return other[1] > 0 and bool(later.get((robot, k + 1), 0) & bits[other])

    return leaves


def proof_file(e: Line) -> str:
    """Return the name of a synthesis's proof file. Lines about the same task share a file."""
    return f"proofs/{hashlib.sha256(e.text.encode()).hexdigest()}.json"


class Evidence:
    """The evidence in a bundle: its ``files`` by name, the files ``named`` by lines, and the proven
    ``claims``. Its rules raise TooLargeError, or arbitrary errors for malformed files."""

    def __init__(self, files: Mapping[str, Any]) -> None:
        self.files, self.named = files, set[str]()
        self.claims: list[dict[str, Any]] = []
        self.drives: dict[str, tuple[Task, set[int]]] = {}  # by robot, each with its possible nodes
        self.tasks: dict[tuple[str, bool], Task] = {}  # by proof file and whether at the start
        self.hopeless: dict[tuple[str, str], tuple[Task, Line]] = {}  # by robot and specification
        self.proven = set[int]()  # lines that may stay unjudged: proven here, or about a wait
        self.plan: Plan | None = None
        self.plans = self.broken = False

    def rules(self) -> list[Rule]:
        """Return the additional rules, for the check of one trace."""
        kinds = {
            self.keeps: ("synthesis",),
            self.apart: ("plan", "plan_end"),
            self.follows: ("move", "depart", "assumption"),
            self.concludes: ("header", "blocked", "deadline", "outcome", "waiting"),
        }
        return [
            Rule(check.__name__, which, self._until_broken(check), check.__doc__ or "")
            for check, which in kinds.items()
        ]

    def _until_broken(self, check: Callable[[Line, State], None]) -> Any:
        def judge(e: Line, s: State) -> Iterator[str]:
            try:
                if not self.broken:
                    check(e, s)
            except RefusedError as error:
                self.broken = True
                yield str(error)

        return judge

    def json(self, path: str) -> Any:
        require(path in self.files, f"{path} is missing")
        if (data := self.files[path].read_bytes()).count(b",") > MOST_VALUES:
            raise TooLargeError(f"{path} has more than {MOST_VALUES} values")
        return read_json(data)

    def claim(self, kind: str, e: Line | None, text: str, *files: str) -> None:
        """Record a claim that follows from a line (None: from the whole trace) and from files."""
        shown = [["trace.jsonl", e.number if e else None], *([path, None] for path in files)]
        when = f"Tick {e.tick}: " if e else ""
        name = f"{kind}-{len(self.claims) + 1}"
        self.claims.append({"id": name, "kind": kind, "text": when + text, "evidence": shown})

    def keeps(self, e: Line, s: State) -> None:
        """Each strategy obeys the scenario: moves, walls, a successor for each observation, and
        goals under named assumptions. A robot without a strategy has a counterstrategy."""
        proof = proof_file(e)
        key = proof, not (s.tick or s.moves)  # `init` holds only at the start of a run
        text = f"{e.robot} for '{_objective(formed(e.objective, e.form), s)}'"
        if e.verdict == "unrealizable" and not e.forbidden and proof in self.files:
            self.named.add(proof)
            if key not in self.tasks:
                given = self.json(proof)
                self.tasks[key] = Task(given["automaton"], e, s)
                self.tasks[key].check_defeats(given)
            task = self.tasks[key]
            self._fits(task, e, s)
            alone = " in its literal form" * formed(e.objective, e.form).strict
            alone += ", even without other robots" * (len(s.robots) > 1)
            shut = task.closed - s.robots[e.robot].own.avoid
            alone += f", while {_word(shut, s)} is closed" if shut else ""
            self.claim("unrealizable", e, f"No strategy exists for {text}{alone}.", proof)
            self.hopeless[e.robot, e.spec] = task, e
        if e.verdict != "realizable" or e.node is None:
            return
        if s.is_planned(e.robot):  # a joint plan drives the robot instead
            self.drives.pop(e.robot, None)
            return
        require(e.strategy, "its strategy is not named: no proof of its moves")
        path = f"strategies/{e.strategy}.json"
        self.named |= {proof, path}
        if key not in self.tasks:
            task = Task(self.json(path), e, s)
            task.check_keeps(e.node, self.json(proof)["measures"])
            self.tasks[key] = task
            what = "obeys the scenario and meets that objective, whatever the other robots do"
            each = [
                f"infinitely often {name} is {'on' if on else 'off'}"
                for name, on in task.assumptions
            ]
            unless = f", if {' and '.join(each)}" if each else ""
            self.claim("keeps", e, f"The strategy of {text} {what}{unless}.", path, proof)
        task = self.tasks[key]
        self._fits(task, e, s)
        self.drives[e.robot] = task, {e.node}

    def _fits(self, task: Task, e: Line, s: State) -> None:
        """Refuse a synthesis whose data contradict the run."""
        name, own, start = e.robot, s.robots[e.robot].own, s.destination(e.robot)
        require(task.pose == start, f"the strategy of {name} does not start at {start}")
        known = [one for one in s.obstacles.values() if one.known and one.present]
        serves = any(e.objective.serves(one) for one in (s.robots[name].given, own))
        helps = s.tick or any(one.open for one in known)  # `duties` judges strategies
        helps = helps or (e.objective.count == 1 and s.robots[name].data.battery)  # it charges
        require(serves or helps, f"{name} was not assigned the objective of its strategy")
        weaker = e.objective.serves(own) and own.literal and not task.objective.strict
        require(not weaker, f"the strategy of {name} may cross a target out of turn")
        walls = [one for one in known if name in one.blocks]
        closed = {region for region, _ in e.closed or ()}
        wrong = closed - own.avoid - {one.region for one in walls}
        require(not wrong, f"the strategy of {name} closes {sorted(wrong)}, where no obstacle is")
        shut = (own.avoid | {one.region for one in walls if one.shut}) - closed
        require(not shut, f"{name} does not know that {sorted(shut)} are closed")
        mine, rules = (own.avoid, own.always), (e.objective.avoid, e.objective.always)
        require(rules == mine, f"the strategy of {name} has rules other than the robot's")
        same = all(s.inputs.get(name) is bool(on) for name, on in (e.inputs or {}).items())
        require(same, f"{name} assumes inputs that differ from the run's")
        view, there = {*(e.sight_closed or ())}, {one.region for one in known}
        blind = not e.knowledge or view == there
        require(blind, f"{name} assumes that {sorted(view)} block the view, not {sorted(there)}")
        task.others.check_known(s)

    def _is_lost(self, robot: str, spec: str, s: State) -> bool:
        """Return whether a proof shows that a robot has no strategy for its own objective now."""
        if (robot, spec) not in self.hopeless:
            return False
        (task, line), own = self.hopeless[robot, spec], s.robots[robot].own
        try:
            self._fits(task, line, s)
        except RefusedError:
            return False
        present = line.tick == s.tick or may_have(s.robots[robot], line.memory or {}, s)
        shut = {one.region for one in case_of(s).shut}  # an open obstacle may still be resolved
        same = task.objective == formed(own, None if own.literal else "alternation")
        return present and same and task.closed <= own.avoid | shut

    def apart(self, e: Line, s: State) -> None:
        """No two rivals ever share a region or zone: they follow plans, whose orders prevent it."""
        self.plan = plan_of(e, s) if e.kind == "plan" else None
        self.plans = self.plans or e.kind == "plan"

    def follows(self, e: Line, s: State) -> None:
        """Each step follows a strategy or a plan; otherwise the robot stays or backs up from an
        obstacle."""
        drive = self.drives.get(e.robot)
        if e.kind in ("move", "depart"):
            self._step(e, s, drive)
        elif drive is not None:
            _, answers = _now(e.robot, drive, s)
            require(not answers, f"the strategy of {e.robot} has a successor: no assumption failed")
            drive[1].clear()
            what = f"An assumption of {e.robot} failed; its guarantees"
            self.claim("broken", e, f"{what} resume at its next synthesis.")

    def _step(self, e: Line, s: State, drive: tuple[Task, set[int]] | None) -> None:
        robot, step, by = s.robots[e.robot], e.step, e.by or "strategy"
        if step.strays or robot.bound is not None:
            return  # the step was judged at its departure
        side = s.world.side(robot.pose[0], step.to) if robot.faces else None
        after = robot.pose if step.to == robot.pose[0] else (step.to, side)
        goes = after != robot.pose
        if by == "plan" and goes:
            drives = self.plan and s.is_planned(e.robot)
            require(drives, f"{e.robot} moves by a plan, but no plan in force drives it")
            assert self.plan is not None
            self.plan.step(e.robot, after, s)
        require(by != "stay" or not goes, f"{e.robot} moves, but must stay")
        inside = any(one.present and e.robot in one.blocks for one in s.at.get(step.start, ()))
        back = by == "backtrack" and after[0] == robot.came and inside
        if drive is None:
            none = "no strategy or plan in force drives it"
            require(not goes or by == "plan" or back, f"{e.robot} moves, but {none}")
            return
        task = drive[0]
        mine = task.line.objective.serves(robot.given)
        require(mine or by != "strategy" or not goes, f"{e.robot} has the strategy of another duty")
        nodes, answers = _now(e.robot, drive, s)
        there = task.of_pose.get(after, set())
        fits = answers & there
        if by != "strategy" and not goes:
            # The robot stayed while others moved: all nodes with its pose, memory and knowledge.
            same = {task.done[n][1:] for n in nodes | answers} if task.graph.names else ()
            kept = {n for n in there if task.observes(n, s) and task.done[n][1:] in same}
            fits = (nodes | kept | (fits if by == "backtrack" else set())) & there
        elif by == "strategy":
            fits = {n for n in fits if e.node in (None, n)}
            goals = sorted({str(task.poses[n]) for n in answers})
            require(fits, f"{e.robot} goes to {after}, but its strategy goes to {goals}")
        may = fits or back or by != "backtrack" or not goes
        require(may, f"{e.robot} leaves its strategy to back up")
        self.drives[e.robot] = task, fits

    def concludes(self, e: Line, s: State) -> None:
        """Record the claim of a line about an obstacle, a lost deadline or the end of the run."""
        if e.kind == "blocked" and e.reason in ("no_capable_robot", "unresolvable"):
            kind, one = e.obstacle.partition("@")[0], s.obstacles[e.obstacle]
            what = f"No robot can resolve {kind}@{_word({one.region}, s)}"
            what += ", unless the scenario or an operator changes something."
            if not one.declared:  # by an operator: nothing is proven
                self.claim("never", e, what)
        elif e.kind == "deadline" and e.verdict == "lost" and e.of in s.obstacles:
            what = f"{e.of} cannot be resolved by tick {e.due}, when it is due"
            self.claim("lost", e, f"{what}, whatever the robots do.")
        elif e.kind == "header" and s.external:
            self.claim("world", None, EXTERNAL)
        elif e.kind in ("outcome", "waiting"):
            stated = e.unrealizable or {}
            lost = {name for name, spec in stated.items() if self._is_lost(name, spec, s)}
            if e.kind == "waiting" or (lost and e.proof is None and lost == stated.keys()):
                self.proven.add(e.number)
            if e.kind == "outcome":
                self.claim("outcome", e, _end(e, s, lost if e.proof is None else ()))

    def finish(self, strays: int, hands: int) -> None:
        """Add the claims about the whole run."""
        but = f" but {strays}, which ended elsewhere than commanded," if strays else ""
        what = f"All moves{but} are legal: no wall, unresolved obstacle or collision."
        by = "Each follows a strategy or a joint plan, stays, or backs up from an obstacle."
        self.claim("moves", None, f"{what} {by}")
        if self.plans:
            what = "Each joint plan keeps rivals apart, however long their steps take"
            self.claim("apart", None, f"{what}, once the steps that began before it have ended.")
        if hands:
            self.claim("changed", None, f"Changes by a user, an operator or the world: {hands}.")


def _now(name: str, drive: tuple[Task, set[int]], s: State) -> tuple[set[int], set[int]]:
    """Return two sets: the possible nodes of a robot's strategy, and their successors that agree
    with the present observation."""
    (task, nodes), follows = drive, drive[0].graph.next
    if s.live:  # the robot may have stayed any number of times
        here = task.of_pose.get(s.robots[name].pose, set())
        nodes = {*closure(nodes, lambda k: here.intersection(follows[k]))}
    return nodes, {n for k in nodes for n in follows[k] if task.observes(n, s)}


def _word(regions: Collection[int], s: State) -> str:
    """Return the name of a set of regions, or the names or indices of its regions."""
    known = s.scenario.map
    names = {frozenset([region]): name for name, region in known.names.items()}
    names |= {area: name for name, area in known.areas.items()}
    each = (names.get(frozenset([region]), str(region)) for region in sorted(regions))
    return names.get(frozenset(regions)) or " or ".join(each)


def _objective(own: Objective, s: State) -> str:
    """Return an objective in the words of the scenario."""
    parts = [f"{own.kind} {', '.join(_word(target, s) for target in own.targets)}".rstrip()]
    parts += [f"avoid {_word([region], s)}" for region in sorted(own.avoid)]
    return "; ".join([*parts, *own.texts, *(f"always {text}" for text in own.always)])


def _end(e: Line, s: State, lost: Collection[str]) -> str:
    """Return, in words, the claim of a bundle about the end of its run. ``lost``: the robots that
    provably have no strategy."""
    what, rounds = e.outcome, s.scenario.until.rounds
    if what == "completed":
        often = "once" if rounds == 1 else f"{rounds} times"
        message = f"every robot has met its objective {often} after the last resolution"
        return f"The mission is completed: {message}."
    if what == "tick_limit":
        return f"The run ended at its limit of {e.ticks} ticks."
    if what == "unrealizable":
        refused = f"no run can meet the deadline or charge of {' and '.join(e.refused or ())}"
        return f"The mission never began: {refused if e.refused else 'a robot has no strategy'}."
    if what != "operator_needed":
        return f"The run ended early ({what.replace('_', ' ')}); no claim about its goal."
    if e.cause == "out_of_service":
        why = f"{' and '.join(n for n, r in s.robots.items() if r.out)} out of service"
    elif lost:
        why = f"there is no strategy for {' and '.join(sorted(lost))}"
    elif e.proof is not None:
        names = [name for name in s.robots if name in e.proof.robots]
        who = " and ".join(names)
        why = f"no order of moves of {who} completes the mission so that each can continue"
    else:
        why = "some robot cannot continue, whatever the robots in service with strategies do"
    return f"An operator is needed: {why}."
