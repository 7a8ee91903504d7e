"""The prose of the tree: sentences of Markdown, docstrings, comments and messages."""

import ast
import inspect
import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from children import ran

ROOT = Path(__file__).parents[2]
SKIPPED = ("assets/", "docs/pictures/", "tests/", "fonts/")
MARKS = (".cpp", ".hpp", ".ts", ".tsx", ".mjs")


class Sentence(NamedTuple):
    """A piece of prose. ``kind``: ``page``, ``docstring``, ``comment`` or ``message``."""

    path: str
    line: int
    kind: str
    text: str


@cache
def prose() -> list[Sentence]:
    """All prose of the files that git tracks, tests and built assets excepted."""
    return list(_sentences())


def _sentences() -> Iterator[Sentence]:
    listed = ran(["git", "ls-files"], cwd=ROOT, check=True, timeout=60)
    for path in listed.stdout.splitlines():
        if any(part in path for part in SKIPPED) or not (ROOT / path).is_file():
            continue
        if path.endswith(".md"):
            found = _markdown(_text(path))
        elif path.endswith(".py"):
            found = _python(_text(path))
        elif path.endswith(MARKS):
            found = _braces(_text(path))
        elif path.endswith((".yaml", ".yml")):
            found = _yaml(_text(path))
        else:
            continue
        for line, kind, text in found:
            yield Sentence(path, line, kind, re.sub(r"``.*?``|`[^`]*`", "", text))


def _text(path: str) -> str:
    return (ROOT / path).read_text(encoding="utf-8")


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
    nodes = [*ast.walk(ast.parse(text))]
    inner: set[ast.AST] = set()
    docstrings: set[ast.AST] = set()
    for node in nodes:
        if isinstance(node, ast.JoinedStr):
            inner.update(child for child in ast.walk(node) if child is not node)
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
    if "#" not in text:  # half of the files
        return
    block, start = "", 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            start = start if block else token.start[0]
            block = f"{block} {token.string.lstrip('# ')}".strip()
        elif token.type != tokenize.NL and block:
            yield start, "comment", block
            block = ""


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
