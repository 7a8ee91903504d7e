"""Correct-by-construction controllers for teams of heterogeneous robots.

The public interface (docs/library.md) consists of the names of ``__init__.pyi``. They are loaded on
first use: ``import safenav``, and so ``safenav --help``, loads nothing else.
"""

import re
from importlib import import_module
from pathlib import Path

__version__ = "0.1.0"


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
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_homes()})
