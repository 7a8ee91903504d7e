"""Imports go downwards only, in the order of docs/architecture.md, and no text becomes code."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import networkx
import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "safenav"
FACES = {"safenav", "safenav.cli"}
"""The library's face re-exports; the command line's lists its commands."""
PROGRAMS = [
    p for folder in ("benchmarks", "docs", "packaging") for p in (ROOT / folder).rglob("*.py")
]


def modules() -> dict[str, Path]:
    """Return every module of the package by its dotted name."""
    found = {}
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


MODULES = modules()


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def nodes(name: str) -> Iterator[ast.AST]:
    return ast.walk(tree(MODULES[name]))


@cache
def own(name: str) -> list[str]:
    """Return the modules of safenav that a module imports anywhere in its text."""
    found = []
    for node in nodes(name):
        if isinstance(node, ast.ImportFrom) and node.module:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            found += [one if one in MODULES else node.module for one in inner]
        elif isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
    return [one for one in found if one.split(".")[0] == "safenav"]


def layers() -> list[str]:
    """The layers from the top down, as documented."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    listed = re.search(r"```layers\n(.*?)```", text, re.DOTALL)
    assert listed is not None
    return [line.split()[0] for line in listed[1].splitlines()]


def test_imports_go_downwards_between_packages_and_inside_them() -> None:
    order = layers()
    height = {name: order.index(name.split(".")[1]) for name in MODULES if name != "safenav"}
    upwards = [
        f"{name} imports {other}"
        for name in height
        for other in own(name)
        if other != "safenav" and height[other] < height[name]
    ]
    assert upwards == []
    # Inside a package the members, modules or folders, need each other in one direction.
    for start in {f"{name.rpartition('.')[0]}." for name in MODULES} - {"."}:
        inside = {
            name: start + name.removeprefix(start).split(".")[0]
            for name in MODULES
            if name.startswith(start) and name not in FACES
        }
        edges = ((inside[one], inside.get(two)) for one in inside for two in own(one))
        needs = networkx.DiGraph((one, two) for one, two in edges if two not in (None, one))
        assert networkx.is_directed_acyclic_graph(needs), networkx.find_cycle(needs)


def test_report_modules_neither_import_records_nor_read_the_clock() -> None:
    """They stand on the run model, which alone knows records and the clock of a run."""
    views = [name for name in MODULES if name.startswith("safenav.report.")]
    assert views
    assert [name for name in views if "safenav.trace.records" in own(name)] == []
    branches = re.compile(r"\bclock (is|==)|\bseconds (is|==) ")
    clocks = [n for n in views if branches.search(MODULES[n].read_text(encoding="utf-8"))]
    assert clocks == []


MODEL = ("safenav.team.", "safenav.solve.", "safenav.plan.", "safenav.runtime.")
HOMES = ("scenario.objective", "scenario.model", "world.poses", "team.battery", "team.formulas")
"""Where the types of features are defined: objectives, needs, mobilities, batteries."""


def test_no_model_code_tests_the_type_of_a_scenario_value() -> None:
    """A feature is data or a method of its value. The page lists the exceptions."""
    classes = (n for home in HOMES for n in nodes(f"safenav.{home}"))
    types = {node.name for node in classes if isinstance(node, ast.ClassDef)}
    asked = {
        (name, word)
        for name in MODULES
        if name.startswith(MODEL)
        for node in nodes(name)
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "isinstance"
        for word in re.findall(r"\w+", ast.unparse(node.args[1]))
        if word in types
    }
    assert asked == {("safenav.runtime.run.mission", "Scenario")}


PAGES = ["docs/architecture.md", "docs/glossary.md", "docs/paper.md", "CONTRIBUTING.md"]


@pytest.mark.parametrize("page", PAGES)
def test_pages_name_files_that_exist(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    named = set(re.findall(r"`([\w./]+\.(?:py|cpp|hpp|md|json))`", text))
    named |= set(re.findall(r"`((?:safenav/)?\w+(?:/\w+)*/)`", text))
    named |= set(re.findall(r"`((?:safenav|tests|scenarios|slugs)/[\w/.]+)`", text))
    inside = ("spec", "team", "solve", "plan", "runtime", "runtime/control", "runtime/run")
    places = [ROOT, PACKAGE, ROOT / "slugs/src/command", *(PACKAGE / each for each in inside)]
    named -= {"safenav/cli/NAME.py", "build/paper/"}
    assert [name for name in named if not any((place / name).exists() for place in places)] == []


def test_programs_outside_the_package_import_names_that_exist() -> None:
    """No other test runs all of them, so a moved module would break them unnoticed."""
    for program in PROGRAMS:
        for node in ast.walk(tree(program)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "safenav":
                module = import_module(str(node.module))
                for name in (alias.name for alias in node.names):
                    there = hasattr(module, name) or find_spec(f"{node.module}.{name}")
                    assert there, f"{program}, line {node.lineno}: {node.module} has no {name}"


PATH = ("scenario.language", "scenario.model", "spec.compile", "synthesis.slugs", "trace.records")
MOST_ON_PATH = 26


def test_a_run_from_scenario_to_trace_loads_few_modules() -> None:
    """Packages are not counted: their ``__init__`` is a docstring."""
    program = f"import sys, {', '.join(f'safenav.{each}' for each in PATH)}\n"
    program += "print(*(n for n, m in sys.modules.items() if not hasattr(m, '__path__')))"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    own = [name for name in loaded.stdout.decode().split() if name.startswith("safenav")]
    assert len(own) <= MOST_ON_PATH, own


FORBIDDEN = {
    *("eval", "exec", "compile", "__import__", "builtins.eval", "builtins.exec"),
    *("importlib.__import__", "importlib.reload", "code.interact"),
    *("types.FunctionType", "types.CodeType", "os.system", "os.popen"),
    *("yaml.load_all", "yaml.unsafe_load", "yaml.full_load", "yaml.unsafe_load_all"),
}
OF_A_TABLE = {"safenav": "homes[name]", "safenav.cli.options": "f'safenav.cli.{COMMANDS[name][0]}'"}
"""Modules that import by a name: one of a table in the same module."""
SAFE = {"_LOADER", "yaml.CSafeLoader", "yaml.SafeLoader"}
"""Loaders of YAML that make plain data only."""
NEW_CODE = {"pickle", "marshal", "shelve", "runpy", "dill", "cloudpickle", "imp", "codeop"}


def test_no_module_evaluates_text_or_imports_a_name_from_a_file() -> None:
    for name in MODULES:
        for node in nodes(name):
            if isinstance(node, ast.Import):
                assert not {alias.name.split(".")[0] for alias in node.names} & NEW_CODE, name
            if isinstance(node, ast.ImportFrom):
                assert (node.module or "").split(".")[0] not in NEW_CODE, name
            if not isinstance(node, ast.Call):
                continue
            word, place = ast.unparse(node.func), f"{MODULES[name]}:{node.lineno}"
            assert word not in FORBIDDEN, f"{place}: {word}"
            assert not any(each.arg == "shell" for each in node.keywords), f"{place}: a shell"
            if word.endswith("import_module") and not isinstance(node.args[0], ast.Constant):
                assert ast.unparse(node.args[0]) == OF_A_TABLE.get(name), f"{place}: import by name"
            if word in ("yaml.load", "yaml.parse", "yaml.compose", "yaml.scan"):
                loader = {ast.unparse(each.value) for each in node.keywords if each.arg == "Loader"}
                assert loader and loader <= SAFE, f"{place}: {word}"
