"""Strategies: a robot's specification for its role, and slugs' answer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from safenav.outcome import Verdict
from safenav.runtime.control.answers import Answers, Pending
from safenav.runtime.control.observing import observed, standing
from safenav.runtime.control.roles import Role
from safenav.scenario.guarantees import values_of
from safenav.scenario.objective import Ltl, Objective, Word, describe, formulas_in
from safenav.scenario.settings import Clock, Coordination
from safenav.spec.compile import compile_task
from safenav.spec.forms import ObjectiveForm, Weakening, concession, forms
from safenav.spec.objective import Memory
from safenav.spec.task import Known, Task
from safenav.synthesis.request import SynthesisResult
from safenav.team.floor import Floor, stages_of
from safenav.team.state import Is, State, Values
from safenav.team.team import Team
from safenav.trace import records
from safenav.trace.vocabulary import Form
from safenav.trace.words import obstacle_words
from safenav.world.partition import Partition
from safenav.world.poses import region_mask

COMMANDS = ("assigned", "request", "wait")
"""The inputs by which an assignable robot is commanded."""


class Controller(Struct, frozen=True, eq=False):
    """A strategy for a task. ``asked``: the objective of which the task has a ``form``; ``tried``:
    the stronger forms that failed; ``node``: where it begins."""

    task: Task
    asked: Objective
    rung: ObjectiveForm
    result: SynthesisResult
    tried: tuple[records.Tried, ...] = ()

    @property
    def realizable(self) -> bool:
        return self.result.verdict is Verdict.REALIZABLE

    @property
    def form(self) -> Form:
        if self.rung.objective != self.asked:
            return Form.ALTERNATION
        return Form.OTHER_MEMORY if self.rung.weakening is Weakening.TURNED else Form.LITERAL

    def allows(self, word: Word) -> str | None:
        """The shortfall of its form from the objective, with the reason; None if there is none."""
        return concession(self.asked, self.rung, word)

    def words(self, word: Word) -> str:
        """The objective in the requested form, in the user's words."""
        allows = self.allows(word)
        return describe(self.asked, word) + (f" ({allows})" if allows else "")

    def failed(self) -> tuple[records.Tried, ...]:
        """All forms that failed, this one the last."""
        one = records.Tried(self.form, self.result.spec_sha256, self.result.verdict)
        return (*self.tried, one)

    @property
    def node(self) -> int | None:
        strategy = self.result.strategy
        begins = values_of(self.task.pose) | ({"wait": 0} if self.task.assignable else {})
        return None if strategy is None else strategy.find_initial(begins)

    def steps(self, node: int, heard: Mapping[str, int]) -> list[tuple[int, int | None, int]]:
        """The strategy's successors for these inputs: region, heading, node."""
        strategy = self.result.strategy
        assert strategy is not None
        found = ((n, strategy.values(n)) for n in strategy.successors_for(node, heard))
        return [(values["region"], values.get("heading"), n) for n, values in found]

    def values(self, node: int | None) -> Values | None:
        """The values at a node of the memory of formulas, of inputs that they name, and of
        commands."""
        objective, strategy = self.task.objective, self.result.strategy
        names: tuple[str, ...] = COMMANDS if self.task.assignable else ()
        if isinstance(objective, Ltl):
            names = (*names, *objective.memory, *objective.inputs)
        if node is None or strategy is None or not names:
            return None
        found = strategy.values(node)
        return tuple(sorted((name, found[name]) for name in names))


def assignable(team: Team, i: int) -> bool:
    """Whether a robot keeps one strategy, whose inputs command it."""
    return team.scenario.coordination is Coordination.ASSIGNABLE and not team.members[i].planned


Candidate = tuple[Task, ObjectiveForm]
"""A task, and the form of its robot's objective in it."""


def synthesized(
    team: Team, state: State, roles: Mapping[int, Role], answers: Answers
) -> dict[int, Controller]:
    """The strategy of each robot for its role, all synthesized simultaneously: the strongest form
    that is realizable; if none is, the last one's verdict. Raises Pending."""
    found: dict[int, Controller] = {}
    left = {i: candidates(team, state, i, role) for i, role in roles.items()}
    while tried := {i: each for i in left if (each := next(left[i], None)) is not None}:
        specs = [compile_task(task, team.world) for task, _ in tried.values()]
        pairs = zip(tried.items(), answers.strategies(specs), strict=True)
        waiting = set()
        for (i, (task, rung)), result in pairs:
            if result is None:
                waiting.add(i)
                continue
            tried_before = found[i].failed() if i in found else ()
            asked = task.robot.objective if task.assignable else roles[i].objective
            found[i] = Controller(task, asked, rung, result, tried_before)
            if found[i].realizable:
                del left[i]
        if waiting:
            raise Pending(frozenset(waiting))
    return found


def candidates(team: Team, state: State, i: int, role: Role) -> Iterator[Candidate]:
    """The tasks for a role, the strongest form first."""
    member, robot, assigned = team.members[i], state.robots[i], assignable(team, i)
    if assigned:
        role = Role(member.objective)  # with any assignment
    own, pose = role.objective == member.objective, member.graph.pose(robot.next)
    walls, cells = walls_of(team, state, i, role.avoid), team.scenario.partition
    turn = robot.own.memory if own and role.objective.in_turn else 0
    for rung in forms(
        role.objective,
        robot.own.memory if role.objective.strict else turn,
        pose,
        member.graph,
        region_mask(known.region for known in walls),
        shared=bool(member.rivals),
        assigned=assigned,
    ):
        memory = Memory(rung.turn if role.objective.strict else turn)
        named: tuple[str, ...] = ()
        if isinstance(role.objective, Ltl):
            kept, named = dict(robot.values), role.objective.inputs
            if role.objective.memory.keys() <= kept.keys():
                memory = Memory(values={name: kept[name] for name in role.objective.memory})
        inputs = (each for each in team.scenario.inputs if each.name in named)
        yield (
            Task(
                member.robot,
                pose,
                rung.objective,
                memory,
                walls,
                tuple(observed(team, state, i)),
                partition=None if cells is None else Partition(cells),
                closed=standing(team, state),
                forbidden=role.forbidden,
                assignable=assigned,
                inputs=tuple((each, each.name in state.inputs) for each in inputs),
                live=team.scenario.clock is Clock.LIVE,
            ),
            rung,
        )


def pursues(team: Team, floor: Floor, state: State, i: int) -> bool:
    """Whether a robot with rivals can pursue its objective alone, past all open obstacles, as its
    poses show; False if only a synthesis can tell."""
    member, robot = team.members[i], team.members[i].robot
    objective = member.objective
    if (
        not member.rivals
        or member.energy is not None
        or robot.tracks
        or robot.when
        or formulas_in(objective) is not None
    ):
        return False
    if objective.strict or objective.literal:
        return False  # it may have another form
    graph, start = floor.graphs[i], 1 << state.robots[i].next
    live = floor.live(i, floor.allowed(i, stages_of(floor, state)))
    here = start & live
    for target in member.targets if here else ():
        here = graph.closure(here, live) & target
    return bool(here)


def outdated(team: Team, state: State, i: int, role: Role, controller: Controller) -> bool:
    """Whether a strategy does not suffice for a role: another objective, or walls or poses unknown
    to it."""
    robot = state.robots[i]
    if not controller.realizable or (robot.node is None and robot.to is None):
        return True  # it has none, or is astray
    if assignable(team, i):
        role = Role(team.members[i].objective)
    if controller.task.objective.relaxed() != role.objective.relaxed():
        return True
    known = {(wall.region, wall.item) for wall in controller.task.blocked}
    walls = {(wall.region, wall.item) for wall in walls_of(team, state, i, role.must)}
    return not walls <= known or not role.forbidden <= controller.task.forbidden


def walls_of(team: Team, state: State, i: int, avoid: frozenset[int]) -> tuple[Known, ...]:
    """The regions beyond the walls that a robot must not plan through."""
    robot = team.members[i].robot
    found = [
        Known(r, f"robots.{robot.name}.objective.avoid", f"{robot.name} avoids it")
        for r in robot.objective.avoid
    ]
    for k, each in enumerate(state.obstacles):
        obstacle = team.obstacles[k]
        if each.state is Is.SEALED and i in obstacle.blocks:
            why = _sealed_words(team, state, k)
            found.append(Known(obstacle.region, f"obstacles.{obstacle.name}", why))
        elif each.state is Is.OPEN and k in avoid and i in obstacle.closed_to[each.stage.need]:
            found.append(
                Known(obstacle.region, f"obstacles.{obstacle.name}", "found, and not resolved yet")
            )
    return tuple(sorted(found, key=lambda known: known.region))


def _sealed_words(team: Team, state: State, k: int) -> str:
    """The reason why a sealed obstacle stays."""
    if not state.obstacles[k].given_up:
        declared = "an operator declared it permanent"
        return "found to be untraversable" if k in state.over else declared
    what = obstacle_words(team.obstacles[k].name, team.world.word)
    if not enough(team, k):
        return f"this team cannot resolve {what}"
    pairs = zip(team.obstacles, state.obstacles, strict=True)
    comes = any(now.state is Is.AWAY or (each.source.goes and now.known) for each, now in pairs)
    return f"no robot can {'' if comes else 'ever '}resolve {what}"


def enough(team: Team, k: int) -> bool:
    """Whether enough robots have the actions of each need of an obstacle."""
    skills = [member.robot.capabilities for member in team.members]
    return all(
        sum(need.skills <= each for each in skills) >= need.robots
        for need in team.obstacles[k].needs
    )
