"""The paper's Patrol read literally, for one robot alone.

A target is left at once, and the one whose turn it is not is never touched. Where that cannot be
kept a scenario is refused before the start, with a message that offers ``visit``; after a detour
robots alternate instead.
"""

from campaigns.judge.mission import Mission, Pose, Robot

State = tuple[Pose, int]
"""A pose, and the target that is next."""


def can_patrol(mission: Mission, robot: Robot) -> bool:
    """Whether the robot can keep the formula for ever, whichever target it begins with."""
    return all(lives(mission, robot, (robot.start, first)) for first in range(2))


def lives(mission: Mission, robot: Robot, begin: State) -> bool:
    reached = {begin}
    pending = [begin]
    after: dict[State, list[tuple[State, bool]]] = {}
    while pending:
        state = pending.pop()
        after[state] = _steps(mission, robot, state)
        for to, _ in after[state]:
            if to not in reached:
                reached.add(to)
                pending.append(to)
    kept = reached
    while True:
        good = {s for s in kept if any(met and to in kept for to, met in after[s])}
        grown = True
        while grown:
            more = {s for s in kept - good if any(to in good for to, _ in after[s])}
            grown = bool(more)
            good |= more
        if good == kept:
            return begin in kept
        kept = good


def _steps(mission: Mission, robot: Robot, state: State) -> list[tuple[State, bool]]:
    """The states one step on, and whether the step meets the target that is next."""
    pose, next_ = state
    found = []
    for to in [pose, *mission.steps(robot, pose)]:
        if to[0] in robot.targets[1 - next_]:
            continue
        met = to[0] in robot.targets[next_]
        found.append(((to, 1 - next_ if met else next_), met))
    return found
