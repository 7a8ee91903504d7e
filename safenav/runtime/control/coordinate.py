"""The intentions of the team, computed from its state and its previous intentions.

Duties are decided again iff their data (``_question``) have changed, once for all changes since the
last decision. A joint plan is computed iff none is in force: a surprise has dropped it (``apply``),
or it has ended before the mission is complete.
"""

from collections.abc import Collection, Hashable
from math import inf

from msgspec import Struct
from msgspec.structs import replace

from safenav.plan.ask import Deadlock, Unserved, lost
from safenav.plan.order import awaited, drains, joint_now, starving, stuck
from safenav.runtime.control import ends
from safenav.runtime.control.answers import Answers, Pending
from safenav.runtime.control.planning import Answer, Planning, beyond, helped, to_chargers, with_all
from safenav.runtime.control.roles import Role, Roles, helpers_of
from safenav.runtime.control.strategies import Controller, outdated, pursues, synthesized
from safenav.solve import solve
from safenav.team import state as now
from safenav.team.acts import driven
from safenav.team.apply import apply, done, initial, on_own, orders_ahead, stands
from safenav.team.floor import Floor
from safenav.team.known import floor_now, floor_with, stages_of
from safenav.team.state import State
from safenav.team.team import Team, hearing, without_memory


class Control(Struct, frozen=True):
    """The intentions of a team. ``new``: robots with a new synthesis result; ``pending``: robots
    that wait for a strategy, given the data ``asked``; ``thinks``: whether a plan is still being
    computed; ``vain``: obstacles that are set aside, since a robot has no strategy for its part
    (``failed`` syntheses); ``left``: obstacles left to robots with strategies, although others had
    to help; ``waits``: whether the plan is only for a wait; ``resting``: robots that need a change
    or an operator's help to continue. The team serves all possible requests, then waits for that
    (``instead``)."""

    question: Hashable | None = None
    found: solve.Settlement = solve.Settlement()
    roles: tuple[Role, ...] = ()
    controllers: tuple[Controller | None, ...] = ()
    new: tuple[int, ...] = ()
    end: ends.End | None = None
    pending: frozenset[int] = frozenset()
    asked: Hashable | None = None
    thinks: bool = False
    failed: tuple[Controller, ...] = ()
    vain: tuple[int, ...] = ()
    left: frozenset[int] = frozenset()
    waits: bool = False
    resting: frozenset[int] = frozenset()
    instead: ends.End | None = None


class Situation:
    """The present moment of a run: its team, state and intentions. ``answers``: the results of the
    synthesizer and of searches."""

    def __init__(self, team: Team, answers: Answers) -> None:
        self.team, self.state, self.answers = team, initial(team), answers
        self.control = Control(controllers=(None,) * len(team.members))


Decided = tuple[State, now.Event]
"""The state before a decision, and that decision."""


class Decision:
    """A decision of the team. ``decided``: its events, in order; ``state``: the state after them.
    ``hopes``: whether the team waits, since a change of the scenario or an operator may help,
    instead of ending the run."""

    def __init__(self, team: Team, state: State, answers: Answers, *, hopes: bool) -> None:
        self.team, self.state, self.answers, self.hopes = team, state, answers, hopes
        self.decided: list[Decided] = []

    def control(self, before: Control) -> Control:
        """Return the present intentions, given the previous ones."""
        control = replace(before, new=(), thinks=False, failed=(), vain=())
        question, begun, state = _question(self.team, self.state), len(self.decided), self.state
        if question != before.question:
            if question == before.asked and not self.answers.ready:
                self.answers.keep()
                return control
            if before.waits and state.plan is not None:
                self._decide(now.Planned(None))
            self._give_up()
            try:
                control = replace(self._serving(self._settled(before), before), left=before.left)
            except Pending as wait:
                self.decided, self.state = self.decided[:begun], state
                return replace(control, pending=wait.robots, asked=question)
            except solve.BudgetError:
                spent = ends.End("search_limit", "search budget exhausted")
                return replace(before, question=question, end=spent)
            if control.vain:
                self._decide(now.SetAside(control.vain))
                return self._again(control)
            self._tell(before, control)
            control = replace(control, question=_question(self.team, self.state))
        if control.end is not None:
            return self._waiting(control, before)
        try:
            end = ends.out_of_service(self.team, self.state, control.found)
            if end is None and (left := _left(self.team, self.state, control)):
                return self._again(replace(control, question=None, left=control.left | left))
            end = end or self._planned(control)
            control = replace(control, end=end and (control.instead or end))
        except Pending:
            return replace(control, thinks=True)
        aside = self.decided and _question(self.team, self.state) != control.question
        again = aside and control.end is None
        return self._again(control) if again else self._waiting(control, before)

    def _serving(self, control: Control, before: Control) -> Control:
        """Return the intentions in which the team serves requests before it waits, or the given
        ones if it need not wait or can serve none. Raises Pending."""
        stuck = {} if control.end is None else {*control.end.stuck}
        resting = frozenset(i for i, m in enumerate(self.team.members) if m.name in stuck)
        if not (self.hopes and resting) or any(drains(self.team, self.state, i) for i in resting):
            return control
        try:
            serving = self._settled(before, resting)
        except solve.BudgetError:
            return control
        serves = serving.end is None and serving.found.served
        return replace(serving, instead=control.end) if serves else control

    def _again(self, control: Control) -> Control:
        """Decide again. Return the intentions and the results of both parts of the decision."""
        after = self.control(control)
        failed, vain = control.failed + after.failed, control.vain + after.vain
        return replace(after, new=control.new + after.new, failed=failed, vain=vain)

    def _decide(self, event: now.Event) -> None:
        self.decided.append((self.state, event))
        self.state = apply(self.team, self.state, event)

    def _give_up(self) -> None:
        """Make each obstacle permanent if no robots can ever fulfil its next need."""
        while True:
            sets = ends.hopeful(self.team, self.state, given_up=False)
            closure = solve.closure_of(sets)
            for g in closure.stuck:
                self._decide(now.GaveUp(sets.floor.gates[g]))
            if not closure.stuck:
                return

    def _tell(self, before: Control, control: Control) -> None:
        """Assign new objectives and strategies, and count the robots' goals where they stand."""
        team = self.team
        if control.end is None:
            told: Collection[int] = range(len(control.roles))
        else:  # while the team waits: robots that continue with a new strategy, or have served
            pairs = enumerate(zip(before.roles, control.roles, strict=False))
            others = (i for i, (old, new) in pairs if new is not old)
            told = [
                i
                for i in others
                if (i in control.new and (each := control.controllers[i]) and each.realizable)
                or (team.members[i].planned and control.roles[i].helps is None)
            ]
        for i in told:
            role, mine, robot = control.roles[i], control.controllers[i], self.state.robots[i]
            new, planned = i in control.new, team.members[i].planned
            changes = role.objective != robot.objective or (new and not planned)
            if robot.active and changes:
                node = mine.node if mine is not None and new else robot.node
                values = None if mine is None or planned else mine.values(node)
                self._decide(now.Told(i, role.objective, node, values))
                if mine and new and mine.form == "other_memory":  # else progress is restored
                    self._decide(now.Turned(i, mine.task.memory.index))
        for i in told:
            robot, keeps = self.state.robots[i], team.members[i].planned or team.assignable(i)
            begun = before.roles and keeps  # the robot counts in its turn, even during a duty
            helped = before.roles and before.roles[i].helps is not None
            stays = robot.own.met or (helped and robot.own.held and stands(team, self.state, i))
            stays = stays and team.members[i].pursuit.settles and on_own(team, self.state, i)
            if robot.fresh and robot.active and robot.to is None and not (begun or stays):
                self._decide(now.Counted(i))  # a stay that continues counts in the turn

    def _settled(self, before: Control, resting: frozenset[int] = frozenset()) -> Control:
        """Return intentions with duties, roles and strategies (Algorithm 1, lines 10 to 14 and 20).
        Raises Pending."""
        team, state = self.team, self.state
        plain, here = without_memory(team, state)
        floor = floor_now(plain, here).while_resting(resting)
        stages, poses = stages_of(floor, here), tuple(r.next for r in here.robots)
        aside = frozenset(g for g, k in enumerate(floor.gates) if state.obstacles[k].aside)
        lone = frozenset(team.lone)
        pairs = ((i, k) for i in team.sharing for k in before.left)
        every, dues = enumerate(floor.gates), (state.obstacles[k].due for k in floor.gates)
        helping = tuple((g, helpers) for g, k in every if (helpers := helpers_of(before.roles, k)))
        left = tuple(inf if due is None else due - state.time for due in dues)
        serving = replace(floor, helping=helping, left=left)
        fewer = replace(serving, barred=floor.barred.union(pairs)) if before.left else serving
        found = solve.settle(solve.Solver(fewer), poses, stages, aside, lone)
        if found.hopeless and before.left:
            found = solve.settle(solve.Solver(serving), poses, stages, aside, lone)
        never: ends.End | None = None
        if found.hopeless and floor.flat:  # robots with a new battery may change that
            later = aside.union(range(len(floor.gates))).difference(floor.flat.values())
            solver = solve.Solver(beyond(serving, floor.flat.values()))
            brought = solve.settle(solver, poses, stages, later, lone)
            found = brought if brought.served and not brought.hopeless else found
        if found.hopeless:
            out = [i for i, robot in enumerate(state.robots) if not robot.active]
            all_, rest = (
                ends.hopeful(plain, here, given_up=False, serving=n) for n in (False, True)
            )
            now_ = solve.around(floor, poses, stages)
            if not out:
                never = ends.infeasible(plain, here, now_)
            elif len(out) == len(poses) or any(
                solve.Solver(each.floor).feasible(each) for each in (all_, rest)
            ):
                never = ends.without(team, state, out, now=now_)  # only absent robots stop others
            else:  # proven for the whole team, or for the robots in service
                lives = enumerate(solve.closure_of(all_).live)
                lame = any(not live and i not in out for i, live in lives)
                never = ends.infeasible(plain, here, all_ if lame else rest)
        roles = before.roles or tuple(Role(member.objective) for member in team.members)
        if never is None:
            roles = Roles(plain, here, floor, stages, found).all()
        elif before.roles:
            stands = Control(None, found, roles, before.controllers, (), never)
            anywhere = replace(found, safe=(None,) * len(poses))
            others = Roles(plain, here, floor, stages, anywhere)
            return self._meanwhile(stands, others) if self.hopes else stands
        held, asked = before.controllers, dict[int, Role]()
        for i, (role, mine) in enumerate(zip(roles, held, strict=True)):
            if i in lone:
                asks = mine is None or outdated(team, state, i, role, mine)
            else:  # a joint plan is the robot's controller
                asks = not before.roles and not pursues(team, floor, here, i)
            if asks and state.robots[i].active and not (i in resting and role.helps is None):
                asked[i] = role
        made, end = synthesized(team, state, asked, self.answers), never
        controllers = tuple(made.get(i, each) for i, each in enumerate(held))
        if failed := [(i, each) for i, each in made.items() if not each.realizable]:
            end = ends.no_strategy(team, state, failed, begun=bool(before.roles))
            helped = {k for i, _ in failed if (k := roles[i].helps) is not None}
            idle = {i for i, _ in failed if roles[i].objective != team.members[i].objective}
            served = {floor.gates[g] for g in found.served}  # the robot may be unable to wait
            helped |= {k for k in served if idle.intersection(dict(state.obstacles[k].asked))}
            vain = tuple(sorted(k for k in helped if not state.obstacles[k].aside))
            if vain:  # the decision ignored the memory of formulas
                kept = replace(before, question=None, failed=tuple(c for _, c in failed))
                return replace(kept, vain=vain)
            proves = end.outcome == "operator_needed" and floor.open(stages)
            if proves and not any(map(_is_a_game, failed)):
                whole = floor_now(team, state)
                joint = joint_now(state, whole)._replace(stages=stages_of(whole, state))
                proven = lost(whole, joint, [i for i, _ in failed])
                if proven is not None:  # a robot out of service might have resolved open obstacles
                    out = [i for i, robot in enumerate(state.robots) if not robot.active]
                    dead = ends.deadlocked(team, state, proven)
                    dead = ends.without(team, state, out) if out else dead
                    links = (*end.links, *(dead.links or (dead.explanation,)))
                    end = replace(dead, explanation="; ".join(links), links=links)
        control = Control(None, found, roles, controllers, tuple(asked), end)
        return replace(control, resting=resting)

    def _meanwhile(self, control: Control, roles: Roles) -> Control:
        """Return the intentions while the team waits. Robots that wait for help pursue other
        objectives. Robots that have served a request, or whose objective has changed, pursue their
        own."""
        state, members, asked = self.state, self.team.members, _asked(self.state)
        helps = [(i, role.helps) for i, role in enumerate(control.roles)]
        served = {i for i, k in helps if k is not None and k not in state.requests}
        others = [i for i, helped in helps if i not in asked and helped is None]
        served |= {i for i in others if control.roles[i].objective != members[i].objective}
        lone = {i for i in others if not members[i].planned}
        served |= {i for i in lone if control.controllers[i] is None}  # the run was resumed
        every = [i for i in sorted(served | asked) if state.robots[i].active]
        own = {i: Role(members[i].objective) for i in served if members[i].planned}
        own |= {i: role for i in served.difference(own) if (role := roles.own(i)) is not None}
        pairs = ((i, own.get(i) or roles.meanwhile(i)) for i in every)
        found = {i: role for i, role in pairs if role is not None}
        asks = {i: role for i, role in found.items() if not members[i].planned}
        made = synthesized(self.team, state, asks, self.answers)
        made = {i: each for i, each in made.items() if each.realizable}
        kept = {i: role for i, role in found.items() if i in made or i not in asks}
        return replace(
            control,
            roles=tuple(kept.get(i, each) for i, each in enumerate(control.roles)),
            controllers=tuple(made.get(i, each) for i, each in enumerate(control.controllers)),
            new=tuple(made),
        )

    def _waiting(self, control: Control, before: Control) -> Control:
        """Plan for the time of a wait, if the team begins to wait. Return the intentions."""
        end, told = control.end, not before.thinks and control.end == before.end
        if end is None or (told and not starving(self.team, self.state)):
            return replace(control, waits=control.waits and end is not None)
        waits = self.hopes and end.outcome == "operator_needed"
        try:
            plan = self._meantime() if waits else None
        except Pending:
            return replace(control, thinks=True)
        if waits and (plan is not None or self.state.plan is not None):
            self._decide(now.Planned(plan))
        return replace(control, waits=plan is not None)

    def _meantime(self) -> now.Plan | None:
        """Return a plan for the robots that can undo each of their steps and complete their rounds
        while all other robots stand still and obstacles stay open. With batteries, it only brings
        robots to chargers. None if there is none."""
        team, state = self.team, self.state
        if team.charged:
            low = [i for i in team.charged if state.robots[i].active and drains(team, state, i)]
            return to_chargers(team, state, sorted(low, key=lambda i: state.robots[i].charge))

        def among(going: Collection[int]) -> Floor:
            every = enumerate(state.robots)
            out = frozenset((i, robot.next) for i, robot in every if i not in going)
            sealed = state.sealed.union(state.gates)
            return floor_with(hearing(team, state.inputs), state, (), sealed, out)

        asked, left = _asked(state), list[int]()
        going = [i for i in driven(team, state) if i not in asked and on_own(team, state, i)]
        while going != left:
            floor, left = among(going), going
            able = (i for i in going if not floor.graphs[i].one_way)
            going = [i for i in able if _meets(floor, state, i)]
        answer: Answer = Deadlock(())
        while isinstance(answer, Deadlock):
            floor = among(going := [i for i in going if i not in answer.robots])
            if not floor.robots:
                return None
            answer = self.answers.plan(floor, joint_now(state, floor), (), state)
        if answer is None or isinstance(answer, Unserved) or answer.first:
            return None
        if all(len(way) < 2 for way in answer.plan.ways):
            return None
        return with_all(answer.plan, state)

    def _planned(self, control: Control) -> ends.End | None:
        """Decide on a joint plan if robots need one. Return the end of the run if no plan exists,
        else None. Raises Pending."""
        about = self.team, self.state, self.answers, control.found, control.roles
        complete = is_complete(self.team, self.state, control)
        events = Planning(*about, complete, self.hopes, control.resting).events()
        if isinstance(events, ends.End):
            return events
        for event in events:
            self._decide(event)
        return None


def _question(team: Team, state: State) -> Hashable:
    obstacles = tuple((k, each) for k, each in enumerate(state.obstacles) if each.stands)
    out = tuple([(i, robot.next) for i, robot in enumerate(state.robots) if not robot.active])
    lone = [(i, state.robots[i]) for i in team.lone]  # some robots have left their strategies
    astray = tuple([i for i, r in lone if r.active and r.to is None and r.node is None])
    order = [i for i in team.lone if team.members[i].pursuit.settles] if state.requests else []
    next_ = tuple((i, state.robots[i].own.memory) for i in order)
    about = state.requests, obstacles, state.over, state.attempts
    return *about, out, astray, next_, team.objectives


def _is_a_game(failed: tuple[int, Controller]) -> bool:
    """Return whether poses do not decide an objective: it has formulas or is a literal patrol."""
    objective = failed[1].task.objective
    return objective.formulas is not None or (objective.strict and objective.literal)


def _left(team: Team, state: State, control: Control) -> frozenset[int]:
    """Return the obstacles that a stuck plan leaves to robots with strategies. These robots were
    not chosen to help, but the chosen ones may have no path past other robots."""
    if state.plan is None or not state.requests:
        return frozenset()
    waits = awaited(team, state) - control.left
    if not waits or not stuck(team, state, helped(team, control.roles)):
        return frozenset()
    floor = floor_now(team, state)
    stages = stages_of(floor, state)
    open_ = {floor.gates[g]: g for g in floor.open(stages)}
    lone = frozenset(team.lone)
    return frozenset(k for k in waits if k in open_ and lone & {*floor.able(open_[k], stages)})


def _asked(state: State) -> set[int]:
    """Return the robots that wait, since they have encountered a known obstacle."""
    return {i for each in state.obstacles if each.known for i, _ in each.asked}


def _meets(floor: Floor, state: State, i: int) -> bool:
    """Return whether a robot can reach all its targets while the other robots stand still."""
    reached = floor.graphs[i].closure(1 << state.robots[i].next, floor.floors[i])
    return all(reached & target for target in floor.team.members[i].targets)


def is_complete(team: Team, state: State, control: Control) -> bool:
    """Return whether every robot has met its objective (and is at its last target if it must stay
    there), no request is being served, and no order is to come."""
    if control.found.served or orders_ahead(team, state):
        return False
    return all(
        done(team, state, i) and stands(team, state, i) and robot.mode is None
        for i, robot in enumerate(state.robots)
    )
