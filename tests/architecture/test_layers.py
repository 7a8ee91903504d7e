"""Imports go downwards only, in the order of docs/architecture.md, including lazy ones."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import networkx
import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "safenav"
FACES = {"safenav", "safenav.cli"}
"""The library's face re-exports; the command line's lists its commands."""


def modules() -> dict[str, Path]:
    """Return every module of the package by its dotted name."""
    found = {}
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(ROOT).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = path
    return found


MODULES = modules()


@cache
def tree(name: str) -> ast.Module:
    return ast.parse(MODULES[name].read_text())


def imports(name: str) -> Iterator[str]:
    """Return the modules of safenav that a module imports anywhere in its text."""
    for node in ast.walk(tree(name)):
        if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield inner if inner in MODULES else node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


@cache
def own(name: str) -> list[str]:
    return [other for other in imports(name) if other.split(".")[0] == "safenav"]


def layers() -> list[str]:
    """The layers from the top down, as documented."""
    text = (ROOT / "docs" / "architecture.md").read_text()
    listed = re.search(r"```layers\n(.*?)```", text, re.DOTALL)
    assert listed is not None
    return [line.split()[0] for line in listed[1].splitlines()]


def layer_of(name: str) -> str:
    return name.split(".")[1]


def test_every_package_has_its_layer() -> None:
    there = {layer_of(name) for name in MODULES if name != "safenav"}
    assert there <= set(layers())


def test_imports_go_downwards() -> None:
    order = layers()
    height = {name: order.index(layer_of(name)) for name in set(MODULES) - {"safenav"}}
    upwards = [
        f"{name} imports {other}"
        for name in height
        for other in own(name)
        if other != "safenav" and order.index(layer_of(other)) < height[name]
    ]
    assert upwards == []


def test_no_modules_import_each_other() -> None:
    graph = networkx.DiGraph(
        (name, other) for name in MODULES for other in own(name) if "safenav" not in (name, other)
    )
    circles = [sorted(part) for part in networkx.strongly_connected_components(graph)]
    assert [circle for circle in circles if len(circle) > 1] == []


def test_the_members_of_a_package_need_each_other_in_one_direction() -> None:
    """A member is a module or a folder with all that it contains."""
    for package in {name.rpartition(".")[0] for name in MODULES} - {""}:
        start = f"{package}."
        inside = {
            name: start + name.removeprefix(start).split(".")[0]
            for name in MODULES
            if name.startswith(start) and name not in FACES
        }
        graph = networkx.DiGraph(
            (member, inside[other])
            for name, member in inside.items()
            for other in own(name)
            if inside.get(other, member) != member
        )
        circles = [sorted(part) for part in networkx.strongly_connected_components(graph)]
        assert [circle for circle in circles if len(circle) > 1] == []


def test_a_package_s_init_is_a_docstring() -> None:
    faces = {name for name, path in MODULES.items() if path.name == "__init__.py"} - FACES
    assert faces
    for name in faces:
        body = tree(name).body
        assert len(body) == 1 and isinstance(body[0], ast.Expr), name


def test_only_frozen_data_has_undeclared_attributes() -> None:
    """State that changes is declared; ``dict=True`` is for cached properties."""
    loose = []
    for name in MODULES:
        for node in ast.walk(tree(name)):
            if isinstance(node, ast.ClassDef):
                said = {word.arg for word in node.keywords}
                loose += [f"{name}.{node.name}"] if "dict" in said and "frozen" not in said else []
    assert loose == []


BESIDE = ("safenav.judge.",)
"""It shares nothing with what it checks, so it has names of its own for it."""

AS_RECORDED = ("safenav.team.", "safenav.solve.", "safenav.runtime.")
"""Events, states and decisions of a run have the names of the lines that record them."""


def classes(name: str) -> list[str]:
    """The public classes of a module."""
    found = [node.name for node in tree(name).body if isinstance(node, ast.ClassDef)]
    return [cls for cls in found if not cls.startswith("_")]


def test_a_class_has_its_name_to_itself() -> None:
    counted = [name for name in MODULES if not name.startswith((*BESIDE, *AS_RECORDED))]
    times = Counter(cls for name in counted for cls in classes(name))
    assert [cls for cls, count in times.items() if count > 1] == []


@pytest.mark.parametrize("page", ["docs/architecture.md", "docs/glossary.md", "CONTRIBUTING.md"])
def test_pages_name_files_that_exist(page: str) -> None:
    text = (ROOT / page).read_text()
    named = set(re.findall(r"`([\w./]+\.(?:py|cpp|hpp|md|json))`", text))
    named |= set(re.findall(r"`((?:safenav/)?\w+(?:/\w+)*/)`", text))
    inside = ("spec", "team", "solve", "plan", "runtime", "runtime/control", "runtime/run")
    places = [ROOT, PACKAGE, ROOT / "slugs/src/command"]
    places += [PACKAGE / folder for folder in inside]
    named -= {"safenav/cli/NAME.py"}
    missing = [name for name in named if not any((place / name).exists() for place in places)]
    assert missing == []
