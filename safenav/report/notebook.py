"""Scenarios and runs that draw themselves in a notebook: ``%load_ext safenav``.

IPython asks formatters for what it does not know; these are registered for scenarios (a drawing)
and replays (the page, in a frame).
"""

from __future__ import annotations

from html import escape
from typing import Any

from safenav.report.page.html import page_of
from safenav.report.picture.scenario import scene_of
from safenav.report.picture.scene import Options, svg_of
from safenav.report.replay.timeline import Replay
from safenav.scenario.model import Scenario


def register(shell: Any) -> None:
    """Teach an IPython shell to draw scenarios and replays."""
    formatters = shell.display_formatter.formatters
    formatters["image/svg+xml"].for_type(Scenario, svg_of_scenario)
    formatters["text/html"].for_type(Replay, frame_of_replay)


def svg_of_scenario(scenario: Scenario) -> str:
    """The scenario before any run, with the numbers of its regions."""
    return svg_of(scene_of(scenario), Options(numbers=True))


def frame_of_replay(replay: Replay, height: int = 640) -> str:
    """The page of a run in a frame of its own; it needs no network."""
    page = escape(page_of(replay, f"{replay.name}.jsonl"), quote=True)
    return (
        f'<iframe srcdoc="{page}" width="100%" height="{height}" style="border: 0" '
        'sandbox="allow-scripts allow-downloads"></iframe>'
    )
