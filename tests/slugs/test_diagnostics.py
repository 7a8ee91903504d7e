"""Errors in specifications: each is reported at its position, with a useful hint."""

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

HEADER = """\
[INPUT]
a
x: 0...7
[OUTPUT]
ready
speed: 2...5
"""


@dataclass(frozen=True)
class Said:
    """What the program answered to a text on standard input."""

    status: int
    errors: str

    @property
    def messages(self) -> list[str]:
        """Without source lines, carets and hints."""
        return [line for line in self.errors.splitlines() if re.match(r"-(:\d+:\d+)?: ", line)]


def ask(binary: Path, text: str | bytes, *options: str) -> Said:
    """Run the program on a text; it must end by itself and in order."""
    process = subprocess.run(
        [binary, *(options or ("--translate",)), "-"],
        input=text.encode() if isinstance(text, str) else text,
        capture_output=True,
        timeout=300,
        check=False,
    )
    assert process.returncode in (0, 2, 10), process.stderr.decode()
    assert process.returncode == 0 or process.stdout == b""
    return Said(process.returncode, process.stderr.decode())


def constraint(section: str, line: str) -> str:
    return f"{HEADER}[{section}]\n{line}\n"


# Line 8 is the first line after the heading of the section.


def test_a_thousand_errors_are_shown_and_the_rest_counted(own_slugs: Path) -> None:
    """A file that is something else altogether does not fill the disk with messages."""
    said = ask(own_slugs, "[SYS_TRANS]\n" + "nonsense\n" * 5000)
    assert said.messages[-2:] == ["-: further mistakes are not shown", "-: 5000 errors"]
    assert len(said.messages) == 1002


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(HEADER.replace("\n", "\r\n") + "[SYS_TRANS]\r\nready'\r\n", id="CRLF"),
        pytest.param("\ufeff" + HEADER, id="byte order mark"),
        pytest.param(HEADER + "[SYS_TRANS]\n\t ready' \t", id="no newline at the end"),
        pytest.param("[SYS_INIT]\nb\n" + HEADER + "[OUTPUT]\nb\n", id="sections in any order"),
        pytest.param("[INPUT]\n[OUTPUT]\n", id="no variables"),
        pytest.param("[OUTPUT]\nF\nU\n[SYS_TRANS]\nF & U\n", id="variables named as operators"),
        pytest.param("[OUTPUT]\na-b\nx[1]\n[SYS_TRANS]\n| a-b' x[1]\n", id="odd names of slugsin"),
        pytest.param("[OUTPUT]\na\n[SYS_TRANS]\n" + "!" * 99_999 + "a\n", id="negations"),
        pytest.param(constraint("SYS_TRANS", "(" * 99_999 + "a" + ")" * 99_999), id="parentheses"),
        pytest.param(constraint("SYS_TRANS", "next(" + "(" * 99_999 + "a" + ")" * 100_000), id="X"),
        pytest.param(constraint("SYS_TRANS", "a & " * 99_999 + "a"), id="a long conjunction"),
        pytest.param(constraint("SYS_TRANS", "x + " * 999 + "x < 3"), id="a long sum"),
        pytest.param("[OUTPUT]\na\n[SYS_TRANS]\n" + "| a " * 99_999 + "a\n", id="deep prefix"),
        pytest.param("[OUTPUT]\na\n[SYS_TRANS]\n" + "$ 1 " * 99_999 + "a\n", id="deep buffers"),
    ],
)
def test_unusual_but_legal_texts_are_read(own_slugs: Path, text: str) -> None:
    """Line ends, marks, depth and length that a person or a generator may produce."""
    said = ask(own_slugs, text)
    assert (said.status, said.errors) == (0, "")


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(b"\0", id="NUL"),
        pytest.param(b"[INPUT]\na\n[SYS_TRANS]\na\0\n", id="NUL in a formula"),
        pytest.param(b"[INPUT]\nx:0...3\n[SYS_TRANS]\n\xff\xfe\n", id="no UTF-8"),
        pytest.param(b"\x7fELF" + bytes(range(256)) * 50, id="a binary file"),
        pytest.param(b"[INPUT]\nx:0...3\n[SYS_TRANS]\n" + b"(" * 99_999, id="open parentheses"),
        pytest.param(b"[INPUT]\na\n[SYS_TRANS]\n" + b"$ 4000000000 a", id="a huge buffer"),
        pytest.param(b"[INPUT]\n" + b"a" * 999_999 + b"\n" + b"b " * 99_999, id="long lines"),
        pytest.param(b"[INPUT]\nx:0...3\n[SYS_TRANS]\nx = " + b"7" * 99_999, id="a long number"),
    ],
)
def test_a_file_that_is_not_text_is_refused(own_slugs: Path, text: bytes) -> None:
    """An error, no crash, and nothing on the terminal that is not printable."""
    said = ask(own_slugs, text)
    assert said.status == 2
    assert "error" in said.errors
    assert all(c.isprintable() or c == "\n" for c in said.errors)
    assert max(map(len, said.errors.splitlines())) < 300
