"""Correct-by-construction controllers for teams of heterogeneous robots.

The names below are the public interface (docs/library.md). They are loaded on first use:
``import safenav`` alone, and so ``safenav --help``, loads nothing else.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from safenav.checked_trace import check_trace as check_trace
    from safenav.run.reading import read_run as read_run
    from safenav.runtime.intervention.kinds import AddObstacle as AddObstacle
    from safenav.runtime.intervention.kinds import AssignObjective as AssignObjective
    from safenav.runtime.intervention.kinds import GiveUp as GiveUp
    from safenav.runtime.intervention.kinds import MarkPermanent as MarkPermanent
    from safenav.runtime.intervention.kinds import MarkResolved as MarkResolved
    from safenav.runtime.intervention.kinds import PlaceOrder as PlaceOrder
    from safenav.runtime.intervention.kinds import PutBack as PutBack
    from safenav.runtime.intervention.kinds import RemoveObstacle as RemoveObstacle
    from safenav.runtime.intervention.kinds import SetInput as SetInput
    from safenav.runtime.intervention.kinds import SetService as SetService
    from safenav.runtime.intervention.kinds import SetTruth as SetTruth
    from safenav.runtime.intervention.reading import read_intervention as read_intervention
    from safenav.runtime.run.checkpoint import resumption as resumption
    from safenav.runtime.run.checkpoint import scenario_of as scenario_of
    from safenav.runtime.run.mission import Mission as Mission
    from safenav.runtime.run.mission import RunResult as RunResult
    from safenav.runtime.worlds.protocol import Acted as Acted
    from safenav.runtime.worlds.protocol import Arrived as Arrived
    from safenav.runtime.worlds.protocol import Blocked as Blocked
    from safenav.runtime.worlds.protocol import BlockingWorld as BlockingWorld
    from safenav.runtime.worlds.protocol import Elsewhere as Elsewhere
    from safenav.runtime.worlds.protocol import Failed as Failed
    from safenav.runtime.worlds.protocol import Lost as Lost
    from safenav.runtime.worlds.protocol import PausingWorld as PausingWorld
    from safenav.runtime.worlds.protocol import PlacingWorld as PlacingWorld
    from safenav.runtime.worlds.protocol import RememberingWorld as RememberingWorld
    from safenav.runtime.worlds.protocol import Sensed as Sensed
    from safenav.runtime.worlds.protocol import TimedWorld as TimedWorld
    from safenav.runtime.worlds.protocol import World as World
    from safenav.runtime.worlds.protocol import WorldEvent as WorldEvent
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
    from safenav.trace.reading import read_trace as read_trace
    from safenav.trace.vocabulary import ActResult as ActResult
    from safenav.trace.writing import TraceWriter as TraceWriter
    from safenav.verify.verification import first_failure as first_failure
    from safenav.world.map import Heading as Heading
    from safenav.world.moves import Pose as Pose

__version__ = "0.1.0"

_MODULES = {
    "safenav.checked_trace": "check_trace",
    "safenav.run.reading": "read_run",
    "safenav.runtime.intervention.kinds": "AddObstacle AssignObjective GiveUp MarkPermanent "
    "MarkResolved PlaceOrder PutBack RemoveObstacle SetInput SetService SetTruth",
    "safenav.runtime.intervention.reading": "read_intervention",
    "safenav.runtime.run.checkpoint": "resumption scenario_of",
    "safenav.runtime.run.mission": "Mission RunResult",
    "safenav.runtime.worlds.protocol": "Acted Arrived Blocked BlockingWorld Elsewhere Failed Lost "
    "PausingWorld PlacingWorld RememberingWorld Sensed TimedWorld World WorldEvent",
    "safenav.scenario.model": "Need Obstacle ObstacleType ResolveAt Robot Scenario",
    "safenav.scenario.reading.catalogue": "built_in",
    "safenav.scenario.reading.loader": "load_scenario",
    "safenav.spec.compile": "compile_task",
    "safenav.spec.task": "Task",
    "safenav.studio.watching": "LiveView",
    "safenav.synthesis.slugs": "Synthesizer",
    "safenav.trace.reading": "read_trace",
    "safenav.trace.vocabulary": "ActResult",
    "safenav.trace.writing": "TraceWriter",
    "safenav.verify.verification": "first_failure",
    "safenav.world.map": "Heading",
    "safenav.world.moves": "Pose",
}
"""The public names by module."""
_HOMES = {name: module for module, names in _MODULES.items() for name in names.split()}

__all__ = sorted({"__version__", *_HOMES} - {"LiveView"})  # which needs the extra of the studio

_DRAWINGS = {
    "safenav.scenario.model": ("Scenario", "_repr_svg_", "svg_of_scenario"),
    "safenav.run.run": ("Run", "_repr_html_", "frame_of_run"),
    "safenav.runtime.run.mission": ("RunResult", "_repr_html_", "table_of_result"),
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


if not TYPE_CHECKING:  # a type checker would otherwise accept any name

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
