"""One HTML file that holds everything: style, program and run. It needs no network.

The program is built from ``front/`` (TypeScript, Preact, esbuild) and committed, since users of
safenav have no Node. A content security policy in the page forbids every request."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files

from safenav.report.page.encode import encoded
from safenav.report.page.requirements import curves_of
from safenav.report.replay.reading import replay_of
from safenav.report.replay.timeline import Replay
from safenav.trace.trace import Trace

_DOCUMENT = """\
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
{scripts}
</body>
</html>
"""


def page_of(replay: Replay, source: str, curves: Sequence[Mapping[str, object]] = ()) -> str:
    """Return the replay as an HTML document. ``source`` is the name of its trace; ``curves``: of
    its requirements (``requirements.curves_of``)."""
    return document(
        f"{replay.name}: replay",
        _asset("replay.css"),
        data_element("run", encoded(replay, source) | {"curves": list(curves)}),
        f"<script>\n{_asset('replay.js')}</script>",
    )


def page_of_trace(trace: Trace, source: str) -> str:
    """Return the page of a trace, with the curves of its requirements."""
    return page_of(replay_of(trace), source, curves_of(trace))


def document(title: str, style: str, *scripts: str) -> str:
    """Return a page of its own: head and policy, an element ``app`` to draw in, and script
    elements."""
    return _DOCUMENT.format(title=escape(title), style=style, scripts="\n".join(scripts))


def data_element(name: str, data: object) -> str:
    """Return a script element with data that the page's program reads by this id."""
    return f'<script type="application/json" id="{name}">{embedded(data)}</script>'


def embedded(data: object) -> str:
    """Return JSON that can stand in a script element whatever its strings hold.

    No ``<`` is left, hence no ``</script>`` and no ``<!--``; the two line separators of Unicode
    are escaped by ``ensure_ascii``."""
    text = json.dumps(data, ensure_ascii=True, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@cache
def _asset(name: str) -> str:
    return files("safenav.report.page").joinpath("assets", name).read_text(encoding="utf-8")
