"""Options that several commands have, their types, and checks of their values.

Paths to write are tried before a command begins, so that no work is lost.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from safenav.errors import InputError, UsageError
from safenav.files import try_folder, try_out

if TYPE_CHECKING:
    from safenav.scenario.model import Scenario

Command = TypeVar("Command", bound=Callable[..., Any])


def refuse(unread: Mapping[str, str]) -> None:
    """Raises UsageError for an option on the command line that nothing reads. ``unread``: by
    parameter, the options or inputs that it requires."""
    context = click.get_current_context()
    for param in context.command.params:
        name = param.name or ""
        if name in unread and context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            off = param.secondary_opts if context.params[name] is False else ()
            raise UsageError(f"{max(off or param.opts, key=len)} requires {unread[name]}")


class FiniteRange(click.FloatRange):
    """A finite number in a range."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number


class _Input(click.Path):
    """A path to read, or a pattern of such paths (as text)."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = super().convert(value, param, ctx)
        _claim(Path(str(path)), param, ctx, writes=False)
        return path


KINDS = (
    *(".csv", ".dot", ".gif", ".graphml", ".html", ".json", ".jsonl", ".map", ".mcap", ".npz"),
    *(".pdf", ".pgm", ".png", ".slugsin", ".structuredslugs", ".svg", ".txt", ".xml"),
    *(".yaml", ".yml", ".zip"),
)
"""Endings of files of known kinds."""


class Output(click.ParamType[Path]):
    """A path to write; ``-`` is standard output. Raises UsageError if it cannot be written, or if
    its ending is that of another kind of file.

    ``endings``: endings of files of this kind, empty if there are several kinds; ``folder``: any
    other path is a folder, and ``-`` is allowed only if ``printed``.
    """

    name = "path"

    def __init__(self, *endings: str, folder: bool = False, printed: bool = False) -> None:
        self._endings = endings
        self._folder = folder
        self._printed = printed or not folder

    def convert(
        self, value: str | Path, param: click.Parameter | None, ctx: click.Context | None
    ) -> Path:
        path = Path(value)
        if str(path) == "-" and self._printed:
            return path
        strict = self._folder or bool(self._endings)
        other = path.suffix.lower() in KINDS and path.suffix.lower() not in self._endings
        if str(path) == "-" or (strict and other and not path.is_dir()):
            if path.is_file():
                problem = f"cannot write {path}: it would overwrite a file of another kind"
                raise UsageError(f"{problem}\n    give another name")
            *others, last = self._endings or ("",)
            names = f"a name in {', '.join(others)} or {last}" if others else f"a name in {last}"
            expected = ["a folder"] * self._folder + [names] * bool(last)
            raise UsageError(f"{path}: expected {' or '.join(expected)}")
        if self._folder and path.suffix not in self._endings:
            try_folder(path)
        else:
            _claim(path, param, ctx, writes=True)
            try_out(path)
        return path


def _claim(
    path: Path, param: click.Parameter | None, ctx: click.Context | None, *, writes: bool
) -> None:
    """Raises UsageError if another parameter names the same file, and one of both is an output."""
    special = str(path) == "-" or (path.exists() and not path.is_file())
    if special or param is None or ctx is None:
        return
    claims: dict[Path, tuple[click.Parameter, bool]] = ctx.meta.setdefault(__name__, {})
    other, written = claims.setdefault(Path(os.path.realpath(path)), (param, writes))
    if other is not param and (writes or written):
        one, kept = map(_words, (param, other) if writes else (other, param))
        raise UsageError(f"{one} {path} would overwrite {kept}; give another file")


def _words(param: click.Parameter) -> str:
    return max(param.opts, key=len) if isinstance(param, click.Option) else f"the {param.name}"


INPUT = _Input(path_type=Path)
TEXT_INPUT = _Input(path_type=str)
LINES = Output(".jsonl")
FOLDER = Output(folder=True)
SECONDS = FiniteRange(min=0, min_open=True, max=1e9)
"""A duration, or a time of a run, in seconds."""
METRES = FiniteRange(min=0, min_open=True, max=1e6)
PIXELS = click.IntRange(100, 8000)
COUNT = click.IntRange(min=1)
SEED = click.IntRange(min=0)


def output(
    *endings: str, folder: bool = False, printed: bool = False, required: bool = False, help: str
) -> Callable[[Command], Command]:
    """Add the option ``-o``, ``--output``: a file with one of these endings (none: any), a folder,
    or standard output (as Output)."""
    kind = Output(*endings, folder=folder, printed=printed)
    return click.option("-o", "--output", type=kind, required=required, help=help)


live = click.option("--live", is_flag=True, help="Watch the run in a browser.")
operator = click.option(
    "--operator", type=TEXT_INPUT, metavar="FILE", help="Interventions of live runs (-: prompt)."
)
as_json = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
html = click.option("--html", type=Output(".html"), help="Write the replay as one HTML page.")
max_ticks = click.option("--max-ticks", type=COUNT, metavar="N", help="Stop after these ticks.")
time_limit = click.option(
    "--time-limit", type=SECONDS, metavar="S", help="Stop after these seconds (of a live clock)."
)
seed = click.option("--seed", type=SEED, metavar="N", help="Override the scenario's seed.")
trace = click.option("--trace", type=LINES, help="Write the trace (JSON Lines).")
motion = click.option("--motion", type=LINES, help="Write the motion in metres and seconds.")
maps = click.option("--map/--no-map", "maps", default=True, help="Draw the map at main events.")
robot = click.option("--robot", metavar="NAME", help="Only this robot.")
_DIVISION = (
    click.option("--rows", type=COUNT, metavar="N", help="Rows of a map file."),
    click.option("--cols", type=COUNT, metavar="N", help="Columns of a map file."),
    click.option("--side", type=METRES, metavar="M", help="Side of a region in metres."),
    click.option("--share", type=FiniteRange(0, 1), metavar="X", help="Blocked share of a wall."),
)


def division(command: Command) -> Command:
    """Add the options that divide a map file into regions: ``--rows``, ``--cols``, ``--side``
    (metres) and ``--share`` (by default, any blocked pixel makes a wall)."""
    for option in reversed(_DIVISION):
        command = option(command)
    return command


def loaded(file: Path, robot: str | None) -> tuple[Scenario, InputError | None, list[str]]:
    """Return a scenario that may have unreachable targets, the error if it has, and the robots
    that a command is about."""
    from safenav.scenario.reading.loader import load_scenario

    refused = None
    try:
        plan = load_scenario(file)
    except InputError as error:
        plan, refused = load_scenario(file, reachable=False), error
    check_robot(robot, plan, file)
    return plan, refused, [each.name for each in plan.robots] if robot is None else [robot]


def check_robot(name: str | None, scenario: Scenario, file: Path) -> None:
    """Raises UsageError if a name is given that no robot of the file's scenario has."""
    names = [robot.name for robot in scenario.robots]
    if name is not None and name not in names:
        raise UsageError(f"{file}: there is no robot '{name}'; it has {', '.join(names)}")
