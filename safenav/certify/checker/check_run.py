"""The run of a bundle: its trace obeys the rules of ``audit``, and each move is the successor of a
proven strategy."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from itertools import chain
from typing import Any

from safenav.audit.judging import RULES, findings
from safenav.audit.kinds import ALTERNATION, STAYING
from safenav.audit.language import Pose, RefusedError, TooLargeError, require
from safenav.audit.lines import Line, read_line
from safenav.audit.possibilities.deriving import is_stop
from safenav.audit.rules.rule import Finding, Message, Rule
from safenav.audit.run.passes import EITHER
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import Status
from safenav.audit.world import World
from safenav.certify.checker.check_ends import conclude
from safenav.certify.checker.check_objectives import Objective
from safenav.certify.checker.check_robots import Robot
from safenav.certify.checker.check_strategies import (
    Json,
    Strategy,
    check_counterstrategy,
    check_realizes,
)
from safenav.certify.checker.check_tasks import ASSUMED, Task, circumstances
from safenav.line_values import flaws
from safenav.strict_json import read_json

STRAYING = {
    *("always", "backtrack", "belief", "continuity", "follows-plan", "hold", "known-obstacle"),
    *("missed-belief", "missed-goal", "mobility", "out-of-turn", "service", "transit"),
}
"""Rules on moves and sightings that an external world may break: a robot may end elsewhere than
commanded."""
APART = {"collision", "never-together"}
"""Rules that an external world may break in lockstep only: ticks do not show who left first."""


class Evidence(Rule):
    """The strategies in a trace are proven, and its moves follow them (docs/bundle.md). ``claims``:
    the established claims. Raises RefusedError, TooLargeError."""

    name = "evidence"

    def __init__(self, files: Mapping[str, Any]) -> None:
        self.files, self.claims, self.number = files, list[Json](), 1
        self.named, self.last = set[str](), ""  # files that lines name; the last file that was read
        header, *self.trace = lines_of(files["trace.jsonl"])
        self.scenario, self.tick = header["scenario"], 0
        same = header["type"] == "header" and self.scenario == self.json("scenario.json")
        require(same, "scenario.json differs from the header of the trace")
        self.header = read_line({"tick": 0, **header}, 1)
        self.live = self.header.clock == "live"
        self.world = World.of(self.scenario["map"], live=self.live)
        self.robots = dict[str, Robot]()
        self.turns = self.answered = self.strayed = 0
        self.departed = 0  # steps of a live run, whose turns include stays
        self.astray: Finding | None = None  # why the present move is not as commanded
        self.shown: dict[Any, Any] = {}  # checked files and their contents
        self.hopeless: set[tuple[str, str]] = set()  # robots without a strategy, by specification

    def file(self, path: str) -> Any:
        require(path in self.files, f"{path} is missing")
        self.last = path
        return self.files[path]

    def text(self, path: str) -> str:
        return str(self.file(path).read_bytes().decode())

    def json(self, path: str) -> Any:
        return content_of(self.file(path))

    def claim(self, kind: str, text: str, *files: str | None) -> None:
        """Record a claim that some files establish (None: the present line of the trace)."""
        shown = [[path or "trace.jsonl", None if path else self.number] for path in files or [None]]
        name, when = f"{kind}-{len(self.claims) + 1}", f"Tick {self.tick}: " if self.number else ""
        self.claims.append({"id": name, "kind": kind, "text": when + text, "evidence": shown})

    def replay(self, rules: Iterable[type[Rule]] = RULES) -> None:
        """Refuse unless all lines obey the rules."""
        lines = [read_line(data, number) for number, data in enumerate(self.trace, 2)]
        now = Situation(self.header, lines)
        for finding in findings(now, lines, [*(rule() for rule in rules), self]):
            external = self.scenario.get("world") == "external"
            if external and finding.rule in (STRAYING if self.live else STRAYING | APART):
                self.astray = finding
                continue
            self.number = finding.line
            if finding.note:
                self.tick = finding.tick
                self.claim("unjudged", f"N{finding.explanation[1:]}.")
                continue
            raise (TooLargeError if finding.unknown else RefusedError)(finding.explanation)
        self.number = 0
        for robot in self.robots.values():
            self.state_form(robot)
        if "motion.jsonl" in self.files:
            trace, motion = (self.files[f"{n}.jsonl"].read_bytes() for n in ("trace", "motion"))
            first = read_json(motion.splitlines()[0])
            same = first["trace"] == hashlib.sha256(trace).hexdigest()
            require(same, "motion.jsonl is the motion of another trace")
            message = "motion.jsonl names this trace"
            self.claim("motion", f"{message}; `safenav check` judges it.", "motion.jsonl")
        but = f" but {self.strayed}, which ended elsewhere than commanded," if self.strayed else ""
        moves = self.departed if self.live else self.turns
        message = f"All {moves} moves{but} are legal: no wall, unresolved obstacle or collision"
        timed = "; at no instant are robots in conflict in one region" if self.live else ""
        others = "follow a joint plan" if self.live else "stay, back up or follow a joint plan"
        by = f"{self.answered} follow strategies; the others {others}"
        what = f"{message}{timed}. {by if self.answered < moves else 'All follow strategies'}."
        self.claim("moves", what, "trace.jsonl")

    def state_form(self, robot: Robot) -> None:
        """Claim the weakest form in which a robot's own objective was proven since the last such
        claim."""
        if robot.forms:
            form = min(robot.forms)  # alternation before literal
            self.claim("form", f"{robot.name}: {robot.own.words(self.world, form)}.", "trace.jsonl")
            robot.forms.clear()

    def opening(self, now: Situation) -> Iterable[Message]:
        apart = {*chain(*(zone["robots"] for zone in self.scenario.get("never_together") or ()))}
        for name, data in self.scenario["robots"].items():
            self.robots[name] = Robot(name, {**data, "zones": name in apart}, now)
        return ()

    def line(self, record: Line, now: Situation) -> Iterable[Message]:
        """Follow a line of the trace."""
        self.number, self.tick = record.line, record.tick
        robot = self.robots.get(getattr(record, "robot", None) or "")
        match record.type:
            case "synthesis":
                self.synthesis(record.data, self.robots[record.robot], now)
            case "move":
                self.move(record, self.robots[record.robot], now)
            case "hold" if robot and record.signal is not None:  # after an ``act`` line
                robot.signal = vars(record.signal)
            case "push" | "pop":
                for name, objective in record.data["objectives"].items():
                    left = len(now.stack) + (1 if record.type == "push" else -1)
                    self.tell(self.robots[name], Objective(objective), now, entries=left)
            case "told":
                stated = Objective(record.data["objective"])
                self.tell(self.robots[record.robot], stated, now, entries=len(now.stack))
            case "objective":
                given = self.robots[record.robot]
                self.give(given, Objective(record.data["objective"]))
                if record.data["at_once"]:  # it may continue from any node with that pose
                    given.came_from, given.nodes = set(), given.nodes_in(given.destination)
            case "operator" if record.intervention == "put_back" and robot:
                robot.nodes = robot.nodes_in((record.region, record.heading))
            case "service" if record.active and robot and now.toward[robot.name] is None:
                robot.nodes = robot.nodes_in(robot.pose)
            case "assumption" if robot:
                require(
                    robot.answers == set(), f"{robot.name} has a successor: no assumption failed"
                )
                robot.nodes = set()
                message = f"An assumption of {robot.name} failed; its guarantees"
                self.claim("broken", f"{message} resume at its next synthesis.")
            case "plan_end":
                for name, node in (record.nodes or {}).items():  # where they continue
                    each = self.robots[name]
                    if node is not None and each.task and now.toward[name] is None:
                        first = each.task.graph.first[node]
                        require(first in each.nodes_in(each.pose), f"{name} is not in {node}")
                        each.nodes = {node}
            case "goal" if robot and robot.task and robot.task.objective.kind == "ltl":
                own = robot.objective.serves(robot.own)  # else it only helps
                if own and robot.objective.kind == "ltl":
                    met = robot.task.meets(record.goal, robot.came_from, robot.nodes)
                    require(met, f"{robot.name} is not at its goal {record.goal}")
            case "blocked" | "deadline" | "outcome":
                conclude(self, record, now)
        return ()

    def give(self, robot: Robot, given: Objective) -> None:
        """Replace a robot's own objective."""
        self.state_form(robot)
        robot.objective = given if robot.objective.serves(robot.own) else robot.objective
        robot.own = given
        words = given.words(self.world)
        self.claim("changed", f"{robot.name} receives another objective: {words}.")

    def tell(self, robot: Robot, objective: Objective, now: Situation, *, entries: int) -> None:
        """Refuse unless a robot's new objective is its own, its previous one, its
        ``while_waiting``, a charging stop, or serves an open request. ``entries``: number of
        entries on the stack after this line."""
        known = [one for name, one in now.obstacles.items() if name in now.discovered]
        wanted = [{*need.regions} for one in known for need in one.all_needs]
        serves = any(aim <= there for aim in objective.targets for there in wanted)
        asked = bool(entries or now.requests)  # on the stack, or still to be pushed
        fits = asked and (objective.kind != ALTERNATION or serves)
        waiting = robot.data.get("while_waiting")
        others = [robot.objective, *([] if waiting is None else [Objective(waiting)])]
        # Their safety rules may differ: they belong to the own objective of that time.
        allowed = [(one.kind, one.targets) for one in others]
        fits = fits or (objective.kind, objective.targets) in allowed
        fits = fits or objective.serves(robot.own)
        fits = fits or is_stop(robot.name, objective.targets, now)
        fits = fits or (robot.name in now.out and objective.kind == STAYING)  # without a duty
        require(fits, f"{robot.name} receives an objective that serves no request")
        robot.objective = objective

    def synthesis(self, record: Json, robot: Robot, now: Situation) -> None:
        """Check a strategy, or that no strategy exists, for a ``synthesis`` line."""
        spec, name, node = record["spec"], record.get("strategy"), record.get("node")
        rules = f"rules/{circumstances(record)}.json"
        asked = Objective(record["objective"])
        words = asked.formed(record.get("form")).words(self.world)
        subject = f"{robot.name} for '{words}'"
        for tried in (*(record.get("tried") or ()), record):
            text = f"specs/{tried['spec']}.structuredslugs"
            path = f"counterstrategies/{tried['spec']}.json"
            self.named |= {text, path, rules}
            if path in self.files and path not in self.shown:
                proof = self.json(path)
                self.shown[path] = graph = Strategy(proof["automaton"], self.text(text))
                check_counterstrategy(graph, graph, proof, proof["measures"])
                if tried is not record:
                    what = f"'{asked.formed(tried['form']).words(self.world)}'"
                    what = f"No strategy of {robot.name} for {what} works"
                    what = f"{what} {ASSUMED[tried['fairness']]}."
                    self.claim("weakest", what, None, text, path)
        if record["verdict"] == "unrealizable" and path in self.shown:
            task = self.task(record, robot, self.shown[path], rules, now)
            check_counterstrategy(task, task.graph, self.json(path), self.json(rules))
            what = f"No strategy exists for {subject}{self.even_alone(task, record)}."
            self.claim("unrealizable", what, None, text, path, rules)
            self.hopeless.add((robot.name, spec))
        files = text, f"strategies/{name}.json", f"measures/{spec}-{name}.json"
        self.named |= {*files}
        if record["verdict"] != "realizable" or node is None:
            return
        require(name, "its strategy is not listed: no proof of its moves")
        if files not in self.shown:
            self.shown[files] = graph = Strategy(self.json(files[1]), self.text(text))
            check_realizes(graph, self.json(files[2]))
            size = (
                f"{n} {word}{'s' * (n != 1)}"
                for n, word in ((graph.count, "node"), (graph.size, "edge"))
            )
            what = f"satisfies its specification: {', '.join(size)}"
            self.claim("realizes", f"The strategy of {subject} {what}.", *files)
        graph = self.shown[files]
        require(node in graph.begin, f"node {node} is not one with which the strategy may begin")
        robot.task = task = self.task(record, robot, graph, rules, now)
        if rules not in self.shown:
            task.check_keeps(node, self.json(rules))
            self.shown[rules] = task
            what = "obeys the scenario's rules and meets that objective"
            what = f"The strategy of {subject} {what}, {ASSUMED[record['fairness']]}."
            self.claim("keeps", what, None, *files, rules)
        if task.objective.serves(robot.own):
            robot.forms.add("literal" if task.objective == robot.own else "alternation")
        robot.nodes, robot.knowledge = {node}, dict(task.knowledge)
        robot.came_from = set()  # its nodes were those of the previous strategy
        robot.signal = robot.signal or {"request": 0, "wait": 0, "assigned": record.get("neutral")}

    def even_alone(self, task: Task, record: Json) -> str:
        """Return the words for a task without other robots, if the team has any."""
        others = {*self.robots} - {record["robot"]}
        return ", even without other robots" if others and not task.moving else ""

    def task(self, record: Json, robot: Robot, graph: Any, rules: str, now: Situation) -> Task:
        """Return the task of a synthesis. Refuse unless its circumstances are those of the run."""
        about = self.world, robot.data, record, self.scenario.get("partition"), graph
        task = self.shown.get(rules) or Task(*about)
        require(
            task.pose == robot.destination,
            f"it is synthesized for another start than {robot.destination}",
        )
        tried = record["verdict"] == "unrealizable" and self.tick  # for an objective not in force
        if not tried and (task.places is None or not task.objective.serves(robot.own)):
            charges = record["reason"] == "charge" and robot.data.get("battery")
            if charges and now.has_heading(robot.name) and task.objective.kind == STAYING:
                robot.objective = task.objective  # where it turns on its way to a charger
            else:
                self.tell(robot, task.objective, now, entries=len(now.stack))
        known = {n for n in now.discovered if now.status[n] is Status.UNRESOLVED}
        known |= {name for name, status in now.status.items() if status.stays}
        standing = [now.obstacles[n] for n in known if robot.name in now.blocked_by(n)]
        at = {o.name: {o.region} for o in standing}  # no robot: it may move
        at[f"robots.{robot.name}.objective.avoid"] = {*robot.own.avoid}
        listed = {each["name"]: each["again"] for each in self.scenario.get("inputs") or ()}
        again = {name: listed[name] for name in task.heard if listed[name]}
        same = again == (record.get("again") or {}) and task.inputs.items() <= robot.heard.items()
        require(same, f"{robot.name} assumes inputs that the scenario lacks")
        same = task.objective.rules() == robot.own.rules()
        require(same, f"{robot.name} is not synthesized for its own rules")
        closed = [(name.removeprefix("obstacles."), r) for r, name in record.get("closed") or ()]
        wrong = [name for name, region in closed if region not in at.get(name, ())]
        require(not wrong, f"{', '.join(wrong)} is not in the region that it should close")
        shut = {o.name for o in standing if now.status[o.name].stays}
        rivals = {name for name in self.robots if name != robot.name}
        rivals = {name for name in rivals if now.conflict(robot.name, name)}
        if record["verdict"] != "unrealizable":  # else there is no strategy even without them
            shut |= {f"robots.{name}" for name in rivals - {*task.moving}}
        shut -= {name for name, _ in closed}
        shut |= {str(r) for r in robot.own.avoid - {region for _, region in closed}}
        require(not shut, f"{robot.name} does not know of {', '.join(sorted(shut))}")
        for name, value in task.knowledge.items():
            where = task.whereabouts(name, value)
            later = self.tick and record["tracking"] == "belief"  # it may have moved since the look
            there = now.taken_by(name) & (self.world.later(where) if later else where)
            require(there, f"{robot.name} believes {name} to be where it is not")
        return task

    def move(self, record: Line, robot: Robot, now: Situation) -> None:
        """Judge a move. In an external world, or after a failed step, the robot may be elsewhere
        than its strategy commanded."""
        self.turns += 1
        failed = now.has_failed(robot.name)
        astray = self.astray is not None and self.astray.line == record.line
        try:
            require(not failed and not astray, "its step has failed")
            self.step(record, robot, now)
        except RefusedError:
            if not (failed or now.external):
                raise
            self.strayed += 1  # if its step has failed, it continues from there
            robot.nodes = robot.nodes_in((record.to, record.heading)) if failed else set()

    def step(self, record: Line, robot: Robot, now: Situation) -> None:
        """Refuse unless a move agrees with the strategy. If its node is unknown, all nodes with the
        robot's pose are possible: the strategy keeps its guarantees from each. With assignable
        goals it may continue from any node with the same values."""
        name, task, before, by = robot.name, robot.task, robot.pose, record.by or "strategy"
        if record.signal is not None:
            robot.signal = vars(record.signal)
        if now.toward[name] is not None:
            return  # the step was judged at its departure
        require(task, f"{name} has no strategy")
        after: Pose = record.to, record.heading
        if record.toward is not None:
            way = now.grid.direction(before[0], record.toward) if before[1] else None
            after = record.toward, way
        self.departed += after != before
        shown = record.busy or ()
        robot.answers = task.answers(robot, self.robots, shown, now.external)
        there, answers = task.of_pose.get(after, set()), robot.answers
        back = now.turn.first("backtrack") if by == "backtrack" else None
        require(back or by != "backtrack", f"no obstacle is before {name}")
        node = None if back is None else back.node
        if node is not None:
            answers = {node} & {*chain(*(task.graph.next[n] for n in robot.nodes))}
        fits = {n for n in answers if task.poses[n] == after}
        if by == "plan":
            fits = there
            robot.forms.add("alternation")  # a plan may cross targets out of turn
        elif by == "stay" or (by == "backtrack" and node is None):
            require(after == before, f"{name} moves, though it should stay")
            seen = {f"at_{other}": robot.knowledge[other] for other in task.tracked}
            seen |= {name: robot.heard[name] for name in task.heard}
            kept = {n for n in there if seen and task.knows(n, seen)} | robot.nodes
            fits = (kept if by == "stay" else kept | fits) if answers else there
        elif by == EITHER:
            fits |= robot.nodes
        else:
            if not fits and task.told:
                others = task.following(task.alike(robot.nodes), robot.row)
                fits = {n for n in others if task.poses[n] == after}
            possible = sorted({str(task.poses[n]) for n in answers})
            require(fits, f"{name} goes to {after}, but its strategy goes to {possible}")
            self.answered += by != "backtrack" and not (self.live and after == before)
        # After a plan, its nodes may have memories that no move of its strategy leads to.
        robot.came_from, robot.nodes = set() if by == "plan" else robot.nodes, fits


def content_of(file: Any) -> Any:
    """Return the value of a JSON file."""
    try:
        return read_json(file.read_bytes())
    except ValueError as error:
        raise RefusedError(f"{file.name} is not valid JSON: {error}") from error


def lines_of(file: Any) -> list[Any]:
    """Return the lines of a trace."""
    found = []
    for number, line in enumerate(file.read_bytes().splitlines(), 1):
        where = f"{file.name}, line {number}"
        try:
            found.append(read_json(line))
        except ValueError as error:
            raise RefusedError(f"{where}, is not valid JSON: {error}") from error
        kind = found[-1].get("type") if isinstance(found[-1], dict) else None
        if not isinstance(kind, str):
            raise RefusedError(f"{where}, is not a line of a trace")
        for flaw in flaws(found[-1], kind):
            raise RefusedError(f"{where}: {flaw}")
    return found
