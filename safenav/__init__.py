"""Correct-by-construction controllers for teams of heterogeneous robots.

The public interface (docs/library.md) consists of the names of ``__init__.pyi``. They are loaded on
first use: ``import safenav`` alone, and so ``safenav --help``, loads nothing else.
"""

import re
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

__version__ = "0.1.0"

_DRAWINGS = {
    "safenav.scenario.model": ("Scenario", "_repr_svg_", "svg_of_scenario"),
    "safenav.run.run": ("Run", "_repr_html_", "frame_of_run"),
    "safenav.runtime.run.mission": ("RunResult", "_repr_html_", "table_of_result"),
}
"""Per module: a class that a notebook can display, the display method, and its implementation."""


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


def _homes() -> dict[str, str]:
    """Return the modules of the public names."""
    stub = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    return {name: home for home, name in re.findall(r"(?m)^from (\S+) import (\w+)", stub)}


def __getattr__(name: str) -> object:
    homes = _homes()
    if name == "__all__":
        return sorted({"__version__", *homes})
    if name not in homes:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found: object = getattr(import_module(homes[name]), name)
    globals()[name] = found
    _let_draw()
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_homes()})
