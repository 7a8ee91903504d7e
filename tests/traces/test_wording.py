"""Every trace line of an event has one sentence, the same in all outputs."""

from collections.abc import Sequence

import pytest
from msgspec.structs import replace

from safenav.outcome import Verdict
from safenav.trace import records, vocabulary
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.records import KINDS
from safenav.trace.wording import Wording, syntheses_words
from safenav.trace.words import shortened
from traces.examples import examples

SILENT = {"header", "move", "backtrack", "belief", "checkpoint", "discovered"}
"""What happens in every tick, or belongs to another line's sentence."""


@pytest.mark.parametrize("seed", range(10))
def test_every_event_has_one_sentence(seed: int) -> None:
    told = set()
    for record in examples(seed):
        if record.type in SILENT:
            with pytest.raises(TypeError, match="is not an event"):
                Wording().sentence(record)
            continue
        sentence = Wording().sentence(record)
        assert sentence and "\n" not in sentence and not sentence.endswith(".")
        assert "None" not in sentence
        told.add(record.type)
    assert told == set(KINDS) - SILENT


@pytest.mark.parametrize("reason", vocabulary.Reason)
def test_every_reason_of_a_synthesis_has_its_words(reason: vocabulary.Reason) -> None:
    objective = TracedObjective.of({"hold": 4})
    assert objective is not None
    verdict = Verdict.REALIZABLE
    line = records.Synthesis(
        1, "quad", reason, verdict, 0.002, 21, False, True, "0" * 64, "0" * 64, objective
    )
    sentence = Wording().sentence(line)
    assert sentence.startswith("synthesis for quad ")
    assert sentence.endswith(": 21 states in 2 ms, verified")


@pytest.mark.parametrize(
    ("sizes", "cached", "verified", "told"),
    [
        (range(1, 14), 0, True, "13 strategies (1 to 13 states, verified)"),
        (range(1, 14), 2, True, "13 strategies (1 to 13 states, 2 from the cache, verified)"),
        (range(1, 14), 13, True, "13 strategies (1 to 13 states, all from the cache, verified)"),
        (range(1, 14), 0, False, None),
        (range(1, 9), 0, True, None),
    ],
)
def test_many_strategies_share_one_sentence(
    sizes: range, cached: int, verified: bool, told: str | None
) -> None:
    objective = TracedObjective.of({"hold": 4})
    assert objective is not None
    line = records.Synthesis(
        *(1, "quad", vocabulary.Reason.INITIAL, Verdict.REALIZABLE, 0.002, 21, False, verified),
        *("0" * 64, "0" * 64, objective),
    )
    lines = [replace(line, states=n, cached=k < cached) for k, n in enumerate(sizes)]
    assert syntheses_words(lines) == told


@pytest.mark.parametrize(
    ("rule", "told"),
    [
        ("never beside it (a, b, c)", "never beside it (a, b, c)"),
        ("never beside it", "never beside it"),
        (
            f"never beside it ({', '.join(map(str, range(20)))})",
            "never beside it (0, 1, 2 and 17 others)",
        ),
        ("it shares its floor with a, b", "it shares its floor with a, b"),
        (
            f"it shares its floor with {', '.join(map(str, range(20)))}",
            "it shares its floor with 0, 1, 2 and 17 others",
        ),
    ],
)
def test_a_line_names_few_robots(rule: str, told: str) -> None:
    assert shortened(rule) == told


def test_an_obstacle_in_the_way_of_many_names_few_of_them() -> None:
    names = frozenset(f"r{number}" for number in range(12))
    line = records.KnownObstacle(1, "spill@4", names, vocabulary.BlockReason.NO_CAPABLE_ROBOT)
    told = Wording().sentence(line)
    assert told.startswith("spill@4 permanently blocks r0, r1, r2 and 9 others: ")


@pytest.mark.parametrize("reason", vocabulary.BlockReason)
def test_every_reason_to_block_has_its_words(reason: vocabulary.BlockReason) -> None:
    line = records.KnownObstacle(1, "door@47", frozenset({"quad", "digit"}), reason)
    assert Wording().sentence(line).startswith("door@47 permanently blocks digit and quad: ")


@pytest.mark.parametrize(
    ("numbers", "team", "told"),
    [
        ((10, 2), None, "rover_2 and rover_10"),
        ((2, 0, 1), 3, "rover_0, rover_1 and rover_2"),
        (range(12), 12, "all 12 robots"),
        ((11, 9, 10, 0, 1), 12, "rover_0, rover_1, rover_9, rover_10 and rover_11"),
    ],
    ids=["as people sort", "a small team", "all of a large one", "some of a large one"],
)
def test_robots_that_something_is_blocked_for(
    numbers: Sequence[int], team: int | None, told: str
) -> None:
    names = frozenset(f"rover_{number}" for number in numbers)
    line = records.KnownObstacle(1, "door@47", names, vocabulary.BlockReason.UNRESOLVABLE)
    assert f" permanently blocks {told}: " in Wording(team=team).sentence(line)


def test_the_wording_of_an_obstacle_that_blocks_no_robot_is_unresolved() -> None:
    line = records.KnownObstacle(1, "parcel@6", frozenset(), vocabulary.BlockReason.UNRESOLVABLE)
    assert Wording().sentence(line).startswith("parcel@6 stays unresolved: ")


def test_regions_and_robots_are_shown_by_the_given_functions() -> None:
    names = {46: "gate", 47: "dock"}
    wording = Wording(
        word=lambda region: names.get(region, str(region)),
        place=lambda region: f"{names[region]} {region}",
        robot=str.upper,
        strong=lambda word: f"*{word}*",
    )
    violation = records.Violation(3, "quad", 46, 47, "door@47", "push")
    told = "QUAD at gate 46 finds *a door* at dock 47 and keeps out: it lacks 'push'"
    assert wording.sentence(violation) == told
    request = records.Request(3, "door@47", "quad", {"digit": 1, "rover": None}, "digit", (47,))
    told = "QUAD requests help with door@dock: digit needs 1 tick, rover cannot come"
    assert wording.sentence(request) == f"{told}; DIGIT helps"
    live = replace(request, t=3.5)  # ticks of the slowest step are no time there
    assert "digit bids 1, rover cannot come" in wording.sentence(live)
    failed = replace(request, because="rover has failed")
    assert wording.sentence(failed).endswith("; DIGIT helps, since rover has failed")
    second = records.Request(3, "door@47", "quad", {"digit": 1}, "digit", (47,), need=1)
    assert wording.sentence(second).startswith("QUAD requests help with door@dock (need 2): ")
    met = records.Met(5, "door@47", 0, "sense", "quad", 46)
    assert wording.sentence(met) == "QUAD at gate 46 fulfils need 1 of *door@dock*: sense"
    both = records.Resolved(5, "beam@47", "digit", 46, False, None, robots=("digit", "rover"))
    assert wording.sentence(both) == (
        "DIGIT at gate 46 resolves *beam@dock* with ROVER (without a request)"
    )
    several = replace(wording, actions={"beam@47": ["sense", "lift"]})  # rover has sensed
    told = "DIGIT at gate 46 resolves *beam@dock* (without a request)"
    assert several.sentence(both) == told
