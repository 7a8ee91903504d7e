"""A motion in words: makespan and critical path, waits, distances and speeds."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from safenav.motion.columns import Columns, columns_of
from safenav.motion.file import FlownTrack, Link, Motion, Moving, Wait
from safenav.motion.geometry import MetricFloor, margin

RATE = 50.0
"""Samples per second from which distances, speeds and margins are taken."""


class Travel(Struct, frozen=True):
    """Travel of a robot: metres, highest speed (m/s), and the least distance of its middle to the
    border of its reserved regions (m)."""

    metres: float
    fastest: float
    room: float


def report_of(motion: Motion) -> str:
    outcome = motion.outcome
    lines = [f"makespan {outcome.makespan:.1f} s, regions of {motion.header.side:g} m"]
    if outcome.chain:
        lines += ["", "critical path:", *(f"  {_link(link)}" for link in _joined(outcome.chain))]
    lines += ["", "robot            busy s  waiting s  path m  mean m/s   max m/s  room m"]
    for name in motion.header.robots:
        travel = travel_of(motion, name)
        busy, waiting = outcome.busy[name], outcome.waiting[name]
        mean = travel.metres / busy if busy else 0.0
        lines.append(
            f"{name:15s} {busy:7.1f}  {waiting:9.1f}  {travel.metres:6.1f}  {mean:8.2f}  "
            f"{travel.fastest:8.2f}  {travel.room:6.2f}"
        )
    waits = _waits(motion)
    if waits:
        lines += ["", "waiting:", *waits]
    return "\n".join([*lines, *_disturbed(motion)])


def travel_of(motion: Motion, robot: str) -> Travel:
    columns = columns_of(motion, robot, RATE, in_world=False)
    x, y = columns.place
    steps = np.hypot(np.diff(x), np.diff(y))
    speeds = np.hypot(*columns.velocity)
    return Travel(float(steps.sum()), float(speeds.max()), _room(motion, robot, columns))


def _room(motion: Motion, robot: str, columns: Columns) -> float:
    floor = MetricFloor(motion.header.rows, motion.header.cols, motion.header.side)
    x, y = columns.place
    points, least = np.column_stack([x, y]), np.inf
    for line in motion.of(Moving, robot):
        inside = (columns.times >= line.t0) & (columns.times <= line.t1)
        if inside.any():
            box = floor.corridor(line.origin, line.to)
            least = min(least, float(margin(points[inside], box).min()))
    return float(least)


def _link(link: Link) -> str:
    return f"{link.t0:8.1f} to {link.t1:7.1f} s  {link.robot}: {link.what}"


def _joined(chain: tuple[Link, ...]) -> list[Link]:
    """Return the chain with successive links of one robot joined."""
    found: list[Link] = []
    for link in chain:
        moves = link.what.split(" -> ")
        last = found[-1].what.split(" -> ") if found else []
        if found and found[-1].robot == link.robot and len(last) > 1 and last[-1] == moves[0]:
            what = f"{found[-1].what} -> {moves[-1]}"
            found[-1] = replace(found[-1], t1=link.t1, what=what)
        else:
            found.append(link)
    return [replace(link, what=_shortened(link.what)) for link in found]


def _shortened(what: str) -> str:
    regions = what.split(" -> ")
    if len(regions) <= 3:
        return what
    return f"{regions[0]} -> ... -> {regions[-1]} ({len(regions) - 1} moves)"


_CAUSES = {
    "region": "to leave a region",
    "obstacle": "to resolve an obstacle",
    "synthesis": "before its new strategy takes effect",
    "together": "to act together",
}


def _waits(motion: Motion) -> list[str]:
    total: dict[tuple[str, str, str], float] = defaultdict(float)
    for line in motion.of(Wait):
        total[line.robot, line.on, line.cause] += line.t1 - line.t0
    return [
        f"  {robot}: {seconds:.1f} s for {on} {_CAUSES.get(cause, cause)}"
        for (robot, on, cause), seconds in sorted(total.items(), key=lambda item: -item[1])
    ]


def _disturbed(motion: Motion) -> list[str]:
    found: list[str] = []
    if tracks := motion.of(FlownTrack):
        errors = np.concatenate([np.array(track.errors) for track in tracks])
        rms, worst = float(np.sqrt((errors**2).mean())), float(errors.max())
        gust = motion.header.gust
        found += ["", "simulated flights" + f" in gusts of {gust:g} m/s" * bool(gust)]
        found[-1] += f": off by {rms:.3f} m (root mean square), {worst:.3f} m at most"
    return found
