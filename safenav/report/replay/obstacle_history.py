"""The obstacles of a replay: the team's knowledge of each, its fulfilled needs, its carriers."""

from __future__ import annotations

from collections.abc import Iterable

from safenav.report.replay.changes import Changes
from safenav.report.replay.robot_paths import ContradictionError, RobotPaths
from safenav.report.replay.timeline import Hidden, ObstacleStatus
from safenav.scenario.model import OPERATOR_ACTION
from safenav.trace import records, setting

ObstacleLine = (
    records.Violation
    | records.Request
    | records.Met
    | records.Resolved
    | records.Reopened
    | records.KnownObstacle
    | records.ObstacleChange
)


class ObstacleHistory:
    """The obstacles up to the last line taken: their statuses, the number of fulfilled needs
    (``met``), and the carriers (``loads``) of each."""

    def __init__(
        self,
        listed: Iterable[setting.ObstacleHeader],
        found: Iterable[setting.ObstacleHeader],
        paths: RobotPaths,
    ) -> None:
        self._paths = paths
        self.hidden: dict[str, Hidden] = {}
        self.statuses: dict[str, Changes[ObstacleStatus]] = {}
        self.loads: dict[str, Changes[tuple[str, ...]]] = {}
        self.met: dict[str, Changes[int]] = {}
        self._acts: dict[int, int] = {}
        for each in listed:
            if each.name not in self.hidden:
                self._add(each)
            elif each.from_ is None:  # one of several that appear in a region one after the other
                self.statuses[each.name] = Changes.of(ObstacleStatus.HIDDEN)
        for each in found:
            if each.name not in self.hidden:
                self._add(each)
                if any(need.action == OPERATOR_ACTION for need in each.all_needs):  # a failure
                    self.statuses[each.name] = Changes.of(ObstacleStatus.ABSENT)

    def _add(self, obstacle: setting.ObstacleHeader) -> None:
        self.hidden[obstacle.name] = hidden = self._hidden(obstacle)
        first = ObstacleStatus.ABSENT if obstacle.from_ else ObstacleStatus.HIDDEN
        self.statuses[hidden.name] = Changes.of(first)
        self.loads[hidden.name] = Changes.of(())
        self.met[hidden.name] = Changes.of(0)

    def _hidden(self, obstacle: setting.ObstacleHeader) -> Hidden:
        return Hidden(
            obstacle.name,
            obstacle.type,
            self._paths.on_map(obstacle.region),
            tuple(need.action for need in obstacle.all_needs),
            tuple(map(self._paths.on_map, obstacle.resolution_regions)),
            tuple(robot for robot in self._paths.tracks if robot in obstacle.blocks),
            tuple(need.same is True for need in obstacle.all_needs[1:]),
            obstacle.ordered is True,
        )

    def take(self, line: records.Record) -> None:
        """Take a line of the trace; only lines about obstacles change anything."""
        match line:
            case records.Discovered():
                name = line.obstacle.name
                if name not in self.hidden:  # a live run, read line by line
                    self._add(line.obstacle)
                if OPERATOR_ACTION in self.hidden[name].actions:
                    self.statuses[name].append((line.tick, ObstacleStatus.HIDDEN))
            case records.Violation() | records.Reopened():
                self._status(line, ObstacleStatus.FOUND)
            case records.Request():
                if line.helper is not None:
                    self._status(line, ObstacleStatus.REQUESTED)
                elif self.statuses[self._known(line).name].now is ObstacleStatus.HIDDEN:
                    self._status(line, ObstacleStatus.FOUND)  # an order without a helper yet
            case records.Act():
                self._acts[line.command] = line.tick
            case records.ActionEnd(results=results):  # its results can name undiscovered obstacles
                begun = self._acts.pop(line.command, line.tick)
                for name in results:
                    self._seen(name, begun)
            case records.Met():
                self._seen(self._known(line).name, line.tick)
                carried = self._known(line).carried
                if line.need < len(carried) and carried[line.need]:
                    carriers = line.robots or (line.robot,)
                    self.loads[line.obstacle].append((line.tick, carriers))
                else:
                    self.loads[line.obstacle].put(line.tick, ())
                self.met[line.obstacle].put(line.tick, line.need + 1)
            case records.Resolved():
                needs = len(self._known(line).actions)
                self.met[line.obstacle].put(line.tick, needs)
                untraversable = line.traversable is False
                status = ObstacleStatus.BLOCKED if untraversable else ObstacleStatus.RESOLVED
                self._status(line, status)
                self.loads[line.obstacle].put(line.tick, ())
            case records.KnownObstacle():
                self._status(line, ObstacleStatus.BLOCKED)
            case records.Appeared():
                self._status(line, ObstacleStatus.HIDDEN)
                self.met[line.obstacle].put(line.tick, 0)  # it may have disappeared before
            case records.Gone():
                self._status(line, ObstacleStatus.ABSENT)
                self.loads[line.obstacle].put(line.tick, ())

    def _seen(self, name: str, tick: int) -> None:
        """A robot acts on an obstacle, so it is not hidden, even if no robot has requested it."""
        if name in self.hidden and self.statuses[name].now is ObstacleStatus.HIDDEN:
            self.statuses[name].append((tick, ObstacleStatus.FOUND))

    def _known(self, line: ObstacleLine) -> Hidden:
        if line.obstacle not in self.hidden:
            raise ContradictionError(f"the header has no obstacle {line.obstacle}")
        return self.hidden[line.obstacle]

    def _status(self, line: ObstacleLine, status: ObstacleStatus) -> None:
        self.statuses[self._known(line).name].append((line.tick, status))
