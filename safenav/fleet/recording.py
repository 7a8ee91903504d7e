"""A drive as it was: what each robot was sent, and where its odometry had it, with both clocks.

Times are on the clock of the world; positions in the frame of the world.
"""

from __future__ import annotations

from msgspec import Struct, field

from safenav.fleet.transport import GoalEnded, GoalPoint, Located, Message


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

    def sent(self, robot: str, goal: GoalPoint, now: float) -> None:
        """A robot is sent to a goal, in place of the one that it has."""
        before = self._newest(robot)
        if before is not None and before.ended is None:
            before.ended = now
        self.goals.append(SentGoal(robot, goal, now))

    def heard(self, message: Message, now: float) -> None:
        """Take a message as it comes, in the transport's thread: a mission that thinks does not
        make it late."""
        if isinstance(message, Located):
            self.places.setdefault(message.robot, []).append((now, message))
        elif isinstance(message, GoalEnded):
            sent = self._newest(message.robot)
            if sent is not None and sent.goal.number == message.number and sent.ended is None:
                sent.ended, sent.end = now, message.end.value

    def _newest(self, robot: str) -> SentGoal | None:
        return next((goal for goal in reversed(self.goals) if goal.robot == robot), None)
