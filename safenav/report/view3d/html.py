"""The 3D page: one self-contained HTML file, as the flat page is, with the scene's program.

The program is large (three.js), so it travels deflated and is unpacked by the browser. Its
sources are beside those of the flat page (``report/page/front``), with which it shares all but
the stage.
"""

from __future__ import annotations

import zlib
from base64 import b64encode
from functools import cache
from importlib.resources import files

from safenav.motion.file.records import Motion
from safenav.motion.in_time import in_time
from safenav.motion.requirements import curves
from safenav.report.page.encode import encoded
from safenav.report.page.html import data_element, document
from safenav.report.replay.reading import replay_of
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
    return document(
        f"{replay.name}: replay in 3D",
        _asset("view3d.css"),
        data_element("run", encoded(replay, source) | {"curves": curves(motion, trace)}),
        data_element("motion", encoded_motion(motion)),
        f'<script type="text/plain" id="program">{_program()}</script>',
        f"<script>\n{_LOADER}</script>",
    )


@cache
def _program() -> str:
    return b64encode(zlib.compress(_asset("view3d.js").encode(), 9)).decode()


@cache
def _asset(name: str) -> str:
    return files("safenav.report.view3d").joinpath("assets", name).read_text(encoding="utf-8")
