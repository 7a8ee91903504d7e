"""Files: reading within limits, kinds of files, line ends, JSON lines and atomic writing.

A line ends with a line feed, perhaps after a carriage return. Python, YAML and some editors also
end lines at other characters (U+0085, U+2028, a single carriage return). So ``# a comment<U+2028>a
formula`` is a comment for one program and a formula for another. Texts with such characters are
refused.
"""

import json
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from safenav.errors import Diagnostic, InputError, UsageError

_FOREIGN = re.compile(
    r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufffe\uffff]|\r(?!\n|\Z)"
)

HINT = "remove it: programs disagree on what it means, for example on whether a line ends there"


MOST_BYTES = 100_000_000
"""Maximum bytes of a file of foreign data."""
MOST_VALUES = 6_000_000
"""Maximum number of values in such a file, counted by brackets and commas. Each takes up to 80
bytes."""


def read_input(
    path: str | Path, most: int = MOST_BYTES, *, named: bool = False, values: float = MOST_VALUES
) -> bytes:
    """Return the content of a file or, for ``-``, of standard input. A path ``named`` in another
    file is never standard input.

    Raises InputError if it cannot be read, has more than ``most`` bytes (a device may have no end),
    or has more than this many ``values``.
    """
    file, hint = Path(path), ""
    try:
        if named and file.exists() and not (file.is_file() or file.is_dir()):
            raise OSError(0, "it is not a regular file")  # a pipe could block forever
        if str(path) == "-" and not named:
            data = sys.stdin.buffer.read(most + 1)
        else:
            with file.open("rb") as stream:
                data = stream.read(most + 1)
    except FileNotFoundError:
        found, hint = "no such file", "check the path"
    except IsADirectoryError:
        found, hint = "this is a directory", "name a file in it"
        if (file / "manifest.json").is_file():
            hint = f"it is a bundle: safenav check {path}; name a file in it for other commands"
    except PermissionError:
        found, hint = "permission denied", "check the file's permissions"
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        found = f"not readable: {reason or error}"
    else:
        if len(data) > most:
            found = f"the file is larger than {most // 1_000_000} MB"
        elif sum(map(data.count, (b"[", b"{", b","))) > values:
            found = f"the file has more than {values / 1e6:g} million values"
        else:
            return data
    raise InputError([Diagnostic(str(path), 0, 0, found, hint)])


def printable(text: str) -> str:
    """Return a file's text or name without characters that control the terminal."""
    return "".join(char if char.isprintable() or char == "\n" else "?" for char in text)


def json_line(data: Any) -> str:
    """Return data as a line of JSON, compact and in ASCII."""
    return json.dumps(data, separators=(",", ":")) + "\n"


def json_flaw(error: Exception) -> str:
    """Return the reason why a text is not JSON, with the position of the error."""
    if isinstance(error, json.JSONDecodeError):
        line = f"line {error.lineno}, " if error.lineno > 1 else ""
        return f"{error.msg.removesuffix(' at')} at {line}column {error.colno}"
    if isinstance(error, UnicodeDecodeError):
        return f"byte {error.start} is not UTF-8"
    return "too deeply nested" if isinstance(error, RecursionError) else str(error)


def foreign_character(text: str) -> tuple[int, int, str] | None:
    """Return line and column (from 1) and the name of the first character that programs interpret
    differently, or None."""
    match = _FOREIGN.search(text)
    if match is None:
        return None
    before = text[: match.start()]
    column = match.start() - before.rfind("\n")
    return before.count("\n") + 1, column, f"the character U+{ord(match.group()):04X}"


_SECTION = r"\[\s*[A-Za-z_]+\s*\]"
_DRAW = "draw it with: safenav draw {0}; 'map' of a scenario names it (docs/maps.md)"
PICTURE, ARCHIVE = "picture", "zip file"
ROS_MAP = "map of ROS map_server"
_KINDS: dict[str, tuple[tuple[str, ...], str]] = {
    "specification": (
        (rf"\A(?:\s|#[^\n]*\n)*{_SECTION}|\n\[(?:SYS|ENV)_[A-Z]+\]",),
        "get its strategy with: safenav synth {0}; if there is none: safenav explain {0}",
    ),
    "motion file": (
        (r'\A\s*\{"type"\s*:\s*"header"\s*,\s*"motion"',),
        "check it with: safenav check {0} TRACE",
    ),
    "trace": ((r'\A\s*\{"type"\s*:\s*"header"',), "show it with: safenav replay {0}"),
    "scenario": (
        (r'(?m)^(?:\{\s*)?"?safenav"?[ \t]*:',),
        "run it with: safenav run {0} --trace run.jsonl; 'safenav synth {0} -o DIR' writes its "
        "specifications and strategies",
    ),
    "strategy of slugs": (
        (r'\A\s*\{\s*"version"\s*:', r'"slugs"\s*:', r'"variables"\s*:'),
        "check it with: safenav verify SPECIFICATION {0}",
    ),
    "matrix file": ((r"(?m)^batch[ \t]*:",), "run it with: safenav batch {0}"),
    ARCHIVE: ((r"\APK\x03\x04",), "if it is a bundle, check it with: safenav check {0}"),
    PICTURE: (
        (r"\A(?:.PNG|P[25]\s|GIF8|.{3,8}(?:JFIF|Exif))",),
        "use it as 'image' of map, or the YAML file of its ROS map as 'ros'; to see it: safenav "
        "draw {0}",
    ),
    "fleet file": (
        (r"(?m)^safenav-fleet[ \t]*:",),
        "use it with: safenav drive SCENARIO --fleet {0}",
    ),
    "map of the MovingAI benchmarks": (
        (r"\Atype[ \t]+\w+[ \t]*\r?\n", r"(?m)^height[ \t]", r"(?m)^map[ \t]*\r?$"),
        _DRAW,
    ),
    ROS_MAP: (
        (r"(?m)^[ \t]*image[ \t]*:", r"(?m)^[ \t]*(?:negate|occupied_thresh|free_thresh)[ \t]*:"),
        _DRAW,
    ),
}
"""The patterns that all texts of a kind contain, and advice on such files."""


def kind_of(text: str) -> str | None:
    """Return the kind of a file with this text; None if it is unknown."""
    text = text.removeprefix("\N{BYTE ORDER MARK}")
    for kind, (patterns, _) in _KINDS.items():
        if all(re.search(pattern, text) for pattern in patterns):
            return kind
    return None


ADVICE = (
    "a scenario is YAML ('safenav new FILE' writes one); 'check' also reads traces and motions "
    "(.jsonl) and bundles, and 'synth' reads structuredslugs and slugsin files, also of LTLMoP"
)
"""The hint for files of other kinds."""


def check_kind(text: str | bytes, expected: str, file: str) -> None:
    """Raise InputError if a file is of another kind. ``text``: the beginning of the file."""
    kind = kind_of(text if isinstance(text, str) else text.decode("utf-8", "replace"))
    if kind not in (None, expected):
        found, advice = f"this is a {kind}, not a {expected}", _KINDS[kind][1]
        raise InputError([Diagnostic(file, 0, 0, found, advice.format(file))])


_BINARY = re.compile(rb"%PDF|\x1f\x8b|(?!\xff\xfe|\xfe\xff)[^\0]{0,200}\0{2}", re.DOTALL)
"""The beginnings of binary files. In UTF-16 texts, which have their own error, every other byte is
zero."""


def decoded(data: bytes, file: str) -> str:
    """Return the text of a file. Raises InputError if it is not UTF-8."""
    try:
        if not _BINARY.match(data):
            return data.decode("utf-8-sig")
        place, found, hint = (0, 0), "this is a binary file, not a text", ADVICE
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line_start = before.rfind(b"\n") + 1
        column = len(before[line_start:].decode("utf-8", "replace")) + 1
        place, hint = (before.count(b"\n") + 1, column), "save it as UTF-8"
        found = f"not UTF-8: byte 0x{data[error.start]:02X}"
    beginning = data[:100].decode("utf-8", "replace")
    if kind_of(beginning) in (PICTURE, ARCHIVE):
        check_kind(beginning, "text", file)
    raise InputError([Diagnostic(file, *place, found, hint)])


def write_out(path: Path, content: str | bytes, *, echo: bool = True, replace: bool = True) -> None:
    """Write a file (``-``: standard output) and, if ``echo``, report it. ``replace``: whether to
    overwrite an existing file.

    Raises UsageError if it cannot be written.
    """
    data = _bytes(content)
    if str(path) == "-":
        sys.stdout.flush()
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
        return
    write_whole(path, lambda part: part.write_bytes(data), replace=replace)
    if echo:
        tell(path)


def _bytes(content: str | bytes) -> bytes:
    return content.encode() if isinstance(content, str) else content


def try_out(path: Path) -> None:
    """Raise UsageError unless a file with this name can be written. Leave no file behind."""
    with _writing(path):
        if path.is_dir():
            raise IsADirectoryError(0, "it is a folder")
        if path.exists() and not os.access(path, os.W_OK):
            raise PermissionError(0, "permission denied")
        if not path.exists() or path.is_file():
            with _new_file(path.parent):
                pass


def try_folder(path: Path) -> None:
    """Raise UsageError unless files can be written into a folder, which need not exist yet."""
    there = next((p for p in (path, *path.parents) if p.exists()), path)
    with _writing(path):
        if there.is_file():
            raise NotADirectoryError(0, f"{there} is a file\n    give the name of a folder")
        with _new_file(there):
            pass


@contextmanager
def _new_file(folder: Path, prefix: str = ".") -> Iterator[Path]:
    """Yield a new file in a folder, readable only by this user. Interrupts never leave a file
    behind."""
    file = folder / f"{prefix}{os.urandom(6).hex()}"
    try:
        os.close(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
        yield file
    finally:
        try:
            file.unlink(missing_ok=True)
        except BaseException:  # interrupted before the deletion
            file.unlink(missing_ok=True)
            raise


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Raise UsageError if the code in this context cannot write its file or folder."""
    try:
        yield
    except OSError as error:
        file = error.filename2 or path  # a failed rename or link has a target
        raise UsageError(f"cannot write {file}: {error.strerror or error}") from error


def tell(path: Path) -> None:
    """Report the name and size of a written file on standard error."""
    print(f"{path}  {path.stat().st_size / 1024:.0f} KiB", file=sys.stderr)


def write_whole(path: Path, write: Callable[[Path], object], *, replace: bool = True) -> None:
    """Let ``write`` fill a file beside ``path``, then rename it, so that no incomplete file is
    left. Write devices and pipes directly. ``replace``: whether to overwrite an existing file.

    Raises UsageError if that is impossible.
    """
    with _writing(path):
        if path.exists() and not path.is_file():
            write(path)
            return
        with _new_file(path.parent, f".{path.name}-") as part:
            write(part)
            part.chmod(0o644)
            try:
                if replace:
                    part.replace(path)
                else:
                    os.link(part, path)  # unlike a rename, a link fails if the name exists
            except FileExistsError:
                hint = "choose another name, or replace it with --force"
                raise UsageError(f"{path} already exists\n    {hint}") from None


def write_all(folder: Path, files: Iterable[tuple[str, str | bytes]]) -> None:
    """Write files by their names into a folder, which need not exist. Write none if there is not
    enough space. Raises UsageError if that is impossible."""
    # Imported here since this loads the modules of all archives (2 ms).
    from tempfile import TemporaryDirectory

    with _writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=folder, prefix=".") as scratch:
            for name, content in files:
                Path(scratch, name).write_bytes(_bytes(content))
            for part in Path(scratch).iterdir():
                part.replace(folder / part.name)
