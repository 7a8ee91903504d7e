"""Checkpoints: the frozen state of a run in its trace, from which ``resume`` continues it.

A checkpoint describes the run before a pass. Its data is read strictly: no part of it is executed,
and its digest shows any change. Strategies are synthesized again where the robots are; commands
under way in a live run have ended where they began.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

import msgspec
from msgspec import Struct, field
from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.runtime.control.roles import Role
from safenav.runtime.run.deadlines import LedgerKept
from safenav.runtime.worlds.truth import Truth
from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.objective import Objective
from safenav.scenario.settings import Limits
from safenav.team.state import State
from safenav.team.team import Team, assigned, introduced, team_of
from safenav.trace import records
from safenav.trace.fields import WrongError, convert, plain
from safenav.trace.setting import scenario_header
from safenav.world.map import MAX_REGIONS

if TYPE_CHECKING:
    from safenav.trace.reading import Trace

ENDED = ("completed", "unrealizable", "late")
FEWEST, SHARE, LINE = 50, 2, 150
"""A checkpoint follows after that many lines at least, when they take ``SHARE`` times the space of
the last one, with ``LINE`` bytes for each."""
MOST = 10**7
"""No number of a pose, a region or a target is as large; a made-up one could fill the memory."""


class Memory(Struct, frozen=True, forbid_unknown_fields=True):
    """The memory of the recorder: see there. ``ledger``: of deadlines, if there are any."""

    tick: int
    moved: int
    stack: tuple[tuple[int, int | None, tuple[str, ...]], ...] = ()
    helpers: tuple[tuple[int, tuple[str, ...]], ...] = ()
    aside: tuple[int, ...] = ()
    planned: bool = False
    ledger: LedgerKept | None = None


class Kept(Struct, frozen=True, forbid_unknown_fields=True):
    """A run before a pass. ``own``: the objective of each robot, with rounds of at most ``within``
    ticks; ``helps``: the obstacle that each robot serves; ``introduced``: the obstacles that the
    scenario does not list, each with the robot whose battery it is; ``due``: the ticks in which
    steps under way end (lockstep). ``scenario``: in the first checkpoint."""

    state: State
    own: tuple[Objective, ...]
    within: tuple[int | None, ...]
    helps: tuple[int | None, ...]
    memory: Memory
    introduced: tuple[tuple[Obstacle, int | None], ...] = ()
    due: dict[str, int] = field(default_factory=dict)
    truth: Truth | None = None
    scenario: Scenario | None = None
    sha256: str = ""

    def checkpoint(self, lines: int, scenario: Scenario | None) -> records.Checkpoint:
        """The run after so many lines of its trace, with its scenario unless that is known."""
        run = plain(self if scenario is None else replace(self, scenario=scenario))
        return records.Checkpoint(self.memory.tick, lines, {**run, "sha256": _digest(run)})


def _digest(run: Mapping[str, object]) -> str:
    """The digest of the data of a checkpoint."""
    data = {key: value for key, value in run.items() if key != "sha256"}
    return hashlib.sha256(msgspec.json.encode(data, order="sorted")).hexdigest()


class Resumption(Struct, frozen=True):
    """A run to continue: its team and state, the roles and the lines before it."""

    team: Team
    state: State
    roles: tuple[Role, ...]
    kept: Kept
    lines: tuple[records.Record, ...]

    def standing(self, scenario: Scenario) -> Scenario:
        """The scenario with each robot where its last step began."""
        rows = zip(scenario.robots, self.team.members, self.state.robots, strict=True)
        robots = [replace(robot, start=m.graph.pose(at.pose)) for robot, m, at in rows]
        return replace(scenario, robots=tuple(robots))


def scenario_of(trace: Trace) -> Scenario:
    """Return the scenario of a run, which its first checkpoint holds. Raises UsageError if there is
    none, or none of which a map can be made."""
    found = next((kept.scenario for _, kept in _checkpoints(trace)), None)
    if found is None or not 0 < found.map.size <= MAX_REGIONS:
        raise UsageError(f"{trace.source}: its first checkpoint has no scenario")
    return replace(found, source=trace.source)


def _checkpoints(trace: Trace) -> list[tuple[int, Kept]]:
    """The first and the last checkpoint of a trace, each with the number of lines before it."""
    found = [line for line in trace.records if isinstance(line, records.Checkpoint)]
    if not found:
        none = "it has no checkpoint to continue from; a run with --trace writes them"
        raise UsageError(f"{trace.source}: {none}")
    try:
        changed = any(line.run.get("sha256") != _digest(line.run) for line in found)
    except UnicodeEncodeError:  # half of a character
        changed = True
    if changed:
        raise UsageError(f"{trace.source}: a checkpoint was changed; resume needs it as written")
    try:
        read = [(line.lines, convert(Kept, line.run)) for line in (found[0], found[-1])]
    except WrongError as error:
        why = f"its checkpoints are those of another version of safenav: {error}"
        raise UsageError(f"{trace.source}: {why}") from error
    if any(not 0 <= number < MOST for _, kept in read for number in _bits(kept)):
        raise UsageError(f"{trace.source}: a checkpoint has a region or target that no map has")
    return read


def _bits(kept: Kept) -> Iterator[int]:
    """The numbers of a checkpoint that become bits of masks."""
    state, truth = kept.state, kept.truth
    pursued = [*zip(kept.own, (robot.own for robot in state.robots), strict=False)]
    for robot in state.robots:
        yield from (robot.pose, robot.next, *robot.failed)
        for _, known in robot.known:
            yield from (known,) if isinstance(known, int) else known
        pursued.append((robot.objective, robot.task))
        pursued += [] if robot.base is None else [(robot.base[0], robot.base[2])]
    for objective, count in pursued:
        yield count.memory * objective.in_turn
    for each in (*state.obstacles, *(() if truth is None else truth.obstacles)):
        yield from (region for _, region in each.asked)
    yield from (place.pose for way in (state.plan.ways if state.plan else ()) for place in way)


def resumption(trace: Trace, scenario: Scenario) -> Resumption:
    """Return the run of a trace at its last checkpoint. ``scenario``: its scenario, perhaps with
    other limits. Raises UsageError if the run has ended, has no checkpoint, or is not one of the
    scenario."""
    if trace.outcome is not None and trace.outcome.outcome.value in ENDED:
        raise UsageError(f"nothing to resume: the run ended ({trace.outcome.outcome.value})")
    count, kept = _checkpoints(trace)[-1]
    limits = _compare(trace, scenario)
    team, state = _restored(team_of(scenario), kept)
    pairs = zip(state.robots, kept.helps, strict=True)
    roles = tuple(Role(robot.objective, helps) for robot, helps in pairs)
    header = replace(trace.header, scenario=replace(trace.header.scenario, limits=limits))
    return Resumption(team, state, roles, kept, (header, *trace.records)[:count])


def _compare(trace: Trace, scenario: Scenario) -> Limits:
    """Compare a scenario with the header of its trace; return its limits."""
    header = trace.header.scenario
    here = scenario_header(scenario, None, live=trace.header.clock is not None)
    hidden = tuple(replace(each, traversable=None) for each in header.obstacles)
    there, parts = replace(header, obstacles=hidden), ("map", "robots", "obstacles", "until")
    other = [name for name in parts if getattr(there, name) != getattr(here, name)]
    if other:
        raise UsageError(
            f"the scenario is not that of {trace.source}: it differs in {' and '.join(other)}"
        )
    return here.limits


def _restored(team: Team, kept: Kept) -> tuple[Team, State]:
    """The team and the state of a checkpoint."""
    for source, battery_of in kept.introduced:
        team = introduced(team, source, battery_of)
    for i, objective in enumerate(kept.own):
        if objective != team.members[i].robot.objective:
            team = assigned(team, i, objective, kept.within[i])
    return team, kept.state


class Checkpoints:
    """The checkpoints of a run, of which it ``emits`` the lines: at most a share of the trace."""

    def __init__(self, scenario: Scenario, emit: Callable[[records.Record], None]) -> None:
        self._scenario, self._emit = scenario, emit
        self.lines = self._last = self._size = self._at = 0
        self._kept: Kept | None = None

    def take(self, kept: Kept) -> None:
        """Remember the run before a pass; record it if a checkpoint is due."""
        self._kept, self._at = kept, self.lines
        lines = self.lines - self._last
        if lines >= FEWEST and lines * LINE >= SHARE * self._size:
            self.write()

    def write(self) -> None:
        """Record the run as it was before the present pass."""
        if self._kept is not None and self._at > self._last:
            line = self._kept.checkpoint(self._at, None if self._last else self._scenario)
            self._size = len(msgspec.json.encode(replace(line, run={**line.run, "scenario": None})))
            self._last = self._at
            self._emit(line)
