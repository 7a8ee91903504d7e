"""The prose is plain: docstrings, comments, messages and pages contain no phrase of ``phrases.tsv``
(CONTRIBUTING.md, "Words")."""

import ast
import inspect
import re
from collections.abc import Iterator
from typing import NamedTuple

from children import ran
from once import ROOT, beside

SKIPPED = ("assets/", "docs/pictures/", "tests/", "fonts/")


class Sentence(NamedTuple):
    """A piece of prose. ``kind``: ``page``, ``docstring``, ``comment`` or ``message``."""

    path: str
    line: int
    kind: str
    text: str


def _markdown(text: str) -> Iterator[tuple[int, str, str]]:
    """Paragraphs, items and table cells outside of code blocks."""
    fenced, paragraph, start = False, "", 0
    for number, line in enumerate([*text.split("\n"), ""], 1):
        begins = not line.strip() or re.match(r"\s*([-*|#]|\d+\.|```)", line)
        if begins and paragraph:
            yield start, "page", paragraph
            paragraph = ""
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif not fenced and line.startswith("|"):
            yield from ((number, "page", cell.strip()) for cell in line.split("|") if cell.strip())
        elif not fenced and line.strip():
            start = start if paragraph else number
            paragraph = f"{paragraph} {line.strip()}".strip()


def _python(text: str) -> Iterator[tuple[int, str, str]]:
    nodes = [*_walked(ast.parse(text))]
    inner: set[ast.AST] = set()
    docstrings: set[ast.AST] = set()
    for node in nodes:
        if isinstance(node, ast.JoinedStr):
            inner.update(child for child in _walked(node) if child is not node)
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            docstrings.add(node.value)
    for node in nodes:
        if node in inner:
            continue
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            if node in docstrings:
                lines = inspect.cleandoc(node.value).split("\n")
                shown = (line for line in lines if not line.startswith("    "))
                yield node.lineno, "docstring", " ".join(" ".join(shown).split())
            else:
                yield node.lineno, "message", " ".join(node.value.split())
        elif isinstance(node, ast.JoinedStr):
            parts = (v.value if isinstance(v, ast.Constant) else "{}" for v in node.values)
            yield node.lineno, "message", " ".join("".join(map(str, parts)).split())
    block, start, end = "", 0, 0
    for found in _TOKEN.finditer(text):
        if found[0].startswith("#"):
            if block and text[end : found.start()].strip():
                yield start, "comment", block
                block = ""
            start = start if block else text.count("\n", 0, found.start()) + 1
            block, end = f"{block} {found[0].lstrip('# ')}".strip(), found.end()
    if block:
        yield start, "comment", block


_TOKEN = re.compile(
    r'''#[^\n]*|("""|\'\'\')(?:\\.|.)*?\1|"(?:\\.|[^"\\])*"|\'(?:\\.|[^'\\])*\'''', re.DOTALL
)
"""A comment or text of Python, found faster than by ``tokenize``."""


def _walked(tree: ast.AST) -> Iterator[ast.AST]:
    """What ``ast.walk`` yields, in another order and in half of the time."""
    nodes: list[object] = [tree]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.AST):
            yield node
            nodes += vars(node).values()
        elif isinstance(node, list):
            nodes += node


def _braces(text: str) -> Iterator[tuple[int, str, str]]:
    """Comments and strings of C++ and TypeScript, and the text between tags."""
    comment = re.compile(
        r"/\*(.*?)\*/|((?:^[ \t]*//[^\n]*\n)+)|//([^\n]*)", re.DOTALL | re.MULTILINE
    )
    for found in comment.finditer(text):
        words = re.sub(r"^[ \t]*(//+|\*)", "", found[0].strip("/*"), flags=re.MULTILINE)
        yield text[: found.start()].count("\n") + 1, "comment", " ".join(words.split())
    bare = comment.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
    quoted = r'"((?:[^"\\\n]|\\.)*)"|`((?:[^`\\]|\\.)*)`|>([^<>{}=;()]*[A-Za-z]{2}[^<>{}=;()]*)<'
    for found in re.finditer(quoted, bare):
        words = " ".join((found[1] or found[2] or found[3] or "").split())
        yield bare[: found.start()].count("\n") + 1, "message", words


def _yaml(text: str) -> Iterator[tuple[int, str, str]]:
    for number, line in enumerate(text.split("\n"), 1):
        if found := re.search(r"(?:^|\s)#\s+(.*)", line):
            yield number, "comment", found[1]


READERS = {"md": _markdown, "py": _python, "yaml": _yaml, "yml": _yaml} | dict.fromkeys(
    ("cpp", "hpp", "ts", "tsx", "mjs"), _braces
)


def prose() -> list[Sentence]:
    """All prose of the files that git tracks, tests and built assets excepted."""
    listed = ran(["git", "ls-files", *(f"*.{kind}" for kind in READERS)], cwd=ROOT, check=True)
    return [
        Sentence(path, line, kind, re.sub(r"``.*?``|`[^`]*`", "", text))
        for path in listed.stdout.splitlines()
        if (ROOT / path).is_file() and not any(part in path for part in SKIPPED)
        for line, kind, text in READERS[path.rpartition(".")[2]](
            (ROOT / path).read_text(encoding="utf-8")
        )
    ]


PHRASES = [line.split("\t") for line in beside(__file__, "phrases.tsv").splitlines()]
"""An expression, what to write instead, and the kinds of prose that it holds for."""


def flagged(sentences: list[Sentence]) -> list[str]:
    """The phrases found, each with its place and what to write instead."""
    found = []
    for pattern, instead, kinds in PHRASES:
        expression = re.compile(pattern, 0 if pattern.startswith(("^", "(^")) else re.IGNORECASE)
        found += [
            f"{sentence.path}:{sentence.line}: '{match[0]}': write {instead}"
            for sentence in sentences
            if kinds == "all" or sentence.kind in kinds.split(",")
            for match in expression.finditer(sentence.text)
        ]
    return sorted(found)


def test_no_prose_has_a_phrase_of_phrases_tsv() -> None:
    """One test, since each process that reads all of it takes seconds."""
    sentences = prose()
    kinds = {(sentence.path.rpartition(".")[2], sentence.kind) for sentence in sentences}
    assert {("md", "page"), ("py", "docstring"), ("py", "message"), ("py", "comment")} <= kinds
    assert {("hpp", "comment"), ("cpp", "message"), ("tsx", "message")} <= kinds
    assert ("yaml", "comment") in kinds
    found = flagged(sentences)
    assert not found, "\n".join(found)


def test_a_listed_phrase_is_found_with_its_line() -> None:
    odd = Sentence("a.py", 3, "message", "nobody goes on for ever")
    assert [line.split("'")[1] for line in flagged([odd])] == ["for ever", "goes on", "nobody"]
