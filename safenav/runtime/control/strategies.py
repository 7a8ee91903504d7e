"""Strategies: a robot's specification for its role, and the result of slugs; its observations; the
commands of an assignable robot.

If goals are assigned at run time (the paper's alternative to resynthesis), a robot keeps its
strategy. Inputs command it to wait or go to a region, around known obstacles that the strategy does
not contain. The strategy's node determines the command, so no other state is kept.
"""

from collections.abc import Iterator, Mapping

from msgspec import Struct

from safenav.errors import Verdict
from safenav.plan.order import closed
from safenav.runtime.control.answers import Answers, Pending
from safenav.runtime.control.roles import Role
from safenav.scenario.objective import Objective, Word, describe, formulas_in
from safenav.spec import assignable
from safenav.spec import task as tasks
from safenav.spec.belief import known_of, observe, watch_for
from safenav.spec.compile import compile_task
from safenav.spec.guarantees import values_of
from safenav.synthesis.slugs import SynthesisResult
from safenav.team import state as now
from safenav.team.floor import Floor
from safenav.team.formulas import targets_of
from safenav.team.known import floor_now, stages_of
from safenav.team.state import Is, State, Values
from safenav.team.team import Team, without_memory
from safenav.trace.vocabulary import Form
from safenav.trace.words import obstacle_words
from safenav.world.map import Region
from safenav.world.poses import FAR, Mask, bits, region_mask

Step = tuple[int, int]
"""A pose, and the strategy's node there."""


class Controller(Struct, frozen=True, eq=False):
    """The strategy of a robot for a task. ``asked``: the objective; ``form``: its form in the task;
    ``node``: the first node of the strategy."""

    task: tasks.Task
    asked: Objective
    rung: tasks.ObjectiveForm
    result: SynthesisResult

    @property
    def realizable(self) -> bool:
        return self.result.verdict is Verdict.REALIZABLE

    @property
    def form(self) -> Form:
        if self.rung.objective != self.asked:
            return Form.ALTERNATION
        return Form.OTHER_MEMORY if self.rung.weakening is tasks.Weakening.TURNED else Form.LITERAL

    def allows(self, word: Word) -> str | None:
        """Return, in words, how and why the form is weaker than the objective; None for the
        strongest form."""
        return tasks.concession(self.asked, self.rung, word)

    def words(self, word: Word) -> str:
        """Return the objective in the user's words, in the task's form."""
        allows = self.allows(word)
        return describe(self.asked, word) + (f" ({allows})" if allows else "")

    @property
    def node(self) -> int | None:
        strategy = self.result.strategy
        return None if strategy is None else strategy.find_initial(values_of(self.task.pose))

    def step(self, node: int, heard: Mapping[str, int], size: int) -> Step | None:
        """Return the strategy's step for these inputs, or None. ``size``: the size of the map."""
        strategy = self.result.strategy
        assert strategy is not None
        for after in strategy.successors_for(node, heard):
            values = strategy.values(after)
            return values["region"] + size * values.get("heading", 0), after
        return None

    def values(self, node: int | None) -> Values | None:
        """Return the values at a node: of the formulas' memory and their inputs; None if there are
        none."""
        objective, strategy = self.task.objective, self.result.strategy
        names = (*objective.memory, *objective.inputs)
        if node is None or strategy is None or not names:
            return None
        found = strategy.values(node)
        return tuple(sorted((name, found[name]) for name in names))


Candidate = tuple[tasks.Task, tasks.ObjectiveForm]
"""A task and the form of its robot's objective in it."""


def synthesized(
    team: Team, state: State, roles: Mapping[int, Role], answers: Answers
) -> dict[int, Controller]:
    """Return, for each robot, the strategy for its role in the strongest realizable form, or the
    verdict on the last form. All are synthesized simultaneously. Raises Pending."""
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
            asked = task.robot.objective if task.assignable else roles[i].objective
            found[i] = Controller(task, asked, rung, result)
            if found[i].realizable:
                del left[i]
        if waiting:
            raise Pending(frozenset(waiting))
    return found


def candidates(team: Team, state: State, i: int, role: Role) -> Iterator[Candidate]:
    """Yield the tasks for a role, the strongest form first."""
    member, robot, assigned = team.members[i], state.robots[i], team.assignable(i)
    if assigned:
        role = Role(member.objective)  # the strategy serves all assignments
    own, pose = role.objective == member.objective, member.graph.pose(robot.next)
    walls = walls_of(team, state, i, role.avoid)
    for rung in tasks.forms(
        role.objective,
        robot.own.turn(role.objective.pursuit) if own else 0,
        pose,
        member.graph,
        region_mask(known.region for known in walls),
        planned=member.planned,
        assigned=assigned,
    ):
        kept, names = dict(robot.values), role.objective.memory
        values = {name: kept[name] for name in names if names.keys() <= kept.keys()}
        memory = tasks.Memory(rung.turn, values)
        inputs = (each for each in team.scenario.inputs if each.name in role.objective.inputs)
        yield (
            tasks.Task(
                member.robot,
                pose,
                rung.objective,
                memory,
                walls,
                tuple(observed(team, state, i)),
                partition=team.scenario.partition,
                closed=standing(team, state),
                forbidden=role.forbidden,
                assignable=assigned,
                inputs=tuple((each, each.name in state.inputs) for each in inputs),
                live=team.live,
            ),
            rung,
        )


def pursues(team: Team, floor: Floor, state: State, i: int) -> bool:
    """Return whether poses show that a robot with rivals can pursue its objective alone past all
    open obstacles. Otherwise a synthesis must decide."""
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
        return False  # the objective may have another form
    graph, start = floor.graphs[i], 1 << state.robots[i].next
    live = floor.live(i, floor.allowed(i, stages_of(floor, state)))
    here = start & live
    for target in member.targets if here else ():
        here = graph.closure(here, live) & target
    return bool(here)


def shown_by_poses(team: Team, state: State, roles: Mapping[int, Role]) -> dict[int, Controller]:
    """Return controllers without a strategy for the robots that need none (``pursues``)."""
    plain, here = without_memory(team, state)
    floor, found = floor_now(plain, here), dict[int, Controller]()
    for i, role in roles.items():
        if pursues(team, floor, here, i):
            name, (task, rung) = team.members[i].name, next(candidates(team, state, i, role))
            proven = SynthesisResult(name, Verdict.REALIZABLE, 0.0, False, "")
            found[i] = Controller(task, role.objective, rung, proven)
    return found


def outdated(team: Team, state: State, i: int, role: Role, controller: Controller) -> bool:
    """Return whether a strategy does not suffice for a role: it has another objective, or lacks
    walls or forbidden poses."""
    robot = state.robots[i]
    if not controller.realizable or (robot.node is None and robot.to is None):
        return True  # the robot has no strategy or has left it
    if team.assignable(i):
        role = Role(team.members[i].objective)
    if controller.task.objective.relaxed() != role.objective.relaxed():
        return True
    known = {(wall.region, wall.item) for wall in controller.task.blocked}
    walls = {(wall.region, wall.item) for wall in walls_of(team, state, i, role.must)}
    return not walls <= known or not role.forbidden <= controller.task.forbidden


def walls_of(team: Team, state: State, i: int, avoid: frozenset[int]) -> tuple[tasks.Known, ...]:
    """Return the closed regions in a robot's specification, except walls, each with the reason."""
    robot = team.members[i].robot
    found = [
        tasks.Known(r, f"robots.{robot.name}.objective.avoid", f"{robot.name} avoids it")
        for r in robot.objective.avoid
    ]
    for k, each in enumerate(state.obstacles):
        obstacle = team.obstacles[k]
        if not obstacle.closes(i, each):
            continue
        if each.state is Is.SEALED:
            why = _sealed_words(team, state, k)
            found.append(tasks.Known(obstacle.region, f"obstacles.{obstacle.name}", why))
        elif each.state is Is.OPEN and k in avoid:
            found.append(
                tasks.Known(
                    obstacle.region, f"obstacles.{obstacle.name}", "found, and not resolved yet"
                )
            )
    return tuple(sorted(found, key=lambda known: known.region))


def _sealed_words(team: Team, state: State, k: int) -> str:
    """Return, in words, the reason why an obstacle is permanent."""
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
    """Return whether the team has enough robots with the actions of each need of an obstacle."""
    skills = [member.robot.capabilities for member in team.members]
    return all(
        sum(need.skills <= each for each in skills) >= need.robots
        for need in team.obstacles[k].needs
    )


def observed(team: Team, state: State, i: int) -> Iterator[tasks.Observed]:
    """Yield a robot's knowledge of each robot that its strategy tracks."""
    known, me = dict(state.robots[i].known), team.members[i]
    for j, member in enumerate(team.members if not me.planned else ()):
        if member.name in me.robot.tracks:
            other = state.robots[j]
            here = other.next % team.size
            found = known.get(j, here)
            seen, belief = (here, found) if isinstance(found, frozenset) else (found, None)
            yield tasks.Observed(member.name, seen, belief=belief)


def standing(team: Team, state: State) -> frozenset[int]:
    """Return the regions of the known obstacles, which block the view."""
    pairs = zip(team.obstacles, state.obstacles, strict=True)
    return frozenset(obstacle.region for obstacle, each in pairs if each.stands)


def heard(team: Team, state: State, i: int, task: tasks.Task) -> dict[str, int]:
    """Return the present values of the inputs of a robot's strategy."""
    robot, places = state.robots[i], {m.name: j for j, m in enumerate(team.members)}
    at = {each.name: state.robots[places[each.name]].pose % team.size for each in task.observed}
    known = {name: dict(robot.known).get(places[name], at[name]) for name in at}
    found = observe(task, team.world, known)
    return found | {each.name: int(each.name in state.inputs) for each, _ in task.inputs}


def looked(team: Team, state: State, i: int, task: tasks.Task) -> now.Looked | None:
    """Return a robot's knowledge of other robots after an observation; None if it tracks none."""
    if not task.observed:
        return None
    watch, before = watch_for(task, team.world), dict(state.robots[i].known)
    own, found = state.robots[i].pose % team.size, []
    names = [member.name for member in team.members]
    for other in task.observed:
        j = names.index(other.name)
        there, known = state.robots[j].pose % team.size, before.get(j, known_of(other))
        found.append((j, watch.look(own, there, known)))
    places = tuple(frozenset(watch.possible(known)) for _, known in found)
    return now.Looked(i, tuple(found), places)


MOST_STEPS = 40
"""Maximum number of steps of a strategy that ``leads`` follows, since the strategy may first meet
its previous goal."""


def commanded(
    team: Team, state: State, i: int, role: Role, found: Controller, safe: Mask | None
) -> Step | None:
    """Return the step of a robot's strategy under the first command that leads the robot toward its
    goal. If there is none, a strategy that has just begun waits; any other one is replaced (None).
    ``safe``: the poses in which the team can continue (None: any)."""
    robot, member, task = state.robots[i], team.members[i], found.task
    node, strategy = robot.node, found.result.strategy
    assert node is not None and strategy is not None
    before, graph = strategy.values(node), member.graph
    possible = assignable.assignable_regions(task, team.world)
    own, none = role.objective == member.objective, assignable.own(team.world)
    others, shut, here = heard(team, state, i, task), closed(team, state, i), before["region"]

    def under(place: int, node: int) -> Step | None:
        return found.step(node, others | {"assigned": place}, team.size)

    free = member.floor & ~graph.on(shut) & (-1 if safe is None else safe)
    free_or_here = free | 1 << robot.pose  # the robot may be in an obstacle
    goal = _goal(team, state, i, role) & free_or_here
    if own and (not shut or goal >> robot.pose & 1):
        return under(none, node)
    field = graph.distances(goal, free_or_here)

    def leads(step: Step | None, place: int) -> bool:
        """Return whether this step, or the strategy's next ones, lead nearer to the goal."""
        for _ in range(MOST_STEPS):
            if step is None or not free >> step[0] & 1:
                return False
            if field[step[0]] < field[robot.pose]:
                return True
            step = under(place, step[1])
        return False

    if not 0 < field[robot.pose] < FAR:
        return under(here, node)
    nearest = graph.regions_of(graph.nearest(robot.pose, goal, free_or_here))

    def near(region: Region) -> tuple[int, bool, Region]:
        """Return the sort key of a region: its number of steps to the goal, whether other regions
        of the goal are nearer, and its index."""
        steps = min(field[pose] for pose in bits(graph.on({region})))
        return steps, not nearest >> region & 1, region

    places, now = [before["assigned"]], (graph.pose(robot.pose), robot.values)
    if places[0] in (none, here):
        places = [
            place for place in sorted(possible.places, key=near) if possible.allows(now, place)
        ]
        places = [none, *places] if own else [*places, none]
    for place in places:
        if leads(step := under(place, node), place):
            return step
    return under(here, node) if node == found.node else None


def _goal(team: Team, state: State, i: int, role: Role) -> Mask:
    """Return the poses one of which the robot must reach next."""
    member, robot = team.members[i], state.robots[i]
    own = role.objective == member.objective
    return member.awaited(robot.own.memory) if own else targets_of(role.objective, member.graph)[0]
