"""Scenarios, results and runs as HTML for notebooks, and a progress bar.

``safenav/__init__.py`` attaches the drawings to the public classes.
"""

from __future__ import annotations

import time
from html import escape
from typing import Any

from safenav.report.page.html import page_of
from safenav.report.picture.scenario import scene_of
from safenav.report.picture.scene import svg_of
from safenav.report.replay.timeline import Replay
from safenav.runtime.mission import RunResult
from safenav.scenario.model import Scenario
from safenav.trace import records
from safenav.trace.words import seconds_words

_UPDATE_SECONDS = 0.1


def svg_of_scenario(scenario: Scenario) -> str:
    return svg_of(scene_of(scenario))


def frame_of_replay(replay: Replay, height: int = 640) -> str:
    """Return the page of a run in a frame of ``height`` pixels; it needs no network."""
    page = escape(page_of(replay, f"{replay.name}.jsonl"), quote=True)
    return (
        f'<iframe srcdoc="{page}" width="100%" height="{height}" style="border: 0" '
        'sandbox="allow-scripts allow-downloads"></iframe>'
    )


def table_of_result(result: RunResult) -> str:
    rounds = ", ".join(f"{robot} {count}" for robot, count in result.rounds.items())
    work = seconds_words(result.synthesis_seconds)
    rows = (
        ("outcome", result.outcome.value.replace("_", " ")),
        ("", result.explanation),
        ("ticks", str(result.ticks)),
        ("rounds", rounds),
        ("syntheses", f"{result.syntheses} ({work} summed)"),
        ("time", seconds_words(result.seconds)),
    )
    cells = "".join(f"<tr><th>{escape(k)}</th><td>{escape(v)}</td></tr>" for k, v in rows)
    return f'<table style="text-align: left">{cells}</table>'


class ProgressBar:
    """A listener that shows the progress of a run in a notebook: ``Mission(scenario,
    listeners=[ProgressBar(scenario)])``. Outside of a notebook it shows nothing.

    ``display``: function that shows HTML and can update it (default: IPython's, if available)."""

    def __init__(self, scenario: Scenario, display: Any = None) -> None:
        self._wanted = scenario.until.rounds * len(scenario.robots)
        self._each = scenario.until.rounds
        self._restarts = scenario.restarts_rounds
        begun = {} if scenario.begun is None else scenario.begun.robots
        self._rounds = {
            r.name: begun[r.name].rounds if r.name in begun else 0 for r in scenario.robots
        }
        self._syntheses = 0
        self._shown_at = 0.0
        self._display = _display() if display is None else display

    def __call__(self, record: records.Record) -> None:
        match record:
            case records.Goal():
                self._rounds[record.robot] = record.round
            case records.Resolved() if self._restarts(record.obstacle):
                self._rounds = dict.fromkeys(self._rounds, 0)
            case records.Synthesis():
                self._syntheses += 1
            case _:
                pass
        ended = record.outcome.value if isinstance(record, records.End) else ""
        now = time.monotonic()
        if self._display is not None and (ended or now - self._shown_at >= _UPDATE_SECONDS):
            self._shown_at = now
            self._display.update(_Html(self.html(record.tick, ended)))

    def html(self, tick: int, ended: str = "") -> str:
        """Return the bar: completed and required rounds, tick, syntheses."""
        done = sum(min(count, self._each) for count in self._rounds.values())
        verdict = ended.replace("_", " ") or "running"
        return (
            f'<progress value="{done}" max="{self._wanted}"></progress> '
            f"{done} of {self._wanted} rounds, tick {tick}, "
            f"{self._syntheses} syntheses: {escape(verdict)}"
        )


class _Html:
    def __init__(self, text: str) -> None:
        self._text = text

    def _repr_html_(self) -> str:
        return self._text


def _display() -> Any:
    """Return an updatable output of a notebook's cell; None outside of a notebook."""
    try:
        from IPython import get_ipython  # type: ignore[attr-defined,unused-ignore]
        from IPython.display import display
    except ImportError:
        return None
    if get_ipython() is None:
        return None
    return display(_Html(""), display_id=True)  # type: ignore[no-untyped-call,unused-ignore]
