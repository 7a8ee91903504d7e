"""The world of a run: commands and their results, as numbered events.

Simulated and real worlds obey the same commands (``runtime.worlds.commands``), so the team knows
only obstacles that robots notice. In lockstep a pass is a tick, in which the robots take turns to
move or continue; a one-tick step has ended when ``start`` returns. In a live run a pass is an
instant at which something ends; each idle robot then has its turn.
"""

from collections.abc import Iterable, Iterator
from math import inf

from msgspec.structs import replace

from safenav.errors import Outcome, UsageError
from safenav.plan.order import charging_ends
from safenav.runtime.control.coordinate import Situation
from safenav.runtime.control.ends import GIVEN_UP, End
from safenav.runtime.run.decide import Proposal, closing
from safenav.runtime.run.operator import Operator
from safenav.runtime.worlds import protocol
from safenav.runtime.worlds.commands import Commands, Lockstep
from safenav.runtime.worlds.protocol import Change
from safenav.runtime.worlds.simulation import LiveSimulation, SimulatedWorld, Truth
from safenav.scenario import model
from safenav.scenario.model import switching
from safenav.team import acts
from safenav.team import state as now
from safenav.team.known import charged
from safenav.team.state import State
from safenav.team.team import Team
from safenav.trace.vocabulary import ActResult

HELPED = ("operator_needed", "assumption_violated", "search_limit")
"""Outcomes that an operator can avert."""
SLOWEST = 20.0
"""Seconds per tick of the limit if a simulated live run has no limit in seconds."""


class World:
    """The world of a run. ``truth``: the simulated obstacles, if the world is a simulation or a
    user's extension of one; ``simulated``: whether it is safenav's own simulation; ``attended``:
    whether an operator may help; ``still``: whether no robot moves and nothing will ever happen;
    ``passes``: the number of passes at this moment; ``limit``: the latest end of the run and its
    outcome."""

    def __init__(
        self,
        scenario: model.Scenario,
        world: protocol.World | protocol.BlockingWorld,
        *,
        attended: bool = False,
    ) -> None:
        truth = world.truth if isinstance(world, LiveSimulation) else world
        self.truth = truth if isinstance(truth, SimulatedWorld) else None
        self.simulated = type(world) in (LiveSimulation, SimulatedWorld)
        kind = Commands if hasattr(world, "start") else Lockstep
        self.commands: Commands | Lockstep = kind(world, scenario)  # type: ignore[arg-type]
        self.live, limits = self.commands.live, scenario.limits
        self.limit = (float(limits.ticks), Outcome.TICK_LIMIT)
        if self.live:
            most = limits.ticks * SLOWEST if self.commands.simulated else inf
            self.limit = (most if limits.seconds is None else limits.seconds, Outcome.TIME_LIMIT)
        self.attended = attended and self.live
        self.operator = Operator(scenario, self.truth, self.commands)
        self.still = False
        self.passes = 0
        self._world, self._inputs = world, truth
        self._set: frozenset[str] = frozenset()
        self._stands: object = None
        self._stood: list[State] = []
        """The states since a robot last moved or got a strategy. Strategies may repeat nodes while
        robots stand."""
        self._asked: set[int] = set()
        """The robots that have acted since their last move."""
        self._opened: dict[str, float] = {}
        """The time at which each obstacle was last resolved or gone. Earlier reports of it are
        late."""

    def resume(self, run: Situation, truth: Truth | None, last: int) -> None:
        """Continue an interrupted run. ``last``: the number of the last command."""
        robots = run.state.robots
        poses = {m.name: m.graph.pose(robots[i].pose) for i, m in enumerate(run.team.members)}
        self.commands.resume(run.state.time, poses, last)
        if (self.truth is None) is not (truth is None):
            began = "an external world" if truth is None else "its simulation"
            raise UsageError(f"the run began in {began}: continue it there")
        if self.truth is not None and truth is not None:
            self.truth.resume(truth, [robot.pose % run.team.size for robot in robots])
            self.truth.follow(run.team)
        self._set = frozenset(self.operator.inputs)

    def wait(self, run: Situation, still: End | None) -> Iterator[now.Event]:
        """Yield the next events and turns; none if nothing will ever happen. Each is read after the
        earlier ones were applied. ``still``: the end of the run if no robot will ever move."""
        commands = self.commands
        if isinstance(commands, Commands):
            if self.truth is not None:
                self.truth.excuse(run.state.robots)
            robots = run.state.robots
            if run.team.charged:  # ``due`` covers the changes of charges in a wait
                robots = tuple(replace(robot, charge=0) for robot in robots)
            here = replace(run.state, time=0, robots=robots)
            places = tuple((robot.pose, robot.to, robot.acting) for robot in robots)
            if (stands := (places, run.control.controllers)) != self._stands:
                self._stands, self._stood = stands, []
            news = here not in self._stood
            self._stood += [here] if news else []
            changed = news or run.answers.fresh() or bool(self.operator.asked)
            marks = self._next(run, commands.times()), charging_ends(run.team, run.state)
            due = min((t for t in marks if t is not None), default=None)
            idle = commands.simulated and commands.idle and not changed
            self.still = idle and due is None
            if self.still or (idle and self.stands(run)):
                return
            due = min((t for t in (due, self.limit[0]) if t is not None and t < inf), default=None)
            if not commands.hear(due, changed) and self._on(run) == run.state.inputs:
                return
        else:
            commands.hear(None, True)
        self.passes = self.passes + 1 if commands.now() == run.state.time else 0
        yield now.Time(commands.now())
        for i in range(len(run.state.robots)):
            if charged(run.team, run.state, i):
                yield now.Served(i, True, "battery")
        yield from self.operator.events(run, lambda: still or self.given_up(run))
        yield from self._heard(run)
        occupied, tick = acts.occupied(run.team, run.state), int(commands.now())
        for change in protocol.changes_of(self._world, tick, occupied, run.team.world):
            yield from self._changed(run, change)
        if isinstance(commands, Commands):
            yield from self._reported(run, commands)
        # Live: all arrivals, then actions by start. A turn may end the pass.
        each = enumerate(run.state.robots)
        ranks = [
            (r.idle, r.to is None, *([0, r.command] if r.acting == i else [1])) for i, r in each
        ]
        every = range(len(ranks))
        for i in sorted(every, key=ranks.__getitem__) if self.live else every:
            member, robot = run.team.members[i], run.state.robots[i]
            if robot.to is not None:
                due_now = self.live or run.state.time >= (robot.due or 0)
                to = member.graph.pose(robot.to)
                ended = self.commands.ended(member.robot, to) if due_now else None
                if ended is not None:
                    yield from self._arrived(run, i, ended)
                elif not self.live:
                    yield now.Goes(i)
            elif robot.acting == i:
                acted = self.commands.acted(member.robot)
                if acted is not None:
                    yield from self._acted(run, i, self._news(run, i, acted))
            else:
                yield now.Turn(i)

    def _on(self, run: Situation) -> frozenset[str]:
        """Return the inputs that are on, as the operator or else the world has set them."""
        names = [each.name for each in run.team.scenario.inputs]
        found = {name: name in run.state.inputs for name in names}
        world, tick = self._inputs if names else None, int(self.commands.now())
        found |= protocol.inputs_of(world, names, tick)
        found |= self.operator.inputs
        return frozenset(name for name in names if found[name])

    def _heard(self, run: Situation) -> Iterator[now.Event]:
        """Yield the event of the present inputs and those of the objectives that they select."""
        by_user, on = self.operator.inputs, self._on(run)
        if on != run.state.inputs or by_user.keys() != self._set:
            self._set = frozenset(by_user)
            yield now.Inputs(on, tuple(by_user))
        yield from self.operator.selected(run)

    def _reported(self, run: Situation, commands: Commands) -> Iterator[now.Event]:
        """Yield events for reports that were dropped, and for obstacles that sensors show."""
        while commands.dropped:
            dropped, why = commands.dropped.pop(0)
            yield now.Late(type(dropped).__name__.lower(), why, self._named(run, dropped))
        while commands.sensed:
            sensed = commands.sensed.pop(0)
            name, at = sensed.obstacle.name, commands.at(sensed)
            if at < self._opened.get(name, at):
                why = "the obstacle was resolved or disappeared after this report"
                yield now.Late("sensed", why, self._named(run, sensed, "by"), name)
            elif sensed.there:
                yield from acts.noticed(run.team, run.state, sensed.obstacle)
            elif name in run.team.numbers:
                self._opened[name] = commands.now()
                yield now.Gone(acts.number(run.team, run.state, sensed.obstacle), "world")

    def _arrived(self, run: Situation, i: int, ended: protocol.Ended) -> Iterator[now.Event]:
        graph, before, target = run.team.members[i].graph, run.state, run.state.robots[i].next
        here = before.robots[i].pose
        self._asked.discard(i)
        end: now.Elsewhere | now.Failed | now.Lost
        match ended:
            case protocol.Arrived(reason=why):
                yield now.Arrived(i, why)
                return
            case protocol.Elsewhere(pose=pose):
                end = now.Elsewhere(i, graph.strayed(here, pose))
            case protocol.Blocked(pose=pose, obstacle=obstacle):
                obstacle = obstacle or acts.unknown(
                    run.team.members[i].robot, target % run.team.size
                )
                if not self._is_open_to(run, i, obstacle):
                    yield now.Elsewhere(i, graph.strayed(here, pose), blocked=True)
                    yield from acts.met(run.team, run.state, i, obstacle, target)
                    return
                end = now.Failed(i, graph.strayed(here, pose), f"{obstacle.name} stops it")
            case protocol.Failed(pose=pose, reason=why, fatal=fatal):
                end = now.Failed(i, graph.strayed(here, pose), why, fatal)
            case protocol.Lost(regions=regions, reason=why):
                end = now.Lost(i, frozenset(regions), why)
        yield end
        yield from acts.consequences(run.team, before, end)

    def _is_open_to(self, run: Situation, i: int, obstacle: model.Obstacle) -> bool:
        """Return whether a robot may try to resolve a known obstacle by entering it."""
        known = obstacle.name in run.team.numbers
        k = acts.number(run.team, run.state, obstacle)
        if not known or run.state.obstacles[k].state is not now.Is.OPEN:
            return False
        return closing(run, i, run.state.robots[i].next) is None

    def _changed(self, run: Situation, change: Change) -> Iterator[now.Event]:
        cause = "user" if change.by_user else "scenario"
        if change.appeared:
            self._opened.pop(change.obstacle.name, None)
            yield from acts.joined(run.team, run.state, change.obstacle)
            k = acts.number(run.team, run.state, change.obstacle)
            yield now.Appeared(k, change.truth, cause)
        elif change.obstacle.name in run.team.numbers:
            self._opened[change.obstacle.name] = self.commands.now()
            yield now.Gone(acts.number(run.team, run.state, change.obstacle), cause)

    def _named(self, run: Situation, report: protocol.WorldEvent, key: str = "robot") -> int | None:
        names = [member.name for member in run.team.members]
        name = getattr(report, key, None)
        return names.index(name) if name in names else None

    def stands(self, run: Situation) -> bool:
        """Return whether time stops until an operator intervenes."""
        idle = self.commands.simulated and self.commands.idle
        pause = self.pause(run) if self.attended and idle else None
        return pause is not None and pause[1] is None

    # Commands.

    def sense(self, run: Situation, i: int, region: int) -> model.Obstacle | None:
        """Return the obstacle that a robot notices in a neighbouring region, or None."""
        robot, floor = run.team.members[i].robot, run.team.world
        return protocol.sensed(self._world, robot, region, floor)

    def start(self, run: Situation, i: int, step: Proposal) -> Iterator[now.Event]:
        """Command a step. Yield its departure and, if the step has already ended, its end."""
        graph, robot = run.team.members[i].graph, run.team.members[i].robot
        here = graph.pose(run.state.robots[i].pose)
        ended = self.commands.start(robot, here, graph.pose(step.pose))
        lasts = not self.live and ended is None
        due = int(run.state.time) + robot.model.timing - 1 if lasts else None
        command = self.commands.number(robot.name), self.commands.expected(robot)
        yield now.Departed(i, step.pose, step.by, step.node, due, *command, step.values)
        if ended is not None:
            yield from self._arrived(run, i, ended)

    def act(self, run: Situation, i: int) -> Iterator[now.Event] | None:
        """Command an action if it may change something where a robot stands. Return its results, or
        the event that it is under way; None if it changes nothing."""
        robot, there = run.team.members[i].robot, run.state.robots[i]
        absent = not there.active or (self.live and there.to is not None)
        if absent or not robot.capabilities or there.acting is not None:
            return None
        if self.simulated and not run.team.worksites >> there.pose % run.team.size & 1:
            return None  # quick for most turns
        if self.truth is not None:
            self.truth.excuse(run.state.robots)  # robots may have returned in this instant
        among = self._acts(run, i)
        expected = self._changes(run, i, among)
        asks = (self.truth is not None and not self.live) or i not in self._asked
        if not expected and not (asks and not self._is_busy(run, i)):  # acting reveals hidden ones
            return None
        self._asked.add(i)
        here = run.team.members[i].graph.pose(there.pose)
        known = [k for k, _ in expected] if self.live else among
        event = self.commands.act(robot, here, [run.team.obstacles[k].source for k in known])
        event = None if event is None else self._news(run, i, event)
        parts = self.truth is not None and not self.live and self.truth.parts(robot)
        told = expected or parts or event is None or event.found or event.reason
        return self._results(run, i, event) if told else None

    def _results(self, run: Situation, i: int, event: protocol.Acted | None) -> Iterator[now.Event]:
        """Yield the results of an action that has just begun (if None: that it is under way)."""
        changes = self._changes(run, i)
        if event is None or self.live:
            command = self.commands.number(run.team.members[i].name)
            at = acts.standing(run.team, run.state, moving=False, leader=i)
            group = acts.acting_group(run.team, run.state, at, i, changes)
            yield now.Acts(i, tuple(sorted(group)), command, tuple(k for k, _ in changes))
        if event is not None:
            yield from self._acted(run, i, event)

    def _acted(self, run: Situation, i: int, event: protocol.Acted) -> Iterator[now.Event]:
        """Yield the results of an action. Those of earlier needs follow from the robots' poses; the
        world reports that of the last need."""
        begun = run.state.robots[i].works
        for obstacle, _ in event.found:
            yield from acts.joined(run.team, run.state, obstacle)
        team, truths = run.team, dict[int, bool | None]()
        reported = {
            acts.number(team, run.state, obstacle): result for obstacle, result in event.found
        }
        again = tuple(  # resolved in passing, without a request
            k
            for k, result in reported.items()
            if run.state.obstacles[k].state is now.Is.SEEN
            and team.obstacles[k].name in self._opened
            and result is ActResult.DONE
        )
        reported = {k: result for k, result in reported.items() if k not in again}
        among = self._acts(run, i)
        if begun:  # the robot may now fetch another load
            loads = [k for k in begun if run.state.obstacles[k].known and _takes(run, k)]
            among = [k for k in among if not _takes(run, k)] + loads
        stages = {k: stage for k, stage in self._changes(run, i, among) if k not in again}
        ready = {k for k, stage in stages.items() if team.obstacles[k].next(stage) is None}
        if self.live:  # robots that arrived meanwhile may have made a need ready
            stages = {k: stages[k] for k in stages if k in (*begun, *reported) or k not in ready}
        there = run.state.obstacles  # OVER: it has disappeared in this instant
        if self.truth is not None:
            stages = {k: stages[k] for k in stages if k in ready} | {
                n: stage
                for obstacle, stage in self.truth.parts(team.members[i].robot)
                if there[n := acts.number(team, run.state, obstacle)].state is not now.Is.OVER
            }
        else:
            stages |= self._unnoticed(run, i)
        results = dict.fromkeys(ready, ActResult.FAILED) | reported
        failed = tuple(k for k in stages | reported if results.get(k) is ActResult.FAILED)
        for k, result in reported.items():
            if result in (ActResult.DONE, ActResult.UNTRAVERSABLE):
                has_truth = team.obstacles[k].source.type.has_truth
                done = result is ActResult.DONE
                truths[k] = (done if has_truth else None) if done else False
                stages[k] = now.Stage(len(team.obstacles[k].needs))
        if event.reason and {*reported.values()} <= {ActResult.FAILED}:
            stages = {}  # only reported effects of a failed action count
        gone = tuple(k for k, result in reported.items() if result is ActResult.NOTHING)
        over = {team.obstacles[k].name for k in (*truths, *gone)}
        self._opened |= dict.fromkeys(over, self.commands.now())
        failed = tuple(k for k in failed if k not in truths and k not in gone)
        undone = {*failed, *gone} - truths.keys()
        if any(i in (there[k].stage.group or ()) for k in failed):  # it still carries the load
            open_ = [k for k in stages if k not in truths]
            needs = {k: team.obstacles[k].needs[there[k].stage.need] for k in open_}
            undone |= {k for k, need in needs.items() if need.takes and not need.same}
        kept = tuple((k, stage) for k, stage in stages.items() if k not in undone)
        command, why, before = event.command or 0, event.reason, run.state
        cause = "scenario" if self.truth is not None else "world"
        yield from (now.Gone(k, cause) for k in gone)
        yield now.Acted(i, kept, tuple(truths.items()), failed, gone, command, why, again)
        yield from acts.vain(run.team, before, run.state, i, failed)

    def _news(self, run: Situation, i: int, event: protocol.Acted) -> protocol.Acted:
        """Return an action with only the results that are new to the team, since repeated results
        would keep a robot acting forever. A load is not delivered where it is taken."""
        if not event.found:
            return event
        team, state, told = run.team, run.state, list[tuple[model.Obstacle, ActResult]]()
        changes = dict(self._changes(run, i))
        for obstacle, result in event.found:
            k, why = acts.number(team, state, obstacle), ""
            there = state.obstacles[k] if k < len(state.obstacles) else now.ObstacleNow()
            asked = there.known and there.state is not now.Is.SEEN
            if result is ActResult.FAILED:
                tells = k in changes or (not asked and _shows(team, state, i, obstacle, there))
            else:  # a sensed obstacle may be absent
                again = result is ActResult.NOTHING or obstacle.name in self._opened
                tells = there.known or not again
            if asked and result is ActResult.DONE and _is_early(team, state, i, obstacle, there):
                why = "other needs are still open"
            elif tells:
                told.append((obstacle, result))
            else:
                why = "the result adds nothing to the team's knowledge"
            if why and isinstance(self.commands, Commands):
                self.commands.dropped.append((event, f"{why} ({obstacle.name}: {result.value})"))
        return replace(event, found=tuple(told))

    def _changes(
        self, run: Situation, i: int, among: list[int] | None = None
    ) -> tuple[tuple[int, now.Stage], ...]:
        """Return the obstacles that a robot changes where it stands, with their new stages.
        ``among``: the obstacles that count (None: those on which it acts)."""
        among = self._acts(run, i) if among is None else among
        if not among:
            return ()
        where = acts.standing(run.team, run.state, moving=not self.live, leader=i)
        return acts.acts_on(run.team, run.state, where, i, among)

    def _unnoticed(self, run: Situation, i: int) -> dict[int, now.Stage]:
        """Return the new stages of unknown obstacles that a robot changes, but does not resolve,
        where it stands. A world may act on these, but reports only the last need."""
        team, state = run.team, run.state
        pairs = ((k, each) for k, each in enumerate(state.obstacles) if each.state is now.Is.HIDDEN)
        hidden = [k for k, each in pairs if not team.obstacles[k].needs[each.stage.need].takes]
        changes = self._changes(run, i, hidden)
        return {k: stage for k, stage in changes if team.obstacles[k].next(stage)}

    def _acts(self, run: Situation, i: int) -> list[int]:
        """Return the known obstacles on which a robot acts. A robot with a duty to take a load
        leaves other loads. (A joint plan decides which loads its robots take.)"""
        roles = run.control.roles
        pairs = ((k, each.state) for k, each in enumerate(run.state.obstacles) if each.known)
        known = [k for k, at in pairs if at is not now.Is.SEEN or not _takes(run, k)]
        known = [k for k in known if not self._is_met(run, i, k)]
        taken = [k for k in known if _takes(run, k)]
        sent = roles[i].helps if roles and not run.team.members[i].planned else None
        return [k for k in known if k not in taken or k == sent] if sent in taken else known

    def _is_met(self, run: Situation, i: int, k: int) -> bool:
        """Return whether enough other robots already act on an obstacle."""
        stage = run.state.obstacles[k].stage
        need = run.team.obstacles[k].needs[stage.need]
        others = sum(k in each.works for j, each in enumerate(run.state.robots) if j != i)
        return others > 0 and (need.together or others + len(stage.done) >= need.robots)

    def _is_busy(self, run: Situation, i: int) -> bool:
        """Return whether a robot leaves a neighbouring obstacle to other robots that act on it. The
        robot may act later if they fail."""
        if not any(robot.works for robot in run.state.robots):
            return False
        known = [k for k, each in enumerate(run.state.obstacles) if each.known]
        return any(self._is_met(run, i, k) for k, _ in self._changes(run, i, known))

    # Changes and operators that may still help.

    def pause(self, run: Situation) -> tuple[End, float | None] | None:
        """Return the end of the run that a future change or an operator may avert, and the time of
        the change (None: there is none). Return None if the team does not wait for help."""
        end = run.control.end
        if end is None or end.outcome not in HELPED:
            return None
        until = self.awaited(run)
        return (end, until) if self.attended or until is not None else None

    def awaited(self, run: Situation) -> float | None:
        """Return the time of the scenario's next change; None if the run waits only for an
        operator."""
        real = self.attended and not self.commands.simulated
        return None if real else self.coming(run)

    def given_up(self, run: Situation) -> End:
        """Return the end of the run if an operator gives up now. It proves nothing while a change
        of the scenario may still help."""
        end = run.control.end
        return GIVEN_UP if end is None or self.coming(run) is not None else end

    def coming(self, run: Situation) -> float | None:
        """Return the time of the scenario's next change before the limit that may help; None if
        there is none. An obstacle that appears later helps no robot."""
        return self._next(run, self.truth.helpful_times() if self.truth is not None else ())

    def _next(self, run: Situation, times: Iterable[float]) -> float | None:
        """Return the first time before the limit among these, the scenario's orders, and its
        changes of robots and inputs."""
        most = self.limit[0] if self.live else run.team.scenario.limits.ticks
        switches = switching(run.team.scenario.inputs) if self.truth is not None else []
        listed = [change.at for change in run.team.scenario.changes]
        orders = [each.source.appears or 0 for each in run.team.obstacles if each.ordered]
        ahead = map(float, (*times, *listed, *switches, *orders))
        return min((time for time in ahead if run.state.time < time <= most), default=None)


def _takes(run: Situation, k: int) -> bool:
    """Return whether a robot takes a load when it fulfils the next need of an obstacle."""
    return run.team.obstacles[k].needs[run.state.obstacles[k].stage.need].takes


def _is_early(
    team: Team, state: State, i: int, obstacle: model.Obstacle, there: now.ObstacleNow
) -> bool:
    """Return whether a report claims the delivery of a load that a robot has only just taken: it
    must still fulfil a need elsewhere."""
    here = state.robots[i].pose % team.size
    return any(
        need.same and here not in obstacle.resolution_regions(team.world, number)
        for number, need in [*enumerate(obstacle.needs)][there.stage.need :]
    )


def _shows(
    team: Team, state: State, i: int, obstacle: model.Obstacle, there: now.ObstacleNow
) -> bool:
    """Return whether a failed action reveals an obstacle whose presence the team did not know."""
    here, last = state.robots[i].pose % team.size, len(obstacle.needs) - 1
    able = obstacle.needs[last].action in team.members[i].robot.capabilities
    able = able and here in obstacle.resolution_regions(team.world, last)
    return able and (here == obstacle.region or there.state is not now.Is.SEEN)
