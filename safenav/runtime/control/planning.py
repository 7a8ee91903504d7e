"""The joint plan of a team: when robots need one, and the searches for it."""

from collections.abc import Collection, Sequence
from functools import cached_property

from msgspec import Struct
from msgspec.structs import replace

from safenav.plan.ask import Deadlock, Found, Unserved, homeward
from safenav.plan.order import at_end, blind, joint_now, starving, stuck
from safenav.runtime.control import ends
from safenav.runtime.control.answers import Answers
from safenav.runtime.control.roles import Role, helpers_of
from safenav.solve.solve import Settlement
from safenav.team import state as now
from safenav.team.acts import driven
from safenav.team.apply import done, orders_ahead, stands
from safenav.team.floor import Floor, Joint
from safenav.team.known import charged, floor_now, floor_with
from safenav.team.state import State
from safenav.team.team import Member, Team, hearing

Answer = Found | Deadlock | Unserved | None
"""The result of a search for a plan; None: the search took too long."""


class Planning(Struct, frozen=True, dict=True):
    """A decision on the joint plan. ``found``: the duties and the served requests; ``roles``: the
    role of each robot; ``complete``: whether the mission is complete; ``hopes``: whether a change
    or an operator may help if no plan exists; ``resting``: robots that only help others until
    then."""

    team: Team
    state: State
    answers: Answers
    found: Settlement
    roles: Sequence[Role]
    complete: bool
    hopes: bool
    resting: frozenset[int]

    @cached_property
    def helped(self) -> frozenset[int]:
        """The obstacles that robots with strategies have to resolve, unless all these robots wait
        there for partners in a joint action."""
        return frozenset(k for k in helped(self.team, self.roles) if not self._is_awaited(k))

    @cached_property
    def out(self) -> list[int]:
        """The robots out of service."""
        return [i for i, robot in enumerate(self.state.robots) if not robot.active]

    @cached_property
    def sharing(self) -> tuple[int, ...]:
        """The robots in service that joint plans drive."""
        return driven(self.team, self.state)

    def _is_awaited(self, k: int) -> bool:
        """Return whether all helpers with strategies wait in place for partners in a joint
        action."""
        need = self.team.obstacles[k].next(self.state.obstacles[k].stage)
        if need is None or not need.together:
            return False
        lone = {*self.team.lone}.intersection(helpers_of(self.roles, k))
        helpers = (self.state.robots[i] for i in lone)
        return all(r.to is None and need.regions >> r.pose % self.team.size & 1 for r in helpers)

    def events(self) -> Sequence[now.Event] | ends.End:
        """Return the events that start a plan or set requests aside (none if no plan is needed), or
        the end of the run if no plan exists. Raises Pending."""
        team, state, answers = self.team, self.state, self.answers
        if not team.sharing:
            return ()
        due, low = self._is_due(), [] if self.complete else starving(team, state)
        may = bool(team.charged) and blind(state) and not self.complete
        starves = bool(low) or (may and len(state.over) > answers.examined)
        returns = any(charged(team, state, i) for i in self.out)  # these return to service first
        if returns or not (starves or due) or not self.sharing:
            return ()
        floor = floor_now(hearing(team, state.inputs), state).while_resting(self.resting)
        joint = joint_now(state, floor)
        open_ = {floor.gates[g] for g in self.found.served}
        if not starves and self._waits(open_):
            return ()  # robots with strategies first resolve obstacles
        alone = self.helped.difference(self.roles[i].helps for i in self.sharing)
        idle = open_ <= alone
        if not starves and idle and floor.completed(joint, frozenset(), self.sharing):
            return self._rounds(floor, joint) if not (self.complete or open_) else ()
        floor, better = self._with_helpers(floor), blind(state) and not due
        answer = answers.plan(floor, joint, self.found.served, state, better=better)
        if floor.team is not team and not isinstance(answer, Found):  # now for any inputs
            floor = replace(floor, team=team, graphs=floor_now(team, state).graphs)
            joint = joint_now(state, floor)
            if idle and floor.completed(joint, frozenset(), self.sharing):
                return ()
            answer = answers.plan(floor, joint, self.found.served, state, better=better)
        answers.examined = len(state.over)
        if better and not isinstance(answer, Found):
            return () if team.scenario.flat else self._home()  # the team keeps its plan
        rests = isinstance(answer, Found) and all(len(answer.plan.ways[i]) < 2 for i in low)
        ends = idle and floor.completed(joint, frozenset(), self.sharing)
        if low and rests and ends and not team.scenario.flat:
            answers.vain = answers.stage
            return self._home()
        return self._decided(self._otherwise(answer, floor, joint), floor)

    def _home(self) -> Sequence[now.Event]:
        """Return a plan that brings robots with low charge to chargers, if there is one. A robot
        with work does not turn back twice without progress: its charge may suffice. Once all rounds
        are completed, the way to its last target is work."""
        team, state = self.team, self.state
        stage, went = self.answers.stage, self.answers.went
        over = all(done(team, state, i) for i in self.sharing) and not orders_ahead(team, state)
        here = (i for i in self.sharing if stands(team, state, i) or not over)
        free = (i for i in here if done(team, state, i) and self.roles[i].helps is None)
        served = self.found.served  # and robots then begin their rounds again
        idle = {i for i in free if team.members[i].pursuit.settles or not served}
        low = [i for i in starving(team, state) if i in idle or went.get(i) != stage]
        plan = to_chargers(team, state, low)
        if plan is None:
            return ()
        went.update({i: stage for i in low if len(plan.ways[i]) > 1})
        return (now.Planned(plan),)

    def _is_due(self) -> bool:
        """Return whether a plan is due: none is in force, or it has ended or is stuck."""
        state, sharing = self.state, self.team.sharing
        if state.plan is None:
            return True
        acts = any(state.robots[i].acting is not None for i in sharing)
        return (at_end(state, sharing) and not acts) or stuck(self.team, state, self.helped)

    def _waits(self, open_: Collection[int]) -> bool:
        """Return whether the plan waits for robots with strategies to resolve these obstacles."""
        foreseen = frozenset[int]() if self.state.plan is None else self.state.plan.foreseen
        return bool(self.helped.intersection(open_)) and {*open_} <= foreseen & self.helped

    def _rounds(self, floor: Floor, joint: Joint) -> Sequence[now.Event]:
        """Return a plan of further rounds if robots have deadlines while others have work."""
        members = self.team.members
        timed = [i for i in self.sharing if _is_timed(members[i], joint.poses[i])]
        if not timed:
            return ()
        more = 1 + min(floor.rounds_done(i, joint.counts[i]) for i in timed)
        rounds = tuple(more if i in timed else n for i, n in enumerate(floor.wanted))
        floor = replace(floor, robots=self.sharing, rounds=rounds)
        answer = self.answers.plan(floor, joint, (), self.state, better=True)
        if isinstance(answer, Found) and not answer.first:
            return (now.Planned(answer.plan),)
        return ()

    def _with_helpers(self, floor: Floor) -> Floor:
        """Return the floor with the robots that help now recorded in ``helping``."""
        duties = self.found.duties
        helping = {d.g: tuple(i for i in duties if duties[i].g == d.g) for d in duties.values()}
        return replace(floor, helping=tuple(helping.items())) if helping else floor

    def _otherwise(self, answer: Answer, floor: Floor, joint: Joint) -> Answer:
        """Return the result of a search or, if that is None or a proof, perhaps that of a smaller
        one."""
        state, answers, served = self.state, self.answers, self.found.served
        brings = replace(floor, rounds=(0,) * len(self.team.members))
        if answer is None and served:
            # The search took too long. The mission may not need the robots' requests. An order may
            # be served before the rounds, which its resolution restarts.
            if all(state.obstacles[floor.gates[g]].asked for g in served):
                without = answers.plan(floor, joint, (), state)
                answer = Unserved(served) if isinstance(without, Found) else None
            elif isinstance(first := answers.plan(brings, joint, served, state), Found):
                answer = replace(first, plan=replace(first.plan, part=True))
        empty = tuple(g for g in served if g in floor.flat.values())
        for gates in dict.fromkeys((served, empty)) if self.out or self.hopes else ():
            # Robots out of service or a deadlock prevent rounds, but perhaps not requests; robots
            # with a new battery return.
            left = answer.gates if isinstance(answer, Unserved) else ()
            if gates and (isinstance(answer, Deadlock | None) or {*empty}.intersection(left)):
                brought = answers.plan(beyond(brings, gates), joint, gates, state)
                rest = {*gates}.difference(brought.gates) if isinstance(brought, Unserved) else ()
                if rest:  # these first: robots that return may serve the others
                    some = tuple(sorted(rest))
                    brought = answers.plan(beyond(brings, some), joint, some, state)
                if isinstance(brought, Found):
                    part = replace(brought.plan, part=True)
                    answer = brought if self.out else replace(brought, plan=part)
        return answer

    def _decided(self, answer: Answer, floor: Floor) -> Sequence[now.Event] | ends.End:
        """Return the events, or the end of the run, that follow from the result of a search."""
        team, state, gone = self.team, self.state, self.out
        match answer:
            case Found(plan, turned):
                plan = replace(plan, part=plan.part or bool(self.resting))
                return (*(now.Turned(i, memory) for i, memory in turned), now.Planned(plan))
            case Unserved(gates):
                return (now.SetAside(tuple(floor.gates[g] for g in gates)),)
            case Deadlock():
                end = ends.deadlocked(team, state, answer)
                return ends.without(team, state, gone) if gone else end  # they may block others
            case None:
                why = "search budget exhausted while planning a joint plan; no verdict"
                gone = [i for i in gone if not (done(team, state, i) and stands(team, state, i))]
                end = ends.End("search_limit", why)
                return ends.without(team, state, gone, why) if gone else end


def to_chargers(team: Team, state: State, low: Sequence[int]) -> now.Plan | None:
    """Return a plan that brings robots with ``low`` charge, the most urgent first, to chargers
    while no obstacle changes; None if no robots are low or no plan is found. A robot stays on its
    charger until its battery is full, or has an ample part more than that of one of them."""
    robots, standing = state.robots, dict[int, int]()
    least = min((robots[i].charge for i in low), default=0)
    for i, (member, robot) in enumerate(zip(team.members, robots, strict=True)):
        energy = member.energy
        if not robot.active or (
            energy and energy.charging(robot.next) and robot.charge < energy.yields(least)
        ):
            standing[i] = robot.next
    every, sealed = hearing(team, state.inputs), state.sealed.union(state.gates)
    floor = floor_with(every, state, (), sealed, frozenset(standing.items()))
    floor = replace(floor, rounds=(0,) * len(robots))
    plan = homeward(floor, joint_now(state, floor), low) if low else None
    return None if plan is None else with_all(plan, state)


def with_all(plan: now.Plan, state: State) -> now.Plan:
    """Return a plan for a part of the mission, in which robots without a path stay."""
    pairs = zip(plan.ways, state.robots, strict=True)
    ways = tuple(way or (now.Waypoint(robot.next),) for way, robot in pairs)
    return replace(plan, ways=ways, part=True)


def helped(team: Team, roles: Sequence[Role]) -> frozenset[int]:
    """Return the obstacles that robots with strategies have to resolve."""
    helps = (roles[i].helps for i in team.lone)
    return frozenset(k for k in helps if k is not None)


def beyond(floor: Floor, gates: Collection[int]) -> Floor:
    """Return the floor on which only these gates keep robots from continuing forever. Robots that
    return to service will resolve all others."""
    closed = [floor.gate(g).region for g in range(len(floor.gates)) if g not in gates]
    pairs = zip(floor.graphs, floor.away or (0,) * len(floor.graphs), strict=True)
    return replace(floor, away=tuple(away | graph.on(closed) for graph, away in pairs))


def _is_timed(member: Member, pose: int) -> bool:
    """Return whether a robot that has completed the mission must move to meet the deadlines of its
    next rounds."""
    stays = member.pursuit.settles or all(target >> pose & 1 for target in member.targets)
    return member.robot.within is not None and not stays
