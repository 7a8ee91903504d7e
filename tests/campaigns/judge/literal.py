"""The paper's Patrol read literally, for one robot alone.

A robot leaves a target immediately, and never enters the target whose turn it is not. If that is
impossible, the scenario is refused before the start, with a message that proposes ``visit``; after
a detour robots alternate instead.
"""

from campaigns.judge.mission import Mission, Pose, Robot

State = tuple[Pose, int]
"""A pose, and the target that is next."""


def can_patrol(mission: Mission, robot: Robot) -> bool:
    """Return whether the robot can satisfy the formula forever, whichever target it begins with."""
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
    """Yield the states after one step, and whether the step meets the next target."""
    pose, next_ = state
    found = []
    for to in [pose, *mission.steps(robot, pose)]:
        if to[0] in robot.targets[1 - next_]:
            continue
        met = to[0] in robot.targets[next_]
        found.append(((to, 1 - next_ if met else next_), met))
    return found
