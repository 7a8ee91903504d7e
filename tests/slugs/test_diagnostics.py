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
@pytest.mark.parametrize(
    ("section", "line", "message", "hint"),
    [
        ("SYS_INIT", "redy", "8:1: error: undeclared variable 'redy'", "did you mean 'ready'?"),
        ("SYS_INIT", "READY", "8:1: error: undeclared variable 'READY'", "did you mean 'ready'?"),
        ("SYS_INIT", "elephant", "8:1: error: undeclared variable 'elephant'", None),
        ("SYS_INIT", "x == 3", "8:3: error: found '=='", "write a single '='"),
        ("SYS_INIT", "a => ready", "8:3: error: found '=>'", "write '->' for 'implies'"),
        ("SYS_INIT", "x - 1 = 2", "8:3: error: found '-'", "add on the other side"),
        ("SYS_INIT", "x <> 2", "8:3: error: found '<>'", "write '!='"),
        ("SYS_INIT", "a, ready", "8:2: error: found ','", "'&' between conditions"),
        ("SYS_INIT", "a # really", "8:3: error: found '#'", "a line of its own"),
        ("SYS_TRANS", "G ready", "8:1: error: temporal operator 'G'", "SYS_TRANS"),
        ("SYS_TRANS", "a U ready", "8:3: error: temporal operator 'U'", "no until"),
        ("SYS_TRANS", "[] ready", "8:1: error: found '[]', expected an operand", "SYS_TRANS"),
        ("SYS_TRANS", "a & []<> ready", "8:5: error: found '[]<>'", "SYS_LIVENESS"),
        ("SYS_LIVENESS", "[]<> ready", "8:1: error: found '[]<>'", "SYS_LIVENESS"),
        ("SYS_TRANS", "a and ready", "8:3: error: found 'and'", "write '&'"),
        ("SYS_TRANS", "a & true", "8:5: error: undeclared variable 'true'", "write TRUE"),
        ("SYS_TRANS", "a & §", "8:5: error: found '§', expected an operand", None),
        ("ENV_INIT", "ready", "8:1: error: output 'ready' is not allowed in ENV_INIT", "SYS_INIT"),
        ("ENV_INIT", "a'", "8:1: error: the next value of input 'a' is not", "ENV_TRANS"),
        ("SYS_INIT", "next(x) = 1", "8:6: error: the next value of input 'x' is not", "SYS_TRANS"),
        ("ENV_TRANS", "a -> ready'", "8:6: error: the next value of output 'ready'", "moves first"),
        ("SYS_TRANS", "next(a')", "8:7: error: primed variable 'a' inside next(...)", "prime out"),
        ("SYS_TRANS", "next a", "8:6: error: found name 'a', expected '(' after 'next'", "next(.."),
        ("SYS_TRANS", "a''", "8:3: error: found ''', expected an operator", "nothing later"),
        ("SYS_TRANS", "(a & ready)'", "8:12: error: found '''", "write next(...)"),
        ("SYS_TRANS", "x", "8:1: error: found integer 'x', expected a Boolean", "as in x = 0"),
        ("SYS_TRANS", "a = ready", "8:1: error: found Boolean variable 'a'", "write '<->'"),
        ("SYS_TRANS", "7", "8:1: error: found number 7, expected a Boolean formula", "comparison"),
        ("SYS_TRANS", "0 < x < 5", "8:7: error: found '<'", "a <= b & b <= c"),
        ("SYS_TRANS", "(a & ready", "8:11: error: found the end of the line, expected ')'", "open"),
        ("SYS_TRANS", "a & ready)", "8:10: error: found ')', but no '(' is open", None),
        ("SYS_TRANS", "a &", "8:4: error: found the end of the line, expected an operand", None),
        ("SYS_TRANS", "2x", "8:1: error: found '2x'", "a name starts with a letter"),
        ("SYS_TRANS", "x < 9999999999", "8:5: error: number 9999999999 is out of range", None),
        ("SYS_TRANS", "| a ready & a", "8:11: error: found '&', expected the end", "before their"),
        ("SYS_TRANS", "a & (| a ready)", "8:6: error: found '|'", "a line of its own"),
        ("SYS_TRANS", "| x a", "8:3: error: found integer 'x' in a prefix line", "infix"),
        ("SYS_TRANS", "| a", "8:4: error: found the end of the line, expected an operand of", None),
        ("SYS_TRANS", "$ 2 a ? 1", "8:9: error: entry 1 is not known yet", "count from 0"),
        ("SYS_TRANS", "$ 0", "8:3: error: a buffer needs at least one formula", None),
        ("SYS_TRANS", "? 0", "8:1: error: '?' outside a buffer", "opened with '$ n'"),
        ("SYS_TRANSITIONS", "a", "7:1: error: unknown section [SYS_TRANSITIONS]", "[SYS_TRANS]"),
        ("GOALS", "a", "7:1: error: unknown section [GOALS]", "the sections are [INPUT]"),
    ],
)
def test_a_mistake_in_a_formula_is_located(
    own_slugs: Path, section: str, line: str, message: str, hint: str | None
) -> None:
    """Line, column, what was found and expected, and what to write instead."""
    said = ask(own_slugs, constraint(section, line))
    assert said.status == 2
    assert f"-:{message}" in said.errors
    hints = [text for text in said.errors.splitlines() if text.startswith("  hint: ")]
    assert hint is None or any(hint in text for text in hints), said.errors
    assert said.errors.endswith((" error\n", " errors\n"))


@pytest.mark.parametrize(
    ("declaration", "message"),
    [
        ("x: 0...7\nx", "3:1: error: variable 'x' is declared twice"),
        ("x: 0..7", "2:5: error: found '.', expected '...'"),
        ("x: 7...0", "2:4: error: the range 7...0 is empty"),
        ("x: 0...2147483648", "2:8: error: number 2147483648 is out of range"),
        ("x: 0...7 int", "2:10: error: found name 'int', expected the end of the line"),
        ("x: 0...1\nb c", "3:3: error: found name 'c', expected ':'"),
        ("x: 0...1\nb'", "3:2: error: found '''"),
        ("x: 0...1\nTRUE", "3:1: error: 'TRUE' is a constant"),
        ("x: 0...1\n3", "3:1: error: found number 3, expected the name of a variable"),
        ("x: 0...3\nx@1", "3:1: error: variable 'x@1' is declared twice"),
        ("b c", "2:1: error: found 'b c', expected one name on each line"),
        ("b\x01c", "2:2: error: not text: the character U+0001"),
        ("b\n[OUTPUT]\nb", "4:1: error: variable 'b' is declared twice"),
    ],
)
def test_a_mistake_in_a_declaration_is_located(
    own_slugs: Path, declaration: str, message: str
) -> None:
    """One message, with its place."""
    said = ask(own_slugs, f"[INPUT]\n{declaration}\n")
    assert said.status == 2
    assert said.messages == [said.messages[0], "-: 1 error"]
    assert said.messages[0].startswith(f"-:{message}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "-: error: the file is empty"),
        ("\n\n", "-: error: the file holds no specification"),
        ("# only a comment\n", "-: error: the file holds no specification"),
        ("a\n[INPUT]\nb\n", "-:1:1: error: found 'a' before the first section"),
        ("[INPUT\na\n", "-:1:7: error: found the end of the line, expected ']'"),
        ("[INPUT] a\nb\n", "-:1:8: error: found 'a' behind a section heading"),
        ("[INPUT]\na\n[SYS_TRANS]\n| ! a b\n", "-:4:7: error: undeclared variable 'b'"),
        ("[INPUT]\na\n[SYS_TRANS]\n| a\n", "-:4:4: error: found the end of the line"),
        ("[INPUT]\na\n[SYS_TRANS]\na a\n", "-:4:3: error: found name 'a', expected the end"),
        ("[INPUT]\na\n[SYS_LIVENESS]\nF a\n", "-:4:1: error: temporal operator 'F'"),
    ],
)
def test_a_mistake_in_a_section_is_located(own_slugs: Path, text: str, message: str) -> None:
    """Files that have no integers, no sections, or nothing."""
    said = ask(own_slugs, text)
    assert said.status == 2
    assert said.messages[0].startswith(message)


def test_the_source_line_is_shown_with_a_caret(own_slugs: Path) -> None:
    """The whole answer to one mistake, as a person sees it."""
    said = ask(own_slugs, constraint("SYS_TRANS", "  a -> spede' = 3"))
    assert said.errors == (
        "-:8:8: error: undeclared variable 'spede'\n"
        "  8 |   a -> spede' = 3\n"
        "    |        ^~~~~\n"
        "  hint: did you mean 'speed'?\n"
        "-: 1 error\n"
    )


def test_all_mistakes_are_reported_in_the_order_of_the_file(own_slugs: Path) -> None:
    """Also several on a line; a broken declaration causes no further errors where it is used."""
    said = ask(
        own_slugs,
        "[SYS_TRANS]\nredy & speeed = 3\nlevel = 1 & wide\n[INPUTS]\na\n[SYS_INIT]\nG a\na'\n"
        "[OUTPUT]\nready\nspeed:2...5\nlevel: 5...2\nwide'\na\n",
    )
    assert [message.partition(": error: ")[0] for message in said.messages] == [
        "-:2:1",
        "-:2:8",
        "-:4:1",
        "-:7:1",
        "-:8:1",
        "-:12:8",
        "-:13:5",
        "-:14:1",
        "-: 8 errors",
    ]


def test_a_thousand_mistakes_are_shown_and_the_rest_counted(own_slugs: Path) -> None:
    """A file that is something else altogether does not fill the disk with messages."""
    said = ask(own_slugs, "[SYS_TRANS]\n" + "nonsense\n" * 5000)
    assert said.messages[-2:] == ["-: further mistakes are not shown", "-: 5000 errors"]
    assert len(said.messages) == 1002


def test_a_comparison_that_cannot_fail_is_a_warning(own_slugs: Path) -> None:
    """Legal, for generated files have it, but it is pointed out."""
    said = ask(own_slugs, constraint("SYS_TRANS", "speed' < 6 & x != 9\nspeed = 6"))
    assert said.status == 0
    assert said.messages == [
        "-:8:1: warning: '<' is always true here: speed ranges over 2...5",
        "-:8:14: warning: '!=' is always true here: x ranges over 0...7",
        "-:9:1: warning: '=' is always false here: speed ranges over 2...5",
    ]


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
