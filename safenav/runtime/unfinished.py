"""Words for a mission that is not completed: the remaining duties, and robots out of service."""

from __future__ import annotations

from safenav.runtime.team import RobotState, TeamState
from safenav.trace.words import MANY, counted, listed, obstacle_words, seconds_words


def where_out(team: TeamState, robot: RobotState) -> str:
    """Describe a robot out of service, the reason, and the robot whose target it occupies."""
    region = robot.pose.region
    barred = [
        other.name
        for other in team.in_conflict(robot.robot)
        if other.active and any(target == {region} for target in other.own.objective.targets)
    ]
    said = [team.failures.out[robot.name]] if robot.name in team.failures.out else []
    if barred:
        said.append(f"at {team.scenario.map.label(region)}, a target of {listed(barred)}")
    return f"{robot.name} ({'; '.join(said)})" if said else robot.name


def what_is_left(team: TeamState) -> str:
    """Return the reasons why the run is not completed yet."""
    word, wanted = team.scenario.map.word, team.scenario.until.rounds
    behind: dict[int, list[str]] = {}
    for name, robot in team.robots.items():
        if robot.own.rounds < wanted:
            behind.setdefault(robot.own.rounds, []).append(name)
    left = [
        f"{listed(names) if len(names) <= MANY else f'{len(names)} robots'} "
        f"{'has' if len(names) == 1 else 'have'} completed {done} of {wanted} rounds"
        for done, names in behind.items()
    ]
    away = [name for name, robot in team.robots.items() if robot.base is not None]
    left += [f"an input keeps {name} from its own objective" for name in away]
    left += [
        f"{listed(request.requesters)} "
        f"{'waits' if len(request.requesters) == 1 else 'wait'} for "
        f"{listed(request.helpers) if request.helpers else 'help'} to resolve "
        f"{obstacle_words(request.obstacle.name, word)}"
        if request.requesters
        else f"{obstacle_words(request.obstacle.name, word)} is still open"
        for request in team.requests
    ]
    after = counted(team.tick, "tick") if team.now is None else seconds_words(team.now())
    return f"not completed after {after}: {'; '.join(left)}"
