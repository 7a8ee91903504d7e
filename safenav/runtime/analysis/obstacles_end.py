"""The team's knowledge of obstacles, and its requests, where a trace ends."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct, field

from safenav.begun import Begun
from safenav.trace import records
from safenav.trace.vocabulary import DeadlineVerdict, OperatorIntervention
from safenav.world.moves import Pose


class ObstaclesEnd(Struct):
    """The obstacles at the end of a trace. ``gone``: resolved or disappeared; ``closed``: found
    untraversable; ``asked``: the requests that are open or given up, each with the regions where
    its requesters wait; ``due``: the ticks in which open requests are due; ``late``: requests that
    missed theirs; ``stays``: obstacles that an operator declared permanent; ``given_up``: those
    found never resolvable; ``backs_up``: a robot that backs up, and the obstacle; ``continues``:
    the run continues another one."""

    gone: set[str] = field(default_factory=set)
    appeared: set[str] = field(default_factory=set)
    truths: dict[str, bool | None] = field(default_factory=dict)
    met: dict[str, list[tuple[str, ...]]] = field(default_factory=dict)
    due: dict[str, int] = field(default_factory=dict)
    late: set[str] = field(default_factory=set)
    closed: set[str] = field(default_factory=set)
    asked: dict[str, dict[str, int]] = field(default_factory=dict)
    stays: set[str] = field(default_factory=set)
    given_up: set[str] = field(default_factory=set)
    backs_up: tuple[str, str] | None = None
    continues: bool = False

    @classmethod
    def of(cls, begun: Begun | None) -> ObstaclesEnd:
        """Return the obstacles at the start of a run."""
        if begun is None:
            return cls()
        return cls(
            met={name: [*groups] for name, groups in begun.met.items()},
            due=dict(begun.due),
            late={*begun.late},
            closed={*begun.closed},
            asked={name: {**robots} for name, robots in begun.asked.items()},
            stays={*begun.stays},
            continues=True,
        )

    def take(self, record: records.Record, poses: Mapping[str, Pose]) -> None:
        """Process a line. ``poses``: those of the robots before it."""
        match record:
            case records.Violation():
                self._encountered(record, poses[record.robot].region)
            case records.Operator() if record.intervention is OperatorIntervention.PERMANENT:
                self._forget(record.obstacle or "")
                self.stays.add(record.obstacle or "")
            case records.Resolved():
                found = self.closed if record.traversable is False else self.gone
                found.add(record.obstacle)
                self._forget(record.obstacle)
                self._over(record.obstacle)
            case records.Truth():
                self.truths[record.obstacle] = record.traversable
            case records.Gone():
                self.gone.add(record.obstacle)
                self.closed.discard(record.obstacle)
                self._forget(record.obstacle)
                self._over(record.obstacle)
            case records.KnownObstacle():
                self._over(record.obstacle)
                self.given_up.add(record.obstacle)
            case records.Reopened():
                self.given_up.discard(record.obstacle)
            case records.Appeared():
                if record.tick > 1 or not self.continues:  # else in the earlier run
                    self.met.pop(record.obstacle, None)
                self.gone.discard(record.obstacle)
                self.closed.discard(record.obstacle)
                self._forget(record.obstacle)
                self.appeared.add(record.obstacle)
            case records.Met():
                groups = self.met.setdefault(record.obstacle, [])
                groups.append(record.robots or (record.robot,))
            case records.Deadline() if record.of not in poses:
                self._judged(record)
            case _:
                pass

    def waits(self, robot: str, here: int) -> None:
        """Record the region where a robot waits after it has backed up from an obstacle."""
        if self.backs_up is not None and robot == self.backs_up[0]:
            name, self.backs_up = self.backs_up[1], None
            if robot in self.asked.get(name, ()):
                self.asked[name][robot] = here

    def _encountered(self, record: records.Violation, here: int) -> None:
        """Record a request; permanent obstacles are not requested."""
        name, robot = record.obstacle, record.robot
        if name not in self.closed | self.stays | self.given_up:
            requesters = self.asked.setdefault(name, {})
            requesters.pop(robot, None)
            requesters[robot] = here
            self.backs_up = robot, name

    def _forget(self, obstacle: str) -> None:
        """Discard requests and verdicts on an obstacle that has changed."""
        self.asked.pop(obstacle, None)
        self.stays.discard(obstacle)
        self.given_up.discard(obstacle)

    def _over(self, obstacle: str) -> None:
        """Record that requests for an obstacle have ended."""
        self.due.pop(obstacle, None)
        self.late.discard(obstacle)

    def _judged(self, record: records.Deadline) -> None:
        if record.verdict is DeadlineVerdict.SET:
            if record.cause is None:  # deadlines from a charge are recomputed
                self.due[record.of] = record.due
        elif record.verdict is not DeadlineVerdict.LOST:
            self.due.pop(record.of, None)
            if record.verdict is DeadlineVerdict.LATE:
                self.late.add(record.of)
