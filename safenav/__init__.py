"""Correct-by-construction controllers for teams of heterogeneous robots.

The names below are the library's face (docs/library.md). They are loaded when they are used:
``import safenav`` alone, and so ``safenav --help``, loads nothing else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from safenav.runtime.environment import World as World
    from safenav.runtime.mission import Mission as Mission
    from safenav.scenario.reading.loader import load_scenario as load_scenario
    from safenav.synthesis.slugs import Synthesizer as Synthesizer

__version__ = "0.1.0"

__all__ = ["Mission", "Synthesizer", "World", "__version__", "load_scenario"]

_HOMES = {
    "Mission": "safenav.runtime.mission",
    "Synthesizer": "safenav.synthesis.slugs",
    "World": "safenav.runtime.environment",
    "load_scenario": "safenav.scenario.reading.loader",
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    found: object = getattr(import_module(_HOMES[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
