"""Task replanning (TR): who has which objective, and the stack of what was interrupted.

A frame is pushed when a robot asks for help and popped when the obstacle is resolved; it keeps
the objectives of the whole team as they were before (paper, Section V-D and Algorithm 1).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from safenav.runtime.progress import Progress
from safenav.scenario.model import Obstacle
from safenav.scenario.objective import Hold, Ltl, Objective, Target, Visit
from safenav.spec.assignable import Signal
from safenav.spec.movement import one_of
from safenav.world.map import Region


@dataclass(frozen=True)
class Assignment:
    """What one robot is doing now: its own objective, or (``temporary``) something else for a
    while: it waits, helps, or gives way.

    ``avoid`` names obstacles that were found and not resolved when a robot began to wait or to
    help: as long as they are pending it plans around them, since walking into one would only
    ask again for what has been asked for. With assignable goals the robot is steered by
    ``signal``, and its strategy is still that for ``specified``.
    """

    objective: Objective
    progress: Progress
    avoid: frozenset[str] = frozenset()
    signal: Signal | None = None
    specified: Objective | None = None
    temporary: bool = False

    @classmethod
    def own(cls, objective: Objective) -> Assignment:
        """A robot's own objective, nothing of it done yet."""
        return cls(objective, Progress(objective))

    @classmethod
    def meanwhile(
        cls, objective: Objective, former: Assignment, avoid: Iterable[str]
    ) -> Assignment:
        """What a robot does for a while in place of its ``former`` assignment."""
        progress = Progress(objective)
        progress.keep_memory(former.progress)
        return cls(objective, progress, frozenset(avoid), temporary=True)


@dataclass
class Frame:
    """A reason why somebody does something else for a while, and what it interrupted.

    A request: ``helper`` resolves ``obstacle`` for ``requester``. Giving way (``obstacle`` is
    None): ``helper`` and perhaps others stand aside for ``requester``.
    ``done``: the obstacle is resolved, the way was used. ``relieved``: its helper could not do
    it after all, and a newer frame for the same obstacle has another one. ``goals_before``:
    goals that the requester had met when others began to stand aside.
    """

    obstacle: Obstacle | None
    requester: str
    helper: str
    tick: int
    saved: dict[str, Assignment]
    done: bool = False
    relieved: bool = False
    goals_before: int = 0

    def serves(self, obstacle: Obstacle) -> bool:
        return self.obstacle is not None and self.obstacle.name == obstacle.name


class TaskStack:
    """The objectives in force and the stack of interrupted ones."""

    def __init__(self, assignments: Mapping[str, Assignment]) -> None:
        self.current = dict(assignments)
        self.frames: list[Frame] = []

    @property
    def depth(self) -> int:
        return len(self.frames)

    def push(
        self,
        obstacle: Obstacle | None,
        requester: str,
        helper: str,
        tick: int,
        changes: Mapping[str, Assignment],
    ) -> Frame:
        """Interrupt the team: save all objectives, then put ``changes`` in force."""
        frame = Frame(obstacle, requester, helper, tick, dict(self.current))
        self.frames.append(frame)
        self.current.update(changes)
        return frame

    def finish(self, obstacle: Obstacle) -> bool:
        """Mark all frames of a resolved obstacle done; whether there was one."""
        served = [f for f in self.frames if f.serves(obstacle) and not f.done]
        for frame in served:
            frame.done = True
        return bool(served)

    def pop_done(self) -> Frame | None:
        """Drop the top frame if it is done and bring back what it interrupted.

        A robot whose objective the frame had not changed keeps the progress that it made.
        """
        if not self.frames or not self.frames[-1].done:
            return None
        frame = self.frames.pop()
        for name, saved in frame.saved.items():
            if self.current[name] is not saved:
                self.current[name] = saved
        return frame

    def request_for(self, obstacle: Obstacle) -> Frame | None:
        """The newest frame in which somebody is on the way to this obstacle."""
        for frame in reversed(self.frames):
            if frame.serves(obstacle) and not (frame.done or frame.relieved):
                return frame
        return None

    def relieved_of(self, obstacle: Obstacle) -> set[str]:
        """The robots that were asked for this obstacle and could not do it after all."""
        return {f.helper for f in self.frames if f.serves(obstacle) and f.relieved}

    def waiting(self) -> dict[str, Frame]:
        """Robots that wait for an open request of theirs -> the newest such frame."""
        return {
            frame.requester: frame
            for frame in self.frames
            if frame.obstacle is not None and not (frame.done or frame.relieved)
        }

    def giving_way(self) -> list[Frame]:
        """The open frames in which somebody stands aside."""
        return [frame for frame in self.frames if frame.obstacle is None and not frame.done]


def holding(objective: Objective, region: Region) -> Objective:
    """What a requester does while it waits: stay in ``region``.

    An ``ltl`` robot keeps its safety guarantees: they hold always, also while it waits.
    """
    if isinstance(objective, Ltl):
        stay = f"region = {region} -> region' = {region}"
        return replace(
            objective, safety=(*objective.safety, stay), liveness=(f"region = {region}",)
        )
    return Hold(frozenset({region}))


def helping(objective: Objective, places: Target, own: Target | None) -> Objective:
    """What a helper does: go to ``places`` first, then alternate with its ``own`` target.

    Plain alternation, not the literal Patrol formula, which would forbid a robot that leaves a
    doorway on the far side to come back through it (DESIGN section 5, rule 5).
    """
    if isinstance(objective, Ltl):
        return replace(objective, liveness=(one_of("region", places),))
    return Visit((places,) if own is None else (places, own))
