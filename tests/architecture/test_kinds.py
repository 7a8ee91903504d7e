"""A kind of objective is known by name in few files: all others query it."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from safenav.judge.lines import Objective
from safenav.scenario.objective import KINDS

PACKAGE = Path(__file__).parents[2] / "safenav"

KNOW = {
    "scenario/objective.py": "its class",
    "scenario/language.py": "its key in a scenario",
    "spec/objective.py": "its formulas, if they are new",
    "judge/lines.py": "the judge's own objective",
    "trace/objective.py": "the format: kinds that an unknown reader could misread",
}

EXEMPT = {
    ("hold", "trace/records.py"): "the line of a robot that stays",
    ("hold", "judge/bundle/evidence.py"): "that line",
    ("once", "judge/bundle/wording.py"): "the adverb",
    ("once", "stl/parser.py"): "an operator of signal temporal logic",
    ("once", "stl/syntax.py"): "that operator",
    ("patrol", "scenario/beginning.py"): "the text of a scenario",
    ("visit", "scenario/beginning.py"): "the text of a scenario",
}
"""Words that mean something else there."""

SOURCES = [
    path
    for path in sorted(PACKAGE.rglob("*"))
    if path.suffix in (".py", ".ts", ".tsx") and not {"node_modules", "__pycache__"} & {*path.parts}
]
TEXTS = {path: path.read_text() for path in SOURCES}


@cache
def words_of(path: Path) -> tuple[tuple[str, ...], frozenset[str]]:
    """The string literals of a source, in Python without docstrings, and its identifiers."""
    text = TEXTS[path]
    if path.suffix != ".py":
        code = re.sub(r"//[^\n]*|/\*.*?\*/|\(\*.*?\*\)", "", text, flags=re.DOTALL)
        quoted = re.findall(r'"[^"\n]*"|`[^`]*`|\'[^\'\n]*\'', code)
        return (*quoted, *re.findall(r"[{,]\s*\w+:", code)), frozenset()
    nodes = [*ast.walk(ast.parse(text))]
    prose = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    strings, names = list[str](), set[str]()
    for node in nodes:
        match node:
            case ast.Constant(str(value)) if id(node) not in prose:
                strings.append(f'"{value}"')
            case ast.Name(name) | ast.Attribute(attr=name) | ast.alias(name):
                names.add(name)
    return tuple(strings), frozenset(names)


def knows(path: Path, key: str, name: str) -> bool:
    """Whether a source has the key of a kind in quotes or as a key of YAML, or its class."""
    text = TEXTS[path]
    if key not in text and name not in text:
        return False
    as_key = re.compile(rf"""["'`]{key}["'`]|\b{key}: ?[\[{{\d]|[{{,]\s*{key}:""")
    strings, names = words_of(path)
    return name in names or any(map(as_key.search, strings))


@pytest.mark.parametrize("key", KINDS)
def test_a_kind_is_known_in_few_files(key: str) -> None:
    name = KINDS[key].__name__
    places = {path.relative_to(PACKAGE).as_posix() for path in SOURCES if knows(path, key, name)}
    found = {place for place in places if (key, place) not in EXEMPT}
    assert found <= KNOW.keys()
    assert {"scenario/objective.py", "judge/lines.py"} <= found


def test_each_exception_is_one() -> None:
    for key, place in EXEMPT:
        assert knows(PACKAGE / place, key, KINDS[key].__name__), f"{key} is not in {place}"


def test_the_judge_has_the_same_kinds() -> None:
    """It was written independently, but it must say the same."""
    for key, kind in KINDS.items():
        own = Objective(kind=key)
        told = (kind.in_turn, kind.settles, kind.one, kind.strict)
        assert (own.in_turn, own.settles, own.single, own.strict) == told, key
