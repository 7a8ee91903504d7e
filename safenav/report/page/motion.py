"""The 3D page: the replay page with a run's motion and the chunk that shows it.

The chunk is large (three.js), so the page embeds it deflated and unpacks it. Motions are sampled
``RATE`` times per second, in the frame of the map, in thousandths of a metre or radian, as
differences column by column. A minute of a walker takes about ten kilobytes (types:
front/src/view3d/motion.ts).
"""

import json
import zlib
from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from safenav.motion import file as records
from safenav.motion.columns import columns_at, times_of
from safenav.motion.timing import in_time
from safenav.report.page.html import asset, data_element, document, encoded
from safenav.run.reading import run_of
from safenav.trace.file import Trace

RATE = 20
"""Samples per second."""

Array = NDArray[np.float64]

_SHOWN = {
    short + name: of + name
    for short, of in (("", ""), ("l", "left_"), ("r", "right_"))
    for name in ("x", "y", "z", "yaw")
} | {f"q{axis}": f"q_{axis}" for axis in "wxyz"}
"""Columns of a body, a walker's feet and a simulated flight's attitude, with their names in the
page."""


def encoded_motion(motion: records.Motion) -> dict[str, Any]:
    """Return the motion as data of the page."""
    names = list(motion.header.robots)
    tracks = [_track(motion, name) for name in names]
    return {
        "side": motion.header.side,
        "rate": RATE,
        "samples": tracks[0]["samples"] if tracks else 0,
        "tracks": tracks,
        "actions": [
            [names.index(a.robot), a.obstacle, a.action, round(a.t0, 3), round(a.t1, 3)]
            for a in motion.of(records.Action)
        ],
    }


def _track(motion: records.Motion, robot: str) -> dict[str, Any]:
    described = motion.header.robots[robot]
    times = times_of(motion, RATE)
    columns = columns_at(motion, robot, times)
    found = {name: columns[of] for name, of in _SHOWN.items() if of in columns}
    return {
        "kind": described["kind"],
        "size": described["size"],
        "samples": len(times),
        **_packed(found),
        "feet": [list(foot) for foot in _feet(motion, robot)],
    }


def _packed(found: Mapping[str, Array]) -> dict[str, Any]:
    """Return the names of columns and their packed values, with continuous yaw."""
    smooth = (np.unwrap(c) if name.endswith("yaw") else c for name, c in found.items())
    return {"columns": list(found), "data": packed(smooth)}


def _feet(motion: records.Motion, robot: str) -> Iterator[tuple[int, ...]]:
    """Yield each foothold once: x, y and yaw (thousandths) and the time of landing (ms)."""
    latest: dict[int, tuple[int, int]] = {}
    for line in motion.of(records.Segment, robot):
        for foot in sorted(line.feet, key=lambda foot: foot.down):
            place = (round(foot.x * 1000), round(foot.y * 1000))
            if latest.get(foot.side) != place and foot.down <= line.t1 - line.t0:
                latest[foot.side] = place
                yield (*place, round(foot.yaw * 1000), round((line.t0 + foot.down) * 1000))


def packed(columns: Iterable[Array]) -> str:
    """Return columns as text: in thousandths, the first value of each column and then its
    differences, as JSON, deflated, in base64."""
    steps = [np.diff(np.rint(1000 * each).astype(int), prepend=0).tolist() for each in columns]
    return deflated(json.dumps(steps, separators=(",", ":")).encode())


def deflated(data: bytes) -> str:
    return b64encode(zlib.compress(data, 9)).decode()


def page3d_of(trace: Trace, source: str, motion: records.Motion) -> str:
    """Return the run of a trace in 3D as an HTML document, on the clock of its motion. ``source``:
    the name of the trace."""
    run = run_of(in_time(trace, motion))
    scene = deflated(asset("scene.js").encode())
    return document(
        f"{run.name}: replay in 3D",
        data_element("run", encoded(run, source)),
        data_element("motion", encoded_motion(motion)),
        f'<script type="text/plain" id="scene">{scene}</script>',
    )
