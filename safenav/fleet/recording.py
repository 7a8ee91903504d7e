"""A drive as it was: what each robot was sent, and where its odometry had it, with both clocks.

Between the fleet's world and a transport. Times are on the clock of the world; positions in the
frame of the world.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from msgspec import Struct, field

from safenav.fleet.transport import GoalEnded, GoalPoint, Located, Message, Transport

if TYPE_CHECKING:
    from safenav.fleet.setpoints import Setpoints


class SentGoal(Struct):
    """A goal of a robot that finds its own way; ``ended``: None while it is under way."""

    robot: str
    goal: GoalPoint
    begun: float
    ended: float | None = None
    end: str = "replaced"


class DriveRecording(Struct):
    """``places``: odometry of each robot and when it was heard, in the order of hearing."""

    places: dict[str, list[tuple[float, Located]]] = field(default_factory=dict)
    goals: list[SentGoal] = field(default_factory=list)


class RecordedTransport:
    """A transport whose goals and odometry are recorded when they pass. Messages are dated as they
    come, in the transport's thread: a mission that thinks does not make them late."""

    def __init__(
        self, inner: Transport, clock: Callable[[], float], recording: DriveRecording
    ) -> None:
        self._inner = inner
        self._clock = clock
        self._recording = recording
        self._under_way: dict[str, SentGoal] = {}

    def open(self, post: Callable[[Message], None]) -> None:
        def heard(message: Message) -> None:
            if isinstance(message, Located):
                kept = self._recording.places.setdefault(message.robot, [])
                kept.append((self._clock(), message))
            elif isinstance(message, GoalEnded):
                self._ended(message)
            post(message)

        self._inner.open(heard)

    def _ended(self, message: GoalEnded) -> None:
        sent = self._under_way.get(message.robot)
        if sent is not None and sent.goal.number == message.number and sent.ended is None:
            sent.ended, sent.end = self._clock(), message.end.value

    def missing(self) -> list[str]:
        return self._inner.missing()

    def navigate(self, robot: str, goal: GoalPoint) -> None:
        before = self._under_way.get(robot)
        if before is not None and before.ended is None:
            before.ended = self._clock()
        sent = self._under_way[robot] = SentGoal(robot, goal, self._clock())
        self._recording.goals.append(sent)
        self._inner.navigate(robot, goal)

    def follow(self, robot: str, reference: Setpoints) -> None:
        self._inner.follow(robot, reference)

    def cancel(self, robot: str) -> None:
        self._inner.cancel(robot)

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        self._inner.perform(robot, action, obstacle, number)

    def close(self) -> None:
        self._inner.close()
