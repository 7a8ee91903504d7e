"""The states of a robot whose formulas remember something: poses, each with the memory there and
the goals that the step into it has met where staying at neither end does."""

from __future__ import annotations

from safenav.audit.formulas import Formulas
from safenav.audit.language import Pose
from safenav.audit.poses import PoseGraph
from safenav.audit.possibilities.members import Member


class Recalled(str):
    """A robot's ``heading``, with the number of its memory and the goals that its step has met:
    in place of a heading it makes a state of a pose."""

    heading: str | None

    @classmethod
    def of(cls, pose: Pose, memory: int, met: frozenset[int] = frozenset()) -> Pose:
        """The state of a pose with a memory."""
        region, heading = pose
        recalled = cls(f"{heading} {memory} {sorted(met)}")
        recalled.heading = heading
        return region, recalled


def plain(state: Pose) -> Pose:
    """The pose of a state."""
    region, heading = state
    return region, heading.heading if isinstance(heading, Recalled) else heading


def with_memory(member: Member, formulas: Formulas) -> Member:
    """A robot whose poses are states. It may also stay, and remember something else then."""
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
