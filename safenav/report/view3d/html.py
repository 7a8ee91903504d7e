"""The 3D page: one self-contained HTML file, as the flat page is, with the scene's program.

The program is large (three.js), so it travels deflated and is unpacked by the browser. Its
sources are beside those of the flat page (``report/page/front``), with which it shares all but
the stage.
"""

from __future__ import annotations

import zlib
from base64 import b64encode
from bisect import bisect_right
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from msgspec.structs import replace

from safenav.motion.file.records import Motion
from safenav.motion.in_time import in_time, turns_in_time
from safenav.motion.requirements import curves
from safenav.report.page.encode import encoded
from safenav.report.page.html import data_element, document
from safenav.report.replay.reading import SAME, replay_of
from safenav.report.replay.timeline import Changes
from safenav.report.view3d.encode import encoded_motion
from safenav.trace.trace import Trace

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


def page3d_of(trace: Trace, source: str, motion: Motion) -> str:
    """Return the run of a trace in 3D as an HTML document, told by the clock of its motion.
    ``source`` is the name of the trace."""
    replay = replay_of(in_time(trace, motion))
    if trace.header.clock is None and replay.charges:
        replay = replace(replay, charges=_charges(trace, motion, replay.times or ()))
    return document(
        f"{replay.name}: replay in 3D",
        _asset("view3d.css"),
        data_element("run", encoded(replay, source) | {"curves": curves(motion, trace)}),
        data_element("motion", encoded_motion(motion)),
        f'<script type="text/plain" id="program">{_program()}</script>',
        f"<script>\n{_LOADER}</script>",
    )


def _charges(trace: Trace, motion: Motion, instants: Sequence[float]) -> dict[str, Changes[int]]:
    """Return the charges of a run in lockstep, in ticks, at the instants of its motion."""
    found = {}
    turns = turns_in_time(trace, motion)
    for name, charge in replay_of(trace).charges.items():
        ticks, seconds = zip(*([(0, 0.0), *turns.get(name, ())]), strict=True)
        told = [
            (bisect_right(instants, seconds[bisect_right(ticks, tick) - 1] + SAME) - 1, percent)
            for tick, percent in zip(charge.ticks[1:], charge.values[1:], strict=True)
        ]
        found[name] = Changes.of(charge.values[0], told)
    return found


@cache
def _program() -> str:
    return b64encode(zlib.compress(_asset("view3d.js").encode(), 9)).decode()


@cache
def _asset(name: str) -> str:
    return files("safenav.report.view3d").joinpath("assets", name).read_text(encoding="utf-8")
