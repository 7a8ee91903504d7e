"""The 3D page: one self-contained HTML file, like the 2D page, with the program of the 3D scene.

The program is large (three.js), so it is embedded deflated and unpacked by the browser. It shares
the sources of the 2D page (``report/page/front``) except for the scene. Motions are sampled
``RATE`` times per second, in the frame of the map, in thousandths of a metre or radian, as
differences column by column: a minute of a walker takes about ten kilobytes (types:
front/src/view3d/motion.ts).
"""

from __future__ import annotations

import json
import zlib
from base64 import b64encode
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from operator import itemgetter
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from safenav.motion import file as records
from safenav.motion.columns import columns_of
from safenav.motion.requirements import curves
from safenav.motion.timing import in_time, turns_in_time
from safenav.report.page.encode import encoded
from safenav.report.page.html import asset, data_element, document
from safenav.run.paths import SAME
from safenav.run.reading import run_of
from safenav.run.run import Run
from safenav.run.values import Changes
from safenav.trace.reading import Trace

RATE = 20
"""Samples per second."""
GRAVITY = 9.81

Array = NDArray[np.float64]

_WALKER = {
    **{"x": "com_x", "y": "com_y", "z": "com_z", "yaw": "yaw"},
    **{f"l{name}": f"left_{name}" for name in ("x", "y", "z", "yaw")},
    **{f"r{name}": f"right_{name}" for name in ("x", "y", "z", "yaw")},
}
_BODY = {name: name for name in ("x", "y", "z", "yaw")}


def encoded_motion(motion: records.Motion) -> dict[str, Any]:
    """Return the motion as data of the page."""
    names = list(motion.header.robots)
    tracks = [_track(motion, name) for name in names]
    return {
        "side": motion.header.side,
        "seconds": motion.outcome.makespan,
        "rate": RATE,
        "samples": tracks[0]["samples"] if tracks else 0,
        "tracks": tracks,
        "reserved": [
            [names.index(robot), region, round(begin, 3), round(end, 3)]
            for robot, region, begin, end in _reserved(motion)
        ],
        "actions": [
            [names.index(a.robot), a.obstacle, a.action, round(a.t0, 3), round(a.t1, 3)]
            for a in motion.of(records.Action)
        ],
    }


def _track(motion: records.Motion, robot: str) -> dict[str, Any]:
    described = motion.header.robots[robot]
    columns = columns_of(motion, robot, RATE, in_world=False)
    walks = "com_x" in columns.columns
    found = {name: columns.columns[given] for name, given in (_WALKER if walks else _BODY).items()}
    if described["kind"] == "flyer":
        found |= _attitude(columns.columns)
    return {
        "kind": described["kind"],
        "size": described["size"],
        "samples": len(columns.times),
        **_packed(found),
        "feet": [list(foot) for foot in _feet(motion, robot)],
        **_ghost(motion, robot, columns.times, list(found)),
    }


def _ghost(motion: records.Motion, robot: str, times: Array, names: list[str]) -> dict[str, Any]:
    """Return the planned columns of a robot with measured ones: its present or last goal if it has
    goals, else its reference."""
    if not motion.of(records.Measured, robot):
        return {}
    goals = motion.of(records.GoalLine, robot)
    columns = columns_of(motion, robot, RATE, in_world=False, planned=not goals).columns
    wanted = _WALKER if "com_x" in columns else _BODY
    found = {name: columns[wanted[name]].copy() for name in names if name in wanted}
    if goals:
        for goal in goals:
            since = times >= goal.t0
            found["x"][since], found["y"][since] = goal.x, goal.y
            if goal.yaw is not None:
                found["yaw"][since] = goal.yaw
        first = times < goals[0].t0
        for name in ("x", "y", "yaw"):
            found[name][first] = found[name][0]
    return {"ghost": _packed(found)}


def _packed(found: Mapping[str, Array]) -> dict[str, Any]:
    """Return names and packed values of columns, with yaw unwrapped."""
    smooth = (np.unwrap(c) if name.endswith("yaw") else c for name, c in found.items())
    return {"columns": list(found), "data": packed(smooth)}


def _attitude(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return the quaternion of a flyer in its simulated flight; else that by which the body's z
    axis has the direction of the reference's thrust, and its yaw."""
    if "q_w" in columns:
        return {f"q{axis}": columns[f"q_{axis}"] for axis in "wxyz"}
    up = np.stack([columns["acc_x"], columns["acc_y"], columns["acc_z"] + GRAVITY], axis=1)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    # The shortest rotation from (0, 0, 1) to ``up``, after a rotation about z by the yaw.
    w = np.sqrt((1 + up[:, 2]) / 2)
    x, y = -up[:, 1] / (2 * w), up[:, 0] / (2 * w)
    cos, sin = np.cos(columns["yaw"] / 2), np.sin(columns["yaw"] / 2)
    return {
        "qw": w * cos,
        "qx": x * cos + y * sin,
        "qy": y * cos - x * sin,
        "qz": w * sin,
    }


def _feet(motion: records.Motion, robot: str) -> Iterator[tuple[int, ...]]:
    """Yield the footholds: x, y and yaw (thousandths), side, down and up (ms), each once."""
    latest: dict[int, tuple[int, int]] = {}
    for line in motion.of(records.Segment, robot):
        for foot in sorted(line.feet, key=lambda foot: foot.down):
            place = (round(foot.x * 1000), round(foot.y * 1000))
            if latest.get(foot.side) != place:
                latest[foot.side] = place
                down, up = (round((line.t0 + t) * 1000) for t in (foot.down, foot.up))
                yield (*place, round(foot.yaw * 1000), foot.side, down, up)


def _reserved(motion: records.Motion) -> Iterator[tuple[str, int, float, float]]:
    """Yield each reservation: robot, region, start and end time."""
    since: dict[tuple[str, int], float] = {}
    for line in motion.lines:
        if isinstance(line, records.Reserve):
            since.setdefault((line.robot, line.region), line.t)
        elif isinstance(line, records.Release):
            begin = since.pop((line.robot, line.region), None)
            if begin is not None:
                yield line.robot, line.region, begin, line.t
    for (robot, region), begin in since.items():
        yield robot, region, begin, motion.outcome.makespan + 1


def packed(columns: Iterable[Array]) -> str:
    """Return columns in thousandths, each as its first value and then differences: JSON, deflated,
    in base64."""
    steps = [np.diff(np.rint(1000 * each).astype(int), prepend=0).tolist() for each in columns]
    return deflated(json.dumps(steps, separators=(",", ":")).encode())


def deflated(data: bytes) -> str:
    return b64encode(zlib.compress(data, 9)).decode()


_LOADER = """\
(async () => {
  const packed = document.getElementById("program").textContent;
  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const script = document.createElement("script");
  script.textContent = await new Response(stream).text();
  document.body.append(script);
})();
"""


def page3d_of(trace: Trace, source: str, motion: records.Motion) -> str:
    """Return the run of a trace in 3D as an HTML document, on the clock of its motion. ``source``:
    the name of the trace."""
    timed = in_time(trace, motion)
    run = run_of(timed)
    if timed is not trace:
        run = _timed(run, trace, motion)
    program = asset("view3d.js", __package__)
    return document(
        f"{run.name}: replay in 3D",
        asset("view3d.css", __package__),
        data_element("run", encoded(run, source) | {"curves": curves(motion, timed)}),
        data_element("motion", encoded_motion(motion)),
        f'<script type="text/plain" id="program">{deflated(program.encode())}</script>',
        f"<script>\n{_LOADER}</script>",
    )


def _timed(run: Run, trace: Trace, motion: records.Motion) -> Run:
    """Move the charges and deadlines of a lockstep run from its ticks to the instants of its
    motion. A tick has ended with the last of its turns."""
    turns = turns_in_time(trace, motion)
    ticked = run_of(trace)

    def instant(tick: int, *robots: str) -> int:
        each = (turns.get(name, ()) for name in robots)
        past = (turn[: bisect_right(turn, tick, key=itemgetter(0))] for turn in each)
        ends = (turn[-1][1] for turn in past if turn)
        return bisect_right(run.seconds or (), max(ends, default=0.0) + SAME) - 1

    def at_end(tick: int) -> int:
        return instant(tick, *turns) if tick < ticked.last else run.last

    charges = {
        name: Changes((max(0, instant(tick, name)), percent) for tick, percent in charge)
        for name, charge in ticked.charges.items()
    }
    deadlines = [
        replace(one, tick=at_end(one.tick), begin=at_end(one.begin), due=at_end(one.due))
        for one in ticked.deadlines
    ]
    return replace(run, charges=charges, deadlines=deadlines)
