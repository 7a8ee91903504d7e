"""The forms in which an objective can stand in a specification, the strongest first.

A patrol is the paper's formula (Section VI) if the robot can keep it by the letter: with the memory
that it has, else with the other target first, else as plain alternation, which allows to cross a
target out of turn and to wait at one. Robots that share a floor, or get goals assigned at runtime,
patrol by plain alternation from the start. Every other objective has one form. A patrol with
``form: literal`` has only its first.

``run``, ``check``, ``synth``, ``explain``, the studio and certificates all climb this one ladder.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from enum import StrEnum

from msgspec import Struct

from safenav.scenario.objective import (
    Objective,
    Patrol,
    Visit,
    Word,
    avoided,
    number_word,
    ruled,
    targets_of,
)
from safenav.spec.task import Task
from safenav.world.moves import Mobility, Pose
from safenav.world.poses import Mask, PoseGraph, plain_graph, region_mask


class Weakening(StrEnum):
    """Why an objective stands in a weaker form than it could."""

    TURNED = "turned"
    """Where the robot stands it cannot begin with the target whose turn it is."""
    CORRIDOR = "corridor"
    """The map leaves no other way than across a target."""
    MOBILITY = "mobility"
    """The robot's mobility leaves no other way."""
    RULES = "rules"
    """Regions to avoid, or formulas to keep, leave no other way."""
    OBSTACLES = "obstacles"
    """Known obstacles leave no other way."""
    KEPT = "kept"
    """Some poses on the way are kept out of, because the team could not continue from there."""
    SHARED = "shared"
    """Other robots are on its floor."""
    ASSIGNED = "assigned"
    """Goals may be assigned to it at any time."""


class Rung(Struct, frozen=True):
    """One form of an objective. ``turn``: the target that comes first. ``weakening``: why no
    stronger form is asked for; None for the strongest."""

    objective: Objective
    turn: int
    weakening: Weakening | None = None


def forms(
    objective: Objective,
    turn: int,
    pose: Pose,
    graph: PoseGraph,
    blocked: Mask = 0,
    *,
    shared: bool = False,
    assigned: bool = False,
) -> Iterator[Rung]:
    """The forms to ask for, the strongest first, for a robot at ``pose`` that has target number
    ``turn`` next. ``blocked``: a mask of the regions that it cannot enter. Forms that the robot
    could not keep even alone are left out, but for the last one."""
    if not isinstance(objective, Patrol) or objective.literal:
        yield Rung(objective, turn)
        return
    plain = alternating(objective)
    if shared or assigned:
        yield Rung(plain, turn, Weakening.SHARED if shared else Weakening.ASSIGNED)
        return
    tried = [
        first for first in (turn, 1 - turn) if can_patrol(graph, pose, objective, first, blocked)
    ]
    for first in tried:
        yield Rung(objective, first, None if first == turn else Weakening.TURNED)
    why = Weakening.KEPT if tried else _obstruction(graph, pose, objective, blocked)
    yield Rung(plain, turn, why)


def alternating(objective: Objective) -> Objective:
    """The objective as plain alternation: the weakest form of a patrol."""
    if isinstance(objective, Patrol) and not objective.literal:
        return ruled(Visit((objective.first, objective.second)), objective)
    return objective


def concession(
    asked: Objective, rung: Rung, word: Word = number_word, others: Collection[str] = ()
) -> str | None:
    """How far a form falls short of what the user asked for, and why: ``may cross a target on the
    way: the corridor leaves no other path``. ``others``: the robots on its floor. None for the
    strongest form."""
    if rung.weakening is None:
        return None
    if rung.weakening is Weakening.TURNED:
        names = [word(target) for target in targets_of(asked)]
        first, other = names[rung.turn], names[1 - rung.turn]
        return f"{first} first: from here it cannot begin with {other} without crossing {first}"
    why = _WHY[rung.weakening]
    if others and rung.weakening is Weakening.SHARED:
        why = f"it shares its floor with {', '.join(others)}"
    return f"{_MAY[rung.weakening]}: {why}"


def asked_of(task: Task) -> Objective:
    """The objective of the user, of which a task may have a weaker form."""
    own = task.robot.objective
    return own if task.objective in (own, alternating(own)) else task.objective


_CROSS = "may cross a target on the way"
_WAIT = "may cross a target on the way and wait at one"
_MAY = {
    Weakening.CORRIDOR: _CROSS,
    Weakening.MOBILITY: _CROSS,
    Weakening.RULES: _CROSS,
    Weakening.OBSTACLES: _CROSS,
    Weakening.KEPT: _CROSS,
    Weakening.SHARED: _WAIT,
    Weakening.ASSIGNED: _WAIT,
}
_WHY = {
    Weakening.CORRIDOR: "the corridor leaves no other path",
    Weakening.MOBILITY: "its mobility leaves no other path",
    Weakening.RULES: "what it avoids or always keeps leaves no other path",
    Weakening.OBSTACLES: "the known obstacles leave no other path",
    Weakening.KEPT: "the team could not continue from a pose on the other path",
    Weakening.SHARED: "it shares its floor with others",
    Weakening.ASSIGNED: "it can be assigned another region at any time",
}


def _obstruction(graph: PoseGraph, pose: Pose, patrol: Patrol, blocked: Mask) -> Weakening:
    """The obstruction that keeps a robot from the literal patrol."""
    shut = region_mask(avoided(patrol))
    if blocked & ~shut and any(can_patrol(graph, pose, patrol, turn, shut) for turn in (0, 1)):
        return Weakening.OBSTACLES
    plain = plain_graph(graph.world, graph.mobility)
    if (shut or patrol.always) and any(can_patrol(plain, pose, patrol, t) for t in (0, 1)):
        return Weakening.RULES
    free = plain_graph(graph.world, Mobility.FREE)
    there = Pose(pose.region)
    if graph.one_way and any(can_patrol(free, there, patrol, turn, blocked) for turn in (0, 1)):
        return Weakening.MOBILITY
    return Weakening.CORRIDOR


def can_patrol(
    graph: PoseGraph, pose: Pose, patrol: Patrol, memory: int, blocked: Mask = 0
) -> bool:
    """Whether a robot at ``pose`` that remembers ``memory`` can by itself patrol by the letter,
    forever, while some regions are ``blocked``: it can neither enter them nor stay there.

    The letter is strict (paper, Section VI): a robot leaves a target immediately, and never touches
    the one out of turn. A one-player game on sets of poses, in a fraction of a millisecond.
    """
    begun = patrol.begin(pose.region, memory)
    targets = [graph.poses_on(region_mask(target)) for target in (patrol.first, patrol.second)]
    open_poses = graph.everywhere & ~graph.poses_on(blocked)
    # Where the robot may be on its way, and of each target the poses that it can continue from.
    way = open_poses & ~targets[0] & ~targets[1]
    met = [targets[turn] & open_poses & ~targets[1 - turn] for turn in (0, 1)]
    while True:
        before = list(met)
        for turn in (0, 1):
            met[turn] &= graph.backward(graph.back(met[1 - turn], way))
        if met == before:
            break
    here = 1 << graph.number(pose)
    after = 1 - begun if here & targets[begun] else begun
    return bool(graph.forward(here) & graph.back(met[after], way))
