"""Searches in a thread, for worlds with a running clock: a mission receives events, interventions
and signals during the search for a plan.

Until the result is available only robots that can undo their steps alone begin new ones. A plan
starts from the poses at the start of its search. Undoing the steps since then in reverse order
leads back there: what was free for a robot's step is free for the step back. So these reversed
steps precede the plan, and the whole is shortened before execution (docs/coordination.md, A live
run).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Sequence
from threading import get_ident
from typing import TYPE_CHECKING, Any, TypeVar

from msgspec import Struct

from safenav.runtime.resolution.problem import Floor
from safenav.runtime.team import RobotState
from safenav.runtime.termination import Stop
from safenav.runtime.traffic import budgets
from safenav.runtime.traffic.joint_search.formula_memory import remembering
from safenav.runtime.traffic.joint_search.states import Count, Course, JointState
from safenav.scenario.objective import formulas_in

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

Answer = TypeVar("Answer")


class Unknown(Exception):  # noqa: N818 - it is not an error
    """The result is not available yet: ask again later."""


class BackgroundSearch:
    """Runs one search at a time. ``background``: whether in a thread; asking before the result is
    available then raises Unknown."""

    def __init__(self, stop: Stop) -> None:
        self.background = False
        self._stop = stop
        self._pool: ThreadPoolExecutor | None = None
        self._asked: tuple[Hashable, Future[Any]] | None = None
        self._abandoned = False
        self._thread: int | None = None
        self._told = False

    def check(self) -> None:
        """Raise RunEnded if the run must end now, and Unknown in an abandoned search."""
        self._stop.check()
        if self._abandoned and get_ident() == self._thread:
            raise Unknown

    def fresh(self) -> bool:
        """Return whether a result has become available; True only once per result."""
        come = not self._told and self._asked is not None and self._asked[1].done()
        self._told |= come
        return come

    def ask(self, moment: Hashable, search: Callable[[], Answer]) -> Answer:
        """Return the result of the search for a ``moment``; results for other moments are
        discarded. Raises Unknown, and the exceptions of the search."""
        if not self.background:
            return search()
        if self._asked is not None and self._asked[0] != moment and not self._asked[1].done():
            self._abandoned = True
            raise Unknown
        if self._asked is None or self._asked[0] != moment:
            from concurrent.futures import ThreadPoolExecutor  # only live runs need it

            self._pool = self._pool or ThreadPoolExecutor(1)
            self._abandoned = self._told = False
            self._asked = moment, self._pool.submit(self._searched, search)
        future: Future[Answer] = self._asked[1]
        try:
            found = future.result(budgets.AT_ONCE)
        except TimeoutError:
            if future.done():  # the search has raised it
                raise
            raise Unknown from None
        finally:
            if future.done():
                self._asked = None
        return found

    def abandon(self) -> None:
        """Abandon the running search: its result is not needed."""
        self._abandoned = True

    def close(self) -> None:
        """Abandon the running search."""
        self.abandon()
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)

    def _searched(self, search: Callable[[], Answer]) -> Answer:
        self._thread = get_ident()
        return search()


class PendingSearch(Struct):
    """A running search. ``floor``: its start; ``moment``: the key of everything that it depends on;
    ``team``: the part of that key which steps do not change; ``poses``: the joint poses since its
    start, which differ by one step of one robot; ``free``: the robots that may take such steps."""

    floor: Floor
    moment: Hashable
    team: Hashable
    poses: list[tuple[int, ...]]
    free: Collection[str] = ()

    @property
    def moved(self) -> bool:
        """Return whether a robot has departed since the search began."""
        return len(self.poses) > 1

    def serves(self, floor: Floor, team: Hashable) -> bool:
        """Return whether the result will apply to the present state."""
        return self.team == team and self.poses[-1] == floor.poses

    def may_go_on(self, name: str) -> bool:
        """Return whether a robot may take another step during the search."""
        return name in self.free and len(self.poses) <= budgets.LONGEST

    def set_out(self, poses: tuple[int, ...]) -> None:
        """Record that a robot has departed: ``poses`` are the next poses of all robots."""
        if poses != self.poses[-1]:
            self.poses.append(poses)

    def from_here(
        self, course: Course, counts: Sequence[Count], states: Sequence[JointState]
    ) -> list[JointState] | None:
        """Return the found plan, preceded by the steps back to its start; None if it no longer
        leads to the same result. ``counts``: each robot's progress."""
        if not self.moved:
            return list(states)
        back = [*reversed(self.poses), *(state.poses for state in states[1:])]
        found = course.along(course.begun(back[0], tuple(counts), states[0].stages), back[1:])
        pairs = zip(found[: len(self.poses)], reversed(self.poses), strict=True)
        undone = all(state.stages == states[0].stages for state, _ in pairs)
        return found if undone and found[-1].stages == states[-1].stages else None


def free_to_go_on(floor: Floor, robots: Collection[RobotState]) -> frozenset[str]:
    """Return the robots whose steps can always be undone: those without headings, formulas and
    batteries."""
    problem = floor.problem
    if remembering(problem):
        return frozenset()
    return frozenset(
        robot.name
        for robot, member in zip(robots, problem.members, strict=True)
        if not member.turns
        and formulas_in(robot.robot.objective) is None
        and formulas_in(robot.assignment.objective) is None
        and robot.charge is None
    )
