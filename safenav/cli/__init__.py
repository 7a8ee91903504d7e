"""The command line: modules of commands, loaded on use.

Only ``main`` turns exceptions into exit statuses.
"""

import errno
import io
import os
import re
import signal
import stat
import sys
import warnings
from collections.abc import Iterable
from typing import Any, NoReturn

from safenav import errors

COMMANDS = {
    "run": ("run", "Run a scenario and print what happens."),
    "resume": ("run", "Continue a run that was cut off, or ended at a limit."),
    "drive": ("run", "Run a scenario with real robots, or rehearse it."),
    "synth": ("synth", "Synthesize the controllers and write them to files."),
    "verify": ("synth", "Check a strategy file against its specification."),
    "check": ("check", "Judge scenarios, traces, bundles and motions."),
    "explain": ("synth", "Explain why a robot is unrealizable, and propose repairs."),
    "batch": ("batch", "Run many scenarios and compare each with its expectations."),
    "certify": ("check", "Run a scenario and write a bundle that proves the run."),
    "replay": ("replay", "Replay a trace: a page, pictures, or 3D."),
    "draw": ("replay", "Draw a scenario without running it."),
    "export": ("export", "Export a trace: waypoints, motion, samples, ROS 2 bag."),
    "studio": ("new", "Draw and run a scenario in a browser, and change its world."),
    "new": ("new", "Write an example scenario, or a schema."),
    "doctor": ("new", "List the installed parts and test the synthesizer."),
}
"""The module of each command and its line of help."""

_NAMES = "\n".join(f"  {name:7}  {words}" for name, (_, words) in COMMANDS.items())
HELP = f"""\
Usage: safenav [OPTIONS] COMMAND [ARGS]...

  Correct-by-construction controllers for teams of heterogeneous robots.

  A scenario (YAML) holds a map, robots, their objectives and obstacles
  unknown to them. Each robot gets a synthesized controller.

  Examples:
    safenav new lab.yaml && safenav run lab.yaml

Options:
  --version   Show the version and exit.
  -h, --help  Show this message and exit.

Commands:
{_NAMES}

  Exit codes:
    0  as expected: completed, realizable   2  bad input or usage
    1  a negative result: operator needed, unrealizable, expectation not met
    3  a limit: ticks, time, memory, size   4  internal or synthesizer failure
    130  interrupted
  Environment:
    SAFENAV_SLUGS  another build of slugs
    SAFENAV_CACHE  directory of the synthesis cache, or 'off'
    NO_COLOR       no colours
"""


def main() -> None:
    """Run the ``safenav`` command. SIGTERM and SIGHUP end the command like Ctrl-C: its subprocesses
    end, and its temporary files are deleted."""
    try:
        _open_closed_streams()
        if stat.S_ISFIFO(os.fstat(1).st_mode):
            output = io.BufferedWriter(_Pipe(1, "w", closefd=False))
            sys.stdout = io.TextIOWrapper(output, sys.stdout.encoding, sys.stdout.errors)
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) is signal.SIG_DFL:
                signal.signal(number, signal.default_int_handler)
        warnings.showwarning = lambda message, *_, **__: warn(message)
        if sys.argv[1:] in (["-h"], ["--help"]):  # without click, whose import takes 20 ms
            print(HELP, end="", flush=True)
            sys.exit(errors.ExitCode.OK)
        from safenav.cli.options import group

        words = sys.argv[1:] or ["--help"]
        status = group.main(words, "safenav", standalone_mode=False, color=_coloured())
        sys.exit(status if isinstance(status, int) else errors.ExitCode.OK)
    except SystemExit:
        raise
    except BaseException as error:
        if errors.follows_an_interruption(error):
            _fail("interrupted", errors.ExitCode.INTERRUPTED)
        message, code = _ending(error)
        if code is errors.ExitCode.INTERNAL and os.environ.get("SAFENAV_DEBUG"):
            raise
        _fail(message, code)


def _ending(error: BaseException) -> tuple[str, errors.ExitCode]:
    """Return the message and exit code of a command ended by an error."""
    from difflib import get_close_matches

    import click

    match error:
        case errors.SafenavError():
            return str(error), error.exit_code
        case click.ClickException():
            message = re.sub(r"valid \w{1,2}$", "number", error.format_message().rstrip("."))
            message = message.replace("valid integer range", "whole number")  # without type names
            context = getattr(error, "ctx", None)
            listed = "commands" if context and context.parent is None else "options"
            hint = f"\n    {context.command_path} --help lists the {listed}" if context else ""
            if context and isinstance(error, click.MissingParameter):
                hint = f"\n    {context.get_usage()}"
            close = get_close_matches(sys.argv[1], COMMANDS, 1) if listed == "commands" else ()
            meant = f". Did you mean '{close[0]}'?" if close else ""
            return f"{message[:1].lower()}{message[1:]}{meant}{hint}", errors.ExitCode.BAD_INPUT
        case OSError(errno=errno.ENAMETOOLONG | errno.ELOOP):
            return f"{errors.file_words(error)}\n    choose another name", errors.ExitCode.BAD_INPUT
        case OSError(errno=errno.ENOSPC | errno.EDQUOT | errno.EFBIG):
            return f"cannot write the output: {errors.file_words(error)}", errors.ExitCode.BAD_INPUT
        case ImportError(name="numpy" | "daqp" as missing):
            user = " ".join(["safenav", *sys.argv[1:2]])
            return str(errors.missing_package(user, missing, "motion")), errors.ExitCode.BAD_INPUT
    return (
        f"internal error: {type(error).__name__}: {error}\n"
        "    this is a defect of safenav; set SAFENAV_DEBUG=1 to see where it happened",
        errors.ExitCode.INTERNAL,
    )


def _open_closed_streams() -> None:
    """Open the null device for each standard stream that is initially closed (by a service or
    script, ``>&-``). Otherwise the next opened file would become that stream."""
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
            setattr(sys, name, os.fdopen(number, mode, encoding="utf-8"))


class _Pipe(io.FileIO):
    """Output that is discarded after its reader has closed it (``safenav ... | head``). The command
    continues, and its exit code depends only on its result."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            return memoryview(data).nbytes


def _coloured() -> bool | None:
    """Return False if the user wants no colours, else None (colours only on a terminal)."""
    return False if os.environ.get("NO_COLOR") else None


def warn(message: Warning | str) -> None:
    """Print a warning."""
    _say("warning:", 33, str(message))


def warn_of(lines: Iterable[str]) -> None:
    """Print warnings, each with its indented lines."""
    for line in lines:
        print(line, file=sys.stderr) if line.startswith(" ") else warn(line)


def report_error(message: str) -> None:
    """Print an error."""
    from safenav.files import printable

    _say("error:", 31, printable(message))


def _say(word: str, colour: int, message: str) -> None:
    """Print a message on standard error. On a terminal its first word is bold and coloured."""
    if _coloured() is None and sys.stderr.isatty():
        word = f"\x1b[{colour}m\x1b[1m{word}\x1b[0m"
    print(f"{word} {message}", file=sys.stderr)


def _fail(message: str, code: errors.ExitCode) -> NoReturn:
    try:
        report_error(message)
    except OSError:  # a closed terminal ends the program like Ctrl-C
        code = errors.ExitCode.INTERRUPTED
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:  # Python would try again at its exit and fail with its own code
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    sys.exit(code)
