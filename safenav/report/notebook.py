"""Scenarios, results and runs as HTML for notebooks.

``safenav/__init__.py`` attaches the drawings to the public classes.
"""

from html import escape

from safenav.report.page.html import page_of
from safenav.report.picture.scene import svg_of_scenario
from safenav.run.run import Run
from safenav.runtime.run.mission import RunResult
from safenav.trace.words import seconds_words

__all__ = ["frame_of_run", "svg_of_scenario", "table_of_result"]


def frame_of_run(run: Run, height: int = 640) -> str:
    """Return the page of a run in a frame of ``height`` pixels; it needs no network."""
    page = escape(page_of(run, f"{run.name}.jsonl"), quote=True)
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
