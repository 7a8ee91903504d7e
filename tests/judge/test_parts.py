"""Parts of the judge: what it refuses to read; formulas and line of sight agree with the reference;
it shares only strict_json with what it judges, and documents its rules."""

import ast
import random
import sys
from pathlib import Path

import pytest

import safenav.judge
from safenav import RegionMap
from safenav.judge.bundle.strategies import sees
from safenav.judge.engine import FACTS
from safenav.judge.formulas import Formulas, UnreadError
from safenav.judge.lines import NotATraceError, Objective, Reader
from safenav.judge.world import World
from safenav.scenario.objective import KINDS
from safenav.world.sight import visible_from
from support.damage import GOOD, Edit, damage, find, text
from traces.test_reader import CASES, NOT_TRACES


@pytest.mark.parametrize(
    ("formula", "holds"),
    [
        ("region = 3", True),
        ("region' = 3", False),
        ("next(region = 4)", True),
        ("!region = 3", False),
        ("region = 3 -> region' = 4", True),
        ("region = 3 -> region' = 3", False),
        ("region = 9 -> region = 3 -> FALSE", False),
        ("region = 1 | region = 3 & region' != 3", True),
        ("region = 3 ^ region = 3 | TRUE", False),
        ("region = 3 <-> region < 7 && TRUE", True),
        ("FALSE <-> TRUE -> TRUE", False),
        ("region + 1 = region'", True),
        ("region + 1 + 1 <= region'", False),
        ("~(region >= 4) /\\ region < 4 --> X(region > 3)", True),
        ("region =", None),
        ("region = door", None),
        ("region = 3 region", None),
        ("region % 2", None),
    ],
)
def test_formulas_have_the_listed_values_or_are_refused(formula: str, holds: bool | None) -> None:
    """At a step from 3 to 4; None: it is not understood."""
    if holds is None:
        with pytest.raises(UnreadError):
            Formulas({"safety": [formula]})
    else:
        assert Formulas({"safety": [formula]}).allows((3, None), (4, None)) is holds


def test_formulas_read_and_update_their_memory() -> None:
    """It may go to 5 only once it has seen 1, and forgets that there."""
    seen = "seen' <-> (seen & region' != 5 | region' = 1)"
    rules = Formulas({"memory": {"seen": "bool"}, "safety": [seen, "region' = 5 -> seen"]})
    known, at = {0}, 3
    for to, possible in ((2, {0}), (1, {1}), (4, {1}), (5, {0}), (4, {0}), (5, set[int]())):
        known, at = rules.after(known, (at, None), (to, None)), to
        assert known == possible


@pytest.mark.parametrize("seed", range(30))
def test_visibility_agrees_with_the_reference_on_random_maps(seed: int) -> None:
    """The judge's own, and the one that specifications are written from."""
    rng = random.Random(seed)
    rows, cols = rng.randint(1, 7), rng.randint(2, 7)
    cells = ["#" if rng.random() < 0.2 else "." for _ in range(rows * cols)]
    cells[rng.randrange(rows * cols)] = "."
    world = RegionMap.from_grid(["".join(cells[k * cols :][:cols]) for k in range(rows)])
    grid, free = World(rows, cols, world.walls), sorted(world.free)
    closed = frozenset(rng.sample(free, min(len(free), rng.randint(0, 3))))
    radius = rng.choice([None, 1, 1.5, 2, 3, 4.2])
    visibility = visible_from(world, radius, closed)
    for one in free:
        for other in free:
            visible = bool(visibility.mask(one) >> other & 1)
            assert sees(grid, one, other, radius, closed) == visible


@pytest.mark.parametrize(("who", "name", "words", "edits"), CASES)
def test_the_judge_also_refuses_traces_that_readers_refuse(
    who: str, name: str, words: str, edits: list[Edit]
) -> None:
    """Its copy in a bundle has no other reader; the values that it does not read may be wrong."""
    lines = damage(GOOD[name](), edits)
    line = find(lines, *edits[0]["line"]) + 1
    if who != "by the reader alone":
        with pytest.raises(NotATraceError, match=rf"^line {line}: .*{words * ('alone' in who)}"):
            list(Reader().lines(text(lines)))


@pytest.mark.parametrize(("lines", "line", "words"), NOT_TRACES)
def test_the_judge_also_refuses_files_that_are_not_a_trace(
    lines: list[str], line: int, words: str
) -> None:
    del line, words
    with pytest.raises(NotATraceError):
        list(Reader().lines("\n".join(lines).splitlines(keepends=True)))


JUDGE = Path(safenav.judge.__file__).parent


@pytest.mark.parametrize("file", sorted(JUDGE.rglob("*.py")), ids=str)
def test_the_judge_needs_python_alone(file: Path) -> None:
    """Apart from ``strict_json``, which does too. That no module runs text: ``architecture``."""
    for node in ast.walk(ast.parse(file.read_text())):
        assert not isinstance(node, ast.ImportFrom) or (node.module and not node.level)
        names = [node.module] if isinstance(node, ast.ImportFrom) else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        for name in filter(None, names):
            own = name.startswith("safenav.judge.") or name == "safenav.strict_json"
            assert own or name.split(".")[0] in sys.stdlib_module_names - {"importlib"}, name


def test_each_rule_states_its_requirement_as_the_page_does() -> None:
    names = [rule.name for rule in FACTS]
    assert len({*names}) == len(names)
    assert all(rule.text.endswith(".") and len(rule.text.split()) >= 5 for rule in FACTS)
    page = (Path(__file__).parents[2] / "docs" / "judge.md").read_text()
    table = page.partition("## Rules")[2].partition("## Limits")[0]
    rows = [line for line in table.splitlines() if line.startswith("| `")]
    assert rows == [f"| `{rule.name}` | {rule.text} |" for rule in FACTS]


def test_a_rule_has_no_memory_and_changes_no_state() -> None:
    """A rule assigns only local names, and to no part of the state."""
    for file in (JUDGE / f"{name}.py" for name in ("rules", "changes", "ends")):
        for node in ast.walk(ast.parse(file.read_text())):
            targets = node.targets if isinstance(node, ast.Assign) else []
            targets = [node.target] if isinstance(node, ast.AugAssign) else targets
            assert not any(isinstance(t, ast.Attribute | ast.Subscript) for t in targets), file.name
            assert not isinstance(node, ast.Global | ast.Nonlocal), file.name


def test_the_judge_knows_all_kinds_of_objectives() -> None:
    """It was written independently, but it must say the same."""
    for key, kind in KINDS.items():
        own = Objective(kind=key)
        told = (kind.in_turn, kind.settles, kind.one, kind.strict)
        assert (own.in_turn, own.settles, own.settles > own.ends, own.strict) == told, key
