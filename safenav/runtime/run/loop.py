"""The paper's Algorithm 1. Numbers in comments are its lines:

 1  for p in P do                              12        if c_r in C_p then
 2    phi_p <- initial objectives              13          add state in S_r to phi_p
 3  phi_stack <- empty                         14          synthesize controllers
 4  synthesize controllers                     15          break
 5  while system active do                     16      continue
 6    execute controllers                      17    else if r in phi_pr then
 7    if r encountered by p_r at s_o then      18      resolve obstacle r
 8      if c_r not in C_pr then                19      pop phi off of phi_stack
 9        push all phi onto phi_stack          20      synthesize controllers
10        change phi_pr to safe behaviour      21      continue
11      for p in P do
"""

from collections.abc import Callable, Iterator
from operator import is_

from msgspec.structs import replace

from safenav.runtime.control.answers import Answers
from safenav.runtime.control.coordinate import Control, Decision, Situation, is_complete
from safenav.runtime.control.ends import End, completed, hopeful, what_is_left
from safenav.runtime.control.roles import Role
from safenav.runtime.control.strategies import candidates, enough, looked
from safenav.runtime.run import decide
from safenav.runtime.run.checkpoint import Kept, Resumption
from safenav.runtime.run.deadlines import refusal_of
from safenav.runtime.run.record import Recorder
from safenav.runtime.run.world import World
from safenav.scenario.model import Obstacle
from safenav.solve.solve import closure_of
from safenav.team import state as now
from safenav.team.acts import noticed
from safenav.team.apply import apply, on_own
from safenav.team.team import Team, assigned, based, introduced
from safenav.trace.records import Act, Depart, Synthesis
from safenav.trace.words import listed, obstacle_words

Action = Iterator[now.Event]
"""The results of an action; each one is applied before the next one is read."""
MOST_PASSES = 50
"""Maximum number of passes at one moment, per robot (plus ten)."""


class Run(Situation):
    """A run. ``state``: the facts; ``control``: the team's intentions; ``team`` also gets obstacles
    that the scenario does not list. ``check`` raises if the run must end."""

    def __init__(
        self,
        team: Team,
        world: World,
        answers: Answers,
        recorder: Recorder,
        check: Callable[[], None] = lambda: None,
    ) -> None:
        super().__init__(team, answers)  # 1 to 3
        self.world, self.recorder, self.check = world, recorder, check
        self.settled: tuple[Team, now.State, Control] | None = None

    def begin(self) -> None:
        self.recorder.begins()
        self.settle()  # 4
        self.recorder.ledger.turn_ends(self.team, self.state)
        if self.control.end is None and (end := refusal_of(self.team, self.state)) is not None:
            self.control = replace(self.control, end=end)

    def kept(self) -> Kept:
        """Return the run before its next pass, for a checkpoint."""
        robots, listed = [m.robot for m in self.team.members], len(self.team.scenario.obstacles)
        own, within = (robot.objective for robot in robots), (robot.within for robot in robots)
        helps = tuple(role.helps for role in self.control.roles) or (None,) * len(robots)
        added = tuple((each.source, each.battery_of) for each in self.team.obstacles[listed:])
        about = tuple(own), tuple(within), helps, self.recorder.kept(), added
        truth = None if self.world.truth is None else self.world.truth.kept()
        return Kept(self.state, *about, truth)

    def resume(self, begun: Resumption) -> None:
        """Continue an interrupted run. In a live run, open commands have ended where they began.
        Strategies are synthesized where the robots are."""
        kept, self.team, self.state = begun.kept, begun.team, begun.kept.state
        self.recorder.team = self.team
        self.world.operator.resume(self.state.time, begun.lines)
        for line in begun.lines:
            if isinstance(line, Synthesis):
                self.answers.count += 1
                self.answers.seconds += line.seconds
        commands = (each.command for each in begun.lines if isinstance(each, Depart | Act))
        self.recorder.resume(kept.memory, self.state, begun.lines)
        self.world.resume(self, kept.truth, max(commands, default=0))
        for i, robot in enumerate(self.state.robots):
            if self.world.live and robot.to is not None:
                self.happens(now.Elsewhere(i, robot.pose))
            elif robot.acting == i:
                self.happens(now.Acted(i, (), (), why="the run was interrupted"))
        pairs = zip(self.state.robots, kept.helps, strict=True)
        roles = tuple(Role(robot.objective, helps) for robot, helps in pairs)
        self.control = Control(roles=roles, controllers=(None,) * len(roles))
        self.settle()

    def step(self) -> None:
        """Run a pass: a tick or, live, an instant at which something happens. The team makes one
        decision for all changes of a pass."""
        changed = happened = False
        strayed = list[int]()
        for event in self.world.wait(self, self.still()):  # reports of the world and turns
            self.check()
            happened = True
            if isinstance(event, now.Change | now.Strayed):
                self.happens(event)
                strayed += [] if isinstance(event, now.Change) else [event.robot]
                changed = True
                continue
            if changed:
                self.settle_after(strayed)
                changed = False
                if self.world.live and self.control.end is not None and self.is_complete():
                    break  # the run is complete and only has to end
            before = self.state
            self.happens(event)
            if isinstance(event, now.Turn | now.Arrived | now.Goes):
                self.look(event.robot)
            if isinstance(event, now.Turn):
                if self.drains(event.robot):
                    self.settle()
                self.execute_controller(event.robot)  # 6 to 8
            elif isinstance(event, now.Arrived | now.Goes):
                self.act(event.robot)  # 17, 18
            self.count(before, event)
            if isinstance(event, now.Turn | now.Ended):
                self.drains(event.robot)
            self.settle()  # 9 to 16, 19 to 21
            self.recorder.ledger.turn_ends(self.team, self.state)
            if self.has_ended(event):
                break
        if changed:
            self.settle_after(strayed)
        if happened:
            self.answers.forget()

    def look(self, i: int) -> None:
        """Let a robot observe those that it tracks, even out of service or without a strategy."""
        member = self.team.members[i]
        if member.robot.tracks and not member.planned:
            mine, role = self.control.controllers[i], Role(self.state.robots[i].objective)
            task = mine.task if mine else next(candidates(self.team, self.state, i, role))[0]
            seen = looked(self.team, self.state, i, task)
            if seen is not None:
                self.happens(seen)

    def execute_controller(self, i: int) -> None:
        """Run a robot's turn (lines 6 to 8). The robot first acts where it stands. Its plan or
        strategy then proposes a move (NP), which is checked for obstacles (EC). If one is found,
        the robot backs up by a safe move."""
        if not self.state.robots[i].idle:
            return
        action = self.action(i)
        if action is not None or not self.moves(i):
            self.take(i, decide.Proposal(self.state.robots[i].pose, "stay"), action)
        else:
            step = decide.propose(self, i)  # NP
            stays = step.by == "stay"
            if stays and (rules := decide.broken(self, i)):
                self.happens(now.Astray(i, rules))
                self.settle()
                step = decide.propose(self, i)
            obstacle = self.characterize(i, step)  # EC
            here = self.state.robots[i].pose
            if obstacle is not None and self.state.obstacles[obstacle].state is now.Is.SEALED:
                step = decide.Proposal(here, "stay")  # the team waits and requests nothing
            elif obstacle is not None:
                inside = self.team.obstacles[obstacle].region == here % self.team.size
                self.happens(now.Met(i, obstacle, here if inside else step.pose))  # 7
                step = self.back_up(i)  # 8
            self.take(i, step)

    def characterize(self, i: int, step: decide.Proposal) -> int | None:
        """Return the obstacle that a robot would enter by a move, from the team's knowledge or else
        from the robot's sensor; None if there is none."""
        known = decide.closing(self, i, step.pose)
        region = step.pose % self.team.size
        if known is not None or region == self.state.robots[i].pose % self.team.size:
            return known
        obstacle = self.world.sense(self, i, region)
        if obstacle is None:
            return None
        for event in noticed(self.team, self.state, obstacle):
            self.happens(event)
        return decide.closing(self, i, step.pose)

    def back_up(self, i: int) -> decide.Proposal:
        """Return a safe move: a step under another command if the robot has assigned goals, else a
        stay, which keeps the strategy's node."""
        other = None
        if self.team.assignable(i) and self.team.members[i].ticks == 1 and not self.world.live:
            other = decide.successor(self, i)
        if other is None or self.characterize(i, other) is not None:
            return decide.Proposal(self.state.robots[i].pose, "backtrack")
        return other._replace(by="backtrack")

    def take(self, i: int, step: decide.Proposal, action: Action | None = None) -> None:
        here, graph = self.state.robots[i].pose, self.team.members[i].graph
        if step.pose == here:
            node, strays = decide.node_while_staying(self, i, step)
            self.happens(now.Stayed(i, step.by, node, step.values))
            if strays:
                self.happens(now.Astray(i, ()))
        elif graph.pose(step.pose) == graph.pose(here):  # only its formulas take a step
            self.happens(now.Departed(i, step.pose, step.by))
            self.happens(now.Arrived(i))
        else:
            for event in self.world.start(self, i, step):
                self.happens(event)
        self.act(i, action)

    def act(self, i: int, action: Action | None = None) -> None:
        """Let a robot resolve all that it can where it stands, whether requested or not (lines 17
        and 18). ``action``: the results of an action that has begun."""
        action = self.action(i) if action is None else action
        if action is not None:
            for event in action:
                self.happens(event)
            if not on_own(self.team, self.state, i):
                self.settle()  # the action ends its duty; otherwise the robot first counts goals

    def moves(self, i: int) -> bool:
        """Return whether a robot may move. While the team waits, only some robots may."""
        if self.control.end is None:
            rests = i in self.control.resting and not self.team.members[i].planned
            return not rests or self.control.roles[i].helps is not None
        pause = self.world.pause(self)
        if self.team.members[i].planned:  # by its plan for the wait
            return pause is not None and self.control.waits
        return pause is not None and decide.continues(self, i)

    def action(self, i: int) -> Action | None:
        """Return the action of a robot where it stands; None if the action changes nothing, or if
        the team waits for an operator and this robot may not continue."""
        pause = self.world.pause(self)
        may = pause is None or pause[1] is not None or self.moves(i)
        return self.world.act(self, i) if may else None

    def count(self, before: now.State, event: now.Event) -> None:
        """Count a robot's goals where it stands, at the end of its turn. Those of a new objective
        were counted when the robot got it. An action ends a duty. Own goals count besides a duty if
        a joint plan, or an assignable robot's strategy, counts them."""
        if isinstance(event, now.Turn | now.Arrived | now.Acted):
            i = event.robot
            robot = self.state.robots[i]
            ended = isinstance(event, now.Acted) or self.control.end is not None
            if ended and not on_own(self.team, self.state, i):
                keeps = self.team.members[i].planned or self.team.assignable(i)
                if isinstance(event, now.Acted) and keeps and robot.idle:
                    self.happens(now.Counted(i, duty=False))
                return
            was = before.robots[i]  # the decision has counted a new objective
            same = robot.fresh or (robot.objective == was.objective and not was.fresh)
            if robot.idle and same and (robot.active or isinstance(event, now.Arrived)):
                at_once = self.world.live and isinstance(event, now.Turn)
                self.happens(now.Counted(i, at_once))

    def settle_after(self, strayed: list[int]) -> None:
        """Decide after changes. Robots that a failure has put out of service request no battery."""
        while strayed:
            self.drains(strayed.pop(0))
        self.settle()

    def drains(self, i: int) -> bool:
        """Put a robot off the chargers out of service, until it gets another battery, if its charge
        does not suffice for a step. Return whether it did so."""
        robot, energy = self.state.robots[i], self.team.members[i].energy
        if energy is None or not (robot.active and robot.to is None):
            return False
        if not energy.is_flat(robot.charge, robot.pose):
            return False
        kind, k = self.team.scenario.flat, None
        pairs = zip(self.team.obstacles, self.state.obstacles, strict=True)
        there = any(o.battery_of == i and each.stands for o, each in pairs)
        if kind is not None and not there:
            k = len(self.team.obstacles)
            source = Obstacle(kind, robot.pose % self.team.size, appears=int(self.state.time))
            while source.name in self.team.numbers:
                source = replace(source, number=source.number + 1)
            if self.world.truth is not None:
                self.world.truth.place(source, battery_of=i)
            self.happens(now.Introduced(source, i))
        self.happens(now.Flat(i, k))
        return True

    def happens(self, event: now.Event) -> None:
        if isinstance(event, now.Introduced):
            self.team = self.recorder.team = introduced(self.team, event.source, event.battery_of)
        elif isinstance(event, now.Assigned):
            event = replace(event, own=on_own(self.team, self.state, event.robot))
            self.team = assigned(self.team, event.robot, event.objective, event.within)
        before, self.state = self.state, apply(self.team, self.state, event)
        if (i := _elsewhere(self.team, before, event)) is not None:
            pose = self.team.members[i].graph.pose(self.state.robots[i].next)
            self.team = self.recorder.team = based(self.team, {i: pose})
            if self.world.truth is not None:
                self.world.truth.follow(self.team)
        self.recorder.record(before, event, self.state)
        rests = bool(self.control.resting)
        if _helps(before, event, ended=rests or self.control.end is not None):
            self.control = replace(self.control, question=None, new=(), end=None)
            waited, self.recorder.waited = self.recorder.waited, None
            waits = rests or waited not in (None, (None,))
            if (waits and self.world.coming(self) is None) or self.may_resolve():
                self.happens(now.Reopened())

    def settle(self) -> None:
        """Update the team's intentions. Its decisions are events like any other."""
        before, intended = self.state, self.control
        if self.settled is not None and all(map(is_, self.settled, (self.team, before, intended))):
            return  # nothing has changed
        hopes = self.world.attended or self.world.awaited(self) is not None
        decision = Decision(self.team, before, self.answers, hopes=hopes)
        self.control = decision.control(intended)
        decided, self.state = decision.decided, decision.state
        if self.control.new or self.control.question != intended.question:
            coming = self.world.coming(self) is not None
            self.recorder.settled(decided, self.state, self.control, coming=coming)
        self.recorder.tell_plan(decided, self.state)
        if (pause := self.world.pause(self)) is not None and not self.is_met():
            self.recorder.waiting(*pause)
        thinks = self.control.thinks or self.control.pending or self.control.question is None
        final = not (decided or thinks or self.control.end)
        self.settled = (self.team, self.state, self.control) if final else None

    def may_resolve(self) -> bool:
        """Return whether some given-up obstacle can be resolved now (True if there is none)."""
        given_up = {k for k, each in enumerate(self.state.obstacles) if each.given_up}
        if not given_up:
            return True
        around = hopeful(self.team, self.state)
        return not given_up <= {around.floor.gates[g] for g in closure_of(around).stuck}

    def has_ended(self, event: now.Event) -> bool:
        """Return whether the run ends after this turn, before other robots' turns: after a missed
        deadline, or since nothing can help."""
        if self.recorder.ledger.stops:
            return True
        if self.control.end is None or not isinstance(event, now.Turn | now.Arrived):
            return False
        return self.world.pause(self) is None and not self.arrives()

    def arrives(self) -> bool:
        """Return whether a robot in transit keeps the run from ending, since it may act where it
        arrives."""
        absent = self.control.end is not None and self.control.end.cause == "out_of_service"
        return absent and any(r.to is not None and not r.active for r in self.state.robots)

    def over(self) -> End | None:
        """Return the end of the run; None if it has not ended."""
        state, end, ledger = self.state, self.control.end, self.recorder.ledger
        if ledger.stops:
            word = self.team.world.word
            missed = listed(obstacle_words(name, word) for name in ledger.missed or ())
            return End("late", f"a deadline was missed: {missed}")
        if self.is_complete():
            return completed(self.team, state, self.control.found)
        under_way = self.acts() or self.arrives()
        if end is not None and not under_way and self.world.pause(self) is None:
            return end
        if (still := self.still()) is not None:
            if not self.may_hear():
                return still
            self.recorder.waiting(still, None)
        if self.world.passes > MOST_PASSES * (len(self.team.members) + 10):
            return End("search_limit", f"no time passes; {self.left()}")
        if state.time >= self.world.limit[0]:
            return End(self.world.limit[1], self.left())
        return None

    def is_complete(self) -> bool:
        """Return whether the mission is complete and nothing is under way."""
        return not self.acts() and self.is_met()

    def is_met(self) -> bool:
        """Return whether the mission is complete unless an action restarts rounds. An order that
        robots cannot serve yet waits for a change if enough of them have its actions."""
        if not is_complete(self.team, self.state, self.control):
            return False
        known = (k for k, each in enumerate(self.state.obstacles) if each.known)
        undone = any(self.team.obstacles[k].ordered and enough(self.team, k) for k in known)
        return not undone or self.world.coming(self) is None

    def acts(self) -> bool:
        """Return whether some robot's action is under way."""
        return any(robot.acting is not None for robot in self.state.robots)

    def may_hear(self) -> bool:
        """Return whether an operator may still set an input."""
        return self.world.attended and bool(self.team.scenario.inputs)

    def still(self) -> End | None:
        """Return the end of a run in which no robot will ever move again; None in any other run."""
        if self.control.end is not None or not self.world.still:
            return None
        words = f"no robot moves; {self.left()}"
        if self.team.scenario.inputs:
            words += f"; inputs: {' and '.join(sorted(self.state.inputs)) or 'none'} on"
        return End("time_limit", words)

    def left(self) -> str:
        """Return, in words, the reason why the mission is incomplete."""
        return what_is_left(self.team, self.state, self.control.roles)


def _elsewhere(team: Team, before: now.State, event: now.Event) -> int | None:
    """Return the robot whose paths an event may change, since it gets other rules, is placed
    elsewhere, or leaves a region that it avoids; None if there is none."""
    if isinstance(event, now.Assigned | now.Placed):
        return event.robot
    if not isinstance(event, now.Departed | now.Ended):
        return None
    avoid, robot = team.members[event.robot].objective.avoid, before.robots[event.robot]
    return event.robot if robot.pose % team.size in avoid else None


def _helps(state: now.State, event: now.Event, *, ended: bool) -> bool:
    """Return whether an event may make a given-up resolution possible. ``ended``: whether only this
    can help."""
    match event:
        case now.Gone(k):
            return ended or state.obstacles[k].stands
        case now.Acted(truths=found):  # it may open obstacles given up or declared meanwhile
            opened = (state.obstacles[k] for k, truth in found if truth is not False)
            return any(each.state is now.Is.SEALED for each in opened)
        case now.Served(_, active):
            return ended or active
        case now.Appeared() | now.Inputs() | now.Declared() | now.Elsewhere() | now.Lost():
            return ended
    return isinstance(event, now.Placed | now.Assigned)
