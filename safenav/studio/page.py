"""The page of the studio and its files, from ``assets/`` (built from report/page/front)."""

from __future__ import annotations

from functools import cache
from html import escape
from importlib.resources import files

FILES = {"studio.js": "text/javascript", "studio.css": "text/css"}

_PAGE = """\
<!doctype html>
<html lang="en" data-theme="auto">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="safenav">
<link rel="icon" href="data:,">
<link rel="stylesheet" href="studio.css">
<title>{title}</title>
</head>
<body>
<div id="app"><noscript>The studio needs JavaScript.</noscript></div>
<script src="studio.js"></script>
</body>
</html>
"""


def page(title: str) -> str:
    """The document that loads everything else."""
    return _PAGE.format(title=escape(title))


@cache
def asset(name: str) -> str:
    """A file of the page."""
    return files("safenav.studio").joinpath("assets", name).read_text(encoding="utf-8")
