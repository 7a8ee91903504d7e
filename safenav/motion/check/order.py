"""The rules of order: what the trace did in a serial order still holds in continuous time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct, field

from safenav.motion.check.finding import NEAR, Finding, Report
from safenav.motion.file.records import Action, Piece, Release, Reserve
from safenav.trace.records import (
    Act,
    ActionEnd,
    Appeared,
    Arrive,
    Depart,
    Gone,
    KnownObstacle,
    Met,
    Move,
    Resolved,
    Synthesis,
)
from safenav.trace.setting import ObstacleHeader, RobotHeader, ScenarioHeader
from safenav.trace.trace import Trace
from safenav.trace.vocabulary import MoveEnd


class Passage(Struct, frozen=True):
    """A step of the trace, with the pieces of motion that carry it out."""

    robot: str
    tick: int
    origin: int
    to: int
    begin: float
    end: float


class _Run(Struct):
    """The state of the run so far, in the serial order of the trace."""

    robots: Mapping[str, RobotHeader]
    at: dict[str, int]
    """Where each robot is: in its old region until it arrives."""
    begun: dict[str, tuple[Passage, float]] = field(default_factory=dict)
    """Steps of several ticks that have not arrived, and when what was before them ended."""
    left: dict[int, dict[str, float]] = field(default_factory=dict)
    ended: dict[str, float] = field(default_factory=dict)
    bound: dict[str, float] = field(default_factory=dict)
    opened: dict[str, float] = field(default_factory=dict)
    """When obstacles that stand no more were resolved; 0 for one that never stood, or went."""
    met: dict[str, tuple[int, float | None]] = field(default_factory=dict)
    """How many needs of an obstacle lines have told to be met, and when the last of them was."""


def conflicts_of(scenario: ScenarioHeader) -> dict[str, frozenset[str]]:
    """With whom each robot must never share a region."""
    found = {}
    for name, robot in scenario.robots.items():
        if robot.conflicts is not None:
            found[name] = robot.conflicts
        else:
            others = (n for n, other in scenario.robots.items() if other.layer == robot.layer)
            found[name] = frozenset(others) - {name}
    return found


def passages(
    trace: Trace,
    pieces: Mapping[str, Sequence[Piece]],
    report: Report,
    *,
    driven: bool = False,
) -> dict[int, Passage]:
    """For each line of the trace with which a step begins, when it is carried out. Steps and
    pieces must match one by one."""
    found: dict[int, Passage] = {}
    moved = {
        name: [piece for piece in own if piece.origin != piece.to] for name, own in pieces.items()
    }
    for name, steps in _steps(trace).items():
        mine = _merged(moved.get(name, []))
        for (line, tick, origin, to), done in zip(steps, mine, strict=False):
            if (done.origin, done.to) != (origin, to):
                what = f"moves {done.origin} -> {done.to} where the trace moves {origin} -> {to}"
                report(Finding(done.begin, name, "order", f"{what} (tick {tick})"))
                return found
            found[line] = done
        if len(mine) < len(steps):
            line, tick, origin, to = steps[len(mine)]
            if driven and line in _under_way(trace):
                continue  # the run ended before its motion began
            t = mine[-1].end if mine else 0.0
            what = f"the move {origin} -> {to} of tick {tick} is missing"
            report(Finding(t, name, "order", what))
        elif len(mine) > len(steps):
            extra = mine[len(steps)]
            what = f"moves {extra.origin} -> {extra.to}, which the trace does not"
            report(Finding(extra.begin, name, "order", what))
    return found


def _under_way(trace: Trace) -> set[int]:
    """The lines with which steps begin that have no end."""
    begun: dict[int, int] = {}
    for record in trace.records:
        if isinstance(record, Depart):
            begun[record.command] = record.line
        elif isinstance(record, Arrive):
            begun.pop(record.command, None)
    return set(begun.values())


def _merged(pieces: Sequence[Piece]) -> list[Passage]:
    """One passage a step: a push splits a step into pieces of one tick."""
    found: list[Passage] = []
    for piece in pieces:
        same = (piece.robot, piece.tick, piece.origin, piece.to)
        last = found[-1] if found else None
        if last is not None and (last.robot, last.tick, last.origin, last.to) == same:
            found[-1] = Passage(*same, last.begin, piece.t1)
        else:
            found.append(Passage(*same, piece.t0, piece.t1))
    return found


def _steps(trace: Trace) -> dict[str, list[tuple[int, int, int, int]]]:
    """The steps of each robot: line of the trace where it begins, tick, from, to."""
    found: dict[str, list[tuple[int, int, int, int]]] = {
        n: [] for n in trace.header.scenario.robots
    }
    begun: dict[str, Move] = {}
    departed: dict[str, Depart] = {}
    for record in trace.records:
        if isinstance(record, Depart):
            departed[record.robot] = record
        elif isinstance(record, Arrive):
            depart = departed.pop(record.robot)
            if record.at != depart.from_:
                step = (depart.line, depart.tick, depart.from_, record.at)
                found[record.robot].append(step)
        if not isinstance(record, Move):
            continue
        if record.toward is not None:
            begun.setdefault(record.robot, record)
            continue
        first = begun.pop(record.robot, record)
        if record.to != record.from_:
            step = (first.line, first.tick, record.from_, record.to)
            found[record.robot].append(step)
    for depart in departed.values():  # under way when the run ends
        found[depart.robot].append((depart.line, depart.tick, depart.from_, depart.to))
    return found


def check_clock(
    trace: Trace,
    steps: Mapping[int, Passage],
    lines: Sequence[object],
    report: Report,
    *,
    driven: bool = False,
) -> None:
    """In a run with a clock, steps, actions and reservations are when the trace has them; a robot
    that was ``driven`` arrives after the end of its reference or goal."""
    if trace.header.clock is None:
        return
    begun: dict[int, Depart | Act] = {}
    reserved: dict[tuple[str, int, bool], list[float]] = {}
    acts: list[tuple[frozenset[str], float, float]] = []
    robots = trace.header.scenario.robots
    for name, robot in robots.items():
        reserved[name, robot.start, True] = [0.0]
    for record in trace.records:
        t = record.t or 0.0
        if isinstance(record, Depart | Act):
            begun[record.command] = record
        if isinstance(record, Depart):
            reserved.setdefault((record.robot, record.to, True), []).append(t)
        elif isinstance(record, Arrive):
            depart = begun[record.command]
            assert isinstance(depart, Depart)
            left = depart.to if record.at == depart.from_ else depart.from_
            if record.result is not MoveEnd.LOST:
                reserved.setdefault((record.robot, left, False), []).append(t)
            step = steps.get(depart.line)
            late = float("inf") if driven else NEAR
            if step is not None and not (
                step.begin > (depart.t or 0.0) - NEAR and t - late < step.end < t + NEAR
            ):
                what = f"moves to {step.to} until {step.end:.3f} s, in the trace until {t:.3f} s"
                report(Finding(step.begin, record.robot, "clock", what))
        elif isinstance(record, ActionEnd):
            act = begun[record.command]
            assert isinstance(act, Act)
            acts.append((frozenset(act.robots), act.t or 0.0, t))
    over = max((record.t or 0.0 for record in trace.records), default=0.0)
    for line in lines:
        if isinstance(line, Reserve | Release) and line.t < over + NEAR:
            times = reserved.get((line.robot, line.region, isinstance(line, Reserve)), [])
            near = next((t for t in times if abs(t - line.t) < NEAR), None)
            if near is None:
                word = "reserves" if isinstance(line, Reserve) else "releases"
                what = f"{word} region {line.region} at {line.t:.3f} s, in the trace it does not"
                report(Finding(line.t, line.robot, "clock", what))
            else:
                times.remove(near)
        elif isinstance(line, Action) and not any(
            line.robot in team and begin < line.t0 + NEAR and line.t1 < end + NEAR
            for team, begin, end in acts
        ):
            what = f"acts on {line.obstacle} until {line.t1:.3f} s, in the trace at another time"
            report(Finding(line.t0, line.robot, "clock", what))
    for (name, region, begins), times in reserved.items():
        for t in times:
            what = f"never {'reserves' if begins else 'releases'} region {region}"
            report(Finding(t, name, "clock", what))


def check_order(
    trace: Trace,
    steps: Mapping[int, Passage],
    actions: Sequence[Action],
    report: Report,
) -> None:
    """A region is entered after those who left it before, after what blocked it is resolved,
    and after what a robot's strategy answers; actions are where and when they must be."""
    robots = trace.header.scenario.robots
    run = _Run(robots, {name: robot.start for name, robot in robots.items()})
    waiting = list(actions)
    conflicts = conflicts_of(trace.header.scenario)
    pending: dict[str, Passage] = {}
    turn: str | None = None
    closed: set[str] = set()
    obstacles = trace.obstacles
    run.opened.update((name, 0.0) for name, found in obstacles.items() if found.from_)
    for record in trace.records:
        if isinstance(record, Move):
            turn = record.robot
            step = steps.get(record.line)
            run.at[record.robot] = record.to
            if record.toward is None:
                run.begun.pop(record.robot, None)
            if step is not None:
                _entered(obstacles, run, conflicts, closed, step, report)
                pending[record.robot] = step
                if record.toward is not None:
                    run.begun[record.robot] = step, run.ended.get(record.robot, 0.0)
                run.ended[record.robot] = step.end
            if record.toward is None and record.to != record.from_:
                arrived = pending.get(record.robot)
                if arrived is not None:
                    run.left.setdefault(record.from_, {})[record.robot] = arrived.end
        elif isinstance(record, Depart):
            step = steps.get(record.line)
            if step is not None:
                _entered(obstacles, run, conflicts, closed, step, report)
                pending[record.robot] = step
        elif isinstance(record, Arrive):
            step = pending.pop(record.robot, None)
            if step is not None:
                run.at[record.robot] = record.at
                run.ended[record.robot] = step.end
                run.left.setdefault(step.origin, {})[record.robot] = step.end
        elif isinstance(record, Met):
            obstacle = obstacles[record.obstacle]
            done = _acted(obstacle, run, record, record.need, waiting, report)
            run.met[record.obstacle] = record.need + 1, done
        elif isinstance(record, Resolved):
            obstacle = obstacles[record.obstacle]
            last = len(obstacle.all_needs) - 1
            met, done = run.met.get(record.obstacle, (0, None))
            if met <= last:  # else a line of the last need has told who acts
                done = _acted(obstacle, run, record, last, waiting, report)
            if done is not None:
                run.opened[record.obstacle] = done
        elif isinstance(record, Appeared):
            run.opened.pop(record.obstacle, None)
            run.met.pop(record.obstacle, None)
            closed.discard(record.obstacle)
        elif isinstance(record, Gone):
            run.opened[record.obstacle] = 0.0
            closed.discard(record.obstacle)
        elif isinstance(record, KnownObstacle):
            closed.add(record.obstacle)
        elif isinstance(record, Synthesis) and record.t is not None:
            run.bound[record.robot] = record.t
        elif isinstance(record, Synthesis) and turn is not None:
            run.bound[record.robot] = _since(run, turn)
    for action in waiting:
        what = f"resolves {action.obstacle}, which the trace does not (tick {action.tick})"
        report(Finding(action.t0, action.robot, "action", what))


def _entered(
    obstacles: Mapping[str, ObstacleHeader],
    run: _Run,
    conflicts: Mapping[str, frozenset[str]],
    closed: set[str],
    step: Passage,
    report: Report,
) -> None:
    def wrong(rule: str, found: str) -> None:
        report(Finding(step.begin, step.robot, rule, found))

    for other, left in run.left.get(step.to, {}).items():
        if other != step.robot and (
            other in conflicts[step.robot] or step.robot in conflicts[other]
        ):
            early = left - step.begin
            if early > NEAR:
                wrong("order", f"enters region {step.to} {early:.3f} s before {other} has left it")
    early = run.bound.get(step.robot, 0.0) - step.begin
    if early > NEAR:
        what = f"moves {early:.3f} s before what its strategy answers has happened"
        wrong("order", what)
    for name, obstacle in obstacles.items():
        if obstacle.region != step.to or step.robot not in obstacle.blocks:
            continue
        if name in closed:
            wrong("obstacle", f"enters region {step.to}, where {name} stays permanently")
            continue
        stage, since = run.met.get(name, (0, None))
        if obstacle.resolved_by_entering(run.robots[step.robot], stage):
            early = (since or 0.0) - step.begin
            if early > NEAR:
                what = f"enters region {step.to} {early:.3f} s before {name} lets it in"
                wrong("obstacle", what)
            continue
        opened = run.opened.get(name)
        if opened is None:
            wrong("obstacle", f"enters region {step.to} with {name} unresolved")
        elif opened - step.begin > NEAR:
            early = opened - step.begin
            wrong("obstacle", f"enters region {step.to} {early:.3f} s before {name} is resolved")


def _since(run: _Run, robot: str) -> float:
    """When what a robot did ended; not the step that it has begun and not ended."""
    ended = run.ended.get(robot, 0.0)
    return run.begun[robot][1] if robot in run.begun else ended


def _go_on(run: _Run, robot: str, done: Action, report: Report) -> None:
    """A robot that acted continues after that: also with the step that it had begun by then."""
    if robot not in run.begun:
        run.ended[robot] = max(run.ended.get(robot, 0.0), done.t1)
        return
    step, before = run.begun[robot]
    early = done.t1 - step.begin
    if early > NEAR:
        what = f"leaves region {step.origin} {early:.3f} s before it has resolved {done.obstacle}"
        report(Finding(step.begin, robot, "order", what))
    run.begun[robot] = step, max(before, done.t1)


def _acted(
    obstacle: ObstacleHeader,
    run: _Run,
    record: Met | Resolved,
    number: int,
    waiting: list[Action],
    report: Report,
) -> float | None:
    """All that take part act, after they have arrived, and simultaneously if they are several.
    Returns when the last of them is done; None if no robot acts."""
    need = obstacle.all_needs[number]
    alone = isinstance(record, Met) and not need.together
    helpers = (n for n in record.robots or () if run.at[n] in need.regions and not alone)
    able = (n for n in helpers if need.action in run.robots[n].capabilities)
    team = {record.robot: None, **dict.fromkeys(able)}
    spans = []
    for name in team:
        done = next((a for a in waiting if (a.robot, a.obstacle) == (name, obstacle.name)), None)
        arrived = _since(run, name)
        if done is None:
            what = f"never acts on {obstacle.name} (tick {record.tick})"
            report(Finding(arrived, name, "action", what))
            continue
        waiting.remove(done)
        spans.append((done.t0, done.t1))
        for since, what in (
            (arrived, "it has arrived"),
            (run.bound.get(name, 0.0), "what its strategy answers"),
        ):
            if since - done.t0 > NEAR:
                early = f"acts on {obstacle.name} {since - done.t0:.3f} s before {what}"
                report(Finding(done.t0, name, "action", early))
        if done.t1 < done.t0 or done.action != need.action:
            what = f"performs '{done.action}' for {done.t1 - done.t0:.3f} s on {obstacle.name}"
            report(Finding(done.t0, name, "action", what))
        _go_on(run, name, done, report)
    if len(set(spans)) > 1:
        what = f"acts on {obstacle.name} at another time than the others"
        report(Finding(spans[0][0], record.robot, "action", what))
    return max((end for _, end in spans), default=None)
