"""Checkpoints: states of a run in its trace, from which ``resume`` continues the run.

A checkpoint describes the run before a pass. Its data are read strictly and never executed. A
checksum reveals a changed checkpoint or header (except for the limits), unless the checksum was
also changed. Strategies are synthesized again where the robots are. In a live run, open commands
count as ended where they began.
"""

import json
from collections.abc import Callable, Mapping
from hashlib import sha256

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.files import json_line
from safenav.runtime.run.deadlines import Due, Of
from safenav.runtime.worlds.simulation import Truth
from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.objective import Objective
from safenav.team.acts import number
from safenav.team.state import Is, Stage, State
from safenav.team.team import Team, assigned, based, introduced, team_of
from safenav.trace import records
from safenav.trace.fields import WrongError, convert, plain
from safenav.trace.file import Trace, as_data

FREE = ("name", "limits", "seed", "expect", "requirements", "catalogue", "clock", "failures")
"""Parts of a scenario that may differ when a run continues."""
ENDED = ("completed", "unrealizable", "late")
FEWEST, SHARE, LINE, SECONDS = 50, 2, 150, 10.0
"""A checkpoint follows at least ``FEWEST`` lines that take ``SHARE`` times the space of the last
checkpoint, at ``LINE`` bytes per line. Runs of real robots cannot be repeated, so one also follows
``SECONDS`` after the last one, and each fulfilled need."""


class Memory(Struct, frozen=True, forbid_unknown_fields=True):
    """The attributes of the recorder and of its ledger, by name."""

    tick: int
    stack: tuple[tuple[int, int | None, tuple[str, ...]], ...] = ()
    helpers: tuple[tuple[int, tuple[str, ...]], ...] = ()
    planned: bool = False
    dues: tuple[tuple[Of, Due], ...] = ()
    late: tuple[str, ...] = ()


class Kept(Struct, frozen=True, forbid_unknown_fields=True):
    """A run before a pass. ``own``: each robot's objective, with rounds of at most ``within``
    ticks; ``helps``: the obstacle that each robot has to resolve; ``introduced``: obstacles that
    the scenario does not list, each with the robot whose empty battery it is, or None."""

    state: State
    own: tuple[Objective, ...]
    within: tuple[int | None, ...]
    helps: tuple[int | None, ...]
    memory: Memory
    introduced: tuple[tuple[Obstacle, int | None], ...] = ()
    truth: Truth | None = None
    sha256: str = ""


def sealed(line: records.Checkpoint, first: str | bytes) -> records.Checkpoint:
    """Return a checkpoint with the digest of its data and of its trace's first line."""
    return replace(line, run={**line.run, "sha256": _digest(line.run, first)})


def _digest(run: Mapping[str, object], first: str | bytes) -> str:
    """Return the digest of a run and its header without the limits, which may change."""
    data = {key: value for key, value in run.items() if key != "sha256"}
    header = json.loads(first, parse_int=float)  # 1 and 1.0 need the same digest
    header["scenario"].pop("limits", None)
    return sha256(json.dumps([header, data], sort_keys=True).encode()).hexdigest()


class Resumption(Struct, frozen=True):
    """A run to continue: its team, other data, and the lines before its last checkpoint."""

    team: Team
    kept: Kept
    lines: tuple[records.Record, ...]

    def standing(self, scenario: Scenario) -> Scenario:
        """Return the scenario with each robot placed where its last step began."""
        rows = zip(scenario.robots, self.team.members, self.kept.state.robots, strict=True)
        robots = [replace(robot, start=m.graph.pose(at.pose)) for robot, m, at in rows]
        return replace(scenario, robots=tuple(robots))

    @property
    def stages(self) -> dict[str, Stage]:
        """The stage of each obstacle that the team knows to be unresolved, by name."""
        rows = zip(self.team.obstacles, self.kept.state.obstacles, strict=True)
        return {each.name: there.stage for each, there in rows if there.known}

    def resolved(self, obstacle: Obstacle) -> bool:
        """Return whether the team knows an obstacle to be resolved or gone."""
        k, there = number(self.team, self.kept.state, obstacle), self.kept.state.obstacles
        gone = k < len(there) and there[k].state in (Is.OVER, Is.SEALED)
        return gone and not there[k].given_up


def _last_checkpoint(trace: Trace) -> tuple[int, Kept]:
    """Return the number of lines before the last checkpoint of a trace, and its run."""
    found = [line for line in trace.records if isinstance(line, records.Checkpoint)]
    if not found:
        none = "the trace ends before its first checkpoint; run the scenario again, with --trace"
        raise UsageError(f"{trace.source}: {none}")
    for line in found:
        if line.run.get("sha256") != _digest(line.run, trace.first):
            what = "this checkpoint or the header was changed; resume needs them as written"
            raise UsageError(f"{trace.source}:{line.line}: {what}")
    try:
        return found[-1].lines, convert(Kept, found[-1].run)
    except WrongError as error:
        why = f"another version of safenav wrote its checkpoints ({error}): run the scenario again"
        raise UsageError(f"{trace.source}: {why}") from error


def resumption(trace: Trace, scenario: Scenario) -> Resumption:
    """Return the run of a trace at its last checkpoint. ``scenario``: its scenario, perhaps with
    other limits. Raises UsageError if the run has ended, lacks a checkpoint or is of another
    scenario."""
    if trace.outcome is not None and trace.outcome.outcome.value in ENDED:
        raise UsageError(f"nothing to resume: the run ended ({trace.outcome.outcome.value})")
    count, kept = _last_checkpoint(trace)
    _compare(trace, scenario)
    team = _restored(scenario, kept)
    lines = trace.records[: max(0, count - 1)]
    recorded = replace(trace.header.scenario, limits=scenario.limits)
    return Resumption(team, kept, (replace(trace.header, scenario=recorded), *lines))


def _compare(trace: Trace, scenario: Scenario) -> None:
    """Raise UsageError if a scenario differs from that of a trace."""
    there, here = trace.header.scenario.recorded, scenario.recorded
    if there.clock is not scenario.clock:
        clock = "seconds" if trace.header.live else "ticks"
        hint = f"safenav resume continues it in {clock}"
        raise UsageError(f"{trace.source} is the trace of a run in {clock}\n    {hint}")
    parts = [name for name in Scenario.__struct_fields__ if name not in FREE]
    other = [name for name in parts if getattr(there, name) != getattr(here, name)]
    if other:
        raise UsageError(
            f"the scenario is not that of {trace.source}: it differs in {' and '.join(other)}"
        )


def _restored(scenario: Scenario, kept: Kept) -> Team:
    """Return the team in a run's checkpoint."""
    team = team_of(scenario)
    for source, battery_of in kept.introduced:
        team = introduced(team, source, battery_of)
    for i, own in enumerate(kept.own):
        if own != team.members[i].robot.objective:
            team = assigned(team, i, own, kept.within[i])
    pairs = enumerate(zip(team.members, kept.state.robots, strict=True))
    return based(team, {i: member.graph.pose(robot.next) for i, (member, robot) in pairs})


class Checkpoints:
    """The writer of a run's checkpoints. ``emit`` receives their lines, which form a limited share
    of the trace unless the run is ``real``."""

    def __init__(self, emit: Callable[[records.Record], None], *, real: bool) -> None:
        self._emit, self._real, self._since = emit, real, -SECONDS
        self.lines = self._last = self._size = self._at = 0
        self._first = ""
        self._kept: Kept | None = None

    def follow(self, line: records.Record) -> None:
        """Count a line of the trace."""
        self.lines += 1
        if isinstance(line, records.Header):
            self._first = json_line(as_data(line))
        elif isinstance(line, records.Part | records.Resolved):
            self._since = -SECONDS

    def take(self, kept: Kept) -> None:
        """Store the run before a pass, and write a checkpoint if one is due."""
        self._kept, self._at = kept, self.lines
        lines = self.lines - self._last
        many = lines >= FEWEST and lines * LINE >= SHARE * self._size
        if many or (self._real and kept.state.time >= self._since + SECONDS):
            self.write()

    def write(self) -> None:
        """Write a checkpoint of the run as it was before the present pass."""
        if (kept := self._kept) is not None and self._at > self._last:
            line = records.Checkpoint(kept.memory.tick, self._at, plain(kept))
            line = sealed(line, self._first)
            self._size = len(msgspec.json.encode(line))
            self._last, self._since = self._at, kept.state.time
            self._emit(line)
