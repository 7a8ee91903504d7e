"""Correct-by-construction controllers for teams of heterogeneous robots.

The names below are the public interface (docs/library.md). They are loaded on first use:
``import safenav`` alone, and so ``safenav --help``, loads nothing else.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from safenav.audit.check import check_trace as check_trace
    from safenav.report.notebook import ProgressBar as ProgressBar
    from safenav.report.replay.reading import read_replay as read_replay
    from safenav.runtime.mission import Mission as Mission
    from safenav.runtime.mission import RunResult as RunResult
    from safenav.runtime.worlds.protocol import BlockingWorld as BlockingWorld
    from safenav.runtime.worlds.protocol import World as World
    from safenav.scenario.model import Need as Need
    from safenav.scenario.model import Obstacle as Obstacle
    from safenav.scenario.model import ObstacleType as ObstacleType
    from safenav.scenario.model import ResolveAt as ResolveAt
    from safenav.scenario.model import Robot as Robot
    from safenav.scenario.model import Scenario as Scenario
    from safenav.scenario.reading.catalogue import built_in as built_in
    from safenav.scenario.reading.loader import load_scenario as load_scenario
    from safenav.spec.compile import compile_task as compile_task
    from safenav.spec.task import Task as Task
    from safenav.studio.watching import LiveView as LiveView
    from safenav.synthesis.slugs import Synthesizer as Synthesizer
    from safenav.trace.writing import TraceWriter as TraceWriter
    from safenav.verify.verification import first_failure as first_failure
    from safenav.world.map import Heading as Heading
    from safenav.world.moves import Pose as Pose

__version__ = "0.1.0"

_HOMES = {
    "BlockingWorld": "safenav.runtime.worlds.protocol",
    "Heading": "safenav.world.map",
    "LiveView": "safenav.studio.watching",
    "Mission": "safenav.runtime.mission",
    "Need": "safenav.scenario.model",
    "Obstacle": "safenav.scenario.model",
    "ObstacleType": "safenav.scenario.model",
    "Pose": "safenav.world.moves",
    "ProgressBar": "safenav.report.notebook",
    "ResolveAt": "safenav.scenario.model",
    "Robot": "safenav.scenario.model",
    "RunResult": "safenav.runtime.mission",
    "Scenario": "safenav.scenario.model",
    "Synthesizer": "safenav.synthesis.slugs",
    "Task": "safenav.spec.task",
    "TraceWriter": "safenav.trace.writing",
    "World": "safenav.runtime.worlds.protocol",
    "built_in": "safenav.scenario.reading.catalogue",
    "check_trace": "safenav.audit.check",
    "compile_task": "safenav.spec.compile",
    "first_failure": "safenav.verify.verification",
    "load_scenario": "safenav.scenario.reading.loader",
    "read_replay": "safenav.report.replay.reading",
}

__all__ = [
    "BlockingWorld",
    "Heading",
    "Mission",
    "Need",
    "Obstacle",
    "ObstacleType",
    "Pose",
    "ProgressBar",
    "ResolveAt",
    "Robot",
    "RunResult",
    "Scenario",
    "Synthesizer",
    "Task",
    "TraceWriter",
    "World",
    "__version__",
    "built_in",
    "check_trace",
    "compile_task",
    "first_failure",
    "load_scenario",
    "read_replay",
]


_DRAWINGS = {
    "safenav.scenario.model": ("Scenario", "_repr_svg_", "svg_of_scenario"),
    "safenav.report.replay.timeline": ("Replay", "_repr_html_", "frame_of_replay"),
    "safenav.runtime.mission": ("RunResult", "_repr_html_", "table_of_result"),
}
"""Per module: a class that a notebook can display, the display method, and its implementation."""


def load_ipython_extension(shell: object) -> None:
    """``%load_ext safenav``: does nothing, since objects display themselves without it."""
    del shell


def _let_draw() -> None:
    """Add display methods to the loaded classes. Done here, since lower layers must not import the
    report package; the code of a display method is loaded when a notebook calls it."""
    for module, (kind, method, draws) in _DRAWINGS.items():
        home = sys.modules.get(module)
        if home is not None and not hasattr(getattr(home, kind), method):
            setattr(getattr(home, kind), method, _drawing(draws))


def _drawing(draws: str) -> Callable[[object], str]:
    def draw(self: object) -> str:
        from safenav.report import notebook

        text: str = getattr(notebook, draws)(self)
        return text

    return draw


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    found: object = getattr(import_module(_HOMES[name]), name)
    globals()[name] = found
    _let_draw()
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
