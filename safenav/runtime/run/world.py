"""The world of a run as numbered events: its commands, and what becomes of them.

A simulated world and a real one answer the same commands (``runtime.worlds.commands``), so the team
learns of an obstacle only what a robot notices. In lockstep a pass is a tick, in which each robot
in turn moves or continues; a step of one tick has ended when ``start`` returns. In a live run a
pass is an instant at which something ends, after which each idle robot has its turn.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from safenav.outcome import Outcome
from safenav.runtime.run.decide import Proposal
from safenav.runtime.worlds import protocol
from safenav.runtime.worlds.adapter import BlockingAdapter
from safenav.runtime.worlds.commands import Commands
from safenav.runtime.worlds.live_simulation import LiveSimulation
from safenav.runtime.worlds.truth import SimulatedWorld
from safenav.runtime.worlds.world import Change
from safenav.scenario import model
from safenav.team import state as now
from safenav.team.apply import acts_on, resolved
from safenav.team.floor import occupied, standing
from safenav.team.state import State
from safenav.team.team import Team
from safenav.trace.vocabulary import ActResult
from safenav.world.poses import bits


class Running(Protocol):
    """The run to which events are reported, as it is at this moment."""

    @property
    def team(self) -> Team: ...
    @property
    def state(self) -> State: ...


class World:
    """``moving``: whether robots in transit still act in the region that they leave; ``limit``:
    when the run ends at the latest, and with which outcome."""

    def __init__(
        self, scenario: model.Scenario, world: protocol.World | protocol.BlockingWorld
    ) -> None:
        truth = world.truth if isinstance(world, LiveSimulation) else world
        self._truth = truth if isinstance(truth, SimulatedWorld) else None
        if not protocol.implements(world, protocol.World):
            world = BlockingAdapter(world, scenario)  # type: ignore[arg-type]
        self.commands, limits = Commands(world, scenario), scenario.limits
        self.live = self.commands.live
        self.moving = not self.live
        self.limit = (float(limits.ticks), Outcome.TICK_LIMIT)
        if self.live:
            seconds = float("inf") if limits.seconds is None else limits.seconds
            self.limit = (seconds, Outcome.TIME_LIMIT)
        self._last: State | None = None
        self._asked: set[int] = set()
        self._found: dict[int, protocol.Acted] = {}

    def wait(self, run: Running) -> Iterator[now.Event]:
        """What happens next, and whose turn it is; nothing if nothing will ever happen. Each event
        is read when those before it have been applied."""
        commands = self.commands
        if self.live:
            changed, self._last = run.state != self._last, run.state
            due = self.coming(run)
            if not changed and commands.simulated and commands.idle and due is None:
                return
            if not commands.hear(due, changed):
                return
        else:
            commands.hear(None, True)
        yield now.Time(commands.now())
        regions = set(bits(occupied(run.team, run.state)))
        for change in commands.changes(regions):
            yield from self._changed(run, change)
        if self.live:
            for i, member in enumerate(run.team.members):
                yield from self._ended(run, i, member.robot)
        for i, member in enumerate(run.team.members):
            if not self.live and run.state.robots[i].to is not None:
                ended = commands.ended(member.robot)
                yield from (now.Goes(i),) if ended is None else self._arrived(run, i, ended)
            else:
                yield now.Turn(i, None if self.live else 1)

    def _ended(self, run: Running, i: int, robot: model.Robot) -> Iterator[now.Event]:
        """The end of a robot's command in a live run, if it has ended."""
        if run.state.robots[i].to is not None:
            ended = self.commands.ended(robot)
            yield from () if ended is None else self._arrived(run, i, ended)
        elif run.state.robots[i].acting == i:
            acted = self.commands.acted(robot)
            yield from () if acted is None else self._acted(run, i, acted)

    def _arrived(self, run: Running, i: int, ended: protocol.Ended) -> Iterator[now.Event]:
        match ended:
            case protocol.Arrived():
                yield now.Arrived(i)
            case protocol.Elsewhere(pose=pose):
                yield now.Elsewhere(i, run.team.members[i].graph.number(pose))
            case protocol.Blocked(pose=pose, obstacle=model.Obstacle() as obstacle):
                target = run.state.robots[i].next
                yield now.Elsewhere(i, run.team.members[i].graph.number(pose))
                yield from self.noticed(run, obstacle)
                yield now.Met(i, number_of(run, obstacle), target)

    def noticed(self, run: Running, obstacle: model.Obstacle) -> Iterator[now.Event]:
        """The events by which an obstacle that somebody noticed joins the team's obstacles."""
        if obstacle.name not in run.team.numbers:
            yield now.Introduced(obstacle)

    def _changed(self, run: Running, change: Change) -> Iterator[now.Event]:
        if change.appeared:
            yield from self.noticed(run, change.obstacle)
            yield now.Appeared(number_of(run, change.obstacle), change.truth, change.another)
        elif change.obstacle.name in run.team.numbers:
            yield now.Gone(number_of(run, change.obstacle))

    # Commands.

    def sense(self, run: Running, i: int, region: int) -> model.Obstacle | None:
        """The obstacle that a robot notices in a region beside it."""
        return self.commands.sense(run.team.members[i].robot, region)

    def start(self, run: Running, i: int, step: Proposal) -> Iterator[now.Event]:
        """Command a step: its departure, and its end if it takes no time."""
        graph, robot = run.team.members[i].graph, run.team.members[i].robot
        self._asked.discard(i)
        self._found.pop(i, None)
        here = graph.pose(run.state.robots[i].pose)
        ended = self.commands.start(robot, here, graph.pose(step.pose))
        yield now.Departed(i, step.pose, step.by, step.node, under_way=ended is None)
        if ended is not None:
            yield from self._arrived(run, i, ended)

    def reaches(self, run: Running, i: int) -> bool:
        """Whether a robot would change something by acting where it stands."""
        robot = run.team.members[i].robot
        if not robot.capabilities or run.state.robots[i].acting is not None:
            return False
        if run.state.robots[i].to is not None and not self.moving:
            return False
        known = self._known(run, i)
        if self._changes(run, i):
            return True
        if not self.live:
            reached = self.commands.within_reach(robot, known)
            if reached is not None:
                return reached
        if i in self._asked:
            return i in self._found
        self._asked.add(i)  # only acting shows it
        here = run.team.members[i].graph.pose(run.state.robots[i].pose)
        if self.live:
            return self.commands.simulated
        event = self.commands.act(robot, here, known)
        if event is not None and event.found:
            self._found[i] = event
        return i in self._found

    def act(self, run: Running, i: int) -> Iterator[now.Event]:
        """Command an action: its results, or that it is under way."""
        robot, graph = run.team.members[i].robot, run.team.members[i].graph
        event = self._found.pop(i, None)
        if event is None:
            here = graph.pose(run.state.robots[i].pose)
            self._asked.add(i)
            event = self.commands.act(robot, here, self._known(run, i))
        if event is None:
            yield now.Acts(i, self._group(run, i))
        else:
            yield from self._acted(run, i, event)

    def _acted(self, run: Running, i: int, event: protocol.Acted) -> Iterator[now.Event]:
        """The results of an action: earlier needs follow from where robots stand, the last one only
        from what the world reports."""
        for obstacle, _ in event.found:
            yield from self.noticed(run, obstacle)
        team, stages, truths = run.team, dict(self._changes(run, i)), dict[int, bool | None]()
        if self._truth is not None:
            stages = {number_of(run, obstacle): stage for obstacle, stage in self._truth.parts()}
        reported = {number_of(run, obstacle): result for obstacle, result in event.found}
        failed = tuple(
            k
            for k, stage in stages.items()
            if resolved(team, k, stage) and reported.get(k) is not ActResult.DONE
        )
        for k, result in reported.items():
            if result in (ActResult.DONE, ActResult.UNTRAVERSABLE):
                has_truth = team.obstacles[k].source.type.has_truth
                done = result is ActResult.DONE
                truths[k] = (done if has_truth else None) if done else False
                stages[k] = now.Stage(len(team.obstacles[k].needs))
        gone = tuple(k for k, result in reported.items() if result is ActResult.NOTHING)
        kept = tuple((k, s) for k, s in stages.items() if k in truths or k not in failed)
        failed = tuple(k for k in failed if k not in truths and k not in gone)
        yield now.Acted(i, kept, tuple(truths.items()), failed)
        yield from map(now.Gone, gone)

    def _changes(self, run: Running, i: int) -> tuple[tuple[int, now.Stage], ...]:
        where = standing(run.team, run.state, moving=self.moving)
        return acts_on(run.team, run.state, where, i)

    def _known(self, run: Running, i: int) -> list[model.Obstacle]:
        """The known obstacles on which a robot acts: in a live run where it stands, else all."""
        if self.live:
            return [run.team.obstacles[k].source for k, _ in self._changes(run, i)]
        pairs = zip(run.team.obstacles, run.state.obstacles, strict=True)
        return [each.source for each, there in pairs if there.known]

    def _group(self, run: Running, i: int) -> tuple[int, ...]:
        """The robots that are busy while a robot acts: those that take part."""
        team, state, group = run.team, run.state, {i}
        for k, _ in self._changes(run, i):
            need = team.obstacles[k].needs[state.obstacles[k].stage.need]
            if need.together:
                group |= {
                    j
                    for j, robot in enumerate(state.robots)
                    if robot.idle
                    and need.regions >> robot.pose % team.size & 1
                    and need.skills <= team.members[j].robot.capabilities
                }
        return tuple(sorted(group))

    def coming(self, run: Running) -> float | None:
        """When the scenario changes something next, within its limits."""
        most = run.team.scenario.limits.ticks
        times = (time for time in self.commands.times() if run.state.time < time <= most)
        return min(times, default=None)


def number_of(run: Running, obstacle: model.Obstacle) -> int:
    """The number of an obstacle that a world reports: of those with its name that of this obstacle,
    else of the first that is not over, else of the last."""
    numbers = run.team.numbers[obstacle.name]
    for k in numbers:
        if run.team.obstacles[k].source == obstacle:
            return k
    there = (k for k in numbers if run.state.obstacles[k].state is not now.Is.OVER)
    return next(there, numbers[-1])
