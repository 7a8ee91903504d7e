"""The acts that a team has chosen since something is due: whether the robots can keep to them.

Each robot goes to its next place by the fastest steps that the obstacles still open leave to it
(docs/deadlines.md). Written from that page, apart from the code that chooses.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from safenav.audit.bound import NEVER, Bound
from safenav.audit.deriving import open_obstacle
from safenav.audit.lines import Line
from safenav.audit.situation import Situation


def impossible(line: Line, now: Situation, tick: int, had: int) -> Iterator[str]:
    """Yield what cannot be as the line tells it; ``had`` as in ``Bound``."""
    bound = Bound(now, tick, had, slow=True)
    for name, regions in (line.around or {}).items():
        bound.sealed[name] |= {*regions}
    first, count = bound.turn + 1, len(bound.names)
    open_ = {obstacle.name: open_obstacle(obstacle.name, now) for obstacle in bound.open}
    seeds = {name: dict([seed]) for name, seed in bound.start.items()}
    since, last = dict.fromkeys(open_, first), first
    unloaded = dict.fromkeys(bound.names, first)

    def is_full(robot: str) -> bool:
        most = now.header.robots[robot].carries
        return most is not None and sum(robot in o.carriers() for o in open_.values()) >= most

    for act in line.acts:
        obstacle = open_.get(act.obstacle)
        if obstacle is None or not obstacle.left or obstacle.stage != act.need:
            yield f"need {act.need} of {act.obstacle} is not the next one"
            return
        need, turns, came = obstacle.left[0], [], {}
        for robot, place in act.robots.items():
            able = robot in need.able - obstacle.done
            if not able or (obstacle.takes() and is_full(robot)):
                yield f"{robot} cannot meet need {act.need} of {act.obstacle}"
                return
            own = bound.names.index(robot)
            if _leaves(robot, place, now) and act.at <= bound.until[robot]:
                turns.append(bound.leaving(robot, need, since[act.obstacle]))
                if turns[-1] < NEVER:
                    continue
            ticks, _ = bound.ticks(robot, seeds[robot])
            came[robot] = ticks.get(tuple(place), NEVER)
            if place[0] not in need.regions or came[robot] > act.at:
                yield f"{robot} cannot act on {act.obstacle} from {place[0]} in tick {act.at}"
                return
            turns.append(came[robot] * count + own)
        there = max(since[act.obstacle], *turns)
        if obstacle.takes():
            there = max(there, *(unloaded[robot] for robot in act.robots))
        mine = [there + (bound.names.index(robot) - there) % count for robot in act.robots]
        turn = min(mine)
        if not need.together:
            turn += count * (act.at - turn // count)
        gone = any(
            turn >= bound.until[robot] * count + bound.names.index(robot)
            for robot in act.robots.keys() - came.keys()
        )
        if turn // count != act.at or turn < there or turn < last or gone:
            yield f"{act.obstacle} is not reached in tick {act.at} and in this order"
            return
        last, full = turn, {robot for robot in bound.names if is_full(robot)}
        for robot, tick in came.items():
            seeds[robot] = {tuple(act.robots[robot]): max(bound.sets_out(robot, turn), tick)}
        open_[act.obstacle] = obstacle.acted(act.robots)
        if len(open_[act.obstacle].left) < len(obstacle.left):
            bound.met[act.obstacle][act.need] = since[act.obstacle] = turn
        unloaded |= {robot: turn for robot in full if not is_full(robot)}


def _leaves(robot: str, place: Iterable[object], now: Situation) -> bool:
    """Whether a robot in transit set out from a place."""
    heading = now.heading[robot] if now.has_heading(robot) else None
    return now.toward[robot] is not None and tuple(place) == (now.region[robot], heading)
