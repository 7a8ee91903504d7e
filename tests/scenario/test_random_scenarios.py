"""Random scenarios load as they were meant; whatever else is given ends in an InputError."""

import string
from contextlib import suppress
from copy import deepcopy
from typing import Any

import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from safenav.errors import InputError
from safenav.scenario.model import Scenario
from safenav.scenario.objective import to_data
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.yaml.document import plain, read_document
from safenav.world.map import RegionMap
from scenario.mistakes import places
from scenario.test_schema import FULL

words = st.text(alphabet=string.ascii_letters + "ü -", min_size=1, max_size=8).filter(
    lambda word: word.strip() == word
)
data = st.recursive(
    st.none() | st.booleans() | st.integers(-99, 99) | words,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(words, inner, max_size=4),
    max_leaves=12,
)


@given(data.filter(lambda value: value is not None), st.booleans())
def test_dumped_data_reads_back(value: object, flow: bool) -> None:
    text = yaml.safe_dump(value, default_flow_style=flow, allow_unicode=True)
    assert plain(read_document(text).root) == value


@st.composite
def scenarios(draw: st.DrawFn) -> dict[str, Any]:
    """A valid scenario as data: one open room with walls at its edge, robots that fly."""
    rows, cols = draw(st.integers(1, 5)), draw(st.integers(2, 5))
    edge = "#" * (cols + 2)
    grid = [edge, *(["#" + "." * cols + "#"] * rows), edge]
    world = RegionMap.from_grid(grid)
    regions = st.sampled_from(world.free)

    def written(region: int) -> object:
        return draw(st.sampled_from([region, list(world.position(region)), f"place{region}"]))

    def target() -> object:
        if draw(st.booleans()):
            return written(draw(regions))
        return {"any": [written(r) for r in draw(st.lists(regions, min_size=1, max_size=3))]}

    def objective() -> dict[str, object]:
        kind = draw(st.sampled_from(["patrol", "visit", "cover", "hold", "ltl"]))
        if kind == "patrol":
            return {kind: [written(r) for r in draw(st.permutations(world.free))[:2]]}
        if kind == "hold":
            return {kind: target()}
        if kind == "ltl":
            goal = f"region = {draw(regions)} | region' = place{draw(regions)}"
            return {kind: {"liveness": [goal], "safety": "TRUE"}}
        return {kind: [target() for _ in range(draw(st.integers(1, 3)))]}

    starts = draw(st.lists(regions, min_size=1, max_size=3, unique=True))
    robots = {
        f"robot{i}": {"model": "quadcopter", "start": written(start), "objective": objective()}
        for i, start in enumerate(starts)
    }
    hidden = draw(st.lists(regions, max_size=3, unique=True))
    obstacles = [
        {"type": "uncertainty", "region": written(r), "traversable": draw(st.booleans())}
        for r in hidden
    ]
    return {
        "safenav": 1,
        "map": {"grid": grid, "names": {f"place{r}": r for r in world.free}},
        "robots": robots,
        "obstacles": obstacles,
        "until": {"rounds": draw(st.integers(1, 5))},
        "seed": draw(st.integers(0, 10**6)),
        "expect": {"resolved": [f"uncertainty@{r}" for r in hidden]},
    }


@given(scenarios())
def test_random_scenarios_load_as_meant(given_data: dict[str, Any]) -> None:
    scenario = load_scenario_text(yaml.safe_dump(given_data, sort_keys=False))
    assert scenario.map.grid_rows() == given_data["map"]["grid"]
    assert [robot.name for robot in scenario.robots] == list(given_data["robots"])
    for robot in scenario.robots:
        item = given_data["robots"][robot.name]
        names = given_data["map"]["names"]
        start = item["start"]
        expected = (
            names.get(start, start)
            if not isinstance(start, list)
            else (scenario.map.region(*start))
        )
        assert robot.start.region == expected
        assert list(to_data(robot.objective)) == list(item["objective"])
    assert scenario.expect.resolved == frozenset(o.name for o in scenario.obstacles)
    assert [o.traversable for o in scenario.obstacles] == [
        o["traversable"] for o in given_data["obstacles"]
    ]


SNIPPETS = [
    *"[]{}:,#'\"|>&*!-?%@` \n\t.~=0123456789",
    *("\n  ", "- ", ": ", "''", "!!python/object:os.system ", "&a ", "*a", "*door", "<<: *door"),
    *("true", "null", ".nan", "-.inf", "1e999", "9" * 30, "0x", "--- ", "...", "é", "\x00"),
    *("\ud800", "\u2028", "[8, 9]", "{any: 7}", "next(", "robots", "region", "\ufeff", "\r"),
]


def load_or_refuse(text: str) -> Scenario | None:
    try:
        return load_scenario_text(text, "mutated.yaml")
    except InputError as error:
        for diagnostic in error.diagnostics:
            assert diagnostic.found, "a refusal says why"
            assert diagnostic.line <= text.count("\n") + text.count("\r") + 3
        assert error.diagnostics
        return None


edits = st.lists(
    st.tuples(st.integers(0, len(FULL)), st.integers(0, 12), st.sampled_from(["", *SNIPPETS])),
    min_size=1,
    max_size=4,
)


@settings(max_examples=600)
@given(edits)
def test_any_damage_to_the_text_gives_a_scenario_or_an_input_error(
    changes: list[tuple[int, int, str]],
) -> None:
    text = FULL
    for place, removed, added in changes:
        text = text[:place] + added + text[place + removed :]
    load_or_refuse(text)


PLAIN = plain(read_document(FULL).root)
DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


@settings(max_examples=400)
@given(st.lists(st.tuples(st.sampled_from([*places(PLAIN)]), data), min_size=1, max_size=3))
def test_any_value_in_any_place_gives_a_scenario_or_an_input_error(
    changes: list[tuple[tuple[Any, ...], Any]],
) -> None:
    scenario = deepcopy(PLAIN)
    for path, value in changes:
        parent = scenario
        with suppress(KeyError, IndexError, TypeError):  # an earlier change took the place away
            for key in path[:-1]:
                parent = parent[key]
            parent[path[-1]] = value
    load_or_refuse(yaml.dump(scenario, Dumper=DUMPER, sort_keys=False, allow_unicode=True))


@settings(max_examples=200)
@given(st.text(max_size=200))
def test_any_text_at_all_gives_a_scenario_or_an_input_error(text: str) -> None:
    load_or_refuse(text)
