"""The 3D page: one self-contained HTML file, as the flat page is, with the scene's program.

The program is large (three.js), so it travels deflated and is unpacked by the browser. Its
sources are beside those of the flat page (``report/page/front``), with which it shares all but
the stage.
"""

from __future__ import annotations

import zlib
from base64 import b64encode
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any

from safenav.report.page.encode import encoded
from safenav.report.page.html import embedded
from safenav.report.replay.timeline import Replay

_PAGE = """\
<!doctype html>
<html lang="en" data-theme="auto">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; \
style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:">
<meta name="generator" content="safenav">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>
{style}</style>
</head>
<body>
<div id="app"><noscript>This page shows a run of robots; it needs JavaScript.</noscript></div>
<script type="application/json" id="run">{run}</script>
<script type="application/json" id="motion">{motion}</script>
<script type="text/plain" id="program">{program}</script>
<script>
{loader}</script>
</body>
</html>
"""

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


def page3d_of(replay: Replay, source: str, motion: dict[str, Any]) -> str:
    """The replay in 3D as an HTML document. ``source`` is the name of its trace, ``motion``
    what ``report.view3d.encode`` made of its motion."""
    return _PAGE.format(
        title=escape(f"{replay.name}: replay in 3D"),
        style=_asset("view3d.css"),
        program=_program(),
        loader=_LOADER,
        run=embedded(encoded(replay, source)),
        motion=embedded(motion),
    )


@cache
def _program() -> str:
    return b64encode(zlib.compress(_asset("view3d.js").encode(), 9)).decode()


@cache
def _asset(name: str) -> str:
    return files("safenav.report.view3d").joinpath("assets", name).read_text(encoding="utf-8")
