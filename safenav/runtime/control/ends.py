"""The ends of a run: outcome, cause, proof and the reasons in words. Also the reasons why a request
has no helpers, and ends from outside (by a request or a time limit)."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations
from math import inf

from msgspec import Struct
from msgspec.structs import replace

from safenav.plan.ask import Deadlock
from safenav.runtime.control.roles import Role, helpers_of
from safenav.runtime.control.strategies import Controller, walls_of
from safenav.scenario.objective import Word, describe
from safenav.solve import reasons
from safenav.solve.solve import (
    Closure,
    Sets,
    Settlement,
    Step,
    around,
    closure_of,
    dead_end,
    gathered,
    time_of,
)
from safenav.spec.task import Memory, Task
from safenav.team import known
from safenav.team.acts import FAILURE
from safenav.team.apply import done, stands
from safenav.team.state import Is, State
from safenav.team.team import Team, without_memory
from safenav.trace.vocabulary import OperatorCause, Proof
from safenav.trace.words import MANY, counted, listed, obstacle_words, seconds_words, some
from safenav.world.poses import FAR, Mask

_OUT = {
    "scenario": "by a change of the scenario",
    "user": "by an operator",
    FAILURE: "its steps fail",
}
_TRAPPED = "every remaining option traps a robot needed elsewhere"


class End(Struct, frozen=True):
    """The end of a run. ``cause``, ``proof``: fields of ``operator_needed`` (docs/trace.md);
    ``links``: its reasons, one sentence each; ``stuck``: robots that cannot continue;
    ``unrealizable``: robots without a strategy, each with its specification; ``refused``:
    insufficient deadlines and charges, each with the least that suffices (None: none)."""

    outcome: str
    explanation: str
    cause: str | None = None
    proof: Proof | None = None
    unrealizable: tuple[tuple[str, str], ...] = ()
    links: tuple[str, ...] = ()
    stuck: tuple[str, ...] = ()
    refused: Mapping[str, int | None] | None = None


def hopeful(team: Team, state: State, *, given_up: bool = True, serving: bool = False) -> Sets:
    """Return the poses and the floor as if every robot were in service. ``serving``: as if robots
    out of service blocked no robot; ``given_up``: as if given-up obstacles were still requested."""
    team, state = without_memory(team, state)
    again = tuple(k for k, each in enumerate(state.obstacles) if given_up and each.given_up)
    sealed = state.sealed.difference(again)
    floor = known.floor_with(team, state, (*state.gates, *again), sealed)
    if serving:
        here, free = known.floor_now(team, state), enumerate(floor.floors)
        within = tuple(each if i in here.robots else here.floors[i] for i, each in free)
        floor = replace(floor, robots=here.robots, floors=within)
    found = around(floor, tuple(r.next for r in state.robots), known.stages_of(floor, state))
    for i, robot in enumerate(state.robots):
        if robot.to is not None and not team.live:  # in transit it acts where it departed
            found = found.placed(i, found.sets[i] | (1 << robot.pose))
    return found


def lacks_of(team: Team, state: State) -> dict[str, reasons.Shortfall]:
    """Return the shortfalls of the known obstacles that are never resolved, given-up ones
    included."""
    views = [hopeful(team, state, given_up=again) for again in (False, True)]
    return {
        each.obstacle: each for now in views for each in reasons.shortfalls(now, closure_of(now))
    }


def infeasible(team: Team, state: State, now: Sets) -> End:
    """Return the end of a run in which some robot can never continue, now or after all choices."""
    word = team.world.word
    given_up = [team.obstacles[k].name for k, each in enumerate(state.obstacles) if each.given_up]
    lacks = lacks_of(team, state) if given_up else {}
    missed = [lacks[name] for name in given_up if name in lacks]
    closure, steps = dead_end(now)
    sentences, stuck = _after_choices(now, steps, word, left=closure is not None), list[int]()
    if closure is not None:
        stuck = _stuck(state, closure)
        sentences += [_why_stuck(team, state, i, chosen=bool(steps)) for i in stuck]
        missed += reasons.shortfalls(now, closure)
    links = tuple(
        dict.fromkeys((*sentences, *(reasons.shortfall_words(each, word) for each in missed)))
    )
    cause = reasons.cause_of(missed) if missed and not steps else OperatorCause.UNREALIZABLE
    stuck_names = tuple(team.members[i].name for i in stuck)
    return End("operator_needed", "; ".join(links), cause.value, None, (), links, stuck_names)


def _stuck(state: State, closure: Closure) -> list[int]:
    """Return the robots in service that can never continue."""
    live = zip(state.robots, closure.live, strict=True)
    return [i for i, (robot, lives) in enumerate(live) if robot.active and not lives]


def _after_choices(now: Sets, steps: Sequence[Step], word: Word, *, left: bool) -> list[str]:
    """Return the reasons along a chain of choices to a dead end. ``left``: whether a step is
    possible there."""
    sentences, lossless = list[str](), True
    for step in steps:
        lossless = lossless and step.lossless
        if lossless:  # each robot still reaches all regions that it could reach
            now = replace(now, stages=now.after(step).stages)
        else:
            sentences.append(_TRAPPED)
    if left:
        return sentences
    return sentences + ((reasons.without_room(now, word) if lossless else []) or [_TRAPPED])


def _why_stuck(team: Team, state: State, i: int, *, chosen: bool) -> str:
    """Return the reason why a robot cannot continue. ``chosen``: whether a choice led here."""
    robot, word = team.members[i].robot, team.world.word
    objective = robot.objective
    if objective.formulas is not None:
        return f"{robot.name} cannot meet its formulas in the regions that it can reach"
    if chosen:  # it can still do so from its current pose
        return f"{robot.name} could no longer {describe(objective, word)} after that"
    memory = Memory(state.robots[i].own.turn(objective.pursuit))
    pose = team.members[i].graph.pose(state.robots[i].next)
    walls = walls_of(team, state, i, frozenset(state.requests))
    return _why_not(team, i, Task(robot, pose, objective, memory, walls))


def no_strategy(
    team: Team, state: State, failed: Sequence[tuple[int, Controller]], *, begun: bool
) -> End:
    """Return the end of a run in which a robot has no strategy. Its outcome is ``unrealizable``
    before the start, ``assumption_violated`` if other robots have violated an assumption of the
    last strategy, else ``operator_needed``."""
    for i, _ in failed:
        if rules := state.robots[i].broken:
            name = team.members[i].name
            what = "; ".join(rules)
            why = f"{name} assumes: {what}; this was violated, and it has no strategy here"
            return End("assumption_violated", why, stuck=(name,))
    links = tuple(_why_not(team, i, each.task) for i, each in failed)
    specs = tuple((each.task.robot.name, each.result.spec_sha256) for _, each in failed)
    if not begun:
        return End("unrealizable", "; ".join(links), None, None, specs)
    cause, stuck = OperatorCause.UNREALIZABLE.value, tuple(name for name, _ in specs)
    return End("operator_needed", "; ".join(links), cause, None, specs, links, stuck)


def _why_not(team: Team, i: int, task: Task) -> str:
    # Imported here since most runs have nothing to explain.
    from safenav.explain.explanation import explain_unrealizable

    return explain_unrealizable(team.members[i].robot, task, team.world)


def deadlocked(team: Team, state: State, found: Deadlock) -> End:
    """Return the end of a run in which no order of moves of some robots completes the mission."""
    robots, why = found.robots, found.why
    names = tuple(team.members[i].name for i in robots)
    if not why:
        rivals = [i for i in robots if team.members[i].partners] or [*robots]
        where = ", ".join(
            f"{team.members[i].name} {'at' if state.robots[i].to is None else 'in transit to'} "
            f"{team.world.label(state.robots[i].next % team.size)}"
            for i in rivals
        )
        stay = [team.members[i].name for i in rivals if team.members[i].pursuit.settles]
        last = f"the last target{'s' if len(stay) > 1 else ''}"
        ends = f" with {listed(stay)} at {last}" if stay else ""
        few = len(robots) < len(team.members)
        alone = ", even without other robots and obstacles that only they resolve" if few else ""
        what = f"no reachable joint state completes every objective{ends}{alone}"
        why = f"{where}: deadlock; {what}"
    proof = Proof(names, found.memory)
    return End("operator_needed", why, "deadlock", proof, (), (why,), names)


def completed(team: Team, state: State, found: Settlement) -> End:
    """Return the end of a run whose mission is complete, with the open orders and the reasons."""
    whole, undone = f"every robot has met its objective for {counted(team.rounds, 'round')}", []
    for k, each in enumerate(state.obstacles):
        if team.obstacles[k].ordered and each.known:
            why, word, name = None, team.world.word, team.obstacles[k].name
            if name in (lacks := lacks_of(team, state) if each.given_up else {}):
                why = reasons.shortfall_words(lacks[name], word, "it")
            elif k in state.requests:
                why = Request(team, state, found, k).why_nobody()
            undone.append(obstacle_words(name, word) + (f" ({why})" if why else ""))
    return End("completed", whole + (f"; still open: {', '.join(undone)}" if undone else ""))


def out_of_service(team: Team, state: State, found: Settlement) -> End | None:
    """Return the end if only robots out of service have unmet objectives, else None."""
    robots, out = state.robots, [i for i, r in enumerate(state.robots) if not r.active]
    if found.served or not out or any(r.acting is not None for r in robots):
        return None
    every = range(len(robots))
    left = [i for i in every if not (done(team, state, i) and stands(team, state, i))]
    if not left or any(state.robots[i].active or known.charged(team, state, i) for i in left):
        return None
    return without(team, state, left)


def without(
    team: Team, state: State, robots: Sequence[int], left: str = "", now: Sets | None = None
) -> End:
    """Return the end of a run that cannot continue without the robots out of service. ``left``: the
    reason why the mission is not complete, if known; ``now``: what the other robots can do."""
    who = [f"{team.members[i].name}{_why_out(team, state, i)}" for i in robots]
    why = f"{' and '.join(who)} {'is' if len(who) == 1 else 'are'} out of service; "
    stuck = () if now is None else (team.members[i].name for i in _stuck(state, closure_of(now)))
    why += left or what_is_left(team, state, ())
    return End("operator_needed", why, "out_of_service", stuck=tuple(stuck))


def _why_out(team: Team, state: State, i: int) -> str:
    """Return the reason why a robot is out of service, with the robots whose targets it
    occupies."""
    robot, where = state.robots[i], 1 << state.robots[i].next % team.size
    why = (
        [text] if (text := "its battery is empty" if robot.flat else _OUT.get(robot.cause)) else []
    )
    others = [team.members[j] for j in sorted(team.members[i].rivals) if state.robots[j].active]
    here = [m.name for m in others if any(m.graph.regions_of(t) == where for t in m.targets)]
    if here:
        why.append(f"at {team.world.label(robot.next % team.size)}, a target of {listed(here)}")
    return f" ({'; '.join(why)})" if why else ""


def what_is_left(team: Team, state: State, roles: Sequence[Role]) -> str:
    """Return the reasons why the mission is incomplete."""
    after = seconds_words(state.time) if team.live else counted(round(state.time), "tick")
    what = "; ".join(_left(team, state, roles)) or "an action is under way"
    return f"not completed after {after}: {what}"


def _left(team: Team, state: State, roles: Sequence[Role]) -> Iterator[str]:
    behind: dict[int, list[str]] = {}
    for member, robot in zip(team.members, state.robots, strict=True):
        whole = member.pursuit.rounds(robot.own.met)
        if whole < team.rounds:
            behind.setdefault(whole, []).append(member.name)
    for whole, names in behind.items():
        who = listed(names) if len(names) <= MANY else f"{len(names)} robots"
        has = "has" if len(names) == 1 else "have"
        yield f"{who} {has} completed {whole} of {team.rounds} rounds"
    met = (i for i in range(len(team.members)) if done(team, state, i))
    away = [team.members[i].name for i in met if not stands(team, state, i)]
    if away:
        yield f"{some(away)} {'is' if len(away) == 1 else 'are'} not at the last target"
    for i, robot in enumerate(state.robots):
        if robot.mode is not None and done(team, state, i):
            yield f"{team.members[i].name} has another objective while '{robot.mode}' is on"
    word = team.world.word
    for obstacle, each in zip(team.obstacles, state.obstacles, strict=True):
        if obstacle.ordered and each.state is Is.AWAY:
            yield f"{obstacle_words(obstacle.name, word)} has not been ordered yet"
    for k in state.requests:
        what = obstacle_words(team.obstacles[k].name, word)
        names = [team.members[i].name for i, _ in state.obstacles[k].asked]
        wait = f"{listed(names)} {'waits' if len(names) == 1 else 'wait'}"
        helping = [team.members[i].name for i in helpers_of(roles, k)] or ["help"]
        yield (
            f"{wait} for {listed(helping)} to resolve {what}" if names else f"{what} is still open"
        )


ASIDE = "no joint plan that resolves it now was found"
_UNSERVED = "if a robot went there now, the team could not continue"


class Request:
    """The open request for obstacle ``k``. ``found``: the present duties of the robots."""

    def __init__(self, team: Team, state: State, found: Settlement, k: int) -> None:
        team, state = without_memory(team, state)
        self.team, self.state, self.found, self.k = team, state, found, k
        self.floor = known.floor_now(team, state)
        self.stages, self.g = known.stages_of(self.floor, state), self.floor.gates.index(k)
        self.need = self.floor.need(self.g, self.stages)
        self.now = Sets(self.floor, tuple(1 << robot.next for robot in state.robots), self.stages)

    def bids(self) -> dict[str, float | None]:
        """Return the bid of each robot in service with the actions of the next need (None: it has
        no path), as if robots out of service blocked no robot."""
        now = replace(self.now, floor=hopeful(self.team, self.state, given_up=False).floor)
        found = dict[str, float | None]()
        for i in (i for i in now.floor.skilled(self.g, self.stages) if self.state.robots[i].active):
            time = time_of(self.g, i, now.spots(i, self.need.regions), now, now)
            found[self.team.members[i].name] = None if time >= FAR else round(time, 1)
        return found

    def why_nobody(self, *, aside: bool = False) -> str | None:
        """Return the reason why no robot helps now although some have a path; None if the bids show
        it. ``aside``: whether no joint plan for the request was found."""
        floor, g = self.floor, self.g
        missing = floor.missing(g, self.stages)
        able = floor.able(g, self.stages)
        absent = (i for i in self._skilled() if not self.state.robots[i].active)
        out = [i for i in absent if i not in able]
        if len(able) + len(out) < missing:  # due to loads: else it would be given up
            return self._loads()
        if len(able) < missing:
            return self._absent(out)
        if aside:
            return ASIDE
        duties, members = self.found.duties, self.team.members
        busy = [i for i in able if i in duties and duties[i].g != g]
        if busy:
            pairs = ((members[i].name, self._obstacle(duties[i].g)) for i in busy)
            helps = (f"{name} helps with {other}" for name, other in pairs)
            return "; ".join(filter(None, (*helps, self._loads())))
        if g not in self.found.served:
            near = {i: there for i in able if (there := self._spots(i))}
            if len(near) < missing:  # robots out of service may be in the way
                left = [i for i, robot in enumerate(self.state.robots) if not robot.active]
                come = [each for each in self.bids().values() if each is not None]
                return self._absent(left) if left and len(come) >= missing else None
            word, name = self.team.world.word, floor.gate(g).name
            hope = hopeful(self.team, self.state, given_up=False)
            for each in reasons.shortfalls(hope, closure_of(hope)):
                if each.obstacle == name:  # a later need can never be fulfilled
                    return reasons.shortfall_words(each, word, "it")
            groups = combinations(near, missing) if self.need.together else [()]
            room = any(gathered(floor, group, near) is not None for group in groups)
            return _UNSERVED if room else reasons.crowd_words(floor, near, word)
        earlier = dict.fromkeys(step.g for step in self.found.plan if step.g != g)
        return f"first {listed(map(self._obstacle, earlier))} must be resolved" if earlier else None

    def why_others(self, helpers: Sequence[int], bids: Mapping[str, float | None]) -> str | None:
        """Return the reason, in words, why other capable robots do not help: they are nearer, are
        out of service, have failed, or cannot deliver the load. None if the bids show it."""
        names = [self.team.members[i].name for i in helpers]
        last = max((bids.get(name) or 0 for name in names), default=0)
        early = sorted(helpers, key=lambda i: bids.get(self.team.members[i].name) or 0)[:-1]
        others: dict[str, list[int]] = {}
        for i in self._skilled():
            ticks, duty = bids.get(self.team.members[i].name), self.found.duties.get(i)
            if i in helpers:
                continue
            if (i, self.k) in known.barred(self.team, self.state):
                why = "has failed"
            elif not self.state.robots[i].active:
                why = "is out of service"
            elif i in self.need.strays:
                why = "cannot go to where the load is put down"
            elif ticks is None or ticks >= last:
                continue
            elif duty is not None and duty.g != self.g:
                why = f"is to help with {self._obstacle(duty.g)}"
            elif not self._returns(i):
                why = "could not return from there"
            elif self.need.together and self._gathers({*early, i}) > self._gathers(helpers):
                why = "could reach another region only later"
            else:
                continue
            others.setdefault(why, []).append(i)
        parts, plural = [], {"has": "have", "is": "are"}
        for why, who in others.items():
            verb, what = why.split(" ", 1)
            several = plural.get(verb, verb) if len(who) > 1 else verb
            parts.append(f"{self._names(who)} {several} {what}")
        return "; ".join(parts) or None

    def _skilled(self) -> list[int]:
        """Return the robots with the actions of the next need, except those that have done their
        part."""
        done = self.stages[self.g].done
        return [i for i in self.floor.candidates(self.g, self.stages) if i not in done]

    def _loads(self) -> str | None:
        """Return, in words, the loads of robots that can take no further one; None if none."""
        floor, parts = self.floor, []
        carrying = floor.carriers(self.stages) if self.need.takes else frozenset()
        for i in carrying.intersection(floor.skilled(self.g, self.stages)):
            taken = {g: {*stage.done, *(stage.group or ())} for g, stage in enumerate(self.stages)}
            loads = [self._obstacle(g) for g in floor.open(self.stages) if i in taken[g]]
            parts.append(f"{self.team.members[i].name} carries {listed(loads)}")
        return "; ".join(sorted(parts)) or None

    def _gathers(self, group: Collection[int]) -> float:
        """Return the earliest time at which a group can act together."""
        places = {i: self._spots(i) for i in group}
        when = partial(time_of, self.g, now=self.now, origins=self.now)
        found = gathered(self.floor, (*group,), places, when)
        return inf if found is None else found

    def _spots(self, i: int) -> Mask:
        return self.now.spots(i, self.need.regions)

    def _returns(self, i: int) -> bool:
        """Return whether a robot can return to its pose after it has fulfilled the next need."""
        then = replace(self.now, stages=self.floor.advanced(self.g, self.stages, (i,)))
        return bool(then.reach(i, self._spots(i)) & self.now.sets[i])

    def _names(self, robots: Sequence[int]) -> str:
        return listed(self.team.members[i].name for i in robots)

    def _absent(self, robots: Sequence[int]) -> str:
        return f"{self._names(robots)} {'is' if len(robots) == 1 else 'are'} out of service"

    def _obstacle(self, g: int) -> str:
        return obstacle_words(self.floor.gate(g).name, self.team.world.word)


GIVEN_UP = End("interrupted", "given up")


class Stopped(BaseException):
    """Signal that the run ends with ``end``. It is not an Exception: like KeyboardInterrupt, it may
    be raised anywhere, and libraries must not handle it as their own error."""

    def __init__(self, end: End) -> None:
        self.end = end
        super().__init__(end.explanation)
