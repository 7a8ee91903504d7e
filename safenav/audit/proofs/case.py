"""The case of a proof: the team, the known obstacles and the remaining goals at its moment."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from safenav.audit.formulas import Formulas, rules_of
from safenav.audit.kinds import shape_of
from safenav.audit.language import Pose
from safenav.audit.lines import Objective
from safenav.audit.needs import OpenObstacle, OpenObstacles
from safenav.audit.poses import PoseGraph, Poses
from safenav.audit.possibilities.deriving import open_obstacle, poses_in, team_of
from safenav.audit.possibilities.members import Member
from safenav.audit.possibilities.team import Team
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import Status


@dataclass(frozen=True)
class RemainingGoals:
    """The goals that a robot must still meet. ``targets``: the poses that meet each goal;
    ``in_order``: in turn, otherwise in any order; ``settles``: the mission ends only while it is at
    the last one; ``ends``: it also meets each once. ``awaited``: the goals that may be next;
    ``covered``: those met in this round; ``met``: how many these are. ``either``: after a
    resolution, either of its two goals may come first."""

    targets: tuple[Poses, ...]
    in_order: bool = True
    settles: bool = False
    ends: bool = False
    awaited: tuple[int, ...] = (0,)
    covered: frozenset[int] = frozenset()
    met: int = 0
    rounds_left: int = 1
    either: bool = False


class Recalled(str):
    """A robot's ``heading``, with the number of its memory and the goals that only its last step
    has met. In place of the heading it turns a pose into a state."""

    heading: str | None

    @classmethod
    def of(cls, pose: Pose, memory: int, met: frozenset[int] = frozenset()) -> Pose:
        """Return the state of a pose with a memory and met goals."""
        region, heading = pose
        recalled = cls(f"{heading} {memory} {sorted(met)}")
        recalled.heading = heading
        return region, recalled


def plain(state: Pose) -> Pose:
    """Return the pose of a state."""
    region, heading = state
    return region, heading.heading if isinstance(heading, Recalled) else heading


@dataclass(frozen=True)
class Case:
    """The situation that a proof concerns. ``at``: each robot's pose; in transit, the pose where it
    will arrive. ``obstacles``: the known unresolved ones; ``shut``: obstacles that can never be
    resolved. ``remaining``: the goals that each robot has still to meet. ``rounds``: how often an
    objective must be met after a resolution. ``zones``: sets of robots of which at most one may be
    in some regions. ``flat``: the obstacle type of an empty battery, whose resolution resets no
    rounds."""

    team: Team
    at: Mapping[str, Pose]
    obstacles: OpenObstacles
    remaining: Mapping[str, RemainingGoals]
    shut: frozenset[str] = frozenset()
    rounds: int = 1
    zones: tuple[tuple[frozenset[str], frozenset[int]], ...] = ()
    flat: str | None = None

    def obstacle(self, name: str) -> OpenObstacle | None:
        return next((obstacle for obstacle in self.obstacles if obstacle.name == name), None)


def case_of(
    now: Situation,
    *,
    hopeful: bool = False,
    begins: bool = False,
    memory: Mapping[str, int] | None = None,
) -> Case | None:
    """Return the case at a line of the trace; None if this check does not read some robot's
    formulas. ``hopeful``: assume that every robot is in service. ``begins``: the first strategies
    are computed, before the requests of the earlier run are decided. ``memory``: the number of each
    robot's formula memory; the poses of these robots are states."""
    out: Collection[str] = () if hopeful else now.out
    team = team_of(now, out)
    if team is None:
        return None
    memory = memory or {}
    lifted = {name: with_memory(team.members[name], rules_of(now.own[name])) for name in memory}
    if lifted:
        team = Team({**team.members, **lifted})
    at = {name: now.pose(name) for name in team.names}
    later = (now.begun.asked or {}) if begins else {}
    known = [
        name
        for name, status in now.status.items()
        if status is Status.UNRESOLVED and name in now.discovered and name not in later
    ]
    return Case(
        team,
        {n: Recalled.of(at[n], memory[n]) if n in memory else at[n] for n in at},
        tuple(open_obstacle(name, now, out=out) for name in known),
        {name: _remaining_goals(name, now, team) for name in team.names},
        frozenset(name for name, status in now.status.items() if status is Status.GIVEN_UP),
        now.header.until.rounds or 1,
        now.exclusions,
        now.header.flat,
    )


def with_memory(member: Member, formulas: Formulas) -> Member:
    """Return a robot whose poses are states. It may also stay and change its memory."""
    edges: dict[tuple[Pose, int], set[tuple[Pose, int, frozenset[int]]]] = {}
    for here, to in member.steps.items():
        for there in (here, *to):
            for i, j, goals in formulas.steps(here, there):
                met = goals - formulas.met_by_staying(here, i) - formulas.met_by_staying(there, j)
                edges.setdefault((here, i), set()).add((there, j, met))
    states = {(*state, frozenset[int]()) for state in edges}.union(*edges.values())
    steps = PoseGraph(
        (
            Recalled.of(pose, i, met),
            tuple(Recalled.of(*to) for to in edges.get((pose, i), ()) if to != (pose, i, met)),
        )
        for pose, i, met in states
    )
    aims = tuple(
        frozenset(
            Recalled.of(pose, i, met)
            for pose, i, met in states
            if goal in met or goal in formulas.met_by_staying(pose, i)
        )
        for goal in range(len(formulas.goals))
    )
    return member._replace(steps=steps, aims=aims)


def _remaining_goals(name: str, now: Situation, team: Team) -> RemainingGoals:
    objective, progress, rounds = now.own[name], now.progress[name], now.header.until.rounds or 1
    targets = tuple(frozenset(poses_in(target, name, now)) for target in objective.targets)
    if objective.kind == "ltl":
        targets = team.members[name].aims
    ends, last = shape_of(objective.kind).ends, len(objective.targets) - 1
    return RemainingGoals(
        targets,
        shape_of(objective.kind).ordered,
        shape_of(objective.kind).settles,
        ends,
        (min(progress.ahead, last),) if ends else _awaited(name, objective, now),
        frozenset(goal for goal in progress.met if goal < len(targets)),
        len(progress.met),
        max(rounds - progress.rounds, 0),
        shape_of(objective.kind).strict and not objective.literal and len(targets) == 2,
    )


def _awaited(name: str, objective: Objective, now: Situation) -> tuple[int, ...]:
    """Return the targets that may be next: with a strict objective without a met target, any of
    them, unless it is literal."""
    count, progress = len(objective.targets), now.progress[name]
    known, goals = progress.awaited, progress.goals
    if objective.literal and now.objectives[name] == objective and known is not None:
        return (known,)
    if goals and goals[-1].goal < count:
        return ((goals[-1].goal + 1) % count,)
    strict = shape_of(objective.kind).strict
    return tuple(range(count)) if strict else ((progress.turn or 0) % max(count, 1),)
