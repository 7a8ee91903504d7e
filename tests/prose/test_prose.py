"""The prose is plain: it contains no phrase of ``phrases.tsv`` (CONTRIBUTING.md, "Words")."""

import re
from pathlib import Path

from prose.reading import Sentence, prose

PHRASES = [
    line.split("\t")
    for line in (Path(__file__).parent / "phrases.tsv").read_text(encoding="utf-8").splitlines()
]
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


def test_no_odd_phrase_is_in_the_prose() -> None:
    found = flagged(prose())
    assert not found, "\n".join(found)


def test_each_kind_of_prose_is_read() -> None:
    kinds = {(sentence.path.rpartition(".")[2], sentence.kind) for sentence in prose()}
    assert {("md", "page"), ("py", "docstring"), ("py", "message"), ("py", "comment")} <= kinds
    assert {
        ("hpp", "comment"),
        ("cpp", "message"),
        ("tsx", "message"),
        ("yaml", "comment"),
    } <= kinds


def test_an_odd_phrase_is_found_with_its_line() -> None:
    odd = Sentence("a.py", 3, "message", "nobody goes on for ever")
    assert [line.split("'")[1] for line in flagged([odd])] == ["for ever", "goes on", "nobody"]
