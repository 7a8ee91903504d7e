"""A class with methods that one other file uses has a reason, listed in docs/architecture.md."""

import ast
import re
from collections.abc import Iterator

from architecture.test_layers import BESIDE, MODULES, ROOT, own, tree


def with_methods(name: str) -> Iterator[str]:
    """The public classes of a module that have more than special methods."""
    for node in tree(name).body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            methods = [each.name for each in node.body if isinstance(each, ast.FunctionDef)]
            if any(not each.startswith("__") or each == "__call__" for each in methods):
                yield node.name


def used(name: str) -> set[str]:
    """The words of a module's code."""
    text = re.sub(r'""".*?"""|#[^\n]*', "", MODULES[name].read_text(), flags=re.DOTALL)
    return {*re.findall(r"\w+", text)}


def test_classes_with_one_user_are_listed() -> None:
    counted = [name for name in MODULES if not name.startswith(BESIDE)]
    importers: dict[str, list[str]] = {name: [] for name in MODULES}
    for name in counted:
        for other in {*own(name)}:
            importers[other].append(name)
    names = {name: used(name) for name in MODULES}
    single = {
        cls
        for name in counted
        for cls in with_methods(name)
        if sum(cls in names[user] for user in importers[name]) == 1
    }
    text = (ROOT / "docs" / "architecture.md").read_text()
    table = re.search(r"## Classes with one user\n(.*?)\n## ", text, re.DOTALL)
    assert table is not None
    assert {*re.findall(r"`(\w+)`", table[1])} == single
