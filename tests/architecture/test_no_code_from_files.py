"""No text becomes code: nothing is evaluated, and no module has a name that a file could give."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from architecture.test_layers import MODULES, tree

FORBIDDEN = {
    *("eval", "exec", "compile", "__import__", "builtins.eval", "builtins.exec"),
    *("importlib.__import__", "importlib.reload", "runpy.run_path", "runpy.run_module"),
    *("code.interact", "marshal.loads", "marshal.load", "types.FunctionType", "types.CodeType"),
    *("pickle.loads", "pickle.load", "pickle.Unpickler", "shelve.open", "os.system", "os.popen"),
    *("yaml.load_all", "yaml.unsafe_load", "yaml.full_load", "yaml.unsafe_load_all"),
}
IMPORTS = {"importlib.import_module", "import_module"}
OF_A_TABLE = {
    "safenav": "_HOMES[name]",
    "safenav.cli": "f'safenav.cli.{ELSEWHERE.get(name, name)}'",
    "safenav.motion.mover": "module",
}
"""Modules that import by a name: one of a table in the same module."""
SAFE = {"_LOADER", "yaml.CSafeLoader", "yaml.SafeLoader"}
"""Loaders of YAML that make plain data only."""
NEW_CODE = ("pickle", "marshal", "shelve", "runpy", "dill", "cloudpickle", "imp", "codeop")


def calls(module: ast.Module) -> Iterator[tuple[str, ast.Call]]:
    for node in ast.walk(module):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node


def test_the_tables_are_up_to_date() -> None:
    for name, argument in OF_A_TABLE.items():
        given = {ast.unparse(call.args[0]) for word, call in calls(tree(name)) if word in IMPORTS}
        assert argument in given, name


@pytest.mark.parametrize("name", sorted(MODULES))
def test_a_module_runs_no_text_and_imports_by_no_name(name: str) -> None:
    for word, call in calls(tree(name)):
        place = f"{MODULES[name]}:{call.lineno}"
        assert word not in FORBIDDEN, f"{place}: {word}"
        if word in IMPORTS and not isinstance(call.args[0], ast.Constant):
            assert ast.unparse(call.args[0]) == OF_A_TABLE.get(name), f"{place}: import by name"
        assert not any(each.arg == "shell" for each in call.keywords), f"{place}: a shell"
        if word in ("yaml.load", "yaml.parse", "yaml.compose", "yaml.scan"):
            loader = {ast.unparse(each.value) for each in call.keywords if each.arg == "Loader"}
            safe = loader and loader <= SAFE
            assert safe or _is_round_trip(MODULES[name]), f"{place}: {word} without a safe loader"


@pytest.mark.parametrize("name", sorted(MODULES))
def test_a_module_uses_no_library_that_makes_code_of_data(name: str) -> None:
    for node in ast.walk(tree(name)):
        if isinstance(node, ast.Import):
            assert not {alias.name.split(".")[0] for alias in node.names} & {*NEW_CODE}
        if isinstance(node, ast.ImportFrom):
            assert (node.module or "").split(".")[0] not in NEW_CODE


def _is_round_trip(path: Path) -> bool:
    """Whether ``yaml`` is an object of ruamel, whose round-trip loader makes plain data only."""
    text = path.read_text()
    return "YAML(" in text and "import yaml" not in text
