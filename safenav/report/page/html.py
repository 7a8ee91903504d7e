"""One self-contained HTML file: style, program and run. It needs no network.

The program is built from ``front/`` (TypeScript, Preact, esbuild) and committed, since users of
safenav have no Node. A content security policy in the page forbids every request.
The robustness of requirements is shown as curves on the timeline."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files

from safenav.errors import SafenavError
from safenav.report.page.encode import encoded
from safenav.run.reading import run_of
from safenav.run.run import Run
from safenav.trace.reading import Trace


def curves_of(trace: Trace) -> list[dict[str, object]]:
    """Return a curve for each requirement of a trace's scenario. They need the run's motion: where
    there is none, or a requirement cannot be evaluated, all are undecided and give the reason."""
    requirements = trace.header.scenario.requirements
    if not requirements:
        return []
    try:
        from safenav.motion.making import motion_of
        from safenav.motion.requirements import curves

        return curves(motion_of(trace), trace)
    except ModuleNotFoundError as error:
        why = f"it needs the extra 'motion' ({error.name} is not installed)"
    except SafenavError as error:
        why = str(error).partition("\n")[0]
    return [
        {"name": name, "told": f"{text}: not evaluated: {why}", "verdict": "undecided"}
        | {"points": [[0, 0]]}
        for name, text in requirements.items()
    ]


_DOCUMENT = """\
<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="safenav">
<link rel="icon" href="data:,">
<title>{title}</title>
{head}
</head>
<body>
<div id="app"><noscript>This page needs JavaScript.</noscript></div>
{scripts}
</body>
</html>
"""

_ALONE = """\
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; \
style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:">
<style>
{style}</style>"""


def page_of(run: Run, source: str, curves: Sequence[Mapping[str, object]] = ()) -> str:
    """Return the replay as an HTML document. ``source``: the name of its trace; ``curves``: those
    of its requirements (``curves_of``)."""
    return document(
        f"{run.name}: replay",
        data_element("run", encoded(run, source) | {"curves": list(curves)}),
    )


def page_of_trace(trace: Trace, source: str) -> str:
    """Return the page of a trace, with the curves of its requirements."""
    return page_of(run_of(trace), source, curves_of(trace))


def document(title: str, *data: str) -> str:
    """Return a self-contained page with its policy and elements with its data."""
    head = _ALONE.format(style=asset("page.css"))
    return framed(title, head, *data, f"<script>\n{asset('page.js')}</script>")


def framed(title: str, head: str, *scripts: str) -> str:
    """Return a page with ``head`` in its head, and ``scripts`` after the element ``app``."""
    return _DOCUMENT.format(title=escape(title), head=head, scripts="\n".join(scripts))


def data_element(name: str, data: object) -> str:
    """Return a script element with data that the page's program reads by this id."""
    return f'<script type="application/json" id="{name}">{embedded(data)}</script>'


def embedded(data: object) -> str:
    """Return JSON that is safe in a script element for any strings.

    No ``<`` is left, hence no ``</script>`` and no ``<!--``; the two line separators of Unicode
    are escaped by ``ensure_ascii``."""
    text = json.dumps(data, ensure_ascii=True, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@cache
def asset(name: str) -> str:
    """Return the text of a built file of a page."""
    return files(__package__).joinpath("assets", name).read_text(encoding="utf-8")
