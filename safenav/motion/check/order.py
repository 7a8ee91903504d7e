"""The rules of order, of actions and of charge.

Dependencies of the trace's serial order hold in continuous time; a robot acts at rest, at the place
in the trace, and does not pass an obstacle before it has resolved it; a robot without charge stands
still."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct

from safenav.motion.check.examination import NEAR, STILL, Array, Examination
from safenav.motion.file import Action, GoalLine, Moving, Piece, Release, Reserve
from safenav.motion.timing.execution import team_of
from safenav.trace import records
from safenav.trace.reading import Trace
from safenav.trace.records import Act, Appeared, Arrive, Depart, Met, Move, Resolved, Service
from safenav.trace.vocabulary import ChangeCause, MoveEnd


class Passage(Struct, frozen=True):
    """A step of the trace, with the pieces of motion that carry it out."""

    robot: str
    tick: int
    origin: int
    to: int
    begin: float
    end: float


def passages(case: Examination) -> dict[int, Passage]:
    """Return the times of each step, by the line of the trace with which it begins. Steps and
    pieces must match one by one."""
    found: dict[int, Passage] = {}
    for name, steps in _steps(case.trace, driven=bool(case.driven)).items():
        pieces: Sequence[Piece] = case.pieces[name] or case.motion.of(GoalLine, name)
        mine = _merged([piece for piece in pieces if piece.origin != piece.to])
        for (line, tick, origin, to), done in zip(steps, mine, strict=False):
            if (done.tick, done.origin, done.to) != (tick, origin, to):
                what = f"moves {done.origin} -> {done.to} in tick {done.tick} where the trace moves"
                case.wrong(done.begin, name, "order", f"{what} {origin} -> {to} (tick {tick})")
                return found
            found[line] = done
        if len(mine) < len(steps):
            line, tick, origin, to = steps[len(mine)]
            under_way = (depart.line for depart, arrive in case.trace.steps if arrive is None)
            if case.driven and line in under_way:
                continue  # the run ended before its motion began
            t = mine[-1].end if mine else 0.0
            what = f"the move {origin} -> {to} of tick {tick} is missing"
            case.wrong(t, name, "order", what)
        elif len(mine) > len(steps):
            extra = mine[len(steps)]
            what = f"moves {extra.origin} -> {extra.to}, a move that the trace does not have"
            case.wrong(extra.begin, name, "order", what)
    return found


def _merged(pieces: Sequence[Piece]) -> list[Passage]:
    """Merge the pieces of each step."""
    found: list[Passage] = []
    for piece in pieces:
        same = (piece.robot, piece.tick, piece.origin, piece.to)
        last = found[-1] if found else None
        if last is not None and (last.robot, last.tick, last.origin, last.to) == same:
            found[-1] = Passage(*same, last.begin, piece.t1)
        else:
            found.append(Passage(*same, piece.t0, piece.t1))
    return found


def _steps(trace: Trace, *, driven: bool) -> dict[str, list[tuple[int, int, int, int]]]:
    """Return the steps of each robot: first line in the trace, tick, origin, destination. That of a
    driven robot is the commanded one, wherever it arrived."""
    found: dict[str, list[tuple[int, int, int, int]]] = {
        n: [] for n in trace.header.scenario.robots
    }
    begun: dict[str, Move] = {}
    for depart, arrive in trace.steps:
        to = depart.to if driven or arrive is None else arrive.at
        if arrive is None or arrive.at != depart.from_:
            found[depart.robot].append((depart.line, depart.tick, depart.from_, to))
    for record in trace.records:
        if not isinstance(record, Move):
            continue
        if record.toward is not None:
            begun.setdefault(record.robot, record)
            continue
        first = begun.pop(record.robot, record)
        if record.to != record.from_:
            step = (first.line, first.tick, record.from_, record.to)
            found[record.robot].append(step)
    return found


def check_clock(case: Examination, steps: Mapping[int, Passage]) -> None:
    """In a run with a clock, steps, actions and reservations have the times of the trace; a driven
    robot arrives after the end of its reference or goal."""
    trace = case.trace
    if trace.header.clock is None:
        return
    robots = trace.header.scenario.robots
    reserved = {(name, robot.start, True): [0.0] for name, robot in robots.items()}
    for depart, arrive in trace.steps:
        reserved.setdefault((depart.robot, depart.to, True), []).append(depart.t or 0.0)
        if arrive is None:
            continue
        t = arrive.t or 0.0
        left = depart.to if arrive.at == depart.from_ else depart.from_
        if arrive.result is not MoveEnd.LOST:
            reserved.setdefault((depart.robot, left, False), []).append(t)
        step = steps.get(depart.line)
        late = float("inf") if case.driven else NEAR
        if step is not None and not (
            step.begin > (depart.t or 0.0) - NEAR and t - late < step.end < t + NEAR
        ):
            what = f"moves to {step.to} until {step.end:.3f} s; in the trace until {t:.3f} s"
            case.wrong(step.begin, depart.robot, "clock", what)
    acts = [({*a.robots}, a.t or 0.0, end.t or 0.0) for a, end in trace.acts if end is not None]
    with_whom: dict[tuple[str, float], set[str]] = {}
    for action in case.actions:
        with_whom.setdefault((action.obstacle, action.t1), set()).add(action.robot)
    over = max((record.t or 0.0 for record in trace.records), default=0.0)
    for line in case.motion.lines:
        if isinstance(line, Reserve | Release) and line.t < over + NEAR:
            times = reserved.get((line.robot, line.region, isinstance(line, Reserve)), [])
            near = next((t for t in times if abs(t - line.t) < NEAR), None)
            if near is None:
                word = "reserves" if isinstance(line, Reserve) else "releases"
                what = f"{word} region {line.region} at {line.t:.3f} s, but not in the trace"
                case.wrong(line.t, line.robot, "clock", what)
            else:
                times.remove(near)
        elif isinstance(line, Action) and not any(
            # A robot that stands there takes part in a joint action, even without a request.
            team & with_whom[line.obstacle, line.t1]
            and begin < line.t0 + NEAR
            and line.t1 < end + NEAR
            for team, begin, end in acts
        ):
            what = f"acts on {line.obstacle} until {line.t1:.3f} s; in the trace at another time"
            case.wrong(line.t0, line.robot, "clock", what)
    for (name, region, begins), times in reserved.items():
        for t in times:
            what = f"never {'reserves' if begins else 'releases'} region {region}"
            case.wrong(t, name, "clock", what)


def check_order(case: Examination, steps: Mapping[int, Passage]) -> None:
    """A region is entered after the robots that were there before have left, after its obstacle is
    resolved, and after the event that the robot's strategy follows; actions have their place and
    time."""
    _Order(case, steps).check()


class _Order:
    """The state of the run, in the serial order of the trace."""

    def __init__(self, case: Examination, steps: Mapping[int, Passage]) -> None:
        self.case, self.steps = case, steps
        self.robots = case.trace.header.scenario.robots
        self.obstacles = case.obstacles
        self.waiting = list(case.actions)
        self.at = {name: robot.start for name, robot in self.robots.items()}
        """The region of each robot: its old one until it arrives."""
        self.pending: dict[str, Passage] = {}
        self.begun: dict[str, tuple[Passage, float]] = {}
        """Steps of several ticks that have not arrived, and the end of the command before each."""
        self.left: dict[int, dict[str, float]] = {}
        self.ended: dict[str, float] = {}
        self.bound: dict[str, float] = {}
        """The end of the event that the strategy of a robot follows."""
        self.acting: dict[str, tuple[float, float]] = {}
        """In a run with a clock, for each robot, its ``_since`` and ``bound`` when its last action
        began; later an earlier part of the action or another strategy may have changed them."""
        self.closed: set[str] = set()
        scenario = case.trace.header.scenario
        self.external = scenario.world == "external"
        """In such a world an obstacle is known once a robot encounters it."""
        listed = set() if self.external else {obstacle.name for obstacle in scenario.obstacles}
        self.opened = {
            name: 0.0 for name, found in self.obstacles.items() if found.from_ or name not in listed
        }
        """When absent obstacles were resolved; 0 for one that never appeared, disappeared, or is
        not known yet."""
        self.met: dict[str, tuple[int, float | None]] = {}
        """The number of needs of an obstacle that the lines so far have fulfilled, and the time of
        the last."""
        self.flat: dict[str, tuple[str, float]] = {}
        """The obstacle that each robot with an empty battery is, and since when."""

    def check(self) -> None:
        turn: str | None = None
        battery = ""
        for record in self.case.trace.records:
            match record:
                case Move():
                    turn = record.robot
                    self._moved(record)
                case Depart() if (step := self.steps.get(record.line)) is not None:
                    self._entered(step)
                    self.pending[record.robot] = step
                case Arrive() if (step := self.pending.pop(record.robot, None)) is not None:
                    self.at[record.robot] = record.at
                    self.ended[record.robot] = step.end
                    self.left.setdefault(step.origin, {})[record.robot] = step.end
                case Act():
                    for name in record.robots:
                        self.acting[name] = self._since(name), self.bound.get(name, 0.0)
                case Met():
                    done = self._acted(record, record.need)
                    self.met[record.obstacle] = record.need + 1, done
                case Resolved():
                    last = len(self.obstacles[record.obstacle].needs) - 1
                    met, done = self.met.get(record.obstacle, (0, None))
                    if met <= last:  # else a line of the last need has recorded who acts
                        done = self._acted(record, last)
                    if done is not None:
                        self.opened[record.obstacle] = done
                    for name in [n for n, (on, _) in self.flat.items() if on == record.obstacle]:
                        until = self.case.makespan if done is None else done
                        _stood(self.case, name, self.flat.pop(name)[1], until)
                case records.Discovered():
                    self.opened.pop(record.obstacle.name, None)
                case records.Violation() if self.external:
                    self.opened.pop(record.obstacle, None)
                case Appeared():
                    if record.cause is ChangeCause.BATTERY:
                        battery = record.obstacle
                    self.opened.pop(record.obstacle, None)
                    self.met.pop(record.obstacle, None)
                    self.closed.discard(record.obstacle)
                case records.Gone():
                    self.opened[record.obstacle] = 0.0
                    self.closed.discard(record.obstacle)
                case Service(cause=ChangeCause.BATTERY, active=False):
                    self.flat[record.robot] = battery, self.ended.get(record.robot, 0.0)
                case records.KnownObstacle():
                    self.closed.add(record.obstacle)
                case records.Synthesis() if record.t is not None:
                    self.bound[record.robot] = record.t
                case records.Synthesis() if turn is not None:
                    self.bound[record.robot] = self._since(turn)
                case _:
                    pass
        for name, (_, since) in self.flat.items():
            _stood(self.case, name, since, self.case.makespan)
        for action in self.waiting:
            what = f"resolves {action.obstacle}, which the trace does not (tick {action.tick})"
            self.case.wrong(action.t0, action.robot, "action", what)

    def _moved(self, record: Move) -> None:
        step = self.steps.get(record.line)
        self.at[record.robot] = record.to
        if record.toward is None:
            self.begun.pop(record.robot, None)
        if step is not None:
            self._entered(step)
            self.pending[record.robot] = step
            if record.toward is not None:
                self.begun[record.robot] = step, self.ended.get(record.robot, 0.0)
            self.ended[record.robot] = step.end
        if record.toward is None and record.to != record.from_:
            arrived = self.pending.get(record.robot)
            if arrived is not None:
                self.left.setdefault(record.from_, {})[record.robot] = arrived.end

    def _entered(self, step: Passage) -> None:
        def wrong(rule: str, found: str) -> None:
            self.case.wrong(step.begin, step.robot, rule, found)

        for other, left in self.left.get(step.to, {}).items():
            early = left - step.begin
            if early > NEAR and other != step.robot and self.case.in_conflict(other, step.robot):
                wrong("order", f"enters region {step.to} {early:.3f} s before {other} has left it")
        early = self.bound.get(step.robot, 0.0) - step.begin
        if early > NEAR:
            wrong("order", f"moves {early:.3f} s before the event that its strategy follows")
        for name, obstacle in self.obstacles.items():
            if obstacle.region != step.to or step.robot not in obstacle.blocks:
                continue
            if name in self.closed:
                wrong("obstacle", f"enters region {step.to}, where {name} stays permanently")
                continue
            stage, since = self.met.get(name, (0, None))
            opened, event = self.opened.get(name), "is resolved"
            if obstacle.resolved_by_entering(self.robots[step.robot], stage):
                opened, event = since or 0.0, "lets it in"
            if opened is None:
                wrong("obstacle", f"enters region {step.to} with {name} unresolved")
            elif opened - step.begin > NEAR:
                early = opened - step.begin
                wrong("obstacle", f"enters region {step.to} {early:.3f} s before {name} {event}")

    def _since(self, robot: str) -> float:
        """Return the end of a robot's last completed command; a step in progress does not count."""
        ended = self.ended.get(robot, 0.0)
        return self.begun[robot][1] if robot in self.begun else ended

    def _go_on(self, robot: str, done: Action) -> None:
        """A robot that acted continues only afterwards, even with a step that it had already
        begun."""
        if robot not in self.begun:
            self.ended[robot] = max(self.ended.get(robot, 0.0), done.t1)
            return
        step, before = self.begun[robot]
        early = done.t1 - step.begin
        if early > NEAR:
            what = f"leaves region {step.origin} {early:.3f} s before it has resolved "
            self.case.wrong(step.begin, robot, "order", what + done.obstacle)
        self.begun[robot] = step, max(before, done.t1)

    def _acted(self, record: Met | Resolved, number: int) -> float | None:
        """Check that all participants act after their arrival, and simultaneously if there are
        several. Returns when the last of them is done; None if no robot acts."""
        name, wrong = record.obstacle, self.case.wrong
        need = self.obstacles[name].needs[number]
        spans = []
        for robot in team_of(self.case.trace, record, need, self.at):
            done = next((a for a in self.waiting if (a.robot, a.obstacle) == (robot, name)), None)
            now = self._since(robot), self.bound.get(robot, 0.0)
            arrived, bound = self.acting.get(robot, now)
            if done is None:
                wrong(arrived, robot, "action", f"never acts on {name} (tick {record.tick})")
                continue
            self.waiting.remove(done)
            _performed(self.case, done, record.at if robot == record.robot else None)
            spans.append((done.t0, done.t1))
            for since, what in (
                (arrived, "it has arrived"),
                (bound, "the event that its strategy follows"),
            ):
                if since - done.t0 > NEAR:
                    early = f"acts on {name} {since - done.t0:.3f} s before {what}"
                    wrong(done.t0, robot, "action", early)
            least = 0.0
            if self.case.trace.header.clock is None:  # else the rule of the clock has its times
                least = self.case.numbers[robot].get("action_seconds", 0.0)
            if done.t1 - done.t0 < least - NEAR or done.action != need.action:
                what = f"performs '{done.action}' for {done.t1 - done.t0:.3f} s on {name}"
                wrong(done.t0, robot, "action", what)
            self._go_on(robot, done)
        if len(set(spans)) > 1:
            what = f"acts on {name}, but not at the same time as the others"
            wrong(spans[0][0], record.robot, "action", what)
        return max((end for _, end in spans), default=None)


def _performed(case: Examination, action: Action, at: int | None) -> None:
    """Check that an action is performed at rest, in region ``at``, on the place of its obstacle."""

    def wrong(found: str, rule: str = "action") -> None:
        case.wrong(action.t0, action.robot, rule, found)

    path = case.body(action.robot, action.t0, action.t1)
    if len(path) == 0:
        return  # the rule of continuity reports it
    if (moved := _moved(path)) > STILL:
        wrong(f"moves by {moved:.3f} m while it acts on {action.obstacle}")
    if at is not None:
        off = float(case.grid.distance(path[:1], case.grid.place(at))[0])
        if off > STILL:
            wrong(f"acts on {action.obstacle} {off:.3f} m outside region {at}")
    region = case.obstacles[action.obstacle].region
    if region != action.region:
        wrong(f"acts on {action.obstacle} in region {action.region}, not {region}")
    if (past := _past(case, region, action)) > STILL:
        wrong(f"passes {action.obstacle} by {past:.3f} m before it is resolved", "obstacle")


def _moved(path: Array) -> float:
    """Return the maximum distance of a body from its first position."""
    return float(np.hypot(*(path - path[0]).T).max()) if len(path) else 0.0


def _past(case: Examination, at: int, action: Action) -> float:
    """Return how far a robot that resolves an obstacle in its own region gets beyond the region's
    centre until then; 0 for any other action."""
    own = case.pieces[action.robot]
    entering = [p for p in own if p.to == at and p.origin != at and p.t1 <= action.t0 + NEAR]
    here = [p for p in own if p.t0 <= action.t0 + NEAR and p.t1 >= action.t0 - NEAR]
    if not entering or any(p.to != at for p in here):
        return 0.0
    last = entering[-1]
    (col, row), (from_col, from_row) = case.grid.place(at), case.grid.place(last.origin)
    ahead = np.array([col - from_col, row - from_row], dtype=float)
    middle = (np.array([col, row]) + 0.5) * case.grid.side
    path = case.body(action.robot, last.t0, action.t1)
    return float(((path - middle) @ ahead).max())


def _stood(case: Examination, name: str, since: float, until: float) -> None:
    """A robot without charge does not move, after it has come to rest."""
    for piece in case.pieces[name]:
        if abs(piece.t0 - since) < NEAR and _comes_to_rest(case, piece):
            since = piece.t1
            break
    moved = _moved(case.body(name, since, until))
    if moved > STILL:
        what = f"moves by {moved:.3f} m without charge, before {until:.3f} s"
        case.wrong(since, name, "charge", what)


def _comes_to_rest(case: Examination, piece: Moving) -> bool:
    """Whether a robot only comes to rest: a walker by a step on the spot; a robot that has acted
    short of the centre of its region by continuing to it."""
    if piece.origin != piece.to:
        return False
    path = case.body(piece.robot, piece.t0, piece.t1)
    middle = (np.array(case.grid.place(piece.to)) + 0.5) * case.grid.side
    off = np.hypot(*(path - middle).T)
    if piece.primitive == "stop":
        return True
    return len(off) > 0 and bool(off[0] > STILL and off[-1] <= STILL)
