"""Derivation of the trace's lines from consecutive states and the event between them. The recorder
stores only recorded facts: the stack, each request's helpers, objectives and the plan."""

from collections.abc import Callable, Iterable, Sequence

from msgspec.structs import replace

import safenav
from safenav.errors import Outcome
from safenav.plan.order import at_end
from safenav.runtime.control.answers import Answers
from safenav.runtime.control.coordinate import Control, Decided
from safenav.runtime.control.ends import End, lacks_of
from safenav.runtime.control.roles import helpers_of
from safenav.runtime.control.strategies import enough
from safenav.runtime.run.checkpoint import Memory
from safenav.runtime.run.deadlines import Ledger
from safenav.runtime.run.lines import (
    command_line,
    move_line,
    plan_line,
    request_line,
    synthesis_line,
)
from safenav.scenario.objective import Objective
from safenav.solve.reasons import shortfall_words
from safenav.spec.belief import automatic
from safenav.team import known
from safenav.team import state as now
from safenav.team.acts import participants, standing
from safenav.team.apply import goals
from safenav.team.state import Plan, State
from safenav.team.team import Team
from safenav.trace import records
from safenav.trace.vocabulary import (
    ActResult,
    AvertedEnd,
    BlockReason,
    ChangeCause,
    OperatorCause,
    OperatorIntervention,
    PlanEndReason,
)

Entry = tuple[int, int | None, tuple[str, ...]]
"""An entry of the stack: obstacle, requester (None: an order), helpers."""


class Recorder:
    """The recorder of a trace. ``stack``: pushed entries. As last recorded: ``helpers`` of each
    request; ``told``: the objectives in force; ``plan``: the joint plan in force. ``makespan``: the
    end of the last command."""

    def __init__(
        self, team: Team, listener: Callable[[records.Record], None], *, simulated: bool
    ) -> None:
        self.team, self._listen, self.simulated = team, listener, simulated
        self._line = command_line if team.live else move_line
        self.time = 0.0
        self.stack: list[Entry] = []
        self.helpers: dict[int, tuple[str, ...]] = {}
        self.told: list[Objective] = [member.objective for member in team.members]
        self.plan: Plan | None = None
        self.tick = self.moved = 0
        self.waited: tuple[float | None] | None = None
        self.makespan = 0.0
        self.ledger = Ledger(team, self.emit)

    def begins(self) -> None:
        scenario, version = self.team.scenario, (records.VERSION, safenav.__version__)
        cells = None
        if any(robot.tracks for robot in scenario.robots):
            listed = scenario.partition or automatic(scenario.map)
            cells = tuple(tuple(sorted(cell)) for cell in listed)
        header = records.Header(0, *version, scenario.recorded, cells=cells)
        self.emit(header if self.simulated else replace(header, world="external"))

    def kept(self) -> Memory:
        """Return the data of the recorder for a checkpoint."""
        stack, helpers, planned = tuple(self.stack), tuple(self.helpers.items()), self.plan
        about = self.tick, stack, helpers, planned is not None
        return Memory(*about, tuple(self.ledger.dues.items()), tuple(self.ledger.late))

    def resume(self, memory: Memory, state: State, lines: Iterable[records.Record]) -> None:
        """Continue after the lines of an interrupted run."""
        for line in lines:
            self._follow(line)
            self._listen(line)
        self.tick, self.time = memory.tick, state.time
        self.stack, self.helpers = [*memory.stack], dict(memory.helpers)
        self.told = [robot.objective for robot in state.robots]
        self.ledger.dues, self.ledger.late = dict(memory.dues), [*memory.late]
        self.ledger.tick = memory.tick
        self.emit(records.Resumed(self.tick))
        if memory.planned:
            self.emit(records.PlanEnd(self.tick, PlanEndReason.CHANGED))

    def record(self, before: State, event: now.Event, after: State) -> None:
        """Record an event, changed charges, and the deadlines that are kept or missed."""
        self._record(before, event, after)
        for i in self.team.charged if after.robots is not before.robots else ():
            energy = self.team.members[i].energy
            assert energy is not None
            was, percent = (energy.battery.percent(s.robots[i].charge) for s in (before, after))
            if percent != was:
                self.emit(records.Charge(self.tick, self._robot(i), percent))
        self.ledger.happened(self.team, before, event)

    def _record(self, before: State, event: now.Event, after: State) -> None:
        if before.requests != after.requests:
            self.helpers = {k: who for k, who in self.helpers.items() if k in after.requests}
        dropped = before.plan is not None and after.plan is None
        if dropped and not isinstance(event, now.Met):
            self._plan_ends(PlanEndReason.CHANGED)
        if isinstance(event, now.Departed | now.Stayed) and event.by == "backtrack":
            self._backtrack(event.robot, after.robots[event.robot].next)
        if (line := self._line(self.team, self.tick, before, event, after)) is not None:
            self.emit(line)
        match event:
            case now.Counted(i, at_once, duty):
                if before is after:  # no goal was met
                    return
                region = before.robots[i].pose % self.team.size
                for goal, whole, own in goals(self.team, before, i, at_once, duty):
                    met = self._robot(i), goal, region, whole, not own or None
                    self.emit(records.Goal(self.tick, *met))
            case now.Time(at):
                self._plan_reached(before)
                self.time, self.tick = at, self.tick + 1 if self.team.live else int(at)
            case now.Arrived() | now.Elsewhere() | now.Failed() | now.Lost():
                if not self.team.live:
                    self._plan_reached(after)
            case now.Stayed(by="backtrack") if after.plan is None:
                self._plan_ends(PlanEndReason.VIOLATION)
            case now.Astray(i, rules):
                for rule in rules:
                    self.emit(records.Assumption(self.tick, self._robot(i), rule))
            case now.Introduced(source):
                self.emit(records.Discovered(self.tick, source))
            case now.Seen(k) if before.obstacles[k].state in (now.Is.OVER, now.Is.AWAY):
                self.emit(records.Appeared(self.tick, self._name(k), ChangeCause.WORLD))
            case now.Met(i, k, pose):
                self.helpers.pop(k, None)
                here, need = before.robots[i].pose % self.team.size, after.obstacles[k].stage.need
                action = self.team.obstacles[k].needs[need].action
                way = here, pose % self.team.size, self._name(k), action
                self.emit(records.Violation(self.tick, self._robot(i), *way))
                if event.stopped:
                    self._backtrack(i, after.robots[i].pose)
            case now.Acts(i, group, command, obstacles):
                who = tuple(map(self._robot, group)), tuple(map(self._name, obstacles))
                self.emit(records.Act(self.tick, command, self._robot(i), *who))
            case now.Acted():
                if self.team.live or event.failed:
                    self._action_ends(before, event, after)
                self._acted(before, event)
                for k in event.again:
                    self.emit(records.Gone(self.tick, self._name(k), ChangeCause.WORLD))
            case now.Appeared(k, truth, cause):
                name, by = self._name(k), ChangeCause(cause)
                self.emit(records.Appeared(self.tick, name, by))
                if self.team.obstacles[k].ordered:
                    self.emit(records.Ordered(self.tick, name, by))
                if truth is not None:
                    self.emit(records.Truth(self.tick, name, truth, by))
            case now.Gone(k, cause):
                self.emit(records.Gone(self.tick, self._name(k), ChangeCause(cause)))
            case now.Flat(i, k):
                if k is not None:
                    self.emit(records.Appeared(self.tick, self._name(k), ChangeCause.BATTERY))
                battery = ChangeCause.BATTERY
                self.emit(records.Service(self.tick, self._robot(i), False, battery))
            case now.Served(i, active, cause):
                self.emit(records.Service(self.tick, self._robot(i), active, ChangeCause(cause)))
                if active:
                    self.told[i] = self.team.members[i].objective
            case now.Assigned(i, objective, cause, within, own=own):
                about = self._robot(i), objective, own, ChangeCause(cause), within
                self.emit(records.NewObjective(self.tick, *about))
                self.told[i] = objective if own else self.told[i]
            case now.Looked(i, known, places):
                told, me = dict(before.robots[i].known), self._robot(i)
                for (j, what), regions in zip(known, places, strict=True):
                    if told.get(j) != what:
                        seen = isinstance(what, int)
                        self.emit(records.Belief(self.tick, me, self._robot(j), seen, regions))
            case now.Declared(k):
                self.emit(self._blocked(k, BlockReason.OPERATOR))
            case now.Intervened(what, i, k, pose, objective) if self.team.live:
                robot = None if i is None else self._robot(i)
                obstacle = None if k is None else self._name(k)
                place = (None, None) if pose is None else pose.place
                done = OperatorIntervention(what), robot, obstacle, *place, objective
                self.emit(records.Operator(self.tick, *done))
            case now.Late(kind, why, i, name):
                robot = None if i is None else self._robot(i)
                self.emit(records.Late(self.tick, kind, why, robot, name))
            case now.Inputs(on, by_user):
                values = {each.name: each.name in on for each in self.team.scenario.inputs}
                self.emit(records.Inputs(self.tick, values, by_user or None))
            case now.Reopened():
                for k in (k for k, each in enumerate(before.obstacles) if each.given_up):
                    self.emit(records.Reopened(self.tick, self._name(k)))

    def emit(self, line: records.Record) -> None:
        """Send a line to the listeners; in a live run with its time."""
        line = replace(line, t=round(self.time, 9)) if self.team.live else line
        self._follow(line)
        self._listen(line)

    def _follow(self, line: records.Record) -> None:
        if isinstance(line, records.Move):
            self.moved = line.tick
        elif isinstance(line, records.Arrive | records.ActionEnd):
            self.makespan = line.t or 0.0

    def _name(self, k: int) -> str:
        return self.team.obstacles[k].name

    def _robot(self, i: int) -> str:
        return self.team.members[i].name

    def tell_plan(self, decided: Sequence[Decided], state: State) -> None:
        """Record a new joint plan, or that one is given up for a wait."""
        for before, event in decided:
            if isinstance(event, now.Planned) and event.plan is None:
                self._plan_reached(before)
                self._plan_ends(PlanEndReason.CHANGED)
        plan = state.plan
        if plan is not None and plan is not self.plan:
            self._plan_ends(PlanEndReason.CHANGED)
            if not at_end(state, self.team.sharing):
                self.emit(plan_line(self.tick, self.team, state, plan))
                self.plan = plan

    def _plan_reached(self, state: State) -> None:
        """Record the end of the plan if every robot has completed its path."""
        if at_end(state, self.team.sharing):
            self._plan_ends(PlanEndReason.REACHED)

    def _plan_ends(self, reason: PlanEndReason) -> None:
        if self.plan is not None:
            self.emit(records.PlanEnd(self.tick, reason))
            self.plan = None

    def _backtrack(self, i: int, pose: int) -> None:
        self.emit(records.Backtrack(self.tick, self._robot(i), pose % self.team.size))

    def _action_ends(self, before: State, event: now.Acted, after: State) -> None:
        results = {self._name(k): ActResult.FAILED for k in event.failed}
        for k, truth in event.truths if self.team.live else ():
            results[self._name(k)] = ActResult.of(truth)
        results |= {self._name(k): ActResult.NOTHING for k in event.gone}
        late = known.barred(self.team, after) - known.barred(self.team, before)
        left = tuple(self._name(k) for i, k in sorted(late)) or None
        who = self.tick, event.command if self.team.live else 0, self._robot(event.robot)
        self.emit(records.ActionEnd(*who, results, left, event.why or None))

    def _acted(self, before: State, event: now.Acted) -> None:
        """Record the fulfilled parts and the resolution of each obstacle on which a robot has
        acted. Loads are put down first and taken last, in the order of ``Floor.acted``."""
        truths, stages = dict(event.truths), dict(event.stages)
        i, obstacles = event.robot, self.team.obstacles
        at = before.robots[i].pose % self.team.size

        def parts(k: int) -> range:
            if k not in stages or (k in truths and len(obstacles[k].needs) == 1):
                return range(0)
            return range(before.obstacles[k].stage.need, stages[k].need + (i in stages[k].done))

        def order(k: int) -> tuple[object, ...]:
            takes = any(obstacles[k].needs[number].takes for number in parts(k))
            begun = bool(before.obstacles[k].stage.done)
            return takes, *((not begun, *obstacles[k].source.order) if takes else ())

        for k in sorted({**stages, **truths}, key=order):
            for number in parts(k):
                need = obstacles[k].needs[number]
                able = need.action in self.team.members[i].robot.capabilities
                if able and need.regions >> at & 1:  # else fulfilled while unknown
                    what = self._name(k), number, need.action, self._robot(i), at
                    group = self._group(before, k, number, i) if need.together else None
                    left = need.robots - len(stages[k].done) if number == stages[k].need else None
                    self.emit(records.Part(self.tick, *what, group, left))
            if k in truths:
                self._resolved(before, i, k, truths[k])

    def _resolved(self, before: State, i: int, k: int, truth: bool | None) -> None:
        at, obstacle = before.robots[i].pose % self.team.size, self.team.obstacles[k]
        group = self._group(before, k, 0, i) if len(obstacle.needs) == 1 else None
        asked = any(entry[0] == k for entry in self.stack)
        who = self._name(k), self._robot(i), at
        self.emit(records.Resolved(self.tick, *who, asked, truth, robots=group))
        if truth is False:
            goes = obstacle.source.goes is not None
            self.emit(self._blocked(k, BlockReason.UNTRAVERSABLE, goes or None))

    def _blocked(
        self, k: int, reason: BlockReason, for_now: bool | None = None, because: str | None = None
    ) -> records.KnownObstacle:
        about = self._name(k), frozenset(map(self._robot, self.team.obstacles[k].blocks))
        return records.KnownObstacle(self.tick, *about, reason, because, for_now)

    def _group(self, state: State, k: int, number: int, i: int) -> tuple[str, ...] | None:
        """Return the robots that fulfil a need when robot i acts; None if robot i alone does."""
        need, stage = self.team.obstacles[k].needs[number], state.obstacles[k].stage
        later = None if number == stage.need else number
        group = [*sorted({i, *(stage.done if later is None else ())})]
        if need.together:
            moving = not (self.team.live and self.simulated)
            for leader in (i, None):  # any leader if the team did not know it
                at = standing(self.team, state, moving=moving, leader=leader)
                at[i] = state.robots[i].pose % self.team.size  # even if it is out of service now
                group = [*participants(self.team, state, at, i, k, later)]
                if len(group) >= need.robots:
                    break
        return tuple(map(self._robot, group)) if len(group) > 1 else None

    # Decisions.

    def settled(
        self, decided: Sequence[Decided], after: State, control: Control, *, coming: bool
    ) -> None:
        """Record a decision: given-up obstacles, the stack, strategies, and goals met where robots
        stand. ``coming``: whether the scenario has further changes."""
        for state, event in decided:
            if isinstance(event, now.GaveUp):
                self._given_up(state, event.obstacle, control, coming=coming)
        self._pops(after)
        if control.end is None or control.end.cause in ("deadlock", "out_of_service"):
            self._stack(after, control)
        self._duties([robot.objective for robot in after.robots])
        for failed in control.failed:
            self.emit(synthesis_line(self.tick, failed, self.team.world))
        for i in control.new:
            controller = control.controllers[i]
            if controller is not None:
                self.emit(synthesis_line(self.tick, controller, self.team.world))
        for state, event in decided:
            if isinstance(event, now.Counted):
                i = event.robot  # no line records a duty that a later decision replaces
                kept = state.robots[i].objective == after.robots[i].objective
                self.record(state, event if kept else replace(event, duty=False), after)

    def _duties(self, objectives: Sequence[Objective]) -> None:
        """Record the changed objectives of robots."""
        pairs = enumerate(zip(self.told, objectives, strict=True))
        new = {self._robot(i): own for i, (told, own) in pairs if told != own}
        if new:
            self.emit(records.Duty(self.tick, new))
        self.told = [*objectives]

    def _given_up(self, state: State, k: int, control: Control, *, coming: bool) -> None:
        lacks = lacks_of(self.team, state)[self._name(k)]
        because = shortfall_words(lacks, self.team.world.word, "it")
        able = enough(self.team, k)
        if k not in self.helpers or not able:
            self.emit(request_line(self.team, self.tick, state, k, (), control, because))
        reason = BlockReason.UNRESOLVABLE if able else BlockReason.NO_CAPABLE_ROBOT
        self.emit(self._blocked(k, reason, coming or None, because))
        self.helpers.pop(k, None)

    def _pops(self, state: State) -> None:
        """Remove the stack entries of requests that are no longer open."""
        for k in dict.fromkeys(k for k, _, _ in self.stack if k not in state.requests):
            for entry in [e for e in reversed(self.stack) if e[0] == k]:
                self.stack.remove(entry)
                self._entry(records.Pop, entry)

    def _stack(self, state: State, control: Control) -> None:
        """Record requests that are new, have other helpers, or are set aside without helpers, and a
        push for each new requester."""
        for k in state.requests:
            each = state.obstacles[k]
            helping = tuple(map(self._robot, helpers_of(control.roles, k)))
            last = self.helpers.get(k)
            if last is None or helping not in ((), last) or (last and each.aside):
                self.emit(request_line(self.team, self.tick, state, k, helping, control))
                self.helpers[k] = helping
            ordered: list[int | None] = [None] if self.team.obstacles[k].ordered else []
            for who in (*ordered, *(i for i, _ in each.asked)):
                if not any(entry[:2] == (k, who) for entry in self.stack):
                    self.stack.append((k, who, helping))
                    self._entry(records.Push, (k, who, helping))

    def _entry(self, kind: type, entry: Entry) -> None:
        k, who, helpers = entry
        requester = None if who is None else self._robot(who)
        self.emit(kind(self.tick, len(self.stack), self._name(k), requester, helpers))

    # Ends.

    def waiting(self, end: End, until: float | None) -> None:
        if self.waited != (until,):
            self.waited = (until,)
            cause = None if end.cause is None else OperatorCause(end.cause)
            about = AvertedEnd(end.outcome), end.explanation, cause, end.proof, until
            self.emit(records.Waiting(self.tick, *about, dict(end.unrealizable) or None))

    def ends(self, state: State, end: End, answers: Answers, seconds: float) -> records.End:
        """Record the end of the run. ``seconds``: the wall time of the run."""
        pairs = zip(self.team.members, state.robots, strict=True)
        rounds = {m.name: 0 if r.mode else m.pursuit.rounds(r.own.met) for m, r in pairs}
        self._plan_reached(state)
        if end.outcome == Outcome.COMPLETED:
            self.ledger.completed(self.team)
        ended = records.End(
            self.tick,
            Outcome(end.outcome),
            end.explanation,
            rounds,  # 0 while an input replaces the objective
            self.tick if self.team.live else self.moved,
            round(seconds, 6),
            answers.count,
            round(answers.seconds, 6),
            cause=None if end.cause is None else OperatorCause(end.cause),
            proof=end.proof,
            unrealizable=dict(end.unrealizable) or None,
            late=self.ledger.missed,
            refused=end.refused,
            makespan=self.makespan if self.team.live else None,
        )
        self.emit(ended)
        return ended
