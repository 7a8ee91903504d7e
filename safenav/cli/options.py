"""Options of commands, their types and the checks of their values.

The parameters of a command's function declare its options and arguments. This module defines shared
ones. Output paths are tried before a command begins, so that no work is lost.
"""

from __future__ import annotations

import importlib
import json
import math
import os
from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin, get_type_hints

import click
from click.core import ParameterSource

import safenav
from safenav.cli import COMMANDS, HELP
from safenav.errors import ExitCode, InputError, UsageError
from safenav.files import MOST_BYTES, decoded, kind_of, read_input, try_folder, try_out

if TYPE_CHECKING:
    from safenav.scenario.model import Scenario


class _Commands(click.Group):
    """The group of all commands. It imports a command's module only on use."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        del ctx
        return command_of(cmd_name) if cmd_name in COMMANDS else None

    def get_help(self, ctx: click.Context) -> str:
        del ctx
        return HELP.rstrip()


group = click.version_option(safenav.__version__, prog_name="safenav")(
    _Commands("safenav", context_settings={"help_option_names": ["-h", "--help"]})
)


def command_of(name: str) -> click.Command:
    """Return the command with this name from its module."""
    module = importlib.import_module(f"safenav.cli.{COMMANDS[name][0]}")
    command: click.Command = getattr(module, name)
    return command


OTHER_CODES = (
    "2  bad input or usage   3  a limit: ticks, time, memory, size",
    "4  internal or synthesizer failure   130  interrupted",
)


def command(
    examples: str, good: str = "done", negative: str = ""
) -> Callable[[Callable[..., int]], click.Command]:
    """Make a command of a function, whose parameters are the options and arguments. Its help shows
    the ``examples`` and the meanings of exit codes 0 (``good``) and 1 (``negative``)."""
    codes = [f"0  {good}", *([f"1  {negative}"] if negative else []), *OTHER_CODES]
    epilog = "\n  ".join([f"\b\nExamples:\n{examples}\b\nExit codes:", *codes])

    def made(function: Callable[..., int]) -> click.Command:
        hints = get_type_hints(function, include_extras=True)
        defaults = function.__kwdefaults__ or {}
        params = [_declared(n, hints[n], defaults.get(n)) for n in hints if n != "return"]

        @wraps(function)
        def checked(**values: Any) -> int:
            _check(click.get_current_context())
            return function(**values)

        return click.command(epilog=epilog, params=params)(checked)

    return made


def _declared(name: str, hint: Any, default: Any) -> click.Parameter:
    """Return the option or argument that a parameter declares. Its annotation has a click type
    (none for a text or a flag) and words for the help (none for an argument). A text that starts
    with a dash, such as ``"--rows N"``, states the option's names and metavar, if they differ from
    the default. A mapping contains further click settings."""
    base, *parts = get_args(hint)
    of, several = get_args(base), get_origin(base) is tuple
    usage, settings = f"--{name.replace('_', '-')}", dict[str, Any]()
    for part in parts:
        if isinstance(part, Mapping):
            settings |= part
        elif not isinstance(part, str):
            settings["type"] = part
        elif part.startswith("-"):
            usage = part
        else:
            settings["help"] = part
    required = default is None and base is not bool and type(None) not in of
    if "help" not in settings:
        metavar = f"{name.removesuffix('s').upper()}..." if several else None
        count = -1 if several else 1
        return click.Argument([name], required, metavar=metavar, nargs=count, **settings)
    words = usage.split()
    names = [word for word in words if word.startswith("-")]
    about: dict[str, Any] = {"metavar": " ".join(words[len(names) :]) or None}
    if base is bool:
        about["is_flag"] = True
    if default is not None:
        about["default"] = default
    if isinstance(default, float):
        settings["help"] += f"  [{default:g}]"
    needed = required and not several
    return click.Option([*names, name], required=needed, multiple=several, **(about | settings))


def refuse(required: str, *names: str) -> None:
    """Raise UsageError if the command line has one of these parameters, which would have no effect.
    ``required``: the options or inputs that they require."""
    context = click.get_current_context()
    for param in context.command.params:
        name = param.name or ""
        if name in names and context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            raise UsageError(f"{max(param.opts, key=len)} requires {required}")


def range_of(unit: str, least: float, most: float, *, beyond: bool = False) -> click.FloatRange:
    """Return a range of numbers. ``unit``: the unit in the help; ``beyond``: exclude ``least``."""
    found = click.FloatRange(least, most, min_open=beyond)
    found.name = unit
    return found


BEGINNING = 5_000_000
"""Initial bytes of a file that show its kind."""
KINDS = (
    *(".csv", ".dot", ".gif", ".graphml", ".html", ".json", ".jsonl", ".map", ".mcap", ".npz"),
    *(".pdf", ".pgm", ".png", ".slugsin", ".structuredslugs", ".svg", ".txt", ".xml"),
    *(".yaml", ".yml", ".zip"),
)
"""File endings of known kinds."""


class Output(click.Path):
    """A path to write; ``-`` is standard output.

    ``endings``: file endings of this kind of output (none: any). If there are several, each is a
    format, and a path must have one of them. ``folder``: whether any other path is a folder, and
    ``-`` is allowed only if ``printed``.
    """

    def __init__(self, *endings: str, folder: bool = False, printed: bool = False) -> None:
        super().__init__(path_type=Path)
        self._endings = endings
        self._folder = folder
        self._printed = printed or not folder

    def check(self, path: Path) -> None:
        """Raise UsageError for an unwritable path or one with the ending of another kind of
        file."""
        if str(path) == "-" and self._printed:
            return
        strict = self._folder or bool(self._endings)
        known = len(self._endings) > 1 or path.suffix.lower() in KINDS
        other = known and path.suffix.lower() not in self._endings
        if str(path) == "-" or (strict and other and not path.is_dir()):
            if path.is_file():
                problem = f"cannot write {path}: it would overwrite a file of another kind"
                raise UsageError(f"{problem}\n    give another name")
            *others, last = self._endings or ("",)
            names = f"a name in {', '.join(others)} or {last}" if others else f"a name in {last}"
            expected = ["a folder"] * self._folder + [names] * bool(last)
            raise UsageError(f"{path}: expected {' or '.join(expected)}")
        if self.is_folder(path):
            try_folder(path)
        else:
            try_out(path)

    def is_folder(self, path: Path) -> bool:
        """Return whether the output is a folder for files, not a file."""
        return self._folder and path.suffix not in self._endings


def _check(context: click.Context) -> None:
    """Raise UsageError for a value that is not a number, an unwritable output, and an output that
    another parameter also names. Devices and pipes may be named twice."""
    named = list[tuple[str, Path, click.Path]]()
    for param in context.command.params:
        value, kind = context.params[param.name or ""], param.type
        option = isinstance(param, click.Option)
        words = max(param.opts, key=len) if option else f"the {param.name}"
        if isinstance(value, float) and math.isnan(value):
            raise UsageError(f"{words} {value} is not a number")
        if param.name == "as_json" and value:
            value, kind = Path("-"), Output()
        if value and isinstance(kind, click.Path):
            paths = value if isinstance(value, tuple) else (value,)
            named += [(words, Path(path), kind) for path in paths]
    for words, path, kind in named:
        if str(path).startswith("-") and str(path) != "-":
            raise UsageError(f"{words}: found the option {path}, expected a path")
        if not isinstance(kind, Output):
            continue
        for other, same, its in named:
            if other == words or os.path.realpath(same) != os.path.realpath(path):
                continue
            if str(path) == "-" and isinstance(its, Output):
                both = f"{words} and {other}"
                raise UsageError(f"{both} both print to standard output: give one of them")
            whole = path.is_file() or not (path.exists() or kind.is_folder(path))
            if str(path) != "-" and whole:
                raise UsageError(f"{words} {path} would overwrite {other}; give another file")
        kind.check(path)


INPUT = click.Path(path_type=Path)
FOLDER = Output(folder=True)
SECONDS = range_of("s", 0, 1e9, beyond=True)
"""A duration or a time of a run in seconds."""
PIXELS = click.IntRange(100, 8000)
COUNT = click.IntRange(min=1)
HERTZ = range_of("hz", 0.1, 10_000)
"""Samples per second."""

InputFile = Annotated[Path, INPUT]
InputOption = Annotated[Path | None, INPUT]
Lines = Annotated[Path | None, Output(".jsonl")]
AsJson = Annotated[bool, "--json", "Print the result as JSON."]
Cols = Annotated[int | None, COUNT, "--cols N", "Columns of a map file."]
Html = Annotated[Path | None, Output(".html"), "Write the replay as one HTML page."]
Live = Annotated[bool, "Watch the run in a browser."]
MaxTicks = Annotated[
    int | None, click.IntRange(1, 2**31 - 1), "--max-ticks N", "Maximum number of ticks."
]
NoMap = Annotated[bool, "Do not print the initial map."]
Operator = Annotated[bool, "Prompt for interventions in a live run, even without a terminal."]
Robot = Annotated[str | None, "--robot NAME", "Only this robot."]
Rows = Annotated[int | None, COUNT, "--rows N", "Rows of a map file."]
Share = Annotated[float | None, range_of("x", 0, 1), "Blocked share that makes a wall."]
Side = Annotated[float | None, range_of("m", 0, 1e6, beyond=True), "Side of a region in metres."]
TimeLimit = Annotated[float | None, SECONDS, "Time limit in seconds (live: on its clock)."]
Trace = Annotated[Lines, "Write the trace (JSON Lines)."]


class GivenFile:
    """An input file, recognized by its content. It is read once, since standard input and pipes
    cannot be read again. ``most``: the maximum number of bytes."""

    def __init__(self, path: Path, most: int = MOST_BYTES) -> None:
        self.path = path
        self.name = str(path)
        self._content, self._failure = b"", None
        try:
            self._content = read_input(path, most)
        except InputError as error:
            self._failure = error
        self.beginning = self._content[:BEGINNING].decode("utf-8", "replace")
        self.kind = kind_of(self.beginning)

    def bytes(self) -> bytes:
        """Return the content of the file. Raises InputError."""
        if self._failure is not None:
            raise self._failure
        return self._content

    def text(self) -> str:
        """Return the text of the file. Raises InputError."""
        return decoded(self.bytes(), self.name)


def loaded(file: GivenFile, robot: str | None) -> tuple[Scenario, InputError | None, list[str]]:
    """Return a scenario, the error about unreachable targets if it has any, and the robots of a
    command: only ``robot`` or all. Raises UsageError if there is no such robot."""
    from safenav.scenario.reading.loader import load_scenario_text

    text, refused = file.text(), None
    try:
        plan = load_scenario_text(text, file.name)
    except InputError as error:
        plan, refused = load_scenario_text(text, file.name, reachable=False), error
    names = [each.name for each in plan.robots]
    if robot is not None and robot not in names:
        raise UsageError(f"{file.name}: there is no robot '{robot}'; it has {', '.join(names)}")
    return plan, refused, names if robot is None else [robot]


def print_json(data: object) -> None:
    """Print the result of a command as JSON."""
    click.echo(json.dumps(data, indent=2))


def code_of(good: bool) -> ExitCode:
    """Return the exit code of a command that judges files."""
    return ExitCode.OK if good else ExitCode.NEGATIVE
