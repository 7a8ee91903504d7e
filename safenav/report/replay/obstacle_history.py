"""The obstacles of a replay: what the team knows of each, its met needs, and who carries it."""

from __future__ import annotations

from collections.abc import Iterable

from msgspec.structs import replace

from safenav.begun import Begun
from safenav.report.replay.robot_paths import ContradictionError, RobotPaths
from safenav.report.replay.timeline import Hidden, ObstacleStatus
from safenav.trace import records, setting
from safenav.trace.vocabulary import OPERATOR_ACTION

ObstacleLine = (
    records.Violation
    | records.Request
    | records.Resolved
    | records.Reopened
    | records.KnownObstacle
    | records.ObstacleChange
)


class ObstacleHistory:
    """The obstacles as far as the lines tell, each value with the tick from which it holds.
    ``met``: how many needs of an obstacle with several are met; ``loads``: its carriers."""

    def __init__(self, found: Iterable[setting.ObstacleHeader], paths: RobotPaths) -> None:
        self._paths = paths
        self.hidden = {each.name: self._hidden(each) for each in found}
        self.statuses: dict[str, list[tuple[int, ObstacleStatus]]] = {n: [] for n in self.hidden}
        self.loads: dict[str, list[tuple[int, tuple[str, ...]]]] = {}
        self.met: dict[str, list[tuple[int, int]]] = {}

    def begin(self, begun: Begun) -> None:
        """Take over what the run continues."""
        for name in begun.asked:
            if name in self.statuses:
                self.statuses[name].append((-1, ObstacleStatus.FOUND))
        for name in begun.closed:
            if name in self.statuses:
                self.statuses[name].append((-1, ObstacleStatus.BLOCKED))
                self.met[name] = [(-1, len(self.hidden[name].actions))]
        for name, groups in begun.met.items():
            self.met[name] = [(-1, len(groups))]
            if name in self.hidden and self.hidden[name].carried[len(groups) - 1]:
                self.loads[name] = [(-1, groups[-1])]

    def _hidden(self, obstacle: setting.ObstacleHeader) -> Hidden:
        return Hidden(
            obstacle.name,
            obstacle.type,
            self._paths.on_map(obstacle.region),
            tuple(need.action for need in obstacle.all_needs),
            tuple(map(self._paths.on_map, obstacle.resolution_regions)),
            tuple(robot for robot in self._paths.tracks if robot in obstacle.blocks),
            obstacle.from_ or 0,
            tuple(need.same is True for need in obstacle.all_needs[1:]),
        )

    def take(self, line: records.Record) -> None:
        """Take a line about an obstacle; others change nothing."""
        match line:
            case records.Discovered():
                found = self._hidden(line.obstacle)
                if OPERATOR_ACTION in found.actions:  # it stands for a failure: it was not there
                    self.hidden[found.name] = replace(found, since=line.tick)
                self.hidden.setdefault(found.name, found)
                self.statuses.setdefault(found.name, [])
            case records.Violation() | records.Reopened():
                self._status(line, ObstacleStatus.FOUND)
            case records.Request():
                known_as = self.statuses.get(line.obstacle, ())
                if line.helper is not None:
                    self._status(line, ObstacleStatus.REQUESTED)
                elif not known_as or known_as[-1][1] is ObstacleStatus.HIDDEN:
                    self._status(line, ObstacleStatus.FOUND)  # an order that has to wait
            case records.Met():
                self._carried(line)
                self._met(line, line.need + 1)
            case records.Resolved():
                self._put_down(line)
                known = self.hidden.get(line.obstacle)
                self._met(line, 0 if known is None else len(known.actions))
                untraversable = line.traversable is False
                status = ObstacleStatus.BLOCKED if untraversable else ObstacleStatus.RESOLVED
                self._status(line, status)
            case records.KnownObstacle():
                self._status(line, ObstacleStatus.BLOCKED)
            case records.Appeared():
                self._appear(line)
            case records.Gone():
                self._put_down(line)
                self._status(line, ObstacleStatus.RESOLVED)

    def _carried(self, line: records.Met) -> None:
        known = self.hidden.get(line.obstacle)
        if known is not None and line.need < len(known.carried) and known.carried[line.need]:
            robots = line.robots or (line.robot,)
            self.loads.setdefault(line.obstacle, []).append((line.tick, robots))
        else:
            self._put_down(line)

    def _met(self, line: ObstacleLine | records.Met, needs: int) -> None:
        told = self.met.setdefault(line.obstacle, [])
        if not told or told[-1][1] != needs:
            told.append((line.tick, needs))

    def _put_down(self, line: records.Met | records.Resolved | records.Gone) -> None:
        told = self.loads.get(line.obstacle, [])
        if told and told[-1][1]:
            told.append((line.tick, ()))

    def _appear(self, line: records.Appeared) -> None:
        self._status(line, ObstacleStatus.HIDDEN)
        if line.obstacle in self.met:  # it is back
            self._met(line, 0)
        known = self.hidden[line.obstacle]
        if known.since > 0 and len(self.statuses[line.obstacle]) == 1:
            self.hidden[line.obstacle] = replace(known, since=line.tick)

    def _status(self, line: ObstacleLine, status: ObstacleStatus) -> None:
        if line.obstacle not in self.hidden:
            raise ContradictionError(f"the header has no obstacle {line.obstacle}")
        self.statuses[line.obstacle].append((line.tick, status))
